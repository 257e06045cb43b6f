"""Requests in files: bodies of POST /route, one a row of a CSV file or a line of JSON; places in a CSV file."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from app.errors.raised import CommandError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

ID: Final = "id"
NAMES: Final = "alternatives"  # a list of names, for which commas are enough in CSV
JSON_LINES: Final = (".jsonl", ".ndjson")


@dataclass(frozen=True, slots=True)
class RequestRow:
    """One row of a file of requests, counted from 1 without the header.

    body: as sent to POST /route, or None where the row can't be read; fault: why.
    """

    number: int
    id: str | None
    body: dict[str, Any] | None
    fault: str = ""


def request_rows(path: Path) -> Iterator[RequestRow]:
    """The requests in a file, read while they are asked for.

    In CSV a column is a field of the request, parts of an object by dots, as `start.lat` or `conditions.ambient_c`. A
    cell is a JSON value, or else text (`alternatives`: names with commas); an empty one is not sent. The column or
    field `id` comes back with the answer.
    Raises CommandError where the file as a whole can't be read, OSError where it can't be opened.
    """
    if path.suffix.lower() in JSON_LINES:
        return _json_rows(path)
    if path.suffix.lower() == ".csv":
        return _csv_rows(path)
    raise CommandError(f"{path} is of an unknown kind, allowed: .csv, {', '.join(JSON_LINES)}")


def _json_rows(path: Path) -> Iterator[RequestRow]:
    number = 0
    with path.open("rb") as lines:
        for line in lines:
            if not line.strip():
                continue
            number += 1
            try:
                body = json.loads(line.decode("utf-8-sig"))
            except (ValueError, RecursionError) as error:
                yield RequestRow(number, None, None, f"not valid JSON: {error}")
                continue
            if not isinstance(body, dict):
                yield RequestRow(number, None, None, "not valid JSON: it must be an object")
                continue
            yield _named_row(number, body.pop(ID, None), body)


def _named_row(number: int, row_id: object, body: dict[str, Any]) -> RequestRow:
    """A row by its id: a text, or the JSON of what is none."""
    text = None if row_id is None else row_id if isinstance(row_id, str) else json.dumps(row_id)
    try:
        (text or "").encode("utf-8")
    except UnicodeEncodeError:  # half of a surrogate pair, which no file of results could hold
        return RequestRow(number, None, None, "its id is not valid Unicode")
    return RequestRow(number, text, body)


def _csv_rows(path: Path) -> Iterator[RequestRow]:
    for number, cells in enumerate(_table(path), 1):
        if None in cells:
            yield RequestRow(number, None, None, "it has more cells than the header")
            continue
        body: dict[str, Any] = {}
        row_id = cells.pop(ID, "")
        for name, text in cells.items():
            if text and text.strip():
                _put(body, name.split("."), _value(name, text.strip()))
        yield RequestRow(number, row_id or None, body)


def _table(path: Path) -> Iterator[dict[str, str]]:
    """The rows of a CSV file by column."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        reader = csv.DictReader(file)
        try:
            columns = [name.strip() for name in reader.fieldnames or []]
            _check_columns(path, columns)
            reader.fieldnames = columns
            yield from reader
        except UnicodeDecodeError as error:
            raise CommandError(f"{path} is not UTF-8 at byte {error.start}") from error
        except csv.Error as error:
            raise CommandError(f"{path} is not valid CSV at line {reader.line_num}: {error}") from error


def _check_columns(path: Path, columns: list[str]) -> None:
    if not columns:
        raise CommandError(f"{path} is empty, allowed: a header and rows")
    for k, name in enumerate(columns):
        if name in columns[:k]:
            raise CommandError(f"{path} has two columns {name!r}, allowed: each once")
        if not all(name.split(".")):
            raise CommandError(f"{path} has a column {name!r}, allowed: names of fields, parts of an object by dots")
        parents = [other for other in columns if name.startswith(f"{other}.")]
        if parents:
            raise CommandError(
                f"{path} has columns {parents[0]!r} and {name!r}, allowed: either the whole or its parts"
            )


def _put(body: dict[str, Any], path: list[str], value: object) -> None:
    for part in path[:-1]:
        body = body.setdefault(part, {})
    body[path[-1]] = value


def _value(name: str, text: str) -> object:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text.split(",") if name == NAMES else text


@dataclass(frozen=True, slots=True)
class NamedPlace:
    """A place of a file, by its id or else its row."""

    id: str
    lat_deg: float
    lon_deg: float


def named_places(path: Path) -> list[NamedPlace]:
    """The places in a CSV file with the columns lat and lon [deg], and id if it has one; others are left out.

    Raises CommandError with row and value where one is not a number, OSError where the file can't be read.
    """
    places = []
    for number, cells in enumerate(_table(path), 1):
        if None in cells:
            raise CommandError(f"{path}, row {number} has more cells than the header")
        for name in ("lat", "lon"):
            if name not in cells:
                raise CommandError(f"{path} has no column {name!r}, required: lat, lon")
        lat_deg, lon_deg = (_degrees(path, number, name, cells[name]) for name in ("lat", "lon"))
        places.append(NamedPlace(cells.get(ID) or str(number), lat_deg, lon_deg))
    if not places:
        raise CommandError(f"{path} has no places, allowed: at least one row")
    return places


def _degrees(path: Path, number: int, name: str, text: str | None) -> float:
    try:
        return float(text or "")
    except ValueError:
        raise CommandError(f"{path}, row {number}: {name} is {text!r}, allowed: degrees") from None
