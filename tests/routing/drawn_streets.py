"""A map of straight streets drawn in a test, at 46° N 8° E."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from routing.graph.earth import great_circle_m
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

STEP = 100_000  # 1e-7 degrees: about a kilometre
SOUTH, WEST = 46.0, 8.0


def drawn_streets(
    name: str,
    places: Sequence[tuple[float, float]],
    links: Sequence[tuple[int, int]],
    heights_m: ArrayLike,
    *,
    speed_limit_mps: NDArray[np.float64],
    cross: NDArray[np.int64],
    detour: ArrayLike = 1.0,
    terrain: Terrain = Terrain.SYNTHETIC,
) -> RoadGraph:
    """A graph of links between places, STEPs east and north; a link is detour times as long as it looks."""
    lon, lat = (np.rint((np.array(places) * STEP).T + np.array([[WEST], [SOUTH]]) * 1e7)).astype(np.int64)
    tail, head = (np.array(side, np.int32) for side in zip(*links, strict=True))
    n = len(links)
    corners = np.column_stack((tail, head)).ravel()
    straight_m = np.asarray(great_circle_m(lat[tail] / 1e7, lon[tail] / 1e7, lat[head] / 1e7, lon[head] / 1e7))
    return assemble_graph(
        GraphMeta(name, "test", "none", "none", terrain, "drawn", 0.0, (0.0,) * 4),
        ("Street",),
        LooseNodes(lat / 1e7, lon / 1e7, np.array(heights_m), np.arange(len(places))),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=straight_m * detour,
            speed_limit_mps=speed_limit_mps,
            functional_class=np.full(n, 5, np.int8),
            cross=cross.astype(np.int8),
            urban=np.ones(n, bool),
            structure=np.zeros(n, bool),
            way_id=np.arange(n),
            name_idx=np.zeros(n, np.int32),
            geometry_first=np.arange(n + 1) * 2,
            geometry_lon_e7=lon[corners].astype(np.int32),
            geometry_lat_e7=lat[corners].astype(np.int32),
            forbidden_turns=np.empty((0, 2), np.int64),
        ),
    )
