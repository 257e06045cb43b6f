"""Areas over 180°: the same as elsewhere, cut there, with each part on its side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from energy.vehicle.files import load_vehicles
from routing.graph.files import load_graph
from routing.places import Point
from routing.planner import Planner
from routing.queries import By, Outline, RangeQuery, Trip
from routing.range.antimeridian import half_turned

ROOT = Path(__file__).resolve().parents[3]
KONA = load_vehicles(ROOT / "data/vehicles")["hyundai-kona-64"]
HOME = Point(-29.950463, -71.2503007)  # on a road: of lines over 180°, which an import would cut, none is as near
WEST_DEG = 108.745  # of Coquimbo: brings its middle to 180°


def west_of(lon: np.ndarray, turn: float, whole: float) -> np.ndarray:
    """Longitudes so much farther west, within half a turn of 0."""
    return (lon - turn + 0.5 * whole) % whole - 0.5 * whole


def to_coquimbo(lonlat: np.ndarray) -> np.ndarray:
    """Places of the moved map where they are in truth."""
    return np.column_stack((lonlat[:, 0] % 360.0 - 360.0 + WEST_DEG, lonlat[:, 1]))


@pytest.fixture(scope="module")
def planners() -> tuple[Planner, Planner]:
    """Coquimbo where it is, and astride of 180°."""
    graph = load_graph(ROOT / "data/graphs/coquimbo")
    lon_deg = west_of(graph.node_lon_deg, WEST_DEG, 360.0)
    lon_e7 = west_of(graph.geometry_lon_e7.astype(np.int64), round(WEST_DEG * 1e7), 3_600_000_000).astype(np.int32)
    astride = replace(graph, node_lon_deg=lon_deg, geometry_lon_e7=lon_e7)
    west, south, east, north = float(lon_deg.min()), graph.meta.bbox[1], float(lon_deg.max()), graph.meta.bbox[3]
    assert west < -179.9
    assert east > 179.9
    return Planner(graph), Planner(replace(astride, meta=replace(graph.meta, bbox=(west, south, east, north))))


@pytest.mark.parametrize(
    "asked",
    [
        {"bands_soc_frac": (0.01,)},
        {"outline": Outline.FILLED, "trip": Trip.ROUND},
        {"by": By.DISTANCE, "limits": (500.0, 8000.0)},
        {"soc_frac": 0.9},
    ],
)
def test_areas_over_the_antimeridian_are_those_of_the_same_map_elsewhere(planners, asked):
    here, astride = planners
    query = replace(RangeQuery(HOME, 0.02, KONA), **asked)
    moved = Point(HOME.lat_deg, float(west_of(np.array(HOME.lon_deg), WEST_DEG, 360.0)))
    for expected, found in zip(here.range(query).bands, astride.range(replace(query, origin=moved)).bands, strict=True):
        assert found.area.is_valid
        assert all(part.exterior.is_ccw for part in found.area.geoms)
        west, _, east, _ = found.area.bounds
        assert -180.0 <= west < east <= 180.0
        assert max(part.bounds[2] - part.bounds[0] for part in found.area.geoms) < 0.3
        back = shapely.union_all(shapely.transform(found.area, to_coquimbo).geoms, grid_size=1e-7)
        assert back.symmetric_difference(expected.area).area < 1e-7
        assert found.area_m2 == pytest.approx(expected.area_m2, rel=1e-5)
        assert found.bearing_reach_m == pytest.approx(expected.bearing_reach_m, abs=0.1)
        assert (found.map_edge is None) == (expected.map_edge is None)
        if found.map_edge is not None and expected.map_edge is not None:
            assert found.map_edge.line.length == pytest.approx(expected.map_edge.line.length, rel=1e-3)


def test_map_on_one_side_of_the_antimeridian_is_drawn_as_it_is(planners):
    here, astride = planners
    assert half_turned(here.graph) is here.graph
    assert np.ptp(half_turned(astride.graph).node_lon_deg) < 0.3


def test_map_on_one_side_is_drawn_as_it_is_however_its_spans_round(planners):
    here, _ = planners
    graph = here.graph
    for offset_deg in np.arange(-100.0, 240.0, 7.3):
        moved = replace(graph, node_lon_deg=graph.node_lon_deg + offset_deg)
        assert half_turned(moved) is moved
