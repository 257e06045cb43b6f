"""The compiled label-setting search: a state is a directed link about to be driven, entry speed and stop probability.

A label is (link, entry go-speed v, probability p of having stopped before it); it carries battery energy used, time,
distance, weighted cost and parent. docs/search.md has the theorem that the dominance rule and the potential rest on.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import (
    ROAD_GRADE,
    ROAD_WAIT,
    LinkPhysics,
    accepted_j,
    borrowed_physics,
    cabin_energy_j,
    road_at,
    road_in_time,
)
from routing.dominance.kernels_dominates import climate_debt_j, leads, least_slack_j, warm_up_debt_j
from routing.dominance.kernels_rules import (
    DESCENT_J,
    DESCENT_MPS,
    GAIN_J,
    NOISE_COST,
    UNEVEN_J,
    SearchRules,
    SlackRules,
    borrowed_slack_rules,
)
from routing.dominance.kernels_slack import greatest_of_sums, slack_of
from routing.kernels_heap import heap_drop, heap_push
from routing.links.kernels_drives import (
    DRIVE_END,
    DRIVE_J,
    DRIVE_LINK,
    DRIVE_POTENTIAL,
    DRIVE_S,
    DRIVE_STATE,
    ENTRY_LENGTH,
    ENTRY_STOP,
    MOST_STATES,
    PAIR,
    PAIR_GAIN_J,
    PAIR_J,
    PAIR_S,
    TURNS,
    DriveTable,
    pair_slot,
    state_of,
)
from routing.links.kernels_tables import CRUISE_J, CRUISE_S, HEIGHT, LENGTH, LIMIT, REST_J, REST_S, STOP, LinkArrays
from routing.lower_bound.kernels_least import SLOWEST
from routing.lower_bound.kernels_lower_bound import (
    FARTHEST,
    FARTHEST_FRAC,
    FARTHEST_J,
    FARTHEST_M,
    FARTHEST_S,
    NODE_COST,
    NODE_FINAL,
    GoalBound,
    borrowed_goal_bound,
    cost_to_goal,
)
from routing.search.kernels_workspace import (
    BAG_COST,
    BAG_EPOCH,
    BAG_LABEL,
    BAG_STATE,
    COST,
    CRAMPED,
    CROWDED,
    CYCLE,
    DEAD,
    DISTANCE,
    DONE,
    ENERGY,
    FOUND,
    FULL,
    GOAL,
    HEAP,
    KEY,
    LABELS,
    LINK,
    NEGATIVE_CYCLE,
    NEXT,
    OFFSET,
    PARENT,
    REDUCED_BELOW_ZERO,
    REFUSED_S,
    SETTLED,
    SPEED,
    STATE,
    STOPPED,
    TIME,
    TOO_MANY,
    Workspace,
)

CROWD = 48  # labels on one link beyond which dominance is relaxed, which is counted and reported


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
    ws.pointer[new, STATE] = 0
    height = g.tail_height_m[link] + g.grade_frac[link] * offset
    key = -r.energy_weight * r.alpha * p.weight_n * height
    ws.number[new, KEY] = key
    heap_push(ws.heap_key, ws.heap_label, ws.counter[HEAP], key, new)
    ws.counter[HEAP] += 1


@njit(nogil=True, cache=True)
def run(
    g: LinkArrays,
    p: LinkPhysics,
    q: SlackRules,
    bounds: NDArray[np.float64],
    r: SearchRules,
    ws: Workspace,
    d: DriveTable,
    fills: bool,
    h: GoalBound,
    epoch: int,
    goal_link: NDArray[np.int64],
    goal_offset: NDArray[np.float64],
) -> int:
    """Settle labels in the order of their reduced cost until the goal is settled or none is left.

    Precondition: reduced costs are not negative, or r.correcting. d: drives known from earlier searches, to which this
    one adds if it fills. Returns FOUND (counter[GOAL] is the label), DONE, or FULL or CRAMPED when the workspace or the
    table of drives must grow before going on. O(L log L) for L labels made. Ties: the label met first stays.

    The loop reads tables by row and column: a view of a row would be counted in and out with locked instructions,
    which took a third of its time.
    """
    p, q, bounds = borrowed_physics(p), borrowed_slack_rules(q), borrowed(bounds)
    number, index, counter = borrowed(ws.number), borrowed(ws.pointer), borrowed(ws.counter)
    heap_key, heap_label, bag = borrowed(ws.heap_key), borrowed(ws.heap_label), borrowed(ws.bag)
    row, settling_m, top_class, roads = (
        borrowed(g.row),
        borrowed(g.settling_m),
        borrowed(g.top_class),
        borrowed(g.roads),
    )
    drives, latest_state = borrowed(d.row), borrowed(d.latest)
    drive_used, pairs = borrowed(d.used), borrowed(d.pair)
    room = drives.shape[0] if fills and d.grows else 0
    climate = p.cabin_w > 0.0 or p.cabin_start_w > 0.0
    fades = p.fade_width_j > 0.0
    warms = p.tyre_time_s > 0.0
    timeless = q.cabin_start_w == 0.0 and not warms
    descent = borrowed(r.descent)
    strict = descent.shape[0] > 0
    refused_s = math.inf
    energy_weight, least_energy, most_energy = r.energy_weight, r.least_energy_j, r.most_energy_j
    limited, pareto, correcting = r.limited, r.pareto, r.correcting
    uneven = not q.printed and not q.table
    kinetic_j = q.drive_factor * r.half_inertia_kg if uneven else 0.0
    most_accel = greatest_of_sums(q.accel_sum)
    successor_first, successors = borrowed(g.successor_first), borrowed(g.successor)
    directed = h.used
    h = borrowed_goal_bound(h)
    node, gathered, tail, back_reach, back_epoch = h.node, h.entry, h.tail, h.reach, h.epoch
    time_weight, distance_weight = r.time_weight, r.distance_weight
    plain = timeless and not pareto
    links = row.shape[0]
    capacity = index.shape[0]
    heap_size, made, settled = counter[HEAP], counter[LABELS], counter[SETTLED]
    status = DONE
    if directed and back_reach[FARTHEST] == math.inf:  # not yet, and not again after making room
        far = 0.0
        for k in range(heap_size):
            here = tail[index[heap_label[k], LINK]]
            far = max(far, cost_to_goal(h, energy_weight, time_weight, distance_weight, here))
        margin = energy_weight * FARTHEST_J + time_weight * FARTHEST_S + distance_weight * FARTHEST_M
        back_reach[FARTHEST] = max(FARTHEST_FRAC * far, far + margin)
    while heap_size > 0:
        top = heap_label[0]
        if index[top, NEXT] == DEAD:
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
            if correcting:
                continue
            break
        # what the label needs is asked for before the heap is put in order, so that memory answers meanwhile
        state = index[top, STATE]
        turns = 0
        length, p_stop = 0.0, 0.0
        if state > 0:
            length, p_stop, count = drives[state, ENTRY_LENGTH], drives[state, ENTRY_STOP], drives[state, TURNS]
            if math.isnan(length + p_stop + count):
                state = 0
            else:
                turns = int(count)
        if state == 0:
            turns = successor_first[link + 1] - successor_first[link]
            length, p_stop = row[link, LENGTH], row[link, STOP]
        if made + turns + goal_link.size >= capacity:
            status = FULL
            break
        if made > r.label_limit:
            status = TOO_MANY
            break
        if room > 0 and drive_used[0] + turns * (d.most_turns + 2) > room:
            status = CRAMPED
            break
        cost0, energy0, time0 = number[top, COST], number[top, ENERGY], number[top, TIME]
        distance0, offset, key0 = number[top, DISTANCE], number[top, OFFSET], number[top, KEY]
        v, stopped = number[top, SPEED], number[top, STOPPED]
        heap_drop(heap_key, heap_label, heap_size)
        heap_size -= 1
        settled += 1
        for k in range(goal_link.size):
            if goal_link[k] == link and goal_offset[k] > offset:
                ds = goal_offset[k] - offset
                v_max = row[link, LIMIT]
                road = road_in_time(p, roads, link, time0, ds / v_max)
                e, t, _ = link_energy(p, road, ds, v, stopped, v_max, v_max, 1.0, 0.0)
                if climate:
                    e += cabin_energy_j(p, time0, time0 + t)
                e = accepted_j(p, energy0, e, least_energy)
                e = max(e, least_energy - energy0)
                if energy0 + e <= most_energy:
                    cost = cost0 + energy_weight * e + time_weight * t + distance_weight * ds
                    height = row[link, HEIGHT] + roads[link, ROAD_GRADE] * goal_offset[k]
                    number[made, KEY] = cost - energy_weight * r.alpha * p.weight_n * height
                    number[made, COST], number[made, ENERGY] = cost, energy0 + e
                    number[made, TIME], number[made, DISTANCE] = time0 + t, distance0 + ds
                    index[made, LINK], index[made, PARENT], index[made, NEXT] = links, top, -1
                    heap_push(heap_key, heap_label, heap_size, number[made, KEY], made)
                    heap_size += 1
                    made += 1
        ds = length - offset
        known_target = -1.0
        heat_s = -1.0
        heat = 0.0
        new_j = 0.0
        new_s = 0.0
        new_end = 0.0
        for k in range(turns):
            successor = 0
            entered = 0
            drive_j, t, v_end, potential = 0.0, 0.0, 0.0, 0.0
            known = False
            if state > 0:
                n = state + 1 + k
                drive_j, t, v_end = drives[n, DRIVE_J], drives[n, DRIVE_S], drives[n, DRIVE_END]
                entry, potential, link_after = drives[n, DRIVE_STATE], drives[n, DRIVE_POTENTIAL], drives[n, DRIVE_LINK]
                known = not math.isnan(drive_j + t + v_end + entry + potential + link_after)
                if known:
                    entered, successor = int(entry), int(link_after)
            if not known:
                successor = successors[successor_first[link] + k]
                v_max = row[link, LIMIT]
                target = min(v_max, row[successor, LIMIT])
                if target != known_target:
                    at_limit = v == v_max and target == v_max and offset == 0.0 and not warms
                    if at_limit and (stopped == 0.0 or row[link, REST_S] >= 0.0):
                        new_j, new_s, new_end = row[link, CRUISE_J], row[link, CRUISE_S], v_max
                        if stopped > 0.0:
                            new_j += stopped * (row[link, REST_J] - new_j)
                            new_s += stopped * (row[link, REST_S] - new_s)
                    else:
                        road = road_at(roads, link)
                        if warms:
                            road = road_in_time(p, roads, link, time0, ds / v_max)
                        wait = roads[link, ROAD_WAIT]
                        new_j, new_s, new_end = link_energy(p, road, ds, v, stopped, v_max, target, p_stop, wait)
                    known_target = target
                drive_j, t, v_end = new_j, new_s, new_end
                kinetic = r.half_inertia_kg * (1.0 - p_stop) * v_end * v_end
                potential = r.alpha * (p.weight_n * row[successor, HEIGHT] + kinetic)
                if not warms:
                    entered = state_of(
                        latest_state,
                        drives,
                        drive_used,
                        successor,
                        successor_first[successor + 1] - successor_first[successor],
                        row[successor, LENGTH],
                        row[successor, STOP],
                        v_end,
                        p_stop,
                        fills,
                    )
                    if fills and state > 0:
                        n = state + 1 + k
                        drives[n, DRIVE_J], drives[n, DRIVE_S], drives[n, DRIVE_END] = drive_j, t, v_end
                        drives[n, DRIVE_STATE], drives[n, DRIVE_POTENTIAL] = entered, potential
                        drives[n, DRIVE_LINK] = successor
            e = drive_j
            if climate:
                if t != heat_s:
                    heat_s = t
                    heat = cabin_energy_j(p, time0, time0 + t)
                e += heat
            offered_j = e
            if fades:
                e = accepted_j(p, energy0, e, least_energy)
            used = max(energy0 + e, least_energy)  # a full battery: the rest is braked away
            if not timeless and used > energy0 + offered_j:
                refused_s = min(refused_s, time0)
            if used > most_energy:
                continue
            cost = cost0 + energy_weight * (used - energy0) + time_weight * t + distance_weight * ds
            if bag[successor, BAG_EPOCH] != epoch:
                bag[successor, BAG_EPOCH] = epoch
                bag[successor, BAG_LABEL] = -1.0
            elif entered > 0 and plain and bag[successor, BAG_STATE] == entered and bag[successor, BAG_COST] <= cost:
                continue  # the newest label is in the same state, as most are
            # a drive that has not gathered way, soon after the start, is outside of what the bound was made for
            ahead = 0.0
            if directed and v_end >= gathered[successor, SLOWEST]:
                begin = tail[successor]
                if node[begin, NODE_FINAL] == back_epoch:
                    ahead = node[begin, NODE_COST]
                else:
                    ahead = cost_to_goal(h, energy_weight, time_weight, distance_weight, begin)
                if ahead == math.inf:
                    continue
            now_s = time0 + t
            number[made, COST], number[made, ENERGY], number[made, TIME] = cost, used, now_s
            number[made, SPEED], number[made, STOPPED] = v_end, p_stop
            before = -1
            crowd = 0
            superfluous = False
            other = int(bag[successor, BAG_LABEL])
            while other >= 0:
                after = index[other, NEXT]
                crowd += 1
                one_cost, one_j, one_s = number[other, COST], number[other, ENERGY], number[other, TIME]
                one_v, one_stopped = number[other, SPEED], number[other, STOPPED]
                equal = one_v == v_end and one_stopped == p_stop
                gone = False
                for newer in range(2):  # whether the older label leads the new one, then whether the new one leads
                    cost_a, cost_b, energy_a, energy_b = one_cost, cost, one_j, used
                    if newer == 1:
                        cost_a, cost_b, energy_a, energy_b = cost, one_cost, used, one_j
                    if cost_a > cost_b:
                        continue
                    if pareto:
                        # a full battery would take a lead in energy and leave the debt in time
                        debt = cost_a - energy_weight * energy_a - (cost_b - energy_weight * energy_b)
                        if energy_a > energy_b or (debt > NOISE_COST and least_energy != -math.inf):
                            continue
                    v_a, p_a, v_b, p_b = one_v, one_stopped, v_end, p_stop
                    if newer == 1:
                        v_a, p_a, v_b, p_b = v_end, p_stop, one_v, one_stopped
                    due = 0.0
                    if not timeless:
                        s_a, s_b = (one_s, now_s) if newer == 0 else (now_s, one_s)
                        due = climate_debt_j(q, s_a, s_b)
                        if warms:
                            due += warm_up_debt_j(bounds, top_class[successor], s_a, s_b)
                    safe_j = -math.inf
                    if strict:
                        # with no more charge than this no way on fills the battery
                        safe_j = math.inf
                        if v_a >= descent[successor, DESCENT_MPS]:
                            held_j = r.alpha * r.half_inertia_kg * (1.0 - p_a) * v_a * v_a
                            safe_j = least_energy + q.fade_width_j + descent[successor, DESCENT_J] + held_j
                    if equal or crowd > CROWD:
                        worth_j = due
                        if not equal:
                            gained = (1.0 - p_b) * v_b * v_b - (1.0 - p_a) * v_a * v_a
                            worth_j += q.drive_factor * r.half_inertia_kg * max(0.0, gained)
                        gone = cost_a + energy_weight * worth_j <= cost_b
                        if gone and (pareto or (limited and equal)):
                            charged_j = max(energy_a, safe_j) if worth_j > 0.0 else energy_a
                            gone = charged_j + worth_j <= energy_b
                    else:
                        k_top = top_class[successor] if uneven or fades else 0
                        long, v_max = row[successor, LENGTH], row[successor, LIMIT]
                        worth_j = least_slack_j(
                            kinetic_j,
                            most_accel,
                            bounds[UNEVEN_J, k_top] if uneven else 0.0,
                            long,
                            v_max,
                            v_a,
                            p_a,
                            v_b,
                            p_b,
                        )
                        if cost_a + energy_weight * worth_j > cost_b or (limited and energy_a + worth_j > energy_b):
                            continue
                        gap_j, lost_s, gain_j = math.nan, 0.0, 0.0
                        slot = -1
                        one_entered = index[other, STATE]
                        if entered > 0 and one_entered > 0:
                            if newer == 1:
                                slot = pair_slot(pairs, entered, one_entered)
                            else:
                                slot = pair_slot(pairs, one_entered, entered)
                            if slot >= 0 and not math.isnan(pairs[slot, PAIR]):
                                gap_j, lost_s, gain_j = (
                                    pairs[slot, PAIR_J],
                                    pairs[slot, PAIR_S],
                                    pairs[slot, PAIR_GAIN_J],
                                )
                        if math.isnan(gap_j + lost_s + gain_j):
                            gap_j, lost_s, gain_j = slack_of(
                                p,
                                q,
                                bounds,
                                r,
                                roads,
                                successor,
                                long,
                                v_max,
                                settling_m[successor],
                                top_class[successor],
                                v_a,
                                p_a,
                                v_b,
                                p_b,
                                one_s if newer == 1 else now_s,
                            )
                            if slot >= 0 and fills:
                                a, b = (entered, one_entered) if newer == 1 else (one_entered, entered)
                                pairs[slot, PAIR_J], pairs[slot, PAIR_S], pairs[slot, PAIR_GAIN_J] = (
                                    gap_j,
                                    lost_s,
                                    gain_j,
                                )
                                pairs[slot, PAIR] = float(int(a) * MOST_STATES + int(b))
                        fade_frac = bounds[GAIN_J, k_top] / q.fade_width_j if fades else 0.0
                        if strict:
                            owes = due > 0.0
                            if not owes:  # but once they meet it may be the earlier one
                                behind_s = one_s - now_s if newer == 0 else now_s - one_s
                                _, gained_s, _ = slack_of(
                                    p,
                                    q,
                                    bounds,
                                    r,
                                    roads,
                                    successor,
                                    long,
                                    v_max,
                                    settling_m[successor],
                                    top_class[successor],
                                    v_b,
                                    p_b,
                                    v_a,
                                    p_a,
                                    now_s,
                                )
                                owes = gained_s > behind_s
                            if owes:
                                gain_j = max(gain_j, safe_j - least_energy)
                        gone = leads(r, cost_a, energy_a, cost_b, energy_b, gap_j, lost_s, gain_j, due, fade_frac)
                    if gone:
                        superfluous = newer == 0
                        break
                if superfluous:
                    break
                if gone:
                    index[other, NEXT] = DEAD
                    if before < 0:
                        bag[successor, BAG_LABEL], bag[successor, BAG_STATE] = after, 0.0
                    else:
                        index[before, NEXT] = after
                    if correcting and is_ancestor(index, top, other):
                        counter[CYCLE] = successor
                else:
                    before = other
                other = after
            if crowd > CROWD:
                counter[CROWDED] += 1
            if superfluous:
                continue
            index[made, LINK], index[made, PARENT], index[made, STATE] = successor, top, entered
            index[made, NEXT] = int(bag[successor, BAG_LABEL])
            bag[successor, BAG_LABEL], bag[successor, BAG_STATE], bag[successor, BAG_COST] = made, entered, cost
            key = cost - energy_weight * potential + ahead
            if key < key0 - 1e-9 * (abs(key0) + energy_weight * 3600.0):
                counter[REDUCED_BELOW_ZERO] += 1
            number[made, KEY], number[made, DISTANCE], number[made, OFFSET] = key, distance0 + ds, 0.0
            heap_push(heap_key, heap_label, heap_size, key, made)
            heap_size += 1
            made += 1
        if counter[CYCLE] >= 0:
            status = NEGATIVE_CYCLE
            break
    counter[HEAP], counter[LABELS], counter[SETTLED] = heap_size, made, settled
    if refused_s < math.inf and (counter[REFUSED_S] < 0 or refused_s < counter[REFUSED_S]):
        counter[REFUSED_S] = int(refused_s)
    if status == DONE and counter[GOAL] >= 0:
        return FOUND
    return status
