"""Chains by hand: what links hand on to each other, how a trip ends, and which stops are made."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.force.effects import drive_of

pytestmark = pytest.mark.nojit


def test_link_physics_takes_the_table_of_parameters_over(round_vehicle):
    p = drive_of(round_vehicle, printed=True).physics
    assert (p.weight_n, p.inertia_kg) == pytest.approx((9810.0, 1100.0))
    assert (p.drive_factor, p.recuperation_factor) == pytest.approx((1.25, 0.5))
    assert (p.aux_move_w, p.aux_idle_w) == pytest.approx((600.0, 500.0))
    assert p.accel_sum.tolist() == [0.0, 3.0, 5.0, 6.0]
    assert p.decel_sum.tolist() == [0.0, 4.0, 7.0, 9.0]
    assert p.printed
    assert not drive_of(round_vehicle).physics.printed


def test_two_links_from_rest_to_rest_add_their_phases(round_vehicle, make_chain):
    # Link 1, limit 20, next 10: 80 m up at 2.5 [299 800 J, 8 s]; 870 m at 20 m/s, 405 J/m [43.5 s];
    #   50 m down at 3 [(100 + 125 - 3300)·50·0.5 + 600·10/3 J]: 299 800 + 352 350 - 76 875 + 2000 = 577 275 J
    # Link 2, limit 10: 487.5 m at 10 m/s, (100 + 50)/0.8 + 60 = 247.5 J/m [48.75 s]; 12.5 m down at 4
    #   [(100 + 25 - 4400)·12.5·0.5 + 600·2.5 J]: 120 656.25 - 26 718.75 + 1500 = 95 437.5 J
    result = simulate_chain(round_vehicle, make_chain([1000.0, 500.0], [20.0, 10.0]))
    first, second = result.links
    assert first.energy_j == pytest.approx(577_275.0)
    assert first.duration_s == pytest.approx(8.0 + 43.5 + 10.0 / 3.0)
    assert first.speed_end_mps == 10.0
    assert second.energy_j == pytest.approx(95_437.5)
    assert second.duration_s == pytest.approx(48.75 + 2.5)
    assert result.energy_j == pytest.approx(672_712.5)  # (6), (41)
    assert result.parts.total_j() == pytest.approx(672_712.5)
    assert result.parts.rolling_j == pytest.approx(150_000.0)
    assert result.parts.inertia_j == pytest.approx(0.0, abs=1e-6)
    assert result.parts.auxiliary_j == pytest.approx(600.0 * result.duration_s)
    assert result.distance_m == 1500.0
    assert (result.stop_count, result.standstill_s) == (0.0, 0.0)


def test_links_of_a_result_are_rows_of_its_columns(round_vehicle, make_chain):
    links = simulate_chain(round_vehicle, make_chain([1000.0, 500.0, 700.0], [20.0, 10.0, 15.0])).links
    assert len(links) == len(list(links)) == 3
    assert [link.energy_j for link in links] == links.energy_j.tolist()
    assert [link.speed_end_mps for link in links[1:]] == links.speed_end_mps.tolist()[1:]
    assert links[-1].parts_j.tolist() == links.parts_j[2].tolist()
    with pytest.raises(IndexError):
        links[3]


def test_trip_that_need_not_arrive_stopped_ends_at_the_limit(round_vehicle, make_chain):
    # (9): the second link is all cruise at 10 m/s: 500·247.5 J
    result = simulate_chain(round_vehicle, make_chain([1000.0, 500.0], [20.0, 10.0]), arrive_stopped=False)
    assert result.links[1].energy_j == pytest.approx(123_750.0)
    assert result.links[1].speed_end_mps == 10.0
    assert result.links[1].stop_probability_frac == 0.0


def test_speed_at_the_end_is_the_entry_of_the_next_link(round_vehicle, make_chain):
    # (7): 45 m from rest at 2.5 reach 15 m/s; from there to 20 at 2 m/s² takes (400-225)/4 = 43.75 m, 2.5 s
    result = simulate_chain(round_vehicle, make_chain([45.0, 500.0], 20.0), arrive_stopped=False)
    assert result.links[0].speed_end_mps == pytest.approx(15.0)
    assert result.links[1].duration_s == pytest.approx(2.5 + 456.25 / 20.0)


def test_start_above_the_limit_brakes_in_the_first_link(round_vehicle, make_chain):
    # 30 → 20 at 2 m/s² takes 5 s and 125 m
    result = simulate_chain(round_vehicle, make_chain([1000.0], 20.0), start_speed_mps=30.0, arrive_stopped=False)
    assert result.duration_s == pytest.approx(5.0 + 875.0 / 20.0)


def test_certain_stop_waits_and_starts_from_rest(round_vehicle, make_chain):
    # two links of 1000 m from rest to rest at 20 m/s (80 m up, 400/7 m down), 12 s at 500 W between them
    result = simulate_chain(
        round_vehicle, make_chain([1000.0, 1000.0], 20.0, stop_probability_frac=[1.0, 0.0], stop_time_s=[12.0, 0.0])
    )
    each_j = 299_800.0 + (920.0 - 400.0 / 7.0) * 405.0 - 706_000.0 / 7.0
    assert result.links[0].energy_j == pytest.approx(each_j + 6000.0)
    assert result.links[1].energy_j == pytest.approx(each_j)
    assert (result.stop_count, result.standstill_s) == (1.0, 12.0)
    assert result.links[0].standstill_s == 12.0


def test_arrival_waits_for_nothing_and_is_no_stop(round_vehicle, make_chain):
    result = simulate_chain(
        round_vehicle, make_chain([1000.0, 1000.0], 20.0, stop_probability_frac=0.5, stop_time_s=30.0)
    )
    assert result.links[1].standstill_s == 0.0
    assert result.links[1].stop_probability_frac == 1.0
    assert result.stop_count == 0.5
    assert result.standstill_s == 15.0


def test_stop_rule_none_equals_probability_zero(round_vehicle, make_chain):
    length, limit, grade = [400.0, 90.0, 700.0], [20.0, 15.0, 25.0], [0.01, -0.05, 0.0]
    asked = make_chain(length, limit, grade, stop_probability_frac=[0.4, 1.0, 0.2], stop_time_s=20.0, stop_class=7)
    never = make_chain(length, limit, grade)
    none = simulate_chain(round_vehicle, asked, stop_rule=StopRule.NONE)
    for rule in StopRule:
        zero = simulate_chain(round_vehicle, never, stop_rule=rule)
        assert none.energy_j == zero.energy_j
        assert none.duration_s == zero.duration_s
        assert [link.parts_j.tolist() for link in none.links] == [link.parts_j.tolist() for link in zero.links]
    assert (none.stop_count, none.standstill_s) == (0.0, 0.0)


def stops_made(result):
    return [k + 1 for k, link in enumerate(result.links) if link.stop_probability_frac == 1.0]


def test_counted_stops_follow_the_counters(round_vehicle, make_chain):
    # target 0.3, stops/requests with the request counted first: 0/1 stop, 1/2, 1/3, 1/4 stop, 2/5, 2/6, 2/7 stop,
    # 3/8, 3/9, 3/10 is not below 0.3, 3/11 stop, 4/12
    chain = make_chain(np.full(12, 500.0), 15.0, stop_probability_frac=0.3, stop_time_s=10.0, stop_class=6)
    result = simulate_chain(round_vehicle, chain, stop_rule=StopRule.COUNTED, arrive_stopped=False)
    assert stops_made(result) == [1, 4, 7, 11]
    assert result.stop_count == 4.0
    assert result.standstill_s == 40.0


def test_counted_stops_of_each_class_have_their_own_counters(round_vehicle, make_chain):
    # odd links: country small, 0.5: requests 1, 2, 3, …: 0/1 stop, 1/2, 1/3 stop, 2/4, 2/5 stop → links 1, 5, 9
    # even links: urban large, 0.3 → their requests 1 and 4 → links 2 and 8
    chain = make_chain(
        np.full(10, 500.0), 15.0, stop_probability_frac=[0.5, 0.3] * 5, stop_time_s=10.0, stop_class=[1, 7] * 5
    )
    result = simulate_chain(round_vehicle, chain, stop_rule=StopRule.COUNTED, arrive_stopped=False)
    assert stops_made(result) == [1, 2, 5, 8, 9]


def test_counted_stops_do_not_count_links_that_request_none(round_vehicle, make_chain):
    # requests at links 1, 3, 4, 7 only: the fourth request stops again (1/4 < 0.3)
    chain = make_chain(
        np.full(8, 500.0), 15.0, stop_probability_frac=[0.3, 0.0, 0.3, 0.3, 0.0, 0.0, 0.3, 0.0], stop_class=6
    )
    result = simulate_chain(round_vehicle, chain, stop_rule=StopRule.COUNTED, arrive_stopped=False)
    assert stops_made(result) == [1, 7]


def test_counted_stops_with_probability_one_always_stop(round_vehicle, make_chain):
    chain = make_chain(np.full(5, 500.0), 15.0, stop_probability_frac=1.0, stop_class=3)
    result = simulate_chain(round_vehicle, chain, stop_rule=StopRule.COUNTED, arrive_stopped=False)
    assert stops_made(result) == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("target", [0.05, 0.2, 0.5])
def test_counted_stops_settle_at_the_target_share(round_vehicle, make_chain, target):
    chain = make_chain(np.full(200, 500.0), 15.0, stop_probability_frac=target, stop_class=5)
    result = simulate_chain(round_vehicle, chain, stop_rule=StopRule.COUNTED, arrive_stopped=False)
    # the share is at least the target, never more than one stop above it
    assert target * 200 <= result.stop_count <= target * 200 + 1


def test_expected_stops_with_certain_probabilities_equal_counted(round_vehicle, make_chain):
    chain = make_chain(
        [300.0, 80.0, 40.0, 500.0],
        [20.0, 12.0, 25.0, 15.0],
        [0.02, -0.03, 0.0, 0.01],
        stop_probability_frac=[1.0, 0.0, 1.0, 0.0],
        stop_time_s=7.0,
        stop_class=2,
    )
    expected = simulate_chain(round_vehicle, chain, stop_rule=StopRule.EXPECTED)
    counted = simulate_chain(round_vehicle, chain, stop_rule=StopRule.COUNTED)
    assert expected.energy_j == counted.energy_j
    assert expected.duration_s == counted.duration_s


@pytest.mark.parametrize("link_model", list(LinkModel))
def test_expected_stops_on_long_links_equal_the_mean_over_all_outcomes(round_vehicle, make_chain, link_model):
    # where every entry reaches the limit, the go-speed has no history and the mean over 2³ outcomes is exact
    length, limit, grade = [900.0, 700.0, 800.0, 600.0], [20.0, 12.0, 25.0, 15.0], [0.02, -0.03, 0.0, 0.01]
    probability = [0.4, 0.1, 0.7, 0.0]
    mean_j = mean_s = 0.0
    for outcome in itertools.product((0.0, 1.0), repeat=3):
        certain = make_chain(length, limit, grade, stop_probability_frac=[*outcome, 0.0], stop_time_s=9.0)
        weight = math.prod(p if stop else 1.0 - p for p, stop in zip(probability, outcome, strict=False))
        result = simulate_chain(round_vehicle, certain, link_model=link_model)
        mean_j += weight * result.energy_j
        mean_s += weight * result.duration_s
    chain = make_chain(length, limit, grade, stop_probability_frac=probability, stop_time_s=9.0)
    expected = simulate_chain(round_vehicle, chain, link_model=link_model)
    assert expected.energy_j == pytest.approx(mean_j, rel=1e-12)
    assert expected.duration_s == pytest.approx(mean_s, rel=1e-12)
    assert expected.stop_count == pytest.approx(1.2)
    assert expected.standstill_s == pytest.approx(1.2 * 9.0)


def test_short_link_after_a_possible_stop_carries_the_root_mean_square(round_vehicle, make_chain):
    # the 45 m link is entered at 20 with 0.64 and from rest (→ 15 m/s) with 0.36: √(0.64·400 + 0.36·225)
    result = simulate_chain(
        round_vehicle,
        make_chain([1000.0, 45.0, 500.0], 20.0, stop_probability_frac=[0.36, 0.0, 0.0]),
    )
    assert result.links[0].speed_end_mps == 20.0
    assert result.links[1].speed_end_mps == pytest.approx(math.sqrt(337.0))
