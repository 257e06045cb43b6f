"""Compiled: what a one-to-all search by time or distance has reached, node by node and along each link."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics, accepted_j, borrowed_physics, cabin_energy_j, road_in_time
from routing.dominance.kernels_rules import SearchRules
from routing.links.kernels_tables import CRUISE_S, LENGTH, LIMIT, LinkArrays
from routing.search.kernels_workspace import (
    COST,
    DEAD,
    DISTANCE,
    ENERGY,
    LABELS,
    LINK,
    NEXT,
    OFFSET,
    SPEED,
    STOPPED,
    TIME,
    Workspace,
)


@njit(nogil=True, cache=True)
def stops_by(
    g: LinkArrays,
    p: LinkPhysics,
    r: SearchRules,
    ws: Workspace,
    head: NDArray[np.int32],
    by_time: bool,
    most: float,
    node_least: NDArray[np.float64],
    node_energy: NDArray[np.float64],
    link_reach_m: NDArray[np.float64],
) -> None:
    """After a one-to-all search by time or distance: the least to stop at each node, and how far along each link.

    most: beyond which nothing counts as reached [s or m]. node_least (N,) starts as inf, node_energy (N,) is what the
    battery gives on those ways [J], link_reach_m (M,) starts as −1.
    """
    p = borrowed_physics(p)
    pointer, number, roads, row = borrowed(ws.pointer), borrowed(ws.number), borrowed(g.roads), borrowed(g.row)
    head, node_least, node_energy = borrowed(head), borrowed(node_least), borrowed(node_energy)
    link_reach_m = borrowed(link_reach_m)
    for label in range(ws.counter[LABELS]):
        if pointer[label, NEXT] == DEAD:
            continue
        link = pointer[label, LINK]
        offset, time0, distance0 = number[label, OFFSET], number[label, TIME], number[label, DISTANCE]
        v, stopped = number[label, SPEED], number[label, STOPPED]
        length, v_max = row[link, LENGTH], row[link, LIMIT]
        road = road_in_time(p, roads, link, time0, (length - offset) / v_max)
        drive_j, t, _ = link_energy(p, road, length - offset, v, stopped, v_max, v_max, 1.0, 0.0)
        carried = 0.0  # time on board so far, of which costs know and the clock of labels does not
        if g.carries and by_time:
            carried = max(number[label, COST] / r.time_weight - time0, 0.0)
            if v_max < 0.0:
                carried += row[link, CRUISE_S]
        used = time0 + t + carried if by_time else distance0 + length - offset
        if used <= most:
            link_reach_m[link] = length
            node = head[link]
            if used < node_least[node]:
                energy0 = number[label, ENERGY]
                taken = accepted_j(p, energy0, drive_j + cabin_energy_j(p, time0, time0 + t), r.least_energy_j)
                node_least[node], node_energy[node] = used, energy0 + taken
            continue
        if link_reach_m[link] >= length:
            continue
        low, high = offset, length
        for _ in range(24):
            middle = 0.5 * (low + high)
            if by_time:
                road = road_in_time(p, roads, link, time0, (middle - offset) / v_max)
                _, t, _ = link_energy(p, road, middle - offset, v, stopped, v_max, v_max, 1.0, 0.0)
            if (time0 + t + carried if by_time else distance0 + middle - offset) <= most:
                low = middle
            else:
                high = middle
        if low > offset:
            link_reach_m[link] = max(link_reach_m[link], low)
