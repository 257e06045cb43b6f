"""Compiled: one label's drive of its link towards a successor, from the table of drives or computed."""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from energy.chain.kernels_link import link_energy
from energy.force.kernels_physics import ROAD_GRADE, ROAD_WAIT, LinkPhysics, accepted_j, cabin_energy_j, road_in_time
from routing.dominance.kernels_rules import SearchRules
from routing.links.kernels_drives import (
    DRIVE_END,
    DRIVE_J,
    DRIVE_LINK,
    DRIVE_POTENTIAL,
    DRIVE_S,
    DRIVE_STATE,
    ENTRY_LENGTH,
    ENTRY_STOP,
    TURNS,
    DriveTable,
    state_of,
)
from routing.links.kernels_tables import CRUISE_J, CRUISE_S, HEIGHT, LENGTH, LIMIT, REST_J, REST_S, STOP, BorrowedLinks
from routing.search.kernels_workspace import (
    COST,
    DISTANCE,
    ENERGY,
    KEY,
    LINK,
    NEXT,
    OFFSET,
    PARENT,
    SPEED,
    STATE,
    STOPPED,
    TIME,
    Workspace,
    whole,
)


class Settled(NamedTuple):
    """A label that is settled: what it has used and how it enters its link.

    state: of the table of drives, 0 for none. turns, length_m, stop_frac: of the link. energy_j, time_s, distance_m:
    since the start.
    """

    label: int
    link: int
    state: int
    turns: int
    length_m: float
    stop_frac: float
    key: float
    cost: float
    energy_j: float
    time_s: float
    distance_m: float
    speed_mps: float
    stopped_frac: float
    offset_m: float


class LinkDrive(NamedTuple):
    """A drive of a link: energy without climate [J], time [s], end speed [m/s] of a drive that does not stop.

    target_mps: the speed at the end that it was driven for.
    """

    energy_j: float
    time_s: float
    end_mps: float
    target_mps: float


class Entered(NamedTuple):
    """How a drive enters the successor: the link, its state in the table of drives, and the potential there [J]."""

    link: int
    state: int
    potential_j: float


@njit(nogil=True, cache=True, inline="always")
def settled_label(ws: Workspace, g: BorrowedLinks, d: DriveTable, top: int) -> Settled:
    """A label as the search settles it; ws, g, d: borrowed."""
    link, state = whole(ws.pointer[top, LINK]), whole(ws.pointer[top, STATE])
    turns = 0
    length, p_stop = 0.0, 0.0
    if state > 0:
        length, p_stop, count = d.row[state, ENTRY_LENGTH], d.row[state, ENTRY_STOP], d.row[state, TURNS]
        if math.isnan(length + p_stop + count):
            state = 0
        else:
            turns = whole(count)
    if state == 0:
        turns = g.successor_first[link + 1] - g.successor_first[link]
        length, p_stop = g.row[link, LENGTH], g.row[link, STOP]
    return Settled(
        top,
        link,
        state,
        turns,
        length,
        p_stop,
        ws.number[top, KEY],
        ws.number[top, COST],
        ws.number[top, ENERGY],
        ws.number[top, TIME],
        ws.number[top, DISTANCE],
        ws.number[top, SPEED],
        ws.number[top, STOPPED],
        ws.number[top, OFFSET],
    )


@njit(nogil=True, cache=True, inline="always")
def driven(p: LinkPhysics, g: BorrowedLinks, s: Settled, target: float) -> LinkDrive:
    """Drive the link of a label to its end at a target speed."""
    v_max = g.row[s.link, LIMIT]
    warms = p.tyre_time_s > 0.0
    at_limit = s.speed_mps == v_max and target == v_max and s.offset_m == 0.0 and not warms
    if at_limit and (s.stopped_frac == 0.0 or g.row[s.link, REST_S] >= 0.0):
        energy, time = g.row[s.link, CRUISE_J], g.row[s.link, CRUISE_S]
        if s.stopped_frac > 0.0:
            energy += s.stopped_frac * (g.row[s.link, REST_J] - energy)
            time += s.stopped_frac * (g.row[s.link, REST_S] - time)
        return LinkDrive(energy, time, v_max, target)
    length = s.length_m - s.offset_m
    road = road_in_time(p, g.roads, s.link, s.time_s, length / v_max)
    wait = g.roads[s.link, ROAD_WAIT]
    energy, time, end = link_energy(p, road, length, s.speed_mps, s.stopped_frac, v_max, target, s.stop_frac, wait)
    return LinkDrive(energy, time, end, target)


@njit(nogil=True, cache=True, inline="always")
def known_drive(d: DriveTable, s: Settled, turn: int) -> tuple[LinkDrive, Entered]:
    """The drive of a label's link towards its turn-th successor as the table has it; the successor is −1 if unknown."""
    n = s.state + 1 + turn
    energy, time, end = d.row[n, DRIVE_J], d.row[n, DRIVE_S], d.row[n, DRIVE_END]
    entry, potential, link = d.row[n, DRIVE_STATE], d.row[n, DRIVE_POTENTIAL], d.row[n, DRIVE_LINK]
    if math.isnan(energy + time + end + entry + potential + link):
        return LinkDrive(0.0, 0.0, 0.0, -1.0), Entered(-1, 0, 0.0)
    return LinkDrive(energy, time, end, -1.0), Entered(whole(link), whole(entry), potential)


@njit(nogil=True, cache=True, inline="always")
def entered_by(
    p: LinkPhysics, r: SearchRules, g: BorrowedLinks, d: DriveTable, s: Settled, drive: LinkDrive, turn: int
) -> Entered:
    """How a new drive enters the turn-th successor; written to the table of drives if this search fills it."""
    successor = whole(g.successor[g.successor_first[s.link] + turn])
    kinetic = r.half_inertia_kg * (1.0 - s.stop_frac) * drive.end_mps * drive.end_mps
    potential = r.alpha * (p.weight_n * g.row[successor, HEIGHT] + kinetic)
    state = 0
    if p.tyre_time_s <= 0.0:
        state = whole(state_of(d, g, successor, drive.end_mps, s.stop_frac))
        if d.fills and s.state > 0:
            n = s.state + 1 + turn
            d.row[n, DRIVE_J], d.row[n, DRIVE_S], d.row[n, DRIVE_END] = drive.energy_j, drive.time_s, drive.end_mps
            d.row[n, DRIVE_STATE], d.row[n, DRIVE_POTENTIAL] = state, potential
            d.row[n, DRIVE_LINK] = successor
    return Entered(successor, state, potential)


@njit(nogil=True, cache=True, inline="always")
def reach_goal(
    p: LinkPhysics, r: SearchRules, g: BorrowedLinks, ws: Workspace, s: Settled, goal_offset: float, made: int
) -> bool:
    """Write the label that stops at a goal on the settled label's link; whether the charge suffices for it.

    made: the row of the new label, whose link is M.
    """
    ds = goal_offset - s.offset_m
    v_max = g.row[s.link, LIMIT]
    road = road_in_time(p, g.roads, s.link, s.time_s, ds / v_max)
    e, t, _ = link_energy(p, road, ds, s.speed_mps, s.stopped_frac, v_max, v_max, 1.0, 0.0)
    if p.cabin_w > 0.0 or p.cabin_start_w > 0.0:
        e += cabin_energy_j(p, s.time_s, s.time_s + t)
    e = accepted_j(p, s.energy_j, e, r.least_energy_j)
    e = max(e, r.least_energy_j - s.energy_j)
    if s.energy_j + e > r.most_energy_j:
        return False
    cost = s.cost + r.energy_weight * e + r.time_weight * t + r.distance_weight * ds
    height = g.row[s.link, HEIGHT] + g.roads[s.link, ROAD_GRADE] * goal_offset
    ws.number[made, KEY] = cost - r.energy_weight * r.alpha * p.weight_n * height
    ws.number[made, COST], ws.number[made, ENERGY] = cost, s.energy_j + e
    ws.number[made, TIME], ws.number[made, DISTANCE] = s.time_s + t, s.distance_m + ds
    ws.pointer[made, LINK], ws.pointer[made, PARENT], ws.pointer[made, NEXT] = g.row.shape[0], s.label, -1
    return True
