"""Coefficients of the effects that conditions switch on, in human units."""

from __future__ import annotations

from typing import Any, Final

from pydantic import Field

from app.schemas.base import Flag, Number, Sent
from energy.units import ZERO_CELSIUS_K
from energy.vehicle.coefficients import COEFFICIENT_RANGES

# fields of EffectCoefficients that are temperatures [K], and their names here [°C]
CELSIUS_FIELDS: Final = {
    "cabin_target_k": "cabin_target_c",
    "cooling_target_k": "cooling_target_c",
    "regen_cold_full_k": "regen_cold_full_c",
    "regen_cold_none_k": "regen_cold_none_c",
}
TEMPERATURE_DIGITS: Final = 9  # of °C and K, so that 21 °C is 294.15 K and 294.15 K is 21 °C


def _coefficient(name: str, description: str) -> Any:
    low, high = COEFFICIENT_RANGES[name]
    if name in CELSIUS_FIELDS:
        low, high = (round(bound - ZERO_CELSIUS_K, TEMPERATURE_DIGITS) for bound in (low, high))
    return Field(default=None, ge=low, le=high, description=description)


class EffectsSent(Sent):
    """How strong each effect is once conditions switch it on; what is left out is as in docs/effects.md."""

    rolling_temp_per_k: Number | None = _coefficient(
        "rolling_temp_per_k", "rise of rolling resistance for each kelvin below the reference [1/K]"
    )
    yaw_drag_per_rad: Number | None = _coefficient(
        "yaw_drag_per_rad", "rise of drag for each radian between air flow and heading [1/rad]"
    )
    wet_rolling_coef: Number | None = _coefficient("wet_rolling_coef", "rolling coefficient that a wet road adds")
    wet_drag_n_per_mps: Number | None = _coefficient("wet_drag_n_per_mps", "force of displaced water [N/(m/s)]")
    snow_rolling_coef: Number | None = _coefficient("snow_rolling_coef", "rolling coefficient that snow adds")
    cabin_ua_w_per_k: Number | None = _coefficient("cabin_ua_w_per_k", "heat that the cabin loses [W/K]")
    cabin_target_c: Number | None = _coefficient("cabin_target_k", "wanted temperature of the cabin [°C]")
    cabin_soak_w_per_k: Number | None = _coefficient(
        "cabin_soak_w_per_k", "extra thermal power for each kelvin that the cabin starts off its target [W/K]"
    )
    cabin_time_s: Number | None = _coefficient("cabin_time_s", "time in which that extra power decays [s]")
    heating_cop: Number | None = _coefficient("heating_cop", "thermal over electric power when heating")
    cooling_cop: Number | None = _coefficient("cooling_cop", "thermal over electric power when cooling")
    climate_fan_w: Number | None = _coefficient("climate_fan_w", "blower and pumps while heating or cooling [W]")
    climate_limit_w: Number | None = _coefficient("climate_limit_w", "most electric power of the climate [W]")
    aux_climate_w: Number | None = _coefficient(
        "aux_climate_w", "share of aux_power_w that is climate on average, which the cabin's power replaces [W]"
    )
    battery_resistance_ohm: Number | None = _coefficient(
        "battery_resistance_ohm", "resistance of the battery at the reference temperature [Ω]"
    )
    battery_voltage_v: Number | None = _coefficient("battery_voltage_v", "nominal voltage of the battery [V]")
    resistance_doubling_k: Number | None = _coefficient(
        "resistance_doubling_k", "cooling that doubles the resistance [K]"
    )
    drive_loss_w_per_n2: Number | None = _coefficient(
        "drive_loss_w_per_n2", "loss that grows with the square of the force at the wheels [W/N²]"
    )
    regen_cap_w: Number | None = _coefficient("regen_cap_w", "most power that recuperation charges with [W]")
    regen_fade_soc_frac: Number | None = _coefficient(
        "regen_fade_soc_frac", "state of charge from which that power falls, to 0 at 1"
    )
    regen_cold_full_c: Number | None = _coefficient(
        "regen_cold_full_k", "battery temperature from which on all of it is there [°C]"
    )
    regen_cold_none_c: Number | None = _coefficient(
        "regen_cold_none_k", "battery temperature below which none of it is there [°C], below regen_cold_full_c"
    )
    regen_always_limited: Flag | None = Field(
        default=None, description="whether the vehicle's recuperation is limited without the condition regen_limited"
    )
    regen_min_speed_mps: Number | None = _coefficient(
        "regen_min_speed_mps", "speed below which braking gives nothing back [m/s]"
    )
    tyre_warm_up_frac: Number | None = _coefficient(
        "tyre_warm_up_frac", "rolling resistance of the tyres at departure over that of warm ones, less 1"
    )
    tyre_time_s: Number | None = _coefficient("tyre_time_s", "time in which that decays [s]")
    air_density_coef: Number | None = _coefficient(
        "air_density_coef", "strength of the air's density; 0: drag does not feel it"
    )
    cooling_target_c: Number | None = _coefficient(
        "cooling_target_k",
        "cabin temperature above which it is cooled [°C], at least cabin_target_c, below which it is heated; "
        "without it the same",
    )
    cooling_ua_w_per_k: Number | None = _coefficient(
        "cooling_ua_w_per_k", "cabin_ua_w_per_k of a cabin that is cooled [W/K]; without it the same"
    )
    cooling_soak_w_per_k: Number | None = _coefficient(
        "cooling_soak_w_per_k", "cabin_soak_w_per_k of a cabin that is cooled [W/K]; without it the same"
    )
    cooling_time_s: Number | None = _coefficient(
        "cooling_time_s", "cabin_time_s of a cabin that is cooled [s]; without it the same"
    )
