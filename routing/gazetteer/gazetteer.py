"""A graph's index of places, opened to be searched by any thread."""

from __future__ import annotations

import json
import math
import sqlite3
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from queue import Empty, Full, LifoQueue
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

from routing.errors import GraphFormatError
from routing.gazetteer.cells import coarse_words_around
from routing.gazetteer.coordinates import coordinates_in
from routing.gazetteer.entries import Box, Kind
from routing.gazetteer.files import APPLICATION_ID, FORMAT_VERSION, PARENT_KINDS, PLACES_FILE
from routing.gazetteer.found import FoundPlace, Near, in_language
from routing.gazetteer.query import Question
from routing.gazetteer.reverse import nearest
from routing.gazetteer.words import CONNECTORS, MOST_QUERY_CHARS, STREET_WORDS, number_value, words_of
from routing.graph.earth import METRE_PER_DEGREE
from routing.places import degrees_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

MOST_ROWS: Final = 250  # things that are weighed for one way to read a text
MOST_FOUND: Final = 50
POOL: Final = 8  # connections that are kept
GOOD: Final = 0.86  # a match from which on spelling and left out words are not tried
LEAST_MATCH: Final = 0.5
IMPORTANCE: Final = 0.3  # how much importance counts beside the match
NEARNESS: Final = 0.25  # how much nearness does
NEAR_M: Final = 8000.0
ALIKE_M: Final = 350.0  # within which things of a name and a kind are one
_COLUMNS: Final = "id, folded, around, importance, lat, lon, kind, has_houses"
_DETAILS: Final = (
    "id, kind, osm_type, osm_id, osm_key, osm_value, name, names, lat, lon, box, importance, street, number, postcode, "
    "city, district, county, state, country"
)


class Gazetteer:
    """An index on disk, read-only; raises GraphFormatError where its file is missing, damaged or of another version.

    folder: of the graph.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._idle: LifoQueue[sqlite3.Connection] = LifoQueue(POOL)
        self.size_bytes = 0
        with suppress(OSError):
            self.size_bytes = (folder / PLACES_FILE).stat().st_size
        with self._connection() as database:
            self.about = dict(database.execute("SELECT key, value FROM about").fetchall())
        try:
            self.region_words = tuple(self.about["region_words"].split())
            self.country_code = self.about["country"]
            self._middle = Near(*map(float, self.about["middle"].split()))
            self._country: dict[str, str] = json.loads(self.about["country_names"])
            self._state: dict[str, str] = json.loads(self.about["state_names"])
            regions = (*self._country.values(), *self._state.values())
            named = (*self.region_words, *(word for name in regions for word in words_of(name)))
            self.region_words = tuple(word for word in named if len(word) > 2 and word not in CONNECTORS)
            self.counts: dict[str, int] = json.loads(self.about["counts"])
            self.left_out: dict[str, int] = json.loads(self.about["left_out"])
        except (KeyError, TypeError, ValueError) as error:
            raise self._damaged(f"damaged ({error})") from error

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing that could be found."""
        return not any(self.counts.values())

    def close(self) -> None:
        """Close all connections that are not in use."""
        with suppress(Empty):
            while True:
                self._idle.get_nowait().close()

    def _damaged(self, value: str) -> GraphFormatError:
        allowed = "an index that `joulepath places build` writes"
        return GraphFormatError(str(self._folder), PLACES_FILE, value, allowed)

    def _open(self) -> sqlite3.Connection:
        path = (self._folder / PLACES_FILE).resolve()
        uri = f"file:{quote(str(path))}?mode=ro&immutable=1"
        database = sqlite3.connect(uri, uri=True, check_same_thread=False, isolation_level=None, cached_statements=64)
        try:
            (application,) = database.execute("PRAGMA application_id").fetchone()
            (version,) = database.execute("PRAGMA user_version").fetchone()
            if application != APPLICATION_ID or version != FORMAT_VERSION:
                raise self._damaged(f"no index of version {FORMAT_VERSION}")
        except BaseException:
            database.close()
            raise
        return database

    @contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection]:
        """A connection that no other thread uses meanwhile."""
        try:
            try:
                database = self._idle.get_nowait()
            except Empty:
                database = self._open()
            with closing(database) if self._idle.full() else _kept(database, self._idle):
                yield database
        except sqlite3.Error as error:
            raise self._damaged(f"unreadable ({error})") from error

    def search(
        self,
        text: str,
        *,
        limit: int = 10,
        near: Near | None = None,
        languages: Sequence[str] = (),
        within: Box | None = None,
        kinds: frozenset[Kind] | None = None,
    ) -> list[FoundPlace]:
        """Things that a text may mean, the likeliest first; empty where there is none.

        text: the first 200 characters count. near: answers near it go before others as good. languages: of names, the
        preferred first. within: only what lies in it. kinds: only these. About 1 ms for each way to read the text.
        """
        text = text[:MOST_QUERY_CHARS].replace("\0", " ").strip("\n\r\t")
        limit = min(limit, MOST_FOUND)
        typed = coordinates_in(text)
        with self._connection() as database:
            if typed is not None:
                return [self._typed(database, *typed, languages)]
            question = Question(database, text, self.region_words)
            if not question.words:
                return []
            if near is None and any(word.is_region for word in question.words):
                near = self._middle  # who names the region means its main town, whose name the map may lack
            rows = self._weighed(database, question, near, within, kinds)
            return self._answers(database, question, rows, limit, near, languages)

    def reverse(
        self,
        lat: float,
        lon: float,
        *,
        limit: int = 1,
        radius_m: float = 1000.0,
        languages: Sequence[str] = (),
        areas_only: bool = False,
    ) -> list[FoundPlace]:
        """What is at a place: its address, then what else is near, the nearest first; all within a radius [m].

        areas_only: only towns and parts of them.
        """
        with self._connection() as database:
            found = []
            for hit in nearest(database, lat, lon, min(limit, MOST_FOUND), radius_m, areas_only=areas_only):
                place = self._details(database, [hit.place], languages).get(hit.place)
                if place is None:
                    continue
                place = replace(place, lat=hit.lat, lon=hit.lon, distance_m=hit.distance_m)
                found.append(place if hit.number is None else self._house(place, hit.number))
            return found

    def _typed(self, database: sqlite3.Connection, lat: float, lon: float, languages: Sequence[str]) -> FoundPlace:
        """Coordinates as a thing, with the address of what is there."""
        name = f"{degrees_text(lat)}, {degrees_text(lon)}"
        hits = nearest(database, lat, lon, 1, 300.0)
        at = self._details(database, [hits[0].place], languages).get(hits[0].place) if hits else None
        found = FoundPlace(-1, Kind.COORDINATES, "", 0, "place", "coordinates", name, {}, lat, lon, 0.5)
        if at is None:
            return found
        street = at.name if at.kind is Kind.STREET else at.street
        return replace(found, street=street, postcode=at.postcode, address=at.address, country_code=at.country_code)

    def _weighed(
        self,
        database: sqlite3.Connection,
        question: Question,
        near: Near | None,
        within: Box | None,
        kinds: frozenset[Kind] | None,
    ) -> list[tuple[float, float, Any]]:
        """Rows that fit, with score and match, the best first; further ways to read the text where none is good."""
        seen: set[int] = set()
        weighed: list[tuple[float, float, Any]] = []

        def weigh(positions: Sequence[int]) -> None:
            if not positions:
                return
            for row in _rows(database, question.expression(positions), near):
                place, names, around, importance, lat, lon, kind, has_houses = row
                if place in seen or (kinds is not None and Kind(kind) not in kinds):
                    continue
                seen.add(place)
                if within is not None and not (within[0] <= lon <= within[2] and within[1] <= lat <= within[3]):
                    continue
                match, each = question.match(names, around)
                match = _with_number(question, match, each, bool(has_houses))
                if match >= LEAST_MATCH:
                    weighed.append((match + IMPORTANCE * importance + _nearness(lat, lon, near), match, row))

        def best() -> float:
            return max((match for _, match, _ in weighed), default=0.0)

        needed, numbers = question.needed(), question.numbers()
        weigh(needed)
        if numbers:
            weigh(sorted({*needed, *numbers}))
        if best() < GOOD:
            lean = [k for k in needed if question.words[k].text not in STREET_WORDS]
            if len(lean) < len(needed):
                weigh(lean)
        if best() < GOOD:
            question.look_for_all_spellings()
            seen.clear()
            weighed.clear()
            weigh(needed)
            weigh([k for k in needed if question.words[k].text not in STREET_WORDS])
            if best() < GOOD and len(needed) > 1:
                for k in needed:
                    weigh([other for other in needed if other != k])
        return sorted(weighed, key=lambda found: (-found[0], found[2][0]))

    def _answers(
        self,
        database: sqlite3.Connection,
        question: Question,
        rows: list[tuple[float, float, Any]],
        limit: int,
        near: Near | None,
        languages: Sequence[str],
    ) -> list[FoundPlace]:
        chosen = rows[: 3 * limit + 10]
        details = self._details(database, [row[0] for _, _, row in chosen], languages)
        found: list[FoundPlace] = []
        for score, match, row in chosen:
            place = replace(details[row[0]], score=score, match=min(1.0, match))
            if row[7] or row[6] == Kind.STREET:
                place = self._numbered(database, question, place, row)
            if not any(_alike(place, other) for other in found):
                found.append(place)
        found.sort(key=lambda place: -place.score)
        return found[:limit]

    def _numbered(self, database: sqlite3.Connection, question: Question, street: FoundPlace, row: Any) -> FoundPlace:
        """A street, or its house of the number that is asked for; the nearest one where there is none of that."""
        _, each = question.match(row[1], row[2])
        asked = [word.text for word, fit in zip(question.words, each, strict=True) if word.is_number and fit < 0.9]
        asked = [number for number in asked if len(number) < 7]
        if not asked:
            return street
        columns = "number, label, lat, lon, postcode, osm_type, osm_id"
        of_street = f"SELECT {columns} FROM houses WHERE street = ?"
        for number in asked:
            for form in _number_forms(question, number):
                house = database.execute(f"{of_street} AND number = ?", (street.place_id, form)).fetchone()
                if house:
                    return replace(self._house(street, house), score=street.score + 0.1, match=street.match)
        wanted = number_value(asked[0])
        numbers = database.execute(of_street, (street.place_id,)).fetchall()
        street = replace(street, asked_number=asked[0])
        values = [(abs(value - (wanted or 0)), house) for house in numbers if (value := number_value(house[0]))]
        if not values or wanted is None:
            return street
        _, house = min(values, key=lambda pair: (pair[0], pair[1][0]))
        return replace(
            street,
            lat=house[2],
            lon=house[3],
            postcode=house[4] or street.postcode,
            nearest_number=house[1],
        )

    def _house(self, street: FoundPlace, house: Any) -> FoundPlace:
        _, label, lat, lon, postcode, osm_type, osm_id = house
        return replace(
            street,
            kind=Kind.HOUSE,
            osm_type=osm_type,
            osm_id=osm_id,
            key="place",
            value="house",
            name="",
            names={},
            lat=lat,
            lon=lon,
            box=None,
            street=street.name,
            number=label,
            postcode=postcode or street.postcode,
        )

    def _details(
        self, database: sqlite3.Connection, ids: Sequence[int], languages: Sequence[str]
    ) -> dict[int, FoundPlace]:
        """Things by their position, with what they are part of."""
        rows = _by_id(database, _DETAILS, ids)
        above = sorted({parent for row in rows for parent in row[15:] if parent is not None})
        parent_rows = _by_id(database, "id, name, names", above)
        named = {row[0]: in_language(row[1], json.loads(row[2]) if row[2] else {}, languages) for row in parent_rows}
        found = {}
        for row in rows:
            names = json.loads(row[7]) if row[7] else {}
            address = {
                kind: named[parent] for kind, parent in zip(PARENT_KINDS, row[15:], strict=True) if parent in named
            }
            if self._state and row[1] not in (Kind.STATE, Kind.COUNTRY):
                address.setdefault(Kind.STATE, in_language(self._state[""], self._state, languages))
            if self._country and row[1] != Kind.COUNTRY:
                address.setdefault(Kind.COUNTRY, in_language(self._country[""], self._country, languages))
            box = None if row[10] is None else tuple(float(part) for part in row[10].split(","))
            found[row[0]] = FoundPlace(
                place_id=row[0],
                kind=Kind(row[1]),
                osm_type=row[2],
                osm_id=row[3],
                key=row[4],
                value=row[5],
                name=in_language(row[6], names, languages),
                names={"": row[6], **names},
                lat=row[8],
                lon=row[9],
                box=box if box is None else (box[0], box[1], box[2], box[3]),
                importance=row[11],
                street=row[12] or "",
                number=row[13] or "",
                postcode=row[14] or "",
                address=address,
                country_code=self.country_code,
            )
        return found


@contextmanager
def _kept(database: sqlite3.Connection, idle: LifoQueue[sqlite3.Connection]) -> Iterator[None]:
    """Within it a connection is used; it is kept afterwards, but closed after an error."""
    try:
        yield
    except BaseException:
        database.close()
        raise
    try:
        idle.put_nowait(database)
    except Full:  # meanwhile
        database.close()


def _by_id(database: sqlite3.Connection, columns: str, ids: Sequence[int]) -> list[Any]:
    marks = ",".join("?" * len(ids))
    statement = f"SELECT {columns} FROM places WHERE id IN ({marks})"
    return database.execute(statement, tuple(ids)).fetchall() if ids else []


def _rows(database: sqlite3.Connection, expression: str, near: Near | None) -> list[Any]:
    """The most important things of an expression, and with `near` those around it."""
    statement = (
        f"SELECT {_COLUMNS} FROM places WHERE id IN "
        "(SELECT rowid FROM words WHERE words MATCH ? ORDER BY rowid LIMIT ?)"
    )
    rows = []
    if near is not None:
        cells = " OR ".join(f'"{word}"' for word in coarse_words_around(near.lat, near.lon))
        rows = database.execute(statement, (f"({expression}) AND cell : ({cells})", MOST_ROWS)).fetchall()
    return rows + database.execute(statement, (expression, MOST_ROWS)).fetchall()


def _nearness(lat: float, lon: float, near: Near | None) -> float:
    if near is None:
        return 0.0
    east = (lon - near.lon) * math.cos(math.radians(near.lat))
    away_m = math.hypot(lat - near.lat, east) * METRE_PER_DEGREE
    return NEARNESS / (1.0 + away_m / NEAR_M)


def _with_number(question: Question, match: float, each: Sequence[float], has_houses: bool) -> float:
    """A match in which numbers that the name has not count as house numbers, more where the street has any."""
    total = sum(word.weight for word in question.words)
    rest = sum(
        word.weight for word, quality in zip(question.words, each, strict=True) if word.is_number and quality == 0.0
    )
    return match + (0.75 if has_houses else 0.55) * rest / total if match > 0.0 else 0.0


def _number_forms(question: Question, number: str) -> list[str]:
    """A number as it is stored, with the letter that may stand apart from it."""
    texts = [word.text for word in question.words]
    at = texts.index(number) + 1
    letter = texts[at] if at < len(texts) and len(texts[at]) == 1 and texts[at].isalpha() else ""
    return [number + letter, number] if letter else [number]


def _alike(place: FoundPlace, other: FoundPlace) -> bool:
    """Whether two answers are one to who asks."""
    if place.kind is not other.kind or place.name != other.name or place.number != other.number:
        return False
    east = (place.lon - other.lon) * math.cos(math.radians(place.lat))
    return math.hypot(place.lat - other.lat, east) * METRE_PER_DEGREE < ALIKE_M
