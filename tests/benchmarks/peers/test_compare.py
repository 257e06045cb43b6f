"""Which places count, that every engine gets the same ones in turn, and ranges that reach equally far."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from benchmarks.graphs import ROOT
from benchmarks.peers.compare import (
    SAME_REACH,
    TRIES,
    WARM_UP,
    Competitor,
    charge_reaching,
    energy_ratio,
    measure_ranges,
    measure_routes,
    nodes_within,
)
from benchmarks.peers.pairs import draw_pairs, draw_places, on_those_roads
from benchmarks.peers.questions import EngineAnswer, Question
from routing.graph.earth import great_circle_m
from routing.graph.files import load_graph

DEGREES_PER_CHARGE = 1.0
DEGREES_PER_MINUTE = 0.01


class Squares:
    """An engine whose roads are the crow's and whose ranges are squares as wide as the budget says."""

    def __init__(self, name, half_width_deg, diary, refuses=lambda question: False) -> None:
        self._name, self._half_width_deg, self._diary, self._refuses = name, half_width_deg, diary, refuses

    def ask(self, question: Question) -> EngineAnswer:
        self._diary.append((self._name, question))
        if self._refuses(question):
            return EngineAnswer(refused="not for me")
        (lat, lon), half = question.start, self._half_width_deg * question.budget
        if question.goal is not None:
            return EngineAnswer(seconds=1.0, energy_kwh=2.0, ends=(question.start, question.goal))
        ring = [(lon - half, lat - half), (lon + half, lat - half), (lon + half, lat + half), (lon - half, lat + half)]
        return EngineAnswer(seconds=1.0, shape=[[ring]])


@pytest.fixture(scope="module")
def region():
    return load_graph(ROOT / "data/graphs/highlands")


def test_pairs_repeat_with_the_seed_and_are_25_km_apart_within_a_fifth(region) -> None:
    def drawn(seed):
        return list(itertools.islice(draw_pairs(region, np.random.default_rng(seed)), 50))

    found = drawn(3)
    assert found == drawn(3)
    assert found != drawn(4)
    for start, goal in found:
        assert 20_000.0 <= great_circle_m(*start, *goal) <= 30_000.0


def test_pairs_of_a_graph_of_two_kilometres_are_an_error(corner) -> None:
    with pytest.raises(ValueError, match=r"graph 'corner': no two of 10000 random nodes are 25 km apart"):
        next(draw_pairs(corner, np.random.default_rng(1)))


def test_route_is_on_other_roads_beyond_100_metres() -> None:
    question = Question((0.0, 0.0), (0.0, 1.0))
    # at the equator, 0.0008 degrees are 89 m and 0.001 degrees 111 m
    assert on_those_roads(question, EngineAnswer(ends=((0.0008, 0.0), (0.0, 1.0008))))
    assert not on_those_roads(question, EngineAnswer(ends=((0.001, 0.0), (0.0, 1.0))))
    assert not on_those_roads(question, EngineAnswer(ends=((0.0, 0.0), (0.0, 1.001))))
    assert on_those_roads(question, EngineAnswer())


def test_every_pair_is_asked_once_of_each_engine_and_another_one_begins_each_time(region) -> None:
    diary = []
    engines = [Competitor(name, Squares(name, 1.0, diary), 1.0) for name in "abc"]
    rounds = measure_routes(engines, draw_pairs(region, np.random.default_rng(1)), 4)
    assert rounds.names == ("a", "b", "c")
    assert (len(rounds.answers), rounds.left_out) == (4, 0)
    assert len(diary) == len(set(diary)) == 3 * (4 + WARM_UP)
    assert [diary[3 * k][0] for k in range(4)] == ["a", "b", "c", "a"]
    assert len({question for _, question in diary}) == 4 + WARM_UP


def test_pairs_that_one_engine_refuses_are_left_out_and_counted(region) -> None:
    diary = []
    every_third = itertools.cycle([True, False, False])
    engines = [
        Competitor("a", Squares("a", 1.0, diary), 1.0),
        Competitor("b", Squares("b", 1.0, diary, lambda question: next(every_third)), 1.0),
    ]
    rounds = measure_routes(engines, draw_pairs(region, np.random.default_rng(1)), 3)
    # 8 that count, of which 5 warm up, behind every third that does not
    assert (len(rounds.answers), rounds.left_out) == (3, 4)
    assert all(answer.refused is None for answered in rounds.answers for answer in answered)


def test_engine_that_refuses_everything_ends_the_asking(region) -> None:
    engines = [Competitor("a", Squares("a", 1.0, [], lambda question: True), 1.0)]
    rounds = measure_routes(engines, draw_pairs(region, np.random.default_rng(1)), 2)
    assert (rounds.answers, rounds.left_out) == ([], TRIES * (2 + WARM_UP))


def test_range_is_asked_with_the_charge_that_reaches_as_many_nodes(region) -> None:
    diary = []
    engines = [
        Competitor("ours", Squares("ours", DEGREES_PER_CHARGE, diary), 1.0),
        Competitor("smaller", Squares("smaller", DEGREES_PER_CHARGE, diary), 0.5),
        Competitor("minutes", Squares("minutes", DEGREES_PER_MINUTE, diary), None),
    ]
    rounds = measure_ranges(engines, region, draw_places(region, np.random.default_rng(2)), 3, 15.0)
    assert len(rounds.answers) == 3
    for own, smaller, minutes in rounds.reached:
        assert own == pytest.approx(minutes, rel=2.0 * SAME_REACH)
        assert 0 < smaller < own
    final = [question for name, question in diary if name == "ours"][-1]
    asked_before = [question for name, question in diary[:-3] if name == "ours"]
    assert final not in asked_before  # an answer kept from before would be of no use
    assert next(q for name, q in reversed(diary) if name == "smaller").budget == pytest.approx(0.5 * final.budget)


def test_charge_that_can_t_reach_so_far_is_none(region) -> None:
    origin = next(draw_places(region, np.random.default_rng(2)))
    assert charge_reaching(Squares("ours", 1e-9, []), region, origin, 1000) is None
    assert charge_reaching(Squares("ours", 1.0, [], lambda question: True), region, origin, 1000) is None


def test_ranges_without_an_engine_that_thinks_in_minutes_start_from_a_charge_of_their_own(region) -> None:
    engines = [Competitor("ours", Squares("ours", DEGREES_PER_CHARGE, []), 1.0)]
    rounds = measure_ranges(engines, region, draw_places(region, np.random.default_rng(2)), 2, 15.0)
    assert (len(rounds.answers), rounds.left_out) == (2, 0)


def test_nodes_in_a_hole_are_not_within(corner) -> None:
    def square(half):
        return [(-half, -half), (half, -half), (half, half), (-half, half)]

    assert nodes_within(corner, [[square(0.015)]]) == 2
    assert nodes_within(corner, [[square(0.03)]]) == 3
    assert nodes_within(corner, [[square(0.03), square(0.015)]]) == 1


def test_energy_ratio_is_the_median_of_the_routes_ratios(region) -> None:
    engines = [Competitor(name, Squares(name, 1.0, []), 1.0) for name in ("ours", "theirs")]
    rounds = measure_routes(engines, draw_pairs(region, np.random.default_rng(1)), 3)
    for answered, energy_kwh in zip(rounds.answers, (3.0, 5.0, 4.0), strict=True):
        answered[1] = EngineAnswer(energy_kwh=energy_kwh)
    assert energy_ratio(rounds, "theirs") == 2.0  # 1.5, 2.5 and 2
    assert energy_ratio(rounds, "ours") == 1.0
