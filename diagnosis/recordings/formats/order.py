"""Rows whose times run back: the newest first, or drives one after the other."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.formats.tables import Column, LogTable
from diagnosis.recordings.notes import Note, NoteKind

if TYPE_CHECKING:
    from collections.abc import Sequence

ANEW_S: Final = 60.0  # a fall of the time from which on another drive may begin
LEAST_ROWS: Final = 60
MOST_DRIVES: Final = 100


def in_order(table: LogTable, clock: str) -> Sequence[LogTable]:
    """The table's drives with times that rise, ids of their own where they are several; none where it is shuffled.

    clock: the name of its column of times. Turned is a table of which each row is older than the one before; taken
    apart is one whose time begins anew a few times, with LEAST_ROWS rows and more of each drive.
    """
    time_s, _ = table.clock(Column(clock, "time_s", -1e12, 1e12))
    step_s = np.diff(time_s)
    if not bool((step_s > 0.0).any()):
        note = Note(NoteKind.REPAIRED, "time_s", "rows turned, as the newest came first")
        return [table.rows(range(time_s.size - 1, -1, -1), table.id, note)]
    begins = [0, *(np.flatnonzero(step_s < 0.0) + 1).tolist(), time_s.size]
    lengths = np.diff(begins)
    if (
        not 1 < len(lengths) <= MOST_DRIVES
        or int(lengths.min()) < LEAST_ROWS
        or float(step_s[step_s < 0.0].max()) > -ANEW_S
    ):
        return []
    drives = []
    for number, (begin, end) in enumerate(itertools.pairwise(begins), start=1):
        text = f"drive {number} of {len(lengths)} in the file: from row {table.lines[begin]} on the time begins anew"
        drives.append(table.rows(range(begin, end), f"{table.id}-{number}", Note(NoteKind.READ, "time_s", text)))
    return drives
