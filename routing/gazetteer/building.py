"""Makes what an index holds of what was read of a map: streets, house numbers, what each thing is a part of, limits."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.gazetteer.context import find_parents
from routing.gazetteer.countries import country_names
from routing.gazetteer.entries import SETTLEMENTS, Box, Entry, House, Kind
from routing.gazetteer.importance import with_population
from routing.gazetteer.streets import joined_streets
from routing.gazetteer.words import folded, house_number, words_of
from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from routing.gazetteer.entries import Collected
    from routing.stations.station import Stations

MOST_ENTRIES: Final = 1_500_000
MOST_HOUSES: Final = 3_000_000
SQUARE_DEG: Final = 0.05
WIDEST_DEG: Final = 1.0  # of what house numbers are looked for on
STREET_AWAY_DEG: Final = 0.03  # from a house number to the street it names, about 3 km; assumed
JOINED_DEG: Final = 0.01  # between streets of a name in a town that are one, about 1 km; assumed
LEAST_OF_POSTCODE: Final = 3  # things with a postal code, from which on it is a place of its own
LEAST_OF_TOWN: Final = 3  # addresses that name a town which the map has no place of
ADDRESS_TOWN: Final = 0.45


@dataclass(frozen=True, slots=True)
class Numbered:
    """A house number of the street at a position of the entries; number: as it is looked up."""

    street: int
    number: str
    house: House


@dataclass(frozen=True, slots=True)
class Content:
    """All of an index, entries with the most important first; left_out: counts by reason."""

    entries: list[Entry]
    houses: list[Numbered]
    left_out: Mapping[str, int]
    region_words: tuple[str, ...]
    country: str
    country_names: Mapping[str, str]
    state_names: Mapping[str, str]

    def counts(self) -> dict[str, int]:
        """How many things of each kind."""
        kinds = Counter(entry.kind.value for entry in self.entries)
        if self.houses:
            kinds[Kind.HOUSE.value] += len(self.houses)
        return dict(sorted(kinds.items()))


def content_of(
    found: Collected,
    stations: Stations | None,
    graph_name: str,
    *,
    most_entries: int = MOST_ENTRIES,
    most_houses: int = MOST_HOUSES,
) -> Content:
    """What an index holds of what was read, O(n log n); the least important entries beyond the limits are left out.

    stations: of the graph, in place of those of the map; None: those of the map.
    """
    entries = [entry for entry in found.entries if stations is None or entry.kind is not Kind.STATION]
    if stations is not None:
        entries += _station_entries(stations)
    entries = _single(entries)
    streets = joined_streets(found.pieces)
    entries += streets
    houses = list(_with_streets(found, entries))
    entries += _towns_of_addresses(entries, found.houses)
    entries += _postcodes(entries, found.houses)
    town_of = find_parents(entries)
    joined = town_of | _joined_in_towns(entries)
    order = sorted((k for k in range(len(entries)) if k not in joined), key=lambda k: (-entries[k].importance, k))
    if len(order) > most_entries:
        found.leave_out(f"the least important things beyond {most_entries}", len(order) - most_entries)
        order = order[:most_entries]
    place_of = {old: new for new, old in enumerate(order)}
    place_of |= {old: place_of[known] for old, known in joined.items() if known in place_of}
    for k in order:
        entry = entries[k]
        entry.parents = {kind: place_of[up] for kind, up in entry.parents.items() if up in place_of}
    numbered = [Numbered(place_of[street], number, house) for street, number, house in houses if street in place_of]
    if len(numbered) > most_houses:
        found.leave_out(f"house numbers beyond {most_houses}", len(numbered) - most_houses)
        del numbered[most_houses:]
    return Content(
        [entries[k] for k in order],
        numbered,
        dict(sorted(found.left_out.items())),
        words_of(graph_name),
        found.country,
        found.country_names or country_names(found.country),
        found.state_names,
    )


def _station_entries(stations: Stations) -> list[Entry]:
    found = []
    for station in stations.stations:
        name = station.name or station.network or station.operator
        if not name:
            continue
        kind, _, number = station.id.partition(":")
        is_osm = kind == "osm" and number[:1] in ("n", "w", "r") and number[1:].isdigit()
        others = dict.fromkeys(text for text in (station.network, station.operator) if text and text != name)
        found.append(
            Entry(
                Kind.STATION,
                number[0] if is_osm else "",
                int(number[1:]) if is_osm else 0,
                "amenity",
                "charging_station",
                name[:200],
                {f"*{k}": text[:200] for k, text in enumerate(others)},
                station.at.lat_deg,
                station.at.lon_deg,
                0.16,
            )
        )
    return found


def _single(entries: Sequence[Entry]) -> list[Entry]:
    """Entries without those that are there as a point and as an area: same name and value within 300 m."""
    kept: dict[tuple[str, str, int, int], Entry] = {}
    for entry in entries:
        if entry.level:
            kept[("", str(entry.osm_id), 0, 0)] = entry
            continue
        key = (entry.value, folded(entry.name), round(entry.lat / 0.004), round(entry.lon / 0.004))
        known = kept.get(key)
        if known is None or (
            entry.kind is not Kind.STATION
            and (entry.importance, bool(entry.street))
            > (
                known.importance,
                bool(known.street),
            )
        ):
            kept[key] = entry
        elif entry.kind is Kind.STATION:
            kept[(*key[:1], f"{key[1]} {entry.osm_type}{entry.osm_id}", *key[2:])] = entry
    return list(kept.values())


def _with_streets(found: Collected, entries: list[Entry]) -> list[tuple[int, str, House]]:
    """House numbers with the entry of their street, which is made where the map has none of that name near; O(n)."""
    by_name: dict[tuple[str, int, int], list[int]] = {}

    def add(k: int) -> None:
        name, (west, south, east, north) = folded(entries[k].name), _box(entries[k])
        for row in range(_square(south - STREET_AWAY_DEG), _square(north + STREET_AWAY_DEG) + 1):
            for column in range(_square(west - STREET_AWAY_DEG), _square(east + STREET_AWAY_DEG) + 1):
                by_name.setdefault((name, row, column), []).append(k)

    named = {folded(house.street) for house in found.houses}
    for k, entry in enumerate(entries):
        if (entry.kind is Kind.STREET or entry.key == "place") and folded(entry.name) in named:
            add(k)
    numbered: dict[tuple[int, str], tuple[int, str, House]] = {}
    for house in found.houses:
        lat, lon = house.lat_e7 / E7, house.lon_e7 / E7
        near = by_name.get((folded(house.street), _square(lat), _square(lon)), ())
        away, street = min(((_away_deg(entries[k], lat, lon), k) for k in near), default=(math.inf, -1))
        if away > STREET_AWAY_DEG:
            street = len(entries)
            entries.append(
                Entry(Kind.STREET, house.osm_type, house.osm_id, "place", "street", house.street, {}, lat, lon, 0.2)
            )
            add(street)
        _widen(entries[street], house)
        for number in _numbers(house.number):
            numbered.setdefault((street, number), (street, number, house))
    return list(numbered.values())


def _square(degrees: float) -> int:
    """The row or column of squares in which a place lies, by which streets are found that are near a house."""
    return math.floor(degrees / SQUARE_DEG)


def _box(entry: Entry) -> Box:
    """The extent of a thing, cut where it is wider than any street: a place of that name."""
    west, south, east, north = entry.box or (entry.lon, entry.lat, entry.lon, entry.lat)
    half = WIDEST_DEG / 2.0
    west, east = max(west, entry.lon - half), min(east, entry.lon + half)
    return west, max(south, entry.lat - half), east, min(north, entry.lat + half)


def _away_deg(entry: Entry, lat: float, lon: float) -> float:
    """How far a place is from the extent of an entry, roughly."""
    west, south, east, north = entry.box or (entry.lon, entry.lat, entry.lon, entry.lat)
    return max(west - lon, lon - east, 0.0) + max(south - lat, lat - north, 0.0)


def _widen(street: Entry, house: House) -> None:
    """Let a street be found by the postal code and the town of its houses."""
    if house.postcode and house.postcode not in street.further and len(street.further) < 8:
        street.further = (*street.further, house.postcode)
    if house.postcode and not street.postcode:
        street.postcode = house.postcode
    if house.city and not street.city_name:
        street.city_name = house.city


def _numbers(text: str) -> list[str]:
    """The house numbers that a tag lists, such as `12;14` and `12-16`, as they are looked up."""
    numbers = [house_number(part) for part in text.replace(",", ";").split(";")]
    if "-" in text and ";" not in text:
        numbers += [house_number(part) for part in text.split("-")]
    return [number for number in dict.fromkeys(numbers) if number]


def _towns_of_addresses(entries: Sequence[Entry], houses: Sequence[House]) -> list[Entry]:
    """Towns that addresses name and the map has no place of, in the middle of these addresses."""
    known = {folded(entry.name) for entry in entries if entry.key in ("place", "boundary")}
    places: dict[str, list[tuple[str, float, float]]] = {}
    for house in houses:
        if house.city and folded(house.city) not in known:
            places.setdefault(folded(house.city), []).append((house.city, house.lat_e7 / E7, house.lon_e7 / E7))
    for entry in entries:
        if entry.city_name and entry.kind is not Kind.STREET and folded(entry.city_name) not in known:
            places.setdefault(folded(entry.city_name), []).append((entry.city_name, entry.lat, entry.lon))
    made = []
    for found in places.values():
        if len(found) < LEAST_OF_TOWN:
            continue
        lat, lon = np.median([place[1] for place in found]), np.median([place[2] for place in found])
        name = Counter(place[0] for place in found).most_common(1)[0][0]
        made.append(Entry(Kind.CITY, "", 0, "place", SETTLEMENTS[2], name, {}, float(lat), float(lon), ADDRESS_TOWN))
    return made


def _postcodes(entries: Sequence[Entry], houses: Sequence[House]) -> list[Entry]:
    """Postal codes that several things have, in the middle of these."""
    places: dict[str, list[tuple[float, float]]] = {}
    for house in houses:
        if house.postcode:
            places.setdefault(house.postcode, []).append((house.lat_e7 / E7, house.lon_e7 / E7))
    for entry in entries:
        if entry.postcode:
            places.setdefault(entry.postcode, []).append((entry.lat, entry.lon))
    made = []
    for code, found in places.items():
        if len(found) < LEAST_OF_POSTCODE or not code[:1].isalnum() or len(code) > 12:
            continue
        lats, lons = [lat for lat, _ in found], [lon for _, lon in found]
        box = (min(lons), min(lats), max(lons), max(lats))
        lat, lon = float(np.median(lats)), float(np.median(lons))
        importance = with_population(0.28, 10 * len(found))
        made.append(Entry(Kind.POSTCODE, "", 0, "place", "postcode", code, {}, lat, lon, min(0.34, importance), box))
    return made


def _joined_in_towns(entries: Sequence[Entry]) -> dict[int, int]:
    """Streets of a name and a town that lie near each other, each by the one that it becomes a part of."""
    by_name: dict[tuple[str, int], list[int]] = {}
    joined: dict[int, int] = {}
    for k, entry in enumerate(entries):
        if entry.kind is not Kind.STREET or not entry.lines or Kind.CITY not in entry.parents:
            continue
        others = by_name.setdefault((folded(entry.name), entry.parents[Kind.CITY]), [])
        known = next((other for other in others if _gap_deg(entries[other], entry) <= JOINED_DEG), None)
        if known is None:
            others.append(k)
            continue
        joined[k] = known
        street = entries[known]
        street.lines += entry.lines
        street.further = tuple(dict.fromkeys((*street.further, *entry.further)))[:8]
        street.importance = max(street.importance, entry.importance)
        if street.box is not None and entry.box is not None:
            west, south, east, north = entry.box
            box = street.box
            street.box = (min(box[0], west), min(box[1], south), max(box[2], east), max(box[3], north))
    return joined


def _gap_deg(first: Entry, second: Entry) -> float:
    """How far the extents of two streets are apart, roughly."""
    assert first.box is not None
    assert second.box is not None
    return max(
        first.box[0] - second.box[2],
        second.box[0] - first.box[2],
        first.box[1] - second.box[3],
        second.box[1] - first.box[3],
        0.0,
    )
