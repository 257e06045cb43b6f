"""Tables in texts of cells set off by semicolons, commas, tabs or bars."""

from __future__ import annotations

import csv
import io
import itertools
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from diagnosis.recordings.formats.numbers import COMMA_THOUSANDS, DECIMAL_COMMA, DECIMAL_POINT, POINT_THOUSANDS
from diagnosis.recordings.formats.tables import (
    MOST_CELLS,
    MOST_COLUMNS,
    MOST_ROWS,
    LogTable,
    check_cells,
    check_columns,
    check_rows,
    is_hidden,
)
from diagnosis.recordings.formats.units import is_unit, plain_unit
from diagnosis.recordings.notes import Note, NoteKind, RecordingError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

DELIMITERS: Final = ";,\t|"
BEFORE_HEADER: Final = 200  # lines that may stand before the header
COMMENTS: Final = ("#", "//", "%")
SEPARATOR: Final = re.compile(r'\s*"?sep=(.|\\t)"?\s*', re.IGNORECASE)
UNIT_IN_NAME: Final = re.compile(r"(?:[\[(]([^\[\]()]*)[\])]|_([a-z]+))$")
MOST_FOOTERS: Final = 5
MOST_ROW: Final = 1_000_000  # letters of a line, and of a row, which may have several
MOST_SECTIONS: Final = 5000  # each with a header of its own


def csv_table(path: str, trip_id: str, text: str, hidden: Sequence[str], is_read: Callable[[str], bool]) -> LogTable:
    """The table in a text of cells set off by semicolons, commas, tabs or bars; RecordingError where it is none.

    is_read: whether a column of this name is read by any format; the cells of others are not kept. Lines before the
    header (comments, "sep=;", a title), a line of units below it, comments between rows, and last rows that are cut off
    or no samples are left out, decimal commas become points, each with a note. Where the header comes again, also with
    other columns, the rows below it are in its columns.
    """
    _check_lines(path, text)
    skipped, delimiter, body = _without_preamble(text, is_read)
    counted = _Counted()
    reader = csv.reader(_lines(path, body, counted), delimiter=delimiter, skipinitialspace=delimiter == " ")
    sections: list[_Section] = []
    notes: list[Note] = []
    short: RecordingError | None = None
    if skipped:
        notes.append(Note(NoteKind.IGNORED, "", f"lines before the header: {skipped}"))
    try:
        first = next(reader, [])
        header = [name.strip() for name in first]
        check_columns(path, header)
        begin, columns, comments, count, cells = first[0] if first else "", len(header), 0, 0, 0
        section = _section(header, hidden, is_read)
        rows, lines, kept = section.rows, section.lines, section.kept
        sections.append(section)
        for row in reader:
            counted.letters = 0
            if row and any(cell and not cell.isspace() for cell in row):
                if short is not None:
                    raise short
                if row[0] == begin and _is_header(row, header, is_read):
                    header = [name.strip() for name in row]
                    check_columns(path, header)
                    _check_sections(path, sections)
                    columns, section = len(header), _section(header, hidden, is_read)
                    rows, lines, kept = section.rows, section.lines, section.kept
                    sections.append(section)
                    continue
                if len(row) != columns:
                    if row[0].lstrip().startswith(COMMENTS[:2]) or _is_rule(row):
                        comments += 1
                        continue
                    short = _uneven(path, reader.line_num + skipped, row, columns, delimiter)
                    if short is not None:
                        continue
                if count == 0 and _is_of_units(row):
                    section.names, kept = _with_units(path, reader.line_num + skipped, section, row, is_read)
                    section.kept = kept
                    notes.append(Note(NoteKind.READ, "", f"a line of units below the header: {', '.join(row)}"))
                    count = 1  # of rows, that of units with them
                    continue
                rows.append([row[k] for k in kept])
                lines.append(reader.line_num + skipped)
                count += 1
                cells += len(kept)
                if count > MOST_ROWS or cells > MOST_CELLS:
                    check_rows(path, count)
                    check_cells(path, cells)
    except csv.Error as error:
        line = reader.line_num + skipped
        raise RecordingError(path, line, "the row", str(error), f"cells set off by {delimiter}") from error
    if short is not None:
        if sum(len(section.rows) for section in sections) < 2:
            raise short
        notes.append(Note(NoteKind.REPAIRED, "", f"the last row dropped: {short.value}"))
    notes += _without_footer(sections[-1])
    if comments:
        notes.append(Note(NoteKind.IGNORED, "", f"comments and rules between rows: {comments}"))
    if len(sections) > 1:
        again = f"the header comes again, {len(sections) - 1} times: rows are in the columns of the one above them"
        notes.append(Note(NoteKind.READ, "", again))
    return with_decimal_points(_joined(path, trip_id, sections, notes, reader.line_num + skipped or 1))


@dataclass(slots=True)
class _Counted:
    """Letters of the row that is being read, which quotes may spread over lines."""

    letters: int = 0


def _lines(path: str, text: str, counted: _Counted) -> Iterator[str]:
    """The lines of a text; RecordingError where a row of them grows too long."""
    for line in io.StringIO(text, newline=""):
        counted.letters += len(line)
        if counted.letters > MOST_ROW:
            raise _too_long(path)
        yield line


def _check_lines(path: str, text: str) -> None:
    """Raises RecordingError for a text with a line that is longer than any table's, O(letters)."""
    at = 0
    while at + MOST_ROW < len(text):
        end = max(text.rfind(sign, at, at + MOST_ROW) for sign in "\n\r")
        if end < 0:
            raise _too_long(path)
        at = end + 1


def _too_long(path: str) -> RecordingError:
    found = f"more than {MOST_ROW} letters long"
    return RecordingError(path, 1, "a line", found, f"at most {MOST_ROW} letters, quotes that are closed")


def _check_sections(path: str, sections: Sequence[_Section]) -> None:
    """Raises RecordingError where the header comes again too often."""
    if len(sections) >= MOST_SECTIONS:
        found = f"there more than {MOST_SECTIONS} times"
        raise RecordingError(path, 1, "the header", found, f"at most {MOST_SECTIONS} times; split it into drives")


@dataclass(slots=True)
class _Section:
    """Rows below a header: names of those columns that are not hidden, by their place, and cells of those kept."""

    names: dict[int, str]
    kept: list[int]
    rows: list[list[str]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)


def _section(header: Sequence[str], hidden: Sequence[str], is_read: Callable[[str], bool]) -> _Section:
    names = {k: name for k, name in enumerate(header) if not is_hidden(name, hidden)}
    return _Section(names, [k for k, name in names.items() if is_read(name)])


def _is_header(row: Sequence[str], header: Sequence[str], is_read: Callable[[str], bool]) -> bool:
    """Whether a row that begins as the header is one: the same, or names of which several are read."""
    names = [cell.strip() for cell in row]
    if names == header:
        return any(is_read(name) for name in names)
    return names[0] != "" and sum(is_read(name) for name in names if name in header) > 1


def _joined(path: str, trip_id: str, sections: Sequence[_Section], notes: list[Note], last: int) -> LogTable:
    """The table of all sections, a column a name; RecordingError where it has fewer than two rows."""
    lines = [line for section in sections for line in section.lines]
    if len(lines) < 2:
        raise RecordingError(path, last, "the table", f"{len(lines)} rows", "at least 2 samples")
    if len(sections) == 1:
        section = sections[0]
        cells = dict(zip(section.kept, zip(*section.rows, strict=True), strict=True))
        columns = tuple(cells.get(k, ()) for k in section.names)
        return LogTable(path, trip_id, tuple(section.names.values()), columns, lines, notes)
    names = dict.fromkeys(name for section in sections for name in section.names.values())
    check_columns(path, names)
    check_cells(path, len({section.names[k] for section in sections for k in section.kept}) * len(lines))
    found: dict[str, list[str]] = {}
    for section in sections:
        own = dict(zip(section.kept, zip(*section.rows, strict=True), strict=True)) if section.rows else {}
        by_name = {section.names[k]: column for k, column in own.items()}
        for name in names:
            found.setdefault(name, []).extend(by_name.get(name, [""] * len(section.rows)))
    kept = {section.names[k] for section in sections for k in section.kept}
    return LogTable(
        path, trip_id, tuple(names), tuple(found[name] if name in kept else () for name in names), lines, notes
    )


def _is_rule(row: Sequence[str]) -> bool:
    """Whether a row is a line that is drawn below a header."""
    return not any(letter not in "-+=| " for cell in row for letter in cell)


def _is_of_units(row: Sequence[str]) -> bool:
    """Whether a row has units in its cells, and nothing else."""
    filled = [cell for cell in row if cell.strip(" -")]
    return len(filled) > 1 and all(is_unit(cell) for cell in filled)


def _with_units(
    path: str, line: int, section: _Section, row: Sequence[str], is_read: Callable[[str], bool]
) -> tuple[dict[int, str], list[int]]:
    """Names with the units of the line below them, and which columns are kept by these names.

    Raises RecordingError for another unit than that of the name.
    """
    names = {}
    for k, name in section.names.items():
        unit = row[k].strip().strip("[]()").strip()
        own = UNIT_IN_NAME.search(name)
        said = plain_unit(own[1] or own[2].replace("kmh", "km/h")) if own is not None else ""
        if unit and is_unit(said) and said != plain_unit(unit):
            allowed = f"{said}, which the column's name says; units in names or below them, not two"
            raise RecordingError(path, line, name, f"in {unit} by the line below the header", allowed)
        names[k] = name if not unit or is_read(name) else f"{name} ({unit})"
    return names, [k for k, name in names.items() if is_read(name)]


def _without_footer(section: _Section) -> list[Note]:
    """Take sums, means and comments off the end, which have a text where the rows before have a number or time."""
    dropped: list[str] = []
    while len(section.rows) > 2 and len(dropped) < MOST_FOOTERS and section.kept:
        last, before = (section.rows[k][0] for k in (-1, -2))
        if any(letter.isdigit() for letter in last) or not last.strip() or len(section.rows) - 1 < 2:
            break
        if not dropped and not any(letter.isdigit() for letter in "".join(row[0] for row in section.rows[-9:-1])):
            break
        dropped.append(last.strip() or before)
        section.rows.pop()
        section.lines.pop()
    text = f"last rows dropped, which are no samples: {shown(', '.join(reversed(dropped)))}"
    return [Note(NoteKind.IGNORED, "", text)] if dropped else []


def with_decimal_points(table: LogTable) -> LogTable:
    """The table with points for commas in the numbers of those columns that have no point.

    Raises RecordingError where commas, or points beside decimal commas, may set off thousands.
    """
    with_comma = [any("," in str(cell) for cell in cells) for cells in table.columns]
    if not any(with_comma):
        return table
    texts = [[str(cell).strip() for cell in cells] for cells in table.columns]
    commas = [text for column, has in zip(texts, with_comma, strict=True) if has for text in column]
    commas = [text for text in commas if DECIMAL_COMMA.fullmatch(text)]
    points = [[text for text in column if DECIMAL_POINT.fullmatch(text)] for column in texts]
    if not commas:
        return table
    sure = not all(COMMA_THOUSANDS.fullmatch(text) for text in commas)
    if not sure and any(points):
        return table  # each cell is told by its column
    allowed = "decimal points and no commas within numbers, as these may set off thousands or decimals"
    if not sure:
        raise _first_of(table, COMMA_THOUSANDS, allowed)
    doubted = [column for column in points if column and all(POINT_THOUSANDS.fullmatch(text) for text in column)]
    if doubted:
        raise _first_of(table, POINT_THOUSANDS, "no points that may set off thousands beside decimal commas")
    converted = [
        has and not own and not all(COMMA_THOUSANDS.fullmatch(text) for text in column if DECIMAL_COMMA.fullmatch(text))
        for column, own, has in zip(texts, points, with_comma, strict=True)
    ]
    anywhere = any(points)
    columns = tuple(
        [cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell.strip()) else cell for cell in map(str, cells)]
        if change or (has and not anywhere)
        else cells
        for cells, change, has in zip(table.columns, converted, with_comma, strict=True)
    )
    note = Note(NoteKind.READ, "", f"numbers with decimal commas, such as {commas[0]}")
    return LogTable(table.path, table.id, table.names, columns, table.lines, [*table.notes, note])


def _first_of(table: LogTable, pattern: re.Pattern[str], allowed: str) -> RecordingError:
    """An error at the first cell that a pattern fits."""
    row, name, text = next(
        (row, name, str(cell).strip())
        for name, cells in zip(table.names, table.columns, strict=True)
        for row, cell in enumerate(cells)
        if pattern.fullmatch(str(cell).strip())
    )
    return table.error(row, name, shown(text), allowed)


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
    text = _unwrapped(text, is_read)
    lines = list(itertools.islice(io.StringIO(text, newline=""), BEFORE_HEADER))
    given, first, begin, at = "", -1, 0, 0
    for k, line in enumerate(lines):
        separator = SEPARATOR.fullmatch(line.strip("\r\n"))
        if separator is not None:
            given = "\t" if separator[1] == "\\t" else separator[1]
        elif line.strip():
            bare = line.lstrip().lstrip("#%/").lstrip() if line.lstrip().startswith(COMMENTS) else line
            for delimiter in dict.fromkeys((given or _delimiter(bare), _delimiter(bare), " ")):
                names = [name.strip().strip('"') for name in bare.split(delimiter)]
                if sum(is_read(name) for name in names[:MOST_COLUMNS]) > 1:
                    return k, delimiter, bare + text[at + len(line) :]
            if first < 0 and bare is line:
                first, begin = k, at
        at += len(line)
    if first < 0:
        return 0, given or ",", text[at:]
    return first, given or _delimiter(lines[first]), text[begin:]


def _unwrapped(text: str, is_read: Callable[[str], bool]) -> str:
    """The text without quotes round whole lines, as spreadsheets write a table that they did not take apart."""
    first, _, _ = text.partition("\n")
    whole = re.fullmatch(r'"((?:[^"]|"")*)"\s*', first.strip("\ufeff"))
    if whole is None:
        return text
    inner = whole[1].replace('""', '"')
    if sum(is_read(name.strip().strip('"')) for name in inner.split(_delimiter(inner))) < 2:
        return text
    return re.sub(r'(?m)^"(.*)"(\r?)$', lambda match: match[1].replace('""', '"') + match[2], text)


def _delimiter(line: str) -> str:
    """The sign that sets off most cells of a line, quoted names aside."""
    header = re.sub(r'"[^"]*"', "", line)
    return max(DELIMITERS, key=header.count)
