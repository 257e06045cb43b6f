"""Recorded drives with a channel taken away, thinned, or few: what the tool makes of them beside the baselines."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.learned import learned_vehicle, replayed_j
from diagnosis.causes.driven import driven, median_ambient
from diagnosis.comparison.coverage import predict
from diagnosis.engine import diagnose
from diagnosis.fit.windows import trip_of
from diagnosis.recordings.recording import channels_of
from energy.units import JOULE_PER_KWH
from proof.trip_sums import ridge_kwh, sums_kwh, trip_sums

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from diagnosis.answer.results import Diagnosis
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle

SPLITS: Final = 10
HELD_OUT: Final = 12
SUBSETS: Final = 30
SAMPLES: Final = 100  # of what is carried, for quantiles
SUBSET_SIZES: Final = (8, 20)


@dataclass(frozen=True, slots=True)
class Variant:
    """What is done to recordings, and how many are fitted."""

    name: str
    changed: Callable[[Recording], Recording]
    fitted: int


@dataclass(frozen=True, slots=True)
class SplitErrors:
    """Mean sizes of relative errors of one split's held-out trips, and what was named: families of clear findings.

    routes: of what routes carry, of the file where nothing is carried. covered: share of the trips that took an energy
    between P10 and P90 of what is carried, None where nothing is.
    """

    file: float
    refitted: float
    ridge: float
    sums: float
    tool: float
    routes: float
    carried: bool
    named: tuple[str, ...]
    parameters: tuple[str, ...]
    covered: float | None


def thinned(recording: Recording, step_s: float) -> Recording:
    """The recording with a sample each so many seconds, as it was at that moment."""
    wanted_s = np.arange(recording.time_s[0], recording.time_s[-1], step_s)
    at = np.unique(np.minimum(np.searchsorted(recording.time_s, wanted_s), recording.time_s.size - 1))
    return replace(recording, **{name: values[at] for name, values in channels_of(recording).items()}, gaps=())


VARIANTS: Final = (
    Variant("as recorded", lambda recording: recording, 28),
    Variant("20 drives fitted", lambda recording: recording, 20),
    Variant("8 drives fitted", lambda recording: recording, 8),
    Variant("without height", lambda recording: replace(recording, elevation_m=None), 28),
    Variant("without temperature", lambda recording: replace(recording, ambient_k=None, battery_k=None), 28),
    Variant("a sample each 5 s", lambda recording: thinned(recording, 5.0), 28),
    Variant("a sample each 10 s", lambda recording: thinned(recording, 10.0), 28),
    Variant("a sample each 30 s", lambda recording: thinned(recording, 30.0), 28),
)


def split_errors(recordings: Sequence[Recording], vehicle: Vehicle, variant: Variant, seed: int) -> SplitErrors:
    """One split: HELD_OUT trips drawn, so many others fitted, all changed as the variant says."""
    order = np.random.default_rng(seed).permutation(len(recordings))
    changed = [variant.changed(recordings[k]) for k in order[: HELD_OUT + variant.fitted]]
    kept, fitted = changed[:HELD_OUT], changed[HELD_OUT:]
    diagnosis = diagnose(changed, vehicle, held_out={recording.id for recording in kept})
    accounts = {account.id: account for account in diagnosis.trips}
    asked, known = ([trip_sums(recording, vehicle) for recording in some] for some in (kept, fitted))
    measured = np.array([trip.measured_kwh for trip in asked])
    carried = learned_vehicle(vehicle, diagnosis) if diagnosis.parameters else None

    def mape(predicted: Sequence[float]) -> float:
        return float(np.mean(np.abs(np.array(predicted) / measured - 1.0)))

    file = [trip.file_kwh for trip in asked]
    routes, covered = file, None
    if carried is not None:
        predicted = predict(
            carried, kept, median_ambient, samples=SAMPLES, residual_sd_frac=carried.residual_sd_frac or 0.0
        )
        covered = float(np.mean([trip.covered for trip in predicted]))
        trips = [trip_of(recording, driven(recording, vehicle)) for recording in kept]
        routes = [replayed_j(carried, trip) / JOULE_PER_KWH for trip in trips]
    return SplitErrors(
        file=mape(file),
        refitted=mape([accounts[trip.id].before_kwh for trip in asked]),
        ridge=mape(ridge_kwh(known, asked).tolist()),
        sums=mape(sums_kwh(known, asked).tolist()),
        tool=mape([accounts[trip.id].after_kwh for trip in asked]),
        routes=mape(routes),
        carried=carried is not None,
        named=clear_families(diagnosis),
        parameters=tuple(error.parameter for error in diagnosis.parameter_errors),
        covered=covered,
    )


def clear_families(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Families that are named without a rival."""
    return tuple(sorted({finding.family.value for finding in diagnosis.findings if not finding.ambiguous_with}))


def agreement(recordings: Sequence[Recording], vehicle: Vehicle, seed: int) -> tuple[int, int]:
    """Clear findings of drawn subsets that all drives name too, clearly or among rivals, and all of them."""
    whole = diagnose(recordings, vehicle)
    families = {finding.family.value for finding in whole.findings}
    families |= {rival.family.value for finding in whole.findings for rival in finding.ambiguous_with}
    rng = np.random.default_rng(seed)
    agreeing = total = 0
    for _ in range(SUBSETS):
        size = int(rng.integers(SUBSET_SIZES[0], SUBSET_SIZES[1] + 1))
        chosen = [recordings[k] for k in rng.permutation(len(recordings))[:size]]
        named = clear_families(diagnose(chosen, vehicle))
        agreeing += sum(family in families for family in named)
        total += len(named)
    return agreeing, total
