"""Stations of OpenStreetMap's tags in files of other formats."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from routing.stations.formats.gathering import Gathering, clean, with_sockets
from routing.stations.formats.osm.numbers import count_of, outputs_w
from routing.stations.formats.osm.tags import (
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
from routing.stations.notes import LeftOutError
from routing.stations.station import Station

if TYPE_CHECKING:
    from collections.abc import Mapping

    from routing.places import Point
    from routing.stations.station import Socket

SOCKET: Final = re.compile(r"socket:([A-Za-z0-9_-]+)")
MOST_HOURS: Final = 255  # letters, the limit of a value there


def is_charging(tags: Mapping[str, str]) -> bool:
    """Whether tags are those of a charging station or of one of its points."""
    return any(tags.get(key) == value for key, value in (STATION_TAG, POINT_TAG))


def osm_station(tags: Mapping[str, str], at: Point, osm_id: str, gathering: Gathering) -> Station:
    """The station of tags; osm_id: as n123. Raises LeftOutError."""
    asked = tags if is_charging(tags) else {**tags, STATION_TAG[0]: STATION_TAG[1]}
    reason = reason_to_leave_out(asked)
    if reason is LeftOut.NOT_FOR_CARS:
        raise LeftOutError("not for cars", "motorcar", tags.get("motorcar", "missing"), "yes, or plugs of cars")
    if reason is LeftOut.NOT_IN_USE:
        raise LeftOutError("removed", "disused", "yes", "a station that is there")
    return Station(
        id=f"osm:{osm_id}",
        at=at,
        sockets=_sockets(tags, at, gathering),
        name=clean(tags.get("name", "")),
        operator=clean(tags.get("operator", "") or tags.get("brand", "")),
        network=clean(tags.get("network", "") or tags.get("brand", "")),
        capacity=capacity_of(tags),
        access=access_of(tags),
        fee=fee_of(tags),
        price=charge_of(tags),
        opening_hours=clean(tags.get("opening_hours", ""), MOST_HOURS) or None,
        operational=operational_of(tags),
        source="osm",
    )


def _sockets(tags: Mapping[str, str], at: Point, gathering: Gathering) -> tuple[Socket, ...]:
    """Sockets of tags such as socket:type2=2 and socket:type2:output=22 kW, with notes on what is not understood."""
    unknown: dict[str, int] = {}
    for key, value in tags.items():
        if SOCKET.fullmatch(key) is None or count_of(value) == 0:
            continue
        if socket_kind(key) is None:
            gathering.unknown_plug(key)
            unknown[key] = 1
            continue
        output = tags.get(f"{key}:output", "")
        if output and not outputs_w(output):
            gathering.note("powers that are no number or out of range")
        if count_of(value) is None and value.strip().casefold() != "unknown":
            gathering.note("counts of sockets that are no number, taken as 1")
    return with_sockets(sockets_of(tags, at), unknown)
