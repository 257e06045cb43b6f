"""Compiled: what ways from many places to one cost at least, each by a short search that is directed there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)
from energy.force.kernels_physics import LinkPhysics
from routing.dominance.kernels_rules import SearchRules, SlackRules
from routing.links.kernels_drives import DriveTable
from routing.links.kernels_tables import LinkArrays
from routing.lower_bound.kernels_lower_bound import GoalBound
from routing.search.kernels_search import Goals, run, start_label
from routing.search.kernels_workspace import COST, CYCLE, DONE, FOUND, GOAL, REFUSED_S, TOO_MANY, Workspace


class Sources(NamedTuple):
    """Places that searches begin at, each with its positions first[k]..first[k + 1]: links, and how far along [m]."""

    first: NDArray[np.int64]
    link: NDArray[np.int64]
    offset_m: NDArray[np.float64]


@njit(nogil=True, cache=True)
def least_costs(
    g: LinkArrays,
    p: LinkPhysics,
    q: SlackRules,
    r: SearchRules,
    ws: Workspace,
    d: DriveTable,
    h: GoalBound,
    epoch: int,
    goals: Goals,
    sources: Sources,
    begin: int,
    gained: float,
    least: NDArray[np.float64],
) -> tuple[int, int, int]:
    """Set the least cost to the goals of each source from begin on: of its way, or what no way is below.

    r: its label_limit ends each search, whose least key is then the bound. gained: what the potential at the goals is
    worth, in costs. Returns the source that it came to, the number of its search (epoch is the first's), and the status
    of run where that asks for something first, DONE at the end.
    """
    for k in range(begin, least.size):
        ws.counter[:] = 0
        ws.counter[GOAL] = ws.counter[CYCLE] = ws.counter[REFUSED_S] = -1
        for j in range(sources.first[k], sources.first[k + 1]):
            start_label(g, p, r, ws, sources.link[j], sources.offset_m[j], 0.0)
        status = run(g, p, q, r, ws, d, h, epoch, goals)
        if status == TOO_MANY:
            least[k] = ws.heap_key[0] + gained
        elif status == FOUND:
            least[k] = ws.number[ws.counter[GOAL], COST]
        elif status == DONE:
            least[k] = math.inf
        else:
            return k, epoch, status
        epoch += 1
    return least.size, epoch, DONE
