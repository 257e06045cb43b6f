"""Synthetic regions: what they promise about size, grades, geometry and repeatability."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from energy.stops import Cross, FunctionalClass
from routing.graph.earth import great_circle_m
from routing.graph.road_graph import ARRAY_NAMES, RoadGraph, Terrain
from routing.synth import synthesize
from routing.synth.grades import GRADE_LIMIT, graded_heights_m
from routing.synth.polylines import Polylines, resampled
from routing.synth.serpentines import meandered, winding_needed
from routing.synth.terrain import build_landscape


def small(seed: int = 3, links: int = 6_000) -> RoadGraph:
    return synthesize("small", seed=seed, width_km=None, height_km=None, links_target=links)


@pytest.fixture(scope="module")
def region() -> RoadGraph:
    return small()


def fingerprint(graph: RoadGraph) -> str:
    digest = hashlib.sha256("\n".join(graph.names).encode())
    for name in ARRAY_NAMES:
        digest.update(getattr(graph, name).tobytes())
    return digest.hexdigest()


def test_synthesize_same_seed_gives_the_same_bits() -> None:
    assert fingerprint(small(links=2_000)) == fingerprint(small(links=2_000))


def test_synthesize_other_seed_gives_another_region() -> None:
    assert fingerprint(small(seed=1, links=2_000)) != fingerprint(small(seed=2, links=2_000))


@pytest.mark.parametrize("links", [600, 2_000, 12_000])
def test_synthesize_link_count_is_near_the_target(links: int) -> None:
    for seed in (0, 1):
        count = small(seed=seed, links=links).link_count
        assert abs(count - links) < 0.06 * links + 500


def test_synthesize_every_link_reaches_every_other(region: RoadGraph) -> None:
    matrix = csr_array(
        (np.ones(region.successor.size), region.successor, region.successor_first), shape=(region.link_count,) * 2
    )
    assert connected_components(matrix, directed=True, connection="strong")[0] == 1


def test_synthesize_every_class_and_stop_level_is_there(region: RoadGraph) -> None:
    assert set(region.functional_class.tolist()) == {int(c) for c in FunctionalClass}
    assert set(region.cross.tolist()) == {int(c) for c in Cross}
    assert region.urban.any()
    assert not region.urban.all()


def test_synthesize_reverse_links_have_the_same_length_and_mirrored_points(region: RoadGraph) -> None:
    twoway = np.flatnonzero(region.reverse_idx >= 0)
    twin = region.reverse_idx[twoway]
    assert twoway.size > 0.85 * region.link_count
    np.testing.assert_array_equal(region.length_m[twoway], region.length_m[twin])
    np.testing.assert_array_equal(region.tail[twoway], region.head[twin])
    np.testing.assert_array_equal(region.reverse_idx[twin], twoway)
    for link, other in zip(twoway[:200].tolist(), twin[:200].tolist(), strict=True):
        np.testing.assert_array_equal(region.geometry(link), region.geometry(other)[::-1])


def test_synthesize_motorways_are_divided(region: RoadGraph) -> None:
    assert (region.reverse_idx[region.functional_class == FunctionalClass.MOTORWAY] < 0).all()


def test_synthesize_no_link_is_steeper_than_its_class_allows(region: RoadGraph) -> None:
    grade = np.abs(region.climb_m()) / region.length_m
    assert (grade <= GRADE_LIMIT[region.functional_class]).all()


def test_synthesize_geometry_ends_at_the_nodes_and_adds_up_to_the_length(region: RoadGraph) -> None:
    lon, lat = region.geometry_lon_e7 / 1e7, region.geometry_lat_e7 / 1e7
    first, last = region.geometry_first[:-1], region.geometry_first[1:] - 1
    for ends, node in ((first, region.tail), (last, region.head)):
        np.testing.assert_array_equal(lon[ends], region.node_lon_deg[node])
        np.testing.assert_array_equal(lat[ends], region.node_lat_deg[node])
    step = np.concatenate(([0.0], great_circle_m(lat[:-1], lon[:-1], lat[1:], lon[1:])))
    step[first] = 0.0
    np.testing.assert_allclose(np.add.reduceat(step, first), region.length_m, rtol=0.0, atol=1e-6)


def test_synthesize_no_link_is_a_loop_or_shorter_than_half_a_metre(region: RoadGraph) -> None:
    assert (region.tail != region.head).all()
    assert region.length_m.min() > 0.5


def test_synthesize_streets_have_the_length_of_streets(region: RoadGraph) -> None:
    street = region.functional_class == FunctionalClass.RESIDENTIAL
    assert 60.0 < region.length_m[street].mean() < 150.0


def test_synthesize_says_that_it_is_no_real_place(region: RoadGraph) -> None:
    meta = region.meta
    assert meta.terrain is Terrain.SYNTHETIC
    assert meta.licence == "CC0-1.0"
    assert "no real place" in meta.source
    assert "--seed 3 --name small --links 6000" in meta.source
    assert "no real place" in meta.attribution
    assert meta.smoothing_m > 0.0
    west, south, east, north = meta.bbox
    assert -40.0 < west < east < -30.0
    assert 40.0 < south < north < 48.0


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"links_target": 10}, "links_target"),
        ({"width_km": 3.0, "height_km": 50.0}, "width_km"),
        ({"width_km": None, "height_km": 50.0}, "width_km"),
        ({"centre_lat_deg": 85.0}, "centre_lat_deg"),
    ],
)
def test_synthesize_argument_out_of_range_names_it(arguments: dict[str, float], field: str) -> None:
    with pytest.raises(ValueError, match=field):
        synthesize("small", seed=1, **arguments)  # type: ignore[arg-type]


def test_synthesize_progress_rises_to_one() -> None:
    shares: list[float] = []
    synthesize(
        "small", seed=1, width_km=None, height_km=None, links_target=600, progress=lambda _, share: shares.append(share)
    )
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_landscape_rivers_drain_to_the_plain() -> None:
    land = build_landscape(60e3, 40e3, np.random.default_rng(5))
    assert land.ground_m.min() > 0.0
    assert land.ground_m.max() > 1_500.0
    # the largest rivers run low: the ground of the wettest cells lies below the mean
    wettest = land.flow_km2 > np.quantile(land.flow_km2, 0.99)
    assert land.ground_m[wettest].mean() < land.ground_m.mean()


def test_meander_lengthens_a_line_by_the_winding_asked_for() -> None:
    straight = Polylines(np.array([0, 2]), np.array([0.0, 8_000.0]), np.array([0.0, 0.0]))
    line, _ = resampled(straight, 8.0)
    for winding in (1.5, 2.0, 3.0):
        asked = np.full(line.x_m.size, winding)
        length = meandered(line, asked, np.random.default_rng(1)).length_m()[0]
        assert length == pytest.approx(8_000.0 * winding, rel=0.12)  # waves of uneven length add a little


def test_winding_of_a_slope_is_its_grade_over_the_easy_grade() -> None:
    # 1 km at 16 % for a road that likes 8 %: two metres of road a metre of corridor
    line, _ = resampled(Polylines(np.array([0, 2]), np.array([0.0, 1_000.0]), np.zeros(2)), 40.0)
    winding = winding_needed(line, 0.16 * line.x_m, np.array([0.08]))
    assert winding[13] == pytest.approx(2.0)
    assert winding[0] == winding[-1] == 1.0


def test_graded_heights_ground_within_the_limit_is_kept() -> None:
    ground = np.array([0.0, 5.0, 8.0])
    tail, head = np.array([0, 1]), np.array([1, 2])
    heights = graded_heights_m(ground, tail, head, np.array([100.0, 100.0]), np.array([0.06, 0.06]))
    np.testing.assert_allclose(heights, ground, atol=1e-9)


def test_graded_heights_lone_summit_is_cut_to_the_limit() -> None:
    # 100 m summit over 2 × 100 m at 10 %: cutting only leaves 10 m, filling only lifts the ends to 90 m;
    # three quarters cut: summit 0.75 · 10 + 0.25 · 100 = 32.5, ends 0.25 · 90 = 22.5
    heights = graded_heights_m(
        np.array([0.0, 100.0, 0.0]), np.array([0, 1]), np.array([1, 2]), np.full(2, 100.0), np.full(2, 0.1)
    )
    np.testing.assert_allclose(heights, [22.5, 32.5, 22.5], atol=1e-6)


def test_synthesize_roads_say_their_kind_and_which_of_them_are_ramps(region: RoadGraph) -> None:
    assert region.signs is not None
    kind = [region.signs.signs[k].highway for k in region.signs.sign_idx.tolist()]
    road_class = region.functional_class.tolist()
    ramp = np.array([text.endswith("_link") for text in kind])
    for text, number in zip(kind, road_class, strict=True):
        assert text in (FunctionalClass(number).name.lower(), "motorway_link")
    assert ramp.any()
    motorway = region.functional_class == FunctionalClass.MOTORWAY
    on_motorway = np.zeros(region.node_count, np.bool_)
    on_motorway[region.tail[motorway]] = on_motorway[region.head[motorway]] = True
    assert (on_motorway[region.tail[ramp]] != on_motorway[region.head[ramp]]).all()  # one end each
    assert (region.functional_class[ramp] == FunctionalClass.TRUNK).all()
    assert (region.reverse_idx[ramp] == -1).all()
