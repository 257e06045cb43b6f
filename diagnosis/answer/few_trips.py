"""A drive, or a few, against the model: an account by cause with what is uncertain, and no conclusion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.answer.accounts import PART_FAMILY
from diagnosis.answer.missing import filled_text, missing_channels
from diagnosis.answer.results import Diagnosis, TripAccount, TripTimeline, Verdict
from diagnosis.causes.nuisance import PARAMETERS
from diagnosis.fit.selection import LEAST_TRIPS
from diagnosis.fit.windows import windows_of
from energy.conditions import Conditions
from energy.force.parts import PART_NAMES
from energy.replay.replay import replay
from energy.units import JOULE_PER_KWH, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.answer.results import QualityNote
    from diagnosis.fit.windows import WindowedTrip
    from energy.vehicle.vehicle import Vehicle

TOLD: Final = 3  # drives that the text tells one by one
LARGEST: Final = 4  # causes of each


def few_trips(
    fitted: Sequence[WindowedTrip],
    kept: Sequence[WindowedTrip],
    vehicle: Vehicle,
    quality: tuple[QualityNote, ...],
    seed: int,
) -> Diagnosis:
    """Energies by the vehicle's file at each drive's temperature: so few drives carry no conclusion."""
    accounts = [_account(trip, vehicle, held_out=trip in kept) for trip in (*fitted, *kept)]
    few = (
        f"{len(fitted)} trips to fit; at least {LEAST_TRIPS} are needed to tell how trips differ, and to name a cause."
    )
    lacking = missing_channels([trip.recording for trip in fitted])
    filled = filled_text([trip.recording for trip in fitted])
    told = [_text(account, _sd_kwh(trip, vehicle)) for account, trip in zip(accounts, fitted, strict=False)]
    return Diagnosis(
        vehicle_id=vehicle.id,
        verdict=Verdict.TOO_FEW_TRIPS,
        text=" ".join([few, *told[:TOLD], *(lack.text for lack in lacking if lack.decisive), *filter(None, [filled])]),
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
        model={"seed": seed, "least_trips": LEAST_TRIPS},
        missing=lacking,
    )


def _account(trip: WindowedTrip, vehicle: Vehicle, *, held_out: bool) -> TripAccount:
    windows = windows_of(trip, ())
    ambient_k = trip.drive.ambient_k
    conditions = Conditions() if ambient_k is None else Conditions(ambient_k=ambient_k)
    replayed = replay(vehicle, trip.drive.profile, conditions=conditions)
    inside = trip.window >= 0
    by_family: dict[str, float] = {}
    for name, value in zip(PART_NAMES, replayed.step_parts_j[inside].sum(axis=0).tolist(), strict=True):
        if value:
            family = PART_FAMILY[name].value
            by_family[family] = by_family.get(family, 0.0) + value / JOULE_PER_KWH
    file_kwh = float(windows.simulated_j.sum()) / JOULE_PER_KWH
    warm_kwh = float(replayed.step_energy_j[inside].sum()) / JOULE_PER_KWH
    count = windows.begin_s.size
    after_w = np.bincount(trip.window[inside], replayed.step_energy_j[inside], count) / windows.duration_s
    return TripAccount(
        id=windows.trip_id,
        held_out=held_out,
        ambient_c=None if ambient_k is None else ambient_k - ZERO_CELSIUS_K,
        distance_km=float(windows.distance_m.sum()) / 1000.0,
        duration_s=float(windows.duration_s.sum()),
        measured_kwh=float(windows.measured_j.sum()) / JOULE_PER_KWH,
        nameplate_kwh=file_kwh,
        before_kwh=file_kwh,
        after_kwh=warm_kwh,
        explained_kwh=warm_kwh,
        by_family_kwh=by_family,
        timeline=TripTimeline(
            begin_s=windows.begin_s,
            duration_s=windows.duration_s,
            speed_mps=windows.distance_m / windows.duration_s,
            measured_w=windows.measured_j / windows.duration_s,
            before_w=windows.simulated_j / windows.duration_s,
            after_w=after_w,
        ),
    )


def _sd_kwh(trip: WindowedTrip, vehicle: Vehicle) -> float:
    """What the file's numbers may be off comes to on a drive, standard deviation [kWh]."""
    windows = windows_of(trip, ())
    parts = [parameter.sd_of(vehicle) * float(windows.column(parameter.name).sum()) for parameter in PARAMETERS]
    return float(np.sqrt(np.square(parts).sum())) / JOULE_PER_KWH


def _text(account: TripAccount, sd_kwh: float) -> str:
    """One drive against the model in a sentence or two."""
    less_kwh = account.measured_kwh - account.after_kwh
    largest = sorted(account.by_family_kwh.items(), key=lambda pair: -abs(pair[1]))[:LARGEST]
    causes = ", ".join(f"{name} {kwh:.2f}" for name, kwh in largest)
    within = "within what" if abs(less_kwh) <= 2.0 * sd_kwh else "more than"
    return (
        f"{account.id} took {account.measured_kwh:.2f} kWh; the vehicle's file makes it {account.after_kwh:.2f} ±"
        f" {2.0 * sd_kwh:.2f} kWh ({causes}). The difference is {less_kwh:+.2f} kWh, {within} its numbers"
        " may be off by."
    )
