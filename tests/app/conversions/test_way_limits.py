"""How fast and how steep a way is: what some of it in sum has."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely

from app.conversions.way_limits import area_limits, held, way_limits
from energy.conditions import STILL
from energy.vehicle.files import load_vehicle
from routing.graph.files import load_graph
from tests.app.conftest import VEHICLES

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph

ROOT = Path(__file__).resolve().parents[3]


def test_held_is_the_highest_value_that_enough_in_sum_reaches() -> None:
    values, weights = np.array([30.0, 50.0, 130.0, 120.0]), np.array([500.0, 500.0, 150.0, 60.0])
    assert held(values, weights, 200.0) == 120.0  # 150 at 130 are too little, 210 reach 120
    assert held(values, weights, 150.0) == 130.0
    assert held(values, weights, 211.0) == 50.0


def test_short_steep_and_fast_links_do_not_count_until_200_m_of_them_are_there() -> None:
    length_m = np.array([1000.0, 100.0, 100.0])
    grade = np.array([0.01, 0.12, -0.09])
    speed_mps = np.array([50.0, 100.0, 100.0]) / 3.6
    limits = way_limits(length_m, grade, speed_mps)
    assert limits is not None
    assert limits.speed_kmh == pytest.approx(100.0)
    assert limits.grade == (0.01, 0.01)
    longer = way_limits(np.array([1000.0, 200.0, 200.0]), grade, speed_mps)
    assert longer is not None
    assert longer.grade == (-0.09, 0.12)


def test_a_way_shorter_than_that_counts_by_half_of_it() -> None:
    limits = way_limits(np.array([60.0, 40.0]), np.array([0.05, 0.02]), np.array([10.0, 20.0]))
    assert limits is not None
    assert limits.speed_kmh == pytest.approx(36.0)
    assert limits.grade == (0.05, 0.05)
    assert way_limits(np.zeros(0), np.zeros(0), np.zeros(0)) is None


@pytest.fixture(scope="module")
def highlands() -> RoadGraph:
    return load_graph(ROOT / "data" / "graphs" / "highlands")


def test_sample_of_a_large_areas_nodes_has_the_limits_of_all(highlands: RoadGraph) -> None:
    car = load_vehicle(VEHICLES / "hyundai-kona-64.toml")
    area = shapely.MultiPolygon([shapely.box(*highlands.meta.bbox)])
    every, some = (area_limits(area, highlands, car, STILL, most) for most in (10**6, 4000))
    assert every is not None
    assert some is not None
    assert some.speed_kmh == every.speed_kmh == pytest.approx(130.0)
    assert some.grade == pytest.approx(every.grade, rel=0.15)
    assert every.grade[1] > 0.02


def test_area_counts_its_own_links_alone(highlands: RoadGraph) -> None:
    car = load_vehicle(VEHICLES / "hyundai-kona-64.toml")
    lon, lat = highlands.node_lon_deg, highlands.node_lat_deg
    slow = np.flatnonzero(highlands.speed_limit_mps < 15.0)
    node = int(highlands.tail[slow[0]])
    around = shapely.MultiPolygon([shapely.box(lon[node] - 1e-6, lat[node] - 1e-6, lon[node] + 1e-6, lat[node] + 1e-6)])
    limits = area_limits(around, highlands, car, STILL)
    assert limits is not None
    own = highlands.tail == node
    assert limits.speed_kmh <= 3.6 * highlands.speed_limit_mps[own].max() + 1e-9
    nowhere = shapely.MultiPolygon([shapely.box(0.0, 0.0, 1.0, 1.0)])
    assert area_limits(nowhere, highlands, car, STILL) is None
    assert area_limits(shapely.MultiPolygon(), highlands, car, STILL) is None
