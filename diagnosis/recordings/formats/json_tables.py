"""Tables in JSON: an object a line, an array of objects, or an array a column."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any, Final

from diagnosis.recordings.formats.tables import LogTable, check_columns, check_rows, is_hidden
from diagnosis.recordings.notes import RecordingError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

TRUTHS: Final = {"true": "1", "false": "0"}
EXAMPLE: Final = '{"utc": 1700000000, "speed": 50, "power": 12.5}'
ALLOWED: Final = f"one JSON object a line, such as {EXAMPLE}, or an array of them"
BEGIN: Final = re.compile(r"\s*(?:\{|\[\s*[\[{\]])")


def is_json(text: str) -> bool:
    """Whether a text begins as JSON does."""
    return BEGIN.match(text) is not None


def json_table(path: str, trip_id: str, text: str, hidden: Sequence[str], is_read: Callable[[str], bool]) -> LogTable:
    """The table in a text of JSON objects: one a line, an array of them, also within an object, or an array a column.

    An object may be in "tlm"; values within values are left out. A name that an object does not have is an empty cell.
    Rows are lines, or in an array entries, from 1. Raises RecordingError where one is no object.
    """
    columns: dict[str, list[str]] = {}
    lines: list[int] = []
    for number, record in _records(path, text):
        for name, value in record.items():
            if not isinstance(value, dict | list) and not is_hidden(name, hidden):
                cells = columns.setdefault(name, [])
                if not is_read(name):
                    continue
                cells.extend([""] * (len(lines) - len(cells)))
                cells.append("" if value is None else TRUTHS.get(str(value).lower(), str(value)))
        lines.append(number)
        check_rows(path, len(lines))
        check_columns(path, list(columns))
    if len(lines) < 2:
        raise RecordingError(path, lines[-1] if lines else 1, "the table", f"{len(lines)} rows", "at least 2 samples")
    for name, cells in columns.items():
        cells.extend([""] * ((len(lines) - len(cells)) * is_read(name)))
    return LogTable(path, trip_id, tuple(columns), tuple(columns.values()), lines)


def _records(path: str, text: str) -> Iterator[tuple[int, dict[str, Any]]]:
    if text.lstrip().startswith("["):
        found: Any = _whole(path, text)
    else:
        first, _, rest = text.strip().partition("\n")
        found = None if _is_object(first) and rest else _wrapped(text)
    if found is None:
        for number, line in enumerate(text.splitlines(), start=1):
            if line.strip():
                yield number, _record(path, number, _parsed(path, number, line), line)
        return
    for number, record in enumerate(found, start=1):
        yield number, _record(path, number, record, str(record))


def _whole(path: str, text: str) -> list[Any]:
    """The array that a text is; an array of arrays has the names first."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        row = getattr(error, "lineno", 1)
        raise RecordingError(path, row, "the array", f"broken JSON ({error})", ALLOWED) from error
    assert isinstance(found, list), "what begins as an array and is JSON is one"
    if found and isinstance(found[0], list):
        names = [str(name) for name in found[0]]
        return [dict(zip(names, row, strict=False)) if isinstance(row, list) else row for row in found[1:]]
    return found


def _wrapped(text: str) -> list[Any] | None:
    """Objects of an array within one object, or the rows of an object of arrays; None where a text is neither."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    arrays = {str(name): value for name, value in found.items() if isinstance(value, list) and value}
    objects = [value for value in arrays.values() if isinstance(value[0], dict)]
    if len(objects) == 1:
        return objects[0]
    flat = {name: value for name, value in arrays.items() if not isinstance(value[0], dict | list)}
    if len(flat) < 2 or len({len(value) for value in flat.values()}) > 1:
        return None
    return [dict(zip(flat, row, strict=True)) for row in zip(*flat.values(), strict=True)]


def _is_object(line: str) -> bool:
    try:
        return isinstance(json.loads(line), dict)
    except (ValueError, RecursionError):
        return False


def _parsed(path: str, number: int, line: str) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError) as error:
        raise RecordingError(path, number, "the row", shown(line), ALLOWED) from error


def _record(path: str, number: int, found: Any, text: str) -> dict[str, Any]:
    if isinstance(found, dict) and isinstance(found.get("tlm"), dict):
        found = found["tlm"]
    if not isinstance(found, dict):
        raise RecordingError(path, number, "the row", shown(text), ALLOWED)
    return found
