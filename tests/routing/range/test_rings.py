"""Rings of areas as JSON: byte for byte what orjson writes of the same numbers."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import orjson
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from routing.range.rings import AreaRings, rings_of, shape_of


def slow_json(rings: AreaRings) -> bytes:
    """By lists of Python."""
    points = rings.lonlat.round(7).tolist()
    lines = [points[begin:end] for begin, end in pairwise(rings.ring_first.tolist())]
    return orjson.dumps([lines[begin:end] for begin, end in pairwise(rings.polygon_first.tolist())])


def rings_with(numbers: list[float], points_of_rings: list[int], rings_of_polygons: list[int]) -> AreaRings:
    count = sum(points_of_rings)
    return AreaRings(
        np.resize(np.array(numbers), (count, 2)),
        np.cumsum([0, *points_of_rings]),
        np.cumsum([0, *rings_of_polygons]),
    )


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.floats(-180.0, 180.0),
            st.integers(-1_800_000_000, 1_800_000_000).map(lambda units: units / 1e7),
            st.integers(-2000, 2000).map(lambda units: units / 1e7),
        ),
        min_size=1,
        max_size=60,
    ),
    st.lists(st.lists(st.integers(1, 6), min_size=1, max_size=3), max_size=4),
)
def test_any_rings_are_written_as_orjson_writes_them(numbers, polygons):
    rings = rings_with(numbers, [size for polygon in polygons for size in polygon], [len(part) for part in polygons])
    assert rings.coordinates_json() == slow_json(rings)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_small_and_round_numbers_are_written_as_orjson_writes_them(sign):
    whole = [units / 1e7 for units in range(12_000)]
    round_ones = [float(number) for number in range(181)] + [10.0**-k for k in range(8)] + [0.4e-7, 0.6e-7, 99.99999996]
    numbers = (sign * np.array(whole + round_ones)).tolist()
    rings = rings_with(numbers, [len(numbers)], [1])
    assert rings.coordinates_json() == slow_json(rings)


def test_points_of_the_most_bytes_fit():
    rings = rings_with([-179.1234567, -179.7654321], [5, 4], [1, 1])
    assert rings.coordinates_json() == slow_json(rings)


def test_area_of_its_rings_is_the_area():
    hole = shapely.Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (1, 2), (2, 2), (2, 1)]])
    area = shapely.MultiPolygon([hole, shapely.Polygon([(5, 0), (6, 0), (6, 1)])])
    assert rings_of(area).polygon_first.tolist() == [0, 2, 3]
    assert shapely.equals_identical(shape_of(rings_of(area)), area)
