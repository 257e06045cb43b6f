"""The tables and the picture of docs/uncertainty.md, computed; run as `python -m docs.uncertainty_table` to renew them.

Needs the BMW i3 recordings in ../shared/data (DOI 10.21227/6jr9-5235), which may not be redistributed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from diagnosis.causes.driven import median_ambient
from diagnosis.comparison.coverage import (
    Coverage,
    TripPrediction,
    at_terminals,
    coverage,
    coverage_png,
    predict,
    source_model,
)
from diagnosis.comparison.tables import markdown_table
from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.reading import Recording, read_recording
from energy.conditions import Conditions
from energy.replay.replay import SMOOTHING_M, replay
from energy.units import JOULE_PER_KWH, METRE_PER_KM, ZERO_CELSIUS_K
from energy.vehicle.files import AnyVehicle, load_vehicle
from energy.vehicle.vehicle import Vehicle

DOCS: Final = Path(__file__).resolve().parent
PAGE: Final = DOCS / "uncertainty.md"
PICTURE: Final = DOCS / "images" / "uncertainty-coverage.png"
VEHICLE: Final = DOCS.parent / "data" / "vehicles" / "bmw-i3-60ah.toml"
RECORDINGS: Final = DOCS.parent.parent / "shared/data/recordings/bmw-i3"
TRIP_COUNT: Final = 40
MODELS: Final = (("(a) source's model", source_model), ("(b) with air temperature", median_ambient))
GROUPS: Final = (("summer", "TripA"), ("winter", "TripB"), ("all", "Trip"))
REPORTED: Final = (NoteKind.REPAIRED, NoteKind.STUCK, NoteKind.GAP, NoteKind.FROZEN, NoteKind.JUMP)

Predictions = tuple[TripPrediction, ...]


def recordings() -> tuple[Recording, ...]:
    """All 40 recordings; raises FileNotFoundError where they are not there."""
    paths = sorted(RECORDINGS.glob("Trip*.csv.gz"))
    if len(paths) != TRIP_COUNT:
        raise FileNotFoundError(f"{RECORDINGS} has {len(paths)} recordings, needs {TRIP_COUNT}")
    return tuple(read_recording(path) for path in paths)


def bundled_i3() -> Vehicle:
    """The bundled vehicle, none of whose numbers is fitted to the recordings."""
    vehicle = load_vehicle(VEHICLE)
    if not isinstance(vehicle, Vehicle):
        raise TypeError(f"{VEHICLE} is a consumption table, needs a vehicle given by forces")
    return vehicle


def with_tables(text: str, trips: Sequence[Recording]) -> tuple[str, bytes]:
    """The page with all tables renewed between their markers, and the picture."""
    vehicle = bundled_i3()
    found = {name: predict(vehicle, trips, conditions_of) for name, conditions_of in MODELS}
    tables = {
        "coverage": _coverage(found),
        "standing": _standing(found),
        "shares": _shares(vehicle, trips, found[MODELS[1][0]]),
        "choices": _choices(vehicle, trips),
        "repairs": _repairs(trips),
        "trips": _trips(*found.values()),
    }
    for name, table in tables.items():
        text = with_place(text, name, table)
    return text, coverage_png(list(found.items()), lambda trip: trip.trip_id.startswith("TripB"))


def with_place(text: str, name: str, table: str) -> str:
    """The page with one table renewed; raises ValueError where it does not have one place for it."""
    begin, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise ValueError(f"docs/uncertainty.md does not have one place for the table {name!r}")
    before, rest = text.split(begin)
    return f"{before}{begin}{table}\n{end}{rest.split(end)[1]}"


def _group(trips: Sequence[TripPrediction], prefix: str) -> Predictions:
    return tuple(trip for trip in trips if trip.trip_id.startswith(prefix))


def _percent(frac: float, digits: int = 0) -> str:
    return f"{100.0 * frac:+.{digits}f}".replace("-", "−")


def _covered(found: Coverage) -> str:
    return (
        f"{found.covered} of {found.trips}: {100.0 * found.covered / found.trips:.0f} %"
        f" ({100.0 * found.covered_low_frac:.0f} … {100.0 * found.covered_high_frac:.0f})"
    )


def _coverage(models: dict[str, Predictions]) -> str:
    rows = []
    for name, trips in models.items():
        for label, prefix in GROUPS:
            found = coverage(_group(trips, prefix))
            rows.append(
                (
                    f"{name}, {label}",
                    _covered(found),
                    f"{found.below}",
                    f"{found.above}",
                    f"± {100.0 * found.half_width_frac:.0f}",
                    _percent(found.bias_frac, 1),
                    f"{100.0 * found.sd_frac:.1f}",
                    f"{100.0 * found.mape_frac:.1f}",
                )
            )
    header = [
        "",
        "measured in P10 … P90",
        "below P10",
        "above P90",
        "half width [%]",
        "bias [%]",
        "SD [%]",
        "MAPE [%]",
    ]
    return markdown_table(header, rows)


def _standing(models: dict[str, Predictions]) -> str:
    """Mean power at standstill, and what its error would be over the whole trip."""
    rows = []
    for name, trips in models.items():
        for label, prefix in GROUPS[:2]:
            measured_w, simulated_w, shares, errors = [], [], [], []
            for trip in _group(trips, prefix):
                errors.append(trip.simulated_j / trip.measured_j - 1.0)
                if trip.standing_measured_w is not None and trip.standing_simulated_w is not None:
                    measured_w.append(trip.standing_measured_w)
                    simulated_w.append(trip.standing_simulated_w)
                    shares.append((simulated_w[-1] - measured_w[-1]) * trip.duration_s / trip.measured_j)
            means = (float(np.mean(values)) for values in (measured_w, simulated_w, errors, shares))
            measured, simulated, error, share = means
            rows.append(
                (
                    f"{name}, {label}",
                    f"{measured:.0f}",
                    f"{simulated:.0f}",
                    _percent(error, 1),
                    _percent(share, 1),
                    _percent(error - share, 1),
                )
            )
    header = [
        "means over trips",
        "measured at standstill [W]",
        "simulated [W]",
        "error of the energy [%]",
        "of it standstill power, held on [%]",
        "rest [%]",
    ]
    return markdown_table(header, rows)


def _shares(vehicle: Vehicle, trips: Sequence[Recording], both: Predictions) -> str:
    certain = dataclasses.replace(vehicle, sd=MappingProxyType({}))
    cases = (
        ("parameters and residual", both),
        ("parameters alone", predict(vehicle, trips, median_ambient, residual_sd_frac=0.0)),
        ("residual alone", predict(certain, trips, median_ambient)),
    )
    rows = []
    for name, found in cases:
        whole = coverage(found)
        rows.append((name, f"± {100.0 * whole.half_width_frac:.0f}", _covered(whole)))
    return markdown_table(["(b), all trips", "half width [%]", "measured in P10 … P90"], rows)


def _choices(vehicle: Vehicle, trips: Sequence[Recording]) -> str:
    """Bias of the plain simulation for other steps of time and other smoothing of heights."""
    outside = at_terminals(vehicle)
    cases = (
        ("1 s, 200 m", outside, 1.0, SMOOTHING_M),
        ("0.1 s, 200 m", outside, 0.1, SMOOTHING_M),
        ("2 s, 200 m", outside, 2.0, SMOOTHING_M),
        ("1 s, 50 m", outside, 1.0, 50.0),
        ("1 s, 500 m", outside, 1.0, 500.0),
        ("1 s, 200 m, loss inside the cold battery counted", vehicle, 1.0, SMOOTHING_M),
    )
    rows = []
    for name, driven, step_s, smoothing_m in cases:
        cells = []
        for _, conditions_of in MODELS:
            errors = [_error(driven, trip, conditions_of, step_s, smoothing_m) for trip in trips]
            for _, prefix in GROUPS[:2]:
                own = [error for trip, error in zip(trips, errors, strict=True) if trip.id.startswith(prefix)]
                cells.append(_percent(float(np.mean(own)), 1))
        rows.append((name, *cells))
    labels = [f"{name[:3]}, {label} [%]" for name, _ in MODELS for label, _ in GROUPS[:2]]
    return markdown_table(["step, smoothing of heights", *labels], rows)


def _error(
    vehicle: AnyVehicle,
    trip: Recording,
    conditions_of: Callable[[Recording], Conditions],
    step_s: float,
    smoothing_m: float,
) -> float:
    driven = replay(vehicle, trip.profile(step_s), conditions=conditions_of(trip), smoothing_m=smoothing_m)
    return driven.energy_j / trip.energy_j() - 1.0


def _repairs(trips: Sequence[Recording]) -> str:
    rows = [
        f"| {trip.id} | {note.kind} | {note.channel or 'all'} | {note.text} |"
        for trip in trips
        for note in trip.notes
        if note.kind in REPORTED
    ]
    return "\n".join(("| trip | kind | channel | what was found and done |", "|---|---|---|---|", *rows))


def _trips(plain: Predictions, warm: Predictions) -> str:
    rows = [
        (
            a.trip_id,
            f"{a.distance_m / METRE_PER_KM:.1f}",
            f"{a.duration_s / 60.0:.0f}",
            "–" if a.ambient_k is None else f"{a.ambient_k - ZERO_CELSIUS_K:.1f}".replace("-", "−"),
            f"{a.measured_j / JOULE_PER_KWH:.2f}",
            *(
                cell
                for trip in (a, b)
                for cell in (_range(trip), "in" if trip.covered else "above" if _high(trip) else "below")
            ),
        )
        for a, b in zip(plain, warm, strict=True)
    ]
    header = [
        "trip",
        "km",
        "min",
        "°C",
        "measured [kWh]",
        "(a) P10 P50 P90",
        "measured is",
        "(b) P10 P50 P90",
        "measured is",
    ]
    return markdown_table(header, rows)


def _high(trip: TripPrediction) -> bool:
    return trip.measured_j > trip.energy_p90_j


def _range(trip: TripPrediction) -> str:
    return " ".join(
        f"{value / JOULE_PER_KWH:.2f}" for value in (trip.energy_p10_j, trip.energy_p50_j, trip.energy_p90_j)
    )


if __name__ == "__main__":
    page, picture = with_tables(PAGE.read_text(encoding="utf-8"), recordings())
    PAGE.write_text(page, encoding="utf-8")
    PICTURE.write_bytes(picture)
