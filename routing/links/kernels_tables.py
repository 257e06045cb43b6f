"""Compiled: the links of a graph as searches read them, one row a link."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed

# columns of the table of links
LENGTH, LIMIT, HEIGHT, STOP, CRUISE_J, CRUISE_S, REST_J, REST_S = range(8)


class LinkArrays(NamedTuple):
    """The graph and its link attributes as the search reads them, one value a link unless said otherwise.

    top_class: highest speed interval that drives entering here may be in before they must have met.
    settling_m: length from which on all phases fit, whatever the entry and the end.
    row: (M, 8), what the search reads of a link for every label, in one cache line, columns as named above: the other
    floating-point arrays are its columns. CRUISE_J, CRUISE_S: of the commonest drive, at the limit throughout.
    REST_J, REST_S: of the drive from rest; REST_S is -1 where that does not reach the limit. Neither has climate in it.
    Of a link over which the vehicle is carried, LIMIT is CARRIED_MPS and CRUISE_S the time on board. carries: there are
    such links.
    roads: (M, 8), columns of energy.force.kernels_force. speed_limit_mps: the speed that is driven where it is free.
    """

    row: NDArray[np.float64]
    roads: NDArray[np.float64]
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
    carries: bool = False


class BorrowedLinks(NamedTuple):
    """What the loop of a search reads of LinkArrays, borrowed."""

    row: NDArray[np.float64]
    roads: NDArray[np.float64]
    successor_first: NDArray[np.int64]
    successor: NDArray[np.int32]
    top_class: NDArray[np.int8]
    settling_m: NDArray[np.float64]
    carries: bool


@njit(nogil=True, cache=True, inline="always")
def borrowed_links(g: LinkArrays) -> BorrowedLinks:
    """The same links with borrowed arrays."""
    return BorrowedLinks(
        borrowed(g.row),
        borrowed(g.roads),
        borrowed(g.successor_first),
        borrowed(g.successor),
        borrowed(g.top_class),
        borrowed(g.settling_m),
        g.carries,
    )
