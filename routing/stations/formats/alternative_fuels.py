"""The register of the Alternative Fuels Data Center (USA, Canada): CSV of stations or charging units, and JSON."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from energy.charging.charging import Connector
from routing.stations.formats.entries import dicts, member
from routing.stations.formats.gathering import Gathering, clean, day_in, with_sockets
from routing.stations.formats.hours import english_hours
from routing.stations.formats.numbers import count_of, place_of, power_w_of
from routing.stations.formats.plugs import joined, socket_of
from routing.stations.formats.prices import price_of
from routing.stations.notes import LeftOutError, shown
from routing.stations.station import Access, Socket, Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from routing.places import Point
    from routing.stations.formats.tables import Table

KEY: Final = "afdc"
NORTH_AMERICA: Final = (13.0, -180.0, 84.0, -52.0)  # south, west, north, east [deg]
NAMES: Final = {  # of a value in CSV and in JSON
    "fuel": ("Fuel Type Code", "fuel_type_code"),
    "id": ("ID", "id"),
    "name": ("Station Name", "station_name"),
    "lat": ("Latitude", "latitude"),
    "lon": ("Longitude", "longitude"),
    "status": ("Status Code", "status_code"),
    "country": ("Country", "country"),
    "level1": ("EV Level1 EVSE Num", "ev_level1_evse_num"),
    "level2": ("EV Level2 EVSE Num", "ev_level2_evse_num"),
    "dc": ("EV DC Fast Count", "ev_dc_fast_num"),
    "network": ("EV Network", "ev_network"),
    "plugs": ("EV Connector Types", "ev_connector_types"),
    "price": ("EV Pricing", "ev_pricing"),
    "hours": ("Access Days Time", "access_days_time"),
    "access": ("Access Code", "access_code"),
    "restricted": ("Restricted Access", "restricted_access"),
    "groups": ("Groups With Access Code", "groups_with_access_code"),
    "updated": ("Updated At", "updated_at"),
}
ALTERNATING: Final = {"J1772": Connector.TYPE1, "TESLA": Connector.NACS, "J3400": Connector.NACS}
DIRECT: Final = {
    "J1772COMBO": Connector.CCS1,
    "CCS": Connector.CCS1,
    "CHADEMO": Connector.CHADEMO,
    "TESLA": Connector.NACS,
    "J3400": Connector.NACS,
    "J3271": Connector.MCS,
}
HOUSEHOLD: Final = frozenset(("NEMA515", "NEMA520", "NEMA1450"))
KNOWN: Final = frozenset((*ALTERNATING, *DIRECT, *HOUSEHOLD))
OF_UNITS: Final = ("J1772", "CCS", "CHAdeMO", "J3400", "J3271")  # plugs with columns of their own
UNIT_PLUGS: Final = (Connector.TYPE1, Connector.CCS1, Connector.CHADEMO, Connector.NACS, Connector.MCS)
LEVEL1_W: Final = 1_440.0  # 12 A at 120 V
LEVEL2_W: Final = 6_240.0  # 30 A at 208 V, the least that is usual; assumed
DESTINATION: Final = "Tesla Destination"
NO_NETWORK: Final = "Non-Networked"
SOURCE: Final = StationSource(
    KEY,
    "Alternative Fuels Data Center, US Department of Energy",
    "US Department of Energy, may be used for any purpose",
    "https://afdc.energy.gov/stations",
)


class _Csv:
    """The register's CSV."""

    NAME: str = "AFDC (CSV)"

    def recognises(self, names: frozenset[str]) -> bool:
        """Whether a header is that of the register."""
        return {"fueltypecode", "latitude", "longitude", "evconnectortypes"} <= names

    def read(self, table: Table, gathering: Gathering, retrieved: str) -> StationSource:
        """Gather the stations of the rows; units of one station are one."""
        columns = {value: table.column(*names) for value, names in NAMES.items()}
        unit_columns = [
            (table.column(f"EV {name} Connector Count"), table.column(f"EV {name} Power Output (kW)"))
            for name in OF_UNITS
        ]
        newest = ""
        for number, row in table.rows():
            gathering.number = number

            def cell(value: str, row: Sequence[str] = row) -> str:
                at = columns[value]
                return "" if at is None else row[at].strip()

            try:
                units = [
                    (connector, row[count], "" if power is None else row[power])
                    for connector, (count, power) in zip(UNIT_PLUGS, unit_columns, strict=True)
                    if count is not None
                ]
                _add(_station(cell, units, gathering), gathering, is_unit=bool(units))
                newest = max(newest, day_in(cell("updated")))
            except LeftOutError as error:
                gathering.leave_out(number, error)
        return replace(SOURCE, retrieved=newest or retrieved)


class _Json:
    """What the register's interface answers in JSON."""

    NAME: str = "AFDC (JSON)"

    def recognises(self, entry: Mapping[str, Any]) -> bool:
        """Whether an object is a station of the register."""
        return "fuel_type_code" in entry and "latitude" in entry

    def read(
        self, entries: Iterator[tuple[int, Any]], members: Mapping[str, Any], gathering: Gathering, retrieved: str
    ) -> StationSource:
        """Gather the stations of the entries."""
        del members
        newest = ""
        for number, entry in entries:
            gathering.number = number
            try:
                if not isinstance(entry, dict):
                    raise LeftOutError("no object", "entry", shown(entry), "a station")
                station = json_station(entry, gathering)
                _add(station, gathering, is_unit=False)
                newest = max(newest, day_in(entry.get("updated_at")))
            except LeftOutError as error:
                gathering.leave_out(number, error)
        return replace(SOURCE, retrieved=newest or retrieved)


CSV: Final = _Csv()
JSON: Final = _Json()


def json_station(entry: Mapping[str, Any], gathering: Gathering, at: Point | None = None) -> Station:
    """The station of an object with the register's names; at: its place where it is not in it. Raises LeftOutError."""
    units: list[tuple[Connector, object, object]] = []
    for unit in dicts(entry.get("ev_charging_units")):
        connectors = unit.get("connectors")
        for name, plug in (connectors if isinstance(connectors, dict) else {}).items():
            connector = DIRECT.get(name) or ALTERNATING.get(name)
            if connector is not None:
                units.append((connector, member(plug, "port_count"), member(plug, "power_kw")))

    def value(name: str) -> Any:
        given = entry.get(NAMES[name][1])
        return "" if given is None else given

    return _station(value, units, gathering, at)


def _add(station: Station, gathering: Gathering, *, is_unit: bool) -> None:
    """Take a station; units of one that is there are added to it."""
    there = gathering.stations.get(station.id)
    if there is None or not is_unit:
        gathering.add(station)
        return
    gathering.parts += 1
    sockets = joined((*there.sockets, *station.sockets))
    gathering.stations[station.id] = replace(there, sockets=sockets, capacity=(there.capacity or 1) + 1)


def _station(
    value: Callable[[str], Any],
    units: Sequence[tuple[Connector, object, object]],
    gathering: Gathering,
    at: Point | None = None,
) -> Station:
    fuel = clean(value("fuel")).upper()
    if fuel not in ("ELEC", ""):
        raise LeftOutError("not electric", "Fuel Type Code", shown(fuel), "ELEC")
    status = clean(value("status")).upper()
    if status == "P":
        raise LeftOutError("planned", "Status Code", status, "E or T, which are there")
    own_id = clean(value("id"), 40)
    if not own_id:
        raise LeftOutError("no id", "ID", "missing", "a number")
    at = at or place_of(value("lat"), value("lon"), NORTH_AMERICA)
    network = clean(value("network"))
    counts = [count_of(value(name)) or 0 for name in ("level1", "level2", "dc")]
    sockets = _of_units(units)
    is_of_units = bool(sockets)
    if not is_of_units:
        sockets = _of_levels(value("plugs"), counts, network, gathering)
    price, is_fee = price_of(clean(value("price"), 300), clean(value("country")).upper()[:2] or "US")
    hours = clean(value("hours"), 600)
    opening_hours = english_hours(hours) if hours else None
    if hours and opening_hours is None:
        gathering.note("opening hours that are not understood, not kept")
    own_network = "" if network == NO_NETWORK else network
    return Station(
        id=f"{KEY}:{own_id}",
        at=at,
        sockets=with_sockets(sockets, dict.fromkeys(_names(value("plugs")), 1)),
        name=clean(value("name")),
        operator=own_network,
        network=own_network,
        capacity=1 if is_of_units and not sum(counts) else sum(counts) or None,
        access=_access(value, hours),
        fee=is_fee,
        price=price,
        opening_hours=opening_hours,
        operational={"E": True, "T": False}.get(status),
        source=KEY,
    )


def _access(value: Callable[[str], Any], hours: str) -> Access:
    code, groups = clean(value("access")).lower(), clean(value("groups")).lower()
    if code == "private" or groups.startswith("private"):
        return Access.PRIVATE
    if "customer use only" in hours.lower() or "guest use only" in hours.lower():
        return Access.CUSTOMERS
    if clean(value("restricted")).lower() == "true" or value("restricted") is True:
        return Access.RESTRICTED
    return Access.PUBLIC if code == "public" or groups.startswith("public") else Access.UNKNOWN


def _names(plugs: object) -> list[str]:
    """Names of plugs, set off by blanks in CSV, a list in JSON."""
    texts = plugs[:50] if isinstance(plugs, list) else clean(plugs, 300).split(" ")
    return [name for name in (clean(text, 40).upper() for text in texts) if name]


def _of_units(units: Sequence[tuple[Connector, object, object]]) -> list[Socket]:
    """Sockets of charging units, whose plugs are counted and have their power."""
    sockets = []
    for connector, count, power in units:
        number = count_of(count)
        if number is not None:
            sockets.append(socket_of(connector, power_w_of(power), number))
    return sockets


def _of_levels(plugs: object, counts: Sequence[int], network: str, gathering: Gathering) -> list[Socket]:
    """Sockets of a station whose ports are counted by level and whose plugs are only named.

    Where several plugs share a level, how many there are of each is not known: one of each is certain.
    """
    names = list(dict.fromkeys(_names(plugs)))
    for name in names:
        if name not in KNOWN:
            gathering.unknown_plug(name)
    level1, level2, direct = counts
    tesla_direct = direct > 0 and network != DESTINATION
    dc = [DIRECT[name] for name in names if name in DIRECT and (name not in ALTERNATING or tesla_direct)]
    slow = [ALTERNATING[name] for name in names if name in ALTERNATING and (name == "J1772" or not tesla_direct)]
    sockets: list[Socket] = []
    if level1:
        at_level1 = [Connector.DOMESTIC] if HOUSEHOLD & set(names) else [Connector.TYPE1] if "J1772" in names else []
        sockets += _shared(at_level1, level1, LEVEL1_W)
    sockets += _shared(slow, level2, LEVEL2_W)
    sockets += _shared(dc, direct, None)
    if level1 or (level2 and slow):
        gathering.note("powers from the level alone (1: 1.44 kW, 2: 6.24 kW)")
    if direct and dc:
        gathering.note("fast chargers without a power")
    return sockets


def _shared(connectors: Sequence[Connector], ports: int, output_w: float | None) -> list[Socket]:
    if not ports:
        return []
    each = ports if len(connectors) == 1 else 1
    return [socket_of(connector, output_w, each) for connector in dict.fromkeys(connectors)]
