"""Compiled: the states in which the links of a graph are entered, which a search back from a goal runs on.

How fast a drive is does not depend on what it takes, so that these states are known before any search.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import plan_link
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics
from routing.links.kernels_tables import LinkArrays

ALIKE_MPS = 1.0  # drives that enter a link within it share a label; what they take is told apart all the same
MOST_ENTRIES = 8  # of one link and one stop probability: then the nearest one is shared


class Entries(NamedTuple):
    """States in which links are entered, K in all: those of one link follow each other.

    first: (M + 1,). link, speed_mps, stopped_frac: (K,). turn_first: (K,), where the turns of an entry begin in turn,
    which holds for each of its link's successors the entry that it leads to. before_first: (M + 1,), before: (S,):
    links that may come before each link. before_turn: (S,), which of their successors it is, from 0.
    """

    first: NDArray[np.int64]
    link: NDArray[np.int32]
    speed_mps: NDArray[np.float64]
    stopped_frac: NDArray[np.float64]
    turn_first: NDArray[np.int64]
    turn: NDArray[np.int32]
    before_first: NDArray[np.int64]
    before: NDArray[np.int32]
    before_turn: NDArray[np.int32]


@njit(nogil=True, cache=True, inline="always")
def borrowed_entries(e: Entries) -> Entries:
    """The same entries with borrowed arrays."""
    return Entries(
        borrowed(e.first),
        borrowed(e.link),
        borrowed(e.speed_mps),
        borrowed(e.stopped_frac),
        borrowed(e.turn_first),
        borrowed(e.turn),
        borrowed(e.before_first),
        borrowed(e.before),
        borrowed(e.before_turn),
    )


class EntryList(NamedTuple):
    """Entries while they are gathered, C at most: chained from latest[link] along earlier, −1 at the end."""

    latest: NDArray[np.int32]
    earlier: NDArray[np.int32]
    link: NDArray[np.int32]
    speed_mps: NDArray[np.float64]
    stopped_frac: NDArray[np.float64]


@njit(nogil=True, cache=True)
def end_speed(g: LinkArrays, p: LinkPhysics, link: int, v: float, stopped: float, successor: int) -> float:
    """Go-speed at a link's end towards a successor, as link_energy has it."""
    v_max = g.speed_limit_mps[link]
    target: float = max(min(v_max, g.speed_limit_mps[successor]), 0.0)
    if v_max < 0.0:
        return 0.0
    if p.table or (v == v_max and stopped == 0.0):
        return target
    length = g.length_m[link]
    end: float = plan_link(p, length, v, v_max, target)[4]
    if stopped == 0.0:
        return end
    _, _, _, _, end_from_rest = plan_link(p, length, 0.0, v_max, target)
    return math.sqrt((1.0 - stopped) * end * end + stopped * end_from_rest * end_from_rest)


@njit(nogil=True, cache=True)
def gather_entry(c: EntryList, made: int, link: int, v: float, stopped: float, alike: float) -> int:
    """Add a state of entry to a link unless one within alike is there; the number of entries then made."""
    other = c.latest[link]
    count = 0
    while other >= 0:
        if c.stopped_frac[other] == stopped:
            count += 1
            if abs(c.speed_mps[other] - v) <= alike:
                return made
        other = c.earlier[other]
    if made == c.link.size or (alike > 0.0 and count >= MOST_ENTRIES):
        return made
    c.link[made], c.speed_mps[made], c.stopped_frac[made] = link, v, stopped
    c.earlier[made] = c.latest[link]
    c.latest[link] = made
    return made + 1


@njit(nogil=True, cache=True)
def gather_entries(g: LinkArrays, p: LinkPhysics, c: EntryList) -> int:
    """Fill the list with the states in which links are entered at a shared limit, and what follows from these.

    The end of a link that is too short for its limits is another state, and so on from link to link. O(K).
    """
    made = 0
    for i in range(g.length_m.size):
        for k in range(g.successor_first[i], g.successor_first[i + 1]):
            j = g.successor[k]
            v = max(min(g.speed_limit_mps[i], g.speed_limit_mps[j]), 0.0)
            made = gather_entry(c, made, j, v, g.stop_probability_frac[i], 0.0)
    entry = 0
    while entry < made:
        i, v, stopped = c.link[entry], c.speed_mps[entry], c.stopped_frac[entry]
        for k in range(g.successor_first[i], g.successor_first[i + 1]):
            j = g.successor[k]
            end = end_speed(g, p, i, v, stopped, j)
            made = gather_entry(c, made, j, end, g.stop_probability_frac[i], ALIKE_MPS)
        entry += 1
    return made


@njit(nogil=True, cache=True)
def sort_entries(g: LinkArrays, c: EntryList, e: Entries) -> None:
    """Entries of a list in the order of their links, and the links before each link."""
    made = 0
    turns = 0
    for link in range(g.length_m.size):
        e.first[link] = made
        entry = c.latest[link]
        while entry >= 0:
            e.link[made], e.speed_mps[made], e.stopped_frac[made] = link, c.speed_mps[entry], c.stopped_frac[entry]
            e.turn_first[made] = turns
            turns += g.successor_first[link + 1] - g.successor_first[link]
            made += 1
            entry = c.earlier[entry]
    e.first[g.length_m.size] = made
    place = e.before_first[:-1].copy()
    for i in range(g.length_m.size):
        for k in range(g.successor_first[i], g.successor_first[i + 1]):
            at = place[g.successor[k]]
            place[g.successor[k]] = at + 1
            e.before[at], e.before_turn[at] = i, k - g.successor_first[i]


@njit(nogil=True, cache=True)
def nearest_entry(e: Entries, link: int, v: float, stopped: float) -> int:
    """The entry of a link after this stop probability whose speed is nearest; there is one after every link before."""
    best = -1
    least = math.inf
    for entry in range(e.first[link], e.first[link + 1]):
        if e.stopped_frac[entry] == stopped and abs(e.speed_mps[entry] - v) < least:
            best, least = entry, abs(e.speed_mps[entry] - v)
    return best


@njit(nogil=True, cache=True)
def join_entries(g: LinkArrays, p: LinkPhysics, e: Entries) -> None:
    """Fill the turns: to which entry each entry leads at each successor of its link."""
    for entry in range(e.link.size):
        link = e.link[entry]
        at = e.turn_first[entry]
        for k in range(g.successor_first[link], g.successor_first[link + 1]):
            end = end_speed(g, p, link, e.speed_mps[entry], e.stopped_frac[entry], g.successor[k])
            e.turn[at] = nearest_entry(e, g.successor[k], end, g.stop_probability_frac[link])
            at += 1
