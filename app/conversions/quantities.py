"""Names and units of a vehicle's numbers: those of requests and answers, and those inside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.schemas.effects import CELSIUS_FIELDS
from energy.units import JOULE_PER_M_PER_KWH_PER_100KM, JOULE_PER_WH, KMH_PER_MPS, MPS_PER_MPH, NEWTON_PER_LBF

if TYPE_CHECKING:
    from collections.abc import Mapping

WH_PER_KWH: Final = 1000.0


@dataclass(frozen=True, slots=True)
class Renamed:
    """A number whose name or unit differs: difference inside = difference shown · factor."""

    shown: str
    inside: str
    factor: float


# of two that are inside the same number, answers show the first
RENAMED: Final = (
    Renamed("road_load.a_n", "road_load_a_n", 1.0),
    Renamed("road_load.b_n_per_kmh", "road_load_b_n_per_mps", KMH_PER_MPS),
    Renamed("road_load.c_n_per_kmh2", "road_load_c_n_per_mps2", KMH_PER_MPS**2),
    Renamed("road_load.a_lbf", "road_load_a_n", NEWTON_PER_LBF),
    Renamed("road_load.b_lbf_per_mph", "road_load_b_n_per_mps", NEWTON_PER_LBF / MPS_PER_MPH),
    Renamed("road_load.c_lbf_per_mph2", "road_load_c_n_per_mps2", NEWTON_PER_LBF / MPS_PER_MPH**2),
    Renamed("usable_capacity_kwh", "usable_capacity_wh", WH_PER_KWH),
    Renamed("acceleration.speed_kmh", "accel_speed_mps", 1.0 / KMH_PER_MPS),
    Renamed("acceleration.accel_mps2", "accel_mps2", 1.0),
    Renamed("acceleration.decel_mps2", "decel_mps2", 1.0),
    *(Renamed(f"effects.{shown}", f"effects.{inside}", 1.0) for inside, shown in CELSIUS_FIELDS.items()),
    Renamed("consumption.speed_kmh", "speed_mps", 1.0 / KMH_PER_MPS),
    Renamed("consumption.kwh_per_100km", "consumption_j_per_m", JOULE_PER_M_PER_KWH_PER_100KM),
    Renamed("ascent_wh_per_m", "ascent_j_per_m", JOULE_PER_WH),
    Renamed("descent_wh_per_m", "descent_j_per_m", JOULE_PER_WH),
    Renamed("kinetic.acceleration_eff", "kinetic_up_kg", 1.0),
    Renamed("kinetic.deceleration_eff", "kinetic_down_kg", 1.0),
)
_BY_SHOWN: Final = {renamed.shown: renamed for renamed in RENAMED}
_BY_INSIDE: Final = {renamed.inside: renamed for renamed in reversed(RENAMED)}


def shown_names(by_inside: Mapping[str, str]) -> dict[str, str]:
    """Texts by the names of requests and answers."""
    return {_BY_INSIDE[name].shown if name in _BY_INSIDE else name: value for name, value in by_inside.items()}


def inside_names(by_shown: Mapping[str, str]) -> dict[str, str]:
    """Texts by the names inside."""
    return {_BY_SHOWN[name].inside if name in _BY_SHOWN else name: value for name, value in by_shown.items()}


def shown_sd(by_inside: Mapping[str, float]) -> dict[str, float]:
    """Standard deviations by the names, and in the units, of requests and answers."""
    shown: dict[str, float] = {}
    for name, value in by_inside.items():
        renamed = _BY_INSIDE.get(name, Renamed(name, name, 1.0))
        shown[renamed.shown] = value / renamed.factor
    return shown


def inside_sd(by_shown: Mapping[str, float]) -> dict[str, float]:
    """Standard deviations by the names, and in the units, inside."""
    inside: dict[str, float] = {}
    for name, value in by_shown.items():
        renamed = _BY_SHOWN.get(name, Renamed(name, name, 1.0))
        inside[renamed.inside] = value * renamed.factor
    return inside
