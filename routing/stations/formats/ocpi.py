"""Locations of OCPI 2.1.1, 2.2 and 2.3: objects, lists of them, and answers with them in `data`."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from energy.charging.charging import DC_CONNECTORS, Connector
from routing.stations.formats.entries import dicts, member
from routing.stations.formats.gathering import NO_WORD, Gathering, clean, day_in, with_sockets
from routing.stations.formats.hours import ALWAYS, weekly_hours
from routing.stations.formats.numbers import number_of, place_of, power_w_of
from routing.stations.formats.plugs import in_north_america, socket_of
from routing.stations.notes import LeftOutError, shown
from routing.stations.station import Access, Price, Socket, Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from routing.places import Point

NAME: Final = "OCPI Locations"
KEY: Final = "ocpi"
PLUGS: Final = MappingProxyType(
    {
        "CHADEMO": Connector.CHADEMO,
        "IEC_62196_T1": Connector.TYPE1,
        "IEC_62196_T1_COMBO": Connector.CCS1,
        "IEC_62196_T2": Connector.TYPE2,
        "IEC_62196_T2_COMBO": Connector.CCS2,
        "IEC_62196_T3A": Connector.TYPE3,
        "IEC_62196_T3C": Connector.TYPE3,
        "GBT_AC": Connector.GBT_AC,
        "GBT_DC": Connector.GBT_DC,
        "MCS": Connector.MCS,
        "SAE_J3400": Connector.NACS,
        **{f"DOMESTIC_{letter}": Connector.DOMESTIC for letter in "ABCDEFGHIJKLMNO"},
        **dict.fromkeys(
            ("NEMA_5_20", "NEMA_6_30", "NEMA_6_50", "NEMA_10_30", "NEMA_10_50", "NEMA_14_30", "NEMA_14_50"),
            Connector.DOMESTIC,
        ),
        **dict.fromkeys(
            ("IEC_60309_2_SINGLE_16", "IEC_60309_2_THREE_16", "IEC_60309_2_THREE_32", "IEC_60309_2_THREE_64"),
            Connector.CEE,
        ),
    }
)
TESLA: Final = "TESLA_S"
PHASES: Final = MappingProxyType({"AC_1_PHASE": 1, "AC_2_PHASE": 2, "AC_2_PHASE_SPLIT": 2, "AC_3_PHASE": 3})
GONE: Final = MappingProxyType({"PLANNED": "planned", "REMOVED": "removed"})
WORKING: Final = frozenset(("AVAILABLE", "BLOCKED", "CHARGING", "RESERVED"))
BROKEN: Final = frozenset(("INOPERATIVE", "OUTOFORDER"))
LINE_VOLTAGE: Final = 350.0  # from here on volts are between phases, which OCPI means from one to the neutral
ROOT_3: Final = 3.0**0.5
MOST_EVSES: Final = 2000
MOST_TARIFFS: Final = 10
MOST_HOURS: Final = 100
RESTRICTIONS: Final = MappingProxyType(
    {"CUSTOMERS": Access.CUSTOMERS, "EMPLOYEES": Access.RESTRICTED, "TENANTS": Access.RESTRICTED}
)


def recognises(entry: Mapping[str, Any]) -> bool:
    """Whether an object is a Location of OCPI."""
    return isinstance(entry.get("coordinates"), dict) and any(
        name in entry for name in ("evses", "country_code", "party_id", "last_updated", "publish")
    )


def read(
    entries: Iterator[tuple[int, Any]], members: Mapping[str, Any], gathering: Gathering, retrieved: str
) -> StationSource:
    """Gather the stations of the Locations; where they are from, with the parties that publish them."""
    parties: dict[str, None] = {}
    for number, entry in entries:
        gathering.number = number
        try:
            gathering.add(_station(entry, gathering))
            parties[_party(entry)] = None
        except LeftOutError as error:
            gathering.leave_out(number, error)
    named = [party for party in list(parties)[:20] if party]
    names = ", ".join(named)
    key = f"{KEY}-{NO_WORD.sub('-', named[0].lower())}" if len(parties) == len(named) == 1 else KEY
    gathering.rekey(key)
    at = day_in(members.get("timestamp")) or retrieved
    return StationSource(key, f"OCPI Locations{f' of {names}' if names else ''}", "as the publisher says", "", at)


def _party(entry: Mapping[str, Any]) -> str:
    country, party = clean(entry.get("country_code"), 2), clean(entry.get("party_id"), 3)
    return f"{country}*{party}" if country and party else ""


def _station(entry: Any, gathering: Gathering) -> Station:
    if not isinstance(entry, dict):
        raise LeftOutError("no object", "entry", shown(entry), "a Location")
    if entry.get("publish") is False:
        raise LeftOutError("not to be published", "publish", "false", "true")
    own_id = clean(entry.get("id"), 80)
    if not own_id:
        raise LeftOutError("no id", "id", shown(entry.get("id")), "a text")
    place = entry.get("coordinates")
    at = place_of(member(place, "latitude"), member(place, "longitude"))
    party = _party(entry)
    evses = dicts(entry.get("evses"), MOST_EVSES)
    present = [evse for evse in evses if _status(evse) not in GONE]
    if evses and not present:
        reason = GONE[_status(evses[0])]
        raise LeftOutError(reason, "evses.status", _status(evses[0]), "at least one that is there")
    states = [_status(evse) for evse in present]
    broken = [state in BROKEN for state in states]
    operational = True if any(state in WORKING for state in states) else False if states and all(broken) else None
    usable = (
        present if all(broken) else [evse for evse, is_broken in zip(present, broken, strict=True) if not is_broken]
    )
    if len(usable) < len(present):
        gathering.note("charging points that are out of order beside others that work", len(present) - len(usable))
    operator = clean(member(entry, "operator", "name"))
    return Station(
        id=f"{KEY}:{party}*{own_id}" if party else f"{KEY}:{own_id}",
        at=at,
        sockets=_sockets(usable, at, gathering),
        name=clean(entry.get("name")) or clean(entry.get("address")),
        operator=operator,
        network=clean(member(entry, "suboperator", "name")) or operator,
        capacity=len(usable) or None,
        access=_access(entry, present),
        price=_price(usable),
        opening_hours=_hours(entry.get("opening_times"), gathering),
        operational=operational,
        source=KEY,
    )


def _status(evse: Mapping[str, Any]) -> str:
    status = evse.get("status")
    return status if isinstance(status, str) else ""


def _access(entry: Mapping[str, Any], evses: Sequence[Mapping[str, Any]]) -> Access:
    """Who may park at every point, where all say the same; public where it is published and none is restricted."""
    said = set()
    for evse in evses:
        named = [RESTRICTIONS[text] for text in _texts(evse.get("parking_restrictions")) if text in RESTRICTIONS]
        said.add(named[0] if named else None)
    only = next(iter(said)) if len(said) == 1 else None
    return only or (Access.PUBLIC if entry.get("publish") is True else Access.UNKNOWN)


def _texts(value: object) -> list[str]:
    return [text for text in value if isinstance(text, str)] if isinstance(value, list) else []


def _sockets(evses: Sequence[Mapping[str, Any]], at: Point, gathering: Gathering) -> tuple[Socket, ...]:
    sockets: list[Socket] = []
    unknown: dict[str, int] = {}
    for evse in evses:
        for plug in dicts(evse.get("connectors"), 50):
            name = clean(plug.get("standard"), 60).upper()
            connector = PLUGS.get(name)
            if name == TESLA:
                elsewhere = Connector.TESLA_EU if _is_direct(plug) else Connector.TYPE2
                connector = Connector.NACS if in_north_america(at) else elsewhere
            if connector is None:
                gathering.unknown_plug(name)
                unknown[name or "no standard"] = 1
                continue
            phases = None if connector in DC_CONNECTORS else PHASES.get(clean(plug.get("power_type"), 20).upper())
            sockets.append(socket_of(connector, _power_w(plug, connector, phases, gathering), phases=phases))
    return with_sockets(sockets, unknown)


def _is_direct(plug: Mapping[str, Any]) -> bool:
    return clean(plug.get("power_type"), 20).upper() == "DC"


def _power_w(plug: Mapping[str, Any], connector: Connector, phases: int | None, gathering: Gathering) -> float | None:
    """The most that a plug gives [W]: as given, else of its volts and amperes."""
    given = plug.get("max_electric_power")
    power_w = power_w_of(given, unit="")
    if power_w is not None:
        return power_w
    if number_of(given) not in (None, 0.0):
        gathering.note("powers out of range (watts are meant)", value=given)
    volts = number_of(plug.get("max_voltage", plug.get("voltage")))
    amps = number_of(plug.get("max_amperage", plug.get("amperage")))
    if volts is None or amps is None:
        return None
    direct = connector in DC_CONNECTORS or _is_direct(plug)
    factor = 1.0
    if not direct:
        factor = {2: 2.0, 3: ROOT_3 if volts >= LINE_VOLTAGE else 3.0}.get(phases or 1, 1.0)
    power_w = power_w_of(volts * amps * factor, unit="")
    if power_w is not None:
        note = "powers of direct current from most volts and most amperes, which are at most these"
        gathering.note(note if direct else "powers from volts and amperes")
    return power_w


def _price(evses: Sequence[Mapping[str, Any]]) -> Price | None:
    """The tariffs of the plugs, whose prices are in another module of OCPI."""
    names: dict[str, None] = {}
    for evse in evses:
        for plug in dicts(evse.get("connectors"), 50):
            listed = plug.get("tariff_ids")
            texts = listed if isinstance(listed, list) else [plug.get("tariff_id")]
            names |= dict.fromkeys(filter(None, (clean(text, 40) for text in texts[:MOST_TARIFFS])))
    kept = ", ".join(list(names)[:MOST_TARIFFS])
    return Price(text=f"tariff {kept}") if kept else None


def _hours(times: object, gathering: Gathering) -> str | None:
    """Regular hours in OpenStreetMap's syntax; days of exception are noted and not kept."""
    if not isinstance(times, dict):
        return None
    if times.get("exceptional_openings") or times.get("exceptional_closings"):
        gathering.note("opening hours with days of exception, which are not kept")
    if times.get("twentyfourseven") is True:
        return ALWAYS
    spans: dict[int, list[tuple[str, str]]] = {}
    listed = times.get("regular_hours")
    for span in dicts([listed] if isinstance(listed, dict) else listed, MOST_HOURS):
        day = number_of(span.get("weekday"))
        begin, end = span.get("period_begin"), span.get("period_end")
        if day not in (1, 2, 3, 4, 5, 6, 7) or not isinstance(begin, str) or not isinstance(end, str):
            gathering.note("opening hours that are not understood")
            return None
        spans.setdefault(int(day) - 1, []).append((begin, end))
    hours = weekly_hours(spans)
    if spans and hours is None:
        gathering.note("opening hours that are not understood")
    return hours
