"""A diagnosis from end to end: recordings and a vehicle in, what was left out and how the fit improves out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.answer.accounts import nameplate_j, score, scored, trip_account
from diagnosis.answer.capacity import capacity_of
from diagnosis.answer.few_trips import few_trips
from diagnosis.answer.findings import findings, unexplained
from diagnosis.answer.learned import NOTHING, applied, learned, replayed_j, with_capacity
from diagnosis.answer.missing import filled_text, missing_channels
from diagnosis.answer.odd_trips import odd_among, odd_trips
from diagnosis.answer.parameter_errors import parameter_errors
from diagnosis.answer.regimes import EDGES, regimes
from diagnosis.answer.results import Diagnosis, QualityNote, TripAccount
from diagnosis.answer.verdict import FAR_FRAC, Off, Rest, is_other_car, verdict_of
from diagnosis.causes.battery import battery_loss
from diagnosis.causes.driven import driven, with_vehicle
from diagnosis.errors import DiagnosisCancelled, DiagnosisError
from diagnosis.fit.fitting import fit
from diagnosis.fit.levels import KINDS, LOAD, ROLLING
from diagnosis.fit.model import BOX, residual_w
from diagnosis.fit.scan import in_box
from diagnosis.fit.selection import LEAST_TRIPS
from diagnosis.fit.windows import WINDOW_S, trip_of, windows_of
from diagnosis.recordings.charge import with_power_of_charge
from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.recording import Detail
from diagnosis.recordings.soundness.feet import with_doubted_heights
from diagnosis.recordings.soundness.masses import with_doubted_scales
from diagnosis.recordings.soundness.temperatures import with_doubts
from energy.errors import EnergyError
from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from diagnosis.answer.learned import Learned
    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.answer.results import FitScore
    from diagnosis.fit.model import Model
    from diagnosis.fit.windows import WindowedTrip, Windows
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle

COARSEST_STEP_S: Final = 35.0
WHOLE_TRIP_S: Final = 1e6  # windows that hold any drive
WINDOW_STEPS: Final = 3.0  # samples of a window at least
LEAST_GAIN_FRAC: Final = 0.005
SEEN_IN_WINDOWS: Final = ("mass_kg",)  # numbers that whole trips' energies need not show
LEVEL_FIELDS: Final = {kind.effect: kind.field or "aux_power_w" for kind in KINDS}
UNIT_CHANNELS: Final = {
    "speed_mps": "the speed",
    "power_w": "the power",
    "elevation_m": "the height",
    "odometer_m": "the odometer",
}
NAMED: Final = 4  # drives, of more only how many
STAGES: Final = (
    "replaying the drives",
    "fitting",
    "selecting effects",
    "refining shapes",
    "looking for what no effect explains",
    "accounting",
)


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    """seed: of everything that is drawn. window_s: length of the windows that are compared."""

    seed: int = 1
    window_s: float = WINDOW_S

    def __post_init__(self) -> None:
        if not 0 <= self.seed < 2**31:
            raise DiagnosisError(f"seed is {self.seed}, allowed: 0..{2**31 - 1}")
        if not 5.0 <= self.window_s <= 60.0:
            raise DiagnosisError(f"window_s is {self.window_s:g}, allowed: 5..60")


DEFAULT: Final = DiagnosisSettings()


def diagnose(
    recordings: Sequence[Recording],
    vehicle: Vehicle,
    *,
    held_out: Collection[str] = (),
    settings: DiagnosisSettings = DEFAULT,
    progress: Callable[[str, float], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Diagnosis:
    """What recordings of a vehicle say about what its model leaves out; held_out: ids of trips that are never fitted.

    progress: called with the name of a stage and the share that is done. cancelled: asked between stages.
    A drive whose profile cannot be replayed is left out, and named in data_quality as unfit. Raises DiagnosisError for
    ids that repeat or are not there and where no drive can be replayed, DiagnosisCancelled.
    """
    _check(recordings, held_out)

    furthest = 0.0

    def share(stage: str) -> float:
        nonlocal furthest
        furthest = max(furthest, STAGES.index(stage) / len(STAGES))  # a second fit begins no earlier
        return furthest

    def on_step(stage: str) -> None:
        if cancelled is not None and cancelled():
            raise DiagnosisCancelled("the diagnosis was cancelled")
        if progress is not None:
            progress(stage, share(stage))

    on_step(STAGES[0])
    profiles = [recording for recording in recordings if recording.detail is Detail.PROFILE]
    recordings = [recording for recording in recordings if recording.detail is not Detail.PROFILE]
    if not recordings:
        raise DiagnosisError("power_w was recorded on no drive, allowed: drives with a power, a charge or an energy")
    recorded = with_doubted_scales(with_doubted_heights(with_doubts(recordings)), vehicle.mass_kg)
    recordings = with_power_of_charge(recorded, vehicle.usable_capacity_wh)
    whole = _is_of_totals(recordings, held_out)
    battery = battery_loss([recording for recording in recordings if recording.id not in held_out])
    trips = []
    refused: dict[str, EnergyError] = {}
    window_s = WHOLE_TRIP_S if whole else _window_s(recordings, settings.window_s)
    for recording in recordings:
        try:
            trips.append(trip_of(recording, driven(recording, vehicle, battery), window_s))
        except EnergyError as error:
            refused[recording.id] = error
        if cancelled is not None and cancelled():
            raise DiagnosisCancelled("the diagnosis was cancelled")
    if not trips:
        trip_id, reason = next(iter(refused.items()))
        raise DiagnosisError(f"trip {trip_id} cannot be replayed: {reason}") from reason
    quality = (
        *(
            QualityNote(recording.id, note.kind.value, note.channel, note.text)
            for recording in recordings
            for note in recording.notes
        ),
        *(_why_refused(trip_id, reason) for trip_id, reason in refused.items()),
        *(QualityNote(profile.id, "unfit", "power_w", "not fitted: a track without power") for profile in profiles),
    )
    recordings = [recording for recording in recordings if recording.id not in refused]
    recorded = [recording for recording in recorded if recording.id not in refused]
    trips, unfit = _fit_for_it(trips, whole)
    fitted = [trip for trip in trips if trip.recording.id not in held_out]
    kept = [trip for trip in trips if trip.recording.id in held_out]
    if len(fitted) < LEAST_TRIPS:
        few = few_trips(fitted, [*kept, *unfit], vehicle, (*quality, *map(_why_unfit, unfit)), settings.seed)
        capacity = capacity_of([each for each in recorded if each.id not in held_out], vehicle.usable_capacity_wh)
        parts = [_doubts(recordings), few.text, "" if capacity is None else capacity.text]
        return replace(few, capacity=capacity, text=" ".join(filter(None, parts)))
    on_step(STAGES[1])
    try:
        model = fit(fitted, vehicle, settings.seed, window_s, on_step)
        odd = odd_trips(model)
        if odd:
            on_step(STAGES[1])
            kept = [*kept, *(trip for trip in fitted if trip.recording.id in odd)]
            fitted = [trip for trip in fitted if trip.recording.id not in odd]
            model = fit(fitted, vehicle, settings.seed, window_s, on_step)
        on_step(STAGES[5])
        others = [_as_fitted(model, trip) for trip in kept]
        accounts = _accounts(model, others, held_out)
    except EnergyError as error:
        raise DiagnosisError(f"vehicle {vehicle.id!r} cannot be fitted: {error}") from error
    asked = [account for account in accounts if account.id in held_out] or [
        account for account in accounts if account.id not in odd
    ]
    before, after = (score(asked, after=which, seed=settings.seed) for which in (False, True))
    found = findings(model)
    held = [windows for trip, windows in others if trip.recording.id in held_out]
    strange = (*map(odd.__getitem__, odd), *odd_among(model, held), *unexplained(model))
    off = _file_is_off(accounts, odd)
    named = {LEVEL_FIELDS.get(finding.effect) for finding in found}  # of which some trips have more, on the whole too
    if LOAD.field in named:
        named.add(ROLLING.field)  # tyres carry the load
    wrong = tuple(
        error
        for error in parameter_errors(model)
        if (off is not None or error.parameter in SEEN_IN_WINDOWS) and error.parameter not in named
    )
    sums_alone = any(trip.recording.detail is Detail.TOTALS for trip in fitted)
    other_car = not sums_alone and is_other_car(wrong, off)
    if other_car:
        wrong = ()  # of so many numbers none is told for sure
    lacking = missing_channels([trip.recording for trip in fitted])
    remarks = " ".join(filter(None, (filled_text([trip.recording for trip in fitted]), _doubts(recordings))))
    departing = _all_regimes(model, after=True)
    in_it = [each for each in recorded if each.id not in held_out and each.id not in odd]
    capacity = capacity_of(in_it, vehicle.usable_capacity_wh)
    verdict, text = verdict_of(
        found,
        wrong,
        strange,
        off,
        Rest(after, departing, lacking, len(fitted), bool(held_out), other_car, remarks, capacity),
    )
    is_off = off is not None and (off.clear or off.nameplate >= FAR_FRAC)
    carried = learned(model) if found or wrong or is_off else NOTHING
    routes = _routes_score(model, vehicle, carried, [*model.trips, *kept], asked, settings.seed)
    carried = with_capacity(carried, capacity)
    return Diagnosis(
        vehicle_id=vehicle.id,
        verdict=verdict,
        text=text,
        findings=found,
        parameter_errors=wrong,
        unexplained=strange,
        data_quality=(*quality, *map(_why_unfit, unfit)),
        fitted_trips=tuple(trip.recording.id for trip in fitted),
        held_out_trips=tuple(trip_id for trip_id in (trip.recording.id for trip in kept) if trip_id in held_out),
        before=before,
        after=after,
        routes=routes,
        regimes_before=_all_regimes(model, after=False),
        regimes_after=departing,
        trips=accounts,
        effects=carried.effects,
        effects_ci95=carried.effects_ci95,
        parameters=carried.parameters,
        not_carried=carried.not_carried,
        missing=lacking,
        other_car=other_car,
        battery=battery,
        capacity=capacity,
        model=_settings_used(model, settings),
    )


def _check(recordings: Sequence[Recording], held_out: Collection[str]) -> None:
    if not recordings:
        raise DiagnosisError(f"0 recordings, at least {LEAST_TRIPS} are needed to name a cause")
    ids = [recording.id for recording in recordings]
    for trip_id in ids:
        if ids.count(trip_id) > 1:
            raise DiagnosisError(f"trip {trip_id!r} is there {ids.count(trip_id)} times, allowed: once")
    for trip_id in held_out:
        if trip_id not in ids:
            raise DiagnosisError(f"held-out trip {trip_id!r} is none of the {len(ids)} recordings")


def _as_fitted(model: Model, trip: WindowedTrip) -> tuple[WindowedTrip, Windows]:
    """A trip that was not fitted as the model sees it, with all its columns."""
    again = replace(trip, drive=with_vehicle(trip.drive, model.vehicle))
    windows = windows_of(again, (*model.found, *model.companions))
    for k, structure in enumerate(model.structures):
        windows = windows.with_column(f"{BOX}{k}", in_box(structure.box, windows, again) * windows.duration_s)
    assert set(model.solution.names) <= set(windows.names), "held-out trips have all columns of the model"
    return again, windows


def _accounts(
    model: Model, others: Sequence[tuple[WindowedTrip, Windows]], held_out: Collection[str]
) -> tuple[TripAccount, ...]:
    """Accounts of the fitted trips, each by the fit of the others, and of those that were not fitted."""
    fitted = zip(model.trips, model.windows, strict=True)
    found = [
        trip_account(model, trip, nameplate_j(model, trip), windows, k, held_out=False)
        for k, (trip, windows) in enumerate(fitted)
    ]
    found += [
        trip_account(model, trip, nameplate_j(model, trip), windows, None, held_out=trip.recording.id in held_out)
        for trip, windows in others
    ]
    return tuple(found)


def _all_regimes(model: Model, *, after: bool) -> tuple[RegimeResidual, ...]:
    """Residual power by regime, of trips by the fit of the others."""
    solution = model.solution if after else model.base
    residuals_w = [residual_w(trip, solution, solution.without[k]) for k, trip in enumerate(model.windows)]
    return tuple(regime for axis in EDGES for regime in regimes(model.windows, axis, residuals_w))


def _file_is_off(accounts: Sequence[TripAccount], odd: Collection[str]) -> Off | None:
    """Whether other numbers of the vehicle meet trips' energies better than those of its file; None where not."""
    fitted = [account for account in accounts if not account.held_out and account.id not in odd]
    used = scored(fitted)
    if not used:  # trips that give back more than they take have no relative error each, but all of them have
        size_kwh = sum(abs(account.measured_kwh) for account in fitted)
        nameplate = sum(abs(account.nameplate_kwh - account.measured_kwh) for account in fitted) / size_kwh
        return Off(nameplate, sum(abs(account.before_kwh - account.measured_kwh) for account in fitted) / size_kwh)
    nameplate = float(np.mean([abs(account.nameplate_kwh / account.measured_kwh - 1.0) for account in used]))
    before = float(np.mean([abs(account.before_kwh / account.measured_kwh - 1.0) for account in used]))
    return Off(nameplate, before) if nameplate - before >= max(LEAST_GAIN_FRAC, 0.1 * nameplate) else None


def _doubts(recordings: Sequence[Recording]) -> str:
    """What is said of drives of which the unit of a channel is doubted; nothing where none is."""
    doubted: dict[str, list[str]] = {}
    why: dict[str, str] = {}
    for recording in recordings:
        for note in recording.notes:
            if note.kind is NoteKind.UNIT and recording.id not in doubted.setdefault(note.channel, []):
                doubted[note.channel].append(recording.id)
                why.setdefault(note.channel, note.text)
    return " ".join(_doubt(channel, trips, why[channel]) for channel, trips in doubted.items())


def _doubt(channel: str, trips: Sequence[str], why: str) -> str:
    which = ", ".join(trips[:NAMED]) + (f" and {len(trips) - NAMED} more" if len(trips) > NAMED else "")
    if channel == "ambient_k":
        return f"The temperature outside seems to be in °F on {which}; it was left out there."
    return f"The unit of {UNIT_CHANNELS.get(channel, channel)} was doubted on {which}: it {why}."


def _is_of_totals(recordings: Sequence[Recording], held_out: Collection[str]) -> bool:
    """Whether too few drives have power, so that each drive is one number."""
    powered = [recording for recording in recordings if not recording.is_one_number and recording.id not in held_out]
    return len(powered) < LEAST_TRIPS and any(recording.is_one_number for recording in recordings)


def _fit_for_it(trips: Sequence[WindowedTrip], whole: bool) -> tuple[list[WindowedTrip], list[WindowedTrip]]:
    """Trips that can be fitted, and those sampled too coarsely or without a window; whole: each is one number."""
    fine = [
        trip
        for trip in trips
        if not _too_coarse(trip)
        and bool((trip.window >= 0).any())
        and (not trip.recording.is_one_number or (whole and bool(trip.recording.power_w.any())))
    ]
    if fine and not any(trip.drive.profile.step_m().any() for trip in fine):
        raise DiagnosisError("no recording moves: allowed: drives of more than 0 m")
    if fine and not any(bool(trip.recording.power_w.any()) for trip in fine):
        raise DiagnosisError("power_w is 0 in every recording, allowed: measured power")
    return fine, [trip for trip in trips if trip not in fine]


def _too_coarse(trip: WindowedTrip) -> bool:
    return float(np.median(np.diff(trip.recording.time_s))) > COARSEST_STEP_S


def _window_s(recordings: Sequence[Recording], least_s: float) -> float:
    """Length of windows that holds WINDOW_STEPS samples of each recording that can be fitted."""
    steps_s = [float(np.median(np.diff(recording.time_s))) for recording in recordings]
    return max([least_s, *(WINDOW_STEPS * step_s for step_s in steps_s if step_s <= COARSEST_STEP_S)])


def _why_refused(trip_id: str, error: EnergyError) -> QualityNote:
    channel = "elevation_m" if getattr(error, "field", "") == "elevation_m" else "speed_mps"
    return QualityNote(trip_id, "unfit", channel, f"not fitted: cannot be replayed: {error}")


def _why_unfit(trip: WindowedTrip) -> QualityNote:
    step_s = float(np.median(np.diff(trip.recording.time_s)))
    text = f"not fitted: a sample each {step_s:.1f} s, at most {COARSEST_STEP_S:g} s are needed to see accelerations"
    if trip.recording.is_one_number:
        text = (
            "not fitted: only the charge or a coarse counter was recorded, other drives have power, or it hardly falls"
        )
    elif step_s <= COARSEST_STEP_S:
        text = "not fitted: nothing is left beside its gaps"
    return QualityNote(trip.recording.id, "unfit", "time_s", text)


def _routes_score(
    model: Model,
    vehicle: Vehicle,
    carried: Learned,
    trips: Sequence[WindowedTrip],
    asked: Sequence[TripAccount],
    seed: int,
) -> FitScore | None:
    """How what routes carry meets the trips that are asked for, replayed at their speed and temperature."""
    if not carried.parameters:
        return None
    car = applied(vehicle, carried)
    replayed = {trip.recording.id: replayed_j(car, trip) / JOULE_PER_KWH for trip in trips}
    return score([replace(account, after_kwh=replayed[account.id]) for account in asked], after=True, seed=seed)


def _settings_used(model: Model, settings: DiagnosisSettings) -> dict[str, Any]:
    """What is needed to repeat the diagnosis, and what its thresholds were."""
    return {
        "seed": settings.seed,
        "window_s": model.noise.window_s,
        "threshold_z": round(model.threshold.z, 3),
        "null_draws": model.threshold.draws,
        "least_trips": LEAST_TRIPS,
        "fitted_but_not_claimed": [
            candidate.label for candidate in model.companions if candidate.label in model.solution.names
        ],
    }
