"""What was learned, as the parameters and coefficients of the energy model that routes and ranges use.

Routes know neither sensors nor the battery's temperature, so what they carry is fitted again without those columns,
with trips' whole energies counted beside their windows. Where replaying it does not meet the drives better than the
vehicle's file, nothing is carried.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.answer.capacity import CAPACITY
from diagnosis.answer.results import CapacityKind
from diagnosis.causes.library import CABIN_K, LIBRARY
from diagnosis.causes.nuisance import PARAMETERS
from diagnosis.causes.terms import Candidate
from diagnosis.fit.fitting import moved
from diagnosis.fit.jackknife import additions, equations, solve
from diagnosis.fit.model import BATTERY_LOSS, model_w, priors, with_companions, with_wholes
from diagnosis.fit.windows import PARAMETER_NAMES, windows_of
from energy.conditions import Conditions
from energy.errors import EnergyError
from energy.replay.replay import replay
from energy.units import ZERO_CELSIUS_K
from energy.vehicle.coefficients import COEFFICIENT_FLAGS, COEFFICIENT_RANGES
from energy.vehicle.vehicle import MOST_RESIDUAL_SD_FRAC

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.answer.results import CapacityEstimate, Diagnosis, Interval
    from diagnosis.fit.jackknife import Solution
    from diagnosis.fit.model import Model
    from diagnosis.fit.windows import WindowedTrip
    from energy.replay.replay import ReplayResult
    from energy.vehicle.vehicle import Vehicle

LEAST_OF_MEDIAN: Final = 0.1  # of the median energy, below which a trip's relative error says nothing
SAME_ERROR_FRAC: Final = (
    0.005  # of energies, by which replaying effects of the file that the drives are silent on differs
)
SHOWN_SD: Final = 4.0  # standard deviations that an effect of its usual size would have been
SHOWN_TRIPS: Final = 5.0
WHOLE_FRAC: Final = 0.8  # a limit of recuperation that takes less than this of what lies beyond it is none for routes
COLDER_K: Final = 10.0  # beyond the coldest drive, to which the climate's power is not cut
CABIN_C: Final = CABIN_K - ZERO_CELSIUS_K
ROLLING: Final = ("rolling_temp_per_k", "tyre_warm_up_frac")
DRAG: Final = ("air_density_coef", "yaw_drag_per_rad")

# fields of EffectCoefficients that a term of the library gives, and their usual size
SAME: Final = {
    "rolling_temp_per_k": ("rolling_temp_per_k", 0.008),
    "tyre_warm_up_frac": ("tyre_warm_up_frac", 0.2),
    "wet_rolling_coef": ("wet_rolling_coef", 0.001),
    "wet_drag_n_per_mps": ("wet_drag_n_per_mps", 0.8),
    "air_density_coef": ("air_density_coef", 1.0),
    "yaw_drag_per_rad": ("yaw_drag_per_rad", 0.6),
    "drive_loss_w_per_n2": ("drive_loss_w_per_n2", 2e-4),
    "cold_battery_resistance_ohm": ("battery_resistance_ohm", 0.09),
}
COLD_BATTERY: Final = next(term for term in LIBRARY if term.name == "cold_battery_resistance_ohm")
HEATING: Final = ("heating_w_per_k", "warm_up_w_per_k")
COOLING: Final = ("cooling_w_per_k", "pull_down_w_per_k")
USUAL_W_PER_K: Final = 100.0
CAPACITY_OPEN: Final = "Too few drives tell it."
PROFILE_SD_FRAC: Final = 0.04  # assumed: what speeds and stops that are planned add to those that were driven
LIMITS: Final = ("lost_beyond_cap_frac", "lost_below_frac", "lost_fading_frac")
REASONS: Final = {
    "warm_restart_w_per_k": "a route does not know when the car was last driven; conditions.cabin_start_c tells it",
    "battery_heating_w": "routes do not know the battery's temperature",
    "battery_cooling_w": "routes do not know the battery's temperature",
    "cornering_per_n": "routes do not know the curvature of roads",
    "wind_coef": "routes take the wind from conditions, at full strength",
    "wind_from_east_mps": "a wind that was unknown is no property of the vehicle",
    "wind_from_north_mps": "a wind that was unknown is no property of the vehicle",
    "payload_coef": "routes take the payload from conditions, at full strength",
    "lost_beyond_cap_frac": "only part of what lies beyond the cap is lost, which routes have no term for",
    "lost_below_frac": "only part of what is recuperated at low speed is lost, which routes have no term for",
    "lost_fading_frac": "only part of what is recuperated at low speed is lost, which routes have no term for",
    "lost_to_brakes_frac": "the routes' decelerations are the vehicle's own",
    "lost_in_cold_frac": "the cap on recuperation is what routes know of the cold",
    "lost_when_full_frac": "the fading acceptance of conditions.regen_limited stands for it",
}


@dataclass(frozen=True, slots=True)
class Learned:
    """Fields of the vehicle and of EffectCoefficients that replace its own, intervals, and what is not carried, why."""

    parameters: dict[str, float]
    effects: dict[str, float]
    effects_ci95: dict[str, Interval]
    not_carried: dict[str, str]


NOTHING: Final = Learned({}, {}, {}, {})


def learned(model: Model) -> Learned:
    """What routes can use of a fitted model; nothing where that meets the fitted drives no better than the file."""
    terms = _in_routes_form([candidate for candidate in _fitted(model) if not _reason(model, candidate)])
    solution = _without_sensors(model, terms)
    shown = _shown(model)
    found = _carried(model, terms, solution, shown)
    beyond = {
        candidate.term.name: REASONS[candidate.term.name] for candidate in _fitted(model) if _reason(model, candidate)
    }
    try:
        applied(model.nameplate, found)
        left_out = [
            applied(model.nameplate, _carried(model, terms, replace(solution, coefficients=beta), shown))
            for beta in solution.without
        ]
    except EnergyError as error:
        return replace(NOTHING, not_carried={"all": f"what was learned is no vehicle: {error}"} | beyond)
    carried, file, refitted, residual = _errors(model, left_out, _without_sensors(model, ()))
    worse_than_refitted = carried > refitted + SAME_ERROR_FRAC
    if worse_than_refitted or carried >= file:
        which, other = ("its own numbers refitted", refitted) if worse_than_refitted else ("the vehicle's file", file)
        reason = (
            f"replaying it meets drives that it has not seen no better than {which}: they err by {carried:.1%} and by"
            f" {other:.1%}"
        )
        return replace(NOTHING, not_carried={"all": reason} | beyond)
    spread = min(float(np.hypot(residual, PROFILE_SD_FRAC)), MOST_RESIDUAL_SD_FRAC)
    parameters = found.parameters | {"residual_sd_frac": spread}
    return replace(found, parameters=parameters, not_carried=found.not_carried | beyond)


def with_capacity(found: Learned, capacity: CapacityEstimate | None) -> Learned:
    """What is carried with the battery's capacity, where the drives tell one below that of the file.

    It holds whatever else is carried: consumption does not depend on it.
    """
    if capacity is None or not capacity.text:
        return found
    if not capacity.is_carried:
        why = f"{CAPACITY_OPEN} {capacity.text}" if capacity.kind is CapacityKind.LESS else capacity.text
        return replace(found, not_carried=found.not_carried | {CAPACITY: why})
    return replace(found, parameters=found.parameters | {CAPACITY: round(capacity.value_wh)})


def applied(vehicle: Vehicle, found: Learned) -> Vehicle:
    """The vehicle with what was learned of it; raises VehicleError or ConditionsError where it is none."""
    effects: dict[str, Any] = {
        name: bool(value) if name in COEFFICIENT_FLAGS else value for name, value in found.effects.items()
    }
    parameters: dict[str, Any] = dict(found.parameters)
    changed = replace(vehicle, **parameters, effects=replace(vehicle.effects, **effects))
    return changed.with_residual({*parameters, *(f"effects.{name}" for name in effects)})


def learned_vehicle(vehicle: Vehicle, diagnosis: Diagnosis) -> Vehicle:
    """The vehicle with what a diagnosis has learned of it; raises as `applied`."""
    return applied(vehicle, Learned(dict(diagnosis.parameters), dict(diagnosis.effects), {}, {}))


def replayed_j(vehicle: Vehicle, trip: WindowedTrip, *, still: bool = False) -> float:
    """Energy of a trip at the battery's terminals by the routes' terms, at its speed and temperature [J].

    still: without any effect.
    """
    return float(_replayed(vehicle, trip, still).step_energy_j[trip.window >= 0].sum())


def dissipated_j(vehicle: Vehicle, trip: WindowedTrip) -> float:
    """Energy that a replayed trip dissipates, which is what its height and speed do not store [J]."""
    return float(_replayed(vehicle, trip, still=False).dissipated_j)


def _replayed(vehicle: Vehicle, trip: WindowedTrip, still: bool) -> ReplayResult:
    ambient_k = trip.drive.ambient_k
    conditions = Conditions() if still or ambient_k is None else Conditions(ambient_k=ambient_k)
    return replay(vehicle, trip.drive.profile, conditions=conditions)


def _errors(model: Model, left_out: Sequence[Vehicle], parameters: Solution) -> tuple[float, float, float, float]:
    """Mean sizes of relative errors of trips' energies by what others carry, by the file, by refitted parameters [-].

    And the standard deviation of the first, over what trips dissipate. left_out: what all trips but each carry;
    parameters: refitted alone, without sensors. Trips of less than LEAST_OF_MEDIAN of the median energy don't count.
    """
    measured = np.array([float(windows.measured_j.sum()) for windows in model.windows])
    counted = measured >= LEAST_OF_MEDIAN * float(np.median(np.abs(measured)))
    carried = [replayed_j(vehicle, trip) for vehicle, trip in zip(left_out, model.trips, strict=True)]
    file = [replayed_j(model.nameplate, trip, still=True) for trip in model.trips]
    refitted = [
        float(model_w(windows, parameters, beta) @ windows.duration_s)
        for windows, beta in zip(model.windows, parameters.without, strict=True)
    ]
    size = np.where(counted, np.maximum(np.abs(measured), 1.0), np.inf)
    sizes = [np.abs(np.array(predicted) - measured) / size for predicted in (carried, file, refitted)]
    mean_carried, mean_file, mean_refitted = (float(errors.sum()) / max(int(counted.sum()), 1) for errors in sizes)
    dissipated = [dissipated_j(vehicle, trip) for vehicle, trip in zip(left_out, model.trips, strict=True)]
    off = np.where(counted, (np.array(carried) - measured) / np.maximum(np.array(dissipated), 1.0), 0.0)
    return mean_carried, mean_file, mean_refitted, float(np.sqrt(np.square(off).sum() / max(int(counted.sum()) - 1, 1)))


def _fitted(model: Model) -> list[Candidate]:
    """Terms of the model: found, and companions that were kept."""
    return [*model.found, *(candidate for candidate in model.companions if candidate.label in model.solution.names)]


def _reason(model: Model, candidate: Candidate) -> bool:
    """Whether routes cannot use a term."""
    if candidate.term.name in LIMITS:
        return model.solution.value(candidate.label) < WHOLE_FRAC
    return candidate.term.name in REASONS


def _shown(model: Model) -> frozenset[str]:
    """Terms that would have stood out in these drives at their usual size."""
    usual = {name: size for name, (_, size) in SAME.items()}
    usual |= {"heating_w_per_k": USUAL_W_PER_K, "cooling_w_per_k": USUAL_W_PER_K}
    return frozenset(name for name, size in usual.items() if _would_have_shown(model, name, size))


def _carried(model: Model, terms: Sequence[Candidate], solution: Solution, shown: frozenset[str]) -> Learned:
    """What a solution of terms in the routes' form says, as fields of vehicle and effects.

    shown: terms that would have stood out, so that those which did not are none.
    """
    limits = [candidate for candidate in terms if candidate.term.name in LIMITS]
    vehicle = moved(model.vehicle, solution)
    values: dict[str, float] = {}
    intervals: dict[str, Interval] = {}
    for candidate in terms:
        if candidate.term.name not in SAME:
            continue
        field, _ = SAME[candidate.term.name]
        factor = _factor(model.vehicle, vehicle, candidate.term.name)
        low, high = COEFFICIENT_RANGES[field]
        high = min(high, candidate.term.most)
        values[field] = float(np.clip(solution.value(candidate.label) * factor, low, high))
        half = solution.half_width(_only(solution, candidate.label)) * abs(factor)
        intervals[field] = (values[field] - half, values[field] + half)
        if candidate.term.name == "tyre_warm_up_frac":
            values["tyre_time_s"] = candidate.shape
    for candidate in limits:
        if candidate.term.name == "lost_beyond_cap_frac":
            # the cap alone was fitted, neither a fading with charge nor one in the cold
            values |= {
                "regen_cap_w": 1000.0 * candidate.shape,
                "regen_always_limited": 1.0,
                "regen_fade_soc_frac": 0.999,
            }
            values |= {"regen_cold_full_k": 231.0, "regen_cold_none_k": 221.0}
        else:  # routes end at once what fades evenly: half-way
            share = 0.5 if candidate.term.name == "lost_fading_frac" else 1.0
            values["regen_min_speed_mps"] = share * candidate.shape / 3.6
    for name, (field, _) in SAME.items():
        if field not in values and name in shown:
            values[field] = 0.0
    _cabin(model, terms, solution, shown, values, intervals)
    parameters = {parameter.name: float(getattr(vehicle, parameter.name)) for parameter in PARAMETERS}
    return Learned(parameters, values, intervals, {})


def _in_routes_form(terms: Sequence[Candidate]) -> list[Candidate]:
    """Terms as routes have them: where a transient goes with a steady climate, both are about one temperature."""
    names = {candidate.term.name for candidate in terms}
    formed = []
    for candidate in terms:
        if candidate.term.name == BATTERY_LOSS:  # what it loses when warm is in the routes' efficiencies
            formed.append(Candidate(COLD_BATTERY, candidate.shape))
            continue
        steady = candidate.term.name in ("heating_w_per_k", "cooling_w_per_k")
        transient = "warm_up_w_per_k" if candidate.term.name == "heating_w_per_k" else "pull_down_w_per_k"
        formed.append(Candidate(candidate.term, CABIN_C) if steady and transient in names else candidate)
    return formed


def _without_sensors(model: Model, terms: Sequence[Candidate]) -> Solution:
    """Parameters and terms fitted without sensor columns, trips' whole energies counted beside their windows."""
    windows = [windows_of(trip, terms) for trip in model.trips]
    prior = priors(windows[0].names, model.vehicle, model.nameplate, model.trips[0].drive.battery)
    system = equations(windows, model.roots, prior)
    companions = [candidate.label for candidate in terms if candidate not in model.found]
    system = with_companions(system, windows, companions)
    system = with_wholes(system, windows)
    labels = [candidate.label for candidate in terms]
    while True:
        solution = solve(system, [*PARAMETER_NAMES, *labels])
        negative = [
            candidate.label for candidate in terms if candidate.term.positive and solution.value(candidate.label) < 0.0
        ]
        if not negative:
            return solution
        labels = [label for label in labels if label not in negative]


def _factor(linear: Vehicle, carried: Vehicle, name: str) -> float:
    """What turns a coefficient of the vehicle that was linearised about into one of the vehicle that is carried."""
    if name in ROLLING:
        return linear.road_load_a_n / carried.road_load_a_n
    if name in DRAG:
        return linear.road_load_c_n_per_mps2 / carried.road_load_c_n_per_mps2
    return 1.0


def _only(solution: Solution, label: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([float(name == label) for name in solution.names])


def _cabin(
    model: Model,
    terms: Sequence[Candidate],
    solution: Solution,
    shown: frozenset[str],
    values: dict[str, float],
    intervals: dict[str, Interval],
) -> None:
    """Heating and cooling as electric power for each kelvin, COP 1; what the drives are silent on stays as it was."""
    by_name = {candidate.term.name: candidate for candidate in terms if candidate.label in solution.names}
    heats = any(name in by_name for name in HEATING)
    cools = any(name in by_name for name in COOLING)
    no_heat = not heats and "heating_w_per_k" in shown
    no_cool = not cools and "cooling_w_per_k" in shown
    if not (heats or cools or no_heat or no_cool):
        return
    usual = model.nameplate.effects
    heated_c = by_name["heating_w_per_k"].shape if "heating_w_per_k" in by_name else CABIN_C
    cooled_c = max(by_name["cooling_w_per_k"].shape if "cooling_w_per_k" in by_name else CABIN_C, heated_c)
    values |= {"cabin_target_k": heated_c + ZERO_CELSIUS_K, "cooling_target_k": cooled_c + ZERO_CELSIUS_K}
    for wanted, none, (steady, transient), prefix, cop in (
        (heats, no_heat, HEATING, "cabin", "heating_cop"),
        (cools, no_cool, COOLING, "cooling", "cooling_cop"),
    ):
        if not (wanted or none):  # as it was, told apart from the other side
            values[f"{prefix}_ua_w_per_k"] = usual.cabin_ua_w_per_k
            values[f"{prefix}_soak_w_per_k"] = usual.cabin_soak_w_per_k
            continue
        values |= {cop: 1.0, "climate_fan_w": 0.0}
        for name, field in ((steady, f"{prefix}_ua_w_per_k"), (transient, f"{prefix}_soak_w_per_k")):
            candidate = by_name.get(name)
            values[field] = 0.0
            if candidate is not None:
                values[field] = float(np.clip(solution.value(candidate.label), 0.0, candidate.term.most))
            if candidate is not None:
                half = solution.half_width(_only(solution, candidate.label))
                intervals[field] = (values[field] - half, values[field] + half)
        if transient in by_name:
            values[f"{prefix}_time_s"] = by_name[transient].shape
    coldest_k = min((trip.ambient_k for trip in model.windows if trip.ambient_k is not None), default=CABIN_K)
    most_w = (values["cabin_ua_w_per_k"] + values["cabin_soak_w_per_k"]) * (CABIN_K - coldest_k + COLDER_K)
    values["climate_limit_w"] = max(usual.climate_limit_w, most_w)


def _would_have_shown(model: Model, name: str, usual: float) -> bool:
    """Whether an effect of its usual size would have stood out in these drives beside all that was found."""
    labels = [label for label in model.system.names if label.partition("@")[0] == name]
    labels = [label for label in labels if label not in model.solution.names]
    if not labels:
        return False
    added = additions(model.system, model.solution.names, labels)
    clear = (added.effective >= SHOWN_TRIPS) & (SHOWN_SD * added.sd < usual) & (added.sd > 0.0)
    return bool(clear.any())
