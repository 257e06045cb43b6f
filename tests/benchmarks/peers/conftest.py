"""A drawn graph for the benchmark's parts."""

from __future__ import annotations

import numpy as np
import pytest

from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph

# 2 at 0.02° N       at the equator, a degree is 111 195 m either way; the link from 0 to 1 goes east and then north,
# |                  the one from 0 to 2 straight to the north, over 20 m of climb
# |     1 at 0.01° N, 0.01° E
# 0 --- ^
PLACES_DEG = [(0.0, 0.0), (0.01, 0.01), (0.02, 0.0)]
HEIGHTS_M = [100.0, 100.0, 120.0]
LINES_DEG = {
    (0, 1): [(0.0, 0.0), (0.0, 0.01), (0.01, 0.01)],
    (0, 2): [(0.0, 0.0), (0.02, 0.0)],
    (1, 0): [(0.01, 0.01), (0.0, 0.01), (0.0, 0.0)],
    (2, 0): [(0.02, 0.0), (0.0, 0.0)],
}
LENGTH_M = 2000.0


@pytest.fixture(scope="session")
def corner() -> RoadGraph:
    """Three nodes and four links of 2 km."""
    tail, head = (np.array(side, np.int32) for side in zip(*LINES_DEG, strict=True))
    n = len(LINES_DEG)
    points = np.array([point for line in LINES_DEG.values() for point in line])
    lat, lon = np.array(PLACES_DEG).T
    return assemble_graph(
        GraphMeta("corner", "test", "none", "none", Terrain.SYNTHETIC, "drawn", 0.0, (0.0,) * 4),
        ("",),
        LooseNodes(lat.copy(), lon.copy(), np.array(HEIGHTS_M), np.arange(3)),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=np.full(n, LENGTH_M),
            speed_limit_mps=np.full(n, 25.0),
            functional_class=np.full(n, 6, np.int8),
            cross=np.zeros(n, np.int8),
            urban=np.zeros(n, bool),
            structure=np.zeros(n, bool),
            way_id=np.arange(n),
            name_idx=np.zeros(n, np.int32),
            geometry_first=np.concatenate(([0], np.cumsum([len(line) for line in LINES_DEG.values()]))),
            geometry_lon_e7=np.rint(points[:, 1] * 1e7).astype(np.int32),
            geometry_lat_e7=np.rint(points[:, 0] * 1e7).astype(np.int32),
            forbidden_turns=np.empty((0, 2), np.int64),
        ),
    )
