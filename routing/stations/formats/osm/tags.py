"""What the tags of a charging station mean.

After the wiki's pages Tag:amenity=charging_station, Tag:man_made=charge_point, Key:socket and
Proposal:Deprecate_socket:tesla_supercharger_and_socket:tesla_destination.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from energy.charging.charging import DC_CONNECTORS, Connector
from routing.stations.formats.osm.numbers import alternating_w, count_of, greatest, outputs_w
from routing.stations.formats.plugs import in_north_america
from routing.stations.formats.prices import price_of
from routing.stations.station import Access, Price, Socket

if TYPE_CHECKING:
    from collections.abc import Mapping

    from routing.places import Point

STATION_TAG: Final = ("amenity", "charging_station")
POINT_TAG: Final = ("man_made", "charge_point")
LIFE_CYCLE: Final = (
    "disused",
    "abandoned",
    "construction",
    "planned",
    "proposed",
    "demolished",
    "removed",
    "razed",
    "was",
)
TOLD_TAGS: Final = (  # of what is a station or charge point, or was one, or will be
    STATION_TAG,
    POINT_TAG,
    *((f"{prefix}:{key}", value) for prefix in LIFE_CYCLE for key, value in (STATION_TAG, POINT_TAG)),
)
MOST_SOCKETS: Final = 1000  # of one kind at one station; a greater number is a mistake


class LeftOut(StrEnum):
    """Why a station of OpenStreetMap's tags is left out."""

    NOT_FOR_CARS = "not for cars"
    NOT_IN_USE = "disused or not built yet"
    NO_PLACE = "no place"


@dataclass(frozen=True, slots=True)
class SocketKind:
    """What a kind of socket is: its plug, and output and phases where its name says them."""

    connector: Connector
    output_w: float | None = None
    phases: int | None = None


def _red(ampere: float) -> SocketKind:
    return SocketKind(Connector.CEE, round(alternating_w(400.0, ampere, 3), -2), 3)


# By the name after `socket:`. Those of bicycles, phones (usb-A) and campers' gas are none of cars.
SOCKET_KINDS: Final[Mapping[str, SocketKind]] = {
    "type1": SocketKind(Connector.TYPE1, phases=1),
    "type1_cable": SocketKind(Connector.TYPE1, phases=1),
    "j1772": SocketKind(Connector.TYPE1, phases=1),
    "type2": SocketKind(Connector.TYPE2),
    "type2_cable": SocketKind(Connector.TYPE2),
    "mennekes": SocketKind(Connector.TYPE2),
    "type3": SocketKind(Connector.TYPE3),
    "type3a": SocketKind(Connector.TYPE3, phases=1),
    "type3c": SocketKind(Connector.TYPE3),
    "scame": SocketKind(Connector.TYPE3),
    "type1_combo": SocketKind(Connector.CCS1),
    "ccs1": SocketKind(Connector.CCS1),
    "type2_combo": SocketKind(Connector.CCS2),
    "ccs": SocketKind(Connector.CCS2),
    "ccs2": SocketKind(Connector.CCS2),
    "combo": SocketKind(Connector.CCS2),
    "combo_ccs": SocketKind(Connector.CCS2),
    "chademo": SocketKind(Connector.CHADEMO),
    "nacs": SocketKind(Connector.NACS),
    "tesla_standard": SocketKind(Connector.NACS),
    "tesla_roadster": SocketKind(Connector.TYPE1, phases=1),
    "tesla_supercharger_ccs": SocketKind(Connector.CCS2),
    "gb_ac": SocketKind(Connector.GBT_AC),
    "gbt_ac": SocketKind(Connector.GBT_AC),
    "gb_dc": SocketKind(Connector.GBT_DC),
    "gbt_dc": SocketKind(Connector.GBT_DC),
    "mcs": SocketKind(Connector.MCS),
    "schuko": SocketKind(Connector.DOMESTIC, phases=1),
    "typee": SocketKind(Connector.DOMESTIC, phases=1),
    "type_e": SocketKind(Connector.DOMESTIC, phases=1),
    "bs1363": SocketKind(Connector.DOMESTIC, phases=1),
    "as3112": SocketKind(Connector.DOMESTIC, phases=1),
    "nema_5_15": SocketKind(Connector.DOMESTIC, phases=1),
    "nema_5_20": SocketKind(Connector.DOMESTIC, phases=1),
    "nema_14_30": SocketKind(Connector.DOMESTIC, phases=1),
    "nema_14_50": SocketKind(Connector.DOMESTIC, phases=1),
    "sev1011_t13": SocketKind(Connector.DOMESTIC, phases=1),
    "sev1011_t15": SocketKind(Connector.DOMESTIC, phases=3),
    "sev1011_t23": SocketKind(Connector.DOMESTIC, phases=1),
    "sev1011_t25": SocketKind(Connector.DOMESTIC, phases=3),
    "domestic": SocketKind(Connector.DOMESTIC, phases=1),
    "cee": SocketKind(Connector.CEE),
    "cee_blue": SocketKind(Connector.CEE, 3700.0, 1),  # 16 A at 230 V
    "cee_red": SocketKind(Connector.CEE, phases=3),
    "cee_red_16a": _red(16.0),
    "cee_red_32a": _red(32.0),
    "cee_red_63a": _red(63.0),
    "cee_red_125a": _red(125.0),
}
# Tesla's plug is another one by region (the proposal named above).
_TESLA: Final = frozenset(("tesla", "tesla_supercharger", "tesla_destination"))
# The greatest output of a plug of alternating current, for a station that says its own output only (IEC 62196-2; 16 A).
_AC_MOST_W: Final[Mapping[Connector, float]] = {
    Connector.TYPE1: 19_200.0,
    Connector.TYPE2: 43_000.0,
    Connector.TYPE3: 22_000.0,
    Connector.DOMESTIC: 3_700.0,
    Connector.CEE: 22_000.0,
    Connector.GBT_AC: 27_700.0,
}
_THREE_PHASE_V: Final = 300.0  # above which a voltage is one between lines
_ONE_PHASE_W: Final = 8_000.0  # 32 A at 230 V with some spare: what gives more has three phases, in Europe
_JAPAN_KOREA: Final = (24.0, 46.0, 124.0, 146.0)  # south, north, west, east

_DENIED: Final = frozenset(("no", "private", "military"))
_CAR_KEYS: Final = ("motorcar", "car", "motor_vehicle")
_OTHERS: Final = (
    *(
        "bicycle",
        "cargo_bike",
        "ebike",
        "e-bike",
        "scooter",
        "kick_scooter",
        "moped",
        "motorcycle",
        "wheelchair_charging",
    ),
    *("bus", "psv", "truck", "hgv", "boat", "ship", "mobile_phone", "phone"),
)
_TRUE: Final = frozenset(("yes", "true", "1", "designated", "official", "permissive", "only", "public"))
_ACCESS: Final[Mapping[str, Access]] = {
    "yes": Access.PUBLIC,
    "public": Access.PUBLIC,
    "permissive": Access.PUBLIC,
    "designated": Access.PUBLIC,
    "destination": Access.PUBLIC,
    "customers": Access.CUSTOMERS,
    "customer": Access.CUSTOMERS,
    "guests": Access.CUSTOMERS,
    "permit": Access.RESTRICTED,
    "members": Access.RESTRICTED,
    "residents": Access.RESTRICTED,
    "employees": Access.RESTRICTED,
    "delivery": Access.RESTRICTED,
    "restricted": Access.RESTRICTED,
    "private": Access.PRIVATE,
    "no": Access.PRIVATE,
}
_BROKEN: Final = frozenset(
    ("broken", "closed", "out_of_order", "non-operational", "nonoperational", "needs_maintenance", "no")
)
_CLOSED_HOURS: Final = frozenset(("closed", "off"))


def is_told(tags: Mapping[str, str]) -> bool:
    """Whether tags are those of a charging station or a charge point, of one that was, or will be."""
    return any(tags.get(key) == value for key, value in TOLD_TAGS)


def reason_to_leave_out(tags: Mapping[str, str]) -> tuple[LeftOut, str] | None:
    """Why a station or charge point is none that a car can charge at, and the key that says so; or None."""
    for key in LIFE_CYCLE:
        if _first(tags, key) in _TRUE:
            return LeftOut.NOT_IN_USE, key
    if not any(tags.get(key) == value for key, value in (STATION_TAG, POINT_TAG)):
        lived = (f"{prefix}:{key}" for prefix in LIFE_CYCLE for key, _ in (STATION_TAG, POINT_TAG))
        return LeftOut.NOT_IN_USE, next((key for key in lived if key in tags), STATION_TAG[0])
    cars = [key for key in _CAR_KEYS if key in tags]
    if cars:
        return None if any(_first(tags, key) not in _DENIED for key in cars) else (LeftOut.NOT_FOR_CARS, cars[0])
    plugs = {kind.connector for key in tags if (kind := socket_kind(key)) is not None} - {Connector.DOMESTIC}
    if plugs:
        return None
    for_others = [key for key in _OTHERS if _first(tags, key) in _TRUE]
    for_others += [key for key in tags if key.startswith(("socket:bosch", "socket:usb", "socket:bicycle"))]
    return (LeftOut.NOT_FOR_CARS, for_others[0]) if for_others else None


def _first(tags: Mapping[str, str], key: str) -> str:
    return tags.get(key, "").split(";")[0].strip().casefold()


def socket_kind(key: str, tesla: Connector = Connector.TESLA_EU) -> SocketKind | None:
    """The kind of socket that a key `socket:…` counts, None for other keys and kinds that no car has."""
    prefix, _, name = key.partition(":")
    if prefix != "socket" or not name or ":" in name:
        return None
    name = name.casefold().replace("-", "_")
    if name in _TESLA:
        if tesla is Connector.TESLA_EU and name == "tesla_destination":
            return SocketKind(Connector.TYPE2)
        return SocketKind(tesla)
    if name == "tesla_supercharger_ccs" and tesla is Connector.NACS:
        return SocketKind(Connector.CCS1)
    return SOCKET_KINDS.get(name)


def tesla_plug(at: Point) -> Connector:
    """The plug of Tesla's chargers at a place: NACS in North America, Japan and Korea, else type 2 that carries DC."""
    south, north, west, east = _JAPAN_KOREA
    in_asia = south <= at.lat_deg <= north and west <= at.lon_deg <= east
    return Connector.NACS if in_asia or in_north_america(at) else Connector.TESLA_EU


def sockets_of(tags: Mapping[str, str], at: Point) -> tuple[Socket, ...]:
    """Sockets for cars of a station or charge point, with what is known of each, in the order of Connector.

    An output is that of the socket's kind (`socket:type2:output`), else from its voltage and current, else what its
    name says, else the station's own (`charging_station:output`) as far as the plug can carry it. Where no socket is
    named but a voltage of three phases and a current, they are of type 2 in Europe, one for each of its capacity. Of
    sockets that are all of type 2 the station's voltage and current are the output, too.
    """
    tesla = tesla_plug(at)
    of_station = max(outputs_w(tags.get("charging_station:output", tags.get("output", ""))), default=None)
    kinds = {kind.connector for key in tags if (kind := socket_kind(key, tesla)) is not None}
    if of_station is None and kinds == {Connector.TYPE2}:
        of_station = next((output_w for _, output_w, _ in _by_voltage(tags, tesla)), None)
    found: dict[tuple[Connector, float | None, int | None], int] = {}
    for key in tags:
        kind = socket_kind(key, tesla)
        if kind is None:
            continue
        named_w = outputs_w(tags.get(f"{key}:output", ""))
        count = count_of(tags[key])
        if count is None:
            count = max(len(named_w), 1)
        if not 1 <= count <= MOST_SOCKETS:
            continue
        for output_w, sockets in _shared_out(named_w, count, _output_of(tags, key, kind, of_station)).items():
            row = (kind.connector, output_w, _phases(tags, key, kind, output_w))
            found[row] = found.get(row, 0) + sockets
    if not found:
        found = _by_voltage(tags, tesla)
    rank = list(Connector)
    return tuple(
        Socket(connector, output_w, count, phases)
        for (connector, output_w, phases), count in sorted(
            found.items(), key=lambda row: (rank.index(row[0][0]), -(row[0][1] or 0.0), row[0][2] or 0)
        )
    )


def _shared_out(named_w: list[float], count: int, otherwise_w: float | None) -> dict[float | None, int]:
    """Outputs of so many sockets: each that is told goes to one, the least of them to those that are left."""
    if not named_w:
        return {otherwise_w: count}
    outputs = sorted(named_w, reverse=True)[:count]
    outputs += [outputs[-1]] * (count - len(outputs))
    return {output_w: outputs.count(output_w) for output_w in dict.fromkeys(outputs)}


def _output_of(tags: Mapping[str, str], key: str, kind: SocketKind, of_station: float | None) -> float | None:
    """The output of a socket without one of its own [W]."""
    volt, ampere = greatest(tags.get(f"{key}:voltage", "")), greatest(tags.get(f"{key}:current", ""))
    is_dc = kind.connector in DC_CONNECTORS
    if volt and ampere:
        phases = 1 if is_dc or volt < _THREE_PHASE_V else 3
        output_w = alternating_w(volt, ampere, phases)
        return round(output_w, -2) if output_w >= 100.0 else None
    if kind.output_w is not None:
        return kind.output_w
    if of_station is None:
        return None
    return min(of_station, _AC_MOST_W.get(kind.connector, of_station))


def _phases(tags: Mapping[str, str], key: str, kind: SocketKind, output_w: float | None) -> int | None:
    """Phases of a socket of alternating current, None of others and where they are not known."""
    if kind.connector in DC_CONNECTORS:
        return None
    if kind.phases is not None:
        return kind.phases
    volt = greatest(tags.get(f"{key}:voltage", tags.get("voltage", "")))
    if volt is not None and volt >= _THREE_PHASE_V:
        return 3
    if kind.connector in (Connector.TYPE2, Connector.TYPE3, Connector.GBT_AC) and output_w is not None:
        return 3 if output_w > _ONE_PHASE_W else None
    return 1 if volt is not None else None


def _by_voltage(tags: Mapping[str, str], tesla: Connector) -> dict[tuple[Connector, float | None, int | None], int]:
    """Sockets that a station names by nothing but its voltage and current."""
    volt = greatest(tags.get("voltage", ""))
    ampere = greatest(tags.get("amperage", tags.get("current", "")))
    if volt is None or ampere is None or tesla is not Connector.TESLA_EU or not _THREE_PHASE_V <= volt <= 420.0:
        return {}
    output_w = round(alternating_w(volt, ampere, 3), -2)
    if not 0.0 < output_w <= _AC_MOST_W[Connector.TYPE2] * 1.05:
        return {}
    return {(Connector.TYPE2, output_w, 3): capacity_of(tags) or 1}


def capacity_of(tags: Mapping[str, str]) -> int | None:
    """Vehicles at a time, None where it is not known."""
    count = count_of(tags.get("capacity:motorcar", tags.get("capacity:car", tags.get("capacity", ""))))
    return count if count is not None and 1 <= count <= MOST_SOCKETS else None


def access_of(tags: Mapping[str, str]) -> Access:
    """Who may charge there."""
    for key in ("motorcar", "motor_vehicle", "vehicle", "access"):
        found = _ACCESS.get(_first(tags, key))
        if found is not None and (key == "access" or found is not Access.PUBLIC):
            return found
    return Access.UNKNOWN


def fee_of(tags: Mapping[str, str]) -> bool | None:
    """Whether charging costs anything, None where it is not known; a fee at some times is one."""
    value = tags.get("fee", "").strip().casefold()
    if value in ("no", "none", "free", "0", "donation"):
        return "fee:conditional" in tags
    if value and value not in ("unknown", "fixme", "?"):
        return True
    return _charge(tags)[1]


def charge_of(tags: Mapping[str, str]) -> Price | None:
    """What charging costs, None where nothing is said."""
    return _charge(tags)[0]


def _charge(tags: Mapping[str, str]) -> tuple[Price | None, bool | None]:
    return price_of(tags.get("charge", "") or tags.get("charge:conditional", ""), tags.get("addr:country", ""))


def operational_of(tags: Mapping[str, str]) -> bool | None:
    """Whether it works, None where the tags say nothing."""
    status = _first(tags, "operational_status") or _first(tags, "status")
    if status:
        return status not in _BROKEN
    return False if _first(tags, "opening_hours") in _CLOSED_HOURS else None
