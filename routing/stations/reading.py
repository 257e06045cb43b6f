"""Charging stations read from the files that registers and networks publish."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final, Protocol

from routing.stations.formats import alternative_fuels, bundesnetzagentur, geojson, ocpi, open_charge_map, plain
from routing.stations.formats.contents import text_of
from routing.stations.formats.entries import Entries, is_json
from routing.stations.formats.gathering import Gathering, ReadStations
from routing.stations.formats.tables import Table, first_line, table_of
from routing.stations.notes import StationFileError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from routing.stations.station import StationSource

__all__ = ["ReadStations", "StationFileError", "read_stations"]

PEEKED: Final = 50  # entries in which a format is looked for


class TableFormat(Protocol):
    """A format in CSV: which headers are its, and how its rows are read."""

    NAME: str

    def recognises(self, names: frozenset[str]) -> bool:
        """Whether a header with these folded names is of this format."""

    def read(self, table: Table, gathering: Gathering, retrieved: str) -> StationSource:
        """Gather the stations of the table; where they are from."""


class EntryFormat(Protocol):
    """A format in JSON: which entries are its, and how they are read."""

    NAME: str

    def recognises(self, entry: Mapping[str, Any]) -> bool:
        """Whether an object is an entry of this format."""

    def read(
        self, entries: Iterator[tuple[int, Any]], members: Mapping[str, Any], gathering: Gathering, retrieved: str
    ) -> StationSource:
        """Gather the stations of the entries; where they are from."""


# A further format is one more module here; the first that recognises a file reads it.
TABLES: Final[tuple[TableFormat, ...]] = (bundesnetzagentur, alternative_fuels.CSV, plain)
ENTRIES: Final[tuple[EntryFormat, ...]] = (open_charge_map, ocpi, geojson, alternative_fuels.JSON)


def read_stations(path: Path) -> ReadStations:
    """The charging stations in a file, plain or gzip, of any known format, told by what is in it.

    A station that can't be read is left out and counted, the others are read. Raises StationFileError naming file,
    place in it, field, value and what is allowed, also where no station is left; OSError where it can't be opened.
    """
    try:
        text = text_of(path)
        retrieved = datetime.fromtimestamp(path.stat().st_mtime, UTC).date().isoformat()
        return _of_json(str(path), text, retrieved) if is_json(text) else _of_table(str(path), text, retrieved)
    except MemoryError:
        pass  # its frames hold what was read: they go before anything else is made
    allowed = "less than the memory that is left; only the region that is planned in"
    raise StationFileError(str(path), "", "the file", "too large once it is read", allowed)


def _of_table(path: str, text: str, retrieved: str) -> ReadStations:
    for form in TABLES:
        table = table_of(path, text, form.recognises)
        if table is not None:
            gathering = Gathering(path, "row")
            return _result(form.NAME, gathering, form.read(table, gathering, retrieved))
    if text.lstrip().startswith("<"):
        raise StationFileError(path, "", "the file", f"XML or HTML ({first_line(text)})", _allowed())
    raise StationFileError(path, "line 1", "the header", first_line(text) or "empty", _allowed())


def _of_json(path: str, text: str, retrieved: str) -> ReadStations:
    entries = Entries(path, text)
    numbered = enumerate(entries, start=1)
    peeked: list[tuple[int, Any]] = []
    for number, entry in numbered:
        peeked.append((number, entry))
        form = next((form for form in ENTRIES if isinstance(entry, dict) and form.recognises(entry)), None)
        if form is not None:
            gathering = Gathering(path, "entry")
            rest = _chained(peeked, numbered)
            return _result(form.NAME, gathering, form.read(rest, entries.members, gathering, retrieved))
        if len(peeked) >= PEEKED:
            break
    first = peeked[0][1] if peeked else None
    found = "empty" if first is None else f"JSON whose first entry has {_names_of(first)}"
    raise StationFileError(path, "", "the file", found, _allowed())


def _chained(peeked: list[tuple[int, Any]], rest: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
    while peeked:
        yield peeked.pop(0)
    yield from rest


def _names_of(entry: object) -> str:
    return ", ".join(str(name)[:30] for name in list(entry)[:6]) if isinstance(entry, dict) and entry else "no members"


def _allowed() -> str:
    return (
        f"a format of charging stations: {', '.join([form.NAME for form in ENTRIES] + [form.NAME for form in TABLES])}"
    )


def _result(name: str, gathering: Gathering, source: StationSource) -> ReadStations:
    gathering.leave_out_swapped()
    if not gathering.stations:
        raise _nothing(gathering)
    return gathering.result(name, source)


def _nothing(gathering: Gathering) -> StationFileError:
    """The refusal of a file without a station that can be read, which quotes the most frequent reason."""
    if not gathering.left_out:
        return StationFileError(gathering.path, "", "the file", "without stations", "at least one")
    reason, count = gathering.left_out.most_common(1)[0]
    left_out = gathering.left_out.total()
    found = f"without a station that can be read: {reason} {count} of {left_out}, first {gathering.examples[reason][0]}"
    return StationFileError(gathering.path, "", "the file", found, "at least one station")
