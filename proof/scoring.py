"""The rules by which an answer is held against the truth; docs/proof.md has them in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.results import Verdict

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from proof.answers import Answer, Claim, Rule, Spot
    from proof.worlds.world import OutsideTruth, WorldLabel

LEAST_OVERLAP_FRAC: Final = 0.5
NEAR_M: Final = 500.0
METRES_PER_DEGREE: Final = 111_195.0
LEAST_TRIPS_FRAC: Final = 0.75  # of the trips that carry something or are said to, those that do both
LEAST_SHARE_FRAC: Final = 0.01
CAPACITY_NEAR: Final = 0.03  # of the file's capacity, beyond an interval within which the truth may lie
# Axis of a label → axis of the tool, and what turns the label's unit into the tool's.
AXES: Final[Mapping[str, tuple[str, float]]] = MappingProxyType(
    {
        "altitude": ("altitude", 1.0),
        "place": ("place", 1.0),
        "speed": ("speed", 1.0),
        "time_of_trip": ("since_start", 1.0),
        "soc": ("soc", 100.0),
        "heading": ("heading", 1.0),
    }
)


@dataclass(frozen=True, slots=True)
class Case:
    """A world's label, what the tool said, and the oracle's energies where the world has an oracle."""

    label: WorldLabel
    answer: Answer
    oracle: Rule | None = None


def claims_falsely(answer: Answer) -> bool:
    """Of a world without any effect: whether there is a finding, or the tool broke."""
    return bool(answer.claims) or answer.error is not None


def says_anything(answer: Answer) -> bool:
    """Of a world without any effect: whether there is a finding or anything unexplained, or the tool broke."""
    return bool(answer.claims or answer.spots) or answer.error is not None


def is_clear(claim: Claim) -> bool:
    """Whether a finding has no rival of another family."""
    return not claim.rivals


def names_clearly(answer: Answer, family: str) -> bool:
    """Whether a finding is of the family and nothing else would do: the strict recall."""
    return any(claim.family == family and is_clear(claim) for claim in answer.claims)


def names_at_all(answer: Answer, family: str) -> bool:
    """Whether a finding is of the family or has it among its rivals: the lenient recall."""
    return any(family in (claim.family, *claim.rivals) for claim in answer.claims)


def is_false(claim: Claim, families: Sequence[str]) -> bool:
    """Whether neither the family of a finding nor any of its rivals is true."""
    return not {claim.family, *claim.rivals} & set(families)


def cannot_tell(answer: Answer, label: WorldLabel) -> bool:
    """Whether a finding leaves open a true family and one that is declared to be confounded with it."""
    return any(
        {claim.family, *claim.rivals} & set(label.families)
        and {claim.family, *claim.rivals} & set(label.confounded_with)
        for claim in answer.claims
    )


def clearly_wrong(answer: Answer, label: WorldLabel) -> bool:
    """Whether a finding without rivals is of a family that is not true."""
    return any(is_clear(claim) and is_false(claim, label.families) for claim in answer.claims)


def resolves(answer: Answer, label: WorldLabel) -> bool:
    """Whether every true family is named clearly, and none that is not true."""
    return all(names_clearly(answer, family) for family in label.families) and not clearly_wrong(answer, label)


def misattributes(answer: Answer) -> bool:
    """Of a world whose cause no library has: a finding that holds a share of the energy, or one without a flag."""
    large = any(abs(claim.share_frac) >= LEAST_SHARE_FRAC for claim in answer.claims)
    return large or bool(answer.claims and not answer.spots) or answer.error is not None


def locates(answer: Answer, truth: OutsideTruth) -> bool:
    """Whether what is flagged is where the cause is.

    The same axis, and an interval that overlaps the true one by LEAST_OVERLAP_FRAC (intersection over union); for a
    place, within NEAR_M of its middle.
    """
    return any(_is_at(spot, truth) for spot in answer.spots)


def overlap_frac(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Intersection over union of two intervals (Jaccard 1901) [-]."""
    common = min(first[1], second[1]) - max(first[0], second[0])
    union = max(first[1], second[1]) - min(first[0], second[0])
    return max(common, 0.0) / union if union > 0.0 else 0.0


def apart_m(first_deg: tuple[float, float], second_deg: tuple[float, float]) -> float:
    """Distance of two near places given by latitude and longitude [m]."""
    north = first_deg[0] - second_deg[0]
    east = (first_deg[1] - second_deg[1]) * math.cos(math.radians(0.5 * (first_deg[0] + second_deg[0])))
    return METRES_PER_DEGREE * math.hypot(north, east)


def _is_at(spot: Spot, truth: OutsideTruth) -> bool:
    axis, factor = AXES[truth.axis]
    if spot.axis != axis:
        return False
    if truth.axis == "place":
        return apart_m((spot.low, spot.high), (truth.low, truth.high)) <= NEAR_M
    return overlap_frac((spot.low, spot.high), (factor * truth.low, factor * truth.high)) >= LEAST_OVERLAP_FRAC


def told_of(answer: Answer, label: WorldLabel) -> bool:
    """Whether what the field has done to a world's drives is told rightly; docs/proof.md says what counts."""
    truth = label.fault
    if truth is None or answer.error is not None:
        return False
    fitted = {trip.id for trip in answer.trips if not trip.held_out}
    known = {trip.id for trip in answer.trips}
    if truth.kind == "fahrenheit":
        return set(answer.doubted) == set(truth.trips)
    if truth.kind == "aged":
        said = answer.capacity_frac
        return said is not None and said[1] - CAPACITY_NEAR <= truth.size <= said[2] + CAPACITY_NEAR
    if truth.kind == "wrong_file":
        return bool(answer.parameters) or answer.other_car or answer.verdict == Verdict.PARAMETER_ERROR.value
    if truth.kind == "foreign":
        return any(set(spot.trips) == set(truth.trips) for spot in answer.spots if spot.axis == "trip")
    family = {"switch": "auxiliary", "step": "rolling", "drift": "rolling"}[truth.kind]
    on = set(truth.trips) & fitted & known
    return any(
        family in (claim.family, *claim.rivals) and overlap_of(set(claim.trips), on) >= LEAST_TRIPS_FRAC
        for claim in answer.claims
    )


def overlap_of(first: set[str], second: set[str]) -> float:
    """Trips in both of two sets by those in either [-]."""
    return len(first & second) / max(len(first | second), 1)


def says_too_few(answer: Answer) -> bool:
    """Whether the tool says that so few trips carry no conclusion, and draws none."""
    return answer.verdict == Verdict.TOO_FEW_TRIPS.value and not answer.claims


def intervals_cover(answer: Answer, label: WorldLabel) -> tuple[bool, ...]:
    """For each true family that is found: whether the 95 % interval of its energy holds the true energy.

    True is the net energy of all effects of the family over the fitted trips: with them less without, signs kept.
    Findings of one family are added, their half widths in quadrature.
    """
    fitted = {trip.id for trip in answer.trips if not trip.held_out}
    found = []
    for family in label.families:
        own = [claim for claim in answer.claims if claim.family == family]
        widths = [
            0.5 * (claim.high_kwh - claim.low_kwh)
            for claim in own
            if claim.low_kwh is not None and claim.high_kwh is not None
        ]
        if not own or len(widths) < len(own):
            continue
        true_kwh = sum(
            kwh
            for effect in label.effects.values()
            if effect.family == family
            for trip, kwh in effect.energy_kwh.items()
            if trip in fitted
        )
        claimed_kwh = sum(claim.energy_kwh for claim in own)
        found.append(abs(claimed_kwh - true_kwh) <= math.hypot(*widths))
    return tuple(found)


def mean_square(answer: Answer, predicted_kwh: Sequence[float]) -> float:
    """Mean square error of the held-out trips' energies, by the square of their mean measured energy [-]."""
    measured = np.array([trip.measured_kwh for trip in answer.held_out])
    error = (np.array(predicted_kwh) - measured) / measured.mean()
    return float(np.mean(error**2))


def mape_frac(answer: Answer, predicted_kwh: Sequence[float]) -> float:
    """Mean size of the relative error of the held-out trips' energies [-]."""
    measured = np.array([trip.measured_kwh for trip in answer.held_out])
    return float(np.mean(np.abs(np.array(predicted_kwh) / measured - 1.0)))
