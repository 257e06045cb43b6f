"""Compiled: the best journey over stations, by labels of cost, time and charge at each of them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.charging.kernels_charging import ChargeCurves, seconds_to
from routing.charging.kernels_curves import Price, turning_charges
from routing.kernels_heap import heap_drop, heap_push

# columns of Stops.number, one row a place
CURVE, A_SECOND, A_JOULE, STOP_COST, STOP_S, CAP, AHEAD, AHEAD_MIX, AHEAD_A_JOULE, LEAST_J = range(10)
# columns of Ways.number, one row a way
WAY_COST, WAY_S, WAY_J, WAY_NEED, WAY_SPILL, WAY_MARGIN, WAY_BOUND = range(7)
# columns of Labels.number
COST, TIME, CHARGE, DEPART, LEVEL, SINCE = range(6)
# columns of Labels.pointer
PLACE, PARENT, WAY, NEXT, STOPS = range(5)
# counters
MADE, HEAP, SETTLED, ASKED, GOAL = range(5)
DONE, FULL, UNKNOWN, NONE, PAUSED = range(5)
PAUSE_LABELS = 4096
MOST_TURNS = 48
ROUNDING = 1e-9  # [s] or what costs are in, and J: labels that differ by less are one
WEEK_S = 604_800.0


class Stops(NamedTuple):
    """Places of the station graph: start, stations, goal; a station comes once for each via point that may be behind.

    number: (P, 10), columns as above: kind of its curve, −1 where nothing is charged; cost of a second and of a joule
    of charging; cost and time [s] of stopping; most charge to leave with [J]; lower bounds on the cost from there: a
    number, and another one for an empty battery less so much a joule; least charge on arrival [J]. known: (P,) whether
    its ways are there; ways first[p]..last[p]. open_first: (P + 1,), opening: (o, 2) from and to in the week [s];
    none: always open.
    """

    number: NDArray[np.float64]
    known: NDArray[np.bool_]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    open_first: NDArray[np.int64]
    opening: NDArray[np.float64]


class Ways(NamedTuple):
    """Ways between places. number: (W, 7), columns as above; to: (W,) place.

    Cost, time [s], net energy, most that a beginning takes, most that an ending takes, margin for what is not certain
    [J], 1 for a bound on ways that are not known.
    """

    number: NDArray[np.float64]
    to: NDArray[np.int32]


class Rules(NamedTuple):
    """Of one search: reserve on the way [J], clock at departure [s of the week], cost of a second.

    clocked: time decides what labels are good for; counted: so does the number of stops, most_stops at most. bounded:
    bounds count as ways.
    """

    reserve_j: float
    departure_s: float
    a_second: float
    clocked: bool
    counted: bool
    most_stops: int
    bounded: bool


class Labels(NamedTuple):
    """Labels at arrival: number (L, 6), pointer (L, 5) as above; latest (P,) of each place; heap; counter (5,).

    DEPART: charge with which the place before was left. LEVEL: cost less what its charge was worth here. SINCE: time
    of charging from empty to its charge.
    """

    number: NDArray[np.float64]
    pointer: NDArray[np.int32]
    latest: NDArray[np.int32]
    heap_key: NDArray[np.float64]
    heap_label: NDArray[np.int32]
    counter: NDArray[np.int64]


@njit(nogil=True, cache=True)
def waiting_s(stops: Stops, place: int, clock_s: float) -> float:
    """How long until a place is open [s]; inf where it never is."""
    first, last = stops.open_first[place], stops.open_first[place + 1]
    if first == last:
        return 0.0
    at_s = clock_s % WEEK_S
    wait = math.inf
    for k in range(first, last):
        since = stops.opening[k, 0] - at_s
        if since <= 0.0 < stops.opening[k, 1] - at_s:
            return 0.0
        wait = min(wait, since if since > 0.0 else since + WEEK_S)
    return wait


@njit(nogil=True, cache=True)
def cost_ahead(stops: Stops, place: int, charge_j: float) -> float:
    """No less is still to be paid from a place with a charge."""
    row = stops.number[place]
    return max(float(row[AHEAD]), float(row[AHEAD_MIX] - row[AHEAD_A_JOULE] * charge_j), 0.0)


@njit(nogil=True, cache=True)
def dominates(rules: Rules, labels: Labels, cap_j: float, a: int, b: int) -> bool:
    """Whether label a is good for all that b is good for, at the same place.

    With no less charge at no more cost; or with less, where charging it up to that of b costs no more than b.
    """
    na, nb = labels.number[a], labels.number[b]
    if rules.counted and labels.pointer[a, STOPS] > labels.pointer[b, STOPS]:
        return False
    if na[CHARGE] >= nb[CHARGE] - ROUNDING:
        return bool(na[COST] <= nb[COST] + ROUNDING and (not rules.clocked or na[TIME] <= nb[TIME] + ROUNDING))
    if nb[CHARGE] > cap_j or na[LEVEL] > nb[LEVEL] + ROUNDING:
        return False
    return bool(not rules.clocked or na[TIME] - na[SINCE] <= nb[TIME] - nb[SINCE] + ROUNDING)


@njit(nogil=True, cache=True)
def arrive(
    curves: ChargeCurves,
    stops: Stops,
    ways: Ways,
    rules: Rules,
    labels: Labels,
    top: int,
    way: int,
    cost: float,
    time: float,
    depart_j: float,
    count: int,
    bound: float,
) -> None:
    """The label of leaving with a charge by a way, unless it is dominated or can't be below a bound on the whole."""
    place = ways.to[way]
    cost += ways.number[way, WAY_COST]
    time += ways.number[way, WAY_S]
    wait = waiting_s(stops, place, rules.departure_s + time)
    if wait == math.inf:
        return
    cost, time = cost + rules.a_second * wait, time + wait
    charge = min(depart_j - ways.number[way, WAY_J], curves.capacity_j - ways.number[way, WAY_SPILL])
    key = cost + cost_ahead(stops, place, charge)
    if key > bound:
        return
    made = labels.counter[MADE]
    row, pointer, number = labels.number[made], labels.pointer[made], stops.number[place]
    row[COST], row[TIME], row[CHARGE], row[DEPART] = cost, time, charge, depart_j
    row[LEVEL], row[SINCE] = math.inf, 0.0
    curve = int(number[CURVE])
    if curve >= 0:
        row[SINCE] = seconds_to(curves, curve, charge / curves.capacity_j)
        row[LEVEL] = cost - number[A_SECOND] * row[SINCE] - number[A_JOULE] * charge
    pointer[PLACE], pointer[PARENT], pointer[WAY], pointer[STOPS] = place, top, way, count
    cap = number[CAP] if curve >= 0 else -1.0
    other = labels.latest[place]
    while other >= 0:
        if dominates(rules, labels, cap, other, made):
            return
        other = labels.pointer[other, NEXT]
    before, other = -1, labels.latest[place]
    while other >= 0:
        after = labels.pointer[other, NEXT]
        if dominates(rules, labels, cap, made, other):
            labels.pointer[other, STOPS] = -1 - labels.pointer[other, STOPS]  # not to be settled any more
            if before < 0:
                labels.latest[place] = after
            else:
                labels.pointer[before, NEXT] = after
        else:
            before = other
        other = after
    pointer[NEXT] = labels.latest[place]
    labels.latest[place] = made
    heap_push(labels.heap_key, labels.heap_label, labels.counter[HEAP], key, made)
    labels.counter[HEAP] += 1
    labels.counter[MADE] = made + 1


@njit(nogil=True, cache=True)
def settle(
    curves: ChargeCurves, stops: Stops, ways: Ways, rules: Rules, labels: Labels, bound: float, goal: int
) -> int:
    """Settle labels by cost so far and ahead until the goal is settled.

    Returns UNKNOWN where the ways of the place in counter ASKED are to be added first, FULL where labels need room,
    PAUSED after some thousand labels, NONE where no label below the bound is left.
    """
    turns = np.empty(MOST_TURNS)
    capacity = curves.capacity_j
    done = 0
    while labels.counter[HEAP] > 0:
        top = labels.heap_label[0]
        place, count = labels.pointer[top, PLACE], labels.pointer[top, STOPS]
        if count < 0:
            heap_drop(labels.heap_key, labels.heap_label, labels.counter[HEAP])
            labels.counter[HEAP] -= 1
            continue
        if place == goal:
            labels.counter[GOAL] = top
            return DONE
        if done == PAUSE_LABELS:
            return PAUSED
        if not stops.known[place]:
            labels.counter[ASKED] = place
            return UNKNOWN
        first, last = stops.first[place], stops.last[place]
        if labels.counter[MADE] + (last - first) * (MOST_TURNS + 1) + 1 > labels.number.shape[0]:
            return FULL
        heap_drop(labels.heap_key, labels.heap_label, labels.counter[HEAP])
        labels.counter[HEAP] -= 1
        labels.counter[SETTLED] += 1
        done += 1
        here, charge = stops.number[place], labels.number[top, CHARGE]
        cost, time = labels.number[top, COST], labels.number[top, TIME]
        curve = int(here[CURVE])
        charges = curve >= 0
        if charges:
            count += 1
            if count > rules.most_stops:
                continue
            cost, time = cost + here[STOP_COST], time + here[STOP_S]
        price = Price(here[A_SECOND], here[A_JOULE])
        for way in range(first, last):
            to = ways.to[way]
            there, number = stops.number[to], ways.number[way]
            if number[WAY_BOUND] > 0.0 and not rules.bounded:
                continue
            energy, full = number[WAY_J], curves.capacity_j - number[WAY_SPILL]
            if full < there[LEAST_J]:
                continue
            low = max(there[LEAST_J] + energy, rules.reserve_j + number[WAY_NEED]) + number[WAY_MARGIN]
            if low > (max(charge, here[CAP]) if charges else charge) + ROUNDING:
                continue
            low = max(low, charge)
            found = 0
            if charges and there[CURVE] >= 0:
                high = min(here[CAP], full + energy)
                if high > low:
                    found = turning_charges(
                        curves,
                        curve,
                        price,
                        int(there[CURVE]),
                        Price(there[A_SECOND], there[A_JOULE]),
                        energy / capacity,
                        low / capacity,
                        high / capacity,
                        turns,
                    )
            for k in range(found + 1):
                depart = low if k == found else max(turns[k] * capacity, low)
                taken_s = 0.0
                if depart > charge:
                    taken_s = seconds_to(curves, curve, depart / capacity) - labels.number[top, SINCE]
                paid = price.a_second * taken_s + price.a_joule * (depart - charge)
                arrive(curves, stops, ways, rules, labels, top, way, cost + paid, time + taken_s, depart, count, bound)
    return NONE
