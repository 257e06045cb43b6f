"""Hot stretches: by hand, against a brute force over all runs, and at the edges."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from energy.force.parts import Part
from routing.errors import QueryError
from routing.route.hot_links import HotReason, RouteLinks, hot_stretches, maximal_runs


def route(
    energy_j,
    *,
    part=Part.ROLLING.idx,
    length_m=1000.0,
    parts_j=None,
    road_names=None,
    grade=0.0,
    altitude_m=None,
    duration_s=100.0,
    standstill_s=0.0,
    stops=0.0,
) -> RouteLinks:
    """Links of 1000 m and 100 s whose whole energy is one part."""
    energy = np.array(energy_j, np.float64)
    n = energy.size

    def column(values):
        return np.array(np.broadcast_to(np.asarray(values, np.float64), (n,)))

    if parts_j is None:
        parts_j = np.zeros((n, 8))
        parts_j[:, part] = energy
    return RouteLinks(
        length_m=column(length_m),
        energy_j=energy,
        grade_frac=column(grade),
        speed_limit_mps=column(20.0),
        stop_probability_frac=column(stops),
        duration_s=column(duration_s),
        standstill_s=column(standstill_s),
        parts_j=parts_j,
        road_names=road_names if road_names is not None else [""] * n,
        altitude_m=altitude_m,
    )


def brute_force(score: list[int]) -> list[tuple[int, int]]:
    """Maximal scoring runs straight from their definition."""
    n = len(score)
    total = {(i, j): sum(score[i : j + 1]) for i, j in itertools.combinations_with_replacement(range(n), 2)}

    def beats_its_parts(run: tuple[int, int]) -> bool:
        i, j = run
        parts = itertools.combinations_with_replacement(range(i, j + 1), 2)
        return total[run] > 0 and all(total[run] > total[part] for part in parts if part != run)

    good = [run for run in total if beats_its_parts(run)]
    return sorted(run for run in good if not any(o != run and o[0] <= run[0] and run[1] <= o[1] for o in good))


@given(st.lists(st.integers(-6, 6), max_size=14))
def test_runs_are_those_of_the_definition(score):
    assert maximal_runs(np.array(score, np.float64)) == brute_force(score)


def test_runs_of_the_published_example():
    # Ruzzo and Tompa, section 2: (4), (3) and (1, 2, -2, 2, -2, 1, 5) of their sequence
    score = np.array([4, -5, 3, -3, 1, 2, -2, 2, -2, 1, 5], np.float64)
    assert maximal_runs(score) == [(0, 0), (2, 2), (4, 10)]


@given(st.lists(st.integers(-1000, 1000), max_size=60))
def test_runs_are_disjoint_positive_and_do_not_touch(score):
    runs = maximal_runs(np.array(score, np.float64))
    for first, last in runs:
        assert sum(score[first : last + 1]) > 0
        assert score[first] > 0
        assert score[last] > 0
    for (_, last), (first, _) in itertools.pairwise(runs):
        assert first > last + 1
    # every positive score is inside some run
    inside = {k for first, last in runs for k in range(first, last + 1)}
    assert {k for k, value in enumerate(score) if value > 0} <= inside


def test_long_sequences_take_linear_work():
    # falling sums make every candidate's search go back; a quadratic search would not end here
    score = np.tile([1.0, -2.0], 200_000)
    assert len(maximal_runs(score)) == 200_000
    assert maximal_runs(np.tile([2.0, -1.0], 200_000)) == [(0, 399_998)]


def test_stretch_by_hand():
    # 1, 1, 5, 1, 4, 0 kJ over 1 km each: 12 kJ, mean 2; scores above it -1, -1, 3, -1, 2, -2: links 2 to 4 score 4
    links = route([1e3, 1e3, 5e3, 1e3, 4e3, 0.0], road_names=["A", "A", "B", "", "A", "C"], grade=0.01, stops=0.5)
    (stretch,) = hot_stretches(links, margin_frac=0.0)
    assert (stretch.first, stretch.last, stretch.from_m, stretch.to_m, stretch.length_m) == (2, 4, 2e3, 5e3, 3e3)
    assert stretch.energy_j == 10e3
    assert stretch.excess_j == pytest.approx(4e3)
    assert stretch.energy_per_m == pytest.approx(10.0 / 3.0)
    assert stretch.times_mean == pytest.approx(10.0 / 6.0)
    assert stretch.energy_share_frac == pytest.approx(10.0 / 12.0)
    assert stretch.road_names == ("B", "A")
    assert stretch.rise_m == pytest.approx(30.0)
    assert stretch.stop_count == pytest.approx(1.5)
    assert stretch.speed_mps == pytest.approx(10.0)
    assert stretch.speed_limit_mps == pytest.approx(20.0)


def test_margin_raises_the_bar_and_leaves_the_excess():
    # the same route with the bar at 1.5 · 2 kJ a km: scores -2, -2, 2, -2, 1, -3; excess over the mean 3 and 2
    links = route([1e3, 1e3, 5e3, 1e3, 4e3, 0.0])
    found = hot_stretches(links, margin_frac=0.5)
    assert [(stretch.first, stretch.last) for stretch in found] == [(2, 2), (4, 4)]
    assert [stretch.excess_j for stretch in found] == pytest.approx([3e3, 2e3])
    assert hot_stretches(links) == found
    assert hot_stretches(links, margin_frac=2.0) == ()


def test_largest_excess_comes_first_and_ties_come_in_driving_order():
    links = route([3e3, 0.0, 5e3, 0.0, 3e3, 0.0])
    found = hot_stretches(links)
    assert [stretch.first for stretch in found] == [2, 0, 4]
    assert found[1].excess_j == pytest.approx(found[2].excess_j)
    assert hot_stretches(links, limit=2) == found[:2]
    assert hot_stretches(links, limit=0) == ()


def test_short_stretches_are_left_out():
    links = route([9e3, 0.0, 9e3, 0.0], length_m=[50.0, 1000.0, 1000.0, 1000.0])
    assert [stretch.first for stretch in hot_stretches(links)] == [2]
    assert [stretch.first for stretch in hot_stretches(links, shortest_m=50.0)] == [0, 2]  # 8.7 and 3.1 kJ above


@pytest.mark.parametrize(
    ("column", "reason"),
    [
        (Part.GRADE.idx, HotReason.CLIMB),
        (Part.AERO.idx, HotReason.SPEED),
        (Part.INERTIA.idx, HotReason.STOPS),
        (Part.AUXILIARY.idx, HotReason.AUXILIARY),
        (Part.ROLLING.idx, HotReason.ROLLING),
        (8, HotReason.CONDITIONS),
    ],
)
def test_reason_is_the_part_above_its_mean(column, reason):
    parts = np.zeros((4, 10))
    parts[:, Part.ROLLING.idx] = 1e3
    parts[1, column] += 5e3
    parts[1, Part.DRIVETRAIN_LOSS.idx] += 400.0  # the loss that comes with it does not count for more
    (stretch,) = hot_stretches(route(parts.sum(axis=1), parts_j=parts))
    assert (stretch.first, stretch.last, stretch.reason) == (1, 1, reason)


def test_auxiliaries_of_standing_count_as_stops():
    parts = np.zeros((3, 8))
    parts[:, Part.AUXILIARY.idx] = [1e3, 6e3, 1e3]
    links = route(parts.sum(axis=1), parts_j=parts, duration_s=[100.0, 600.0, 100.0], standstill_s=[0.0, 500.0, 0.0])
    assert hot_stretches(links)[0].reason is HotReason.STOPS
    moving = route(parts.sum(axis=1), parts_j=parts, duration_s=[100.0, 600.0, 100.0])
    assert hot_stretches(moving)[0].reason is HotReason.AUXILIARY


def test_reason_is_against_the_mean_not_the_largest_part():
    # drag is the largest part everywhere; the climb is what link 1 has more of
    parts = np.zeros((3, 8))
    parts[:, Part.AERO.idx] = 50e3
    parts[1, Part.GRADE.idx] = 10e3
    links = route(parts.sum(axis=1), parts_j=parts)
    assert hot_stretches(links, margin_frac=0.0)[0].reason is HotReason.CLIMB


def test_altitudes_give_the_rise_where_they_are_known():
    links = route([0.0, 4e3, 0.0], altitude_m=np.array([100.0, 101.0, 131.0, 90.0]))
    assert hot_stretches(links)[0].rise_m == 30.0


@pytest.mark.parametrize("energy_j", [[], [5e3], [0.0, 0.0, 0.0], [2e3, 2e3, 2e3], [-1e3, -1e3]])
def test_route_without_difference_has_no_hot_stretch(energy_j):
    assert hot_stretches(route(energy_j)) == ()


def test_rounding_makes_no_hot_stretch():
    lengths = np.array([0.1, 0.2, 0.3, 0.7, 1.1]) * 1000.0
    assert hot_stretches(route(lengths * 0.7, length_m=lengths)) == ()


def test_downhill_route_has_stretches_without_shares():
    # -4, -1, -4 kJ: mean -3, bar -1.5; link 1 is 2 above the mean
    (stretch,) = hot_stretches(route([-4e3, -1e3, -4e3]))
    assert (stretch.first, stretch.last, stretch.excess_j) == (1, 1, pytest.approx(2e3))
    assert (stretch.times_mean, stretch.energy_share_frac) == (None, None)


def test_route_whose_energies_cancel_has_stretches_without_shares():
    (stretch,) = hot_stretches(route([3e3, -3e3]))
    assert (stretch.first, stretch.times_mean, stretch.energy_share_frac) == (0, None, None)


@given(
    st.lists(st.tuples(st.integers(1, 50), st.integers(-40, 200)), min_size=1, max_size=40),
    st.integers(0, 8),
    st.sampled_from([0.0, 100.0, 1000.0]),
    st.sampled_from([0.0, 0.5]),
)
def test_stretches_are_disjoint_ranked_and_above_the_bar(links, limit, shortest_m, margin_frac):
    length_m = np.array([length for length, _ in links]) * 20.0
    energy_j = np.array([energy for _, energy in links]) * 1e3
    given_links = route(energy_j, length_m=length_m)
    found = hot_stretches(given_links, limit=limit, shortest_m=shortest_m, margin_frac=margin_frac)
    assert found == hot_stretches(given_links, limit=limit, shortest_m=shortest_m, margin_frac=margin_frac)
    assert len(found) <= limit
    taken = [k for stretch in found for k in range(stretch.first, stretch.last + 1)]
    assert len(taken) == len(set(taken))
    mean = energy_j.sum() / length_m.sum()
    for stretch in found:
        assert stretch.length_m >= shortest_m
        assert stretch.energy_per_m > mean + margin_frac * abs(mean)
        assert stretch.to_m - stretch.from_m == pytest.approx(stretch.length_m)
        assert stretch.excess_j == pytest.approx(stretch.energy_j - mean * stretch.length_m, abs=1e-3)
    excesses = [stretch.excess_j for stretch in found]
    assert excesses == sorted(excesses, reverse=True)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"parts_j": np.zeros((3, 8))}, "parts_j"),
        ({"parts_j": np.zeros((2, 7))}, "parts_j"),
        ({"road_names": ["A"]}, "road_names"),
        ({"altitude_m": np.zeros(2)}, "altitude_m"),
        ({"length_m": [1.0, 0.0]}, "length_m"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(changes, field):
    with pytest.raises(QueryError) as caught:
        route([1.0, 2.0], **changes)
    assert caught.value.field == field


def test_energy_that_is_not_finite_is_refused():
    with pytest.raises(QueryError, match="energy_j is not finite"):
        route([1.0, np.nan], parts_j=np.zeros((2, 8)))


@pytest.mark.parametrize(
    "arguments", [{"limit": -1}, {"shortest_m": -1.0}, {"shortest_m": np.nan}, {"margin_frac": -0.1}]
)
def test_settings_out_of_range_are_refused(arguments):
    with pytest.raises(QueryError, match="0 or more"):
        hot_stretches(route([1.0, 2.0]), **arguments)
