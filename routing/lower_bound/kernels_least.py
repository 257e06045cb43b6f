"""Compiled: the least reduced cost of each link over all states in which it may be entered (docs/search-goal.md).

A reduced cost is battery energy less the change of the potential of lemma 1. Its sums along roads to the goal are a
lower bound of what a search still has to pay.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import TOUCH_MPS, drive_energy, mean_over_intervals
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_force import idle_energy, road_load_n
from energy.force.kernels_physics import LinkPhysics, Road, borrowed_physics, road_at
from routing.links.kernels_stretch import LinkStretch, stretch_energy, stretch_to_end
from routing.links.kernels_tables import CRUISE_S, LENGTH, LIMIT, STOP

# columns of the table of entries: lowest speed in which a link is entered once a drive has gathered way, and the least
# and greatest probability of having stopped before it
SLOWEST, STOPPED_LEAST, STOPPED_MOST = range(3)
NOISE_J = 1e-6


class Reduction(NamedTuple):
    """How costs are reduced: share of the potential, and the most that the road load falls with speed [N]."""

    alpha: float
    sag_n: float


class EntryRange(NamedTuple):
    """In which states a link may be entered: a row of the table of entries, slowest_mps not above the link's limit."""

    slowest_mps: float
    stopped_least_frac: float
    stopped_most_frac: float


@njit(nogil=True, cache=True)
def reduced_drive(
    p: LinkPhysics, reduction: Reduction, r: Road, s: LinkStretch, entry_mps: float, target: float
) -> tuple[float, float]:
    """Energy above the potential, auxiliaries included, and time of one drive of a link from one speed to another."""
    energy, duration, end = drive_energy(p, r, s.length_m, entry_mps, s.limit_mps, target)
    kinetic = 0.5 * p.inertia_kg * (end - entry_mps) * (end + entry_mps)
    return energy - reduction.alpha * (p.weight_n * r.grade * s.length_m + kinetic), duration


@njit(nogil=True, cache=True)
def steepest_fall(
    p: LinkPhysics,
    reduction: Reduction,
    r: Road,
    s: LinkStretch,
    low: float,
    high: float,
    target: float,
    accel: float,
) -> float:
    """By how much a reduced cost may fall with the square of the entry speed, low..high [J/(m/s)²]; 0 where concave.

    All entries of the stretch accelerate alike. Concave where they reach the limit before they have to brake, rising
    where they reach neither; in between the derivative has the bound that is taken here.
    """
    alpha, v_max = reduction.alpha, s.limit_mps
    if target >= v_max:
        return 0.0
    decel = mean_over_intervals(p.speed_bound_mps, p.decel_sum, target, v_max)
    braking_m = (v_max * v_max - target * target) / (2.0 * decel)
    if (v_max * v_max - low * low) / (2.0 * accel) + braking_m <= s.length_m:
        return 0.0
    hill_n = p.weight_n * r.grade
    fastest_n = road_load_n(r, high) + reduction.sag_n
    pull_n = fastest_n + hill_n + p.inertia_kg * accel
    gaining = alpha * fastest_n
    gaining += (p.drive_factor - alpha) * pull_n if pull_n > 0.0 else (p.recuperation_factor - alpha) * pull_n
    slowest_n = max(road_load_n(r, low) - reduction.sag_n, 0.0)
    pull_n = slowest_n + hill_n - p.inertia_kg * decel
    braking = alpha * slowest_n
    braking += (p.drive_factor - alpha) * pull_n if pull_n > 0.0 else (p.recuperation_factor - alpha) * pull_n
    fall = max(gaining - braking, 0.0) / (2.0 * (accel + decel))
    if high * high - target * target > 2.0 * decel * s.length_m:  # too short to brake as others do
        fall = max(fall, 0.5 * p.inertia_kg * (p.drive_factor - alpha))
    return fall


@njit(nogil=True, cache=True)
def least_drive_j(
    p: LinkPhysics, reduction: Reduction, r: Road, s: LinkStretch, low: float, target: float
) -> tuple[float, float]:
    """Least energy above the potential and least time over all entries from low up to the limit."""
    v_max = s.limit_mps
    at_limit, least_s = reduced_drive(p, reduction, r, s, v_max, target)
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
        e, t = reduced_drive(p, reduction, r, s, lower, target)
        fall = steepest_fall(p, reduction, r, s, lower, upper, target, accel)
        least = min(least, e - p.aux_move_w * t - fall * (upper * upper - lower * lower))
        if upper < v_max:
            e, t = reduced_drive(p, reduction, r, s, max(lower, upper - 2.0 * TOUCH_MPS), target)
            least = min(least, e - p.aux_move_w * t)
        upper = lower
    return least - p.drive_factor * reduction.sag_n * min(gaining_m, s.length_m) + aux_j, least_s


@njit(nogil=True, cache=True)
def least_of_link(
    p: LinkPhysics, reduction: Reduction, r: Road, s: LinkStretch, entries: EntryRange
) -> tuple[float, float]:
    """Least energy above the potential [J] and time [s] of a link towards one successor, over all entries."""
    if p.table:
        return least_of_table(p, reduction, r, s, entries)
    p_stop, target = s.stop_frac, s.target_mps
    go_j, go_s = 0.0, 0.0
    rest_j, rest_s = 0.0, 0.0
    if p_stop < 1.0:
        e, t = least_drive_j(p, reduction, r, s, entries.slowest_mps, target)
        go_j, go_s = (1.0 - p_stop) * e, (1.0 - p_stop) * t
    if p_stop > 0.0:
        e, t = least_drive_j(p, reduction, r, s, entries.slowest_mps, 0.0)
        go_j, go_s = go_j + p_stop * e, go_s + p_stop * t
    if entries.stopped_most_frac > 0.0:
        if p_stop < 1.0:
            e, t = reduced_drive(p, reduction, r, s, 0.0, target)
            rest_j, rest_s = (1.0 - p_stop) * e, (1.0 - p_stop) * t
        if p_stop > 0.0:
            e, t = reduced_drive(p, reduction, r, s, 0.0, 0.0)
            rest_j, rest_s = rest_j + p_stop * e, rest_s + p_stop * t
    share_j = entries.stopped_least_frac if rest_j >= go_j else entries.stopped_most_frac
    share_s = entries.stopped_least_frac if rest_s >= go_s else entries.stopped_most_frac
    idle_s = p_stop * s.wait_s
    least_j = go_j + share_j * (rest_j - go_j) + idle_energy(p, idle_s)
    return least_j, go_s + share_s * (rest_s - go_s) + idle_s


@njit(nogil=True, cache=True)
def least_of_table(
    p: LinkPhysics, reduction: Reduction, r: Road, s: LinkStretch, entries: EntryRange
) -> tuple[float, float]:
    """least_of_link of a consumption-table vehicle, linear in the square of the entry speed: least at an end."""
    least_j, least_s = math.inf, math.inf
    for stopped in (entries.stopped_least_frac, entries.stopped_most_frac):
        for v in (entries.slowest_mps, s.limit_mps):
            e, t, end = stretch_energy(p, r, s, v, stopped)
            kinetic = 0.5 * p.inertia_kg * ((1.0 - s.stop_frac) * end * end - (1.0 - stopped) * v * v)
            least_j = min(least_j, e - reduction.alpha * (p.weight_n * r.grade * s.length_m + kinetic))
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
                target = max(min(limit, row[j, LIMIT]), 0.0)
                going = min(target * target, low * low + gained)
                end = (1.0 - stopped) * going + stopped * min(target * target, gained)
                squared[j] = min(squared[j], end)
        for j in range(links):
            if squared[j] < math.inf:
                entry[j, SLOWEST] = max(entry[j, SLOWEST], math.sqrt(squared[j]) * (1.0 - 1e-9))


@njit(nogil=True, cache=True)
def least_towards_any(
    p: LinkPhysics,
    reduction: Reduction,
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
    if limit < 0.0:
        return 0.0, row[link, CRUISE_S]
    entries = EntryRange(min(entry[link, SLOWEST], limit), entry[link, STOPPED_LEAST], entry[link, STOPPED_MOST])
    least_j, least_s = math.inf, math.inf
    known = -1.0
    for k in range(first[link], first[link + 1]):
        target = max(min(limit, row[successor[k], LIMIT]), 0.0)
        if target == known:
            continue
        known = target
        e, t = least_of_link(p, reduction, r, stretch_to_end(row, roads, link, 0.0, target), entries)
        least_j, least_s = min(least_j, e), min(least_s, t)
    return max(least_j - NOISE_J, 0.0), least_s
