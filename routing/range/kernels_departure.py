"""Compiled: what is left at the goal of a search back when one departs from rest anywhere on the map."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.force.kernels_physics import LinkPhysics, road_in_time
from routing.links.kernels_stretch import stretch_energy, stretch_to_end, stretch_to_rest, used_after_j
from routing.links.kernels_tables import LENGTH, LIMIT, STOP
from routing.range.kernels_entries import nearest_entry
from routing.range.kernels_way_back import (
    ARRIVED,
    BEST,
    NONE,
    BorrowedReverse,
    Passage,
    ReverseArrays,
    borrowed_reverse,
    chained,
    drive_in,
    drive_on,
    int64_of,
    starting_climate_j,
    way_on,
    worth,
)


class Departures(NamedTuple):
    """What departing from rest at the tail of each link leaves at the goal, (M,) each.

    left_j: for certain. hoped_j: if the battery had no limits. cold_j: what cold tyres take of it at most. choice: the
    label after the link, ARRIVED or NONE.
    """

    left_j: NDArray[np.float64]
    hoped_j: NDArray[np.float64]
    cold_j: NDArray[np.float64]
    choice: NDArray[np.int32]


@njit(nogil=True, cache=True)
def departure(b: BorrowedReverse, link: int, begin_m: float) -> tuple[Passage, int]:
    """The best way to the goal from rest at begin_m of a link, and the label after that link, ARRIVED or NONE."""
    p, r, e, g = b.physics, b.rules, b.entries, b.links
    there, best = drive_in(b, link, begin_m, 0.0, 0.0)
    choice = ARRIVED if there else NONE
    least = worth(r, best) if there else math.inf
    known_target = -1.0
    this, end = best, 0.0
    for at in range(g.successor_first[link], g.successor_first[link + 1]):
        target = min(g.row[link, LIMIT], g.row[g.successor[at], LIMIT])
        if target != known_target:
            this, end = drive_on(b, link, begin_m, 0.0, 0.0, target)
            known_target = target
        label = nearest_entry(e, g.successor[at], end, g.row[link, STOP])
        if not b.labels.settled[label]:
            continue
        faster = max(end, e.speed_mps[label])
        if this.cost_j + b.labels.number[label, BEST] - p.drive_factor * r.half_inertia_kg * faster * faster > least:
            continue  # worse by more than all of its speed can be worth
        way = chained(p, this, way_on(b, label, end))
        value = worth(r, way)
        if value < least:
            best, choice, least = way, label, value
    return best, choice


@njit(nogil=True, cache=True)
def hoped_j(p: LinkPhysics, way: Passage, charge_j: float) -> float:
    """Charge left at the goal after a passage if the battery's limits do not act [J]."""
    return charge_j - way.cost_j - way.cold_j - starting_climate_j(p, way.duration_s)


@njit(nogil=True, cache=True)
def certain_j(p: LinkPhysics, way: Passage, charge_j: float) -> float:
    """Charge left for certain at the goal after a passage [J], −inf where the charge does not suffice."""
    cold = way.cold_j + starting_climate_j(p, way.duration_s)
    if not charge_j >= way.need_j + cold:
        return -math.inf
    return min(charge_j - way.cost_j - cold, way.most_j)


@njit(nogil=True, cache=True)
def drive_home(b: BorrowedReverse, link: int, choice: int, charge_j: float) -> float:
    """Charge left at the goal after driving there along the labels from rest at a link's tail [J], −inf if short."""
    p, r, goal, row, roads = b.physics, b.rules, b.goal, b.links.row, b.links.roads
    v = stopped = clock = 0.0
    used_j = -charge_j  # from an empty battery on
    label = choice
    while True:
        if label == ARRIVED:
            end_m = row[link, LENGTH]
            for k in range(goal.link.size):
                if goal.link[k] == link:
                    end_m = goal.offset_m[k]
            stretch = stretch_to_rest(row, link, 0.0, end_m)
        else:
            target = min(row[link, LIMIT], row[b.entries.link[label], LIMIT])
            stretch = stretch_to_end(row, roads, link, 0.0, target)
        road = road_in_time(p, roads, link, clock, stretch.length_m / stretch.limit_mps)
        energy, t, v = stretch_energy(p, road, stretch, v, stopped)
        used_j = used_after_j(p, used_j, energy, clock, t, -r.full_j)
        if -used_j < r.reserve_j:
            return -math.inf
        if label == ARRIVED:
            return 0.0 - used_j
        clock += t
        stopped = stretch.stop_frac
        link = b.entries.link[label]
        label = b.labels.following[label]


@njit(nogil=True, cache=True)
def out_of_range(b: BorrowedReverse, link: int) -> bool:
    """Whether a link is too far to be departed on, by what it takes of those who enter it, less all of their speed."""
    e, v_max = b.entries, b.links.row[link, LIMIT]
    speed_j = b.physics.drive_factor * b.rules.half_inertia_kg * v_max * v_max
    for label in range(e.first[link], e.first[link + 1]):
        if not b.labels.settled[label] or b.labels.number[label, BEST] - speed_j <= b.rules.bound_j:
            return False
    return bool(e.first[link] < e.first[link + 1])  # nothing is known of a link that nobody enters


@njit(nogil=True, cache=True)
def depart_everywhere(arrays: ReverseArrays, charge_j: NDArray[np.float64], found: Departures) -> None:
    """Fill in what is left of charge_j [J], (M,), at the tail of each link."""
    b = borrowed_reverse(arrays)
    for link in range(charge_j.size):
        found.left_j[link] = found.hoped_j[link] = -math.inf
        found.cold_j[link] = 0.0
        found.choice[link] = NONE
        if not charge_j[link] >= b.rules.reserve_j or out_of_range(b, link):
            continue
        way, label = departure(b, link, 0.0)
        found.choice[link] = label
        if label != NONE:
            found.left_j[link] = certain_j(b.physics, way, charge_j[link])
            found.hoped_j[link] = hoped_j(b.physics, way, charge_j[link])
            found.cold_j[link] = way.cold_j


@njit(nogil=True, cache=True)
def drive_doubtful(arrays: ReverseArrays, charge_j: NDArray[np.float64], wanted_j: float, found: Departures) -> None:
    """Drive home from the links whose bound is below wanted_j [J] although it may be kept after all."""
    b = borrowed_reverse(arrays)
    for link in range(charge_j.size):
        choice, left_j = found.choice[link], found.left_j[link]
        if choice != NONE and left_j < wanted_j <= found.hoped_j[link] + found.cold_j[link]:
            found.left_j[link] = max(left_j, drive_home(b, link, choice, charge_j[link]))


@njit(nogil=True, cache=True)
def first_places(
    arrays: ReverseArrays,
    head_left_j: NDArray[np.float64],
    charge_j: float,
    wanted_j: float,
    left_j: NDArray[np.float64],
    begin_m: NDArray[np.float64],
) -> None:
    """Of links (M,) that can't be departed on at their tail, how far along one has to be for the charge to suffice."""
    b = borrowed_reverse(arrays)
    for link in range(left_j.size):
        if left_j[link] >= wanted_j:
            begin_m[link] = min(begin_m[link], 0.0)
            continue
        length = b.links.row[link, LENGTH]
        high = length
        for k in range(b.goal.link.size):
            if b.goal.link[k] == link:
                high = b.goal.offset_m[k]
        if high == length and not head_left_j[link] >= wanted_j:
            continue
        low = 0.0
        for _ in range(16):
            middle = 0.5 * (low + high)
            way, label = departure(b, link, middle)
            if label != NONE and certain_j(b.physics, way, charge_j) >= wanted_j:
                high = middle
            else:
                low = middle
        begin_m[link] = min(begin_m[link], high)


@njit(nogil=True, cache=True)
def last_places(
    arrays: ReverseArrays,
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
    b = borrowed_reverse(arrays)
    for link in range(twin.size):
        if twin[link] < 0 or not end_m[link] > 0.0:
            continue
        low, high = 0.0, end_m[link]
        for _ in range(16):
            middle = 0.5 * (low + high)
            charge = tail_charge[link] + middle / end_m[link] * (end_charge[link] - tail_charge[link])
            way, label = departure(b, int64_of(twin[link]), b.links.row[link, LENGTH] - middle)
            if label != NONE and certain_j(b.physics, way, charge) >= wanted_j:
                low = middle
            else:
                high = middle
        if low > 0.0:
            turn_m[link] = max(turn_m[link], low)
