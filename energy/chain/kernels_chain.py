"""The chain loop, compiled: links driven one after the other, with stops by a rule, their parts booked or not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import LinkPassage, add_link_parts, link_energy
from energy.force.kernels_parts import CABIN, PART_COUNT, REGEN_LIMIT, ROLLING
from energy.force.kernels_physics import (
    ROAD_GRADE,
    ROAD_WAIT,
    LinkPhysics,
    accepted_j,
    book_warm_up,
    cabin_energy_j,
    road_in_time,
)

EXPECTED, COUNTED, NO_STOPS, CROSSINGS = range(4)
MEDIUM = 2  # Cross.MEDIUM: a minor road meeting a major one, an entry to a roundabout
REST = 8  # stop class of a link at whose end the vehicle comes to rest for certain, whatever the rule


class ChainLinks(NamedTuple):
    """Links of a chain as kernels read them.

    roads: (n, 8), columns of energy.force.kernels_physics. length_m, driven_mps (speed driven where the limit is),
    stop_probability: float64 (n,). stop_class: int8 (n,). carried_s: float64 (n,), or (0,) where all links are driven;
    where the vehicle is carried, driven_mps is below 0.
    """

    roads: NDArray[np.float64]
    length_m: NDArray[np.float64]
    driven_mps: NDArray[np.float64]
    stop_probability: NDArray[np.float64]
    stop_class: NDArray[np.int8]
    carried_s: NDArray[np.float64]


class ChainDrive(NamedTuple):
    """How a chain is driven.

    rule: how stops are treated. start_mps: speed at its beginning. arrive_stopped: it ends at rest. full_j: battery
    energy that would fill the battery at departure, negative, −inf where the charge is not known.
    """

    rule: int
    start_mps: float
    arrive_stopped: bool
    full_j: float


class DrivenChain(NamedTuple):
    """What driving each link of a chain takes, to be filled: float64 (n,) each, parts_j (n, 15) of zeros, or (0, 15).

    energy_j, duration_s, standstill_s. speed_end_mps: carried into the next link, given no stop. stopped_frac:
    probability of having stopped at its end.
    """

    energy_j: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    standstill_s: NDArray[np.float64]
    speed_end_mps: NDArray[np.float64]
    stopped_frac: NDArray[np.float64]
    parts_j: NDArray[np.float64]


def undriven(links: int, *, with_parts: bool) -> DrivenChain:
    """Room for what driving so many links takes, with or without their parts."""
    energy, duration, standstill, end, stopped = (np.empty(links) for _ in range(5))
    return DrivenChain(energy, duration, standstill, end, stopped, np.zeros((links if with_parts else 0, PART_COUNT)))


@njit(nogil=True, cache=True)
def stop_at(
    rule: int,
    probability: float,
    stop_class: int,
    requests: NDArray[np.float64],
    stops: NDArray[np.float64],
) -> float:
    """Probability of stopping at a link's end under a rule; counters (8,) are carried from link to link."""
    if stop_class == REST:
        return 1.0
    if rule == NO_STOPS:
        return 0.0
    if rule == CROSSINGS:
        return 1.0 if probability > 0.0 and (stop_class & 3) >= MEDIUM else 0.0
    if rule == COUNTED and probability > 0.0:
        requests[stop_class] += 1.0  # counted before the comparison, so that there is no 0/0
        if stops[stop_class] / requests[stop_class] < probability:  # (29)-(31)
            stops[stop_class] += 1.0
            return 1.0
        return 0.0
    return probability


@njit(nogil=True, cache=True)
def drive_chain(p: LinkPhysics, links: ChainLinks, drive: ChainDrive, driven: DrivenChain) -> float:
    """Drive a chain of links and fill what each takes; the time of all of them [s].

    Parts are booked where driven has room for them. They change nothing else. The clock of climate and tyres stands
    still while the vehicle is carried.
    """
    length, v_max, roads, parts = links.length_m, links.driven_mps, links.roads, driven.parts_j
    energy, time, v_end = driven.energy_j, driven.duration_s, driven.speed_end_mps
    requests = np.zeros(8)
    stops = np.zeros(8)
    v = drive.start_mps
    p_entry = 0.0
    used = 0.0
    clock = 0.0
    carried = 0.0
    n = length.size
    booked = parts.shape[0] > 0
    for k in range(n):
        wait = roads[k, ROAD_WAIT]
        p_stop = stop_at(drive.rule, links.stop_probability[k], links.stop_class[k], requests, stops)
        v_next = v_max[k + 1] if k + 1 < n else v_max[k]  # (10), or (9) where the next link is unknown
        if k + 1 == n and drive.arrive_stopped:
            p_stop = 1.0
            wait = 0.0
        r = road_in_time(p, roads, k, clock, length[k] / v_max[k])
        e, time[k], v_end[k] = link_energy(p, r, length[k], v, p_entry, v_max[k], v_next, p_stop, wait)
        heat = cabin_energy_j(p, clock, clock + time[k])
        energy[k] = accepted_j(p, used, e + heat, drive.full_j)
        if booked:
            passage = LinkPassage(length[k], v, p_entry, v_max[k], v_next, p_stop, wait)
            add_link_parts(p, r, passage, parts[k])
            book_warm_up(p, r, roads, k, parts[k, ROLLING], parts[k])
            parts[k, CABIN] += heat
            parts[k, REGEN_LIMIT] += energy[k] - (e + heat)
        driven.standstill_s[k] = p_stop * wait
        driven.stopped_frac[k] = p_stop
        v = v_end[k]
        p_entry = p_stop
        used = max(used + energy[k], drive.full_j)
        clock += time[k]
        if v_max[k] < 0.0:
            time[k] = links.carried_s[k]
            carried += time[k]
    return clock + carried


@njit(nogil=True, cache=True)
def dissipated_j(
    p: LinkPhysics, links: ChainLinks, drive: ChainDrive, driven: DrivenChain, dissipated: NDArray[np.float64]
) -> None:
    """Fill what of each driven link's energy is not stored in height and speed, (n,).

    Stored is m·g·Δh + ½·m·d·Δv², of a vehicle that stops with probability p the mean over both cases.
    """
    moving = 0.5 * p.inertia_kg * drive.start_mps * drive.start_mps
    for k in range(dissipated.size):
        v, p_stop = driven.speed_end_mps[k], driven.stopped_frac[k]
        still_moving = 0.5 * p.inertia_kg * (1.0 - p_stop) * v * v
        lifted = p.weight_n * links.roads[k, ROAD_GRADE] * links.length_m[k]
        dissipated[k] = driven.energy_j[k] - lifted - (still_moving - moving)
        moving = still_moving
