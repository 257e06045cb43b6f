"""Real drives with their climate columns hidden: what the tool makes of them, held against the columns afterwards."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.engine import diagnose
from diagnosis.recordings.reading import read_recordings
from energy.units import JOULE_PER_KWH
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from proof.answers import answer_of, read_answer, write_answer
from proof.carriers import HIDDEN
from proof.errors import ProofError
from proof.figures import Figure, Target, drawn
from proof.source import OF_THE_TOOL, source_hash
from proof.tool import held_out_of, seed_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from diagnosis.recordings.reading import Recording
    from proof.answers import Answer

SPLITS: Final = 10  # so that each trip is held out about three times
GROUP: Final = "real drives, climate columns hidden"


@dataclass(frozen=True, slots=True)
class HiddenTrip:
    """One trip: how often it was held out, mean errors then, and mean thermal power, claimed and by the hidden columns.

    claimed_w: of all splits; claimed_held_out_w: of those that held it out, None where none did. hidden_w: heater and
    air conditioning, None where the columns do not say, which `why` explains.
    """

    id: str
    held_out: int
    before_frac: float | None
    after_frac: float | None
    claimed_w: float
    claimed_held_out_w: float | None
    hidden_w: float | None
    why: str = ""


@dataclass(frozen=True, slots=True)
class HiddenProof:
    """The figures, trip by trip what they rest on, the seeds of the splits, and the findings of each split."""

    figures: tuple[Figure, ...]
    trips: tuple[HiddenTrip, ...]
    seeds: tuple[int, ...]
    findings: tuple[tuple[str, ...], ...]


def split_seeds(seed: int) -> tuple[int, ...]:
    """The seeds of the splits."""
    return tuple(seed_of(f"{seed} {k}") for k in range(SPLITS))


def split_answered(recordings: Path, vehicle: Path, seed: int, file: Path) -> int:
    """Let the tool answer one split of real drives into a file, climate columns dropped on reading; returns its seed.

    Raises ProofError where the vehicle is a consumption table.
    """
    tool = source_hash(OF_THE_TOOL)
    if file.is_file() and read_answer(file).tool == tool:
        return seed
    began = time.perf_counter()
    car = load_vehicle(vehicle)
    if not isinstance(car, Vehicle):
        raise ProofError(f"vehicle is {str(vehicle)!r}, a consumption table, allowed: one given by its physics")
    drives, _ = read_recordings([recordings], HIDDEN)
    diagnosis = diagnose(drives, car, held_out=held_out_of(drives, seed))
    write_answer(answer_of(file.stem, tool, diagnosis, (), time.perf_counter() - began), file)
    return seed


def scored(answers: Sequence[Answer], seeds: Sequence[int], recordings: Path) -> HiddenProof:
    """Read the hidden columns, and hold the answers against them."""
    drives, _ = read_recordings([recordings])
    hidden = {drive.id: hidden_power_w(drive) for drive in drives}
    trips = hidden_trips(answers, hidden)
    findings = tuple(tuple(f"{claim.effect} {claim.share_frac:.1%}" for claim in answer.claims) for answer in answers)
    return HiddenProof(figures_of(trips), trips, tuple(seeds), findings)


def hidden_power_w(recording: Recording) -> tuple[float | None, str]:
    """Mean electric power of heater and air conditioning [W], or None and why the columns do not say it."""
    if recording.hvac_w is not None:
        return _mean(recording, recording.hvac_w), ""
    if recording.heater_w is None or recording.aircon_w is None:
        columns = (("heater", "heater_w", recording.heater_w), ("air conditioning", "aircon_w", recording.aircon_w))
        missing = [name for name, _, values in columns if values is None]
        stuck = [
            f"{name} is {note.kind.value}"
            for note in recording.notes
            for name, key, _ in columns
            if note.channel == key
        ]
        return None, ", ".join((f"no column of {' and '.join(missing)}", *stuck))
    return _mean(recording, recording.heater_w + recording.aircon_w), ""


def hidden_trips(answers: Sequence[Answer], hidden: Mapping[str, tuple[float | None, str]]) -> tuple[HiddenTrip, ...]:
    """Each trip over all splits, in order of ids."""
    found = []
    for trip_id in sorted({trip.id for answer in answers for trip in answer.trips}):
        own = [trip for answer in answers for trip in answer.trips if trip.id == trip_id]
        kept = [trip for trip in own if trip.held_out]
        hidden_w, why = hidden.get(trip_id, (None, "not among the recordings"))
        found.append(
            HiddenTrip(
                id=trip_id,
                held_out=len(kept),
                before_frac=_mean_of(abs(trip.before_kwh / trip.measured_kwh - 1.0) for trip in kept),
                after_frac=_mean_of(abs(trip.after_kwh / trip.measured_kwh - 1.0) for trip in kept),
                claimed_w=_mean_of(trip.thermal_kwh * JOULE_PER_KWH / trip.duration_s for trip in own) or 0.0,
                claimed_held_out_w=_mean_of(trip.thermal_kwh * JOULE_PER_KWH / trip.duration_s for trip in kept),
                hidden_w=hidden_w,
                why=why,
            )
        )
    return tuple(found)


def figures_of(trips: Sequence[HiddenTrip]) -> tuple[Figure, ...]:
    """Errors of held-out trips before and after, and thermal power against the hidden columns; trips are drawn anew."""
    errors = np.array([(trip.before_frac, trip.after_frac) for trip in trips if trip.held_out], np.float64).reshape(
        -1, 2
    )
    figures = [
        drawn(
            GROUP,
            "held-out MAPE from recorded speed, before",
            errors,
            lambda rows: float(rows[:, 0].mean()),
            is_share=True,
        ),
        drawn(
            GROUP,
            "held-out MAPE from recorded speed, after",
            errors,
            lambda rows: float(rows[:, 1].mean()),
            Target(high=0.07),
            is_share=True,
        ),
    ]
    known = [trip for trip in trips if trip.hidden_w is not None]
    held_out = [(trip.hidden_w, trip.claimed_held_out_w) for trip in known if trip.claimed_held_out_w is not None]
    for text, pairs in (
        ("held-out trips", held_out),
        ("all trips", [(trip.hidden_w, trip.claimed_w) for trip in known]),
    ):
        rows = np.array(pairs, np.float64).reshape(-1, 2)
        figures += [
            drawn(GROUP, f"thermal power, {text}: r", rows, correlation, Target(low=0.9)),
            drawn(GROUP, f"thermal power, {text}: slope", rows, slope, Target(0.85, 1.15)),
        ]
    return tuple(figures)


def correlation(rows: NDArray[np.float64]) -> float:
    """Pearson's r of two columns; NaN where one of them is constant."""
    if rows.shape[0] < 2 or bool(np.any(rows.max(axis=0) == rows.min(axis=0))):
        return float("nan")
    return float(np.corrcoef(rows[:, 0], rows[:, 1])[0, 1])


def slope(rows: NDArray[np.float64]) -> float:
    """Slope of the second column over the first by least squares with an intercept; NaN where the first is constant."""
    x = rows[:, 0] - rows[:, 0].mean()
    size = float(x @ x)
    return float(x @ rows[:, 1]) / size if size > 0.0 else float("nan")


def _mean(recording: Recording, values: NDArray[np.float64]) -> float:
    known = ~np.isnan(values)
    time_s = recording.time_s[known]
    return float(np.trapezoid(values[known], time_s) / (time_s[-1] - time_s[0]))


def _mean_of(values: Iterable[float]) -> float | None:
    found = list(values)
    return float(np.mean(found)) if found else None
