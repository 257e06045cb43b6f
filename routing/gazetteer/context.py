"""Of which town, district, county, state and country each thing is: by boundaries, else by the nearest places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from scipy.spatial import cKDTree

from routing.gazetteer.entries import SETTLEMENTS, Entry, Kind
from routing.gazetteer.words import folded
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

# how far places reach [m], and how many times as far at most things are said to be of them; assumed
REACH_M: Final = {
    "city": 9000.0,
    "town": 3500.0,
    "municipality": 3000.0,
    "village": 1800.0,
    "hamlet": 800.0,
    "borough": 3000.0,
    "suburb": 1800.0,
    "quarter": 900.0,
    "neighbourhood": 700.0,
}
BEYOND: Final = {Kind.CITY: 2.5, Kind.DISTRICT: 1.6}
MOST_STEPS: Final = 4  # of a third more that a place reaches farther than its kind by its population


def find_parents(entries: Sequence[Entry]) -> dict[int, int]:
    """Write into each entry of which others it is a part; the towns whose boundaries are entries, too. O(n log n)."""
    lat = np.array([entry.lat for entry in entries])
    lon = np.array([entry.lon for entry in entries])
    _by_place(entries, lat, lon, Kind.CITY)
    _by_place(entries, lat, lon, Kind.DISTRICT)
    town_of = _by_boundary(entries, lat, lon)
    for k, entry in enumerate(entries):
        entry.parents = {kind: parent for kind, parent in entry.parents.items() if parent != k}
    return town_of


def _by_place(entries: Sequence[Entry], lat: NDArray[np.float64], lon: NDArray[np.float64], kind: Kind) -> None:
    """The place of a kind in whose reach each thing lies deepest."""
    places = [k for k, entry in enumerate(entries) if entry.kind is kind and entry.value in REACH_M]
    if not places:
        return
    shrink = float(np.cos(np.radians(np.median(lat))))
    flat = np.column_stack((lon * shrink, lat)) * METRE_PER_DEGREE
    reach = np.array([_reach_m(entries[k]) for k in places])
    best, depth = np.full(len(entries), -1), np.full(len(entries), np.inf)
    for size in np.unique(reach):  # a tree for each reach, of which there are few
        own = np.flatnonzero(reach == size)
        away_m, found = cKDTree(flat[np.array(places)[own]]).query(flat, 1)
        at = np.asarray(found)
        away = away_m / size
        nearer = (away < depth) & (away <= BEYOND[kind])
        depth[nearer] = away[nearer]
        best[nearer] = np.array(places)[own[at[nearer]]]
    for entry, parent in zip(entries, best.tolist(), strict=True):
        is_part = entry.kind not in (Kind.CITY, Kind.COUNTY, Kind.STATE, Kind.COUNTRY)
        if parent >= 0 and is_part and (kind is Kind.CITY or entry.kind is not Kind.DISTRICT):
            entry.parents[kind] = parent


def _reach_m(entry: Entry) -> float:
    """How far a place reaches, in steps of a third more."""
    reach_m = REACH_M[entry.value]
    if entry.population > 1000:
        grown = max(reach_m, 25.0 * entry.population**0.5)
        reach_m *= 1.33 ** min(MOST_STEPS, round(np.log(grown / reach_m) / np.log(1.33)))
    return reach_m


def _by_boundary(entries: Sequence[Entry], lat: NDArray[np.float64], lon: NDArray[np.float64]) -> dict[int, int]:
    """The boundaries around each thing; where a town has one, it goes before the nearest place.

    Returns the towns that have one, by the boundary.
    """
    areas = [k for k, entry in enumerate(entries) if entry.level and entry.area is not None]
    if not areas:
        return {}
    town_of = _towns_of(entries, areas)
    tree = shapely.STRtree(np.asarray(shapely.points(lon, lat), np.object_))
    around: dict[int, list[int]] = {}
    for k in areas:
        area = entries[k].area
        shapely.prepare(area)
        for inside in tree.query(area, predicate="contains").tolist():
            around.setdefault(inside, []).append(k)
    for inside, held in around.items():
        entry = entries[inside]
        for k in sorted((k for k in held if k != inside), key=lambda k: entries[k].level):
            level, parents = entries[k].level, entry.parents
            if entry.level and level >= entry.level:
                continue
            if k in town_of:
                if town_of[k] != inside:
                    parents[Kind.CITY] = town_of[k]
            elif level == 2:
                parents[Kind.COUNTRY] = k
            elif level < 6:
                parents.setdefault(Kind.STATE, k)
            elif level < 8:
                parents[Kind.COUNTY] = k
            elif level == 8:
                parents.setdefault(Kind.CITY, k)
            elif entry.kind not in (Kind.DISTRICT, Kind.CITY):
                parents.setdefault(Kind.DISTRICT, k)
    return town_of


def _towns_of(entries: Sequence[Entry], areas: Sequence[int]) -> dict[int, int]:
    """The town whose boundary an area is: a place of its name within it. It gets the extent of the area."""
    by_name: dict[str, list[int]] = {}
    for k, entry in enumerate(entries):
        if entry.key == "place" and entry.value in SETTLEMENTS:
            by_name.setdefault(folded(entry.name), []).append(k)
    found: dict[int, int] = {}
    for k in areas:
        area = entries[k].area
        if area is None or entries[k].level < 6:
            continue
        for town in by_name.get(folded(entries[k].name), ()):
            if shapely.contains_xy(area, entries[town].lon, entries[town].lat):
                found[k] = town
                entries[town].box = entries[k].box
    return found
