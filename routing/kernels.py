"""The compiled label-setting search: a state is a directed link about to be driven, entry speed and stop probability.

A label is (link, entry go-speed v, probability p of having stopped before it); it carries battery energy used, time,
distance, weighted cost and parent. docs/search.md has the theorem that the dominance rule and the potential rest on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.kernels import link_energy
from energy.kernels_force import ROAD_GRADE, ROAD_WAIT, LinkPhysics, accepted_j, cabin_energy_j, road_at, road_in_time
from routing.kernels_gap import (
    COST,
    CRUISE_J,
    CRUISE_S,
    DISTANCE,
    ENERGY,
    HEIGHT,
    KEY,
    LENGTH,
    LIMIT,
    OFFSET,
    REST_J,
    REST_S,
    SPEED,
    STOP,
    STOPPED,
    TIME,
    WARM_LATE_W,
    GapRules,
    SearchRules,
    leads,
)

LINK, PARENT, NEXT, DEAD = range(4)
# counters
LABELS, HEAP, SETTLED, GOAL, CYCLE, REDUCED_BELOW_ZERO, CROWDED = range(7)

CROWD = 48  # labels on one link beyond which dominance is relaxed, which is counted and reported

DONE, FOUND, FULL, NEGATIVE_CYCLE, TOO_MANY = range(5)


class LinkArrays(NamedTuple):
    """The graph and its link attributes as the search reads them, one value a link unless said otherwise.

    top_class: highest speed interval that drives entering here may be in before they must have met.
    settling_m: length from which on all phases fit, whatever the entry and the end.
    row: (M, 8), what the search reads of a link for every label, in one cache line, columns as named above: the other
    floating-point arrays are its columns. CRUISE_J, CRUISE_S: of the commonest drive, at the limit throughout.
    REST_J, REST_S: of the drive from rest; REST_S is -1 where that does not reach the limit. Neither has climate in it.
    roads: (M, 8), columns of energy.kernels_force. speed_limit_mps: the speed that is driven where it is free.
    """

    row: NDArray[np.float64]
    roads: NDArray[np.float64]
    tail_height_m: NDArray[np.float64]
    length_m: NDArray[np.float64]
    grade_frac: NDArray[np.float64]
    speed_limit_mps: NDArray[np.float64]
    stop_probability_frac: NDArray[np.float64]
    stop_time_s: NDArray[np.float64]
    successor_first: NDArray[np.int64]
    successor: NDArray[np.int32]
    top_class: NDArray[np.int8]
    settling_m: NDArray[np.float64]


class Workspace(NamedTuple):
    """Arrays that one search writes; capacity C labels, M links. bag_epoch spares resetting the bags."""

    number: NDArray[np.float64]  # (C, 8)
    pointer: NDArray[np.int32]  # (C, 4)
    heap_key: NDArray[np.float64]  # (C,)
    heap_label: NDArray[np.int32]  # (C,)
    bag_first: NDArray[np.int32]  # (M + 1,)
    bag_epoch: NDArray[np.int32]  # (M + 1,)
    counter: NDArray[np.int64]  # (8,)


@njit(nogil=True, cache=True)
def heap_push(heap_key: NDArray[np.float64], heap_label: NDArray[np.int32], size: int, key: float, label: int) -> None:
    """Add a label to the four-ary heap of a size; the caller counts."""
    k = size
    while k > 0:
        up = (k - 1) >> 2
        if heap_key[up] <= key:
            break
        heap_key[k] = heap_key[up]
        heap_label[k] = heap_label[up]
        k = up
    heap_key[k] = key
    heap_label[k] = label


@njit(nogil=True, cache=True)
def heap_drop(heap_key: NDArray[np.float64], heap_label: NDArray[np.int32], size: int) -> None:
    """Take the least key off the four-ary heap of a size; the caller counts."""
    size -= 1
    key = heap_key[size]
    label = heap_label[size]
    k = 0
    while True:
        child = 4 * k + 1
        if child >= size:
            break
        best = child
        best_key = heap_key[child]
        for c in range(child + 1, min(child + 4, size)):
            if heap_key[c] < best_key:
                best = c
                best_key = heap_key[c]
        if best_key >= key:
            break
        heap_key[k] = best_key
        heap_label[k] = heap_label[best]
        k = best
    heap_key[k] = key
    heap_label[k] = label


@njit(nogil=True, cache=True)
def is_ancestor(index: NDArray[np.int32], label: int, candidate: int) -> bool:
    """Whether candidate is on the way from label back to its start."""
    while label >= 0:
        if label == candidate:
            return True
        label = index[label, PARENT]
    return False


@njit(nogil=True, cache=True)
def start_label(
    g: LinkArrays, p: LinkPhysics, r: SearchRules, ws: Workspace, link: int, offset: float, begin_s: float
) -> None:
    """Put a start, at rest on a link begin_s after departure, into the heap; it takes part in no dominance."""
    new = ws.counter[LABELS]
    ws.counter[LABELS] = new + 1
    ws.number[new, :] = 0.0
    ws.number[new, OFFSET] = offset
    ws.number[new, TIME] = begin_s
    ws.pointer[new, LINK] = link
    ws.pointer[new, PARENT] = -1
    ws.pointer[new, NEXT] = -1
    ws.pointer[new, DEAD] = 0
    height = g.tail_height_m[link] + g.grade_frac[link] * offset
    key = -r.energy_weight * r.alpha * p.weight_n * height
    ws.number[new, KEY] = key
    heap_push(ws.heap_key, ws.heap_label, ws.counter[HEAP], key, new)
    ws.counter[HEAP] += 1


@njit(nogil=True, cache=True)
def run(
    g: LinkArrays,
    p: LinkPhysics,
    q: GapRules,
    bounds: NDArray[np.float64],
    r: SearchRules,
    ws: Workspace,
    epoch: int,
    goal_link: NDArray[np.int64],
    goal_offset: NDArray[np.float64],
) -> int:
    """Settle labels in the order of their reduced cost until the goal is settled or none is left.

    Precondition: reduced costs are not negative, or r.correcting. Returns FOUND (counter[GOAL] is the label), DONE, or
    FULL when the workspace must grow before going on. O(L log L) for L labels made. Ties: the label met first stays.
    """
    number, index, counter = ws.number, ws.pointer, ws.counter
    heap_key, heap_label = ws.heap_key, ws.heap_label
    bag_first, bag_epoch = ws.bag_first, ws.bag_epoch
    row, settling_m, top_class = g.row, g.settling_m, g.top_class
    roads = g.roads
    climate = p.cabin_w > 0.0 or p.cabin_start_w > 0.0
    fades = p.fade_width_j > 0.0
    warms = p.tyre_time_s > 0.0
    late_w = bounds[WARM_LATE_W, 0]
    successor_first, successors = g.successor_first, g.successor
    links = row.shape[0]
    capacity = index.shape[0]
    heap_size, made, settled = counter[HEAP], counter[LABELS], counter[SETTLED]
    status = DONE
    while heap_size > 0:
        top = heap_label[0]
        if index[top, DEAD] == 1:
            heap_drop(heap_key, heap_label, heap_size)
            heap_size -= 1
            continue
        link = index[top, LINK]
        if link == links:
            heap_drop(heap_key, heap_label, heap_size)
            heap_size -= 1
            settled += 1
            if counter[GOAL] < 0 or number[top, COST] < number[counter[GOAL], COST]:
                counter[GOAL] = top
            if r.correcting:
                continue
            break
        first, end = successor_first[link], successor_first[link + 1]
        if made + (end - first) + goal_link.size >= capacity:
            status = FULL
            break
        if made > r.label_limit:
            status = TOO_MANY
            break
        heap_drop(heap_key, heap_label, heap_size)
        heap_size -= 1
        settled += 1
        cost0, energy0, time0 = number[top, COST], number[top, ENERGY], number[top, TIME]
        distance0, offset, key0 = number[top, DISTANCE], number[top, OFFSET], number[top, KEY]
        v, stopped = number[top, SPEED], number[top, STOPPED]
        here = row[link]
        v_max = here[LIMIT]
        for k in range(goal_link.size):
            if goal_link[k] == link and goal_offset[k] > offset:
                ds = goal_offset[k] - offset
                road = road_in_time(p, roads, link, time0, ds / v_max)
                e, t, _ = link_energy(p, road, ds, v, stopped, v_max, v_max, 1.0, 0.0)
                if climate:
                    e += cabin_energy_j(p, time0, time0 + t)
                e = accepted_j(p, energy0, e, r.least_energy_j)
                e = max(e, r.least_energy_j - energy0)
                if energy0 + e <= r.most_energy_j:
                    cost = cost0 + r.energy_weight * e + r.time_weight * t + r.distance_weight * ds
                    height = here[HEIGHT] + roads[link, ROAD_GRADE] * goal_offset[k]
                    number[made, KEY] = cost - r.energy_weight * r.alpha * p.weight_n * height
                    number[made, COST], number[made, ENERGY] = cost, energy0 + e
                    number[made, TIME], number[made, DISTANCE] = time0 + t, distance0 + ds
                    index[made, LINK], index[made, PARENT], index[made, DEAD] = links, top, 0
                    heap_push(heap_key, heap_label, heap_size, number[made, KEY], made)
                    heap_size += 1
                    made += 1
        ds = here[LENGTH] - offset
        p_stop = here[STOP]
        known_target = -1.0
        e = 0.0
        t = 0.0
        v_end = 0.0
        for k in range(first, end):
            successor = successors[k]
            there = row[successor]
            target = min(v_max, there[LIMIT])
            if target != known_target:
                at_limit = v == v_max and target == v_max and offset == 0.0 and not warms
                if at_limit and (stopped == 0.0 or here[REST_S] >= 0.0):
                    e, t, v_end = here[CRUISE_J], here[CRUISE_S], v_max
                    if stopped > 0.0:
                        e += stopped * (here[REST_J] - e)
                        t += stopped * (here[REST_S] - t)
                else:
                    road = road_at(roads, link)
                    if warms:
                        road = road_in_time(p, roads, link, time0, ds / v_max)
                    e, t, v_end = link_energy(p, road, ds, v, stopped, v_max, target, p_stop, roads[link, ROAD_WAIT])
                if climate:
                    e += cabin_energy_j(p, time0, time0 + t)
                if fades:
                    e = accepted_j(p, energy0, e, r.least_energy_j)
                known_target = target
            used = max(energy0 + e, r.least_energy_j)  # a full battery: the rest is braked away
            if used > r.most_energy_j:
                continue
            cost = cost0 + r.energy_weight * (used - energy0) + r.time_weight * t + r.distance_weight * ds
            new = number[made]
            new[COST], new[ENERGY], new[SPEED], new[STOPPED] = cost, used, v_end, p_stop
            new[TIME] = time0 + t
            if bag_epoch[successor] != epoch:
                bag_epoch[successor] = epoch
                bag_first[successor] = -1
            before = -1
            crowd = 0
            superfluous = False
            other = bag_first[successor]
            while other >= 0:
                after = index[other, NEXT]
                crowd += 1
                one = number[other]
                # a lead in cost is needed, so that at most one of two unequal labels can lead
                if one[COST] <= cost and (
                    (
                        one[SPEED] == v_end
                        and one[STOPPED] == p_stop
                        and not r.pareto
                        and ((q.cabin_start_w == 0.0 and not warms) or (one[TIME] >= new[TIME] and late_w == 0.0))
                    )
                    or leads(
                        p,
                        q,
                        bounds,
                        r,
                        roads,
                        successor,
                        there,
                        settling_m[successor],
                        top_class[successor],
                        one,
                        new,
                        crowd > CROWD,
                    )
                ):
                    superfluous = True
                    break
                if cost <= one[COST] and leads(
                    p,
                    q,
                    bounds,
                    r,
                    roads,
                    successor,
                    there,
                    settling_m[successor],
                    top_class[successor],
                    new,
                    one,
                    crowd > CROWD,
                ):
                    index[other, DEAD] = 1
                    if before < 0:
                        bag_first[successor] = after
                    else:
                        index[before, NEXT] = after
                    if r.correcting and is_ancestor(index, top, other):
                        counter[CYCLE] = successor
                else:
                    before = other
                other = after
            if crowd > CROWD:
                counter[CROWDED] += 1
            if superfluous:
                continue
            index[made, LINK], index[made, PARENT], index[made, DEAD] = successor, top, 0
            index[made, NEXT] = bag_first[successor]
            bag_first[successor] = made
            kinetic = r.half_inertia_kg * (1.0 - p_stop) * v_end * v_end
            key = cost - r.energy_weight * r.alpha * (p.weight_n * there[HEIGHT] + kinetic)
            if key < key0 - 1e-9 * (abs(key0) + r.energy_weight * 3600.0):
                counter[REDUCED_BELOW_ZERO] += 1
            new[KEY], new[DISTANCE], new[OFFSET] = key, distance0 + ds, 0.0
            heap_push(heap_key, heap_label, heap_size, key, made)
            heap_size += 1
            made += 1
        if counter[CYCLE] >= 0:
            status = NEGATIVE_CYCLE
            break
    counter[HEAP], counter[LABELS], counter[SETTLED] = heap_size, made, settled
    if status == DONE and counter[GOAL] >= 0:
        return FOUND
    return status


@njit(nogil=True, cache=True)
def fill_cruise(p: LinkPhysics, row: NDArray[np.float64], roads: NDArray[np.float64]) -> None:
    """Energy and time of each link entered at its limit or from rest, left at the limit or stopped, into its row."""
    for k in range(row.shape[0]):
        v, length, stop = row[k, LIMIT], row[k, LENGTH], row[k, STOP]
        r = road_at(roads, k)
        wait = roads[k, ROAD_WAIT]
        row[k, CRUISE_J], row[k, CRUISE_S], _ = link_energy(p, r, length, v, 0.0, v, v, stop, wait)
        row[k, REST_J], row[k, REST_S], end = link_energy(p, r, length, 0.0, 0.0, v, v, stop, wait)
        if end != v:
            row[k, REST_S] = -1.0


@njit(nogil=True, cache=True)
def top_classes(
    length: NDArray[np.float64],
    first: NDArray[np.int64],
    successor: NDArray[np.int32],
    run_up: NDArray[np.float64],
    top: NDArray[np.int8],
) -> None:
    """Highest speed interval that drives may be in before two of them must have met, for each link.

    run_up: distance in which any entry reaches the link's limit. top starts as the interval of that limit
    and grows along successors of links shorter than their run-up until nothing changes.
    """
    changed = True
    while changed:
        changed = False
        for i in range(length.size):
            if length[i] >= run_up[i]:
                continue
            best = top[i]
            for k in range(first[i], first[i + 1]):
                best = max(best, top[successor[k]])
            if best > top[i]:
                top[i] = best
                changed = True


@njit(nogil=True, cache=True)
def arrivals(
    g: LinkArrays,
    p: LinkPhysics,
    r: SearchRules,
    ws: Workspace,
    head: NDArray[np.int32],
    node_energy: NDArray[np.float64],
    node_label: NDArray[np.int32],
    link_reach_m: NDArray[np.float64],
) -> None:
    """After a one-to-all search: least energy to stop at each node, and how far along each link one can stop.

    node_energy (N,) starts as inf; node_label (N,) the label whose link ends there; link_reach_m (M,) starts as −1.
    """
    for label in range(ws.counter[LABELS]):
        if ws.pointer[label, DEAD] == 1:
            continue
        link = ws.pointer[label, LINK]
        offset = ws.number[label, OFFSET]
        energy0 = ws.number[label, ENERGY]
        v, stopped = ws.number[label, SPEED], ws.number[label, STOPPED]
        time0 = ws.number[label, TIME]
        v_max = g.speed_limit_mps[link]
        length = g.length_m[link]
        road = road_in_time(p, g.roads, link, time0, (length - offset) / v_max)
        e, t, _ = link_energy(p, road, length - offset, v, stopped, v_max, v_max, 1.0, 0.0)
        e = accepted_j(p, energy0, e + cabin_energy_j(p, time0, time0 + t), r.least_energy_j)
        used = max(energy0 + e, r.least_energy_j)
        if used <= r.most_energy_j:
            link_reach_m[link] = length
            node = head[link]
            if used < node_energy[node]:
                node_energy[node] = used
                node_label[node] = label
        elif link_reach_m[link] < length:
            low, high = offset, length
            for _ in range(24):
                middle = 0.5 * (low + high)
                road = road_in_time(p, g.roads, link, time0, (middle - offset) / v_max)
                e, t, _ = link_energy(p, road, middle - offset, v, stopped, v_max, v_max, 1.0, 0.0)
                e += cabin_energy_j(p, time0, time0 + t)
                if energy0 + e <= r.most_energy_j:
                    low = middle
                else:
                    high = middle
            link_reach_m[link] = max(link_reach_m[link], low)


@njit(nogil=True, cache=True)
def scalar_dijkstra(
    first: NDArray[np.int64],
    successor: NDArray[np.int32],
    weight: NDArray[np.float64],
    source: int,
    distance: NDArray[np.float64],
    heap_key: NDArray[np.float64],
    heap_item: NDArray[np.int32],
) -> int:
    """Plain one-to-all Dijkstra over links with one scalar weight and the same heap: the yardstick of benchmarks."""
    distance[source] = 0.0
    heap_push(heap_key, heap_item, 0, 0.0, source)
    size = 1
    settled = 0
    while size > 0:
        key = heap_key[0]
        i = heap_item[0]
        heap_drop(heap_key, heap_item, size)
        size -= 1
        if key > distance[i]:
            continue
        settled += 1
        d = key + weight[i]
        for k in range(first[i], first[i + 1]):
            j = successor[k]
            if d < distance[j]:
                distance[j] = d
                heap_push(heap_key, heap_item, size, d, j)
                size += 1
    return settled
