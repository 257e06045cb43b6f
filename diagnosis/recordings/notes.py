"""What a reader says about a recording: notes on what it found and did, an error where it can't go on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from diagnosis.errors import DiagnosisError
from energy.errors import Refusal


class NoteKind(StrEnum):
    """What a note is about."""

    GAP = "gap"
    FROZEN = "frozen"
    JUMP = "jump"
    MISSING = "missing"
    STUCK = "stuck"
    REPAIRED = "repaired"
    IGNORED = "ignored"
    CHECKED = "checked"
    READ = "read"  # which column became which channel, and how
    LAG = "lag"
    SUSPECT = "suspect"
    UNIT = "unit"  # of a channel that is doubted
    FILLED = "filled"  # a channel that was not recorded, from elsewhere


@dataclass(frozen=True, slots=True)
class Note:
    """One thing that was found in a recording; channel: a field of Recording, or "" for all of it."""

    kind: NoteKind
    channel: str
    text: str


class RecordingError(DiagnosisError, Refusal):
    """A recording that can't be read: names file, row (1 is the header), column, value and what is allowed."""

    def __init__(self, path: str, row: int, column: str, value: str, allowed: str) -> None:
        self.path = path
        self.row = row
        self.column = column
        super().__init__(column, value, allowed, subject=f"{path}, row {row}: {column}")

    def without_trace(self) -> RecordingError:
        """The same to be kept: without the frames that it passed, which hold the tables of its file."""
        return RecordingError(self.path, self.row, self.column, str(self.value), str(self.allowed))


class OrderError(RecordingError):
    """A time that runs back, or far from the others: rows may be out of order, or drives joined."""


def shown(text: str) -> str:
    """A text of a file as an error quotes it: printable, at most 80 characters."""
    printable = "".join(letter if letter.isprintable() else "?" for letter in text[:81])
    return printable if len(printable) <= 80 else f"{printable[:77]}..."
