"""Compiled: the least reduced cost of each link over all states in which it may be entered (docs/search-goal.md).

A reduced cost is battery energy less the change of the potential of lemma 1. Its sums along roads to the goal are a
lower bound of what a search still has to pay.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import TOUCH_MPS, drive_energy, link_energy, mean_over_intervals
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_force import idle_energy, road_load_n
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, Road, borrowed_physics, road_at
from routing.links.kernels_tables import LENGTH, LIMIT, STOP

# columns of the table of entries: lowest speed in which a link is entered once a drive has gathered way, and the least
# and greatest probability of having stopped before it
SLOWEST, STOPPED_LEAST, STOPPED_MOST = range(3)
NOISE_J = 1e-6


@njit(nogil=True, cache=True)
def reduced_drive(
    p: LinkPhysics, r: Road, alpha: float, length: float, v_start: float, v_max: float, target: float
) -> tuple[float, float]:
    """Energy above the potential, auxiliaries included, and time of one drive of a link from one speed to another."""
    energy, duration, end = drive_energy(p, r, length, v_start, v_max, target)
    kinetic = 0.5 * p.inertia_kg * (end - v_start) * (end + v_start)
    return energy - alpha * (p.weight_n * r.grade * length + kinetic), duration


@njit(nogil=True, cache=True)
def steepest_fall(
    p: LinkPhysics,
    r: Road,
    alpha: float,
    sag_n: float,
    length: float,
    low: float,
    high: float,
    v_max: float,
    target: float,
    accel: float,
) -> float:
    """By how much a reduced cost may fall with the square of the entry speed, low..high [J/(m/s)²]; 0 where concave.

    All entries of the stretch accelerate alike. Concave where they reach the limit before they have to brake, rising
    where they reach neither; in between the derivative has the bound that is taken here.
    """
    if target >= v_max:
        return 0.0
    decel = mean_over_intervals(p.speed_bound_mps, p.decel_sum, target, v_max)
    braking_m = (v_max * v_max - target * target) / (2.0 * decel)
    if (v_max * v_max - low * low) / (2.0 * accel) + braking_m <= length:
        return 0.0
    hill_n = p.weight_n * r.grade
    fastest_n = road_load_n(r, high) + sag_n
    pull_n = fastest_n + hill_n + p.inertia_kg * accel
    gaining = alpha * fastest_n
    gaining += (p.drive_factor - alpha) * pull_n if pull_n > 0.0 else (p.recuperation_factor - alpha) * pull_n
    slowest_n = max(road_load_n(r, low) - sag_n, 0.0)
    pull_n = slowest_n + hill_n - p.inertia_kg * decel
    braking = alpha * slowest_n
    braking += (p.drive_factor - alpha) * pull_n if pull_n > 0.0 else (p.recuperation_factor - alpha) * pull_n
    fall = max(gaining - braking, 0.0) / (2.0 * (accel + decel))
    if high * high - target * target > 2.0 * decel * length:  # too short to brake as others do
        fall = max(fall, 0.5 * p.inertia_kg * (p.drive_factor - alpha))
    return fall


@njit(nogil=True, cache=True)
def least_drive_j(
    p: LinkPhysics,
    r: Road,
    alpha: float,
    sag_n: float,
    length: float,
    low: float,
    v_max: float,
    target: float,
) -> tuple[float, float]:
    """Least energy above the potential and least time over all entries from low up to the limit."""
    at_limit, least_s = reduced_drive(p, r, alpha, length, v_max, v_max, target)
    aux_j = p.aux_move_w * least_s
    least = at_limit - aux_j
    if low >= v_max:
        return least + aux_j, least_s
    bound = p.speed_bound_mps
    upper = v_max
    gaining_m = 0.0
    k = bound.size - 1
    while upper > low:
        while k > 0 and bound[k] >= upper - TOUCH_MPS:
            k -= 1
        lower = max(low, bound[k])
        if lower >= upper:
            lower = low
        accel = mean_over_intervals(bound, p.accel_sum, lower, v_max)
        gaining_m = max(gaining_m, (v_max * v_max - lower * lower) / (2.0 * accel))
        e, t = reduced_drive(p, r, alpha, length, lower, v_max, target)
        fall = steepest_fall(p, r, alpha, sag_n, length, lower, upper, v_max, target, accel)
        least = min(least, e - p.aux_move_w * t - fall * (upper * upper - lower * lower))
        if upper < v_max:
            e, t = reduced_drive(p, r, alpha, length, max(lower, upper - 2.0 * TOUCH_MPS), v_max, target)
            least = min(least, e - p.aux_move_w * t)
        upper = lower
    return least - p.drive_factor * sag_n * min(gaining_m, length) + aux_j, least_s


@njit(nogil=True, cache=True)
def least_of_link(
    p: LinkPhysics,
    r: Road,
    alpha: float,
    sag_n: float,
    length: float,
    v_max: float,
    target: float,
    p_stop: float,
    wait_s: float,
    low: float,
    stopped_least: float,
    stopped_most: float,
) -> tuple[float, float]:
    """Least energy above the potential [J] and time [s] of a link towards one successor, over all entries."""
    if p.table:
        return least_of_table(p, r, alpha, length, v_max, target, p_stop, wait_s, low, stopped_least, stopped_most)
    go_j, go_s = 0.0, 0.0
    rest_j, rest_s = 0.0, 0.0
    if p_stop < 1.0:
        e, t = least_drive_j(p, r, alpha, sag_n, length, low, v_max, target)
        go_j, go_s = (1.0 - p_stop) * e, (1.0 - p_stop) * t
    if p_stop > 0.0:
        e, t = least_drive_j(p, r, alpha, sag_n, length, low, v_max, 0.0)
        go_j, go_s = go_j + p_stop * e, go_s + p_stop * t
    if stopped_most > 0.0:
        if p_stop < 1.0:
            e, t = reduced_drive(p, r, alpha, length, 0.0, v_max, target)
            rest_j, rest_s = (1.0 - p_stop) * e, (1.0 - p_stop) * t
        if p_stop > 0.0:
            e, t = reduced_drive(p, r, alpha, length, 0.0, v_max, 0.0)
            rest_j, rest_s = rest_j + p_stop * e, rest_s + p_stop * t
    share_j = stopped_least if rest_j >= go_j else stopped_most
    share_s = stopped_least if rest_s >= go_s else stopped_most
    idle_s = p_stop * wait_s
    least_j = go_j + share_j * (rest_j - go_j) + idle_energy(p, idle_s)
    return least_j, go_s + share_s * (rest_s - go_s) + idle_s


@njit(nogil=True, cache=True)
def least_of_table(
    p: LinkPhysics,
    r: Road,
    alpha: float,
    length: float,
    v_max: float,
    target: float,
    p_stop: float,
    wait_s: float,
    low: float,
    stopped_least: float,
    stopped_most: float,
) -> tuple[float, float]:
    """least_of_link of a consumption-table vehicle, linear in the square of the entry speed: least at an end."""
    least_j, least_s = math.inf, math.inf
    for stopped in (stopped_least, stopped_most):
        for v in (low, v_max):
            e, t, end = link_energy(p, r, length, v, stopped, v_max, target, p_stop, wait_s)
            kinetic = 0.5 * p.inertia_kg * ((1.0 - p_stop) * end * end - (1.0 - stopped) * v * v)
            least_j = min(least_j, e - alpha * (p.weight_n * r.grade * length + kinetic))
            least_s = min(least_s, t)
    return least_j, least_s


@njit(nogil=True, cache=True)
def fill_entries(
    p: LinkPhysics,
    row: NDArray[np.float64],
    first: NDArray[np.int64],
    successor: NDArray[np.int32],
    passes: int,
    entry: NDArray[np.float64],
) -> None:
    """In which states links are entered by drives that have gathered way, into entry (M, 3).

    Who enters a link no slower than SLOWEST enters every later one no slower than that one's. From nothing at all each
    pass over the turns raises the speeds; after any number of them this holds.
    """
    p, row, first, successor, entry = (
        borrowed_physics(p),
        borrowed(row),
        borrowed(first),
        borrowed(successor),
        borrowed(entry),
    )
    links = row.shape[0]
    bound = p.speed_bound_mps
    squared = np.empty(links)
    accel = np.empty(links)
    for i in range(links):
        entry[i, SLOWEST], entry[i, STOPPED_LEAST], entry[i, STOPPED_MOST] = 0.0, 1.0, 0.0
        accel[i] = math.inf
        if not p.table:
            for k in range(bound.size - 1):
                if bound[k] < row[i, LIMIT]:
                    accel[i] = min(accel[i], mean_over_intervals(bound, p.accel_sum, bound[k], row[i, LIMIT]))
    for i in range(links):
        for k in range(first[i], first[i + 1]):
            j = successor[k]
            entry[j, STOPPED_LEAST] = min(entry[j, STOPPED_LEAST], row[i, STOP])
            entry[j, STOPPED_MOST] = max(entry[j, STOPPED_MOST], row[i, STOP])
    for _ in range(passes):
        squared[:] = math.inf
        for i in range(links):
            low, limit, length, stopped = entry[i, SLOWEST], row[i, LIMIT], row[i, LENGTH], entry[i, STOPPED_MOST]
            gained = 2.0 * accel[i] * length
            for k in range(first[i], first[i + 1]):
                j = successor[k]
                target = min(limit, row[j, LIMIT])
                going = min(target * target, low * low + gained)
                end = (1.0 - stopped) * going + stopped * min(target * target, gained)
                squared[j] = min(squared[j], end)
        for j in range(links):
            if squared[j] < math.inf:
                entry[j, SLOWEST] = max(entry[j, SLOWEST], math.sqrt(squared[j]) * (1.0 - 1e-9))


@njit(nogil=True, cache=True)
def least_towards_any(
    p: LinkPhysics,
    alpha: float,
    sag_n: float,
    row: NDArray[np.float64],
    roads: NDArray[np.float64],
    first: NDArray[np.int64],
    successor: NDArray[np.int32],
    entry: NDArray[np.float64],
    link: int,
) -> tuple[float, float]:
    """Least energy above the potential [J] and least time [s] of a link, towards any successor, over all entries."""
    r = road_at(roads, link)
    limit = row[link, LIMIT]
    low = min(entry[link, SLOWEST], limit)
    least_j, least_s = math.inf, math.inf
    known = -1.0
    for k in range(first[link], first[link + 1]):
        target = min(limit, row[successor[k], LIMIT])
        if target == known:
            continue
        known = target
        e, t = least_of_link(
            p,
            r,
            alpha,
            sag_n,
            row[link, LENGTH],
            limit,
            target,
            row[link, STOP],
            roads[link, ROAD_WAIT],
            low,
            entry[link, STOPPED_LEAST],
            entry[link, STOPPED_MOST],
        )
        least_j, least_s = min(least_j, e), min(least_s, t)
    return max(least_j - NOISE_J, 0.0), least_s
