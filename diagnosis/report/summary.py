"""The top of the report: consumption as measured, as the file has it and as learned, and what to do next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from diagnosis.answer.capacity import CAPACITY
from diagnosis.answer.results import Verdict
from diagnosis.report.text import SPACE, fixed, listed, spoken

if TYPE_CHECKING:
    from collections.abc import Mapping

    from diagnosis.answer.results import Diagnosis

LEAST_KM: Final = 1.0  # of all drives, for a consumption to mean something
DO_ABOUT: Final[Mapping[str, str]] = {
    "power_w": "Record the battery's power, or its voltage and current.",
    "elevation_m": "Record height, or positions where a map or a file has heights: slopes take as much as tyres do.",
    "ambient_k": "Record the temperature outside.",
}
UNIT_NAMES: Final[Mapping[str, str]] = {
    "ambient_k": "temperature",
    "speed_mps": "speed",
    "power_w": "power",
    "elevation_m": "height",
    "odometer_m": "odometer",
}


class Bar(NamedTuple):
    """One bar: what it is, how long (share of the longest), its number, and its colour by class."""

    label: str
    width_frac: float
    text: str
    colour: str


def consumption_bars(diagnosis: Diagnosis) -> list[Bar]:
    """Consumption of all drives per 100 km: measured, by the vehicle's file, and with what was learned."""
    distance_km = sum(trip.distance_km for trip in diagnosis.trips)
    if distance_km < LEAST_KM:
        return []
    kinds = (
        ("Your drives took", "measured", sum(trip.measured_kwh for trip in diagnosis.trips)),
        ("The vehicle's file says", "before", sum(trip.nameplate_kwh for trip in diagnosis.trips)),
        ("With what was learned", "after", sum(trip.after_kwh for trip in diagnosis.trips)),
    )
    per_100_km = [100.0 * kwh / distance_km for _, _, kwh in kinds]
    longest = max(per_100_km)
    if longest <= 0.0:
        return []
    return [
        Bar(label, max(value, 0.0) / longest, f"{fixed(value, 1)}{SPACE}kWh/100{SPACE}km", colour)
        for (label, colour, _), value in zip(kinds, per_100_km, strict=True)
    ]


def next_steps(diagnosis: Diagnosis) -> list[str]:
    """What a driver can do to know more, or with what is known."""
    steps = [DO_ABOUT[lack.channel] for lack in diagnosis.missing if lack.decisive and lack.channel in DO_ABOUT]
    doubted: dict[str, set[str]] = {}
    for note in diagnosis.data_quality:
        if note.kind == "unit":
            doubted.setdefault(UNIT_NAMES.get(note.channel, spoken(note.channel)), set()).add(note.trip_id)
    steps += [f"Look at the unit of the {name} in {listed(sorted(trips))}." for name, trips in doubted.items()]
    if diagnosis.other_car:
        steps.append("Look whether the vehicle's file is of the car that was driven, and correct it.")
    odd = sorted({trip for place in diagnosis.unexplained if place.axis == "trip" for trip in place.trips})
    if odd:
        steps.append(f"Look at {listed(odd)}: another car, an unusual load, or a fault of the logger.")
    steps += [
        f"To tell causes apart, make {finding.separating_recording[0].lower()}{finding.separating_recording[1:]}"
        for finding in diagnosis.findings
        if finding.separating_recording
    ]
    if diagnosis.verdict is Verdict.TOO_FEW_TRIPS:
        steps.append(f"Record at least {diagnosis.model.get('least_trips', 6)} drives, better twenty, in all weathers.")
    capacity = diagnosis.capacity
    if capacity is not None and capacity.text:
        steps.append(
            "Ranges with effects.json are those of the battery as it is."
            if capacity.is_carried
            else "Look at how much of the battery the vehicle's file and the charge on the display stand for."
        )
    if any(name != CAPACITY for name in diagnosis.parameters):
        steps.append(
            "Plan routes and ranges with effects.json: it meets drives that it has not seen better than the file does."
        )
    elif diagnosis.verdict is Verdict.NOTHING_MISSING and not steps:
        steps.append("Nothing: routes and ranges are right as they are.")
    return list(dict.fromkeys(steps))
