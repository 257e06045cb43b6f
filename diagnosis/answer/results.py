"""What a diagnosis says: findings, parameter errors, what stays unexplained, and how trips are met before and after.

Everything here is plain data in SI units but for energies, which are in kWh as in every report. `as_json` gives the
object of diagnosis.json. Families are those of `Family`; intervals are 95 % and None where the data cannot carry one.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from diagnosis.causes.families import Family

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from diagnosis.answer.missing import MissingChannel
    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.causes.battery import BatteryLoss

Interval = tuple[float, float] | None


class Verdict(StrEnum):
    """What the drives say as a whole."""

    TOO_FEW_TRIPS = "too_few_trips"
    NOTHING_MISSING = "nothing_missing"
    PARAMETER_ERROR = "parameter_error"
    LEFT_OUT_PHYSICS = "left_out_physics"
    CANNOT_TELL = "cannot_tell"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One fitted number of an effect in the unit that is named, with its interval."""

    name: str
    unit: str
    value: float
    ci95: Interval


@dataclass(frozen=True, slots=True)
class Rival:
    """An effect that would do as well as the one that was found."""

    effect: str
    family: Family


@dataclass(frozen=True, slots=True)
class Finding:
    """An effect that the model left out and the drives speak for.

    effect: its name in the library. energy_kwh: over all fitted trips; energy_share_frac: of what they measured.
    t: of its strongest coefficient. located: regimes in which the mismatch that it explains shows. trips: where the
    effect is a level of single trips (payload, roof load), which ones. ambiguous_with: effects of other families that
    cannot be told from it; separating_recording: what drive would tell them apart, None where nothing is ambiguous.
    text: one sentence for a reader without the library's names. standing_ratio: of heat, the power that standstill
    shows over what the finding says of it, with its interval; None where too little standstill was recorded.
    """

    effect: str
    family: Family
    text: str
    coefficients: tuple[Coefficient, ...]
    energy_kwh: float
    energy_kwh_ci95: Interval
    energy_share_frac: float
    t: float
    located: tuple[RegimeResidual, ...] = ()
    trips: tuple[str, ...] = ()
    ambiguous_with: tuple[Rival, ...] = ()
    separating_recording: str | None = None
    standing_ratio: float | None = None
    standing_ratio_ci95: Interval = None


@dataclass(frozen=True, slots=True)
class ParameterError:
    """A parameter of the vehicle that the drives speak against, and what cannot be told from it by power alone.

    nameplate, fitted and ci95 in the unit that is named. at_bound: fitted is as far from the file as such a car can be.
    """

    parameter: str
    family: Family
    unit: str
    nameplate: float
    fitted: float
    ci95: Interval
    energy_kwh: float
    energy_share_frac: float
    aliases: tuple[str, ...]
    text: str
    at_bound: bool = False


class CapacityKind(StrEnum):
    """What the battery's capacity by charge against energy is, beside that of the vehicle's file."""

    AS_IN_FILE = "as_in_file"
    LESS = "less"
    MORE = "more"
    NOT_CLEAR = "not_clear"


@dataclass(frozen=True, slots=True)
class CapacityDrift:
    """Change of the capacity a year, relative, with its interval, and the years between the first drive and the last.

    Only where the interval leaves out 0.
    """

    frac_per_year: float
    ci95_frac_per_year: tuple[float, float]
    years: float


@dataclass(frozen=True, slots=True)
class CapacityEstimate:
    """What the battery holds by the drives' energy over the fall of their charge [Wh], beside file_wh of its file.

    trips: that it rests on; fall_frac: of the charge, over all of them. displayed: the charge is that of the display.
    median_c: of the battery, or else of the air. is_carried: whether routes use it. text: empty where it agrees.
    """

    kind: CapacityKind
    value_wh: float
    ci95_wh: tuple[float, float]
    file_wh: float
    trips: tuple[str, ...]
    fall_frac: float
    displayed: bool
    median_c: float | None
    drift: CapacityDrift | None
    is_carried: bool
    text: str


@dataclass(frozen=True, slots=True)
class Unexplained:
    """Structure that no effect of the library explains: where on an axis it lies, and how much it is.

    low, high: of the axis in its unit. mean_w: power above the rest of the drives there. p: chance of as much in drives
    with nothing left out, corrected for every place that was looked at. low_ci95, high_ci95: where its ends may be;
    None for a place or a trip.
    """

    axis: str
    unit: str
    low: float
    high: float
    mean_w: float
    ci95_w: Interval
    energy_kwh: float
    p: float
    trips: tuple[str, ...]
    text: str
    low_ci95: Interval = None
    high_ci95: Interval = None


@dataclass(frozen=True, slots=True)
class QualityNote:
    """What was noticed in a recording: its id, what kind of thing, the channel and a sentence."""

    trip_id: str
    kind: str
    channel: str
    text: str


@dataclass(frozen=True, slots=True)
class TripTimeline:
    """One trip in windows, for plots: begin_s and mean powers [W], each float64 (n,).

    before_w: base model with its own parameters refitted. after_w: with findings, its own power not used.
    """

    begin_s: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    measured_w: NDArray[np.float64]
    before_w: NDArray[np.float64]
    after_w: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TripAccount:
    """One trip's energies [kWh].

    nameplate_kwh: model as the vehicle file has it. before_kwh: its own parameters refitted, no effects. after_kwh:
    with findings, the trip's own power not used. explained_kwh: its own power used for levels that a trip has, as an
    account of where it went; by_family_kwh adds up to it. predicted_by_family_kwh: what terms of each family, found or
    only kept near none, add to the vehicle's own, without the trip's own power.
    """

    id: str
    held_out: bool
    ambient_c: float | None
    distance_km: float
    duration_s: float
    measured_kwh: float
    nameplate_kwh: float
    before_kwh: float
    after_kwh: float
    explained_kwh: float
    by_family_kwh: Mapping[str, float]
    timeline: TripTimeline
    predicted_by_family_kwh: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FitScore:
    """Errors of trip energies, positive where the model takes more [-], and of windows' power [W]."""

    mape: float
    mape_ci95: Interval
    bias: float
    sd: float
    rmse_w: float


@dataclass(frozen=True, slots=True)
class ProfileSplit:
    """What planning and what the vehicle model got wrong on one trip [kWh], stops and time beside.

    planned: by the graph's speeds and expected stops on the matched way; driven: model at the driven speed; both with
    the vehicle as its file has it. forecast: planned with what was learned and the trip's temperature, as it would have
    been told before departure; a trip that was not held out has had a part in what was learned.
    """

    trip_id: str
    planned_kwh: float
    driven_kwh: float
    measured_kwh: float
    planned_s: float
    driven_s: float
    planned_stops: float
    driven_stops: int
    forecast_kwh: float | None = None


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The whole answer; scores are of held-out trips, or of trips left out one at a time where none was held out.

    A trip left out one at a time has had no part in the coefficients, but in what was selected. routes: what routes
    carry, replayed at the recorded speed and temperature.

    missing: channels that the fitted trips lack, and what that leaves open. other_car: so much of the vehicle's file is
    contradicted that the drives may be of another one. battery: what its voltage tells of its resistance.
    capacity: what the battery holds, where drives tell it.

    effects: the model that was learned, as energy.vehicle.coefficients.EffectCoefficients has it (fields that the
    drives say something about only). parameters: fields of the vehicle that replace its own. not_carried: findings
    that routes and ranges cannot use, and why.
    """

    vehicle_id: str
    verdict: Verdict
    text: str
    findings: tuple[Finding, ...]
    parameter_errors: tuple[ParameterError, ...]
    unexplained: tuple[Unexplained, ...]
    data_quality: tuple[QualityNote, ...]
    fitted_trips: tuple[str, ...]
    held_out_trips: tuple[str, ...]
    before: FitScore | None
    after: FitScore | None
    routes: FitScore | None
    regimes_before: tuple[RegimeResidual, ...]
    regimes_after: tuple[RegimeResidual, ...]
    trips: tuple[TripAccount, ...]
    effects: Mapping[str, float]
    effects_ci95: Mapping[str, Interval]
    parameters: Mapping[str, float]
    not_carried: Mapping[str, str]
    profile: tuple[ProfileSplit, ...] = ()
    model: Mapping[str, Any] = field(default_factory=dict)
    missing: tuple[MissingChannel, ...] = ()
    other_car: bool = False
    battery: BatteryLoss | None = None
    capacity: CapacityEstimate | None = None
