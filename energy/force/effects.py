"""Physics of a drive under given conditions: what the kernels need of the vehicle and of each link, and the parts.

Equations, sources and ranges of validity: docs/effects.md. Every effect is one term; with all conditions at their
defaults the numbers are the source's to the bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.conditions import STILL, Conditions, RoadSurface
from energy.errors import ConditionsError
from energy.force import kernels_physics
from energy.force.kernels_physics import LinkPhysics
from energy.force.parts import Part
from energy.units import GRAVITY_MPS2, JOULE_PER_WH
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.vehicle import CHECKED_SPEED_MPS, Vehicle

if TYPE_CHECKING:
    from numpy.typing import NDArray

REFERENCE_K: Final = 293.15  # 20 °C and 100 kPa, to which coast-downs are corrected (UN GTR 15, annex 4)
REFERENCE_PA: Final = 100_000.0
SEA_LEVEL_PA: Final = 101_325.0  # ISO 2533, the standard atmosphere
SEA_LEVEL_K: Final = 288.15
LAPSE_K_PER_M: Final = 0.0065
BAROMETRIC_EXPONENT: Final = 5.25588
RESISTANCE_REFERENCE_K: Final = 296.15  # middle of the source's 13 to 32 °C, in which its efficiencies were measured
FAN_FULL_W: Final = 1000.0  # thermal power from which the fan runs at full speed (assumed)
YAW_SPEED_MPS: Final = 1.0  # air slower than this has no direction that matters

PARTS_WITH_COLUMN: Final = [part.idx for part in Part if part.column is not None]
COLUMNS_OF_PARTS: Final = [part.column for part in Part if part.column is not None]
ROAD_LOAD_COLUMNS: Final = (kernels_physics.ROAD_ROLLING, kernels_physics.ROAD_LINEAR, kernels_physics.ROAD_AERO)


@dataclass(frozen=True, slots=True)
class LinkSetting:
    """Links as conditions see them, one value a link.

    grade_frac: sin θ. driven_mps: speed driven. altitude_m: mean height, heading: (n, 2) east and north part of the way
    over its length, so that a winding road counts its mean direction. The last two may be absent; conditions
    that need them then raise ConditionsError.
    """

    grade_frac: NDArray[np.float64]
    driven_mps: NDArray[np.float64]
    altitude_m: NDArray[np.float64] | None = None
    heading: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True)
class Drive:
    """A vehicle under given conditions: what search, simulation and time-step model share."""

    vehicle: Vehicle | ConsumptionTableVehicle
    conditions: Conditions
    physics: LinkPhysics

    def driven_mps(self, speed_limit_mps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Speeds that are driven where the limits are given, of the same shape [m/s]."""
        driven = speed_limit_mps
        if self.conditions.speed_factor != 1.0:
            driven = np.minimum(driven * self.conditions.speed_factor, CHECKED_SPEED_MPS)
        if self.conditions.top_speed_mps is not None:
            driven = np.minimum(driven, self.conditions.top_speed_mps)
        return driven

    def roads(self, links: LinkSetting, wait_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """The table of roads that the kernels read, float64 (n, 8); wait_s: stop time at the end of each link."""
        table = np.zeros((links.grade_frac.size, kernels_physics.ROAD_COLUMNS))
        table[:, kernels_physics.ROAD_GRADE] = links.grade_frac
        table[:, kernels_physics.ROAD_WAIT] = wait_s
        if isinstance(self.vehicle, ConsumptionTableVehicle):
            table[:, kernels_physics.ROAD_ROLLING] = self.vehicle.consumption_at(links.driven_mps)
            return table
        flat = np.sqrt(np.maximum(1.0 - links.grade_frac * links.grade_frac, 0.0))
        table[:, kernels_physics.ROAD_ROLLING] = sum(_rolling_n(self.vehicle, self.conditions)) * flat
        table[:, kernels_physics.ROAD_WARM_UP] = _warm_up_n(self.vehicle, self.conditions) * flat
        table[:, kernels_physics.ROAD_LINEAR] = sum(_linear_n_per_mps(self.vehicle, self.conditions))
        base, density, drag = _aero_n_per_mps2(self.vehicle, self.conditions, links)
        aero = base + density + drag
        table[:, kernels_physics.ROAD_AERO] = aero
        if self.conditions != STILL:
            lift = -np.minimum(_least_load_n(*(table[:, k] for k in ROAD_LOAD_COLUMNS)), 0.0)
            table[:, kernels_physics.ROAD_ROLLING] += lift
        if self.conditions.wind_speed_mps > 0.0:
            table[:, kernels_physics.ROAD_WIND] = _wind_mps(self.conditions, links)[0]
        return table

    def parts(self, links: LinkSetting, terms: NDArray[np.float64]) -> NDArray[np.float64]:
        """Energy by cause, float64 (n, 20) in the order of Part, from the kernels' terms (n, 15) [J]."""
        parts = np.zeros((terms.shape[0], len(Part)))
        parts[:, PARTS_WITH_COLUMN] = terms[:, COLUMNS_OF_PARTS]
        if isinstance(self.vehicle, ConsumptionTableVehicle) or self.conditions == STILL:
            return parts
        rolling = _rolling_n(self.vehicle, self.conditions)
        of_rolling = (Part.ROLLING, Part.TYRE_TEMPERATURE, Part.ROAD_SURFACE, Part.PAYLOAD)
        for part, value in zip(of_rolling, rolling, strict=True):
            parts[:, part.idx] = _share(value, sum(rolling)) * terms[:, Part.ROLLING.column]
        linear = _linear_n_per_mps(self.vehicle, self.conditions)
        parts[:, Part.LINEAR.idx] = _share(linear[0], sum(linear)) * terms[:, Part.LINEAR.column]
        parts[:, Part.ROAD_SURFACE.idx] += _share(linear[1], sum(linear)) * terms[:, Part.LINEAR.column]
        base, density, drag = _aero_n_per_mps2(self.vehicle, self.conditions, links)
        whole = base + density + drag
        of_drag = (Part.AERO, Part.AIR_DENSITY, Part.DRAG)
        for part, coefficient in zip(of_drag, (base, density, drag), strict=True):
            share = np.divide(coefficient, whole, out=np.zeros_like(whole), where=whole != 0.0)
            parts[:, part.idx] = share * terms[:, Part.AERO.column]
        moved = self.conditions.payload_kg / (self.vehicle.mass_kg + self.conditions.payload_kg)
        for part in (Part.GRADE, Part.INERTIA):
            parts[:, part.idx] = (1.0 - moved) * terms[:, part.column]
            parts[:, Part.PAYLOAD.idx] += moved * terms[:, part.column]
        return parts


def drive_of(
    vehicle: Vehicle | ConsumptionTableVehicle, conditions: Conditions = STILL, *, printed: bool = False
) -> Drive:
    """The drive of a vehicle under conditions; printed: dynamic phases by equations (13), (15), (36) as printed.

    Raises ConditionsError where a consumption table, which holds no forces, is to feel an effect on forces.
    """
    if isinstance(vehicle, ConsumptionTableVehicle):
        if printed:
            raise ConditionsError(
                "link_model", "printed", f"integrated for vehicle {vehicle.id!r}, a consumption table"
            )
        return Drive(vehicle, conditions, _table_physics(vehicle, conditions))
    strength = vehicle.effects
    mass_kg = vehicle.mass_kg + conditions.payload_kg
    cap_w, fade_j = regen_limit(conditions, strength, vehicle.usable_capacity_wh)
    resistance = resistance_rise_ohm(conditions, strength)
    steady_w, start_w, cabin_time_s = cabin_power_w(conditions, strength)
    aux_w = vehicle.aux_power_w
    if conditions.aux_power_w is not None:
        aux_w = conditions.aux_power_w
    elif conditions.ambient_k is not None and conditions.climate:
        aux_w = max(aux_w - strength.aux_climate_w, 0.0)
    physics = LinkPhysics(
        weight_n=float(mass_kg * GRAVITY_MPS2),
        inertia_kg=float(mass_kg * vehicle.rotating_mass_coef),
        drive_factor=1.0 / float(vehicle.drive_eff),
        recuperation_factor=float(vehicle.recuperation_eff),
        aux_move_w=float(aux_w / vehicle.aux_move_eff),
        aux_idle_w=float(aux_w / vehicle.aux_idle_eff),
        speed_bound_mps=np.array(vehicle.accel_speed_mps, np.float64),
        accel_sum=np.concatenate(([0.0], np.cumsum(vehicle.accel_mps2))),
        decel_sum=np.concatenate(([0.0], np.cumsum(-vehicle.decel_mps2))),
        printed=printed,
        regen_cap_w=cap_w,
        fade_width_j=fade_j,
        loss_per_n2=float(strength.drive_loss_w_per_n2),
        loss_per_w=resistance / strength.battery_voltage_v**2,
        regen_min_mps=float(strength.regen_min_speed_mps),
        lossy=(
            math.isfinite(cap_w)
            or resistance > 0.0
            or strength.drive_loss_w_per_n2 > 0.0
            or strength.regen_min_speed_mps > 0.0
        ),
        cabin_w=steady_w,
        cabin_start_w=start_w,
        cabin_time_s=cabin_time_s,
        tyre_time_s=float(strength.tyre_time_s) if strength.tyre_warm_up_frac > 0.0 else 0.0,
        table=False,
        climb_up_j_per_m=0.0,
        climb_down_j_per_m=0.0,
        kinetic_up_kg=0.0,
        kinetic_down_kg=0.0,
    )
    return Drive(vehicle, conditions, physics)


def rolling_temperature_factor(conditions: Conditions, strength: EffectCoefficients) -> float:
    """Rolling resistance over that at the reference, 1 + k·(T_ref − T) [-] (ISO 28580, equation of temperature)."""
    if conditions.ambient_k is None:
        return 1.0
    return 1.0 + strength.rolling_temp_per_k * (REFERENCE_K - conditions.ambient_k)


def air_density_factor(conditions: Conditions, altitude_m: NDArray[np.float64] | None) -> NDArray[np.float64] | float:
    """Density of the air over that at the reference [-]: p/p_ref · T_ref/T, p by the standard atmosphere (ISO 2533)."""
    factor: NDArray[np.float64] | float = 1.0
    if conditions.ambient_k is not None:
        factor = REFERENCE_K / conditions.ambient_k
    if conditions.thin_air:
        if altitude_m is None:
            if conditions.altitude_density:
                raise ConditionsError("conditions.altitude_density", True, "false where links have no altitude")
            return factor
        lapsed = np.maximum(1.0 - LAPSE_K_PER_M / SEA_LEVEL_K * altitude_m, 0.1)
        return np.asarray(factor * (SEA_LEVEL_PA / REFERENCE_PA) * lapsed**BAROMETRIC_EXPONENT, np.float64)
    return factor


def cabin_power_w(conditions: Conditions, strength: EffectCoefficients) -> tuple[float, float, float]:
    """Electric power of heating or cooling [W]: what stays, what decays from departure on, and with which time τ [s].

    Thermal: |UA·(T − T_set) + sun| to stay, soak·|T_cabin − T_set|·exp(−t/τ) at the start, each over the COP of heating
    or cooling, whichever it is; the fan, in proportion up to FAN_FULL_W of thermal power; at most the climate's limit.
    T_set, UA, soak and τ are those of heating where heat is missing, of cooling where there is too much; between the
    two temperatures neither is needed. Where both are at once they are not set off against each other.
    """
    if conditions.ambient_k is None or not conditions.climate:
        return 0.0, 0.0, float(strength.cabin_time_s)
    heated_k = strength.cabin_target_k
    cooled_k = heated_k if strength.cooling_target_k is None else strength.cooling_target_k
    soak, time_s = strength.cabin_soak_w_per_k, strength.cabin_time_s
    begin_k = conditions.ambient_k if conditions.cabin_start_k is None else conditions.cabin_start_k
    if begin_k > heated_k:
        soak = soak if strength.cooling_soak_w_per_k is None else strength.cooling_soak_w_per_k
        time_s = time_s if strength.cooling_time_s is None else strength.cooling_time_s
    starts_w = soak * _excess(begin_k - heated_k, begin_k - cooled_k)
    heat_w = strength.cabin_ua_w_per_k * (conditions.ambient_k - heated_k) + conditions.sun_w
    cool_ua = strength.cabin_ua_w_per_k if strength.cooling_ua_w_per_k is None else strength.cooling_ua_w_per_k
    cool_w = cool_ua * (conditions.ambient_k - cooled_k) + conditions.sun_w
    stays_w = _excess(heat_w, cool_w)
    fan_w = strength.climate_fan_w * min(abs(stays_w) / FAN_FULL_W, 1.0)
    steady_w = min(_electric_w(stays_w, strength) + fan_w, strength.climate_limit_w)
    return steady_w, min(_electric_w(starts_w, strength), strength.climate_limit_w - steady_w), float(time_s)


def _excess(above_heated: float, above_cooled: float) -> float:
    """What is too much, positive, or missing, negative, with nothing to do in between."""
    return above_cooled if above_cooled > 0.0 else min(above_heated, 0.0)


def _electric_w(thermal_w: float, strength: EffectCoefficients) -> float:
    return abs(thermal_w) / (strength.cooling_cop if thermal_w > 0.0 else strength.heating_cop)


def resistance_rise_ohm(conditions: Conditions, strength: EffectCoefficients) -> float:
    """Internal resistance above that at the reference temperature [Ω]; warmth above it changes nothing."""
    if conditions.ambient_k is None or conditions.ambient_k >= RESISTANCE_REFERENCE_K:
        return 0.0
    doublings = (RESISTANCE_REFERENCE_K - conditions.ambient_k) / strength.resistance_doubling_k
    return strength.battery_resistance_ohm * (math.exp2(doublings) - 1.0)


def regen_limit(conditions: Conditions, strength: EffectCoefficients, capacity_wh: float) -> tuple[float, float]:
    """Cap on recuperation [W], inf for none, and the charge below full over which less and less is accepted [J]."""
    if not (conditions.regen_limited or strength.regen_always_limited):
        return math.inf, 0.0
    cap_w = strength.regen_cap_w
    if conditions.ambient_k is not None:
        span = strength.regen_cold_full_k - strength.regen_cold_none_k
        cap_w *= min(max((conditions.ambient_k - strength.regen_cold_none_k) / span, 0.0), 1.0)
    return cap_w, (1.0 - strength.regen_fade_soc_frac) * capacity_wh * JOULE_PER_WH


def _rolling_n(vehicle: Vehicle, conditions: Conditions) -> tuple[float, float, float, float]:
    """Rolling resistance on the flat [N]: of the vehicle, by tyre temperature, road surface and payload."""
    strength = vehicle.effects
    base = float(vehicle.road_load_a_n)
    temperature = base * (rolling_temperature_factor(conditions, strength) - 1.0)
    added = {
        RoadSurface.DRY: 0.0,
        RoadSurface.WET: strength.wet_rolling_coef,
        RoadSurface.SNOW: strength.snow_rolling_coef,
    }[conditions.road]
    surface = added * vehicle.mass_kg * GRAVITY_MPS2
    payload = (base + temperature + surface) * (conditions.payload_kg / vehicle.mass_kg)
    return base, temperature, surface, payload


def _warm_up_n(vehicle: Vehicle, conditions: Conditions) -> float:
    """Rolling resistance on the flat that cold tyres add at departure [N]; what lies on the road has no part in it."""
    base, temperature, _, _ = _rolling_n(vehicle, conditions)
    loaded = 1.0 + conditions.payload_kg / vehicle.mass_kg
    return vehicle.effects.tyre_warm_up_frac * max(base + temperature, 0.0) * loaded


def _linear_n_per_mps(vehicle: Vehicle, conditions: Conditions) -> tuple[float, float]:
    """Part of the road load that grows with speed [N/(m/s)]: of the vehicle, and of water on the road."""
    wet = vehicle.effects.wet_drag_n_per_mps if conditions.road is RoadSurface.WET else 0.0
    return float(vehicle.road_load_b_n_per_mps), wet


def _aero_n_per_mps2(
    vehicle: Vehicle, conditions: Conditions, links: LinkSetting
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Drag coefficient of each link [N/(m/s)²]: of the vehicle, by air density, and by roof load and yaw."""
    base = np.full(links.grade_frac.size, float(vehicle.road_load_c_n_per_mps2))
    strength = vehicle.effects.air_density_coef
    # with a strength above 1 thin air could weigh less than nothing
    density = base * np.maximum((air_density_factor(conditions, links.altitude_m) - 1.0) * strength, -1.0)
    factor = conditions.drag_factor
    drag = (base + density) * (factor - 1.0)
    if conditions.wind_speed_mps > 0.0:
        ahead, across = _wind_mps(conditions, links)
        yaw_rad = np.arctan2(across, np.maximum(links.driven_mps + ahead, YAW_SPEED_MPS))
        drag = (base + density) * (factor * (1.0 + vehicle.effects.yaw_drag_per_rad * yaw_rad) - 1.0)
    return base, density, drag


def _wind_mps(conditions: Conditions, links: LinkSetting) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wind against the direction of travel and across it [m/s]."""
    if links.heading is None:
        raise ConditionsError("conditions.wind_speed_mps", conditions.wind_speed_mps, "0 where links have no heading")
    east, north = math.sin(conditions.wind_from_rad), math.cos(conditions.wind_from_rad)
    ahead = conditions.wind_speed_mps * (east * links.heading[:, 0] + north * links.heading[:, 1])
    across = conditions.wind_speed_mps * np.abs(north * links.heading[:, 0] - east * links.heading[:, 1])
    return ahead, across


def _least_load_n(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least of a + b·v + c·v² over 0..200 km/h, float64 (n,) [N]: warm tyres and thin air may take it below 0."""
    top = np.full_like(a, CHECKED_SPEED_MPS)
    vertex = np.divide(-b, 2.0 * c, out=np.zeros_like(a), where=c > 0.0)
    at = np.stack((np.zeros_like(a), top, np.clip(vertex, 0.0, CHECKED_SPEED_MPS)))
    return np.asarray((a + (b + c * at) * at).min(axis=0), np.float64)


def _share(part: float, whole: float) -> float:
    return part / whole if whole != 0.0 else 0.0


def _table_physics(vehicle: ConsumptionTableVehicle, conditions: Conditions) -> LinkPhysics:
    """Kernel parameters of a consumption table; climate and auxiliary power are the only effects that it can feel."""
    for name, value, off in (
        ("wind_speed_mps", conditions.wind_speed_mps, 0.0),
        ("payload_kg", conditions.payload_kg, 0.0),
        ("drag_factor", conditions.drag_factor, 1.0),
        ("road", conditions.road, RoadSurface.DRY),
        ("regen_limited", conditions.regen_limited, False),
        ("altitude_density", conditions.altitude_density or False, False),
    ):
        if value != off:
            raise ConditionsError(
                f"conditions.{name}",
                str(value),
                f"{off} for vehicle {vehicle.id!r}, a consumption table without forces",
            )
    steady_w, start_w, cabin_time_s = cabin_power_w(conditions, EffectCoefficients())
    aux_w = float(vehicle.aux_power_w if conditions.aux_power_w is None else conditions.aux_power_w)
    up, down = float(vehicle.ascent_j_per_m), float(vehicle.descent_j_per_m)
    nothing = np.array([0.0, CHECKED_SPEED_MPS])
    return LinkPhysics(
        weight_n=0.5 * (up + down),
        inertia_kg=0.5 * (vehicle.kinetic_up_kg + vehicle.kinetic_down_kg),
        drive_factor=1.0,
        recuperation_factor=1.0,
        aux_move_w=aux_w,
        aux_idle_w=aux_w,
        speed_bound_mps=nothing,
        accel_sum=np.array([0.0, 1.0]),
        decel_sum=np.array([0.0, 1.0]),
        printed=False,
        regen_cap_w=math.inf,
        fade_width_j=0.0,
        loss_per_n2=0.0,
        loss_per_w=0.0,
        regen_min_mps=0.0,
        lossy=False,
        cabin_w=steady_w,
        cabin_start_w=start_w,
        cabin_time_s=cabin_time_s,
        tyre_time_s=0.0,
        table=True,
        climb_up_j_per_m=up,
        climb_down_j_per_m=down,
        kinetic_up_kg=float(vehicle.kinetic_up_kg),
        kinetic_down_kg=float(vehicle.kinetic_down_kg),
    )
