"""Each trip's energies under a fitted model, and where its energy went by family."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.results import FitScore, TripAccount, TripTimeline
from diagnosis.causes.families import Family
from diagnosis.causes.library import LIBRARY
from diagnosis.causes.nuisance import PARAMETERS
from diagnosis.fit.model import model_w, residual_w
from diagnosis.fit.windows import FREE, summed
from energy.force.parts import PART_NAMES
from energy.replay.replay import replay
from energy.units import JOULE_PER_KWH, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.fit.model import Model
    from diagnosis.fit.windows import WindowedTrip, Windows

DRAWS: Final = 2000
LEAST_OF_MEDIAN: Final = 0.1
SLOW: Final = ("wander_120s", "wander_480s", "wander_1800s", "level")
PART_FAMILY: Final = {
    "rolling": Family.ROLLING,
    "linear": Family.AERODYNAMIC,
    "aero": Family.AERODYNAMIC,
    "grade": Family.GRADE,
    "inertia": Family.MASS,
    "drivetrain_loss": Family.DRIVETRAIN,
    "recuperation_loss": Family.RECUPERATION,
    "auxiliary": Family.AUXILIARY,
    "regen_limit": Family.RECUPERATION,
    "load_loss": Family.DRIVETRAIN,
    "battery_resistance": Family.BATTERY,
    "tyre_warm_up": Family.ROLLING,
    "tyre_temperature": Family.ROLLING,
    "road_surface": Family.ROLLING,
    "payload": Family.MASS,
    "air_density": Family.AERODYNAMIC,
    "drag": Family.AERODYNAMIC,
    "wind": Family.WIND,
    "cabin": Family.THERMAL,
    "consumption_table": Family.UNEXPLAINED,
}
# what sensors do to a recording, by what it is like
SENSOR_FAMILY: Final = {
    "acceleration_gain": Family.MASS,
    "grade_gain": Family.GRADE,
    "kink_noise": Family.RECUPERATION,
    "load_curvature": Family.DRIVETRAIN,
    "recuperation_curvature": Family.RECUPERATION,
}
TERM_FAMILY: Final = (
    {term.name: term.family for term in LIBRARY}
    | {parameter.name: parameter.family for parameter in PARAMETERS}
    | SENSOR_FAMILY
)


def trip_account(
    model: Model, trip: WindowedTrip, nameplate_j: float, windows: Windows, k: int | None, *, held_out: bool
) -> TripAccount:
    """One trip's account; k: its place among the fitted trips, which predicts it by the fit of the others, or None."""
    before = model.base.coefficients if k is None else model.base.without[k]
    after = model.solution.coefficients if k is None else model.solution.without[k]
    before_w = model_w(windows, model.base, before)
    after_w = model_w(windows, model.solution, after)
    measured_w = windows.measured_j / windows.duration_s
    expected = model.noise.expected_w(windows, residual_w(windows, model.solution, model.solution.coefficients))
    thermal = any(candidate.term.family is Family.THERMAL for candidate in model.found)
    recorded_j = windows.climate_j
    level_family = Family.THERMAL if thermal and recorded_j is None else Family.AUXILIARY
    by_family = _parts_j(model, trip)
    for name, value in zip(model.solution.names, model.solution.coefficients, strict=True):
        family = TERM_FAMILY.get(name.partition("@")[0], Family.UNEXPLAINED)
        if recorded_j is None or name not in windows.climate_names:
            _add(by_family, family, float(value * windows.column(name).sum()))
    if recorded_j is not None:
        _add(by_family, Family.THERMAL, float(recorded_j.sum()))
    for kernel, power_w in expected.items():
        kept = {"rolling": Family.ROLLING, "drag": Family.AERODYNAMIC}.get(kernel)
        if kernel in SLOW:
            kept = level_family
        if kept is not None:
            _add(by_family, kept, float(power_w @ windows.duration_s))
    predicted: dict[Family, float] = {}
    for name, value in zip(model.solution.names, after, strict=True):
        own = TERM_FAMILY.get(name.partition("@")[0])
        if own is not None and name not in FREE:
            _add(predicted, own, float(value * windows.column(name).sum()))
    return TripAccount(
        id=windows.trip_id,
        held_out=held_out,
        ambient_c=None if windows.ambient_k is None else windows.ambient_k - ZERO_CELSIUS_K,
        distance_km=float(windows.distance_m.sum()) / 1000.0,
        duration_s=float(windows.duration_s.sum()),
        measured_kwh=float(windows.measured_j.sum()) / JOULE_PER_KWH,
        nameplate_kwh=nameplate_j / JOULE_PER_KWH,
        before_kwh=float(before_w @ windows.duration_s) / JOULE_PER_KWH,
        after_kwh=float(after_w @ windows.duration_s) / JOULE_PER_KWH,
        explained_kwh=sum(by_family.values()) / JOULE_PER_KWH,
        by_family_kwh={family.value: value / JOULE_PER_KWH for family, value in by_family.items() if value != 0.0},
        timeline=TripTimeline(
            begin_s=windows.begin_s,
            duration_s=windows.duration_s,
            speed_mps=windows.distance_m / windows.duration_s,
            measured_w=measured_w,
            before_w=before_w,
            after_w=after_w,
        ),
        predicted_by_family_kwh={family.value: value / JOULE_PER_KWH for family, value in predicted.items()},
    )


def score(accounts: Sequence[TripAccount], *, after: bool, seed: int) -> FitScore | None:
    """Errors over trips that are scored, with the interval of the mean size of errors over drawn trips; or None."""
    used = scored(accounts)
    if not used:
        return None
    error = np.array(
        [(account.after_kwh if after else account.before_kwh) / account.measured_kwh - 1.0 for account in used]
    )
    interval = None
    if error.size > 2:
        drawn = np.abs(error)[np.random.default_rng(seed).integers(0, error.size, (DRAWS, error.size))].mean(axis=1)
        low, high = np.quantile(drawn, (0.025, 0.975))
        interval = (float(low), float(high))
    lines = [account.timeline for account in used]
    residuals_w = np.concatenate([line.measured_w - (line.after_w if after else line.before_w) for line in lines])
    weight = np.concatenate([line.duration_s for line in lines])
    return FitScore(
        mape=float(np.abs(error).mean()),
        mape_ci95=interval,
        bias=float(error.mean()),
        sd=float(error.std(ddof=1)) if error.size > 1 else 0.0,
        rmse_w=float(np.sqrt(np.average(residuals_w**2, weights=weight))),
    )


def scored(accounts: Sequence[TripAccount]) -> list[TripAccount]:
    """Trips whose relative error says something: those with LEAST_OF_MEDIAN of the median measured energy, or more."""
    sizes = [abs(account.measured_kwh) for account in accounts]
    least_kwh = LEAST_OF_MEDIAN * float(np.median(sizes)) if sizes else 0.0
    return [account for account in accounts if account.measured_kwh >= least_kwh and account.measured_kwh > 0.0]


def _parts_j(model: Model, trip: WindowedTrip) -> dict[Family, float]:
    """Energy by family of the vehicle that the model is linear about."""
    replayed = replay(model.vehicle, trip.drive.profile)
    inside = trip.window >= 0
    found: dict[Family, float] = {}
    for name, value in zip(PART_NAMES, replayed.step_parts_j[inside].sum(axis=0).tolist(), strict=True):
        if value:
            _add(found, PART_FAMILY[name], value)
    return found


def nameplate_j(model: Model, trip: WindowedTrip) -> float:
    """Energy of the vehicle as its file has it, in the windows that were measured [J]."""
    return float(summed(trip, replay(model.nameplate, trip.drive.profile).step_energy_j).sum())


def _add(sums: dict[Family, float], family: Family, value: float) -> None:
    sums[family] = sums.get(family, 0.0) + value
