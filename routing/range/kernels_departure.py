"""Compiled: what is left at the goal of a search back when one departs from rest anywhere on the map."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, accepted_j, cabin_energy_j, road_in_time
from routing.links.kernels_tables import LinkArrays
from routing.range.kernels_entries import Entries, nearest_entry
from routing.range.kernels_way_back import (
    ARRIVED,
    BEST,
    NONE,
    Goal,
    Homeward,
    Passage,
    ReverseRules,
    chained,
    drive_in,
    drive_on,
    int64_of,
    starting_climate_j,
    way_on,
    worth,
)


@njit(nogil=True, cache=True)
def departure(
    g: LinkArrays, p: LinkPhysics, r: ReverseRules, e: Entries, h: Homeward, goal: Goal, link: int, begin_m: float
) -> tuple[Passage, int]:
    """The best way to the goal from rest at begin_m of a link, and the label after that link, ARRIVED or NONE."""
    there, best = drive_in(g, p, r, goal, link, begin_m, 0.0, 0.0)
    choice = ARRIVED if there else NONE
    least = worth(r, best) if there else math.inf
    known_target = -1.0
    this, end = best, 0.0
    for at in range(g.successor_first[link], g.successor_first[link + 1]):
        target = min(g.speed_limit_mps[link], g.speed_limit_mps[g.successor[at]])
        if target != known_target:
            this, end = drive_on(g, p, r, link, begin_m, 0.0, 0.0, target)
            known_target = target
        label = nearest_entry(e, g.successor[at], end, g.stop_probability_frac[link])
        if not h.settled[label]:
            continue
        faster = max(end, e.speed_mps[label])
        if this.cost_j + h.number[label, BEST] - p.drive_factor * r.half_inertia_kg * faster * faster > least:
            continue  # worse by more than all of its speed can be worth
        way = chained(p, this, way_on(g, p, r, e, h, goal, label, end))
        value = worth(r, way)
        if value < least:
            best, choice, least = way, label, value
    return best, choice


@njit(nogil=True, cache=True)
def hoped_j(p: LinkPhysics, way: Passage, charge_j: float) -> float:
    """Charge left at the goal after a passage if the battery's limits do not act [J]."""
    return charge_j - way.cost_j - way.cold_j - starting_climate_j(p, way.duration_s)


@njit(nogil=True, cache=True)
def left_j(p: LinkPhysics, way: Passage, charge_j: float) -> float:
    """Charge left for certain at the goal after a passage [J], −inf where the charge does not suffice."""
    cold = way.cold_j + starting_climate_j(p, way.duration_s)
    if not charge_j >= way.need_j + cold:
        return -math.inf
    return min(charge_j - way.cost_j - cold, way.most_j)


@njit(nogil=True, cache=True)
def drive_home(
    g: LinkArrays,
    p: LinkPhysics,
    r: ReverseRules,
    e: Entries,
    h: Homeward,
    goal: Goal,
    link: int,
    choice: int,
    charge_j: float,
) -> float:
    """Charge left at the goal after driving there along the labels from rest at a link's tail [J], −inf if short."""
    v = stopped = clock = 0.0
    label = choice
    while True:
        ds = g.length_m[link]
        v_max = g.speed_limit_mps[link]
        target, p_stop, wait = v_max, 1.0, 0.0
        if label == ARRIVED:
            for k in range(goal.link.size):
                if goal.link[k] == link:
                    ds = goal.offset_m[k]
        else:
            target = min(v_max, g.speed_limit_mps[e.link[label]])
            p_stop, wait = g.stop_probability_frac[link], g.roads[link, ROAD_WAIT]
        road = road_in_time(p, g.roads, link, clock, ds / v_max)
        energy, t, v = link_energy(p, road, ds, v, stopped, v_max, target, p_stop, wait)
        energy += cabin_energy_j(p, clock, clock + t)
        energy = accepted_j(p, -charge_j, energy, -r.full_j)
        charge_j = min(charge_j - energy, r.full_j)
        if charge_j < r.reserve_j:
            return -math.inf
        if label == ARRIVED:
            return charge_j
        clock += t
        stopped = p_stop
        link = e.link[label]
        label = h.following[label]


@njit(nogil=True, cache=True)
def out_of_range(g: LinkArrays, p: LinkPhysics, r: ReverseRules, e: Entries, h: Homeward, link: int) -> bool:
    """Whether a link is too far to be departed on, by what it takes of those who enter it, less all of their speed."""
    v_max = g.speed_limit_mps[link]
    speed_j = p.drive_factor * r.half_inertia_kg * v_max * v_max
    for label in range(e.first[link], e.first[link + 1]):
        if not h.settled[label] or h.number[label, BEST] - speed_j <= r.bound_j:
            return False
    return bool(e.first[link] < e.first[link + 1])  # nothing is known of a link that nobody enters


@njit(nogil=True, cache=True)
def depart_everywhere(
    g: LinkArrays,
    p: LinkPhysics,
    r: ReverseRules,
    e: Entries,
    h: Homeward,
    goal: Goal,
    charge_j: NDArray[np.float64],
    left: NDArray[np.float64],
    hoped: NDArray[np.float64],
    cold: NDArray[np.float64],
    choice: NDArray[np.int32],
) -> None:
    """For each link (M,) driven from rest at its tail with charge_j [J]: what is left at the goal for certain.

    hoped: what would be left if the battery had no limits. cold: what cold tyres take of it at most.
    """
    for link in range(charge_j.size):
        left[link] = hoped[link] = -math.inf
        cold[link] = 0.0
        choice[link] = NONE
        if not charge_j[link] >= r.reserve_j or out_of_range(g, p, r, e, h, link):
            continue
        way, label = departure(g, p, r, e, h, goal, link, 0.0)
        choice[link] = label
        if label != NONE:
            left[link] = left_j(p, way, charge_j[link])
            hoped[link] = hoped_j(p, way, charge_j[link])
            cold[link] = way.cold_j


@njit(nogil=True, cache=True)
def drive_doubtful(
    g: LinkArrays,
    p: LinkPhysics,
    r: ReverseRules,
    e: Entries,
    h: Homeward,
    goal: Goal,
    charge_j: NDArray[np.float64],
    wanted_j: float,
    left: NDArray[np.float64],
    hoped: NDArray[np.float64],
    cold: NDArray[np.float64],
    choice: NDArray[np.int32],
) -> None:
    """Drive home from the links whose bound is below wanted_j [J] although it may be kept after all."""
    for link in range(charge_j.size):
        if choice[link] != NONE and left[link] < wanted_j <= hoped[link] + cold[link]:
            left[link] = max(left[link], drive_home(g, p, r, e, h, goal, link, choice[link], charge_j[link]))


@njit(nogil=True, cache=True)
def first_places(
    g: LinkArrays,
    p: LinkPhysics,
    r: ReverseRules,
    e: Entries,
    h: Homeward,
    goal: Goal,
    head_left: NDArray[np.float64],
    charge_j: float,
    wanted_j: float,
    left: NDArray[np.float64],
    begin_m: NDArray[np.float64],
) -> None:
    """Of links (M,) that can't be departed on at their tail, how far along one has to be for the charge to suffice."""
    for link in range(left.size):
        if left[link] >= wanted_j:
            begin_m[link] = min(begin_m[link], 0.0)
            continue
        high = g.length_m[link]
        for k in range(goal.link.size):
            if goal.link[k] == link:
                high = goal.offset_m[k]
        if high == g.length_m[link] and not head_left[link] >= wanted_j:
            continue
        low = 0.0
        for _ in range(16):
            middle = 0.5 * (low + high)
            way, label = departure(g, p, r, e, h, goal, link, middle)
            if label != NONE and left_j(p, way, charge_j) >= wanted_j:
                high = middle
            else:
                low = middle
        begin_m[link] = min(begin_m[link], high)


@njit(nogil=True, cache=True)
def last_places(
    g: LinkArrays,
    p: LinkPhysics,
    r: ReverseRules,
    e: Entries,
    h: Homeward,
    goal: Goal,
    twin: NDArray[np.int32],
    tail_charge: NDArray[np.float64],
    end_charge: NDArray[np.float64],
    end_m: NDArray[np.float64],
    wanted_j: float,
    turn_m: NDArray[np.float64],
) -> None:
    """Of links (M,) how far along them one can drive, turn, and still be left with wanted_j at the goal [m].

    twin: the link driven the other way, −1 where none, which leaves turn_m as it is. tail_charge, end_charge: charge on
    reaching a link's tail and end_m of it [J], linear between; end_m is −1 where the link is not asked for.
    """
    for link in range(twin.size):
        if twin[link] < 0 or not end_m[link] > 0.0:
            continue
        low, high = 0.0, end_m[link]
        for _ in range(16):
            middle = 0.5 * (low + high)
            charge = tail_charge[link] + middle / end_m[link] * (end_charge[link] - tail_charge[link])
            way, label = departure(g, p, r, e, h, goal, int64_of(twin[link]), g.length_m[link] - middle)
            if label != NONE and left_j(p, way, charge) >= wanted_j:
                low = middle
            else:
                high = middle
        if low > 0.0:
            turn_m[link] = max(turn_m[link], low)
