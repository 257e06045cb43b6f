"""Names of plugs that people write, told to the kinds that vehicles have."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from energy.charging.charging import DC_CONNECTORS, Connector
from routing.stations.formats.numbers import MOST_AC_W, phases_of
from routing.stations.station import Socket

if TYPE_CHECKING:
    from collections.abc import Iterable

    from routing.places import Point

NO_LETTERS: Final = re.compile(r"[^a-z0-9]+")
AMERICAN: Final = {"ccs": Connector.CCS1, "tesla": Connector.NACS, "destination": Connector.NACS}
ELSEWHERE: Final = {"ccs": Connector.CCS2, "tesla": Connector.TESLA_EU, "destination": Connector.TYPE2}
BY_PLACE: Final = {  # names that are one plug in North America and another elsewhere
    **dict.fromkeys(("ccs", "combo", "ccscombo", "comboccs", "dccombo", "ccsdc", "dcccs"), "ccs"),
    **dict.fromkeys(("tesla", "teslasupercharger", "supercharger", "teslas", "teslastandard"), "tesla"),
    "tesladestination": "destination",
}
NAMES: Final = {
    **dict.fromkeys(
        ("type1", "typ1", "j1772", "saej1772", "iec62196t1", "iec621962type1", "yazaki", "type1cable", "type1j1772"),
        Connector.TYPE1,
    ),
    **dict.fromkeys(
        (
            *("type2", "typ2", "t2", "mennekes", "iec62196t2", "iec621962type2", "type2cable", "type2socket", "typ2ac"),
            *("actype2", "actyp2", "type2ac", "actyp2steckdose", "acsteckdosetyp2", "ackupplungtyp2", "type2mennekes"),
            *("actyp2fahrzeugkupplung", "type2tethered", "type2untethered"),
        ),
        Connector.TYPE2,
    ),
    **dict.fromkeys(
        ("type3", "typ3", "type3a", "type3c", "scame", "iec62196t3a", "iec62196t3c", "actyp3"), Connector.TYPE3
    ),
    **dict.fromkeys(
        (
            *("domestic", "schuko", "household", "acschuko", "cee74", "cee75", "typee", "typeef", "typef", "bs1363"),
            *("uk3pin", "3pin", "nema515", "nema520", "nema1450", "nema615", "nema620", "nema1430", "tt30", "as3112"),
            *("sev1011", "sev1011t13", "sev1011t23", "sev1011t25", "t13", "t23", "typej", "typei", "typel", "nematt30"),
            *("domesticf", "domestice", "domesticg", "ef", "steckdose", "sev1011t15", "nbr14136", "cei2316"),
        ),
        Connector.DOMESTIC,
    ),
    **dict.fromkeys(
        (
            *("cee", "ceeblue", "ceered", "ceered16a", "ceered32a", "ceered63a", "ceered64a", "ceered125a", "iec60309"),
            *("commando", "bluecommando", "acceedose", "accee5polig", "accee3polig", "drehstrom", "cee16", "cee32"),
            *("ceeblau", "ceerot"),
        ),
        Connector.CEE,
    ),
    **dict.fromkeys(("gbtac", "gbac", "gbt202342"), Connector.GBT_AC),
    **dict.fromkeys(("gbtdc", "gbdc", "gbt202343"), Connector.GBT_DC),
    **dict.fromkeys(
        ("ccs1", "ccstype1", "type1combo", "combo1", "type1ccs", "iec62196t1combo", "j1772combo", "ccscombo1"),
        Connector.CCS1,
    ),
    **dict.fromkeys(
        (
            *("ccs2", "ccstype2", "type2combo", "combo2", "type2ccs", "iec62196t2combo", "ccscombo2", "combotype2"),
            *("comboccs2", "dckupplungcombo", "dcfahrzeugkupplungtypcombo2ccs", "typ2combo", "ccstyp2", "teslaccs"),
            "teslasuperchargerccs",
        ),
        Connector.CCS2,
    ),
    **dict.fromkeys(("chademo", "dcchademo"), Connector.CHADEMO),
    **dict.fromkeys(("nacs", "j3400", "saej3400", "teslanacs"), Connector.NACS),
    **dict.fromkeys(("teslaeu",), Connector.TESLA_EU),
    **dict.fromkeys(("mcs", "megawatt", "j3271", "saej3271"), Connector.MCS),
}


def connector_of(name: str, at: Point) -> Connector | None:
    """The plug of a name, letter case, blanks and signs aside; None where it is unknown."""
    plain = NO_LETTERS.sub("", name.lower())
    if plain in BY_PLACE:
        return (AMERICAN if in_north_america(at) else ELSEWHERE)[BY_PLACE[plain]]
    return NAMES.get(plain)


def in_north_america(at: Point) -> bool:
    """Whether a place is where plugs of SAE are used: the United States, Canada, Mexico, and what lies between."""
    return at.lat_deg >= 14.0 and -170.0 <= at.lon_deg <= -50.0


def socket_of(connector: Connector, output_w: float | None, count: int = 1, *, phases: int | None = None) -> Socket:
    """Sockets of one kind; of alternating current with no more power than the plug carries, and the phases it needs."""
    if connector in DC_CONNECTORS:
        return Socket(connector, output_w, count)
    most_w = MOST_AC_W.get(connector)
    if output_w is not None and most_w is not None:
        output_w = min(output_w, most_w)
    return Socket(connector, output_w, count, phases or phases_of(connector, output_w))


def joined(sockets: Iterable[Socket]) -> tuple[Socket, ...]:
    """Sockets with those of one kind, power and phases as one entry."""
    counts: dict[tuple[Connector, float | None, int | None], int] = {}
    for socket in sockets:
        kind = (socket.connector, socket.output_w, socket.phases)
        counts[kind] = counts.get(kind, 0) + socket.count
    return tuple(Socket(kind, output_w, count, phases) for (kind, output_w, phases), count in counts.items())
