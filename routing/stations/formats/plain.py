"""Tables of stations that people make themselves: CSV with documented headers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from routing.stations.formats.gathering import POWERS_PASSED, Gathering, clean, with_sockets
from routing.stations.formats.hours import osm_hours
from routing.stations.formats.numbers import MOST_COUNT, count_of, number_of, place_of, power_w_of
from routing.stations.formats.plugs import connector_of, socket_of
from routing.stations.formats.prices import CODES, MOST_PRICE, price_of
from routing.stations.formats.tables import folded
from routing.stations.notes import LeftOutError, StationFileError, shown
from routing.stations.station import Access, Price, Socket, Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Callable

    from routing.places import Point
    from routing.stations.formats.tables import Table

NAME: Final = "CSV with lat, lon, connectors and power_kw"
LATITUDES: Final = ("lat", "latitude", "lat_deg", "latitude_deg", "gps_lat", "geo_lat", "y", "breitengrad")
LONGITUDES: Final = (
    *(
        "lon",
        "lng",
        "long",
        "longitude",
        "lon_deg",
        "longitude_deg",
        "gps_lon",
        "gps_lng",
        "geo_lon",
        "x",
        "längengrad",
    ),
)
COLUMNS: Final = {  # names of each value, the first that is there is read
    "lat": LATITUDES,
    "lon": LONGITUDES,
    "id": ("id", "station_id", "ref", "uid", "osm_id"),
    "name": ("name", "station_name", "title", "station"),
    "operator": ("operator", "operator_name", "betreiber", "owner", "brand"),
    "network": ("network", "ev_network"),
    "plugs": ("connectors", "connector", "plugs", "plug", "plug_types", "connector_types", "connector_type", "sockets"),
    "kilowatts": ("power_kw", "max_power_kw", "power", "kw", "output", "output_kw", "max_power", "leistung_kw"),
    "watts": ("power_w", "max_power_w", "output_w"),
    "count": ("count", "quantity", "plug_count", "sockets_count"),
    "capacity": ("capacity", "points", "charge_points", "stalls", "num_points", "evse_count"),
    "access": ("access", "usage"),
    "fee": ("fee",),
    "price": ("price", "pricing", "charge", "cost", "tariff"),
    "currency": ("currency",),
    "per_kwh": ("price_per_kwh", "price_kwh"),
    "per_min": ("price_per_min", "price_min"),
    "per_session": ("price_per_session", "price_session"),
    "hours": ("opening_hours", "hours"),
    "status": ("status", "operational", "state_of_operation"),
    "country": ("country", "country_code"),
}
OF_OBJECTS: Final = (  # names of kind, power [kW] and count in objects of GeoJSON
    ("type", "connector", "plug", "standard", "name"),
    ("power_kw", "powerKW", "powerKw", "power", "max_power_kw", "output_kw", "output"),
    ("count", "quantity"),
)
PLUGS_APART: Final = re.compile(r"\s*[;,|/+&\n]\s*")
PLUG: Final = re.compile(
    r"(?:(?P<before>\d{1,3})\s*[x×*]\s*)?(?P<name>[^()@]{1,60}?)(?:\s*[x×*]\s*(?P<after>\d{1,3}))?"
    r"(?:\s*[@(]?\s*(?P<power>\d[\d.,]{0,8}\s*[kKmM]?[wWvV][aA]?)\s*\)?)?(?:\s*[x×*]\s*(?P<last>\d{1,3}))?",
)
POWER_FIRST: Final = re.compile(
    r"\A(?:(?P<count>\d{1,3}\s*[x×*])\s*)?(?P<power>\d[\d.,]{0,8}\s*[kKmM]?[wWvV][aA]?)[\s:-]+(?P<name>[^\d\s].{0,59})"
)
DECIMAL_COMMA: Final = re.compile(r"(?<=\d),(?=\d)")
TRUTHS: Final = {"yes": True, "true": True, "1": True, "y": True, "ja": True, "no": False, "false": False, "0": False}
ACCESS: Final = {
    **dict.fromkeys(("public", "yes", "permissive", "öffentlich", "open", "true"), Access.PUBLIC),
    **dict.fromkeys(("customers", "customer", "guests", "visitors", "kunden"), Access.CUSTOMERS),
    **dict.fromkeys(("restricted", "permit", "members", "semi-public", "destination", "limited"), Access.RESTRICTED),
    **dict.fromkeys(("private", "no", "privat", "employees", "residents"), Access.PRIVATE),
}
WORKING: Final = frozenset(
    ("operational", "open", "available", "active", "yes", "true", "1", "e", "in betrieb", "in operation", "working")
)
BROKEN: Final = frozenset(
    (
        *("out of order", "broken", "closed", "inactive", "no", "false", "0", "unavailable", "offline", "outoforder"),
        *("not operational", "temporarily unavailable", "außer betrieb", "inoperative"),
        *("temporarily closed", "closed temporarily", "under maintenance", "maintenance", "defekt", "faulted", "down"),
    )
)
PLANNED: Final = frozenset(
    (
        *("planned", "construction", "under construction", "proposed", "in planung", "coming soon", "geplant"),
        *("in construction", "im bau", "not yet open", "future"),
    )
)
REMOVED: Final = frozenset(
    (
        *("removed", "decommissioned", "disused", "abandoned", "demolished", "dismantled", "closed down", "gone"),
        *(
            "permanently closed",
            "closed permanently",
            "closed_permanently",
            "permanently_closed",
            "dauerhaft geschlossen",
        ),
        *("permanently removed", "retired", "abgebaut", "stillgelegt", "defunct"),
    )
)
_FOLDED: Final = {value: frozenset(map(folded, names)) for value, names in COLUMNS.items()}


def recognises(names: frozenset[str]) -> bool:
    """Whether a header has a latitude and a longitude."""
    return bool(names & _FOLDED["lat"]) and bool(names & _FOLDED["lon"])


def read(table: Table, gathering: Gathering, retrieved: str) -> StationSource:
    """Gather the stations of the rows; raises StationFileError for a header without plugs."""
    key = gathering.own_key
    columns = {value: table.column(*names) for value, names in COLUMNS.items()}
    if columns["plugs"] is None:
        where, names = f"line {len(table.before) + 1}", ", ".join(COLUMNS["plugs"])
        raise StationFileError(table.path, where, "the header", "without a column of plugs", f"one of {names}")
    decimal_comma = _has_decimal_commas(table, columns)
    for number, row in table.rows():
        gathering.number = number

        def cell(value: str, row: Any = row) -> str:
            at = columns[value]
            return "" if at is None else row[at].strip()

        try:
            if len(row) > len(table.names) and any(row[len(table.names) :]):
                found, allowed = (
                    f"{len(row)} cells long",
                    f"{len(table.names)}, as the header; decimal points or quotes",
                )
                raise LeftOutError("more cells than the header", "row", found, allowed)
            gathering.add(station_of(cell, gathering, key, decimal_comma=decimal_comma))
        except LeftOutError as error:
            gathering.leave_out(number, error)
    return StationSource(key, "a file of its own", "as its author says", "", retrieved)


def station_of(
    cell: Callable[[str], Any], gathering: Gathering, key: str, *, at: Point | None = None, decimal_comma: bool = False
) -> Station:
    """The station of named values, each a text or "" (names: those of COLUMNS); raises LeftOutError.

    at: its place where it is not among them.
    """
    at = at or place_of(cell("lat"), cell("lon"))
    status = clean(cell("status")).lower()
    for reason, words in (("planned", PLANNED), ("removed", REMOVED)):
        if status in words:
            raise LeftOutError(reason, "status", shown(status), "a station that is there")
    sockets = _sockets(cell, at, gathering, decimal_comma=decimal_comma)
    price, is_fee = price_of(clean(cell("price"), 300), clean(cell("country")).upper()[:2])
    own_price = _own_price(cell, decimal_comma=decimal_comma)
    if own_price is not None:
        price, is_fee = own_price, any((own_price.per_kwh, own_price.per_min, own_price.per_session))
    if status and status not in WORKING and status not in BROKEN:
        gathering.note("words of status that are not known, taken as nothing said", value=status)
    access = clean(cell("access")).lower()
    if access and access not in ACCESS:
        gathering.note("words of access that are not known, taken as unknown", value=access)
    said_fee = TRUTHS.get(clean(cell("fee")).lower())
    hours = clean(cell("hours"), 600)
    opening_hours = osm_hours(hours)
    if hours and opening_hours is None:
        gathering.note("opening hours that are not in OpenStreetMap's syntax, not kept", value=hours)
    own_id = clean(cell("id"), 80)
    place_id = f"{key}:{at.lat_deg:.6f},{at.lon_deg:.6f}"
    return Station(
        id=f"{key}:{own_id}" if own_id else gathering.free_id(place_id),
        at=at,
        sockets=sockets,
        name=clean(cell("name")),
        operator=clean(cell("operator")),
        network=clean(cell("network")),
        capacity=_count(cell("capacity"), gathering, "capacities"),
        access=ACCESS.get(access, Access.UNKNOWN),
        fee=is_fee if said_fee is None else said_fee,
        price=price,
        opening_hours=opening_hours,
        operational=True if status in WORKING else False if status in BROKEN else None,
        source=key,
    )


def _has_decimal_commas(table: Table, columns: dict[str, int | None]) -> bool:
    """Whether the first places of a table are written with decimal commas, as then all its numbers are."""
    places = [at for at in (columns["lat"], columns["lon"]) if at is not None]
    for _, row in table.rows():
        texts = [row[at] for at in places]
        if any(DECIMAL_COMMA.search(text) for text in texts):
            return True
        if any("." in text for text in texts):
            return False
    return False


def _sockets(cell: Callable[[str], Any], at: Point, gathering: Gathering, *, decimal_comma: bool) -> tuple[Socket, ...]:
    plugs = cell("plugs")
    plugs = "; ".join(_plug_text(plug) for plug in plugs[:20]) if isinstance(plugs, list) else clean(plugs, 400)
    texts = [text for text in PLUGS_APART.split(_without_decimal_commas(plugs)) if text]
    powers = _powers(cell, len(texts), gathering, decimal_comma=decimal_comma)
    count = _count(cell("count"), gathering, "counts of sockets")
    sockets: list[Socket] = []
    unknown: dict[str, int] = {}
    for text, power_w in zip(texts, powers, strict=True):
        match = PLUG.fullmatch(POWER_FIRST.sub(r"\g<count> \g<name> \g<power>", text).strip())
        connector = connector_of(match["name"], at) if match is not None else None
        if match is None or connector is None:
            gathering.unknown_plug(text)
            unknown[text] = 1
            continue
        own_w = power_w_of(match["power"]) if match["power"] else None
        if match["power"] and own_w is None:
            gathering.note(POWERS_PASSED, value=text)
        said = match["before"] or match["after"] or match["last"]
        if said is not None and int(said) == 0:
            continue
        own_count = count_of(said)
        sockets.append(socket_of(connector, own_w or power_w, own_count or (count if len(texts) == 1 else None) or 1))
    return with_sockets(sockets, unknown)


def _count(value: object, gathering: Gathering, what: str) -> int | None:
    """A count of sockets or vehicles, with a note where what is said is none."""
    count = count_of(value)
    if count is None and clean(value):
        gathering.note(f"{what} that are no whole number of 1..{MOST_COUNT}, taken as not known", value=value)
    return count


def _plug_text(plug: object) -> str:
    """A plug of a list as plain CSV writes it; an object has its kind, power [kW] and count."""
    if not isinstance(plug, dict):
        return clean(plug, 60)
    kind, kilowatts, count = (
        next((clean(plug[name], 30) for name in names if plug.get(name) is not None), "") for names in OF_OBJECTS
    )
    bare = number_of(kilowatts) is not None
    power = f" {kilowatts}{' kW' if bare else ''}" if bare or power_w_of(kilowatts) is not None else ""
    return f"{f'{count}x ' if count else ''}{kind}{power}"


def _own_price(cell: Callable[[str], Any], *, decimal_comma: bool) -> Price | None:
    """The price of columns of numbers in a currency; None where there is none."""
    currency = clean(cell("currency")).upper()
    rates = [number_of(cell(name), decimal_comma=decimal_comma) for name in ("per_kwh", "per_min", "per_session")]
    known = [rate is not None and 0.0 <= rate <= MOST_PRICE for rate in rates]
    if currency not in CODES or not any(known):
        return None
    per_kwh, per_min, per_session = (rate if is_known else None for rate, is_known in zip(rates, known, strict=True))
    units = zip((per_kwh, per_min, per_session), ("kWh", "min", "session"), strict=True)
    words = " + ".join(f"{rate:g} {currency}/{unit}" for rate, unit in units if rate is not None)
    return Price(words, currency, per_kwh, per_min, per_session)


def _without_decimal_commas(plugs: str) -> str:
    """With points for commas in powers such as "3,7 kW", as commas set off plugs."""
    return re.sub(r"(?<=\d),(?=\d{1,2}\s*[kK][wWvV])", ".", plugs)


def _powers(cell: Callable[[str], Any], plugs: int, gathering: Gathering, *, decimal_comma: bool) -> list[float | None]:
    """The power of each plug [W]: all the same, or as many as there are plugs."""
    unit = "" if cell("watts") not in ("", None) else "k"
    given = cell("kilowatts" if unit else "watts")
    if given in ("", None):
        return [None] * plugs
    texts = [part for part in re.split(r"[;|/]", given) if part.strip()] if isinstance(given, str) else [given]
    found = [power_w_of(text, unit=unit, decimal_comma=decimal_comma) for text in texts[:50]]
    if None in found:
        gathering.note(POWERS_PASSED, value=texts[found.index(None)])
    if len(found) == plugs:
        return found
    known = [power_w for power_w in found if power_w is not None]
    return [max(known, default=None)] * plugs
