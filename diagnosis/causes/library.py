"""The physics that a diagnosis knows by name: what one unit of each effect's coefficient would draw, step by step.

Every term is one of docs/effects.md, so that a coefficient found for it is a coefficient of the model. Terms with a
shape (a time constant, a threshold) are tried over its grid and refined where they are found. κ, battery energy over
work at the wheels, is that of the step.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.causes.families import Family
from diagnosis.causes.terms import Candidate, Term, TermShape
from energy.conditions import Conditions
from energy.force.effects import REFERENCE_K, RESISTANCE_REFERENCE_K, air_density_factor
from energy.units import GRAVITY_MPS2, KMH_PER_MPS, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.driven import ReplayedDrive

CABIN_K: Final = 294.15
FULL_SOC: Final = 0.85  # from here on a full battery may refuse recuperation
RESTART_S: Final = 10.0  # from the start on, in which a battery has the temperature that it was parked with


TAU: Final = TermShape("time_constant", "s", (120.0, 300.0, 600.0, 1200.0), 40.0, 3600.0)
HEAT_TO: Final = TermShape("heated_below", "°C", (12.0, 16.0, 20.0, 24.0), 5.0, 28.0)
COOL_TO: Final = TermShape("cooled_above", "°C", (18.0, 22.0, 26.0), 12.0, 32.0)
TYRE_TAU: Final = TermShape("time_constant", "s", (300.0, 600.0, 1200.0), 100.0, 3600.0)
REGEN_CAP: Final = TermShape("cap", "kW", (10.0, 15.0, 22.0, 32.0, 45.0, 65.0), 3.0, 120.0)
REGEN_LOW: Final = TermShape("cut_off", "km/h", (7.0, 11.0, 15.0, 20.0), 3.0, 30.0)
REGEN_FADE: Final = TermShape("fades_from", "km/h", (12.0, 20.0, 32.0), 5.0, 50.0)
REGEN_COLD: Final = TermShape("full_from", "°C", (5.0, 12.0), 0.0, 20.0)
BLEND: Final = TermShape("friction_beyond", "m/s²", (0.8, 1.4, 2.0), 0.5, 3.5)
BATTERY_COLD: Final = TermShape("battery_below", "°C", (2.0, 8.0, 14.0, 20.0), -10.0, 25.0)
BATTERY_HOT: Final = TermShape("battery_above", "°C", (28.0, 33.0, 38.0), 24.0, 48.0)


def _known_k(drive: ReplayedDrive) -> float:
    assert drive.ambient_k is not None, "terms that need the temperature are not asked without it"
    return drive.ambient_k


def _cold_k(drive: ReplayedDrive, target_k: float = CABIN_K) -> float:
    return max(target_k - _known_k(drive), 0.0)


def _hot_k(drive: ReplayedDrive, target_k: float = CABIN_K) -> float:
    return max(_known_k(drive) - target_k, 0.0)


def decaying_s(drive: ReplayedDrive, tau_s: float) -> NDArray[np.float64]:
    """∫ exp(−t/τ) dt of each step from the start on, exact, float64 (n,) [s]."""
    begin_s = drive.since_s - 0.5 * drive.duration_s
    return np.asarray(tau_s * np.exp(-begin_s / tau_s) * -np.expm1(-drive.duration_s / tau_s), np.float64)


def _restart(drive: ReplayedDrive, tau_s: float) -> NDArray[np.float64]:
    """Warm-up that is saved where a battery warmer than the air tells that the car has just been driven."""
    kelvin = drive.channels["battery_k"][: max(int(RESTART_S), 1)]
    warmer_k = min(max(float(np.mean(kelvin)) - _known_k(drive), 0.0), _cold_k(drive))
    return np.asarray(-warmer_k * decaying_s(drive, tau_s), np.float64)


def _rolling_n(drive: ReplayedDrive) -> float:
    return float(drive.vehicle.road_load_a_n)


def _drag_n(drive: ReplayedDrive) -> NDArray[np.float64]:
    return np.asarray(drive.vehicle.road_load_c_n_per_mps2 * drive.speed_mps**2, np.float64)


def _density(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    altitude = drive.channels.get("altitude_m")
    conditions = Conditions(ambient_k=_known_k(drive), altitude_density=altitude is not None)
    factor = air_density_factor(conditions, altitude)
    return drive.work_j(_drag_n(drive) * (factor - 1.0))


def _headwind(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    angle = drive.channels["wind_from_rad"] - drive.channels["heading_rad"]
    ahead = drive.channels["wind_speed_mps"] * np.cos(angle)
    v, drag = drive.speed_mps, drive.vehicle.road_load_c_n_per_mps2
    return drive.work_j(drag * ((v + ahead) * np.abs(v + ahead) - v * v))


def _crosswind(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    angle = drive.channels["wind_from_rad"] - drive.channels["heading_rad"]
    ahead, across = (drive.channels["wind_speed_mps"] * turned for turned in (np.cos(angle), np.abs(np.sin(angle))))
    yaw_rad = np.arctan2(across, np.maximum(drive.speed_mps + ahead, 1.0))
    return drive.work_j(_drag_n(drive) * yaw_rad)


def _unknown_wind(
    turned: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> Callable[[ReplayedDrive, float], NDArray[np.float64]]:
    def energy_j(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
        drag = 2.0 * drive.vehicle.road_load_c_n_per_mps2 * drive.speed_mps
        return drive.work_j(drag * turned(drive.channels["heading_rad"]))

    return energy_j


def _payload(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    force = drive.vehicle.rotating_mass_coef * drive.accel_mps2 + GRAVITY_MPS2 * drive.grade_frac
    return drive.work_j(drive.channels["payload_kg"] * (force + _rolling_n(drive) / drive.vehicle.mass_kg))


def _wet_linear(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    return drive.work_j(drive.channels["wet_frac"] * drive.speed_mps)


def _load_loss(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    return np.asarray(drive.force_n**2 * drive.duration_s, np.float64)


def _resistance(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    volt = drive.vehicle.effects.battery_voltage_v
    return np.asarray((drive.power_w / volt) ** 2 * drive.duration_s, np.float64)


def _measured_resistance(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    """Loss of the battery by the resistance that its voltage tells, at the battery's temperature or else the air's."""
    battery = drive.battery
    assert battery is not None, "terms that need the voltage are not asked without it"
    kelvin = drive.channels.get("battery_k", RESISTANCE_REFERENCE_K if drive.ambient_k is None else drive.ambient_k)
    return np.asarray((drive.power_w / battery.volt) ** 2 * battery.ohm_at(kelvin) * drive.duration_s, np.float64)


def _cold_resistance(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    cold_k = max(RESISTANCE_REFERENCE_K - _known_k(drive), 0.0)
    rise = np.exp2(cold_k / drive.vehicle.effects.resistance_doubling_k) - 1.0
    return np.asarray(rise * _resistance(drive, 0.0), np.float64)


def _beyond_cap(drive: ReplayedDrive, cap_kw: float) -> NDArray[np.float64]:
    return np.maximum(drive.recovered_w() - 1000.0 * cap_kw, 0.0) * drive.duration_s


def _below_cut_off(drive: ReplayedDrive, cut_off_kmh: float) -> NDArray[np.float64]:
    slow = drive.speed_mps < cut_off_kmh / KMH_PER_MPS
    return np.asarray(drive.recovered_w() * slow * drive.duration_s, np.float64)


def _fading(drive: ReplayedDrive, from_kmh: float) -> NDArray[np.float64]:
    """Recuperation that fades evenly from a speed down to standstill."""
    lost = np.maximum(1.0 - drive.speed_mps * KMH_PER_MPS / from_kmh, 0.0)
    return np.asarray(drive.recovered_w() * lost * drive.duration_s, np.float64)


def _hard_braking(drive: ReplayedDrive, beyond_mps2: float) -> NDArray[np.float64]:
    """What brakes beyond a deceleration take from recuperation: the part of the force above it."""
    most_n = drive.vehicle.mass_kg * beyond_mps2
    extra_n = np.maximum(-drive.force_n - most_n, 0.0)
    return np.asarray(drive.vehicle.recuperation_eff * extra_n * drive.speed_mps * drive.duration_s, np.float64)


def _cold_regen(drive: ReplayedDrive, full_from_c: float) -> NDArray[np.float64]:
    kelvin = drive.channels.get("battery_k", np.full_like(drive.duration_s, _known_k(drive)))
    span_k = 25.0  # from all to none, as regen_cold_full_k to regen_cold_none_k
    lost = np.clip((full_from_c + ZERO_CELSIUS_K - kelvin) / span_k, 0.0, 1.0)
    return np.asarray(drive.recovered_w() * lost * drive.duration_s, np.float64)


def _full_regen(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    lost = np.clip((drive.channels["soc_frac"] - FULL_SOC) / (1.0 - FULL_SOC), 0.0, 1.0)
    return np.asarray(drive.recovered_w() * lost * drive.duration_s, np.float64)


def _cornering(drive: ReplayedDrive, _: float) -> NDArray[np.float64]:
    side_n = drive.vehicle.mass_kg * drive.speed_mps**2 * drive.channels["curvature_per_m"]
    side_n = np.clip(side_n, -0.8 * drive.vehicle.mass_kg * GRAVITY_MPS2, 0.8 * drive.vehicle.mass_kg * GRAVITY_MPS2)
    return drive.work_j(side_n**2)


def _conditioning(sign: float) -> Callable[[ReplayedDrive, float], NDArray[np.float64]]:
    def energy_j(drive: ReplayedDrive, limit_c: float) -> NDArray[np.float64]:
        beyond = sign * (drive.channels["battery_k"] - ZERO_CELSIUS_K - limit_c) > 0.0
        return np.asarray(beyond * drive.duration_s, np.float64)

    return energy_j


_HEATING: Final = "cabin_heating"
_COOLING: Final = "air_conditioning"
_WIND: Final = ("wind_speed_mps", "wind_from_rad", "heading_rad")

LIBRARY: Final[tuple[Term, ...]] = (
    Term(
        _HEATING,
        "heating_w_per_k",
        "W/K",
        Family.THERMAL,
        lambda d, c: _cold_k(d, c + ZERO_CELSIUS_K) * d.duration_s,
        HEAT_TO,
        needs_ambient=True,
        most=400.0,
    ),
    Term(
        _HEATING,
        "warm_up_w_per_k",
        "W/K",
        Family.THERMAL,
        lambda d, tau: _cold_k(d) * decaying_s(d, tau),
        TAU,
        needs_ambient=True,
        most=600.0,
    ),
    Term(
        _HEATING,
        "warm_restart_w_per_k",
        "W/K",
        Family.THERMAL,
        _restart,
        TAU,
        channels=("battery_k",),
        needs_ambient=True,
    ),
    Term(
        _COOLING,
        "cooling_w_per_k",
        "W/K",
        Family.THERMAL,
        lambda d, c: _hot_k(d, c + ZERO_CELSIUS_K) * d.duration_s,
        COOL_TO,
        needs_ambient=True,
        most=300.0,
    ),
    Term(
        _COOLING,
        "pull_down_w_per_k",
        "W/K",
        Family.THERMAL,
        lambda d, tau: _hot_k(d) * decaying_s(d, tau),
        TAU,
        needs_ambient=True,
        most=600.0,
    ),
    Term(
        "battery_heating",
        "battery_heating_w",
        "W",
        Family.THERMAL,
        _conditioning(-1.0),
        BATTERY_COLD,
        channels=("battery_k",),
        most=8000.0,
    ),
    Term(
        "battery_cooling",
        "battery_cooling_w",
        "W",
        Family.THERMAL,
        _conditioning(1.0),
        BATTERY_HOT,
        channels=("battery_k",),
        most=8000.0,
    ),
    Term(
        "rolling_temperature",
        "rolling_temp_per_k",
        "1/K",
        Family.ROLLING,
        lambda d, _: d.work_j(_rolling_n(d) * (REFERENCE_K - _known_k(d))),
        needs_ambient=True,
        most=0.03,
    ),
    Term(
        "tyre_warm_up",
        "tyre_warm_up_frac",
        "1",
        Family.ROLLING,
        lambda d, tau: d.work_j(_rolling_n(d)) * np.exp(-d.since_s / tau),
        TYRE_TAU,
        most=1.0,
    ),
    Term(
        "wet_road",
        "wet_rolling_coef",
        "1",
        Family.ROLLING,
        lambda d, _: d.work_j(d.vehicle.mass_kg * GRAVITY_MPS2 * d.channels["wet_frac"]),
        channels=("wet_frac",),
        most=0.02,
    ),
    Term("wet_road", "wet_drag_n_per_mps", "N/(m/s)", Family.ROLLING, _wet_linear, channels=("wet_frac",)),
    Term("cornering", "cornering_per_n", "1/N", Family.ROLLING, _cornering, channels=("curvature_per_m",)),
    Term("air_density", "air_density_coef", "1", Family.AERODYNAMIC, _density, needs_ambient=True, most=1.6),
    Term("wind", "wind_coef", "1", Family.WIND, _headwind, channels=_WIND, oscillates=True, most=2.0),
    Term("side_wind", "yaw_drag_per_rad", "1/rad", Family.WIND, _crosswind, channels=_WIND),
    Term(
        "steady_wind",
        "wind_from_east_mps",
        "m/s",
        Family.WIND,
        _unknown_wind(np.sin),
        positive=False,
        channels=("heading_rad",),
        oscillates=True,
    ),
    Term(
        "steady_wind",
        "wind_from_north_mps",
        "m/s",
        Family.WIND,
        _unknown_wind(np.cos),
        positive=False,
        channels=("heading_rad",),
        oscillates=True,
    ),
    Term("payload", "payload_coef", "1", Family.MASS, _payload, channels=("payload_kg",), oscillates=True, most=2.0),
    Term("load_loss", "drive_loss_w_per_n2", "W/N²", Family.DRIVETRAIN, _load_loss),
    Term(
        "cold_battery",
        "cold_battery_resistance_ohm",
        "Ω",
        Family.BATTERY,
        _cold_resistance,
        needs_ambient=True,
        most=0.5,
        by_voltage=False,
    ),
    Term(
        "battery_resistance",
        "battery_loss_share",
        "1",
        Family.BATTERY,
        _measured_resistance,
        most=1.3,
        by_voltage=True,
    ),
    Term("recuperation_cap", "lost_beyond_cap_frac", "1", Family.RECUPERATION, _beyond_cap, REGEN_CAP, most=1.0),
    Term(
        "recuperation_low_speed",
        "lost_below_frac",
        "1",
        Family.RECUPERATION,
        _below_cut_off,
        REGEN_LOW,
        most=1.0,
        alternative=True,
    ),
    Term(
        "recuperation_low_speed",
        "lost_fading_frac",
        "1",
        Family.RECUPERATION,
        _fading,
        REGEN_FADE,
        most=1.0,
        alternative=True,
    ),
    Term("friction_blending", "lost_to_brakes_frac", "1", Family.RECUPERATION, _hard_braking, BLEND, most=1.0),
    Term(
        "recuperation_cold",
        "lost_in_cold_frac",
        "1",
        Family.RECUPERATION,
        _cold_regen,
        REGEN_COLD,
        needs_ambient=True,
        most=1.5,
    ),
    Term(
        "recuperation_full",
        "lost_when_full_frac",
        "1",
        Family.RECUPERATION,
        _full_regen,
        channels=("soc_frac",),
        most=1.5,
    ),
)


def candidates(drives: Sequence[ReplayedDrive], library: Sequence[Term] = LIBRARY) -> tuple[Candidate, ...]:
    """Every term that any of the drives knows, at every value of its grid."""
    found = []
    for term in library:
        if not any(term.known_on(drive) for drive in drives):
            continue
        if term.by_voltage is False and any(drive.battery is not None for drive in drives):
            continue
        found += [Candidate(term, value) for value in (term.shape.grid if term.shape else (float("nan"),))]
    return tuple(found)
