"""Maps that recordings are matched to: one drawn here, one bundled."""

from __future__ import annotations

from pathlib import Path

import pytest

from routing.graph.files import load_graph
from routing.planner import Planner
from tests.diagnosis.map_drives import streets

GRAPHS = Path(__file__).parents[3] / "data/graphs"

# 7 --- 8 --- 9 -- 10     streets 200 m apart, all two-way but 13 → 14 and 15 → 16: two carriageways 12 m apart, the
# |     |     |     |     southern one to the east, joined to the grid at their ends
# 3 --- 4 --- 5 --- 6
#  `13 -----------> 14'   13 and 14 are 200 m south of 3 and 6
#  `16 <----------- 15'
PLACES = {
    **{3 + k: (200.0 * k, 0.0) for k in range(4)},
    **{7 + k: (200.0 * k, 200.0) for k in range(4)},
    13: (0.0, -212.0),
    14: (600.0, -212.0),
    15: (600.0, -200.0),
    16: (0.0, -200.0),
}
WAYS = [
    *((3 + k, 4 + k) for k in range(3)),
    *((7 + k, 8 + k) for k in range(3)),
    *((3 + k, 7 + k) for k in range(4)),
]
ONEWAYS = [(13, 14), (15, 16), (3, 13), (14, 6), (6, 15), (16, 3)]


@pytest.fixture(scope="module")
def town():
    return streets(PLACES, WAYS, oneways=ONEWAYS, forbidden=[((4, 5), (5, 9))])


@pytest.fixture(scope="module")
def coquimbo():
    return Planner(load_graph(GRAPHS / "coquimbo"))
