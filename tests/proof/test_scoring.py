"""Each rule of docs/proof.md on answers by hand, one that it counts and one that it does not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from proof.answers import Spot
from proof.scoring import (
    apart_m,
    cannot_tell,
    claims_falsely,
    clearly_wrong,
    intervals_cover,
    is_false,
    locates,
    mape_frac,
    mean_square,
    misattributes,
    names_at_all,
    names_clearly,
    overlap_frac,
    resolves,
    says_anything,
    says_too_few,
    told_of,
)
from proof.worlds.world import FaultTruth, OutsideTruth, WorldKind
from tests.proof.made_up import HELD_OUT, answer, claim, effect, label, trip

SPOT = Spot("speed", 50.0, 60.0, 900.0)


def test_any_finding_in_a_null_world_is_a_false_claim_and_so_is_a_tool_that_broke() -> None:
    assert claims_falsely(answer(claim("thermal")))
    assert claims_falsely(answer(claim("thermal", "rolling")))
    assert claims_falsely(answer(error="ValueError: no"))
    assert not claims_falsely(answer())
    assert not claims_falsely(answer(spots=(SPOT,)))


def test_saying_anything_counts_what_is_unexplained_too() -> None:
    assert says_anything(answer(spots=(SPOT,)))
    assert not says_anything(answer(parameters=("mass_kg",)))


def test_strict_recall_wants_a_finding_of_the_family_without_rivals() -> None:
    assert names_clearly(answer(claim("rolling"), claim("thermal")), "thermal")
    assert not names_clearly(answer(claim("thermal", "rolling")), "thermal")
    assert not names_clearly(answer(claim("rolling")), "thermal")


def test_lenient_recall_takes_rivals_too() -> None:
    assert names_at_all(answer(claim("rolling", "thermal")), "thermal")
    assert not names_at_all(answer(claim("rolling", "wind")), "thermal")


def test_a_finding_is_false_where_neither_it_nor_a_rival_is_true() -> None:
    assert is_false(claim("rolling"), ("thermal",))
    assert is_false(claim("rolling", "wind"), ("thermal",))
    assert not is_false(claim("rolling", "thermal"), ("thermal",))
    assert is_false(claim("rolling"), ())


def test_cannot_tell_wants_the_true_family_and_a_declared_confounder_in_one_finding() -> None:
    truth = label(WorldKind.CONFOUNDED, "thermal", confounded_with=("rolling",))
    assert cannot_tell(answer(claim("thermal", "rolling")), truth)
    assert cannot_tell(answer(claim("rolling", "thermal")), truth)
    assert not cannot_tell(answer(claim("thermal", "wind")), truth)
    assert not cannot_tell(answer(claim("thermal"), claim("rolling")), truth)


def test_a_clear_finding_of_a_false_family_is_clearly_wrong() -> None:
    truth = label(WorldKind.CONFOUNDED, "thermal")
    assert clearly_wrong(answer(claim("rolling")), truth)
    assert not clearly_wrong(answer(claim("rolling", "wind")), truth)
    assert not clearly_wrong(answer(claim("thermal")), truth)


def test_a_separated_world_is_resolved_by_the_true_family_alone() -> None:
    truth = label(WorldKind.CONFOUNDED_SEPARATED, "thermal")
    assert resolves(answer(claim("thermal")), truth)
    assert not resolves(answer(claim("thermal", "rolling")), truth)
    assert not resolves(answer(claim("thermal"), claim("rolling")), truth)


def test_what_no_library_has_is_misattributed_by_a_large_finding_or_one_without_a_flag() -> None:
    assert misattributes(answer(claim("rolling", share_frac=0.01), spots=(SPOT,)))
    assert misattributes(answer(claim("rolling", share_frac=0.004)))
    assert misattributes(answer(error="ValueError: no"))
    assert not misattributes(answer(claim("rolling", share_frac=0.004), spots=(SPOT,)))
    assert not misattributes(answer())


@pytest.mark.parametrize(
    ("axis", "true", "spot", "found"),
    [
        ("speed", (50.0, 60.0), Spot("speed", 52.0, 62.0, 900.0), True),  # 8 of 12
        ("speed", (50.0, 60.0), Spot("speed", 55.0, 65.0, 900.0), False),  # 5 of 15
        ("speed", (50.0, 60.0), Spot("altitude", 50.0, 60.0, 900.0), False),
        ("soc", (0.5, 0.6), Spot("soc", 50.0, 61.0, 900.0), True),  # a share in labels, percent in the tool
        ("time_of_trip", (5.0, 9.0), Spot("since_start", 5.0, 9.0, 900.0), True),
        ("place", (48.0, 16.0), Spot("place", 48.0, 16.0067, 900.0), True),  # 498 m to the east
        ("place", (48.0, 16.0), Spot("place", 48.0046, 16.0, 900.0), False),  # 511 m to the north
    ],
)
def test_a_cause_is_located_on_its_axis_where_intervals_overlap_by_half_or_places_are_near(
    axis: str, true: tuple[float, float], spot: Spot, found: bool
) -> None:
    truth = OutsideTruth(axis, *true, 900.0, "", 1000.0 if axis == "place" else None)
    assert locates(answer(spots=(spot,)), truth) is found
    assert not locates(answer(), truth)


def test_overlap_is_intersection_over_union() -> None:
    assert overlap_frac((0.0, 2.0), (1.0, 4.0)) == pytest.approx(0.25)
    assert overlap_frac((0.0, 1.0), (2.0, 3.0)) == 0.0


def test_distance_of_places_shrinks_with_latitude() -> None:
    assert apart_m((60.0, 10.0), (60.0, 10.01)) == pytest.approx(0.5 * 1111.95, rel=1e-3)


@pytest.mark.parametrize(
    ("said", "right"),
    [
        (None, False),
        ((0.83, 0.80, 0.86), True),
        ((0.89, 0.875, 0.905), True),  # 2.5 points beside its interval
        ((0.79, 0.77, 0.815), False),  # 3.5 points beside it
        ((0.98, 0.89, 1.07), False),
    ],
)
def test_an_aged_battery_is_told_rightly_within_three_points_of_its_interval(
    said: tuple[float, float, float] | None, right: bool
) -> None:
    aged = replace(label(WorldKind.FAULT), fault=FaultTruth("aged", (), 0.85))
    assert told_of(replace(answer(), capacity_frac=said), aged) is right


def test_too_few_has_to_be_said_and_nothing_claimed() -> None:
    assert says_too_few(answer(verdict="too_few_trips"))
    assert not says_too_few(answer(verdict="nothing_missing"))
    assert not says_too_few(answer(claim("thermal"), verdict="too_few_trips"))


def test_intervals_are_held_against_the_net_energy_of_the_fitted_trips() -> None:
    truth = label(WorldKind.SINGLE, "thermal")  # 0.5 kWh on each of two fitted trips
    assert intervals_cover(answer(claim("thermal", energy_kwh=1.09)), truth) == (True,)
    assert intervals_cover(answer(claim("thermal", energy_kwh=1.11)), truth) == (False,)
    assert intervals_cover(answer(claim("rolling", energy_kwh=1.0)), truth) == ()
    assert intervals_cover(answer(claim("thermal", half_kwh=None)), truth) == ()


def test_findings_and_effects_of_one_family_are_added_before_intervals_are_judged() -> None:
    """0.7 + 0.7 kWh claimed of 1.0 + 0.28 true: 0.12 off, within √(0.1² + 0.1²) = 0.14."""
    both = {"true_thermal": effect("thermal"), "other": effect("thermal", kwh=0.14)}
    truth = replace(label(WorldKind.SEVERAL, "thermal"), effects=both)
    assert intervals_cover(answer(claim("thermal", energy_kwh=0.7), claim("thermal", energy_kwh=0.7)), truth) == (True,)


def test_errors_of_held_out_trips_leave_fitted_ones_aside() -> None:
    """Errors of 0.2 and −0.1 kWh on trips of 2 and 3 kWh, whose mean is 2.5 kWh."""
    trips = (trip("T1", after=9.0), trip(HELD_OUT[0], measured=2.0), trip(HELD_OUT[1], measured=3.0))
    given = answer(trips=trips)
    assert mean_square(given, [2.2, 2.9]) == pytest.approx((0.08**2 + 0.04**2) / 2.0)
    assert mape_frac(given, [2.2, 2.9]) == pytest.approx((0.1 + 1.0 / 30.0) / 2.0)
