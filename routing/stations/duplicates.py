"""Stations that are told several times, united."""

from __future__ import annotations

import math
import re
import unicodedata
from collections import defaultdict
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from routing.graph.earth import METRE_PER_DEGREE
from routing.stations.station import Access, Socket

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from routing.stations.station import Station

ALIKE_M: Final = 40.0  # between stations of one operator that are one; assumed: a row of posts at a car park
UNSAID_M: Final = 15.0  # where only one of both names its operator; assumed
MOST_LOOKED_AT: Final = 50  # of the stations of one name in one place, which is more than any place has
_LEGAL_FORMS: Final = frozenset(
    (
        *("ab", "ag", "as", "bv", "co", "gmbh", "inc", "kg", "limited", "llc", "ltd", "mbh", "nv", "oy", "plc", "sa"),
        *("sarl", "sas", "se", "sl", "spa", "srl"),
    )
)
_GENERIC: Final = frozenset(
    (
        *("ayuntamiento", "city", "commune", "comune", "deutsche", "die", "ein", "electric", "energie", "energy"),
        *("gemeinde", "hotel", "kommune", "mairie", "parkhaus", "parking", "stadt", "stadtwerke", "the", "town"),
        "ville",
    )
)
_UNNAMED: Final = ""
_WORD: Final = re.compile(r"[^\W_]+")


def united(stations: Iterable[Station]) -> tuple[tuple[Station, ...], int]:
    """Stations without those that are told twice, ordered by id, and how many were united with another.

    Of one id the later one holds. Stations at most ALIKE_M apart are one where their operators are alike, or, where not
    both name one, what else they name, or where none of both names any; and at most UNSAID_M apart where one of both
    names none. Of one source sockets and
    capacity of what is united add up, for a source tells each post once; of several sources, each plug is as the source
    says that knows most of it. Which stations are united depends on neither their order nor anything but them. O(n).
    """
    by_id = {station.id: station for station in stations}
    groups: list[list[Station]] = []
    named: dict[tuple[str, int, int], list[int]] = defaultdict(list)
    anywhere: dict[tuple[int, int], int] = {}
    keys = {station.id: names_of(station.operator, station.network) for station in by_id.values()}
    for station in sorted(by_id.values(), key=lambda station: (not keys[station.id], *_order(station))):
        names = keys[station.id]
        found = _joined(station, names, groups, named, anywhere)
        if found is not None:
            groups[found].append(station)
            continue
        lat, lon = station.at.lat_deg, station.at.lon_deg
        for name in names or {_UNNAMED}:
            named[name, *_cell(lat, lon, ALIKE_M)].append(len(groups))
        anywhere.setdefault(_cell(lat, lon, UNSAID_M), len(groups))
        groups.append([station])
    singles = sorted((_united(group) for group in groups), key=lambda station: station.id)
    return tuple(singles), len(by_id) - len(groups)


def _order(station: Station) -> tuple[object, ...]:
    """Those of which most is known first."""
    outputs = sum(socket.output_w is not None for socket in station.sockets)
    return -outputs, -len(station.sockets), station.opening_hours is None, station.id


def names_of(*texts: str) -> frozenset[str]:
    """What the names of an operator and a network have in common with others of the same, empty where none is said."""
    return frozenset().union(*map(_names_in, texts))


@lru_cache(maxsize=2**16)
def _names_in(text: str) -> frozenset[str]:
    """A name without accents and legal forms, and its first word where that tells it from others."""
    letters = unicodedata.normalize("NFKD", text.casefold())
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    words = [word for word in _WORD.findall(plain.replace("+", "")) if word not in _LEGAL_FORMS]
    if not words:
        return frozenset()
    tells = len(words[0]) >= 3 and words[0] not in _GENERIC
    return frozenset((" ".join(words), words[0]) if tells else (" ".join(words),))


def _joined(
    station: Station,
    names: frozenset[str],
    groups: Sequence[Sequence[Station]],
    named: dict[tuple[str, int, int], list[int]],
    anywhere: dict[tuple[int, int], int],
) -> int | None:
    """The nearest group that a station belongs to, by the first station of it."""
    lat, lon = station.at.lat_deg, station.at.lon_deg
    near = [
        (away_m, group)
        for name in names or {_UNNAMED}
        for cell in _cells_around(lat, lon, ALIKE_M)
        for group in named.get((name, *cell), ())[:MOST_LOOKED_AT]
        if (away_m := _away_m(station, groups[group][0])) <= ALIKE_M and _may_be_one(station, groups[group][0])
    ]
    if not names:
        near += [
            (away_m, group)
            for cell in _cells_around(lat, lon, UNSAID_M)
            if (group := anywhere.get(cell, -1)) >= 0 and (away_m := _away_m(station, groups[group][0])) <= UNSAID_M
        ]
    return min(near)[1] if near else None


def _may_be_one(a: Station, b: Station) -> bool:
    """Whether their operators do not say otherwise: a network may be one of many operators."""
    if a.operator == b.operator:
        return True
    of_a, of_b = names_of(a.operator), names_of(b.operator)
    return not of_a or not of_b or not of_a.isdisjoint(of_b)


def _cell(lat_deg: float, lon_deg: float, side_m: float) -> tuple[int, int]:
    row = math.floor(lat_deg * METRE_PER_DEGREE / side_m)
    return row, _column(row, lon_deg, side_m)


def _column(row: int, lon_deg: float, side_m: float) -> int:
    """Column of a place among the cells of a row, each at least so wide anywhere in the row."""
    nearest_pole_deg = max(abs(row), abs(row + 1)) * side_m / METRE_PER_DEGREE
    return math.floor(lon_deg * METRE_PER_DEGREE * max(math.cos(math.radians(nearest_pole_deg)), 0.0) / side_m)


def _cells_around(lat_deg: float, lon_deg: float, side_m: float) -> list[tuple[int, int]]:
    middle = math.floor(lat_deg * METRE_PER_DEGREE / side_m)
    return [
        (row, _column(row, lon_deg, side_m) + step) for row in (middle - 1, middle, middle + 1) for step in (-1, 0, 1)
    ]


def _away_m(a: Station, b: Station) -> float:
    shrink = math.cos(math.radians(a.at.lat_deg))
    east = math.remainder(a.at.lon_deg - b.at.lon_deg, 360.0) * shrink
    return METRE_PER_DEGREE * math.hypot(east, a.at.lat_deg - b.at.lat_deg)


def _united(group: Sequence[Station]) -> Station:
    """One station of a group, its place and id those of the first."""
    first = group[0]
    if len(group) == 1:
        return first
    by_source: dict[str, list[Station]] = defaultdict(list)
    for station in group:
        by_source[station.source].append(station)
    capacities = [_sum_of_known([station.capacity for station in stations]) for stations in by_source.values()]
    known = [station.operational for station in group if station.operational is not None]
    return replace(
        first,
        sockets=best_sockets([added_up(stations) for stations in by_source.values()]),
        name=_first(group, "name"),
        operator=_first(group, "operator"),
        network=_first(group, "network"),
        capacity=max((capacity for capacity in capacities if capacity is not None), default=None),
        access=next((s.access for s in group if s.access is not Access.UNKNOWN), Access.UNKNOWN),
        fee=next((s.fee for s in group if s.fee is not None), None),
        price=next((s.price for s in group if s.price is not None), None),
        opening_hours=next((s.opening_hours for s in group if s.opening_hours is not None), None),
        operational=any(known) if known else None,
        merged=tuple(sorted({other for station in group for other in (station.id, *station.merged)} - {first.id})),
    )


def _first(group: Sequence[Station], field: str) -> str:
    return next((text for station in group if (text := getattr(station, field))), "")


def _sum_of_known(capacities: Sequence[int | None]) -> int | None:
    known = [capacity for capacity in capacities if capacity is not None]
    return sum(known) if len(known) == len(capacities) else None


def added_up(stations: Sequence[Station]) -> tuple[Socket, ...]:
    """Sockets of stations of one source: those alike counted together."""
    counts: dict[Socket, int] = defaultdict(int)
    for station in stations:
        for socket in station.sockets:
            counts[replace(socket, count=1)] += socket.count
    return tuple(replace(socket, count=count) for socket, count in counts.items())


def best_sockets(by_source: Sequence[tuple[Socket, ...]]) -> tuple[Socket, ...]:
    """Each plug as told by the source that knows most of it: more outputs, then more sockets; the first of equals."""
    found: list[Socket] = []
    for connector in dict.fromkeys(socket.connector for sockets in by_source for socket in sockets):
        versions = [[socket for socket in sockets if socket.connector is connector] for sockets in by_source]
        found += max(
            versions, key=lambda v: (sum(s.count for s in v if s.output_w is not None), sum(s.count for s in v))
        )
    return tuple(found)
