"""Sea is what lies on the right of a coast."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from routing.ground.sea import sea_of

BOX = (0.0, 0.0, 4.0, 2.0)
SOUTHWARD = shapely.LineString([(1.0, 2.5), (1.2, 1.0), (1.0, -0.5)])  # land to the east, sea to the west


def area(shapes: list[shapely.Polygon]) -> float:
    return float(sum(shape.area for shape in shapes))


def test_a_map_without_a_coast_has_no_sea() -> None:
    assert sea_of([], BOX) == ([], 0)


def test_a_coast_that_crosses_the_box_parts_it() -> None:
    sea, unclear = sea_of([SOUTHWARD], BOX)
    assert area(sea) == pytest.approx((1.0 + 0.2 / 3.0 + 1.2) / 2.0 * 2.0)  # two trapezes, one high each
    assert all(shape.contains(shapely.Point(0.1, 1.0)) for shape in sea)
    assert not unclear


def test_a_coast_drawn_the_other_way_has_its_sea_on_the_other_side() -> None:
    sea, _ = sea_of([SOUTHWARD], BOX)
    other, _ = sea_of([shapely.reverse(SOUTHWARD)], BOX)
    assert area(sea) + area(other) == pytest.approx(8.0)
    assert area([a.intersection(b) for a in sea for b in other]) == pytest.approx(0.0)


def test_a_coast_in_pieces_is_the_same_coast() -> None:
    points = list(SOUTHWARD.coords)
    pieces = [shapely.LineString(points[1:]), shapely.LineString(points[:2])]
    assert area(sea_of(pieces, BOX)[0]) == pytest.approx(area(sea_of([SOUTHWARD], BOX)[0]))


def test_an_island_is_land_in_the_sea_and_a_hole_is_sea_in_land() -> None:
    ring = shapely.Point(2.0, 1.0).buffer(0.5).exterior
    island = shapely.LineString(ring.coords) if ring.is_ccw else shapely.LineString(list(ring.coords)[::-1])
    sea, _ = sea_of([island], BOX)
    assert area(sea) == pytest.approx(8.0 - shapely.Polygon(ring).area)
    sea, _ = sea_of([shapely.reverse(island)], BOX)
    assert area(sea) == pytest.approx(shapely.Polygon(ring).area)


def test_a_coast_that_ends_shortly_before_the_edge_is_led_on_to_it() -> None:
    short = shapely.LineString([(1.0, 1.95), (1.0, 0.04)])
    sea, _ = sea_of([short], BOX)
    assert area(sea) == pytest.approx(2.0)


def test_a_coast_that_ends_in_the_middle_gives_no_sea() -> None:
    sea, _ = sea_of([shapely.LineString([(1.0, 2.5), (1.0, 1.0)])], BOX)
    assert sea == []


def test_an_area_with_its_coast_on_both_sides_is_left_out_and_counted() -> None:
    down = shapely.LineString([(1.0, 2.5), (1.0, -0.5)])
    down_too = shapely.LineString([(3.0, 2.5), (3.0, -0.5)])  # the middle is land by the first, sea by the second
    sea, unclear = sea_of([down, down_too], BOX)
    assert unclear == 1
    assert area(sea) == pytest.approx(2.0)


@given(st.lists(st.floats(0.5, 3.5), min_size=2, max_size=8))
def test_land_and_sea_fill_the_box(easts: list[float]) -> None:
    points = list(zip(easts, np.linspace(2.2, -0.2, len(easts)).tolist(), strict=True))
    coast = shapely.LineString(points)
    sea, _ = sea_of([coast], BOX)
    land, _ = sea_of([shapely.reverse(coast)], BOX)
    assert area(sea) + area(land) == pytest.approx(8.0)
    assert shapely.union_all(sea).contains(shapely.Point(0.01, 1.0))
