"""Which trips are kept out of a fit, so that it can be judged on drives that it has not seen."""

from __future__ import annotations

import math
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.errors import DiagnosisError
from energy.errors import Refusal

if TYPE_CHECKING:
    from collections.abc import Sequence

MOST_FRAC: Final = 0.9  # assumed: with less than a tenth of the trips fitted, what is held out judges nothing


class HoldoutError(Refusal, DiagnosisError):
    """Trips that can't be held out: names the field, its value and what is allowed."""

    code = "invalid_request"

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(field, value, allowed, message=f"{field} is {value!r}, allowed: {allowed}")


def named_trips(trip_ids: Sequence[str], patterns: Sequence[str]) -> frozenset[str]:
    """Trips that ids or patterns such as "TripB*" name, letter case counting.

    Raises HoldoutError naming the first pattern that matches no trip.
    """
    found: set[str] = set()
    for pattern in patterns:
        matched = {trip_id for trip_id in trip_ids if trip_id == pattern or fnmatchcase(trip_id, pattern)}
        if not matched:
            raise HoldoutError("holdout", pattern, f"an id of a trip, or a pattern of ids: {_some(trip_ids)}")
        found |= matched
    return frozenset(found)


def drawn_trips(
    trip_ids: Sequence[str], ambient_k: Sequence[float | None], share_frac: float, seed: int
) -> frozenset[str]:
    """Trips drawn at random, the same for the same seed: share_frac of all, at least one, but never all.

    ambient_k: mean air temperature of each trip [K], None where it is not known. The trips are put in the order of
    their temperature and cut into as many strata of equal size as trips are drawn, one from each, so that what is held
    out is as warm and as cold as what is fitted; those of unknown temperature follow after the others. The order that
    trips are given in does not matter. share_frac: 0..0.9 [-]; at 0 none is drawn.

    Raises HoldoutError where share_frac is out of range, or above 0 with fewer than two trips.
    """
    if not 0.0 <= share_frac <= MOST_FRAC:
        raise HoldoutError("holdout_fraction", share_frac, f"0..{MOST_FRAC:g}")
    if share_frac == 0.0:
        return frozenset()
    count = len(trip_ids)
    if count < 2:
        raise HoldoutError("holdout_fraction", share_frac, f"0 with {count} trip{'s' * (count != 1)}")
    drawn = min(max(round(share_frac * count), 1), count - 1)
    warmth = {
        trip_id: math.inf if kelvin is None else kelvin for trip_id, kelvin in zip(trip_ids, ambient_k, strict=True)
    }
    ordered = sorted(trip_ids, key=lambda trip_id: (warmth[trip_id], trip_id))
    bounds = np.linspace(0, count, drawn + 1).round().astype(int).tolist()
    random = np.random.default_rng(seed)
    return frozenset(ordered[int(random.integers(begin, end))] for begin, end in pairwise(bounds))


def _some(trip_ids: Sequence[str], most: int = 20) -> str:
    names = ", ".join(sorted(trip_ids)[:most])
    return names if len(trip_ids) <= most else f"{names} and {len(trip_ids) - most} more"
