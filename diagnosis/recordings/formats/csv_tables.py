"""Tables in texts of cells set off by semicolons, commas, tabs or bars."""

from __future__ import annotations

import csv
import io
import itertools
import re
from typing import TYPE_CHECKING, Final

from diagnosis.recordings.formats.tables import LogTable, check_columns, check_rows, is_hidden
from diagnosis.recordings.notes import Note, NoteKind, RecordingError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

DELIMITERS: Final = ";,\t|"
BEFORE_HEADER: Final = 50  # lines that may stand before the header
COMMENTS: Final = ("#", "//", "%")
SEPARATOR: Final = re.compile(r'\s*"?sep=(.|\\t)"?\s*', re.IGNORECASE)
DECIMAL_COMMA: Final = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
DECIMAL_POINT: Final = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
THOUSANDS: Final = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")


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
