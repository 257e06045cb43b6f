"""A station as OpenStreetMap's tags tell it, in whatever file they stand."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from routing.stations.formats.gathering import POWERS_PASSED, clean
from routing.stations.formats.osm.numbers import count_of, outputs_w
from routing.stations.formats.osm.tags import (
    MOST_SOCKETS,
    POINT_TAG,
    STATION_TAG,
    LeftOut,
    access_of,
    capacity_of,
    charge_of,
    fee_of,
    operational_of,
    reason_to_leave_out,
    socket_kind,
    sockets_of,
)
from routing.stations.notes import LeftOutError, shown
from routing.stations.station import Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Mapping

    from routing.places import Point
    from routing.stations.formats.gathering import Gathering

OSM_KEY: Final = "osm"
SOCKET: Final = re.compile(r"socket:([A-Za-z0-9_-]+)")
MOST_HOURS: Final = 255  # letters, the limit of a value there
_NO_NUMBERS: Final = frozenset(("fixme", "?", "unknown"))
_ALLOWED: Final = {LeftOut.NOT_FOR_CARS: "what cars can charge at", LeftOut.NOT_IN_USE: "a station that is there"}


def osm_source(retrieved: str) -> StationSource:
    """OpenStreetMap as a source; retrieved: the day of the data, or empty."""
    name, about = "© OpenStreetMap contributors", "https://www.openstreetmap.org/copyright"
    return StationSource(OSM_KEY, name, "ODbL-1.0", about, retrieved)


def is_charge_point(tags: Mapping[str, str]) -> bool:
    """Whether tags are those of one charge point of a station."""
    key, value = POINT_TAG
    return tags.get(key) == value and tags.get(STATION_TAG[0]) != STATION_TAG[1]


def osm_station(tags: Mapping[str, str], at: Point, osm_id: str, gathering: Gathering) -> Station:
    """The station of tags, with notes on what is not understood; osm_id: as n123.

    One without a socket that is known is kept. Raises LeftOutError for what no car can charge at.
    """
    reason = reason_to_leave_out(tags)
    if reason is not None:
        why, key = reason
        raise LeftOutError(why.value, key, shown(tags.get(key, "missing")), _ALLOWED[why])
    _note_sockets(tags, gathering)
    number = clean(tags.get("ref", ""))
    return Station(
        id=f"{OSM_KEY}:{osm_id}",
        at=at,
        sockets=sockets_of(tags, at),
        name=clean(tags.get("name", "")) or ("" if number.casefold() in _NO_NUMBERS else number),
        operator=clean(tags.get("operator", "")),
        network=clean(tags.get("network", "")) or clean(tags.get("brand", "")),
        capacity=capacity_of(tags),
        access=access_of(tags),
        fee=fee_of(tags),
        price=charge_of(tags),
        opening_hours=clean(tags.get("opening_hours", ""), MOST_HOURS) or None,
        operational=operational_of(tags),
        source=OSM_KEY,
    )


def _note_sockets(tags: Mapping[str, str], gathering: Gathering) -> None:
    """Notes on what tags such as socket:type2=2 and socket:type2:output=22 kW say that is not understood."""
    for key, value in tags.items():
        if SOCKET.fullmatch(key) is None or count_of(value) == 0:
            continue
        if socket_kind(key) is None:
            gathering.unknown_plug(key)
            continue
        output = tags.get(f"{key}:output", "")
        if output and not outputs_w(output):
            gathering.note(POWERS_PASSED, value=f"{key}:output={output}")
        count = count_of(value)
        if count is not None and count > MOST_SOCKETS:
            gathering.note(f"counts of sockets above {MOST_SOCKETS}, not believed", value=f"{key}={value}")
        if count is None and value.strip().casefold() != "unknown":
            gathering.note("counts of sockets that are no number, taken as 1", value=f"{key}={value}")
