"""Stations as a reader finds them one by one, and what it leaves out."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from statistics import median
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from routing.places import Point, place_text, swapped_question
from routing.stations.formats.plugs import joined
from routing.stations.notes import LeftOutError, StationFileError, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from routing.stations.station import Socket, Station, StationSource

LEAST_NEIGHBOURS: Final = 3  # beside which a place can be told to be swapped; assumed
FAR_DEG: Final = 12.0  # from the middle of all; a country's extent, assumed
FAR_FRAC: Final = 0.34  # of stations that may be far for the file to be of one country
MOST_STATIONS: Final = 300_000
MOST_EXAMPLES: Final = 3
MOST_NAMES: Final = 200  # of unknown plugs that are told apart
MOST_TEXT: Final = 160  # letters of names
MOST_KEY: Final = 40  # letters of a file's name in ids
NO_WORD: Final = re.compile(r"[^a-z0-9]+")
OTHERS: Final = "others"
POWERS_PASSED: Final = "powers that are no number or not 0.5..4000 kW, taken as not known"
DAY: Final = re.compile(r"[12]\d{3}-[01]\d-[0-3]\d", re.ASCII)


@dataclass(frozen=True, slots=True)
class ReadStations:
    """What a file of stations holds: those that are read, and what is left out.

    stations: not on roads yet. format: its name. left_out: how many of its stations by reason; examples: the first few
    messages of each. parts: how many of its entries are parts of stations that others tell. unknown_plugs: how many
    plugs by names that are unknown. notes: how values were read, as sentences. All entries are stations, parts or left
    out.
    """

    stations: tuple[Station, ...]
    source: StationSource
    left_out: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()
    format: str = ""
    examples: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))
    unknown_plugs: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    parts: int = 0


@dataclass(slots=True)
class Gathering:
    """What is read of a file so far.

    left_out, examples: stations that were left out by reason, and the first few messages of each. unknown_plugs: names
    of plugs that no vehicle's is known for. noted: remarks on what was read in which way, and how often; first_noted:
    where first, and of which value. parts: entries that are parts of a station that another one tells.
    """

    path: str
    unit: str  # what its stations are: row, entry
    stations: dict[str, Station] = field(default_factory=dict)
    left_out: Counter[str] = field(default_factory=Counter)
    examples: dict[str, list[str]] = field(default_factory=dict)
    unknown_plugs: Counter[str] = field(default_factory=Counter)
    noted: Counter[str] = field(default_factory=Counter)
    first_noted: dict[str, str] = field(default_factory=dict)
    parts: int = 0
    number: int | str = ""  # of the row or entry that is read; a text is the station's id
    _numbers: dict[str, int] = field(default_factory=dict)

    @property
    def own_key(self) -> str:
        """The key of a file that is a source of its own: by its name, so that another file is another source."""
        name = NO_WORD.sub("-", PurePath(self.path).name.lower().split(".")[0]).strip("-")[:MOST_KEY].rstrip("-")
        return f"file-{name}" if name else "file"

    def rekey(self, key: str) -> None:
        """Name another source of all stations."""
        self.stations = {own_id: replace(station, source=key) for own_id, station in self.stations.items()}

    def add(self, station: Station) -> None:
        """Take a station; raises LeftOutError where its id is there already, StationFileError beyond MOST_STATIONS."""
        if station.id in self.stations:
            raise LeftOutError("id that is there already", "id", shown(station.id), "one a station")
        if len(self.stations) >= MOST_STATIONS:
            found, allowed = f"more than {MOST_STATIONS} stations", f"at most {MOST_STATIONS}"
            raise StationFileError(self.path, "", "the file", found, allowed)
        self.stations[station.id] = station

    def leave_out(self, number: int | str, error: LeftOutError) -> None:
        """Count what is left out, and keep its message where it is among the first of its reason.

        number: of its row or entry; a text is the station's id.
        """
        self.left_out[error.reason] += 1
        if self.left_out[error.reason] <= MOST_EXAMPLES:
            self.examples.setdefault(error.reason, []).append(f"{self._where(number)}: {error}")

    def unite_parts(self, stations: dict[str, Station]) -> None:
        """Keep the stations that others are parts of."""
        self.parts += len(self.stations) - len(stations)
        self.stations = stations

    def _where(self, number: int | str) -> str:
        return f"station {number}" if isinstance(number, str) else f"{self.unit} {number}"

    def note(self, text: str, times: int = 1, value: object = None) -> None:
        """Remark on how something was read; value: that which was not taken as it is."""
        if value is not None and text not in self.noted:
            self.first_noted[text] = f"{self._where(self.number)}: {shown(value)}"
        self.noted[text] += times

    def unknown_plug(self, name: object, times: int = 1) -> None:
        """Count a plug of a name that is unknown."""
        text = shown(name).strip() or "no name"
        if text not in self.unknown_plugs and len(self.unknown_plugs) >= MOST_NAMES:
            text = OTHERS
        self.unknown_plugs[text] += times

    def leave_out_swapped(self) -> None:
        """Leave out stations that are far from nearly all others, where they would be with their degrees swapped."""
        if len(self.stations) < LEAST_NEIGHBOURS:
            return
        middle = Point(
            median(station.at.lat_deg for station in self.stations.values()),
            median(station.at.lon_deg for station in self.stations.values()),
        )
        far = [station for station in self.stations.values() if _apart_deg(station.at, middle) > FAR_DEG]
        if len(far) > FAR_FRAC * len(self.stations):
            return
        for station in far:
            at = station.at
            if _apart_deg(Point(at.lon_deg, at.lat_deg), middle) <= FAR_DEG / 2.0:
                del self.stations[station.id]
                where, hint = place_text(at.lat_deg, at.lon_deg), swapped_question(at.lat_deg, at.lon_deg)
                allowed = f"near the others around {place_text(round(middle.lat_deg, 1), round(middle.lon_deg, 1))}"
                error = LeftOutError("latitude and longitude swapped", "place", where, allowed, hint)
                self.leave_out(station.id, error)

    def result(self, name: str, source: StationSource) -> ReadStations:
        """All that was read; name: of the format."""
        return ReadStations(
            tuple(self.stations.values()),
            source,
            MappingProxyType(dict(self.left_out.most_common())),
            tuple(
                f"{text}: {times}" + (f", first {self.first_noted[text]}" if text in self.first_noted else "")
                for text, times in self.noted.items()
            ),
            name,
            MappingProxyType({reason: tuple(texts) for reason, texts in self.examples.items()}),
            MappingProxyType(dict(self.unknown_plugs.most_common())),
            self.parts,
        )

    def free_id(self, wanted: str) -> str:
        """An id that no station has yet: the wanted one, or with the first number behind it that makes it so."""
        if wanted not in self.stations:
            return wanted
        number = self._numbers.get(wanted, 1) + 1
        while f"{wanted}#{number}" in self.stations:
            number += 1
        self._numbers[wanted] = number
        return f"{wanted}#{number}"


def _apart_deg(at: Point, other: Point) -> float:
    return max(abs(at.lat_deg - other.lat_deg), abs(at.lon_deg - other.lon_deg))


def with_sockets(sockets: Iterable[Socket], names: Mapping[str, int] | None = None) -> tuple[Socket, ...]:
    """Sockets of a station by kind; raises LeftOutError where there are none. names: of plugs that are unknown."""
    found = joined(sockets)
    if found:
        return found
    unknown = shown(", ".join(names)) if names else "none"
    reason = "no plug that is known" if names else "no plug given"
    raise LeftOutError(reason, "plugs", unknown, "at least one that vehicles have")


def day_in(value: object) -> str:
    """The day that a time begins with, as YYYY-MM-DD; "" where it does not."""
    text = value[:10] if isinstance(value, str) else ""
    return text if DAY.fullmatch(text) else ""


def clean(value: object, most: int = MOST_TEXT) -> str:
    """A name as it is kept: printable, blanks as one, of limited length; "" for what is no text or number."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return ""
    text = value[: 4 * most] if isinstance(value, str) else str(value)
    if not text.isprintable():
        text = "".join(letter if letter.isprintable() else " " for letter in text)
    return " ".join(text.split())[:most].rstrip()
