"""Filled outlines: they hold those along roads, without small gaps and holes, and say how many nodes are falsely in."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from energy.vehicle.files import load_vehicles
from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.files import load_graph
from routing.places import Point
from routing.planner import Planner
from routing.queries import Outline, RangeQuery, Trip
from routing.range.bands import RangeAnswer

ROOT = Path(__file__).resolve().parents[3]
KONA = load_vehicles(ROOT / "data/vehicles")["hyundai-kona-64"]
HOME = Point(-29.95, -71.25)


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(load_graph(ROOT / "data/graphs/coquimbo"))


def both(planner: Planner, soc: float, **changes) -> tuple[RangeAnswer, RangeAnswer]:
    """Along roads, and filled."""
    query = replace(RangeQuery(HOME, soc, KONA, bands_soc_frac=(0.4 * soc, 0.7 * soc)), **changes)
    return planner.range(query), planner.range(replace(query, outline=Outline.FILLED))


def in_metres(area: shapely.Geometry) -> shapely.Geometry:
    scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(HOME.lat_deg)), 1.0))
    return shapely.transform(area, lambda lonlat: (lonlat - (HOME.lon_deg, HOME.lat_deg)) * scale)


@pytest.mark.parametrize("trip", list(Trip))
@pytest.mark.parametrize("soc", [0.006, 0.02])
def test_filled_areas_are_valid_right_handed_nested_and_hold_the_others(planner, soc, trip):
    roads, filled = both(planner, soc, trip=trip)
    assert roads.filling is None
    assert filled.filling is not None
    for road, smooth in zip(roads.bands, filled.bands, strict=True):
        assert smooth.area.is_valid
        assert smooth.soc_left_frac == road.soc_left_frac
        assert road.area.difference(smooth.area.buffer(2e-7)).is_empty
        assert smooth.area_m2 >= road.area_m2 * (1.0 - 1e-9)
        for polygon in smooth.area.geoms:
            assert polygon.exterior.is_ccw
            assert not any(ring.is_ccw for ring in polygon.interiors)
    for outer, inner in pairwise(filled.bands):
        assert inner.area.difference(outer.area.buffer(2e-7)).is_empty
        assert inner.area_m2 <= outer.area_m2 * (1.0 + 1e-9)
        assert outer.tolerance_m < 0.02 * filled.filling.gap_m


def test_filled_levels_nest_at_each_probability_though_the_whole_map_is_reached(planner):
    _, filled = both(planner, 0.5, uncertainty=True)
    for probability in {band.probability_frac for band in filled.bands}:
        bands = [band for band in filled.bands if band.probability_frac == probability]
        assert len(bands) == 3
        for outer, inner in pairwise(bands):
            assert inner.area.difference(outer.area.buffer(2e-7)).is_empty


def test_filled_areas_have_no_holes_below_the_stated_size_and_no_narrow_gaps(planner):
    roads, filled = both(planner, 0.02)
    assert sum(len(polygon.interiors) for polygon in roads.bands[0].area.geoms) > 5
    filling = filled.filling
    assert filling is not None
    for band in filled.bands:
        flat = in_metres(band.area)
        for polygon in flat.geoms:
            for hole in polygon.interiors:
                assert shapely.Polygon(hole).area >= 0.99 * filling.hole_m2
        # widened and narrowed again by a bit less than half a gap, hardly anything is gained
        closed = flat.buffer(0.45 * filling.gap_m).buffer(-0.45 * filling.gap_m)
        assert closed.area - flat.area <= 0.01 * flat.area


def test_shares_of_a_filled_area_are_those_of_all_nodes_asked_one_by_one(planner):
    graph = planner.graph
    nodes = shapely.points(graph.node_lon_deg, graph.node_lat_deg)
    roads, filled = both(planner, 0.01)
    for road, smooth in zip(roads.bands, filled.bands, strict=True):
        covered = int(shapely.contains(smooth.area, nodes).sum())
        truly = round(smooth.node_count * (1.0 - smooth.false_out_frac))
        assert smooth.node_count == road.node_count
        assert covered * smooth.false_in_frac == pytest.approx(covered - truly)
        assert smooth.false_out_frac <= road.false_out_frac + 1e-9
        assert smooth.false_in_frac > road.false_in_frac


def test_larger_areas_are_filled_farther(planner):
    small, large = (both(planner, soc)[1].filling for soc in (0.004, 0.5))
    assert small is not None
    assert large is not None
    assert small.gap_m == 800.0
    (outermost,) = planner.range(RangeQuery(HOME, 0.5, KONA)).bands
    assert large.gap_m == pytest.approx(0.1 * np.sqrt(outermost.area_m2 / np.pi))
    assert large.gap_m > 800.0
    assert large.hole_m2 == large.gap_m**2


def test_filled_area_that_the_map_ends_says_so_as_the_other_does(planner):
    roads, filled = both(planner, 0.03)
    for road, smooth in zip(roads.bands, filled.bands, strict=True):
        assert (road.map_edge is None) == (smooth.map_edge is None)
        assert road.edge_left_j == smooth.edge_left_j
        if smooth.map_edge is not None:
            assert smooth.map_edge.line.within(smooth.area.boundary.buffer(1e-7))
