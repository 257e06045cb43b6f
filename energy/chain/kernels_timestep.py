"""Compiled: the equation of motion over a whole chain of links in equal time steps (source, section IV).

Units: m, s, m/s, kg, N, W, J. Within a step, acceleration is constant; a step that would cross a link's end is cut
there. What a step takes is the phase of energy.force.kernels_terms, so both models share one law of force and battery.

Braking is expressed in distances: D(v) is the way that stopping from v takes with the table. A vehicle that keeps every
later limit and stop has D(v) ≤ reach + the way that remains on its link, where reach is the least of D of the speed
allowed at the link's end and of what the links beyond allow.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_chain import ChainDrive, ChainLinks, DrivenChain, stop_at
from energy.chain.kernels_link import TOUCH_MPS
from energy.force.kernels_force import idle_energy
from energy.force.kernels_parts import AUXILIARY, BATTERY_RESISTANCE, CABIN, REGEN_LIMIT, ROLLING
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, accepted_j, book_warm_up, cabin_energy_j, road_in_time
from energy.force.kernels_terms import cruise_terms, ramp_terms, total_j

SLACK = 1e-6  # a step that ends this share of itself before the link's end ends there: no step of rounding errors
STEP_LIMIT_REACHED = -1


class Braking(NamedTuple):
    """Braking by the vehicle's table; the last interval holds on above the table's end.

    speed_bound_mps, distance_m: (n+1,) interval boundaries and D there. decel_mps2: (n,) positive.
    """

    speed_bound_mps: NDArray[np.float64]
    distance_m: NDArray[np.float64]
    decel_mps2: NDArray[np.float64]


@njit(nogil=True, cache=True)
def braking_of(p: LinkPhysics) -> Braking:
    """Braking table of a vehicle with the distances to stop from its interval boundaries."""
    n = p.speed_bound_mps.size - 1
    decel = np.empty(n)
    distance = np.zeros(n + 1)
    for i in range(n):
        low, high = p.speed_bound_mps[i], p.speed_bound_mps[i + 1]
        decel[i] = p.decel_sum[i + 1] - p.decel_sum[i]
        distance[i + 1] = distance[i] + (high - low) * (high + low) / (2.0 * decel[i])
    return Braking(p.speed_bound_mps, distance, decel)


@njit(nogil=True, cache=True)
def braking_distance_m(b: Braking, v: float) -> float:
    """D(v), the way that stopping from a speed takes."""
    last = b.decel_mps2.size - 1
    i = 0
    while i < last and b.speed_bound_mps[i + 1] <= v:
        i += 1
    low = b.speed_bound_mps[i]
    distance: float = b.distance_m[i] + (v - low) * (v + low) / (2.0 * b.decel_mps2[i])
    return distance


@njit(nogil=True, cache=True)
def braking_speed_mps(b: Braking, distance: float) -> float:
    """Speed from which stopping takes a way; the inverse of braking_distance_m."""
    last = b.decel_mps2.size - 1
    i = 0
    while i < last and b.distance_m[i + 1] <= distance:
        i += 1
    low = b.speed_bound_mps[i]
    return math.sqrt(low * low + 2.0 * b.decel_mps2[i] * max(distance - b.distance_m[i], 0.0))


@njit(nogil=True, cache=True)
def speed_on_curve(b: Braking, v: float, curve: float, fall: float, dt: float) -> float:
    """Speed after dt at constant acceleration from v that lies on a braking curve.

    curve: D allowed where the step begins; fall: how much less is allowed a metre later, 1 for the table itself.
    Solves D(x) + fall·½·(v + x)·dt = curve, a quadratic in each interval of speed; 0 where x would be negative.
    """
    last = b.decel_mps2.size - 1
    half = 0.5 * fall * dt
    i = 0
    while i < last and b.distance_m[i + 1] + half * (v + b.speed_bound_mps[i + 1]) <= curve:
        i += 1
    low, decel = b.speed_bound_mps[i], b.decel_mps2[i]
    rest = 2.0 * decel * (curve - b.distance_m[i] - half * v) + low * low  # x² + 2·decel·half·x = rest
    if rest <= 0.0:
        return 0.0
    linear = decel * half
    speed: float = rest / (linear + math.sqrt(linear * linear + rest))
    return speed


@njit(nogil=True, cache=True)
def accel_at(p: LinkPhysics, v: float) -> float:
    """Acceleration of the table at a speed, on a boundary that of the interval above."""
    last = p.speed_bound_mps.size - 2
    i = 0
    while i < last and p.speed_bound_mps[i + 1] <= v + TOUCH_MPS:
        i += 1
    accel: float = p.accel_sum[i + 1] - p.accel_sum[i]
    return accel


@njit(nogil=True, cache=True)
def look_ahead(
    b: Braking, length: NDArray[np.float64], allowed: NDArray[np.float64], reach: NDArray[np.float64]
) -> None:
    """Fill reach (n,), D with which a link may be left at most, from the last link back, and lower allowed to it.

    allowed: (n,) speed at each link's end by the limits and stop there alone; on return by all that lies ahead.
    """
    n = length.size
    for k in range(n - 1, -1, -1):
        reach[k] = braking_distance_m(b, allowed[k])
        if k + 1 < n and reach[k + 1] + length[k + 1] < reach[k]:
            reach[k] = reach[k + 1] + length[k + 1]
            allowed[k] = braking_speed_mps(b, reach[k])


@njit(nogil=True, cache=True)
def braking_factor(b: Braking, length: NDArray[np.float64], allowed: NDArray[np.float64], v: float) -> float:
    """How many times harder than the table a vehicle has to brake from the start for all that lies ahead, at least 1.

    allowed: (n,) speed at each link's end by the limits and stop there alone.
    """
    begin = braking_distance_m(b, v)
    factor = 1.0
    way = 0.0
    for k in range(length.size):
        way += length[k]
        if way >= begin:
            break
        factor = max(factor, (begin - braking_distance_m(b, allowed[k])) / way)
    return factor


@njit(nogil=True, cache=True)
def drive_steps(
    p: LinkPhysics,
    links: ChainLinks,
    drive: ChainDrive,
    step_s: float,
    step_limit: int,
    driven: DrivenChain,
    track: NDArray[np.float64],
) -> int:
    """Drive a chain in time steps and fill what each link takes, with its parts.

    The rule of drive is one whose stops are certain; a link's speed at its end is 0 where it stops.
    track: (m, 3) way, time and speed at the start and after each step and wait, as many as fit; m = 0 for none.
    Returns the number of steps, or STEP_LIMIT_REACHED.
    """
    length, v_max, roads, parts = links.length_m, links.driven_mps, links.roads, driven.parts_j
    energy, v_end, stopped = driven.energy_j, driven.speed_end_mps, driven.stopped_frac
    v_start, arrive_stopped, full_j = drive.start_mps, drive.arrive_stopped, drive.full_j
    n = length.size
    requests = np.zeros(8)
    stops = np.zeros(8)
    for k in range(n):
        stopped[k] = stop_at(drive.rule, links.stop_probability[k], links.stop_class[k], requests, stops)
    if arrive_stopped:
        stopped[n - 1] = 1.0
    for k in range(n):
        v_end[k] = v_max[k]  # the limit beyond the last link is unknown (9)
        if k + 1 < n and v_max[k + 1] < v_max[k]:
            v_end[k] = v_max[k + 1]
        if stopped[k] > 0.0 or v_end[k] < 0.0:
            v_end[k] = 0.0
    braking = braking_of(p)
    factor = braking_factor(braking, length, v_end, v_start)
    reach = np.empty(n)
    look_ahead(braking, length, v_end, reach)
    v = v_start
    hard_m = braking_distance_m(braking, v)  # D(v) along the harder curve that only the start can force
    hard = v > v_max[0] or hard_m > reach[0] + length[0]
    way = clock = used = carried = 0.0
    rest = step_s
    count = 0
    rows = record(track, 0, way, clock, v)
    for k in range(n):
        energy[k] = 0.0
        if v_max[k] < 0.0:  # on board the vehicle stands, and the clock of climate and tyres with it
            driven.duration_s[k], driven.standstill_s[k] = links.carried_s[k], 0.0
            way += length[k]
            carried += links.carried_s[k]
            rest = step_s
            rows = record(track, rows, way, clock + carried, v)
            continue
        begin_s = clock
        remaining = length[k]
        while remaining > 0.0:
            if count == step_limit:
                return STEP_LIMIT_REACHED
            count += 1
            accel = accel_at(p, v)
            exit_mps = v_end[k]
            if hard and stopped[k] == 0.0:
                exit_mps = max(exit_mps, braking_speed_mps(braking, hard_m - factor * remaining))
            v_new = min(math.sqrt(v * v + 2.0 * accel * remaining), exit_mps)
            if 2.0 * remaining <= (v + v_new) * rest * (1.0 + SLACK):
                ds = remaining
                dt = 2.0 * ds / (v + v_new)
            else:
                dt = rest
                v_new = min(v + accel * dt, v_max[k], speed_on_curve(braking, v, reach[k] + remaining, 1.0, dt))
                if hard:
                    harder = speed_on_curve(braking, v, hard_m, factor, dt)
                    hard = harder > v_new
                    v_new = max(v_new, harder)
                ds = 0.5 * (v + v_new) * dt
            r = road_in_time(p, roads, k, clock, dt)
            if v_new == v:
                terms = cruise_terms(p, r, ds, v)
            else:
                terms, _ = ramp_terms(p, r, ds, v, v_new)
            for part in range(len(terms)):
                parts[k, part] += terms[part]
            book_warm_up(p, r, roads, k, terms[ROLLING], parts[k])
            heat = cabin_energy_j(p, clock, clock + dt)
            parts[k, CABIN] += heat
            offered = total_j(terms) + heat
            taken = accepted_j(p, used, offered, full_j)
            parts[k, REGEN_LIMIT] += taken - offered
            energy[k] += taken
            used = max(used + taken, full_j)
            remaining -= ds
            way += ds
            hard_m -= factor * ds
            clock += dt
            v = v_new
            rest -= dt
            if rest <= SLACK * step_s:
                rest = step_s
            rows = record(track, rows, way, clock + carried, v)
        v_end[k] = v
        driven.standstill_s[k] = 0.0
        if stopped[k] > 0.0:
            wait = 0.0 if arrive_stopped and k + 1 == n else roads[k, ROAD_WAIT]
            heat = cabin_energy_j(p, clock, clock + wait)
            parts[k, AUXILIARY] += p.aux_idle_w * wait
            parts[k, BATTERY_RESISTANCE] += p.loss_per_w * p.aux_idle_w * p.aux_idle_w * wait
            parts[k, CABIN] += heat
            taken = idle_energy(p, wait) + heat
            energy[k] += taken
            used = max(used + taken, full_j)
            driven.standstill_s[k] = wait
            clock += wait
            rest = step_s
            if wait > 0.0:
                rows = record(track, rows, way, clock + carried, v)
        driven.duration_s[k] = clock - begin_s
    return count


@njit(nogil=True, cache=True)
def record(track: NDArray[np.float64], row: int, way: float, clock: float, v: float) -> int:
    """Write one row of a track, if it fits, and return the next."""
    if row < track.shape[0]:
        track[row, 0] = way
        track[row, 1] = clock
        track[row, 2] = v
        return row + 1
    return row
