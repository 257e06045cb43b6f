"""The compiled label-setting search: a state is a directed link about to be driven, entry speed and stop probability.

A label is (link, entry go-speed v, probability p of having stopped before it); it carries battery energy used, time,
distance, weighted cost and parent. docs/search.md has the theorem that the dominance rule and the potential rest on.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.kernels import LinkPhysics, link_energy, mean_over_intervals

# columns of the label table
KEY, COST, ENERGY, TIME, DISTANCE, SPEED, STOPPED, OFFSET = range(8)
LINK, PARENT, NEXT, DEAD = range(4)
# counters
LABELS, HEAP, SETTLED, GOAL, CYCLE, REDUCED_BELOW_ZERO, CROWDED = range(7)

# leads this small are rounding: without them a loss-free vehicle's labels, equal but for the last digits, would pile up
NOISE_J = 1e-6
NOISE_S = 1e-9

CROWD = 48  # labels on one link beyond which dominance is relaxed, which is counted and reported

# columns of the table of links
LENGTH, LIMIT, HEIGHT, STOP, CRUISE_J, CRUISE_S, REST_J, REST_S = range(8)

DONE, FOUND, FULL, NEGATIVE_CYCLE, TOO_MANY = range(5)

# (1 + r)(ln(2/(1 + r)) + 1/2) for r in 0..1 is at most this: time lost by starting slower, docs/search.md lemma 4
LOST_TIME_COEF = 1.2131


class LinkArrays(NamedTuple):
    """The graph and its link attributes as the search reads them, one value a link unless said otherwise.

    top_class: highest speed interval that drives entering here may be in before they must have met.
    settling_m: length from which on all phases fit, whatever the entry and the end.
    row: (M, 8), what the search reads of a link for every label, in one cache line, columns as named above: the other
    floating-point arrays are its columns. CRUISE_J, CRUISE_S: of the commonest drive, at the limit throughout.
    REST_J, REST_S: of the drive from rest; REST_S is -1 where that does not reach the limit.
    """

    row: NDArray[np.float64]
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


# rows of the table of bounds on what a difference of entry states can be worth while two drives have not met again;
# one column a speed interval of the vehicle, for drives that stay below its upper end (docs/search.md, lemma 6):
# least mean acceleration [m/s²]; distance until they meet, weighted and doubled [m]; what differing mean accelerations
# can add [J] and [s]; most that can be recuperated until they meet [J]
LEAST_ACCEL, MEETING_DISTANCE, SLACK_J, SLACK_S, GAIN_J = range(5)


class SearchRules(NamedTuple):
    """Weights, limits and potential of one search.

    least_energy_j: −(1 − soc)·capacity, a full battery; most_energy_j: (soc − reserve)·capacity; ±inf when not held.
    cost = energy_weight·E + time_weight·t + distance_weight·s. alpha: of the potential, in [η_chg, 1/η_dis].
    half_inertia_kg: ½·m·d. limited: any battery limit is held. pareto: dominance needs cost and energy.
    correcting: reduced costs may be negative (printed model).
    """

    least_energy_j: float
    most_energy_j: float
    energy_weight: float
    time_weight: float
    distance_weight: float
    alpha: float
    half_inertia_kg: float
    limited: bool
    pareto: bool
    correcting: bool
    label_limit: int


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
def pair_gap(p: LinkPhysics, half_inertia: float, v_a: float, v_b: float, v_max: float) -> tuple[float, float]:
    """Most energy [J] and time [s] that entering at v_a instead of v_b can cost where both reach v_max in the link.

    Lemma 5 of docs/search.md: kinetic energy at 1/η_dis, overshoot where the slower one accelerates harder,
    drag of whoever is faster, auxiliaries for the time lost.
    """
    low, high = (v_a, v_b) if v_a < v_b else (v_b, v_a)
    accel_low = mean_over_intervals(p.speed_bound_mps, p.accel_sum, low, v_max)
    accel_high = accel_low
    if high < v_max:
        accel_high = mean_over_intervals(p.speed_bound_mps, p.accel_sum, high, v_max)
    least = min(accel_low, accel_high)
    top2 = v_max * v_max
    z = high * high - low * low
    run = (top2 - low * low) / (2.0 * least)
    overshoot = max(0.0, (top2 - high * high) - accel_high / accel_low * (top2 - low * low))
    diverge = max(0.0, accel_high - accel_low) / least * (top2 - low * low)
    linear = max(p.linear_n_per_mps, 0.0)
    sag = 0.0
    if p.linear_n_per_mps < 0.0 and p.aero_n_per_mps2 > 0.0:
        sag = p.linear_n_per_mps * p.linear_n_per_mps / (4.0 * p.aero_n_per_mps2)
    swing = overshoot + diverge
    energy = (p.drive_factor - p.recuperation_factor) * half_inertia * swing
    energy += p.drive_factor * run * (p.aero_n_per_mps2 * swing + linear * math.sqrt(swing) + sag)
    if v_a < v_b:
        lost = LOST_TIME_COEF * (high - low) / least
        if diverge > 0.0:
            lost += LOST_TIME_COEF * math.sqrt(diverge) / least
        energy += p.drive_factor * half_inertia * z
    else:
        lost = LOST_TIME_COEF * math.sqrt(swing) / least if swing > 0.0 else 0.0
        drag = p.drive_factor * run * (p.aero_n_per_mps2 * z + linear * (high - low))
        energy += max(0.0, drag - p.recuperation_factor * half_inertia * z)
    return energy + p.aux_move_w * lost, lost


@njit(nogil=True, cache=True)
def state_gap(
    p: LinkPhysics,
    bounds: NDArray[np.float64],
    half_inertia: float,
    length: float,
    v_max: float,
    k: int,
    v_a: float,
    p_a: float,
    v_b: float,
    p_b: float,
) -> tuple[float, float, bool, float]:
    """Most energy [J] and time [s] that state A can cost over state B on any way on; whether they meet in this link.

    If not, the last value is the most that A can recuperate until they meet [J]; k is the link's top class.
    The two drives are coupled: both have stopped, or only one has, or none.
    """
    only_one = abs(p_a - p_b)
    none = 1.0 - max(p_a, p_b)
    slowest = min(v_a, v_b) if only_one == 0.0 else 0.0
    meets = slowest >= v_max
    if not meets:
        accel = mean_over_intervals(p.speed_bound_mps, p.accel_sum, slowest, v_max)
        meets = v_max * v_max - slowest * slowest <= 2.0 * accel * length
    if meets:
        energy = 0.0
        lost = 0.0
        if none > 0.0 and v_a != v_b:
            e, t = pair_gap(p, half_inertia, v_a, v_b, v_max)
            energy += none * e
            lost += none * t
        if only_one > 0.0:
            if p_a > p_b:
                e, t = pair_gap(p, half_inertia, 0.0, v_b, v_max)
            else:
                e, t = pair_gap(p, half_inertia, v_a, 0.0, v_max)
            energy += only_one * e
            lost += only_one * t
        return energy, lost, True, 0.0
    deficit = none * max(0.0, v_b * v_b - v_a * v_a)
    excess = none * max(0.0, v_a * v_a - v_b * v_b)
    slower = none * max(0.0, v_b - v_a)
    if p_a > p_b:
        deficit += only_one * v_b * v_b
        slower += only_one * v_b
    else:
        excess += only_one * v_a * v_a
    lost = 2.0 * LOST_TIME_COEF * slower / bounds[LEAST_ACCEL, k] + bounds[SLACK_S, k]
    drag = p.drive_factor * bounds[MEETING_DISTANCE, k]
    drag *= p.aero_n_per_mps2 * excess + max(p.linear_n_per_mps, 0.0) * math.sqrt(excess)
    energy = p.drive_factor * half_inertia * deficit + p.aux_move_w * lost + bounds[SLACK_J, k]
    energy += max(0.0, drag - p.recuperation_factor * half_inertia * excess)
    return energy, lost, False, bounds[GAIN_J, k]


@njit(nogil=True, cache=True)
def phase_gap(
    p: LinkPhysics, length: float, grade: float, v_max: float, v_a: float, p_a: float, v_b: float, p_b: float
) -> tuple[float, float]:
    """The exact difference of energy and time of two entries of a link in which all phases fit whatever follows."""
    e_a, t_a, _ = link_energy(p, length, grade, v_a, p_a, v_max, v_max, 0.0, 0.0)
    e_b, t_b, _ = link_energy(p, length, grade, v_b, p_b, v_max, v_max, 0.0, 0.0)
    return e_a - e_b, t_a - t_b


@njit(nogil=True, cache=True)
def leads(
    p: LinkPhysics,
    bounds: NDArray[np.float64],
    r: SearchRules,
    link: NDArray[np.float64],
    grade: float,
    settling: float,
    k: int,
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    crowded: bool,
) -> bool:
    """Whether label a makes label b on the same link superfluous, whatever follows; a, b, link are table rows.

    crowded: compare kinetic energy and cost alone, without the slack for differing accelerations.
    """
    if a[COST] > b[COST] or (r.pareto and a[ENERGY] > b[ENERGY]):
        return False
    v_a, p_a = a[SPEED], a[STOPPED]
    v_b, p_b = b[SPEED], b[STOPPED]
    if v_a == v_b and p_a == p_b:
        return True
    if crowded:
        gained = (1.0 - p_b) * v_b * v_b - (1.0 - p_a) * v_a * v_a
        worth = p.drive_factor * r.half_inertia_kg * max(0.0, gained)
        if a[COST] + r.energy_weight * worth > b[COST]:
            return False
        return not r.pareto or a[ENERGY] + worth <= b[ENERGY]
    if r.correcting:
        if link[LENGTH] < settling:
            return False
        energy, lost = phase_gap(p, link[LENGTH], grade, link[LIMIT], v_a, p_a, v_b, p_b)
        meets = True
        gain = 0.0
    else:
        energy, lost, meets, gain = state_gap(
            p, bounds, r.half_inertia_kg, link[LENGTH], link[LIMIT], k, v_a, p_a, v_b, p_b
        )
    if a[COST] + r.energy_weight * (energy - NOISE_J) + r.time_weight * (lost - NOISE_S) > b[COST]:
        return False
    if not r.limited:
        return True
    lead = a[ENERGY]
    if not meets:
        # a full battery could take away the lead: count a's charge only as far as it can't be clamped until they meet
        lead = max(lead, r.least_energy_j + gain)
    return bool(lead + energy - NOISE_J <= b[ENERGY])


@njit(nogil=True, cache=True)
def is_ancestor(index: NDArray[np.int32], label: int, candidate: int) -> bool:
    """Whether candidate is on the way from label back to its start."""
    while label >= 0:
        if label == candidate:
            return True
        label = index[label, PARENT]
    return False


@njit(nogil=True, cache=True)
def start_label(g: LinkArrays, p: LinkPhysics, r: SearchRules, ws: Workspace, link: int, offset: float) -> None:
    """Put a start, at rest somewhere on a link, into the heap; it takes part in no dominance."""
    new = ws.counter[LABELS]
    ws.counter[LABELS] = new + 1
    ws.number[new, :] = 0.0
    ws.number[new, OFFSET] = offset
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
    grade_frac, stop_time = g.grade_frac, g.stop_time_s
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
        grade, v_max = grade_frac[link], here[LIMIT]
        for k in range(goal_link.size):
            if goal_link[k] == link and goal_offset[k] > offset:
                ds = goal_offset[k] - offset
                e, t, _ = link_energy(p, ds, grade, v, stopped, v_max, v_max, 1.0, 0.0)
                e = max(e, r.least_energy_j - energy0)
                if energy0 + e <= r.most_energy_j:
                    cost = cost0 + r.energy_weight * e + r.time_weight * t + r.distance_weight * ds
                    height = here[HEIGHT] + grade * goal_offset[k]
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
                if v == v_max and target == v_max and offset == 0.0 and (stopped == 0.0 or here[REST_S] >= 0.0):
                    e, t, v_end = here[CRUISE_J], here[CRUISE_S], v_max
                    if stopped > 0.0:
                        e += stopped * (here[REST_J] - e)
                        t += stopped * (here[REST_S] - t)
                else:
                    e, t, v_end = link_energy(p, ds, grade, v, stopped, v_max, target, p_stop, stop_time[link])
                known_target = target
            used = max(energy0 + e, r.least_energy_j)  # a full battery: the rest is braked away
            if used > r.most_energy_j:
                continue
            cost = cost0 + r.energy_weight * (used - energy0) + r.time_weight * t + r.distance_weight * ds
            new = number[made]
            new[COST], new[ENERGY], new[SPEED], new[STOPPED] = cost, used, v_end, p_stop
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
                    (one[SPEED] == v_end and one[STOPPED] == p_stop and (not r.pareto or one[ENERGY] <= used))
                    or leads(
                        p,
                        bounds,
                        r,
                        there,
                        grade_frac[successor],
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
                    bounds,
                    r,
                    there,
                    grade_frac[successor],
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
            new[KEY], new[TIME], new[DISTANCE], new[OFFSET] = key, time0 + t, distance0 + ds, 0.0
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
def fill_cruise(
    p: LinkPhysics, row: NDArray[np.float64], grade: NDArray[np.float64], wait: NDArray[np.float64]
) -> None:
    """Energy and time of each link entered at its limit or from rest, left at the limit or stopped, into its row."""
    for k in range(row.shape[0]):
        v, length, stop = row[k, LIMIT], row[k, LENGTH], row[k, STOP]
        row[k, CRUISE_J], row[k, CRUISE_S], _ = link_energy(p, length, grade[k], v, 0.0, v, v, stop, wait[k])
        row[k, REST_J], row[k, REST_S], end = link_energy(p, length, grade[k], 0.0, 0.0, v, v, stop, wait[k])
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
        grade, v_max = g.grade_frac[link], g.speed_limit_mps[link]
        length = g.length_m[link]
        e, _, _ = link_energy(p, length - offset, grade, v, stopped, v_max, v_max, 1.0, 0.0)
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
                e, _, _ = link_energy(p, middle - offset, grade, v, stopped, v_max, v_max, 1.0, 0.0)
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
