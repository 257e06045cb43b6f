"""Tags of OpenStreetMap on charging stations, as sockets and words."""

from __future__ import annotations

import re
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from energy.charging.charging import Connector
from routing.stations.formats.gathering import Gathering, clean, with_sockets
from routing.stations.formats.numbers import count_of, power_w_of
from routing.stations.formats.plugs import connector_of, socket_of
from routing.stations.formats.prices import price_of
from routing.stations.notes import LeftOutError
from routing.stations.station import Access, Socket, Station

if TYPE_CHECKING:
    from collections.abc import Mapping

    from routing.places import Point

SOCKET: Final = re.compile(r"socket:([a-z0-9_]+)")
POWERS_APART: Final = re.compile(r"\s*[;|]\s*")
ACCESS: Final = MappingProxyType(
    {
        **dict.fromkeys(("yes", "public", "permissive", "designated"), Access.PUBLIC),
        **dict.fromkeys(("customers", "destination", "hotel"), Access.CUSTOMERS),
        **dict.fromkeys(("permit", "employees", "members", "residents", "delivery"), Access.RESTRICTED),
        **dict.fromkeys(("private", "no"), Access.PRIVATE),
    }
)
NOT_THERE: Final = frozenset(("no", "0", "none"))
WITHOUT_NUMBER: Final = frozenset(("yes", "unknown"))
TRUTHS: Final = MappingProxyType({"yes": True, "no": False})
MOST_HOURS: Final = 255  # letters, the limit of a value there


def is_charging(tags: Mapping[str, str]) -> bool:
    """Whether tags are those of a charging station or of one of its points."""
    return tags.get("amenity") == "charging_station" or tags.get("man_made") == "charge_point"


def osm_station(tags: Mapping[str, str], at: Point, osm_id: str, gathering: Gathering) -> Station:
    """The station of tags; osm_id: as n123. Raises LeftOutError."""
    if tags.get("motorcar") == "no" or tags.get("motor_vehicle") == "no":
        raise LeftOutError("not for cars", "motorcar", "no", "yes, or no such tag")
    if tags.get("disused") == "yes" or tags.get("abandoned") == "yes" or tags.get("demolished") == "yes":
        raise LeftOutError("removed", "disused", "yes", "a station that is there")
    price, is_fee = price_of(clean(tags.get("charge", ""), 300), tags.get("addr:country", ""))
    said_fee = TRUTHS.get(tags.get("fee", ""))
    return Station(
        id=f"osm:{osm_id}",
        at=at,
        sockets=_sockets(tags, at, gathering),
        name=clean(tags.get("name", "")),
        operator=clean(tags.get("operator", "") or tags.get("brand", "")),
        network=clean(tags.get("network", "") or tags.get("brand", "")),
        capacity=count_of(tags.get("capacity")),
        access=ACCESS.get(tags.get("access", ""), Access.UNKNOWN),
        fee=is_fee if said_fee is None else said_fee,
        price=price,
        opening_hours=clean(tags.get("opening_hours", ""), MOST_HOURS) or None,
        operational=False if tags.get("operational_status") in ("closed", "broken", "out_of_order") else None,
        source="osm",
    )


def _sockets(tags: Mapping[str, str], at: Point, gathering: Gathering) -> tuple[Socket, ...]:
    """Sockets of tags such as socket:type2=2 and socket:type2:output=22 kW."""
    kinds = {
        match[1]: value
        for key, value in tags.items()
        if (match := SOCKET.fullmatch(key)) is not None and value.strip().lower() not in NOT_THERE
    }
    shared = tags.get("charging_station:output", "") or tags.get("maxpower", "")
    sockets: list[Socket] = []
    unknown: dict[str, int] = {}
    for kind, value in kinds.items():
        connector = Connector.CCS2 if kind == "tesla_supercharger_ccs" else connector_of(kind, at)
        if connector is None:
            gathering.unknown_plug(f"socket:{kind}")
            unknown[kind] = 1
            continue
        output = tags.get(f"socket:{kind}:output", "") or (shared if len(kinds) == 1 else "")
        power_w = _most_w(output)
        if output and power_w is None:
            gathering.note("powers that are no number or out of range")
        count = count_of(value)
        if count is None and value.strip().lower() not in WITHOUT_NUMBER:
            gathering.note("counts of sockets that are no number, taken as 1")
        sockets.append(socket_of(connector, power_w, count or 1))
    return with_sockets(sockets, unknown)


def _most_w(text: str) -> float | None:
    """The most of one or several powers [W], which are kW without a unit."""
    found = [power_w_of(part) for part in POWERS_APART.split(text[:200])]
    return max((power_w for power_w in found if power_w is not None), default=None)
