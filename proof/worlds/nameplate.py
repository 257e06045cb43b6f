"""The vehicle file that a tool is given: numbers that fit the true car about, or that are off by a known factor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from proof.worlds.car import STANDARD_GRAVITY_MPS2, STILL_AIR_KG_PER_M3, Car
from proof.worlds.dynamics import BRAKING_ELECTRIC, BRAKING_MECH, DRIVE_ELECTRIC, DRIVE_MECH, rolling_coef

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from proof.worlds.dynamics import WorldDrive

COAST_KMH: Final = (15.0, 130.0)  # speeds of a coast-down
PARAMETERS: Final = (
    "mass_kg",
    "road_load_a_n",
    "road_load_b_n_per_mps",
    "road_load_c_n_per_mps2",
    "drive_eff",
    "recuperation_eff",
    "aux_power_w",
)
_SECTIONS: Final = {
    "mass_kg": ("mass", "value_kg", 0),
    "road_load_a_n": ("road_load_a", "value_n", 2),
    "road_load_b_n_per_mps": ("road_load_b", "value_n_per_mps", 4),
    "road_load_c_n_per_mps2": ("road_load_c", "value_n_per_mps2", 5),
    "drive_eff": ("drive_efficiency", "value_eff", 4),
    "recuperation_eff": ("recuperation_efficiency", "value_eff", 4),
    "aux_power_w": ("aux_power", "value_w", 0),
}


@dataclass(frozen=True, slots=True)
class Nameplate:
    """What a maker says of a car: the parameters of a vehicle file, in SI units."""

    mass_kg: float
    rotating_coef: float
    road_load_a_n: float
    road_load_b_n_per_mps: float
    road_load_c_n_per_mps2: float
    drive_eff: float
    recuperation_eff: float
    aux_power_w: float
    usable_capacity_kwh: float
    battery_volt: float


def nameplate_of(car: Car, driven: Iterable[WorldDrive]) -> Nameplate:
    """The numbers that fit a car: coast-down by least squares, efficiencies as on drives without any effect."""
    speed = np.linspace(*COAST_KMH, 47) / 3.6
    force = np.array([coast_down_n(car, float(v)) for v in speed])
    columns = np.column_stack([np.ones_like(speed), speed, speed * speed])
    a, b, c = np.linalg.lstsq(columns, force, rcond=None)[0].tolist()
    if b < 0.0:
        b = 0.0
        a, c = np.linalg.lstsq(columns[:, [0, 2]], force, rcond=None)[0].tolist()
    total = np.sum([drive.energy_j for drive in driven], axis=0)
    return Nameplate(
        mass_kg=car.mass_kg,
        rotating_coef=car.rotating_coef,
        road_load_a_n=a,
        road_load_b_n_per_mps=b,
        road_load_c_n_per_mps2=c,
        drive_eff=float(total[DRIVE_MECH] / total[DRIVE_ELECTRIC]),
        recuperation_eff=float(total[BRAKING_ELECTRIC] / total[BRAKING_MECH]),
        aux_power_w=car.aux_w,
        usable_capacity_kwh=car.capacity_j / 3.6e6,
        battery_volt=car.open_volt + 0.5 * car.open_volt_rise,
    )


def coast_down_n(car: Car, speed_mps: float) -> float:
    """Resistance of the warm car on a flat road in still air at 20 °C [N]."""
    rolling = car.mass_kg * STANDARD_GRAVITY_MPS2 * rolling_coef(car, speed_mps)
    gear = car.gear_drag_n + car.gear_drag_n_per_mps * speed_mps
    return float(rolling + gear + 0.5 * STILL_AIR_KG_PER_M3 * car.drag_area_m2 * speed_mps**2)


def draw_changes(rng: np.random.Generator, off: tuple[float, float] = (0.03, 0.15)) -> dict[str, float]:
    """Factors for two to four parameters, off by so much either way; efficiencies never above 0.98."""
    names = [name for name in PARAMETERS if name != "road_load_b_n_per_mps"]
    chosen = rng.choice(len(names), size=int(rng.integers(2, 5)), replace=False)
    changes = {}
    for at in sorted(chosen.tolist()):
        size = float(rng.uniform(*off)) * (1.0 if rng.random() < 0.5 else -1.0)
        changes[names[at]] = 1.0 + (-abs(size) if names[at].endswith("_eff") else size)
    return changes


def changed(nameplate: Nameplate, factors: Mapping[str, float]) -> Nameplate:
    """The nameplate with parameters multiplied by their factors."""
    return replace(nameplate, **{name: getattr(nameplate, name) * factor for name, factor in factors.items()})


def vehicle_toml(nameplate: Nameplate) -> str:
    """The vehicle file `vehicle.toml`, whose id is its name: the same whatever the world hides but for its numbers."""
    source = 'source = "maker\'s description of a made-up car"'
    parts = ['id = "vehicle"', 'name = "A made-up car"', 'powertrain = "bev"']
    for name, (section, key, decimals) in _SECTIONS.items():
        parts += ["", f"[{section}]", f"{key} = {getattr(nameplate, name):.{decimals}f}", source]
    parts += ["", "[rotating_mass]", f"value_coef = {nameplate.rotating_coef:.4f}", source]
    for section in ("aux_efficiency_moving", "aux_efficiency_idle"):
        parts += ["", f"[{section}]", "value_eff = 1.0", source]
    parts += ["", "[usable_capacity]", f"value_kwh = {nameplate.usable_capacity_kwh:.1f}", source]
    parts += ["", "[battery_voltage]", f"value_v = {nameplate.battery_volt:.0f}", source]
    parts += ["", "[accel_speed]", "value_kmh = [0, 50, 130]", source]
    parts += ["", "[acceleration]", "value_mps2 = [1.2, 0.6]", source]
    parts += ["", "[deceleration]", "value_mps2 = [-1.2, -0.9]", source]
    return "\n".join(parts) + "\n"
