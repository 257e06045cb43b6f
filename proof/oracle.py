"""The oracle: the same fit, given which effects act and nothing else, as the best that could be reached."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.causes.battery import battery_loss
from diagnosis.causes.driven import driven, with_vehicle
from diagnosis.causes.library import LIBRARY
from diagnosis.fit.fitting import moved
from diagnosis.fit.jackknife import additions, solve
from diagnosis.fit.model import residual_w
from diagnosis.fit.windows import FREE, trip_of
from proof.answers import Rule
from proof.prepared import predicted_kwh, weighed, windowed_and_weighed

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from diagnosis.causes.terms import Candidate, Term
    from diagnosis.fit.jackknife import Equations, Solution
    from diagnosis.fit.windows import WindowedTrip
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle
    from proof.prepared import Prepared

ORACLE: Final = "oracle"
# The library's effects that stand for one of a truth generator. A roof box, an unknown load or wind are levels of
# single trips, which no fit can know of a trip that it has not seen; those worlds have no oracle.
KNOWN_AS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "cabin_heating": ("cabin_heating",),
        "air_conditioning": ("air_conditioning",),
        "cabin_climate": ("cabin_heating", "air_conditioning"),
        "battery_conditioning": ("battery_heating", "battery_cooling"),
        "tyre_temperature": ("rolling_temperature", "tyre_warm_up"),
        "wet_road": ("wet_road",),
        "air_density": ("air_density",),
        "resistance_known": ("battery_resistance",),
        "wind_known": ("wind", "side_wind"),
        "payload_known": ("payload",),
        "copper_loss": ("load_loss",),
        "regen_cap": ("recuperation_cap",),
        "regen_cold": ("recuperation_cold",),
        "regen_cutoff": ("recuperation_low_speed",),
    }
)


def true_terms(effects: Iterable[str]) -> tuple[Term, ...]:
    """The library's terms of true effects; none where there is no effect, or one of them has no term."""
    names = tuple(effects)
    if not names or any(name not in KNOWN_AS for name in names):
        return ()
    known = {effect for name in names for effect in KNOWN_AS[name]}
    return tuple(term for term in LIBRARY if term.effect in known)


def oracle(recordings: Sequence[Recording], vehicle: Vehicle, held_out: Collection[str], terms: Sequence[Term]) -> Rule:
    """Energies of the held-out trips by a fit of exactly these terms, as the tool fits: twice, with shapes profiled."""
    battery = battery_loss([recording for recording in recordings if recording.id not in held_out])
    trips = [trip_of(recording, driven(recording, vehicle, battery)) for recording in recordings]
    _, solution = _fit(trips, held_out, vehicle, vehicle, terms)
    better = moved(vehicle, solution)
    again: Sequence[WindowedTrip] = [replace(trip, drive=with_vehicle(trip.drive, better)) for trip in trips]
    ready, solution = _fit(again, held_out, better, vehicle, terms)
    families = sorted({term.family.value for term in terms})
    return Rule(ORACLE, tuple(families), predicted_kwh(ready.kept, solution))


def _fit(
    trips: Sequence[WindowedTrip],
    held_out: Collection[str],
    vehicle: Vehicle,
    nameplate: Vehicle,
    terms: Sequence[Term],
) -> tuple[Prepared, Solution]:
    ready = windowed_and_weighed(trips, held_out, vehicle, nameplate, terms)
    system, solution = ready.system, solve(ready.system, FREE)
    for _ in range(2):  # the noise depends on what is fitted, and shapes on the noise
        solution = solve(system, [*FREE, *(candidate.label for candidate in _shaped(system, ready.tried))])
        residuals_w = [residual_w(trip, solution, solution.without[k]) for k, trip in enumerate(ready.fitted)]
        system = weighed(ready.fitted, residuals_w, system.prior)
    return ready, solution


def _shaped(system: Equations, tried: Sequence[Candidate]) -> list[Candidate]:
    """Each term at the shape that predicts left-out trips best beside the others; those of the wrong sign go."""
    by_term: dict[str, list[Candidate]] = {}
    for candidate in tried:
        by_term.setdefault(candidate.term.name, []).append(candidate)
    chosen = {name: variants[len(variants) // 2] for name, variants in by_term.items()}
    for _ in range(2):
        for name, variants in by_term.items():
            if name in chosen:
                beside = [*FREE, *(candidate.label for key, candidate in chosen.items() if key != name)]
                losses = additions(system, beside, [candidate.label for candidate in variants]).losses.sum(axis=0)
                chosen[name] = variants[int(np.argmin(losses))]
        solution = solve(system, [*FREE, *(candidate.label for candidate in chosen.values())])
        wrong = [
            name
            for name, candidate in chosen.items()
            if candidate.term.positive and solution.value(candidate.label) <= 0.0
        ]
        for name in wrong:
            del chosen[name]
    return list(chosen.values())
