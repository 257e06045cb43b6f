"""A file's table: named columns of cells, each with the row that it came from."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.formats.times import FORMS, Written, ZoneError, epoch_parts, past_midnight, written
from diagnosis.recordings.notes import Note, NoteKind, RecordingError, shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

DELIMITERS: Final = ";,\t|"
MOST_ROWS: Final = 2_000_000
MOST_COLUMNS: Final = 1000
BEFORE_HEADER: Final = 50  # lines that may stand before the header
COMMENTS: Final = ("#", "//", "%")
SEPARATOR: Final = re.compile(r'\s*"?sep=(.|\\t)"?\s*', re.IGNORECASE)
ABSENT: Final = frozenset(
    {"-", "--", "---", "?", "n/a", "na", "#n/a", "nan", "null", "none", "\\n", "unavailable", "unknown"}
)
DECIMAL_COMMA: Final = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
DECIMAL_POINT: Final = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
THOUSANDS: Final = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")

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

    def times(self, column: Column, *, rising: bool = True) -> tuple[NDArray[np.float64], str]:
        """A column of times [s], float64 (n,), rising or equal, and how they were written: "" for seconds.

        Date and time becomes seconds since 1970, of UTC where it has no zone; so do milliseconds and finer parts since
        1970. Times of day become seconds since midnight, past the next too. Raises RecordingError for one that is
        empty, of another form than the first, out of range, or runs back where they have to be rising.
        """
        cells = self.cells(column.name)
        form = None if isinstance(cells, np.ndarray) else written(cells)
        if form is not None and not isinstance(cells, np.ndarray):
            time_s, how = self._written_times(column, cells, form), form.form
        else:
            time_s, how = self._counted_times(column, cells)
        back = np.diff(time_s) < 0.0
        if rising and bool(back.any()):
            row = int(np.argmax(back)) + 1
            before, time = (self._shown(cells, k) for k in (row - 1, row))
            raise self.error(row, column.name, time, f"at least that of the row before, {before}")
        return time_s, how

    def _counted_times(self, column: Column, cells: Cells) -> tuple[NDArray[np.float64], str]:
        """Seconds, or parts of them since 1970."""
        try:
            values = self._numbers(column, cells, strict=True)
        except RecordingError as error:
            allowed = f"{error.allowed}; or {FORMS}"
            raise RecordingError(error.path, error.row, error.column, str(error.value), allowed) from error
        parts = epoch_parts(float(values[0])) if values.size else None
        if parts is None:
            return self.values(column, required=True), ""
        per_s, name = parts
        time_s = values / per_s
        bad = ~((time_s >= column.low) & (time_s <= column.high))
        if bool(bad.any()):
            row = int(np.argmax(bad))
            raise self.error(row, column.name, _text(cells[row]) or "empty", f"{name} since 1970, as in the first row")
        return time_s, f"{name} since 1970"

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
            return np.array(
                [self._number(row, column, cell, strict=strict) for row, cell in enumerate(cells)], np.float64
            )

    def _number(self, row: int, column: Column, cell: str, *, strict: bool) -> float:
        if _is_absent(cell):
            return math.nan
        try:
            return float(cell)
        except ValueError as error:
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
        return past_midnight(time_s) if form.of_day else time_s


def csv_table(path: str, trip_id: str, text: str, hidden: Sequence[str], is_read: Callable[[str], bool]) -> LogTable:
    """The table in a text of cells set off by semicolons, commas, tabs or bars; RecordingError where it is none.

    is_read: whether a column of this name is read by any format; the cells of others are not kept. Lines before the
    header (comments, "sep=;", a title) and a last row that was cut off are left out, decimal commas become points,
    each with a note.
    """
    skipped, delimiter, body = _without_preamble(text, is_read)
    reader = csv.reader(io.StringIO(body, newline=""), delimiter=delimiter)
    rows: list[list[str]] = []
    lines: list[int] = []
    notes: list[Note] = []
    short: RecordingError | None = None
    if skipped:
        notes.append(Note(NoteKind.IGNORED, "", f"lines before the header: {skipped}"))
    try:
        header = [name.strip() for name in next(reader, [])]
        check_columns(path, header)
        seen = [k for k, name in enumerate(header) if not is_hidden(name, hidden)]
        kept = [k for k in seen if is_read(header[k])]
        for row in reader:
            if row and any(cell and not cell.isspace() for cell in row):
                if short is not None:
                    raise short
                short = _uneven(path, reader.line_num + skipped, row, len(header), delimiter)
                if short is not None:
                    continue
                rows.append([row[k] for k in kept])
                lines.append(reader.line_num + skipped)
                check_rows(path, len(rows))
    except csv.Error as error:
        line = reader.line_num + skipped
        raise RecordingError(path, line, "the row", str(error), f"cells set off by {delimiter}") from error
    if short is not None:
        if len(rows) < 2:
            raise short
        notes.append(Note(NoteKind.REPAIRED, "", f"the last row dropped: {short.value}"))
    if len(rows) < 2:
        line = reader.line_num + skipped or 1
        raise RecordingError(path, line, "the table", f"{len(rows)} rows", "at least 2 samples")
    cells = dict(zip(kept, zip(*rows, strict=True), strict=True))
    columns = tuple(cells.get(k, ()) for k in seen)
    table = LogTable(path, trip_id, tuple(header[k] for k in seen), columns, lines, notes)
    return _with_decimal_points(table)


def _with_decimal_points(table: LogTable) -> LogTable:
    """The table with points for commas in numbers, where no number of the file has a point.

    Raises RecordingError where commas may set off thousands.
    """
    with_comma = [any("," in str(cell) for cell in cells) for cells in table.columns]
    texts = [str(cell).strip() for cells, has in zip(table.columns, with_comma, strict=True) if has for cell in cells]
    commas = [text for text in texts if DECIMAL_COMMA.fullmatch(text)]
    if not commas or any(DECIMAL_POINT.fullmatch(str(cell).strip()) for cells in table.columns for cell in cells):
        return table
    if all(THOUSANDS.fullmatch(text) for text in commas):
        row, name = next(
            (row, name)
            for name, cells in zip(table.names, table.columns, strict=True)
            for row, cell in enumerate(cells)
            if THOUSANDS.fullmatch(str(cell).strip())
        )
        allowed = "decimal points and no commas within numbers, as these may set off thousands or decimals"
        raise table.error(row, name, shown(commas[0]), allowed)
    columns = tuple(
        [cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell.strip()) else cell for cell in map(str, cells)]
        if has
        else cells
        for cells, has in zip(table.columns, with_comma, strict=True)
    )
    note = Note(NoteKind.READ, "", f"numbers with decimal commas, such as {commas[0]}")
    return LogTable(table.path, table.id, table.names, columns, table.lines, [*table.notes, note])


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


def check_columns(path: str, names: Sequence[str]) -> None:
    """Raises RecordingError for more columns than a recording may have."""
    if len(names) > MOST_COLUMNS:
        raise RecordingError(path, 1, "the header", f"{len(names)} columns wide", f"at most {MOST_COLUMNS} columns")


def _uneven(path: str, line: int, row: list[str], columns: int, delimiter: str) -> RecordingError | None:
    """What is wrong with a row of another length than the header; None where only empty cells follow."""
    while len(row) > columns and not row[-1].strip():
        row.pop()
    if len(row) == columns:
        return None
    hint = "; numbers with a decimal point" if delimiter == "," and len(row) > columns else ""
    allowed = f"{columns}, as the header, set off by {'tabs' if delimiter == chr(9) else delimiter}{hint}"
    return RecordingError(path, line, "the row", f"{len(row)} cells long", allowed)


def _without_preamble(text: str, is_read: Callable[[str], bool]) -> tuple[int, str, str]:
    """How many lines stand before the header, the sign that sets off cells, and the text from the header on.

    The header is the first of BEFORE_HEADER lines of which some format reads two names, also behind a comment's mark;
    else the first that is no comment.
    """
    lines = list(itertools.islice(io.StringIO(text, newline=""), BEFORE_HEADER))
    given, first, begin, at = "", -1, 0, 0
    for k, line in enumerate(lines):
        separator = SEPARATOR.fullmatch(line.strip("\r\n"))
        if separator is not None:
            given = "\t" if separator[1] == "\\t" else separator[1]
        elif line.strip():
            bare = line.lstrip().lstrip("#%/").lstrip() if line.lstrip().startswith(COMMENTS) else line
            delimiter = given or _delimiter(bare)
            names = [name.strip().strip('"') for name in bare.split(delimiter)]
            if sum(is_read(name) for name in names) > 1:
                rest = text[at + len(line) :]
                return k, delimiter, bare + rest
            if first < 0 and bare is line:
                first, begin = k, at
        at += len(line)
    if first < 0:
        return 0, given or ",", text[at:]
    return first, given or _delimiter(lines[first]), text[begin:]


def _delimiter(line: str) -> str:
    """The sign that sets off most cells of a line, quoted names aside."""
    header = re.sub(r'"[^"]*"', "", line)
    return max(DELIMITERS, key=header.count)


def _is_absent(cell: str | float) -> bool:
    """Whether a cell says that there is no value."""
    if not isinstance(cell, str):
        return math.isnan(cell)
    text = cell.strip().lower()
    return not text or text in ABSENT


def _text(cell: str | float) -> str:
    return shown(cell.strip() if isinstance(cell, str) else f"{cell:g}")
