"""Vehicle parameters with a road load on one link, so that a hand-computed test needs to name no table of roads."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from energy.chain import kernels_link
from energy.force import kernels_phase
from energy.force.kernels_physics import LinkPhysics, Road


@dataclass(frozen=True)
class Loaded:
    """LinkPhysics together with A, B, C and wind; attributes of either can be read and replaced."""

    physics: LinkPhysics
    rolling_n: float = 100.0
    linear_n_per_mps: float = 0.0
    aero_n_per_mps2: float = 0.5
    wind_mps: float = 0.0

    def __getattr__(self, name):
        return getattr(object.__getattribute__(self, "physics"), name)

    def _replace(self, **changes):
        own = {k: v for k, v in changes.items() if k in self.__dataclass_fields__}
        return replace(self, **own, physics=self.physics._replace(**{k: v for k, v in changes.items() if k not in own}))

    def road(self, grade=0.0, flat=None):
        cos = math.sqrt(1.0 - grade * grade) if flat is None else flat
        return Road(grade, self.rolling_n * cos, self.linear_n_per_mps, self.aero_n_per_mps2, self.wind_mps)


def off():
    """Fields of LinkPhysics with every effect off."""
    return {
        "regen_cap_w": math.inf,
        "fade_width_j": 0.0,
        "loss_per_n2": 0.0,
        "loss_per_w": 0.0,
        "regen_min_mps": 0.0,
        "lossy": False,
        "cabin_w": 0.0,
        "cabin_start_w": 0.0,
        "cabin_time_s": 600.0,
        "tyre_time_s": 0.0,
        "table": False,
        "climb_up_j_per_m": 0.0,
        "climb_down_j_per_m": 0.0,
        "kinetic_up_kg": 0.0,
        "kinetic_down_kg": 0.0,
    }


def link_energy(p, length, grade, *rest):
    return kernels_link.link_energy(p.physics, p.road(grade), length, *rest)


def add_link_parts(p, length, grade, *rest):
    *passage, parts = rest
    return kernels_link.add_link_parts(p.physics, p.road(grade), kernels_link.LinkPassage(length, *passage), parts)


def ramp_energy(p, ds, v_a, v_b, grade, flat):
    return kernels_phase.ramp_energy(p.physics, p.road(grade, flat), ds, v_a, v_b)


def cruise_energy(p, ds, v, grade, flat):
    return kernels_phase.cruise_energy(p.physics, p.road(grade, flat), ds, v)


def plan_link(p, *rest):
    return kernels_link.plan_link(p.physics, *rest)


def loaded(drive):
    """A Loaded of a vehicle's drive under default conditions."""
    vehicle = drive.vehicle
    return Loaded(drive.physics, vehicle.road_load_a_n, vehicle.road_load_b_n_per_mps, vehicle.road_load_c_n_per_mps2)
