"""Rows of a CSV file by the names of its header, whatever sets off its cells and stands before the header."""

from __future__ import annotations

import csv
import itertools
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from routing.stations.notes import StationFileError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

DELIMITERS: Final = (",", ";", "\t", "|")
BEFORE_HEADER: Final = 40  # lines; the German register has ten
MOST_ROWS: Final = 1_000_000
MOST_COLUMNS: Final = 400
MOST_SIGNS: Final = 4 * MOST_COLUMNS  # that set off cells of a header, with those in quotes
MOST_ROW_LINES: Final = 50  # of cells in quotes; more are a quote that was never closed, assumed
MOST_LINE: Final = 200_000  # letters


@dataclass(frozen=True, slots=True)
class Table:
    """Names of the header's columns, folded by `folded`, and what is below it, by row numbers of the file."""

    path: str
    names: tuple[str, ...]
    delimiter: str
    before: tuple[str, ...]  # lines before the header
    text: str
    begin: int  # of the header in the text

    def column(self, *names: str) -> int | None:
        """The place of the first column that has one of these names; None where there is none."""
        return next((self.names.index(name) for name in map(folded, names) if name in self.names), None)

    def rows(self) -> Iterator[tuple[int, Sequence[str]]]:
        """Rows with their number, 1 is the file's first line, with as many cells as the header or empty ones behind.

        Raises StationFileError for quotes that are never closed, and for too many rows.
        """
        reader = csv.reader(_lines(self.path, self.text, self.begin), delimiter=self.delimiter)
        first = len(self.before)
        columns = len(self.names)
        count = 0
        try:
            next(reader, None)
            begin = reader.line_num
            for row in reader:
                lines, begin = reader.line_num - begin, reader.line_num
                if lines > MOST_ROW_LINES:
                    where = f"row {begin - lines + 1 + first}"
                    found, allowed = f"{lines} lines long", f"at most {MOST_ROW_LINES}; quotes that are closed"
                    raise StationFileError(self.path, where, "the row", found, allowed)
                if not row or not any(row):
                    continue
                if lines > 1 and len(row) < columns and "\n" in row[-1]:  # it has taken the rows behind it
                    where, found = f"row {begin - lines + 1 + first}", f"{lines} lines long with {len(row)} cells"
                    raise StationFileError(
                        self.path, where, "the row", found, f"{columns} cells; quotes that are closed"
                    )
                count += 1
                if count > MOST_ROWS:
                    found, allowed = f"more than {MOST_ROWS} rows", f"at most {MOST_ROWS}"
                    raise StationFileError(self.path, "", "the file", found, allowed)
                if len(row) < columns:
                    row += [""] * (columns - len(row))
                yield reader.line_num + first, row
        except csv.Error as error:
            where = f"row {reader.line_num + first}"
            allowed = f"quotes that are closed, cells of at most {csv.field_size_limit()} letters"
            raise StationFileError(self.path, where, "the row", str(error), allowed) from error


def folded(name: str) -> str:
    """A column's name without letter case, blanks and signs, so that "Power (kW)" and "power_kw" are the same."""
    return re.sub(r"[\W_]+", "", name.casefold())


def table_of(path: str, text: str, recognises: Callable[[frozenset[str]], bool]) -> Table | None:
    """The table of a text with a header that is recognised by its folded names; None where no line is one.

    The header is the first such of 40 lines.
    """
    at = 0
    before: list[str] = []
    for line in itertools.islice(_lines(path, text, 0), BEFORE_HEADER):
        for delimiter in _delimiters(line):
            names = _names(line, delimiter)
            if len(names) <= MOST_COLUMNS and recognises(frozenset(names)):
                return Table(path, names, delimiter, tuple(before), text, at)
        before.append(shown(line.strip()))
        at += len(line)
    return None


def first_line(text: str) -> str:
    """The first line that is not empty, as an error quotes it."""
    return shown(next((line for line in text[:2000].splitlines() if line.strip()), ""))


def _names(line: str, delimiter: str) -> tuple[str, ...]:
    if line.count(delimiter) > MOST_SIGNS:
        return ()
    try:
        return tuple(folded(name) for name in next(csv.reader([line.strip("\r\n")], delimiter=delimiter), []))
    except csv.Error:
        return ()


def _delimiters(line: str) -> Sequence[str]:
    """Signs that may set off the cells of a line, the most frequent first."""
    bare = re.sub(r'"[^"]{0,1000}"', "", line[:MOST_LINE])
    return sorted((sign for sign in DELIMITERS if sign in bare), key=bare.count, reverse=True)


def _lines(path: str, text: str, at: int) -> Iterator[str]:
    """Lines of a text from a place on, with their ends; StationFileError for a very long one."""
    end_sign = "\n" if "\n" in text[:MOST_LINE] or "\r" not in text[:MOST_LINE] else "\r"
    while at < len(text):
        end = text.find(end_sign, at, at + MOST_LINE) + 1
        if not end:
            if len(text) - at >= MOST_LINE:
                where, found = f"line {text.count(end_sign, 0, at) + 1}", f"more than {MOST_LINE} letters long"
                raise StationFileError(path, where, "the line", found, f"at most {MOST_LINE} letters")
            end = len(text)
        yield text[at:end] if end_sign == "\n" else text[at : end - 1] + "\n"
        at = end
