"""The compiled label-setting search: a state is a directed link about to be driven, entry speed and stop probability.

A label is (link, entry go-speed v, probability p of having stopped before it); it carries battery energy used, time,
distance, weighted cost and parent. docs/search-proof.md has the theorem that the dominance rule and the potential rest
on. The loop is `run`: settle the label of least reduced cost, write those at goals on its link, drive to each
successor, and admit the label there unless another one dominates it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics, accepted_j, borrowed_physics, cabin_energy_j
from routing.dominance.kernels_dominates import Label, Rivalry, dominates, rivalry_of
from routing.dominance.kernels_rules import SearchRules, SlackRules, borrowed_search_rules, borrowed_slack_rules
from routing.dominance.kernels_slack import Entry
from routing.kernels_heap import heap_drop, heap_push
from routing.links.kernels_drives import DriveTable, borrowed_drives
from routing.links.kernels_tables import CRUISE_S, LIMIT, LinkArrays, borrowed_links
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
from routing.search.kernels_drive import (
    Entered,
    LinkDrive,
    Settled,
    driven,
    entered_by,
    known_drive,
    reach_goal,
    settled_label,
)
from routing.search.kernels_workspace import (
    BAG_COST,
    BAG_EPOCH,
    BAG_LABEL,
    BAG_STATE,
    COMPARED,
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
    PAUSE_COMPARED,
    PAUSE_LABELS,
    PAUSED,
    REDUCED_BELOW_ZERO,
    REFUSED_S,
    SETTLED,
    SPEED,
    STATE,
    STOPPED,
    TIME,
    TOO_MANY,
    Workspace,
    borrowed_workspace,
    whole,
)

CROWD = 48  # labels on one link beyond which dominance is relaxed, which is counted and reported


class Goals(NamedTuple):
    """Where a search may end: links, rising, and how far along each [m]; (G,) each."""

    link: NDArray[np.int64]
    offset_m: NDArray[np.float64]


@njit(nogil=True, cache=True, inline="always")
def first_goal(link: NDArray[np.int64], of: int) -> int:
    """The first of rising links that is not below one."""
    low, high = 0, link.size
    while low < high:
        middle = (low + high) >> 1
        if link[middle] < of:
            low = middle + 1
        else:
            high = middle
    return low


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
def look_ahead(r: SearchRules, ws: Workspace, h: GoalBound, heap_size: int) -> None:
    """Set how far from the goal a search back may matter, from the labels at the starts; ws, h: borrowed."""
    far = 0.0
    for k in range(heap_size):
        here = h.tail[ws.pointer[ws.heap_label[k], LINK]]
        far = max(far, cost_to_goal(h, r.energy_weight, r.time_weight, r.distance_weight, here))
    margin = r.energy_weight * FARTHEST_J + r.time_weight * FARTHEST_S + r.distance_weight * FARTHEST_M
    h.reach[FARTHEST] = max(FARTHEST_FRAC * far, far + margin)


@njit(nogil=True, cache=True, inline="always")
def cost_ahead(r: SearchRules, h: GoalBound, link: int, end_mps: float) -> float:
    """Lower bound of the cost from the tail of a link to the goal, inf where no way leads there; h: borrowed.

    It is 0 for a drive that has not gathered way, soon after the start, which is outside of what the bound was made
    for.
    """
    if not h.used or end_mps < h.entry[link, SLOWEST]:
        return 0.0
    begin = h.tail[link]
    if h.node[begin, NODE_FINAL] == h.epoch:
        known: float = h.node[begin, NODE_COST]
        return known
    return cost_to_goal(h, r.energy_weight, r.time_weight, r.distance_weight, begin)


@njit(nogil=True, cache=True, inline="always")
def is_dominated(m: Rivalry, ws: Workspace, link: int, new: Label, parent: int) -> bool:
    """Whether an older label of a link dominates a new one; those that the new one dominates leave the link.

    parent: the new label's, by which a cycle shows in a label-correcting search. m, ws: borrowed.
    """
    before = -1
    crowd = 0
    dominated = False
    label = int(ws.bag[link, BAG_LABEL])
    while label >= 0:
        after = ws.pointer[label, NEXT]
        crowd += 1
        number = ws.number
        entry = Entry(number[label, SPEED], number[label, STOPPED], number[label, TIME])
        older = Label(number[label, COST], number[label, ENERGY], entry, whole(ws.pointer[label, STATE]))
        gone = False
        for turned in range(2):  # one place, so that what is inlined here is there once
            a, b = (new, older) if turned == 1 else (older, new)
            if dominates(m, link, a, b, crowd > CROWD):
                gone = turned == 1
                dominated = turned == 0
                break
        if dominated:
            break
        if gone:
            ws.pointer[label, NEXT] = DEAD
            if before < 0:
                ws.bag[link, BAG_LABEL], ws.bag[link, BAG_STATE] = after, 0.0
            else:
                ws.pointer[before, NEXT] = after
            if m.rules.correcting and is_ancestor(ws.pointer, parent, label):
                ws.counter[CYCLE] = link
        else:
            before = label
        label = after
    if crowd > CROWD:
        ws.counter[CROWDED] += 1
        ws.counter[COMPARED] += crowd
    return dominated


@njit(nogil=True, cache=True, inline="always")
def admit(ws: Workspace, made: int, s: Settled, to: Entered, new: Label, distance_m: float, key: float) -> None:
    """Write a label into row made and into the bag of its link; ws: borrowed."""
    link = to.link
    ws.number[made, KEY], ws.number[made, COST], ws.number[made, ENERGY] = key, new.cost, new.energy_j
    ws.number[made, TIME], ws.number[made, DISTANCE] = new.entry.time_s, distance_m
    ws.number[made, SPEED], ws.number[made, STOPPED], ws.number[made, OFFSET] = (
        new.entry.speed_mps,
        new.entry.stopped_frac,
        0.0,
    )
    ws.pointer[made, LINK], ws.pointer[made, PARENT], ws.pointer[made, STATE] = link, s.label, to.state
    ws.pointer[made, NEXT] = int(ws.bag[link, BAG_LABEL])
    ws.bag[link, BAG_LABEL], ws.bag[link, BAG_STATE], ws.bag[link, BAG_COST] = made, to.state, new.cost


@njit(nogil=True, cache=True)
def run(
    g: LinkArrays,
    p: LinkPhysics,
    q: SlackRules,
    r: SearchRules,
    ws: Workspace,
    d: DriveTable,
    h: GoalBound,
    epoch: int,
    goals: Goals,
) -> int:
    """Settle labels in the order of their reduced cost until the goal is settled or none is left.

    Precondition: reduced costs are not negative, or r.correcting. goals: where h directs the search, or on the way
    there, or anywhere where it is not directed; one from which no road leads there is settled last. d: drives known
    from earlier searches, to which this one adds if it fills. Returns FOUND (counter[GOAL] is the label), DONE, or FULL
    or CRAMPED when the workspace or the table of drives must grow before going on, and PAUSED after PAUSE_LABELS or
    PAUSE_COMPARED, to be called again for the rest.
    O(L log L) for L labels made. Ties: the label met first stays.

    Arrays are borrowed and read by row and column: counting references and views of rows in and out with locked
    instructions took a third of the time.
    """
    p, q, links, drives = borrowed_physics(p), borrowed_slack_rules(q), borrowed_links(g), borrowed_drives(d)
    ws, h, r = borrowed_workspace(ws), borrowed_goal_bound(h), borrowed_search_rules(r)
    goals = Goals(borrowed(goals.link), borrowed(goals.offset_m))
    m = rivalry_of(p, q, r, links, drives)
    counter, bag, pointer = ws.counter, ws.bag, ws.pointer
    room = drives.row.shape[0] if drives.fills and drives.grows else 0
    climate = p.cabin_w > 0.0 or p.cabin_start_w > 0.0
    plain = m.timeless and not r.pareto
    refused_s = math.inf
    goal_row = links.row.shape[0]
    capacity = pointer.shape[0]
    heap_size, made, settled = counter[HEAP], counter[LABELS], counter[SETTLED]
    pause, pause_compared = settled + PAUSE_LABELS, counter[COMPARED] + PAUSE_COMPARED
    status = DONE
    if h.used and h.reach[FARTHEST] == math.inf:  # not yet, and not again after making room
        look_ahead(r, ws, h, heap_size)
    while heap_size > 0:
        top = ws.heap_label[0]
        if pointer[top, NEXT] == DEAD:
            heap_drop(ws.heap_key, ws.heap_label, heap_size)
            heap_size -= 1
            continue
        if pointer[top, LINK] == goal_row:
            heap_drop(ws.heap_key, ws.heap_label, heap_size)
            heap_size -= 1
            settled += 1
            if counter[GOAL] < 0 or ws.number[top, COST] < ws.number[counter[GOAL], COST]:
                counter[GOAL] = top
            if r.correcting:
                continue
            break
        # what the label needs is asked for before the heap is put in order, so that memory answers meanwhile
        s = settled_label(ws, links, drives, top)
        if made + s.turns + goals.link.size >= capacity:
            status = FULL
            break
        if made > r.label_limit:
            status = TOO_MANY
            break
        if room > 0 and drives.used[0] + s.turns * (drives.most_turns + 2) > room:
            status = CRAMPED
            break
        if settled >= pause or counter[COMPARED] >= pause_compared:
            status = PAUSED
            break
        heap_drop(ws.heap_key, ws.heap_label, heap_size)
        heap_size -= 1
        settled += 1
        for k in range(first_goal(goals.link, s.link), goals.link.size):
            if goals.link[k] != s.link:
                break
            if goals.offset_m[k] > s.offset_m and reach_goal(p, r, links, ws, s, goals.offset_m[k], made):
                # a goal on the way to where the search is directed comes no earlier than other ways to it
                ws.number[made, KEY] += cost_ahead(r, h, s.link, math.inf)
                heap_push(ws.heap_key, ws.heap_label, heap_size, ws.number[made, KEY], made)
                heap_size += 1
                made += 1
        ds = s.length_m - s.offset_m
        latest = LinkDrive(0.0, 0.0, 0.0, -1.0)  # turns with the same target speed share a drive
        heat_s, heat_j = -1.0, 0.0
        carried_cost = 0.0  # of the time on board, which the clock of climate and tyres does not count
        if links.carries and links.row[s.link, LIMIT] < 0.0:
            carried_cost = r.time_weight * links.row[s.link, CRUISE_S]
        for turn in range(s.turns):
            to = Entered(-1, 0, 0.0)
            if s.state > 0:
                drive, to = known_drive(drives, s, turn)
            if to.link < 0:
                successor = links.successor[links.successor_first[s.link] + turn]
                target = min(links.row[s.link, LIMIT], links.row[successor, LIMIT])
                if target != latest.target_mps:
                    latest = driven(p, links, s, target)
                drive = latest
                to = entered_by(p, r, links, drives, s, drive, turn)
            offered_j = drive.energy_j
            if climate:
                if drive.time_s != heat_s:
                    heat_s = drive.time_s
                    heat_j = cabin_energy_j(p, s.time_s, s.time_s + heat_s)
                offered_j += heat_j
            taken_j = accepted_j(p, s.energy_j, offered_j, r.least_energy_j) if m.fades else offered_j
            used = max(s.energy_j + taken_j, r.least_energy_j)  # a full battery: the rest is braked away
            if not m.timeless and used > s.energy_j + offered_j:
                refused_s = min(refused_s, s.time_s)
            if used > r.most_energy_j:
                continue
            used_cost = r.energy_weight * (used - s.energy_j)
            cost = s.cost + used_cost + r.time_weight * drive.time_s + r.distance_weight * ds + carried_cost
            if bag[to.link, BAG_EPOCH] != epoch:
                bag[to.link, BAG_EPOCH] = epoch
                bag[to.link, BAG_LABEL] = -1.0
            elif to.state > 0 and plain and bag[to.link, BAG_STATE] == to.state and bag[to.link, BAG_COST] <= cost:
                continue  # the newest label is in the same state, as most are
            ahead = cost_ahead(r, h, to.link, drive.end_mps)
            if ahead == math.inf:
                continue
            new = Label(cost, used, Entry(drive.end_mps, s.stop_frac, s.time_s + drive.time_s), to.state)
            if is_dominated(m, ws, to.link, new, top):
                continue
            key = cost - r.energy_weight * to.potential_j + ahead
            if key < s.key - 1e-9 * (abs(s.key) + r.energy_weight * 3600.0):
                counter[REDUCED_BELOW_ZERO] += 1
            admit(ws, made, s, to, new, s.distance_m + ds, key)
            heap_push(ws.heap_key, ws.heap_label, heap_size, key, made)
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
