"""Compiled: battery energies of a chain without their parts, for driving it many times with altered parameters.

Units: m, s, m/s, kg, N, W, J. The energies are those of energy.chain.kernels_link.drive_chain to the bit; leaving out
the parts takes a third to a half of the time.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy, stop_at
from energy.force.kernels_force import ROAD_WAIT, LinkPhysics, accepted_j, cabin_energy_j, road_in_time


@njit(nogil=True, cache=True)
def drive_energies(
    p: LinkPhysics,
    roads: NDArray[np.float64],
    length: NDArray[np.float64],
    v_max: NDArray[np.float64],
    stop_probability: NDArray[np.float64],
    stop_class: NDArray[np.int8],
    rule: int,
    v_start: float,
    arrive_stopped: bool,
    full_j: float,
    energy: NDArray[np.float64],
    dissipated: NDArray[np.float64],
) -> float:
    """Fill the battery energy of each link and what of it is not stored in height and speed (n,); the time [s].

    Arguments as for energy.chain.kernels_link.drive_chain. Stored is m·g·Δh + ½·m·d·Δv², of a vehicle that stops with
    probability p the mean over both cases.
    """
    requests = np.zeros(8)
    stops = np.zeros(8)
    v = v_start
    p_entry = 0.0
    used = 0.0
    clock = 0.0
    moving = 0.5 * p.inertia_kg * v_start * v_start
    n = length.size
    for k in range(n):
        wait = roads[k, ROAD_WAIT]
        p_stop = stop_at(rule, stop_probability[k], stop_class[k], requests, stops)
        v_next = v_max[k + 1] if k + 1 < n else v_max[k]
        if k + 1 == n and arrive_stopped:
            p_stop = 1.0
            wait = 0.0
        r = road_in_time(p, roads, k, clock, length[k] / v_max[k])
        e, t, v = link_energy(p, r, length[k], v, p_entry, v_max[k], v_next, p_stop, wait)
        energy[k] = accepted_j(p, used, e + cabin_energy_j(p, clock, clock + t), full_j)
        still_moving = 0.5 * p.inertia_kg * (1.0 - p_stop) * v * v
        dissipated[k] = energy[k] - p.weight_n * r.grade * length[k] - (still_moving - moving)
        moving = still_moving
        p_entry = p_stop
        used = max(used + energy[k], full_j)
        clock += t
    return clock
