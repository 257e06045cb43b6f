"""Compiled: battery energy along a recorded speed and height, a step from each sample to the next.

Units: m, s, m/s, kg, N, W, J. Within a step acceleration and grade are constant, so a step is a phase of
energy.force.kernels_terms: the route model's law of force and battery, integrated exactly.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.force.kernels_force import idle_energy
from energy.force.kernels_parts import (
    AUXILIARY,
    BATTERY_RESISTANCE,
    CABIN,
    CONSUMPTION_TABLE,
    GRADE,
    INERTIA,
    REGEN_LIMIT,
    ROLLING,
)
from energy.force.kernels_physics import LinkPhysics, accepted_j, book_warm_up, cabin_energy_j, road_in_time
from energy.force.kernels_terms import cruise_terms, ramp_terms, total_j


class ProfileSteps(NamedTuple):
    """A driven profile as the kernel reads it: time_s, speed_mps float64 (n+1,), time rising; roads float64 (n, 8),
    columns of energy.force.kernels_physics, one row a step.
    """

    time_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    roads: NDArray[np.float64]


@njit(nogil=True, cache=True)
def drive_profile(
    p: LinkPhysics,
    steps: ProfileSteps,
    first: int,
    beyond: int,
    full_j: float,
    used: float,
    energy: NDArray[np.float64],
    terms: NDArray[np.float64],
) -> float:
    """Fill energy (n,) and terms (n, 15) of the steps first ≤ k < beyond; battery energy used up to there [J].

    full_j: battery energy that would fill the battery at departure, negative, −inf where the charge is not known.
    """
    time, speed, roads = steps.time_s, steps.speed_mps, steps.roads
    for k in range(first, beyond):
        dt = time[k + 1] - time[k]
        v_a, v_b = speed[k], speed[k + 1]
        ds = 0.5 * (v_a + v_b) * dt
        r = road_in_time(p, roads, k, time[k] - time[0], dt)
        if ds <= 0.0:
            terms[k, AUXILIARY] = p.aux_idle_w * dt
            terms[k, BATTERY_RESISTANCE] = p.loss_per_w * p.aux_idle_w * p.aux_idle_w * dt
            taken = idle_energy(p, dt)
        elif p.table:
            climb = r.grade * ds
            gain = 0.5 * (v_b - v_a) * (v_b + v_a)
            terms[k, AUXILIARY] = p.aux_move_w * dt
            terms[k, CONSUMPTION_TABLE] = r.rolling_n * ds
            terms[k, GRADE] = climb * (p.climb_up_j_per_m if climb > 0.0 else p.climb_down_j_per_m)
            terms[k, INERTIA] = gain * (p.kinetic_up_kg if gain > 0.0 else p.kinetic_down_kg)
            taken = terms[k, AUXILIARY] + terms[k, CONSUMPTION_TABLE] + terms[k, GRADE] + terms[k, INERTIA]
        else:
            if v_a == v_b:
                work = cruise_terms(p, r, ds, v_a)
            else:
                work, _ = ramp_terms(p, r, ds, v_a, v_b)
            for part in range(len(work)):
                terms[k, part] = work[part]
            book_warm_up(p, r, roads, k, work[ROLLING], terms[k])
            taken = total_j(work)
        heat = cabin_energy_j(p, time[k] - time[0], time[k + 1] - time[0])
        terms[k, CABIN] = heat
        energy[k] = accepted_j(p, used, taken + heat, full_j)
        terms[k, REGEN_LIMIT] += energy[k] - (taken + heat)
        used = max(used + energy[k], full_j)
    return used
