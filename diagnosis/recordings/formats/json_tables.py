"""Tables in JSON: an object a line, an array of objects, or an array a column."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any, Final

from diagnosis.recordings.formats.csv_tables import with_decimal_points
from diagnosis.recordings.formats.tables import LogTable, check_cells, check_columns, check_rows, is_hidden
from diagnosis.recordings.notes import Note, NoteKind, RecordingError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

TRUTHS: Final = {"true": "1", "false": "0"}
EXAMPLE: Final = '{"utc": 1700000000, "speed": 50, "power": 12.5}'
ALLOWED: Final = f"one JSON object a line, such as {EXAMPLE}, or an array of them"
BETWEEN: Final = re.compile(r"(?:[\s,]|(?:#|//)[^\n]*(?:\n|$))*")  # objects that stand one after the other
DEEPEST: Final = 4
MOST_READ_BYTES: Final = 1_500_000_000
READ_BYTES: Final = {"{": 240, "[": 90, ":": 40, ",": 40}  # that each of these takes once it is read; measured
BEGIN: Final = re.compile(r"(?:\s|(?:#|//)[^\n]*\n)*(?:\{|\[\s*[\[{\]])")


def is_json(text: str) -> bool:
    """Whether a text begins as JSON does."""
    return BEGIN.match(text) is not None


def json_table(path: str, trip_id: str, text: str, hidden: Sequence[str], is_read: Callable[[str], bool]) -> LogTable:
    """The table in a text of JSON objects: one a line, an array of them, also within an object, or an array a column.

    An object may be in "tlm"; values within values are left out, but for those with their unit. A name that an object
    does not have is an empty cell. Rows are lines, or in an array entries, from 1. Raises RecordingError where one is
    no object.
    """
    columns: dict[str, list[str]] = {}
    notes: list[Note] = []
    lines: list[int] = []
    kept = 0
    for number, record in _records(path, text, notes):
        check_columns(path, record)
        for name, value in record.items():
            if not isinstance(value, dict | list) and not is_hidden(name, hidden):
                new = name not in columns
                cells = columns.setdefault(name, [])
                if not is_read(name):
                    continue
                kept += new
                cells.extend([""] * (len(lines) - len(cells)))
                cells.append("" if value is None else TRUTHS.get(str(value).lower(), str(value)))
        lines.append(number)
        check_rows(path, len(lines))
        check_columns(path, columns)
        check_cells(path, kept * len(lines))
    if len(lines) < 2:
        raise RecordingError(path, lines[-1] if lines else 1, "the table", f"{len(lines)} rows", "at least 2 samples")
    for name, cells in columns.items():
        cells.extend([""] * ((len(lines) - len(cells)) * is_read(name)))
    return with_decimal_points(LogTable(path, trip_id, tuple(columns), tuple(columns.values()), lines, notes))


def _records(path: str, text: str, notes: list[Note]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Rows by their number: that of the line where a text has an object a line, else by their order."""
    _check_size(path, text)
    whole = _parsed_whole(text)
    if whole is not None:
        found = _rows_in(whole, 0)
        if found is None and isinstance(whole, list):
            found = whole
        for number, record in enumerate([whole] if found is None else found, start=1):
            yield number, _record(path, number, record, str(record))
        return
    if text.lstrip().startswith("["):
        _whole(path, text)  # tells what is broken
    yield from _one_by_one(path, text, notes)


def _check_size(path: str, text: str) -> None:
    """Raises RecordingError for a text that would take too much memory."""
    size = sum(each * text.count(sign) for sign, each in READ_BYTES.items())
    if size > MOST_READ_BYTES:
        found = f"JSON that takes {size / 1e9:.1f} GB once it is read"
        raise RecordingError(path, 1, "the file", found, f"at most {MOST_READ_BYTES / 1e9:g} GB; split it into drives")


def _parsed_whole(text: str) -> Any:
    """What a text of one value is; None for any other, such as an object a line."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _one_by_one(path: str, text: str, notes: list[Note]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Objects one after the other, whatever blank, line or comma stands between; one that is cut off ends them."""
    decoder, at, line, done = json.JSONDecoder(), 0, 1, 0
    while True:
        begin = BETWEEN.match(text, at)
        assert begin is not None, "it matches nothing, too"
        line += text.count("\n", at, begin.end())
        at = begin.end()
        if at >= len(text):
            return
        try:
            found, end = decoder.raw_decode(text, at)
        except (ValueError, RecursionError) as error:
            rest = text[at:].partition("\n")
            if done > 1 and not rest[2].strip() and rest[0].startswith("{"):
                notes.append(Note(NoteKind.REPAIRED, "", f"the last row dropped, which was cut off: row {line}"))
                return
            raise RecordingError(path, line, "the row", shown(rest[0]), ALLOWED) from error
        yield line, _record(path, line, found, text[at:end])
        line += text.count("\n", at, end)
        at, done = end, done + 1


def _whole(path: str, text: str) -> None:
    """Raises RecordingError for an array that is broken."""
    try:
        json.loads(text)
    except (ValueError, RecursionError) as error:
        row = getattr(error, "lineno", 1)
        raise RecordingError(path, row, "the array", f"broken JSON ({error})", ALLOWED) from error


def _rows_in(found: Any, depth: int) -> list[Any] | None:
    """The rows of a table in any of its forms, also within others: objects, arrays with names, arrays a column."""
    if depth > DEEPEST:
        return None
    if isinstance(found, list):
        if found and isinstance(found[0], list):
            names = [str(name) for name in found[0]]
            return [dict(zip(names, row, strict=False)) if isinstance(row, list) else row for row in found[1:]]
        return found if any(isinstance(row, dict) for row in found) or (found and depth == 0) else None
    if not isinstance(found, dict) or isinstance(found.get("tlm"), dict):
        return None
    if found.get("type") == "Feature":
        return [found]
    if _is_of(found.get("columns"), str) and _is_of(found.get("data"), list):
        titles = [str(name) for name in found["columns"]]
        return [dict(zip(titles, row, strict=False)) if isinstance(row, list) else row for row in found["data"]]
    arrays = {str(name): value for name, value in found.items() if isinstance(value, list) and value}
    flat = {name: value for name, value in arrays.items() if not isinstance(value[0], dict | list)}
    if len(flat) > 1 and len({len(value) for value in flat.values()}) == 1:
        return [dict(zip(flat, row, strict=True)) for row in zip(*flat.values(), strict=True)]
    by_index = _by_index(found)
    if by_index is not None:
        return by_index
    inner = [rows for value in found.values() if (rows := _rows_in(value, depth + 1)) is not None]
    return max(inner, key=len, default=None)


def _by_index(found: dict[str, Any]) -> list[Any] | None:
    """Rows of an object of objects, by their numbers or with the numbers within each column."""
    values = list(found.values())
    if len(values) < 2 or not all(isinstance(value, dict) and value for value in values):
        return None
    if all(name.isdigit() for name in found):
        return values
    keys = list(values[0])
    if len(keys) < 2 or not all(key.isdigit() for key in keys) or any(list(value) != keys for value in values):
        return None
    return [{name: column[key] for name, column in found.items()} for key in keys]


def _is_of(found: Any, kind: type) -> bool:
    return isinstance(found, list) and bool(found) and isinstance(found[0], kind)


def _record(path: str, number: int, found: Any, text: str) -> dict[str, Any]:
    if isinstance(found, dict) and isinstance(found.get("tlm"), dict):
        found = found["tlm"]
    if not isinstance(found, dict):
        raise RecordingError(path, number, "the row", shown(text), ALLOWED)
    properties, geometry = found.get("properties"), found.get("geometry")
    if found.get("type") == "Feature" and isinstance(properties, dict) and isinstance(geometry, dict):
        return _feature(path, number, properties, geometry)
    return {name: _with_unit(value) for name, value in found.items()}


def _with_unit(value: Any) -> Any:
    """A value with its unit behind it, where it stands in an object with its unit."""
    if not isinstance(value, dict) or "value" not in value or isinstance(value["value"], dict | list):
        return value
    unit = next((value[name] for name in ("unit", "units", "uom") if isinstance(value.get(name), str)), "")
    return value["value"] if not unit or value["value"] is None else f"{value['value']} {unit}"


def _feature(path: str, number: int, properties: dict[str, Any], geometry: dict[str, Any]) -> dict[str, Any]:
    """A point of GeoJSON as a row: its properties, and its place."""
    places = geometry.get("coordinates")
    if geometry.get("type") != "Point" or not isinstance(places, list) or len(places) < 2:
        found = f"GeoJSON of a {shown(str(geometry.get('type')))}"
        allowed = "points with a time, a speed and a power each; save a line without them as GPX"
        raise RecordingError(path, number, "the row", found, allowed)
    names = {"longitude": places[0], "latitude": places[1]}
    return {**names, **({"elevation": places[2]} if len(places) > 2 else {}), **properties}
