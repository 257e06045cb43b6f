"""Outlines with fewer points: within their tolerance, still valid, still nested."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely

from routing.graph.earth import METRE_PER_DEGREE
from routing.places import Point
from routing.range.rings import rings_of, shape_of
from routing.range.simplified import ROUNDING_FRAC, simplified_rings

pytestmark = pytest.mark.nojit
HOME = Point(0.0, 0.0)
CELL_DEG = 1e-3
TOLERANCE_M = 150.0
DUST_DEG2 = 1e-12  # what rounding of overlays leaves of areas that touch: a square of a tenth of a metre


def area_of(inside: np.ndarray, keep: np.ndarray | None = None) -> shapely.MultiPolygon:
    """The cells of a grid around (0, 0) that are marked."""
    half = inside.shape[0] // 2
    cells = [shapely.box(*((np.array((x, y, x + 1, y + 1)) - half - 0.5) * CELL_DEG)) for x, y in np.argwhere(inside)]
    drawn = shapely.set_precision(shapely.union_all(cells), 1e-7)
    parts = shapely.get_parts(drawn)
    return shapely.MultiPolygon([shapely.geometry.polygon.orient(part) for part in parts])


def nested_areas(seed: int) -> list[shapely.MultiPolygon]:
    """Three ragged areas, each within the one before, which share much of their outlines and have holes and islands."""
    dice = np.random.default_rng(seed)
    size = 41
    x, y = np.meshgrid(np.arange(size) - size // 2, np.arange(size) - size // 2, indexing="ij")
    away = np.hypot(x, y) + dice.uniform(-3.0, 3.0, x.shape)
    east = x < 9  # where the map ends, for all of them
    return [area_of((away < reach) & east | (np.hypot(x, y) < 2)) for reach in (18.0, 14.0, 9.0)]


def simpler(areas: list[shapely.MultiPolygon], tolerance_m: float = TOLERANCE_M) -> list[shapely.MultiPolygon]:
    return [shape_of(rings) for rings in simplified_rings([rings_of(area) for area in areas], HOME, tolerance_m)]


def points(areas: list[shapely.MultiPolygon]) -> int:
    return int(shapely.get_num_coordinates(areas).sum())


@pytest.mark.parametrize("seed", range(8))
def test_simplified_areas_are_valid_and_nest_within_the_tolerance_with_fewer_points(seed: int) -> None:
    areas = nested_areas(seed)
    found = simpler(areas)
    assert shapely.is_valid(found).all()
    for outer, inner in pairwise(found):
        assert shapely.difference(inner, outer).area < DUST_DEG2
    for area, drawn in zip(areas, found, strict=True):
        off_m = shapely.hausdorff_distance(area.boundary, drawn.boundary, densify=0.2) * METRE_PER_DEGREE
        assert 0.0 < off_m < (1.0 + ROUNDING_FRAC) * TOLERANCE_M
        assert shapely.contains_xy(drawn, 0.0, 0.0)
        assert len(drawn.geoms) == len(area.geoms)
        assert all(part.exterior.is_ccw for part in drawn.geoms)
    assert points(found) < 0.7 * points(areas)


def test_areas_that_are_the_same_stay_the_same() -> None:
    area = nested_areas(0)[0]
    first, second, third = simpler([area, area, area])
    assert first == second == third
    assert points([first]) < 0.7 * points([area])


def test_outline_that_the_origin_is_near_to_keeps_it_on_its_side() -> None:
    notch = shapely.Polygon(
        [(-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (0.0002, 0.01), (0.0, -0.0004), (-0.0002, 0.01), (-0.01, 0.01)]
    )
    (drawn,) = simpler([shapely.MultiPolygon([shapely.geometry.polygon.orient(notch)])], 2000.0)
    assert drawn.is_valid
    assert not shapely.contains_xy(drawn, 0.0, 0.0)


def test_rounding_keeps_the_origin_in_an_area_that_is_small_beside_the_tolerance() -> None:
    triangle = shapely.Polygon([(-0.0005, -0.0025), (0.0015, -0.0005), (-0.0005, 0.0015)])
    (drawn,) = simpler([shapely.MultiPolygon([triangle])], 2000.0)
    assert shapely.contains_xy(drawn, 0.0, 0.0)


def test_coordinates_have_as_many_decimals_as_the_tolerance_asks_for() -> None:
    area = nested_areas(1)[0]
    shifted = shapely.transform(area, lambda lonlat: np.rint((lonlat + 0.0000123) * 1e7) / 1e7)
    rounded = shapely.get_coordinates(simpler([shifted])[0])
    short = np.abs(rounded * 1e5 - np.rint(rounded * 1e5)).max(axis=1) < 1e-6
    assert short.mean() > 0.9
