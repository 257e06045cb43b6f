"""A diagnosis from end to end: recordings and a vehicle in, what was left out and how the fit improves out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.answer.accounts import nameplate_j, score, scored, trip_account
from diagnosis.answer.findings import findings, unexplained
from diagnosis.answer.learned import NOTHING, applied, learned, replayed_j
from diagnosis.answer.missing import missing_channels
from diagnosis.answer.odd_trips import odd_among, odd_trips
from diagnosis.answer.parameter_errors import parameter_errors
from diagnosis.answer.regimes import EDGES, regimes, where
from diagnosis.answer.results import Diagnosis, QualityNote, TripAccount, TripTimeline, Verdict
from diagnosis.causes.driven import driven, with_vehicle
from diagnosis.errors import DiagnosisCancelled, DiagnosisError
from diagnosis.fit.fitting import fit
from diagnosis.fit.model import BOX, residual_w
from diagnosis.fit.scan import in_box
from diagnosis.fit.selection import LEAST_TRIPS
from diagnosis.fit.windows import WINDOW_S, trip_of, windows_of
from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.soundness.temperatures import with_doubts
from energy.errors import EnergyError
from energy.units import JOULE_PER_KWH, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from diagnosis.answer.learned import Learned
    from diagnosis.answer.missing import MissingChannel
    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.answer.results import Finding, FitScore, ParameterError, Unexplained
    from diagnosis.fit.model import Model
    from diagnosis.fit.windows import WindowedTrip, Windows
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle

COARSEST_STEP_S: Final = 35.0
WINDOW_STEPS: Final = 3.0  # samples of a window at least
OFF_FRAC: Final = 0.03  # of trips' energies, from which on a file's numbers are off
OFF_GAIN: Final = 0.5  # of that, that refitted numbers may leave
LEAST_GAIN_FRAC: Final = 0.005
FAR_FRAC: Final = 0.05  # error of trips that were left out, from which on something stays unexplained
SEEN_IN_WINDOWS: Final = ("mass_kg",)  # numbers that whole trips' energies need not show
OTHER_CAR_NUMBERS: Final = 3  # of the file, that drives of the same car do not contradict at once
NAMED: Final = 4  # drives, of more only how many
OTHER_CAR_FRAC: Final = (
    0.15  # of trips' energies, by which the file of the same car is not off where nothing is left out
)
OTHER_CAR: Final = (
    "So much of the vehicle's file is contradicted that these drives may be of another vehicle, or the file may be"
    " wrong."
)
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
    Raises DiagnosisError for ids that repeat or are not there, DiagnosisCancelled, and EnergyError where a profile
    cannot be replayed.
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
    recordings = with_doubts(recordings)
    trips = []
    window_s = _window_s(recordings, settings.window_s)
    for recording in recordings:
        try:
            trips.append(trip_of(recording, driven(recording, vehicle), window_s))
        except EnergyError as error:
            raise DiagnosisError(f"trip {recording.id} cannot be replayed: {error}") from error
        if cancelled is not None and cancelled():
            raise DiagnosisCancelled("the diagnosis was cancelled")
    quality = tuple(
        QualityNote(recording.id, note.kind.value, note.channel, note.text)
        for recording in recordings
        for note in recording.notes
    )
    trips, unfit = _fit_for_it(trips)
    fitted = [trip for trip in trips if trip.recording.id not in held_out]
    kept = [trip for trip in trips if trip.recording.id in held_out]
    if len(fitted) < LEAST_TRIPS:
        return _too_few(fitted, [*kept, *unfit], vehicle, (*quality, *map(_why_unfit, unfit)), settings)
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
    wrong = tuple(error for error in parameter_errors(model) if off is not None or error.parameter in SEEN_IN_WINDOWS)
    other_car = _is_other_car(wrong, off)
    if other_car:
        wrong = ()  # of so many numbers none is told for sure
    lacking = missing_channels([trip.recording for trip in fitted])
    departing = _all_regimes(model, after=True)
    verdict, text = _verdict(
        found,
        wrong,
        strange,
        off,
        _Rest(after, departing, lacking, len(fitted), bool(held_out), other_car, _doubts(recordings)),
    )
    is_off = off is not None and (off.clear or off.nameplate >= FAR_FRAC)
    carried = learned(model) if found or wrong or is_off else NOTHING
    routes = _routes_score(model, vehicle, carried, [*model.trips, *kept], asked, settings.seed)
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
        windows = windows.with_column(f"{BOX}{k}", in_box(structure.box, windows) * windows.duration_s)
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


@dataclass(frozen=True, slots=True)
class _Off:
    """How the vehicle's file and its own numbers refitted meet fitted trips: mean size of errors [-]."""

    nameplate: float
    before: float

    @property
    def clear(self) -> bool:
        """Whether the file's numbers are off, whichever of them it is."""
        return self.nameplate >= OFF_FRAC and self.before <= OFF_GAIN * self.nameplate


def _file_is_off(accounts: Sequence[TripAccount], odd: Collection[str]) -> _Off | None:
    """Whether other numbers of the vehicle meet trips' energies better than those of its file; None where not."""
    fitted = [account for account in accounts if not account.held_out and account.id not in odd]
    used = scored(fitted)
    if not used:  # trips that give back more than they take have no relative error each, but all of them have
        size_kwh = sum(abs(account.measured_kwh) for account in fitted)
        nameplate = sum(abs(account.nameplate_kwh - account.measured_kwh) for account in fitted) / size_kwh
        return _Off(nameplate, sum(abs(account.before_kwh - account.measured_kwh) for account in fitted) / size_kwh)
    nameplate = float(np.mean([abs(account.nameplate_kwh / account.measured_kwh - 1.0) for account in used]))
    before = float(np.mean([abs(account.before_kwh / account.measured_kwh - 1.0) for account in used]))
    return _Off(nameplate, before) if nameplate - before >= max(LEAST_GAIN_FRAC, 0.1 * nameplate) else None


def _doubts(recordings: Sequence[Recording]) -> str:
    """What is said of drives of which the unit of a channel is doubted; nothing where none is."""
    doubted = [recording.id for recording in recordings if any(n.kind is NoteKind.UNIT for n in recording.notes)]
    if not doubted:
        return ""
    which = ", ".join(doubted[:NAMED]) + (f" and {len(doubted) - NAMED} more" if len(doubted) > NAMED else "")
    return f"The temperature outside seems to be in °F on {which}; it was left out there."


def _is_other_car(wrong: Sequence[ParameterError], off: _Off | None) -> bool:
    """Whether so much of a file is contradicted that the drives may be of another vehicle."""
    far_off = off is not None and off.clear and off.nameplate >= OTHER_CAR_FRAC and len(wrong) != 1
    return far_off or any(error.at_bound for error in wrong) or len(wrong) >= OTHER_CAR_NUMBERS


@dataclass(frozen=True, slots=True)
class _Rest:
    """What a diagnosis leaves: errors of trips that it has not seen, regimes that depart, channels that it lacked."""

    after: FitScore | None
    regimes: tuple[RegimeResidual, ...]
    lacking: tuple[MissingChannel, ...]
    trips: int
    held_out: bool
    other_car: bool
    doubts: str

    @property
    def is_far(self) -> bool:
        """Whether more is left than drives of a known car leave."""
        return self.after is not None and self.after.mape > FAR_FRAC

    def text(self) -> str:
        """What is left, and where most of it lies; nothing where little is."""
        if self.after is None or not self.is_far:
            return ""
        which = "Drives that were held out" if self.held_out else "Drives that the fit of the others had not seen"
        text = f"{which} are still missed by {self.after.mape:.1%} on average, which nothing here explains."
        departing = [regime for regime in self.regimes if regime.departs]
        if departing:
            most = max(departing, key=lambda regime: abs(regime.energy_kwh))
            text += f" Most of it lies {where(most)}: {most.mean_w:+.0f} W."
        return text


def _verdict(
    found: Sequence[Finding],
    wrong: Sequence[ParameterError],
    strange: Sequence[Unexplained],
    off: _Off | None,
    rest: _Rest,
) -> tuple[Verdict, str]:
    """The verdict and everything that was concluded, in one text: what was not recorded first, what is left last."""
    text = " ".join(
        [
            *(lack.text for lack in rest.lacking if lack.decisive),
            *filter(None, [rest.doubts]),
            *([OTHER_CAR] if rest.other_car else []),
            *(
                finding.text
                if finding.separating_recording is None
                else f"{finding.text} {finding.separating_recording}"
                for finding in found
            ),
            *(error.text for error in wrong),
            *(structure.text for structure in strange),
            *filter(None, [rest.text()]),
        ]
    )
    if any(not finding.ambiguous_with for finding in found):
        return Verdict.LEFT_OUT_PHYSICS, text
    if found:
        return Verdict.CANNOT_TELL, text
    if strange:
        return Verdict.UNEXPLAINED, text
    if wrong:
        return Verdict.PARAMETER_ERROR, text
    if off is not None and off.clear:
        return Verdict.PARAMETER_ERROR, (
            f"The vehicle's numbers are off: with those of its file trips err by {off.nameplate:.1%}, with fitted ones"
            f" by {off.before:.1%}. Which of them it is can't be told from these drives. {text}"
        ).strip()
    if rest.is_far:
        return Verdict.UNEXPLAINED, text
    nothing = f"In {rest.trips} drives nothing stands out that the model leaves out."
    return Verdict.NOTHING_MISSING, f"{text} {nothing}".strip()


def _fit_for_it(trips: Sequence[WindowedTrip]) -> tuple[list[WindowedTrip], list[WindowedTrip]]:
    """Trips that can be fitted, and those sampled too coarsely or without a window."""
    fine = [trip for trip in trips if not _too_coarse(trip) and bool((trip.window >= 0).any())]
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


def _why_unfit(trip: WindowedTrip) -> QualityNote:
    step_s = float(np.median(np.diff(trip.recording.time_s)))
    text = f"not fitted: a sample each {step_s:.1f} s, at most {COARSEST_STEP_S:g} s are needed to see accelerations"
    if step_s <= COARSEST_STEP_S:
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


def _too_few(
    fitted: Sequence[WindowedTrip],
    kept: Sequence[WindowedTrip],
    vehicle: Vehicle,
    quality: tuple[QualityNote, ...],
    settings: DiagnosisSettings,
) -> Diagnosis:
    """Energies by the vehicle's file only: so few trips carry no conclusion."""
    accounts = []
    for trip in (*fitted, *kept):
        windows = windows_of(trip, ())
        simulated_w = windows.simulated_j / windows.duration_s
        energy_kwh = float(windows.simulated_j.sum()) / JOULE_PER_KWH
        accounts.append(
            TripAccount(
                id=windows.trip_id,
                held_out=trip in kept,
                ambient_c=None if windows.ambient_k is None else windows.ambient_k - ZERO_CELSIUS_K,
                distance_km=float(windows.distance_m.sum()) / 1000.0,
                duration_s=float(windows.duration_s.sum()),
                measured_kwh=float(windows.measured_j.sum()) / JOULE_PER_KWH,
                nameplate_kwh=energy_kwh,
                before_kwh=energy_kwh,
                after_kwh=energy_kwh,
                explained_kwh=energy_kwh,
                by_family_kwh={},
                timeline=TripTimeline(
                    begin_s=windows.begin_s,
                    duration_s=windows.duration_s,
                    speed_mps=windows.distance_m / windows.duration_s,
                    measured_w=windows.measured_j / windows.duration_s,
                    before_w=simulated_w,
                    after_w=simulated_w,
                ),
            )
        )
    return Diagnosis(
        vehicle_id=vehicle.id,
        verdict=Verdict.TOO_FEW_TRIPS,
        text=f"{len(fitted)} trips to fit; at least {LEAST_TRIPS} are needed to tell how trips differ, and so to name a"
        " cause.",
        findings=(),
        parameter_errors=(),
        unexplained=(),
        data_quality=quality,
        fitted_trips=tuple(trip.recording.id for trip in fitted),
        held_out_trips=tuple(trip.recording.id for trip in kept),
        before=None,
        after=None,
        routes=None,
        regimes_before=(),
        regimes_after=(),
        trips=tuple(accounts),
        effects={},
        effects_ci95={},
        parameters={},
        not_carried={},
        model={"seed": settings.seed, "least_trips": LEAST_TRIPS},
    )
