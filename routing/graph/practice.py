"""A block of four streets on which kernels are compiled before a real graph is asked."""

from __future__ import annotations

import numpy as np

from routing.graph.earth import E7, great_circle_m
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph


def practice_graph() -> RoadGraph:
    """Four nodes on a hillside with streets both ways around them, 8 links; arrays are of the types of any graph."""
    lat, lon = np.array((0.0, 0.0, 0.002, 0.002)), np.array((0.0, 0.002, 0.002, 0.0))
    ahead = np.arange(4)
    tail, head = np.concatenate((ahead, (ahead + 1) % 4)), np.concatenate(((ahead + 1) % 4, ahead))
    ends = np.column_stack((tail, head)).ravel()
    same = np.zeros(tail.size, np.int8)
    links = LooseLinks(
        tail=tail.astype(np.int32),
        head=head.astype(np.int32),
        length_m=great_circle_m(lat[tail], lon[tail], lat[head], lon[head]),
        speed_limit_mps=np.full(tail.size, 50.0 / 3.6),
        functional_class=same,
        cross=same,
        urban=same.astype(bool),
        structure=same.astype(bool),
        way_id=ahead.repeat(2),
        name_idx=same.astype(np.int32),
        geometry_first=2 * np.arange(tail.size + 1),
        geometry_lon_e7=np.rint(lon[ends] * E7).astype(np.int32),
        geometry_lat_e7=np.rint(lat[ends] * E7).astype(np.int32),
        forbidden_turns=np.empty((0, 2), np.int64),
    )
    nodes = LooseNodes(lat, lon, np.array((0.0, 5.0, 9.0, 4.0)), np.arange(4))
    meta = GraphMeta("practice", "drawn", "none", "none", Terrain.SYNTHETIC, "drawn", 0.0, (0.0, 0.0, 0.0, 0.0))
    return assemble_graph(meta, ("",), nodes, links)
