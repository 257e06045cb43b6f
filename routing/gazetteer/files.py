"""The index on disk: places.sqlite beside a graph's own files, as docs/places.md describes it."""

from __future__ import annotations

import json
import os
import sqlite3
import tempfile
from array import array
from collections import Counter
from contextlib import closing, suppress
from datetime import date
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.gazetteer.cells import CELLS_A_DEGREE, cell_at, cell_of, coarse_word
from routing.gazetteer.entries import Kind
from routing.gazetteer.words import grams_of, joined_words, meant_by, words_of
from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from routing.gazetteer.building import Content
    from routing.gazetteer.entries import Entry

PLACES_FILE: Final = "places.sqlite"
FORMAT_VERSION: Final = 1
APPLICATION_ID: Final = 0x4A504C43  # JPLC
LEAST_GRAMMED: Final = 3  # characters of a word that is looked for by its trigrams
SQUARE_E7: Final = round(E7 / CELLS_A_DEGREE)
STEP_E7: Final = 8000  # of a street's line that goes over several squares at once
PARENT_KINDS: Final = (Kind.CITY, Kind.DISTRICT, Kind.COUNTY, Kind.STATE, Kind.COUNTRY)
CONTEXT_LANGUAGES: Final = ("int", "en", "de", "fr", "es", "pt", "it")  # of what things are a part of
_SCHEMA: Final = """
CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE places (
    id INTEGER PRIMARY KEY, kind TEXT NOT NULL, osm_type TEXT NOT NULL, osm_id INTEGER NOT NULL, osm_key TEXT NOT NULL,
    osm_value TEXT NOT NULL, name TEXT NOT NULL, names TEXT, folded TEXT NOT NULL, around TEXT NOT NULL,
    lat REAL NOT NULL, lon REAL NOT NULL, box TEXT, importance REAL NOT NULL, street TEXT, number TEXT, postcode TEXT,
    city INTEGER, district INTEGER, county INTEGER, state INTEGER, country INTEGER, line BLOB, has_houses INTEGER
);
CREATE VIRTUAL TABLE words USING fts5(
    name, around, cell, content='', columnsize=0, detail=column, prefix='1 2 3',
    tokenize="unicode61 remove_diacritics 0 categories 'L* N* Co Mn Mc'"
);
CREATE TABLE vocabulary (id INTEGER PRIMARY KEY, word TEXT NOT NULL UNIQUE, count INTEGER NOT NULL);
CREATE TABLE grams (gram TEXT NOT NULL, word INTEGER NOT NULL, PRIMARY KEY (gram, word)) WITHOUT ROWID;
CREATE TABLE houses (
    street INTEGER NOT NULL, number TEXT NOT NULL, label TEXT NOT NULL, lat REAL NOT NULL, lon REAL NOT NULL,
    postcode TEXT, osm_type TEXT NOT NULL, osm_id INTEGER NOT NULL, cell INTEGER NOT NULL,
    PRIMARY KEY (street, number)
) WITHOUT ROWID;
CREATE TABLE spots (cell INTEGER NOT NULL, place INTEGER NOT NULL, PRIMARY KEY (cell, place)) WITHOUT ROWID;
"""


def index_bytes(content: Content, source: str, attribution: str = "") -> bytes:
    """The file of an index. source: the map that it is of. attribution: of its data, with the licence."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as database:
        database.execute("PRAGMA page_size = 4096")
        database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        database.execute(f"PRAGMA user_version = {FORMAT_VERSION}")
        database.execute("PRAGMA journal_mode = OFF")
        database.executescript(_SCHEMA)
        database.execute("BEGIN")
        _fill(database, content, source, attribution)
        database.execute("COMMIT")
        database.execute("INSERT INTO words (words) VALUES ('optimize')")
        database.execute("CREATE INDEX houses_by_cell ON houses (cell)")
        database.execute("VACUUM")
        return bytes(database.serialize())


def save_index(folder: Path, content: bytes) -> None:
    """Write an index beside a graph, whole or not at all; raises OSError."""
    descriptor, scratch = tempfile.mkstemp(prefix=f".{PLACES_FILE}.", dir=folder)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        os.chmod(scratch, 0o644)
        os.replace(scratch, folder / PLACES_FILE)
    except BaseException:
        with suppress(OSError):
            os.unlink(scratch)
        raise


def _fill(database: sqlite3.Connection, content: Content, source: str, attribution: str) -> None:
    entries = content.entries
    with_houses = {numbered.street for numbered in content.houses}
    counts: Counter[str] = Counter()
    places, texts = [], []
    above = {up: _context_words(entries[up]) for up in {up for entry in entries for up in entry.parents.values()}}
    for k, entry in enumerate(entries):
        named = _name_words(entry)
        around = " ".join(dict.fromkeys(_around(above, entry)))
        flat = [word for words in named for word in words]
        counts.update(set(flat))
        joined = [word for words in named for word in joined_words(words)]
        counts.update(set(joined) - set(flat))
        counts.update(set(around.split()) - set(flat))
        short = [short for word in dict.fromkeys(flat) if len(word) < 5 for short in meant_by(word)]
        texts.append((k, " ".join((*flat, *joined, *short)), around, coarse_word(entry.lat, entry.lon)))
        shown = {key: text for key, text in entry.names.items() if not key.startswith("*")}
        box = None if entry.box is None else ",".join(f"{value:.6f}" for value in entry.box)
        places.append(
            (
                *(k, entry.kind.value, entry.osm_type, entry.osm_id, entry.key, entry.value, entry.name),
                json.dumps(shown, ensure_ascii=False) if shown else None,
                "|".join(dict.fromkeys(" ".join(words) for words in named)),
                around,
                *(round(entry.lat, 7), round(entry.lon, 7), box, round(entry.importance, 4)),
                *(entry.street or None, entry.number or None, entry.postcode or None),
                *(entry.parents.get(kind) for kind in PARENT_KINDS),
                _line(entry) if entry.lines else None,
                int(k in with_houses),
            )
        )
    database.executemany(f"INSERT INTO places VALUES ({','.join('?' * 24)})", places)
    database.executemany("INSERT INTO words (rowid, name, around, cell) VALUES (?, ?, ?, ?)", texts)
    vocabulary = [(k, word, count) for k, (word, count) in enumerate(sorted(counts.items()))]
    database.executemany("INSERT INTO vocabulary VALUES (?, ?, ?)", vocabulary)
    grams = sorted(
        (gram, k)
        for k, word, _ in vocabulary
        if len(word) >= LEAST_GRAMMED and not word.isdigit()
        for gram in grams_of(word)
    )
    database.executemany("INSERT INTO grams VALUES (?, ?)", grams)
    database.executemany(
        "INSERT INTO houses VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        sorted(
            (
                *(numbered.street, numbered.number, numbered.house.number),
                *(numbered.house.lat_e7 / E7, numbered.house.lon_e7 / E7, numbered.house.postcode or None),
                *(numbered.house.osm_type, numbered.house.osm_id),
                cell_of(numbered.house.lat_e7 / E7, numbered.house.lon_e7 / E7),
            )
            for numbered in content.houses
        ),
    )
    spots = sorted({(cell, k) for k, entry in enumerate(entries) for cell in _cells(entry)})
    database.executemany("INSERT INTO spots VALUES (?, ?)", spots)
    about = {
        "source": source,
        "attribution": attribution,
        "middle": _middle(entries),
        "built": date.today().isoformat(),
        "counts": json.dumps(content.counts()),
        "left_out": json.dumps(dict(content.left_out)),
        "region_words": " ".join(content.region_words),
        "country": content.country,
        "country_names": json.dumps(dict(content.country_names), ensure_ascii=False),
        "state_names": json.dumps(dict(content.state_names), ensure_ascii=False),
    }
    database.executemany("INSERT INTO about VALUES (?, ?)", sorted(about.items()))


def _middle(entries: list[Entry]) -> str:
    """Latitude and longitude [deg] in the middle of most things."""
    if not entries:
        return "0 0"
    return f"{np.median([entry.lat for entry in entries]):.4f} {np.median([entry.lon for entry in entries]):.4f}"


def _name_words(entry: Entry) -> list[tuple[str, ...]]:
    """The words of each name of a thing, its own first."""
    names = dict.fromkeys((entry.name, *entry.names.values()))
    if entry.kind in (Kind.POINT, Kind.STATION) and entry.value != "yes":
        names[entry.value.replace("_", " ")] = None  # who types pharmacy wants any
    return list(dict.fromkeys(words for words in map(words_of, names) if words))


def _context_words(entry: Entry) -> tuple[str, ...]:
    """The words by which a thing is said to be what another is part of."""
    names = [text for key, text in entry.names.items() if key.startswith("*") or key in CONTEXT_LANGUAGES]
    return tuple(dict.fromkeys(word for text in (entry.name, *names) for word in words_of(text)))


def _around(above: Mapping[int, tuple[str, ...]], entry: Entry) -> Iterator[str]:
    """Words of what a thing is part of and of its address; above: of each thing of which others are a part."""
    for parent in entry.parents.values():
        yield from above[parent]
    for text in (entry.street, entry.postcode, entry.city_name, *entry.further):
        yield from words_of(text)


def _line(entry: Entry) -> bytes:
    """The lines of a street: the number of points of each, then all points as lon, lat [1e-6 deg], whole numbers."""
    numbers = array("i", (len(entry.lines), *(len(line) // 2 for line in entry.lines)))
    for line in entry.lines:
        numbers.extend([value // 10 for value in line])
    return numbers.tobytes()


def line_points(blob: bytes) -> list[tuple[int, int, int, int]]:
    """The stretches of a street's lines: lon, lat, lon, lat [1e-6 deg]."""
    numbers = np.frombuffer(blob, np.int32)
    count = int(numbers[0])
    points = numbers[1 + count :].reshape(-1, 2).tolist()
    stretches, begin = [], 0
    for size in numbers[1 : 1 + count].tolist():
        line = points[begin : begin + size]
        stretches += [(x0, y0, x1, y1) for (x0, y0), (x1, y1) in pairwise(line)]
        begin += size
    return stretches


def _cells(entry: Entry) -> Iterable[int]:
    """The squares that a thing lies in, of a street all that it goes through."""
    if not entry.lines:
        return (cell_of(entry.lat, entry.lon),)
    squares = set()
    for line in entry.lines:
        squares |= {(y // SQUARE_E7, x // SQUARE_E7) for x, y in zip(line[::2], line[1::2], strict=True)}
    if len(squares) > 1:
        for line in entry.lines:
            for x0, y0, x1, y1 in zip(line[::2], line[1::2], line[2::2], line[3::2], strict=False):
                if abs(y1 // SQUARE_E7 - y0 // SQUARE_E7) + abs(x1 // SQUARE_E7 - x0 // SQUARE_E7) > 1:
                    steps = max(abs(x1 - x0), abs(y1 - y0)) // STEP_E7 + 1
                    squares |= {
                        ((y0 + (y1 - y0) * k // steps) // SQUARE_E7, (x0 + (x1 - x0) * k // steps) // SQUARE_E7)
                        for k in range(1, steps)
                    }
    return {cell_at(row, column) for row, column in squares}
