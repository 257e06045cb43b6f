"""Trips that are kept out of a fit: named, or drawn over all temperatures."""

from __future__ import annotations

import pytest

from diagnosis.holdout import HoldoutError, drawn_trips, named_trips

IDS = [f"Trip{letter}{number:02d}" for letter in "AB" for number in range(10)]
UNKNOWN: list[float | None] = [None] * len(IDS)


def test_named_trips_are_those_of_ids_and_patterns() -> None:
    assert named_trips(IDS, ["TripA03", "TripB0[12]"]) == {"TripA03", "TripB01", "TripB02"}
    assert named_trips(IDS, []) == frozenset()


def test_id_with_pattern_characters_names_itself() -> None:
    assert named_trips(["drive [1]", "drive 1"], ["drive [1]"]) == {"drive [1]", "drive 1"}
    assert named_trips(["drive [1]"], ["drive [1]"]) == {"drive [1]"}


def test_pattern_that_matches_nothing_is_named() -> None:
    with pytest.raises(HoldoutError, match=r"holdout is 'tripC\*', allowed: .*TripA00"):
        named_trips(IDS, ["TripA*", "tripC*"])


@pytest.mark.parametrize(("share", "count"), [(0.0, 0), (0.01, 1), (0.3, 6), (0.5, 10), (0.9, 18)])
def test_share_of_the_trips_is_drawn(share: float, count: int) -> None:
    assert len(drawn_trips(IDS, UNKNOWN, share, 1)) == count


def test_one_of_two_trips_is_drawn_and_never_both() -> None:
    assert len(drawn_trips(["a", "b"], [None, None], 0.9, 1)) == 1


def test_same_seed_draws_the_same_whatever_the_order_and_others_draw_others() -> None:
    kelvins: list[float | None] = [270.0 + k for k in range(len(IDS))]
    first = drawn_trips(IDS, kelvins, 0.3, 5)
    assert drawn_trips(IDS[::-1], kelvins[::-1], 0.3, 5) == first
    assert len({drawn_trips(IDS, kelvins, 0.3, seed) for seed in range(20)}) > 10


@pytest.mark.parametrize("seed", range(10))
def test_each_stratum_of_temperature_gives_one_trip(seed: int) -> None:
    # 20 trips, one a kelvin, not in order; 5 strata of 4: 0..3, 4..7, 8..11, 12..15, 16..19 K
    warmth = [(7 * k) % 20 for k in range(20)]
    drawn = drawn_trips(IDS, [270.0 + k for k in warmth], 0.25, seed)
    strata = sorted(warmth[IDS.index(trip_id)] // 4 for trip_id in drawn)
    assert strata == [0, 1, 2, 3, 4]


def test_trips_of_unknown_temperature_are_drawn_in_proportion() -> None:
    kelvins: list[float | None] = [270.0 if trip_id.startswith("TripA") else None for trip_id in IDS]
    for seed in range(10):
        drawn = drawn_trips(IDS, kelvins, 0.2, seed)
        assert sum(trip_id.startswith("TripB") for trip_id in drawn) == 2


@pytest.mark.parametrize("share", [-0.1, 0.95, float("nan")])
def test_share_out_of_range_is_refused(share: float) -> None:
    with pytest.raises(HoldoutError, match=r"holdout_fraction is .*, allowed: 0\.\.0\.9"):
        drawn_trips(IDS, UNKNOWN, share, 1)


@pytest.mark.parametrize("ids", [[], ["only"]])
def test_share_of_fewer_than_two_trips_is_refused(ids: list[str]) -> None:
    with pytest.raises(HoldoutError, match="allowed: 0 with"):
        drawn_trips(ids, [None] * len(ids), 0.3, 1)
