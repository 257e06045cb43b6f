"""A vehicle as the link-energy model needs it (source, table I), validated and in SI units."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from energy.errors import VehicleError
from energy.units import KMH_PER_MPS
from energy.vehicle.coefficients import EffectCoefficients

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from numpy.typing import NDArray

    from energy.charging.charging import Charging

MOST_RESIDUAL_SD_FRAC: Final = 0.5
CHECKED_SPEED_MPS: Final = 200.0 / KMH_PER_MPS
STEEP_COS: Final = 0.95  # cos θ of a 31 % grade, which takes that much of A (equation 4)


class Powertrain(StrEnum):
    """What the stored energy is: a traction battery's or a tank's."""

    BEV = "bev"
    ICE = "ice"


@dataclass(frozen=True, slots=True)
class Vehicle:
    """One vehicle with the parameters of the source's table I, in SI units.

    mass_kg: total mass with occupants and load [kg].
    road_load_a_n, road_load_b_n_per_mps, road_load_c_n_per_mps2: F = A·cosθ + B·v + C·v² [N, N/(m/s), N/(m/s)²].
    rotating_mass_coef: d, mass factor of the rotating parts [-], at least 1.
    drive_eff: η_dis, battery to wheel [-]; recuperation_eff: η_chg, wheel to battery [-].
    aux_power_w: P_aux [W]; aux_move_eff, aux_idle_eff: η_aux moving and standing [-].
    accel_speed_mps: float64 (n+1,), rising from 0, boundaries of the speed intervals [m/s].
    accel_mps2, decel_mps2: float64 (n,), mean acceleration (> 0) and braking (< 0) in each interval [m/s²].
    usable_capacity_wh: usable battery (or tank) energy [Wh].
    sources: where each number is from, by field name; "assumed …" where nothing is published.
    sd: standard deviation of a number by field name, in that field's unit; a field without one is taken as certain.
    effects: how strong each effect is that conditions switch on.
    residual_sd_frac: standard deviation of a trip's dissipated energy about this model's, where it was measured on the
    vehicle's own trips [-]; None where it was not.
    charging: which plugs fit and what power the battery takes; None where it is not known.

    Raises VehicleError when a number is out of range, when η_dis·η_chg > 1 (a round trip would gain
    energy) or when the road load is negative somewhere in 0..200 km/h.
    """

    id: str
    name: str
    mass_kg: float
    road_load_a_n: float
    road_load_b_n_per_mps: float
    road_load_c_n_per_mps2: float
    drive_eff: float
    recuperation_eff: float
    aux_power_w: float
    usable_capacity_wh: float
    accel_speed_mps: NDArray[np.float64]
    accel_mps2: NDArray[np.float64]
    decel_mps2: NDArray[np.float64]
    powertrain: Powertrain = Powertrain.BEV
    rotating_mass_coef: float = 1.1
    aux_move_eff: float = 0.9
    aux_idle_eff: float = 0.9
    sources: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    sd: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    effects: EffectCoefficients = field(default_factory=EffectCoefficients)
    residual_sd_frac: float | None = None
    charging: Charging | None = None

    def __post_init__(self) -> None:
        product = self.drive_eff * self.recuperation_eff
        if self.drive_eff > 0.0 and self.recuperation_eff > 0.0 and product > 1.0:
            raise VehicleError("drive_eff*recuperation_eff", product, "at most 1", self.id)
        ranges: tuple[tuple[str, float, float, bool], ...] = (
            ("mass_kg", 0.0, 100_000.0, False),
            ("rotating_mass_coef", 1.0, 2.0, True),
            ("drive_eff", 0.0, 1.0, False),
            ("recuperation_eff", 0.0, 1.0, True),
            ("aux_power_w", 0.0, 100_000.0, True),
            ("aux_move_eff", 0.0, 1.0, False),
            ("aux_idle_eff", 0.0, 1.0, False),
            ("usable_capacity_wh", 0.0, 10_000_000.0, False),
        )
        for name, low, high, closed in ranges:
            value = float(getattr(self, name))
            if not ((value >= low if closed else value > low) and value <= high):
                bracket = "[" if closed else "("
                raise VehicleError(name, value, f"{bracket}{low:g}, {high:g}]", self.id)
        if self.residual_sd_frac is not None and not 0.0 <= self.residual_sd_frac <= MOST_RESIDUAL_SD_FRAC:
            raise VehicleError("residual_sd_frac", self.residual_sd_frac, f"[0, {MOST_RESIDUAL_SD_FRAC:g}]", self.id)
        self._check_tables()
        self._check_road_load()

    def with_residual(self, names: Collection[str]) -> Self:
        """The vehicle without standard deviations of these numbers, where its residual, measured on trips, holds them.

        names: fields, those of effects as effects.<field>.
        """
        if self.residual_sd_frac is None:
            return self
        return replace(self, sd=MappingProxyType({name: sd for name, sd in self.sd.items() if name not in names}))

    def _check_tables(self) -> None:
        bounds = self.accel_speed_mps
        if bounds.ndim != 1 or bounds.size < 2:
            raise VehicleError("accel_speed_mps", bounds.tolist(), "at least two boundaries", self.id)
        if not bool(np.all(np.isfinite(bounds))) or bounds[0] != 0.0 or not bool(np.all(np.diff(bounds) > 0.0)):
            raise VehicleError("accel_speed_mps", bounds.tolist(), "rising from 0", self.id)
        for name, sign in (("accel_mps2", 1.0), ("decel_mps2", -1.0)):
            table = getattr(self, name)
            if table.shape != (bounds.size - 1,):
                raise VehicleError(name, f"{table.size} values", f"{bounds.size - 1}, one a speed interval", self.id)
            if not bool(np.all((sign * table >= 0.01) & (sign * table <= 15.0))):
                allowed = "each 0.01..15" if sign > 0 else "each -15..-0.01"
                raise VehicleError(name, table.tolist(), allowed, self.id)

    def _check_road_load(self) -> None:
        a, b, c = self.road_load_a_n, self.road_load_b_n_per_mps, self.road_load_c_n_per_mps2
        for name, value in (
            ("road_load_a_n", a),
            ("road_load_b_n_per_mps", b),
            ("road_load_c_n_per_mps2", c),
        ):
            if not (np.isfinite(value) and abs(value) <= 1e6):
                raise VehicleError(name, value, "a finite number within ±1e6", self.id)
        speeds = [0.0, CHECKED_SPEED_MPS]
        if c > 0.0:
            speeds.append(min(max(-b / (2.0 * c), 0.0), CHECKED_SPEED_MPS))
        for flat, where in ((1.0, ""), (STEEP_COS, " on a 31 % grade")):
            for speed in speeds:
                force = flat * a + b * speed + c * speed * speed
                if force < 0.0:
                    at = f"{force:.1f} N at {speed * KMH_PER_MPS:.1f} km/h{where}"
                    raise VehicleError("road_load", at, "at least 0 N everywhere in 0..200 km/h", self.id)
