"""How strong each effect is once conditions switch it on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from energy.errors import ConditionsError


@dataclass(frozen=True, slots=True)
class EffectCoefficients:
    """How strong each effect is once conditions switch it on; the defaults are those of docs/effects.md.

    rolling_temp_per_k: rise of rolling resistance for each kelvin below the reference [1/K] (ISO 28580: 0.008).
    yaw_drag_per_rad: rise of drag for each radian between air flow and heading [1/rad].
    wet_rolling_coef, snow_rolling_coef: added rolling coefficient [-]; wet_drag_n_per_mps: water displaced [N/(m/s)].
    cabin_ua_w_per_k: heat that the cabin loses [W/K]; cabin_target_k: wanted temperature [K].
    cabin_soak_w_per_k: extra thermal power for each kelvin that the cabin starts off its target [W/K], decaying
    with cabin_time_s [s]. heating_cop, cooling_cop: thermal power over electric power [-].
    climate_fan_w: blower and pumps while heating or cooling [W]; climate_limit_w: most electric power [W].
    aux_climate_w: share of the vehicle's aux_power_w that is climate on average, which the cabin term replaces [W].
    battery_resistance_ohm: at the reference temperature [Ω]; battery_voltage_v: nominal [V].
    resistance_doubling_k: cooling that doubles the resistance [K].
    drive_loss_w_per_n2: loss that grows with the square of the force at the wheels [W/N²]; 0 is the source's model.
    regen_cap_w: most power that recuperation charges with [W]. regen_fade_soc_frac: charge from which the battery
    accepts a falling share of it, none at 1 [-]. regen_cold_full_k, regen_cold_none_k: temperatures with all and none
    of the cap [K]. regen_always_limited: the cap is the vehicle's own and needs no condition. regen_min_speed_mps: any
    slower, braking gives nothing back [m/s].
    tyre_warm_up_frac: rolling resistance of the tyres at departure over that of warm ones, less 1 [-]; it decays with
    tyre_time_s [s]. air_density_coef: strength of the air's density [-], 0 for none.
    cooling_target_k: temperature above which the cabin is cooled [K]; below cabin_target_k, no higher, it is heated.
    cooling_ua_w_per_k, cooling_soak_w_per_k, cooling_time_s: as those of the cabin, where it is cooled. None: the same.
    """

    rolling_temp_per_k: float = 0.008
    yaw_drag_per_rad: float = 0.6
    wet_rolling_coef: float = 0.001
    wet_drag_n_per_mps: float = 0.8
    snow_rolling_coef: float = 0.008
    cabin_ua_w_per_k: float = 110.0
    cabin_target_k: float = 294.15
    cabin_soak_w_per_k: float = 150.0
    cabin_time_s: float = 600.0
    heating_cop: float = 1.0
    cooling_cop: float = 2.5
    climate_fan_w: float = 100.0
    climate_limit_w: float = 6000.0
    aux_climate_w: float = 0.0
    battery_resistance_ohm: float = 0.09
    battery_voltage_v: float = 360.0
    resistance_doubling_k: float = 23.0
    drive_loss_w_per_n2: float = 0.0
    regen_cap_w: float = 60_000.0
    regen_fade_soc_frac: float = 0.9
    regen_cold_full_k: float = 283.15
    regen_cold_none_k: float = 258.15
    regen_always_limited: bool = False
    regen_min_speed_mps: float = 0.0
    tyre_warm_up_frac: float = 0.0
    tyre_time_s: float = 600.0
    air_density_coef: float = 1.0
    cooling_target_k: float | None = None
    cooling_ua_w_per_k: float | None = None
    cooling_soak_w_per_k: float | None = None
    cooling_time_s: float | None = None

    def __post_init__(self) -> None:
        for name, (low, high) in COEFFICIENT_RANGES.items():
            value = getattr(self, name)
            if value is not None and not low <= value <= high:
                raise ConditionsError(f"effects.{name}", value, f"{low:g}..{high:g}")
        for name in COEFFICIENT_FLAGS:
            if not isinstance(getattr(self, name), bool):
                raise ConditionsError(f"effects.{name}", getattr(self, name), "True or False")
        if self.regen_cold_none_k >= self.regen_cold_full_k:
            raise ConditionsError(
                "effects.regen_cold_none_k",
                self.regen_cold_none_k,
                f"below regen_cold_full_k, {self.regen_cold_full_k:g}",
            )
        if self.cooling_target_k is not None and self.cooling_target_k < self.cabin_target_k:
            raise ConditionsError(
                "effects.cooling_target_k", self.cooling_target_k, f"at least cabin_target_k, {self.cabin_target_k:g}"
            )


COEFFICIENT_RANGES: Final = {
    "rolling_temp_per_k": (0.0, 0.05),
    "yaw_drag_per_rad": (0.0, 5.0),
    "wet_rolling_coef": (0.0, 0.05),
    "wet_drag_n_per_mps": (0.0, 20.0),
    "snow_rolling_coef": (0.0, 0.2),
    "cabin_ua_w_per_k": (0.0, 5000.0),
    "cabin_target_k": (273.15, 313.15),
    "cabin_soak_w_per_k": (0.0, 5000.0),
    "cabin_time_s": (1.0, 36_000.0),
    "heating_cop": (0.5, 10.0),
    "cooling_cop": (0.5, 10.0),
    "climate_fan_w": (0.0, 5000.0),
    "climate_limit_w": (0.0, 100_000.0),
    "aux_climate_w": (0.0, 100_000.0),
    "battery_resistance_ohm": (0.0, 2.0),
    "battery_voltage_v": (10.0, 2000.0),
    "resistance_doubling_k": (1.0, 200.0),
    "drive_loss_w_per_n2": (0.0, 0.1),
    "regen_cap_w": (0.0, 2_000_000.0),
    "regen_fade_soc_frac": (0.0, 0.999),
    "regen_cold_full_k": (230.0, 330.0),
    "regen_cold_none_k": (220.0, 320.0),
    "regen_min_speed_mps": (0.0, 15.0),
    "tyre_warm_up_frac": (0.0, 2.0),
    "tyre_time_s": (1.0, 36_000.0),
    "air_density_coef": (0.0, 3.0),
    "cooling_target_k": (273.15, 313.15),
    "cooling_ua_w_per_k": (0.0, 5000.0),
    "cooling_soak_w_per_k": (0.0, 5000.0),
    "cooling_time_s": (1.0, 36_000.0),
}
COEFFICIENT_FLAGS: Final = ("regen_always_limited",)
