"""Compiled: a stretch of a link that is driven, and what its drive takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy
from energy.force.kernels_physics import ROAD_WAIT, LinkPhysics, Road, accepted_j, cabin_energy_j
from routing.links.kernels_tables import CRUISE_J, CRUISE_S, LENGTH, LIMIT, REST_J, REST_S, STOP


class LinkStretch(NamedTuple):
    """A stretch of a link that is driven towards a go-speed at its end.

    stop_frac: probability of stopping there, wait_s: for how long.
    """

    length_m: float
    limit_mps: float
    target_mps: float
    stop_frac: float
    wait_s: float


@njit(nogil=True, cache=True, inline="always")
def stretch_to_end(
    row: NDArray[np.float64], roads: NDArray[np.float64], link: int, begin_m: float, target_mps: float
) -> LinkStretch:
    """A link from begin_m on, left as its stops say; row, roads: tables of links, borrowed."""
    return LinkStretch(
        row[link, LENGTH] - begin_m, row[link, LIMIT], target_mps, row[link, STOP], roads[link, ROAD_WAIT]
    )


@njit(nogil=True, cache=True, inline="always")
def stretch_to_rest(row: NDArray[np.float64], link: int, begin_m: float, end_m: float) -> LinkStretch:
    """A link between two places, of which the drive ends at the second; row: table of links, borrowed."""
    return LinkStretch(end_m - begin_m, row[link, LIMIT], row[link, LIMIT], 1.0, 0.0)


@njit(nogil=True, cache=True, inline="always")
def limit_drive(row: NDArray[np.float64], link: int, stopped_frac: float) -> tuple[float, float]:
    """Energy without climate [J] and time [s] of a whole link from its limit to its limit, or stopped_frac from rest.

    The table of links, row, must know the drive from rest unless stopped_frac is 0.
    """
    energy, time = row[link, CRUISE_J], row[link, CRUISE_S]
    if stopped_frac > 0.0:
        energy += stopped_frac * (row[link, REST_J] - energy)
        time += stopped_frac * (row[link, REST_S] - time)
    return energy, time


@njit(nogil=True, cache=True, inline="always")
def stretch_energy(
    p: LinkPhysics, road: Road, s: LinkStretch, entry_mps: float, stopped_frac: float
) -> tuple[float, float, float]:
    """Energy without climate [J], time [s] and go-speed at the end [m/s] of a stretch, as link_energy has them."""
    return link_energy(p, road, s.length_m, entry_mps, stopped_frac, s.limit_mps, s.target_mps, s.stop_frac, s.wait_s)


@njit(nogil=True, cache=True, inline="always")
def used_after_j(p: LinkPhysics, used_j: float, drive_j: float, begin_s: float, time_s: float, full_j: float) -> float:
    """Battery energy used since departure after a drive, of which used_j was used before it [J].

    drive_j: what it takes without climate [J]. begin_s: since departure [s]. A battery that is full at full_j accepts
    what it can; the rest is braked away.
    """
    offered_j = drive_j + cabin_energy_j(p, begin_s, begin_s + time_s)
    return max(used_j + accepted_j(p, used_j, offered_j, full_j), full_j)
