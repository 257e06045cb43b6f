"""A file's table: named columns of cells, each with the row that it came from."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import RecordingError, shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

DELIMITERS: Final = ";,\t|"
MOST_ROWS: Final = 2_000_000
MOST_COLUMNS: Final = 1000
EPOCH_MS: Final = 1e11  # seconds since 1970 reach it in the year 5138, milliseconds have since 1973
DAY_S: Final = 86_400.0
EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
TIME_OF_DAY: Final = re.compile(r"(\d{1,2}):(\d{2}):(\d{2}(?:\.\d+)?)")
TRUTHS: Final = {"true": "1", "false": "0"}

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
    lines: the row of the file that each row of the table came from.
    """

    path: str
    id: str
    names: tuple[str, ...]
    columns: tuple[Cells, ...]
    lines: Sequence[int]

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

    def values(self, column: Column, *, required: bool = False) -> NDArray[np.float64]:
        """A column in SI units, float64 (n,); empty cells are NaN, and an error where the column is required.

        Raises RecordingError for a cell that is no number or out of the column's range.
        """
        cells = self.cells(column.name)
        values = self._numbers(column, cells)
        good = (values >= column.low) & (values <= column.high)
        if not required:
            good |= np.isnan(values)
        if not bool(good.all()):
            row = int(np.argmin(good))
            cell = cells[row]
            text = cell.strip() if isinstance(cell, str) else f"{cell:g}"
            raise self.error(row, column.name, shown(text) or "empty", column.allowed())
        return values * column.to_si + column.offset

    def times(self, column: Column) -> tuple[NDArray[np.float64], str]:
        """A column of times [s], float64 (n,), rising or equal, and how they were written: "" for seconds.

        Date-times in ISO 8601 become seconds since 1970, of UTC where they have no zone; times of day such as
        13:59:59.5 become seconds since midnight, past the next too. Raises RecordingError for one that is empty, out of
        range or runs back.
        """
        cells = self.cells(column.name)
        first = str(cells[0]).strip()
        if not isinstance(cells, np.ndarray) and TIME_OF_DAY.fullmatch(first):
            time_s, written = self._times_of_day(column, cells), "time of day"
        elif not isinstance(cells, np.ndarray) and _is_date_time(first):
            time_s, written = self._date_times(column, cells), "date and time"
        else:
            time_s, written = self._numbers(column, cells), ""
            if time_s.size and abs(float(time_s[0])) > EPOCH_MS:
                allowed = "seconds; milliseconds since 1970 divided by 1000"
                raise self.error(0, column.name, shown(first), allowed)
            time_s = self.values(column, required=True)
        back = np.diff(time_s) < 0.0
        if bool(back.any()):
            row = int(np.argmax(back)) + 1
            before, time = (self._shown(cells, k) for k in (row - 1, row))
            raise self.error(row, column.name, time, f"at least that of the row before, {before}")
        return time_s, written

    def _shown(self, cells: Cells, row: int) -> str:
        cell = cells[row]
        try:
            return f"{float(cell):.12g}"
        except ValueError:
            return shown(str(cell))

    def _numbers(self, column: Column, cells: Cells) -> NDArray[np.float64]:
        if isinstance(cells, np.ndarray):
            return cells
        try:
            return np.array([cell or "nan" for cell in cells], np.float64)
        except ValueError:
            return np.array([self._number(row, column, cell) for row, cell in enumerate(cells)], np.float64)

    def _number(self, row: int, column: Column, cell: str) -> float:
        try:
            return float(cell) if cell.strip() else math.nan
        except ValueError as error:
            texts = {
                name: str(cells[row]).strip()
                for name, cells in zip(self.names, self.columns, strict=True)
                if len(cells)
            }
            if texts and all(name == text for name, text in texts.items()):
                raise self.error(
                    row, "the row", "the header again", "one header; split the file into drives"
                ) from error
            if row == 0 and not any(_is_number(text) for text in texts.values()):
                found = f"a second header line ({shown(', '.join(texts.values()))})"
                raise self.error(row, "the row", found, "numbers from the row after the header on") from error
            raise self.error(row, column.name, shown(cell), column.allowed()) from error

    def _date_times(self, column: Column, cells: Sequence[str]) -> NDArray[np.float64]:
        found: list[datetime] = []
        for row, cell in enumerate(cells):
            try:
                found.append(datetime.fromisoformat(cell.strip()))
            except ValueError as error:
                allowed = "a date and time as in the rows before, ISO 8601"
                raise self.error(row, column.name, shown(cell) or "empty", allowed) from error
            if (found[row].tzinfo is None) != (found[0].tzinfo is None):
                raise self.error(row, column.name, shown(cell), "a time zone in all rows, or in none")
        since = EPOCH if found[0].tzinfo else EPOCH.replace(tzinfo=None)
        return np.array([(time - since).total_seconds() for time in found], np.float64)

    def _times_of_day(self, column: Column, cells: Sequence[str]) -> NDArray[np.float64]:
        found = []
        for row, cell in enumerate(cells):
            match = TIME_OF_DAY.fullmatch(cell.strip())
            if match is None:
                raise self.error(row, column.name, shown(cell) or "empty", "a time of day such as 13:59:59.5")
            hours, minutes, seconds = match.groups()
            found.append(3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds))
        return past_midnight(np.array(found, np.float64))


def past_midnight(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Seconds of the day, float64 (n,), with a day more after each fall of at least half a day."""
    days = np.concatenate(([0.0], np.cumsum(np.diff(time_s) < -0.5 * DAY_S)))
    return np.asarray(time_s + DAY_S * days, np.float64)


def csv_table(path: str, trip_id: str, text: str, hidden: Sequence[str], is_read: Callable[[str], bool]) -> LogTable:
    """The table in a text of cells set off by semicolons, commas, tabs or bars; RecordingError where it is none.

    is_read: whether a column of this name is read by any format; the cells of others are not kept.
    """
    delimiter = _delimiter(text)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    rows: list[list[str]] = []
    lines: list[int] = []
    try:
        header = [name.strip() for name in next(reader, [])]
        _check_columns(path, header)
        seen = [k for k, name in enumerate(header) if not is_hidden(name, hidden)]
        kept = [k for k in seen if is_read(header[k])]
        for row in reader:
            if row:
                _check_row(path, reader.line_num, len(row), len(header), delimiter)
                rows.append([row[k] for k in kept])
                lines.append(reader.line_num)
                check_rows(path, len(rows))
    except csv.Error as error:
        raise RecordingError(path, reader.line_num, "the row", str(error), f"cells set off by {delimiter}") from error
    if len(rows) < 2:
        raise RecordingError(path, reader.line_num or 1, "the table", f"{len(rows)} rows", "at least 2 samples")
    cells = dict(zip(kept, zip(*rows, strict=True), strict=True))
    columns = tuple(cells.get(k, ()) for k in seen)
    return LogTable(path, trip_id, tuple(header[k] for k in seen), columns, lines)


def json_table(path: str, trip_id: str, text: str, hidden: Sequence[str], is_read: Callable[[str], bool]) -> LogTable:
    """The table in a text with one JSON object a line, or with the object in "tlm"; values within values are left out.

    A name that a line does not have is an empty cell. Raises RecordingError where a line is no object.
    """
    columns: dict[str, list[str]] = {}
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        for name, value in _json_object(path, number, line).items():
            if not isinstance(value, dict | list) and not is_hidden(name, hidden):
                cells = columns.setdefault(name, [])
                if not is_read(name):
                    continue
                cells.extend([""] * (len(lines) - len(cells)))
                cells.append("" if value is None else TRUTHS.get(str(value).lower(), str(value)))
        lines.append(number)
        check_rows(path, len(lines))
        _check_columns(path, list(columns))
    if len(lines) < 2:
        raise RecordingError(path, lines[-1] if lines else 1, "the table", f"{len(lines)} rows", "at least 2 samples")
    for name, cells in columns.items():
        cells.extend([""] * ((len(lines) - len(cells)) * is_read(name)))
    return LogTable(path, trip_id, tuple(columns), tuple(columns.values()), lines)


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


def _check_columns(path: str, names: Sequence[str]) -> None:
    if len(names) > MOST_COLUMNS:
        raise RecordingError(path, 1, "the header", f"{len(names)} columns wide", f"at most {MOST_COLUMNS} columns")


def _check_row(path: str, line: int, cells: int, columns: int, delimiter: str) -> None:
    if cells != columns:
        hint = "; numbers with a decimal point" if delimiter == "," and cells > columns else ""
        allowed = f"{columns}, as the header, set off by {'tabs' if delimiter == chr(9) else delimiter}{hint}"
        raise RecordingError(path, line, "the row", f"{cells} cells long", allowed)


def _delimiter(text: str) -> str:
    """The sign that sets off most cells of the header, quoted names aside."""
    header = re.sub(r'"[^"]*"', "", re.split(r"[\r\n]", text[:100_000], maxsplit=1)[0])
    return max(DELIMITERS, key=header.count)


def _json_object(path: str, number: int, line: str) -> dict[str, object]:
    allowed = 'one JSON object a line, such as {"utc": 1700000000, "speed": 50, "power": 12.5}'
    try:
        found = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise RecordingError(path, number, "the row", shown(line), allowed) from error
    if isinstance(found, dict) and isinstance(found.get("tlm"), dict):
        found = found["tlm"]
    if not isinstance(found, dict):
        raise RecordingError(path, number, "the row", shown(line), allowed)
    return found


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _is_date_time(text: str) -> bool:
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return False
    return not _is_number(text)
