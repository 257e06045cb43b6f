"""The German register of charging stations (Bundesnetzagentur), its present form and the one of before 2025."""

from __future__ import annotations

import re
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from energy.charging.charging import Connector
from routing.stations.formats.gathering import POWERS_PASSED, Gathering, clean, with_sockets
from routing.stations.formats.hours import ALWAYS, REPEATED, SPAN, day_of, weekly_hours
from routing.stations.formats.numbers import count_of, place_of, power_w_of
from routing.stations.formats.plugs import NO_LETTERS, socket_of
from routing.stations.notes import LeftOutError, shown
from routing.stations.station import Access, Socket, Station, StationSource

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from routing.stations.formats.tables import Table

NAME: Final = "Ladesäulenregister (CSV)"
KEY: Final = "bnetza"
GERMANY: Final = (47.0, 5.5, 55.3, 15.5)  # south, west, north, east [deg]
MOST_POINTS: Final = 6  # charging points of a row
HOUSEHOLD_W: Final = 3_700.0  # most of a Schuko socket
PLUGS: Final = MappingProxyType(  # letters and digits of names, old and present
    {
        **dict.fromkeys(
            (
                "acsteckdosetyp2",
                "ackupplungtyp2",
                "actyp2steckdose",
                "actyp2fahrzeugkupplung",
                "actyp2kupplung",
                "typ2",
            ),
            Connector.TYPE2,
        ),
        **dict.fromkeys(
            (
                *("acsteckdosetyp1", "ackupplungtyp1", "actyp1steckdose", "actyp1fahrzeugkupplung", "steckdosetyp1"),
                "adaptertyp1autoauftyp2fahrzeugkupplung",
            ),
            Connector.TYPE1,
        ),
        **dict.fromkeys(
            ("dckupplungcombo", "dcfahrzeugkupplungtypcombo2ccs", "dcfahrzeugkupplungtypcombo2", "dckupplungcomboccs"),
            Connector.CCS2,
        ),
        **dict.fromkeys(("dcchademo", "chademo", "dckupplungchademo"), Connector.CHADEMO),
        **dict.fromkeys(("acschuko", "schuko"), Connector.DOMESTIC),
        **dict.fromkeys(
            ("accee3polig", "accee5polig", "accee", "cee", "ceestecker", "accee3pol", "accee5pol", "acceesteckdose"),
            Connector.CEE,
        ),
        **dict.fromkeys(("actyp3", "typ3", "actyp3steckdose"), Connector.TYPE3),
        **dict.fromkeys(
            ("dctesla", "dckupplungtesla", "typ2tesla", "tesla", "dckupplungteslatyp2"), Connector.TESLA_EU
        ),
    }
)
PHASES: Final = MappingProxyType({"accee3polig": 1, "accee3pol": 1, "accee5polig": 3, "accee5pol": 3})
APART: Final = re.compile(r"\s*[,;\n]\s*")
POWERS_APART: Final = re.compile(r"\s*[;\n|]\s*")
OF_DAY: Final = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})")
BROKEN: Final = frozenset(("außer betrieb", "in wartung", "ausser betrieb", "defekt", "gestört"))
GONE: Final = MappingProxyType(
    {
        "in planung": "planned",
        "geplant": "planned",
        "im bau": "planned",
        "stillgelegt": "removed",
        "abgebaut": "removed",
    }
)


def recognises(names: frozenset[str]) -> bool:
    """Whether a header is that of the register."""
    return {"betreiber", "breitengrad", "steckertypen1"} <= names and bool({"längengrad", "laengengrad"} & names)


def read(table: Table, gathering: Gathering, retrieved: str) -> StationSource:
    """Gather the stations of the rows, a device each; where they are from, as of the day that the file names."""
    own_id = table.column("Ladeeinrichtungs-ID")
    columns = {
        name: table.column(*names)
        for name, names in {
            "operator": ("Betreiber",),
            "network": ("Anzeigename (Karte)",),
            "status": ("Status",),
            "name": ("Standortbezeichnung",),
            "street": ("Straße", "strasse"),
            "number": ("Hausnummer",),
            "town": ("Ort",),
            "lat": ("Breitengrad",),
            "lon": ("Längengrad", "laengengrad"),
            "points": ("Anzahl Ladepunkte",),
            "power": ("Nennleistung Ladeeinrichtung [kW]", "Anschlussleistung", "Anschlussleistung [kW]"),
            "hours": ("Öffnungszeiten",),
            "days": ("Öffnungszeiten: Wochentage",),
            "times": ("Öffnungszeiten: Tageszeiten",),
        }.items()
    }
    points = [
        (plugs, table.column(f"Nennleistung Stecker{k}", f"P{k} [kW]"))
        for k in range(1, MOST_POINTS + 1)
        if (plugs := table.column(f"Steckertypen{k}")) is not None
    ]
    for number, row in table.rows():
        gathering.number = number

        def cell(name: str, row: Sequence[str] = row) -> str:
            at = columns[name]
            return "" if at is None else row[at].strip()

        try:
            pairs = [
                (clean(row[plugs], 400), "" if power is None else clean(row[power], 100)) for plugs, power in points
            ]
            gathering.add(_station(cell, pairs, "" if own_id is None else clean(row[own_id], 40), gathering))
        except LeftOutError as error:
            gathering.leave_out(number, error)
    return StationSource(
        KEY,
        "Ladesäulenregister, Bundesnetzagentur.de",
        "CC BY 4.0",
        "https://www.bundesnetzagentur.de/ladesaeulenkarte",
        _day(table.before) or retrieved,
    )


def _day(lines: Sequence[str]) -> str:
    """The day of the last change, as the lines before the header name it; "" where they don't."""
    for line in lines:
        match = OF_DAY.search(line) if "ktualisierung" in line else None
        if match is not None:
            return f"{match[3]}-{int(match[2]):02d}-{int(match[1]):02d}"
    return ""


def _station(
    cell: Callable[[str], str], pairs: Sequence[tuple[str, str]], own_id: str, gathering: Gathering
) -> Station:
    status = cell("status").lower()
    if status in GONE:
        raise LeftOutError(GONE[status], "Status", shown(status), "in Betrieb")
    at = place_of(cell("lat"), cell("lon"), GERMANY)
    place_id = f"{KEY}:{at.lat_deg:.6f},{at.lon_deg:.6f}"
    sockets = _sockets(pairs, cell("power"), gathering)
    operator = clean(cell("operator"))
    street = " ".join(filter(None, (cell("street"), cell("number"))))
    return Station(
        id=f"{KEY}:{own_id}" if own_id else gathering.free_id(place_id),
        at=at,
        sockets=sockets,
        name=clean(cell("name")) or clean(", ".join(filter(None, (street, cell("town"))))),
        operator=operator,
        network=clean(cell("network")) or operator,
        capacity=count_of(cell("points")),
        access=Access.PUBLIC,  # which the register is of
        opening_hours=_hours(clean(cell("hours")), clean(cell("days"), 300), clean(cell("times"), 300), gathering),
        operational=False if status in BROKEN else True if status == "in betrieb" else None,
        source=KEY,
    )


def _sockets(pairs: Sequence[tuple[str, str]], whole: str, gathering: Gathering) -> tuple[Socket, ...]:
    """Sockets of the charging points, each with the plugs of one and their power; whole: of the device."""
    sockets: list[Socket] = []
    unknown: dict[str, int] = {}
    given = [(plugs, power) for plugs, power in pairs if plugs]
    for plugs, power in given:
        names = [name for name in APART.split(plugs) if name]
        for name, power_w in zip(
            names, _powers(power, whole if len(given) == 1 else "", len(names), gathering), strict=True
        ):
            plain = NO_LETTERS.sub("", name.lower())
            connector = PLUGS.get(plain)
            if connector is None:
                gathering.unknown_plug(name)
                unknown[name] = 1
                continue
            if connector is Connector.DOMESTIC and power_w is not None:
                power_w = min(power_w, HOUSEHOLD_W)
            sockets.append(socket_of(connector, power_w, phases=PHASES.get(plain)))
    return with_sockets(sockets, unknown)


def _powers(power: str, whole: str, plugs: int, gathering: Gathering) -> list[float | None]:
    """The power of each plug of a charging point [W]: one for each, or the same for all."""
    texts = [text for text in POWERS_APART.split(power) if text]
    if not texts and whole:
        texts = [whole]
        gathering.note("powers of the only charging point from that of the device")
    found = [power_w_of(text, decimal_comma=True) for text in texts]
    if None in found:
        gathering.note(POWERS_PASSED, value=texts[found.index(None)])
    if len(found) == plugs:
        return found
    return [max((power_w for power_w in found if power_w is not None), default=None)] * plugs


def _hours(kind: str, days: str, times: str, gathering: Gathering) -> str | None:
    """Opening hours of the register's three columns in OpenStreetMap's syntax."""
    if kind.replace("/", "").replace(" ", "") == "247":
        return ALWAYS
    if not days or not times:
        return None
    hours = _hours_of_days(days, times)
    if hours is None:
        gathering.note("opening hours that are not understood", value=f"{days} {times}")
    return hours


@lru_cache(maxsize=REPEATED)
def _hours_of_days(days: str, times: str) -> str | None:
    named = [day_of(day) for day in APART.split(days) if day]
    spans = [SPAN.fullmatch(span) for span in APART.split(times) if span]
    if len(spans) == 1:
        spans *= len(named)
    by_day: dict[int, list[tuple[str, str]]] = {}
    if len(named) == len(spans):
        for day, span in zip(named, spans, strict=True):
            if day is None or span is None:
                by_day.clear()
                break
            by_day.setdefault(day, []).append((span[1], span[2]))
    return weekly_hours(by_day)
