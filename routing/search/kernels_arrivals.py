"""Compiled: what a one-to-all search has reached, node by node and along each link."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics, accepted_j, borrowed_physics, cabin_energy_j, road_in_time
from routing.dominance.kernels_rules import SearchRules
from routing.links.kernels_drives import DRIVE_J, DRIVE_S, TURNS, DriveTable
from routing.links.kernels_tables import LENGTH, LIMIT, LinkArrays
from routing.search.kernels_workspace import (
    DEAD,
    ENERGY,
    LABELS,
    LINK,
    NEXT,
    OFFSET,
    SPEED,
    STATE,
    STOPPED,
    TIME,
    Workspace,
)


@njit(nogil=True, cache=True)
def arrivals(
    g: LinkArrays,
    p: LinkPhysics,
    r: SearchRules,
    ws: Workspace,
    d: DriveTable,
    head: NDArray[np.int32],
    node_energy: NDArray[np.float64],
    link_reach_m: NDArray[np.float64],
) -> None:
    """After a one-to-all search: least energy to stop at each node, and how far along each link one can stop.

    d: the drives that the search had, to which those that end at rest are added if it fills. node_energy (N,) starts as
    inf; link_reach_m (M,) as −1.
    """
    p = borrowed_physics(p)
    pointer, number, roads, row = borrowed(ws.pointer), borrowed(ws.number), borrowed(g.roads), borrowed(g.row)
    drives, head = borrowed(d.row), borrowed(head)
    node_energy, link_reach_m = borrowed(node_energy), borrowed(link_reach_m)
    for label in range(ws.counter[LABELS]):
        if pointer[label, NEXT] == DEAD:
            continue
        link, state = pointer[label, LINK], pointer[label, STATE]
        offset, energy0, time0 = number[label, OFFSET], number[label, ENERGY], number[label, TIME]
        v, stopped = number[label, SPEED], number[label, STOPPED]
        drive_j, t, length, v_max = math.nan, math.nan, 0.0, 0.0
        stop = 0
        if state > 0 and not math.isnan(drives[state, TURNS]):
            stop = state + 1 + int(drives[state, TURNS])
            drive_j, t = drives[stop, DRIVE_J], drives[stop, DRIVE_S]
        if math.isnan(drive_j + t):
            length, v_max = row[link, LENGTH], row[link, LIMIT]
            road = road_in_time(p, roads, link, time0, (length - offset) / v_max)
            drive_j, t, _ = link_energy(p, road, length - offset, v, stopped, v_max, v_max, 1.0, 0.0)
            if stop > 0 and d.fills:
                drives[stop, DRIVE_J], drives[stop, DRIVE_S] = drive_j, t
        e = accepted_j(p, energy0, drive_j + cabin_energy_j(p, time0, time0 + t), r.least_energy_j)
        used = max(energy0 + e, r.least_energy_j)
        if used <= r.most_energy_j:
            link_reach_m[link] = row[link, LENGTH]
            node = head[link]
            node_energy[node] = min(node_energy[node], used)
            continue
        length, v_max = row[link, LENGTH], row[link, LIMIT]
        if link_reach_m[link] >= length:
            continue
        low, high = offset, length
        for _ in range(24):
            middle = 0.5 * (low + high)
            road = road_in_time(p, roads, link, time0, (middle - offset) / v_max)
            e, t, _ = link_energy(p, road, middle - offset, v, stopped, v_max, v_max, 1.0, 0.0)
            e += cabin_energy_j(p, time0, time0 + t)
            if energy0 + e <= r.most_energy_j:
                low = middle
            else:
                high = middle
        link_reach_m[link] = max(link_reach_m[link], low)
