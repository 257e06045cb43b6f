"""Compiled: the table of drives, what links take from the states that they were entered in before.

Speeds do not depend on energy, so that a drive of a link from one entry state towards one successor always takes the
same, climate, tyres that warm up and what a battery refuses apart. A search that fills the table writes what it drives;
the next one adds up numbers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from routing.links.kernels_tables import LENGTH, STOP, BorrowedLinks

# columns of a state's row
ENTRY_MPS, ENTRY_STOPPED, EARLIER, TURNS, ENTRY_LENGTH, ENTRY_STOP = range(6)
# columns of a drive's row
DRIVE_J, DRIVE_S, DRIVE_END, DRIVE_STATE, DRIVE_POTENTIAL, DRIVE_LINK = range(6)
COLUMNS = 6
# columns of a pair of states, of which the first is asked whether it dominates the second: both, and what slack_of says
PAIR, PAIR_J, PAIR_S, PAIR_GAIN_J = range(4)
PAIR_COLUMNS = 4
MOST_STATES = 1 << 24
PROBES = 4


class DriveTable(NamedTuple):
    """States in which links are entered and the drives from them; a state is the number of its row, from 1 on.

    latest: (M,), the newest state of each link, 0 for none. row: (R, 6). A state's row has the entry speed [m/s], the
    probability of having stopped, the link's state before it (0 at the end), the number of the link's turns, its length
    [m] and the probability of stopping at its end. A row for each turn follows: energy [J] without climate, time [s],
    speed at the end [m/s], the state in which it enters the successor (0 where there was no room for it), the potential
    there [J] and the successor; then one for stopping at the link's end: energy and time. used: (1,), rows in use.
    most_turns: of any link. grows: more room may be asked for. fills: this search writes what it drives.
    pair: (H, 4), H a power of two, slacks of two states of a link in the order of their hash.

    Every value is NaN or 0 until it is written, once. So one search may fill the table while others read it: what they
    find is either absent or right, in whatever order it becomes visible to them.
    """

    latest: NDArray[np.int32]
    row: NDArray[np.float64]
    used: NDArray[np.int64]
    pair: NDArray[np.float64]
    most_turns: int
    grows: bool
    fills: bool = False


@njit(nogil=True, cache=True, inline="always")
def borrowed_drives(d: DriveTable) -> DriveTable:
    """The same table with borrowed arrays."""
    return DriveTable(
        borrowed(d.latest), borrowed(d.row), borrowed(d.used), borrowed(d.pair), d.most_turns, d.grows, d.fills
    )


@njit(nogil=True, cache=True)
def state_of(d: DriveTable, g: BorrowedLinks, link: int, speed: float, stopped: float) -> int:
    """The state of a link with exactly this entry, made if it is new and the search fills; 0 where there is none."""
    table = d.row
    state: int = d.latest[link]
    while state > 0:
        if table[state, ENTRY_MPS] == speed and table[state, ENTRY_STOPPED] == stopped:
            return state
        earlier = table[state, EARLIER]
        if math.isnan(earlier):
            break
        state = int(earlier)
    made = d.used[0]
    turns = g.successor_first[link + 1] - g.successor_first[link]
    if not d.fills or made + 2 + turns > table.shape[0]:
        return 0
    table[made, ENTRY_MPS], table[made, ENTRY_STOPPED], table[made, EARLIER] = speed, stopped, d.latest[link]
    table[made, TURNS], table[made, ENTRY_LENGTH], table[made, ENTRY_STOP] = (
        turns,
        g.row[link, LENGTH],
        g.row[link, STOP],
    )
    d.used[0] = made + 2 + turns
    d.latest[link] = made
    return int(made)


@njit(nogil=True, cache=True, inline="always")
def pair_slot(table: NDArray[np.float64], a: int, b: int) -> int:
    """Where the slack of state a over state b is kept or would be, −1 where there is no room for it."""
    first, second = int(a), int(b)
    key = float(first * MOST_STATES + second)
    mask = table.shape[0] - 1
    at = (first * 2654435761 + second * 2246822519) >> 7 & mask
    found = -1
    for _ in range(PROBES):
        if table[at, PAIR] == key or math.isnan(table[at, PAIR]):
            found = at
            break
        at = (at + 1) & mask
    return found
