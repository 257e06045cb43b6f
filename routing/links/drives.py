"""What links take from the states they are entered in, kept from search to search for a vehicle and its conditions."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.links.kernels_drives import COLUMNS, PAIR_COLUMNS, DriveTable

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

LEAST_ROWS: Final = 16_384
MOST_ROWS: Final = 4_194_304  # 200 MB: 1.2 million states, a city of 900 000 links
GROWTH: Final = 2
ROWS_PER_PAIR: Final = 8  # a city's search compares some 50 000 pairs of states and has 600 000 rows


class Drives:
    """The table of drives of one search space: one search at a time fills it, others read it meanwhile.

    successor_first: of the graph, int64 (M + 1,). most_rows: of states and drives; the rest is driven each time.
    """

    def __init__(self, successor_first: NDArray[np.int64], most_rows: int = MOST_ROWS) -> None:
        degree = np.diff(successor_first)
        self._most_turns = int(degree.max(initial=0))
        self._links = degree.size
        self._most_rows = most_rows
        self._table = self._empty(LEAST_ROWS)
        self._filling = threading.Lock()

    @property
    def rows(self) -> int:
        """States and drives that are known."""
        return int(self._table.used[0]) - 1

    @property
    def held_bytes(self) -> int:
        """Memory of the table [B]."""
        table = self._table
        return table.latest.nbytes + table.row.nbytes + table.pair.nbytes

    @contextmanager
    def lent(self) -> Iterator[LentDrives]:
        """The table for one search, to be filled if no other search fills it."""
        fills = self._filling.acquire(blocking=False)
        try:
            yield LentDrives(self, self._table, fills=fills)
        finally:
            if fills:
                self._filling.release()

    def forget(self) -> None:
        """Give the memory back, unless a search fills the table just now; those that read it keep what they have."""
        if self.rows == 0 or not self._filling.acquire(blocking=False):
            return
        try:
            self._table = self._empty(LEAST_ROWS)
        finally:
            self._filling.release()

    def grown(self) -> DriveTable:
        """The table with more room, for the search that fills it; others may go on reading the smaller one."""
        old = self._table
        new = self._empty(GROWTH * old.row.shape[0])
        used = int(old.used[0])
        new.latest[:] = old.latest
        new.row[:used] = old.row[:used]
        new.used[:] = used
        self._table = new
        return new

    def _empty(self, rows: int) -> DriveTable:
        # room for what one label can add is asked for beforehand, so that a search that may grow never stops short
        least = self._most_turns * (self._most_turns + 2) + 2
        rows = min(max(rows, 2 * least), self._most_rows)
        return DriveTable(
            latest=np.zeros(self._links, np.int32),
            row=np.full((rows, COLUMNS), np.nan),
            used=np.ones(1, np.int64),
            pair=np.full((1 << (rows // ROWS_PER_PAIR).bit_length(), PAIR_COLUMNS), np.nan),
            most_turns=self._most_turns,
            grows=rows < self._most_rows,
        )


class LentDrives:
    """The table of drives as one search has it."""

    def __init__(self, drives: Drives, table: DriveTable, *, fills: bool) -> None:
        self.table = table._replace(fills=fills)
        self._drives = drives

    def grow(self) -> None:
        """Make more room; for a search that fills the table."""
        self.table = self._drives.grown()._replace(fills=True)
