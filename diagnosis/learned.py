"""What was learned, as coefficients of the energy model that routes and ranges use."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.effects_library import CABIN_K
from diagnosis.fitting import moved
from diagnosis.tangents import PARAMETERS
from energy.conditions import COEFFICIENT_FLAGS, COEFFICIENT_RANGES, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from diagnosis.effects_library import Candidate
    from diagnosis.fitting import Model
    from diagnosis.results import Diagnosis, Interval
    from energy.vehicle import Vehicle

TESTED_SHARE: Final = 0.01  # of the energy: what an effect must usually hold for its absence to say something
LEAST_KELVIN: Final = 1.0

# fields of EffectCoefficients that a term of the library gives as it is
SAME: Final = {
    "rolling_temp_per_k": "rolling_temp_per_k",
    "tyre_warm_up_frac": "tyre_warm_up_frac",
    "wet_rolling_coef": "wet_rolling_coef",
    "wet_drag_n_per_mps": "wet_drag_n_per_mps",
    "air_density_coef": "air_density_coef",
    "yaw_drag_per_rad": "yaw_drag_per_rad",
    "drive_loss_w_per_n2": "drive_loss_w_per_n2",
    "cold_battery_resistance_ohm": "battery_resistance_ohm",
}
USUAL: Final = {
    "rolling_temp_per_k": 0.008,
    "tyre_warm_up_frac": 0.2,
    "wet_rolling_coef": 0.001,
    "wet_drag_n_per_mps": 0.8,
    "air_density_coef": 1.0,
    "yaw_drag_per_rad": 0.6,
    "drive_loss_w_per_n2": 2e-4,
    "cold_battery_resistance_ohm": 0.09,
}
CABIN: Final = ("heating_w_per_k", "warm_up_w_per_k", "cooling_w_per_k", "pull_down_w_per_k")
REASONS: Final = {
    "warm_restart_w_per_k": "a route does not know when the car was last driven; conditions.cabin_start_c tells it",
    "battery_heating_w": "routes do not know the battery's temperature",
    "battery_cooling_w": "routes do not know the battery's temperature",
    "cornering_per_n": "routes do not know the curvature of roads",
    "wind_coef": "routes take the wind from conditions, at full strength",
    "wind_from_east_mps": "a wind that was unknown is no property of the vehicle",
    "wind_from_north_mps": "a wind that was unknown is no property of the vehicle",
    "payload_coef": "routes take the payload from conditions, at full strength",
    "battery_resistance_ohm": "the efficiency of the drive holds it",
    "lost_to_brakes_frac": "the routes' decelerations are the vehicle's own",
    "lost_in_cold_frac": "the cap on recuperation is what routes know of the cold",
    "lost_when_full_frac": "the fading acceptance of conditions.regen_limited stands for it",
}


def learned_effects(model: Model) -> tuple[dict[str, float], dict[str, Interval], dict[str, str]]:
    """Fields of EffectCoefficients with intervals, and what routes cannot use with the reason.

    An effect that these drives would have shown and did not is switched off; of one that they say nothing about the
    default stays.
    """
    values: dict[str, float] = {}
    intervals: dict[str, Interval] = {}
    left_out: dict[str, str] = {}
    found = {one.term.name: one for one in (*_fitted_companions(model), *model.found)}
    for name, one in found.items():
        if name in SAME:
            _take(model, one, SAME[name], values, intervals, left_out)
            if name == "tyre_warm_up_frac":
                values["tyre_time_s"] = one.shape
        elif name == "lost_beyond_cap_frac":
            values |= {"regen_cap_w": 1000.0 * one.shape, "regen_always_limited": 1.0}
        elif name == "lost_below_frac":
            values["regen_min_speed_mps"] = one.shape / 3.6
        elif name in REASONS and one in model.found:
            left_out[name] = REASONS[name]
    for name, field in SAME.items():
        if name not in found and field not in values and _would_have_shown(model, name):
            values[field] = 0.0
    _cabin(model, found, values, intervals)
    return values, intervals, left_out


def learned_vehicle(vehicle: Vehicle, diagnosis: Diagnosis) -> Vehicle:
    """The vehicle with what a diagnosis has learned of it; raises VehicleError or ConditionsError where it is none."""
    effects: dict[str, Any] = {
        name: bool(value) if name in COEFFICIENT_FLAGS else value for name, value in diagnosis.effects.items()
    }
    parameters: dict[str, Any] = dict(diagnosis.parameters)
    return replace(vehicle, **parameters, effects=replace(vehicle.effects, **effects))


def _fitted_companions(model: Model) -> list[Candidate]:
    return [one for one in model.companions if one.label in model.solution.names]


def learned_parameters(model: Model, *, wanted: bool) -> dict[str, float]:
    """Fields of the vehicle with their fitted values, about which effects were fitted; none where none is wanted."""
    if not wanted:
        return {}
    vehicle = moved(model.vehicle, model.solution)
    return {one.name: float(getattr(vehicle, one.name)) for one in PARAMETERS}


def _take(
    model: Model,
    one: Candidate,
    field: str,
    values: dict[str, float],
    intervals: dict[str, Interval],
    left_out: dict[str, str],
) -> None:
    value = model.solution.value(one.label)
    low, high = COEFFICIENT_RANGES[field]
    if not low <= value <= high:
        left_out[one.term.name] = f"{value:.3g} {one.term.unit} is beyond {low:g}..{high:g}, cut there"
        value = float(np.clip(value, low, high))
    values[field] = value
    intervals[field] = _interval(model, one, 1.0)


def _interval(model: Model, one: Candidate, factor: float) -> Interval:
    weights = np.array([float(name == one.label) for name in model.solution.names])
    half = model.solution.half_width(weights)
    value = model.solution.value(one.label)
    return ((value - half) * factor, (value + half) * factor)


def _cabin(model: Model, found: dict[str, Candidate], values: dict[str, float], intervals: dict[str, Interval]) -> None:
    """Heating and cooling: electric power for each kelvin goes into the heat that the cabin loses, COP 1 each."""
    heats = [name for name in CABIN[:2] if name in found]
    cools = [name for name in CABIN[2:] if name in found]
    cold, hot = _kelvin(model, -1.0), _kelvin(model, 1.0)
    if not heats and not cools and max(cold, hot) < LEAST_KELVIN:
        return
    heating = found.get("heating_w_per_k")
    cooling = found.get("cooling_w_per_k")
    target_c = heating.shape if heating is not None else CABIN_K - ZERO_CELSIUS_K
    cool_c = max(cooling.shape if cooling is not None else CABIN_K - ZERO_CELSIUS_K, target_c)
    if heats or cold >= LEAST_KELVIN:
        values |= {"cabin_target_k": target_c + ZERO_CELSIUS_K, "heating_cop": 1.0, "climate_fan_w": 0.0}
        values["cabin_ua_w_per_k"] = model.solution.value(heating.label) if heating is not None else 0.0
        values["cabin_soak_w_per_k"] = 0.0
        if heating is not None:
            intervals["cabin_ua_w_per_k"] = _interval(model, heating, 1.0)
        warm = found.get("warm_up_w_per_k")
        if warm is not None:
            ratio = cold / max(_kelvin(model, -1.0, target_c), LEAST_KELVIN) if heating is not None else 1.0
            values["cabin_soak_w_per_k"] = model.solution.value(warm.label) * ratio
            values["cabin_time_s"] = warm.shape
            intervals["cabin_soak_w_per_k"] = _interval(model, warm, ratio)
    if cools or hot >= LEAST_KELVIN:
        values |= {"cooling_target_k": cool_c + ZERO_CELSIUS_K, "cooling_cop": 1.0, "climate_fan_w": 0.0}
        values["cooling_ua_w_per_k"] = model.solution.value(cooling.label) if cooling is not None else 0.0
        values["cooling_soak_w_per_k"] = 0.0
        if cooling is not None:
            intervals["cooling_ua_w_per_k"] = _interval(model, cooling, 1.0)
        pull = found.get("pull_down_w_per_k")
        if pull is not None:
            ratio = _kelvin(model, 1.0, PULL_DOWN_C) / max(_kelvin(model, 1.0, cool_c), LEAST_KELVIN)
            values["cooling_soak_w_per_k"] = model.solution.value(pull.label) * ratio
            values["cooling_time_s"] = pull.shape
            intervals["cooling_soak_w_per_k"] = _interval(model, pull, ratio)


PULL_DOWN_C: Final = 18.0  # from which on the library's pull-down counts


def _kelvin(model: Model, sign: float, target_c: float = CABIN_K - ZERO_CELSIUS_K) -> float:
    """Mean kelvin by which drives were colder (−1) or hotter (1) than a temperature."""
    known = [trip.ambient_k for trip in model.windows if trip.ambient_k is not None]
    away = [max(sign * (ambient_k - ZERO_CELSIUS_K - target_c), 0.0) for ambient_k in known]
    return float(np.mean(away)) if away else 0.0


def _would_have_shown(model: Model, name: str) -> bool:
    """Whether an effect of its usual size would have held a share of the energy that would have been found."""
    usual = USUAL[name]
    labels = [label for label in model.system.names if label.partition("@")[0] == name]
    if not labels:
        return False
    measured_j = sum(float(trip.measured_j.sum()) for trip in model.windows)
    energy_j = sum(abs(float(trip.column(labels[0]).sum())) for trip in model.windows)
    return bool(usual * energy_j >= TESTED_SHARE * measured_j)
