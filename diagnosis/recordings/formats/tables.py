"""A file's table: named columns of cells, each with the row that it came from."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.formats.numbers import degrees_of, number_and_unit, number_of
from diagnosis.recordings.formats.times import (
    DAY_S,
    FORMS,
    Written,
    ZoneError,
    counted,
    going_on,
    is_too_coarse,
    written,
)
from diagnosis.recordings.notes import Note, NoteKind, OrderError, RecordingError, shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_ROWS: Final = 2_000_000
MOST_COLUMNS: Final = 1000
MOST_CELLS: Final = 30_000_000  # that are kept of one file: ten samples a second of 48 columns for 17 hours
MOST_DRIVES: Final = 50_000  # in one file
MOST_NAMED: Final = 100  # drives of one file that can't be read, and are named one by one
POSITIONS: Final = ("latitude_deg", "longitude_deg")
COUNTERS_S: Final = (DAY_S, 7.0 * DAY_S, 2.0**16, 2.0**32 / 1000.0)  # after which counters of seconds begin again
ABSENT: Final = frozenset(
    {"-", "--", "---", "?", "n/a", "na", "#n/a", "nan", "null", "none", "\\n", "unavailable", "unknown"}
)

Cells = Sequence[str] | np.ndarray[tuple[int], np.dtype[np.float64]]


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a format: the channel that it fills, factor and offset to SI, and its range in the file's unit."""

    name: str
    channel: str
    low: float
    high: float
    to_si: float = 1.0
    offset: float = 0.0

    def allowed(self) -> str:
        """Its range as an error tells it."""
        return f"a number from {self.low:g} to {self.high:g}, with a decimal point"


@dataclass(frozen=True, slots=True)
class LogTable:
    """A file's cells by column, hidden columns left out: texts, or float64 (n,) where the file holds numbers.

    Of columns that no format reads only the names are kept, their cells are empty.
    lines: the row of the file that each row of the table came from. notes: what was found while it was read.
    """

    path: str
    id: str
    names: tuple[str, ...]
    columns: tuple[Cells, ...]
    lines: Sequence[int]
    notes: list[Note] = field(default_factory=list)

    def cells(self, name: str) -> Cells:
        """The cells of a column; RecordingError where it is missing or there twice."""
        at = [k for k, column in enumerate(self.names) if column == name]
        if len(at) > 1:
            raise RecordingError(self.path, 1, name, "there twice", "once")
        if not at:
            raise RecordingError(self.path, 1, name, "missing", "a column of this name")
        return self.columns[at[0]]

    def error(self, row: int, column: str, value: str, allowed: str) -> RecordingError:
        """An error at a row of the table."""
        return RecordingError(self.path, self.lines[row], column, value, allowed)

    def values(self, column: Column, *, required: bool = False, strict: bool = False) -> NDArray[np.float64]:
        """A column in SI units, float64 (n,); empty cells are NaN, and an error where the column is required.

        Cells that are no number or out of the column's range are an error where the column is required or strict; else
        they are blanked, with a note. Raises RecordingError.
        """
        cells = self.cells(column.name)
        values = self._numbers(column, cells, strict=required or strict)
        known = ~np.isnan(values)
        bad = ~((values >= column.low) & (values <= column.high)) & (known | required)
        if required or strict:
            if bool(bad.any()):
                row = int(np.argmax(bad))
                raise self.error(row, column.name, _text(cells[row]) or "empty", column.allowed())
        else:
            for row in np.flatnonzero(~known).tolist():
                bad[row] = not _is_absent(cells[row])
            if bool(bad.any()):
                self._note_blanked(column, cells, bad)
                values = np.where(bad, np.nan, values)
        return values * column.to_si + column.offset

    def _note_blanked(self, column: Column, cells: Cells, bad: NDArray[np.bool_]) -> None:
        row = int(np.argmax(bad))
        many = (
            f", the first of {np.count_nonzero(bad)} cells of {bad.size} that are" if np.count_nonzero(bad) > 1 else ","
        )
        text = f"row {self.lines[row]}: {column.name} is {_text(cells[row])}{many} blanked; allowed: {column.allowed()}"
        self.notes.append(Note(NoteKind.REPAIRED, column.channel, text))

    def times(self, column: Column) -> tuple[NDArray[np.float64], str]:
        """A column of times [s], float64 (n,), rising or equal, and how they were written: "" for seconds.

        Date and time becomes seconds since 1970, of UTC where it has no zone; so do milliseconds and finer parts since
        1970. Times of day become seconds since midnight, past the next too. Raises RecordingError for one that is
        empty, of another form than the first, out of range, or runs back.
        """
        time_s, how = self.clock(column)
        back = np.diff(time_s) < 0.0
        if bool(back.any()):
            row, cells = int(np.argmax(back)) + 1, self.cells(column.name)
            before, time = (self._shown(cells, k) for k in (row - 1, row))
            raise OrderError(
                self.path, self.lines[row], column.name, time, f"at least that of the row before, {before}"
            )
        return time_s, how

    def clock(self, column: Column, *, going: bool = True) -> tuple[NDArray[np.float64], str]:
        """As times, in whatever order; going: where a clock begins again, the time goes on."""
        cells = self.cells(column.name)
        form = None if isinstance(cells, np.ndarray) else written(cells)
        if form is not None and not isinstance(cells, np.ndarray):
            time_s, how = self._written_times(column, cells, form), form.form
            anew_s = form.starts_anew_s
        else:
            time_s, how = self._counted_times(column, cells)
            anew_s = () if how else COUNTERS_S
        if not going:
            return time_s, how
        time_s, further = going_on(time_s, anew_s)
        return time_s, "; ".join(filter(None, (how or ("a number" if further else ""), further)))

    def rows(self, rows: Sequence[int], part_id: str, note: Note | None = None) -> LogTable:
        """The table of some of the rows, in their order, with an id of its own."""
        columns = tuple(
            cells[list(rows)]
            if isinstance(cells, np.ndarray)
            else [cells[row] for row in rows]
            if len(cells)
            else cells
            for cells in self.columns
        )
        notes = [*self.notes, *([] if note is None else [note])]
        return LogTable(self.path, part_id, self.names, columns, [self.lines[row] for row in rows], notes)

    def _counted_times(self, column: Column, cells: Cells) -> tuple[NDArray[np.float64], str]:
        """Seconds, or what else counts a time."""
        try:
            values = self._numbers(column, cells, strict=True)
        except RecordingError as error:
            allowed = f"{error.allowed}; or {FORMS}"
            raise RecordingError(error.path, error.row, error.column, str(error.value), allowed) from error
        count = counted(values)
        if count is None:
            return self.values(column, required=True), ""
        time_s = (values - count.begin) / count.per_s
        bad = ~((time_s >= column.low) & (time_s <= column.high))
        if bool(bad.any()):
            row = int(np.argmax(bad))
            raise self.error(row, column.name, _text(cells[row]) or "empty", f"{count.name}, as in the first row")
        return time_s, count.name

    def _shown(self, cells: Cells, row: int) -> str:
        cell = cells[row]
        try:
            return f"{float(cell):.12g}"
        except ValueError:
            return shown(str(cell))

    def _numbers(self, column: Column, cells: Cells, *, strict: bool) -> NDArray[np.float64]:
        if isinstance(cells, np.ndarray):
            return cells
        try:
            return np.array([cell or "nan" for cell in cells], np.float64)
        except ValueError:
            found: dict[str, str] = {}
            values = [self._number(row, column, cell, found, strict=strict) for row, cell in enumerate(cells)]
            for how, cell in found.items():
                self.notes.append(Note(NoteKind.READ, column.channel, f"{column.name}: {how}, such as {shown(cell)}"))
            return np.array(values, np.float64)

    def _number(self, row: int, column: Column, cell: str, found: dict[str, str], *, strict: bool) -> float:
        """The number in a cell in the column's unit; found: how cells were written, with an example of each."""
        if _is_absent(cell):
            return math.nan
        try:
            return float(cell)
        except ValueError as error:
            value, how = number_of(cell), "numbers with thousands set off or a sign of their own"
            if value is None and column.channel in POSITIONS:
                value, how = degrees_of(cell), "degrees and minutes"
            if value is not None:
                found.setdefault(how, cell)
                return value
            known = number_and_unit(cell, column.channel)
            if known is not None:
                found.setdefault(f"unit in its cells, {known[1]}", cell)
                return (known[0] - column.offset) / column.to_si
            self._check_header_again(row, error)
            if not strict:
                return math.nan
            raise self.error(row, column.name, shown(cell), column.allowed()) from error

    def _check_header_again(self, row: int, error: ValueError) -> None:
        """Raises RecordingError for a row that is the header once more, or a line of units below it."""
        texts = {
            name: str(cells[row]).strip() for name, cells in zip(self.names, self.columns, strict=True) if len(cells)
        }
        if texts and all(name == text for name, text in texts.items()):
            raise self.error(row, "the row", "the header again", "one header; split the file into drives") from error
        filled = [text for text in texts.values() if text]
        below = row == 0 and len(filled) > 1 and not any(re.search(r"\d", text) for text in filled)
        if below and not all(_is_absent(text) for text in filled):
            found = f"a second header line ({shown(', '.join(texts.values()))})"
            raise self.error(row, "the row", found, "numbers from the row after the header on") from error

    def _written_times(self, column: Column, cells: Sequence[str], form: Written) -> NDArray[np.float64]:
        found = []
        for row, cell in enumerate(cells):
            try:
                found.append(form.second_of(cell.strip()))
            except ZoneError as error:
                raise self.error(row, column.name, shown(cell), "a time zone in all rows, or in none") from error
            except ValueError as error:
                self._check_header_again(row, error)
                allowed = f"a {form.form} as in the rows before; {FORMS}"
                raise self.error(row, column.name, shown(cell) or "empty", allowed) from error
        time_s = np.array(found, np.float64)
        if is_too_coarse(time_s):
            many = f"{shown(cells[0])}, the same minute in most rows"
            allowed = "times with seconds, which spreadsheets leave out where they are not shown"
            raise self.error(0, column.name, many, allowed)
        return time_s


def is_hidden(name: str, hidden: Sequence[str]) -> bool:
    """Whether a name fits one of the patterns of columns to hide, letter case aside."""
    return any(fnmatchcase(name.strip().lower(), pattern.strip().lower()) for pattern in hidden)


def check_rows(path: str, count: int) -> None:
    """Raises RecordingError for more rows than a recording may have."""
    if count > MOST_ROWS:
        found = f"more than {MOST_ROWS} rows long"
        raise RecordingError(
            path, MOST_ROWS + 1, "the table", found, f"at most {MOST_ROWS} samples; split it into drives"
        )


def check_columns(path: str, names: Collection[str]) -> None:
    """Raises RecordingError for more columns than a recording may have."""
    if len(names) > MOST_COLUMNS:
        raise RecordingError(path, 1, "the header", f"{len(names)} columns wide", f"at most {MOST_COLUMNS} columns")


def check_cells(path: str, count: int) -> None:
    """Raises RecordingError for more cells, in columns that are read, than a recording may have."""
    if count > MOST_CELLS:
        found = f"more than {MOST_CELLS} cells in columns that are read"
        raise RecordingError(path, 1, "the table", found, f"at most {MOST_CELLS}; split it into drives")


def check_drives(path: str, count: int) -> None:
    """Raises RecordingError for more drives than a file may have."""
    if count > MOST_DRIVES:
        raise RecordingError(path, 1, "the file", f"{count} drives", f"at most {MOST_DRIVES}; split it")


def named_errors(path: str, errors: Sequence[RecordingError]) -> list[RecordingError]:
    """Errors of drives of one file as they are kept: without frames, and of very many the first, and how many more."""
    kept = [error.without_trace() for error in errors[:MOST_NAMED]]
    if len(errors) > MOST_NAMED:
        found = f"{len(errors)} drives that can't be read, of which {MOST_NAMED} are named"
        kept.append(RecordingError(path, errors[MOST_NAMED].row, "the file", found, "drives that can be read"))
    return kept


def _is_absent(cell: str | float) -> bool:
    """Whether a cell says that there is no value."""
    if not isinstance(cell, str):
        return math.isnan(cell)
    text = cell.strip().lower()
    return not text or text in ABSENT


def _text(cell: str | float) -> str:
    return shown(cell.strip() if isinstance(cell, str) else f"{cell:g}")
