"""Open Charge Map: the list of points that its API (version 3) gives, compact or verbose."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

from energy.charging.charging import DC_CONNECTORS, Connector
from routing.stations.formats.entries import dicts, member
from routing.stations.formats.gathering import POWERS_PASSED, Gathering, clean, with_sockets
from routing.stations.formats.numbers import count_of, number_of, place_of, power_w_of
from routing.stations.formats.open_charge_map_codes import (
    ACCESS,
    COUNTRIES,
    DIRECT_CURRENT,
    FAST,
    GONE,
    LEAST_DELISTED,
    LEVEL_W,
    NACS_COUNTRIES,
    NO_OPERATORS,
    NOT_LISTED,
    OPERATIONAL,
    OPERATORS,
    PAY_AT_LOCATION,
    PHASES,
    PLUGS,
    PROVIDERS,
    TESLA_PLUGS,
    UNKNOWN_PLUGS,
)
from routing.stations.formats.plugs import in_north_america, socket_of
from routing.stations.formats.prices import price_of
from routing.stations.notes import LeftOutError, shown
from routing.stations.station import Access, Socket, Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from routing.places import Point

NAME: Final = "Open Charge Map JSON"
KEY: Final = "ocm"
LINE_VOLTAGE: Final = 350.0  # from here on volts are between phases
ROOT_3: Final = 3.0**0.5
MOST_DEPTH: Final = 6
MOST_ID: Final = 1e12
MOST_LICENCES: Final = 300  # letters


def recognises(entry: Mapping[str, Any]) -> bool:
    """Whether an object is a point of Open Charge Map."""
    point = _capital(entry) if "addressInfo" in entry else entry
    return isinstance(point.get("AddressInfo"), dict) and any(name in point for name in ("Connections", "UUID", "ID"))


def read(
    entries: Iterator[tuple[int, Any]], members: Mapping[str, Any], gathering: Gathering, retrieved: str
) -> StationSource:
    """Gather the stations of the points; where they are from, with the licences of their providers."""
    del members
    providers: Counter[str] = Counter()
    for number, entry in entries:
        gathering.number = number
        try:
            point = _capital(entry) if isinstance(entry, dict) and "addressInfo" in entry else entry
            gathering.add(_station(point, gathering))
            providers[_provider(point)] += 1
        except LeftOutError as error:
            gathering.leave_out(number, error)
    licences = "; ".join(dict.fromkeys(name for name, _ in providers.most_common()))
    return StationSource(
        KEY, "Open Charge Map", licences[:MOST_LICENCES] or "CC BY-SA 4.0", "https://openchargemap.org", retrieved
    )


def _capital(value: Any, depth: int = 0) -> Any:
    """A point that was asked for with `camelcase`, with the names that it has else; not deeper than points are."""
    if depth > MOST_DEPTH:
        return None
    if isinstance(value, list):
        return [_capital(item, depth + 1) for item in value]
    if not isinstance(value, dict):
        return value
    return {
        name.upper() if name in ("id", "uuid") else name[:1].upper() + name[1:]: _capital(item, depth + 1)
        for name, item in value.items()
    }


def _station(entry: Any, gathering: Gathering) -> Station:
    if not isinstance(entry, dict):
        raise LeftOutError("no object", "entry", shown(entry), "an object with AddressInfo")
    _check_listed(entry)
    address = entry.get("AddressInfo")
    at = place_of(member(address, "Latitude"), member(address, "Longitude"))
    country = _country(address)
    number = number_of(entry.get("ID"))
    if number is None or not 0 <= number <= MOST_ID or number != int(number):
        raise LeftOutError("no id", "ID", shown(entry.get("ID")), "a whole number")
    operator = _operator(entry)
    usage = _code(entry, "UsageType")
    price, is_fee = price_of(clean(entry.get("UsageCost"), 300), country)
    if is_fee is None and (usage == PAY_AT_LOCATION or member(entry, "UsageType", "IsPayAtLocation") is True):
        is_fee = True
    return Station(
        id=f"{KEY}:{int(number)}",
        at=at,
        sockets=_sockets(entry, at, country, gathering),
        name=clean(member(address, "Title")),
        operator=operator,
        network=operator,
        capacity=count_of(entry.get("NumberOfPoints")),
        access=ACCESS.get(usage, Access.UNKNOWN) if usage is not None else Access.UNKNOWN,
        fee=is_fee,
        price=price,
        operational=_operational(entry),
        source=KEY,
    )


def _code(value: Mapping[str, Any], name: str) -> int | None:
    """The id of a reference: of its own member in compact form, of the object in verbose form."""
    number = number_of(value.get(f"{name}ID"))
    if number is None:
        number = number_of(member(value, name, "ID"))
    return int(number) if number is not None and abs(number) < 1e9 else None


def _check_listed(entry: Mapping[str, Any]) -> None:
    """Raises LeftOutError for a point that is planned, removed or not on the list."""
    status = _code(entry, "StatusType")
    if status is not None and status in GONE:
        raise LeftOutError(GONE[status], "StatusTypeID", status, "a station that is there")
    submission = _code(entry, "SubmissionStatus")
    if submission is None:
        submission = _code(entry, "SubmissionStatusType")
    if submission is not None and (submission >= LEAST_DELISTED or submission in NOT_LISTED):
        raise LeftOutError("not listed", "SubmissionStatusTypeID", submission, "100 or 200, which are published")


def _operational(entry: Mapping[str, Any]) -> bool | None:
    status = _code(entry, "StatusType")
    if status is not None and status in OPERATIONAL:
        return OPERATIONAL[status]
    said = member(entry, "StatusType", "IsOperational")
    return said if isinstance(said, bool) else None


def _country(address: Any) -> str:
    iso = member(address, "Country", "ISOCode")
    if isinstance(iso, str):
        return iso.upper()[:2]
    number = number_of(member(address, "CountryID"))
    return "" if number is None else COUNTRIES.get(int(number), "")


def _operator(entry: Mapping[str, Any]) -> str:
    code = _code(entry, "Operator")
    if code is None:
        code = _code(entry, "OperatorInfo")
    if code in NO_OPERATORS:
        return ""
    return clean(member(entry, "OperatorInfo", "Title")) or ("" if code is None else OPERATORS.get(code, ""))


def _provider(entry: Mapping[str, Any]) -> str:
    """The licence of the provider of a point, and its name."""
    code = _code(entry, "DataProvider")
    name, licence = PROVIDERS.get(1 if code is None else code, (f"provider {code}", None))
    name = clean(member(entry, "DataProvider", "Title")) or name
    if code is None or code in PROVIDERS:
        return f"{licence or 'licence not open or not known'} ({name})"
    said = clean(member(entry, "DataProvider", "License"), 80)
    return f"{said or 'licence not known'} ({name})"


def _sockets(entry: Mapping[str, Any], at: Point, country: str, gathering: Gathering) -> tuple[Socket, ...]:
    connections = entry.get("Connections")
    if connections is not None and not isinstance(connections, list):
        raise LeftOutError("plugs that are no list", "Connections", shown(connections), "a list of objects")
    sockets: list[Socket] = []
    unknown: dict[str, int] = {}
    for connection in dicts(connections):
        status = _code(connection, "StatusType")
        if status in GONE or OPERATIONAL.get(-1 if status is None else status) is False:
            gathering.note("plugs that are planned, removed or out of order")
            continue
        connector = _connector(connection, at, country)
        if connector is None:
            name = _plug_name(connection)
            gathering.unknown_plug(name)
            unknown[name] = 1
            continue
        sockets.append(_socket(connection, connector, gathering))
    return with_sockets(sockets, unknown)


def _connector(connection: Mapping[str, Any], at: Point, country: str) -> Connector | None:
    code = _code(connection, "ConnectionType")
    if code in TESLA_PLUGS:
        american = country in NACS_COUNTRIES if country else in_north_america(at)
        if american:
            return Connector.NACS
        return Connector.TYPE2 if _code(connection, "CurrentType") in PHASES else Connector.TESLA_EU
    return None if code is None else PLUGS.get(code)


def _plug_name(connection: Mapping[str, Any]) -> str:
    code = _code(connection, "ConnectionType")
    title = clean(member(connection, "ConnectionType", "Title"))
    return title or UNKNOWN_PLUGS.get(0 if code is None else code, f"ConnectionTypeID {code}")


def _socket(connection: Mapping[str, Any], connector: Connector, gathering: Gathering) -> Socket:
    current = _code(connection, "CurrentType")
    phases = None if current is None or connector in DC_CONNECTORS else PHASES.get(current)
    quantity = connection.get("Quantity")
    count = count_of(quantity)
    if count is None and number_of(quantity) not in (None, 0.0):
        gathering.note("plugs with a quantity out of range, taken as 1", value=quantity)
    return socket_of(connector, _power_w(connection, connector, phases, gathering), count or 1, phases=phases)


def _power_w(
    connection: Mapping[str, Any], connector: Connector, phases: int | None, gathering: Gathering
) -> float | None:
    """The power of a plug [W]: as given, else of its amperes and volts, else of its level."""
    given = connection.get("PowerKW")
    power_w = power_w_of(given)
    if power_w is not None:
        return power_w
    if number_of(given) not in (None, 0.0):
        gathering.note(POWERS_PASSED, value=given)
    amps, volts = number_of(connection.get("Amps")), number_of(connection.get("Voltage"))
    if amps is not None and volts is not None and amps > 0.0 and volts > 0.0:
        direct = connector in DC_CONNECTORS or _code(connection, "CurrentType") == DIRECT_CURRENT
        factor = 1.0 if direct else {3: ROOT_3 if volts >= LINE_VOLTAGE else 3.0}.get(phases or 1, 1.0)
        if not direct and phases is None and volts >= LINE_VOLTAGE:
            factor = ROOT_3  # volts between phases are those of three
        power_w = power_w_of(amps * volts * factor, unit="")
        if power_w is not None:
            gathering.note("powers from amperes and volts")
            return power_w
    level_w = LEVEL_W.get(_code(connection, "Level") or 0)
    if connector in DC_CONNECTORS and level_w is not None and level_w < LEVEL_W[FAST]:
        return None  # the level is a mistake
    if level_w is not None:
        gathering.note("powers from the level alone (1: 1.8 kW, 2: 3.7 kW, 3: 40 kW)")
    return level_w
