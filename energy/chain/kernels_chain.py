"""The chain loop, compiled: links driven one after the other, with stops by a rule, their parts booked or not."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import add_link_parts, link_energy
from energy.force.kernels_parts import CABIN, REGEN_LIMIT, ROLLING
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, accepted_j, book_warm_up, cabin_energy_j, road_in_time

EXPECTED, COUNTED, NO_STOPS, CROSSINGS = range(4)
MEDIUM = 2  # Cross.MEDIUM: a minor road meeting a major one, an entry to a roundabout
REST = 8  # stop class of a link at whose end the vehicle comes to rest for certain, whatever the rule


@njit(nogil=True, cache=True)
def stop_at(
    rule: int,
    probability: float,
    stop_class: int,
    requests: NDArray[np.float64],
    stops: NDArray[np.float64],
) -> float:
    """Probability of stopping at a link's end under a rule; counters (8,) are carried from link to link."""
    if stop_class == REST:
        return 1.0
    if rule == NO_STOPS:
        return 0.0
    if rule == CROSSINGS:
        return 1.0 if probability > 0.0 and (stop_class & 3) >= MEDIUM else 0.0
    if rule == COUNTED and probability > 0.0:
        requests[stop_class] += 1.0  # counted before the comparison, so that there is no 0/0
        if stops[stop_class] / requests[stop_class] < probability:  # (29)-(31)
            stops[stop_class] += 1.0
            return 1.0
        return 0.0
    return probability


@njit(nogil=True, cache=True)
def drive_chain(
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
    time: NDArray[np.float64],
    standstill: NDArray[np.float64],
    v_end: NDArray[np.float64],
    p_end: NDArray[np.float64],
    parts: NDArray[np.float64],
) -> None:
    """Drive a chain of links and fill energy, time, standstill, v_end, p_end (n,) and parts (n, 15).

    roads: (n, 8), columns of energy.force.kernels_force. full_j: battery energy that would fill the battery at
    departure, negative, −inf where the charge is not known.
    """
    requests = np.zeros(8)
    stops = np.zeros(8)
    v = v_start
    p_entry = 0.0
    used = 0.0
    clock = 0.0
    n = length.size
    for k in range(n):
        wait = roads[k, ROAD_WAIT]
        p_stop = stop_at(rule, stop_probability[k], stop_class[k], requests, stops)
        v_next = v_max[k + 1] if k + 1 < n else v_max[k]  # (10), or (9) where the next link is unknown
        if k + 1 == n and arrive_stopped:
            p_stop = 1.0
            wait = 0.0
        r = road_in_time(p, roads, k, clock, length[k] / v_max[k])
        e, time[k], v_end[k] = link_energy(p, r, length[k], v, p_entry, v_max[k], v_next, p_stop, wait)
        add_link_parts(p, r, length[k], v, p_entry, v_max[k], v_next, p_stop, wait, parts[k])
        book_warm_up(p, r, roads, k, parts[k, ROLLING], parts[k])
        heat = cabin_energy_j(p, clock, clock + time[k])
        energy[k] = accepted_j(p, used, e + heat, full_j)
        parts[k, CABIN] += heat
        parts[k, REGEN_LIMIT] += energy[k] - (e + heat)
        standstill[k] = p_stop * wait
        p_end[k] = p_stop
        v = v_end[k]
        p_entry = p_stop
        used = max(used + energy[k], full_j)
        clock += time[k]


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

    Arguments as for energy.chain.kernels_chain.drive_chain. Stored is m·g·Δh + ½·m·d·Δv², of a vehicle that stops with
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
