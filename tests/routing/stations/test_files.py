"""Stations on disk: what is written is read, the same for the same, and what is wrong is named."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from energy.charging.charging import Connector
from routing.errors import GraphFormatError
from routing.graph.road_graph import RoadGraph
from routing.importers.region import import_region
from routing.places import LinkPosition
from routing.stations import files
from routing.stations.files import (
    NO_STATIONS,
    STATIONS_FILE,
    load_stations,
    load_stations_version,
    save_stations,
    stations_bytes,
    stations_version,
)
from routing.stations.placing import place_stations
from routing.stations.station import Access, Price, Socket, Stations
from tests.routing.stations.drawn import CCS, SOURCE, TYPE2, station

STREET = {"highway": "residential"}


@pytest.fixture
def town(draw_map: Any) -> RoadGraph:
    return import_region(draw_map({1: (0, 0), 2: (1000, 0), 3: (1000, 1000)}, {9: ([1, 2, 3], STREET)}), [], "town")


@pytest.fixture
def stations(town: RoadGraph) -> Stations:
    everything = station(
        "b", 500, 20, sockets=(TYPE2, CCS, Socket(Connector.TYPE1, 3_680.0, 1, 1)), name="Märkt «1»", operator="Op",
        network="Net", capacity=4, access=Access.CUSTOMERS, fee=True, price=Price("0.4 EUR/kWh", "EUR", 0.4, 0.01, 1.0),
        opening_hours="Mo-Fr 08:00-18:00", operational=False, merged=("other:1", "other:2"),
    )  # fmt: skip
    bare = station("a", 990, 500, sockets=())
    placed = place_stations(town, [everything, bare])
    return Stations(tuple(sorted(placed.stations, key=lambda s: s.id)), (SOURCE,), {"outside the map": 3})


def test_stations_saved_and_loaded_are_the_same(town: RoadGraph, stations: Stations, tmp_path: Path) -> None:
    save_stations(tmp_path, town, stations)
    assert load_stations(tmp_path, town) == stations
    assert sorted(os.listdir(tmp_path)) == ["drawn.osm.pbf", STATIONS_FILE]


def test_the_file_is_the_same_for_the_same_stations_in_any_order(town: RoadGraph, stations: Stations) -> None:
    turned = replace(stations, stations=stations.stations[::-1])
    assert stations_bytes(town, turned) == stations_bytes(town, stations)
    lines = stations_bytes(town, stations).decode().splitlines()
    assert [json.loads(line.strip().removesuffix(","))["id"] for line in lines if '"id"' in line] == [
        "drawn:a",
        "drawn:b",
    ]


def test_a_graph_without_the_file_has_no_stations(town: RoadGraph, tmp_path: Path) -> None:
    assert load_stations(tmp_path, town) == NO_STATIONS
    assert stations_version(tmp_path) == ""


def test_the_version_names_the_content(town: RoadGraph, stations: Stations, tmp_path: Path) -> None:
    save_stations(tmp_path, town, stations)
    version = stations_version(tmp_path)
    assert load_stations_version(tmp_path, town)[1] == version != ""
    save_stations(tmp_path, town, replace(stations, left_out={}))
    assert stations_version(tmp_path) != version


def test_stations_of_another_graph_are_placed_anew(
    town: RoadGraph, stations: Stations, draw_map: Any, tmp_path: Path
) -> None:
    save_stations(tmp_path, town, stations)
    points = {1: (0, 0), 2: (1000, 0), 3: (1000, 400), 4: (0, 400)}
    other = import_region(draw_map(points, {9: ([1, 4], STREET), 10: ([1, 2, 3], STREET)}), [], "other")
    loaded = load_stations(tmp_path, other)
    again = place_stations(other, stations.stations)
    assert loaded.stations == again.stations
    assert [found.id for found in loaded.stations] == ["drawn:a", "drawn:b"]
    assert loaded.stations[0].position != stations.stations[0].position


def test_a_file_written_by_hand_needs_neither_positions_nor_digest(town: RoadGraph, tmp_path: Path) -> None:
    by_hand = {
        "format_version": 1,
        "sources": [{"key": "me", "name": "me", "licence": "CC0-1.0"}],
        "stations": [
            {
                "id": "me:1",
                "lat": 42.0,
                "lon": 1.503,
                "source": "me",
                "sockets": [{"connector": "ccs2", "output_kw": 50}],
            }
        ],
    }
    (tmp_path / STATIONS_FILE).write_text(json.dumps(by_hand), encoding="utf-8")
    (found,) = load_stations(tmp_path, town).stations
    assert found.sockets == (Socket(Connector.CCS2, 50_000.0),)
    assert len(found.position) == 2


def change(path: tuple[str | int, ...], value: object) -> Callable[[Any], None]:
    def apply(raw: Any) -> None:
        for key in path[:-1]:
            raw = raw[key]
        raw[path[-1]] = value

    return apply


FIRST = ("stations", 1)


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("format_version",), 99, r"format_version.* is 99, allowed: 1"),
        (("sources",), {}, "sources.*allowed: a list"),
        (("sources", 0, "licence"), "", r"sources\[0\].licence.*empty"),
        (("stations",), 4, "stations.*allowed: a list"),
        ((*FIRST,), [], r"stations\[1\].*allowed: an object"),
        ((*FIRST, "id"), "drawn:a", r"stations\[1\].id.*drawn:a, allowed: each id once"),
        ((*FIRST, "id"), 4, r"stations\[1\].id"),
        ((*FIRST, "lat"), 91.0, r"stations\[1\].lat.*91.0, allowed: -90..90 deg"),
        ((*FIRST, "lon"), True, r"stations\[1\].lon"),
        ((*FIRST, "lon"), None, r"stations\[1\].lon"),
        ((*FIRST, "source"), "nobody", r"stations\[1\].source.*nobody, allowed: a key of sources: drawn"),
        ((*FIRST, "access"), "open", r"stations\[1\].access.*open, allowed: public, customers"),
        ((*FIRST, "capacity"), 0, r"stations\[1\].capacity.*0, allowed: a whole number, 1"),
        ((*FIRST, "fee"), "yes", r"stations\[1\].fee.*yes, allowed: true, false or null"),
        ((*FIRST, "opening_hours"), 24, r"stations\[1\].opening_hours"),
        ((*FIRST, "merged"), [1], r"stations\[1\].merged"),
        ((*FIRST, "sockets", 0, "connector"), "type9", r"sockets\[0\].connector.*type9, allowed: type1, type2"),
        ((*FIRST, "sockets", 0, "output_kw"), 0, r"sockets\[0\].output_kw.*0, allowed: above 0"),
        ((*FIRST, "sockets", 0, "output_kw"), 1e9, r"sockets\[0\].output_kw.*allowed: 0..4000 kW"),
        ((*FIRST, "sockets", 0, "phases"), 4, r"sockets\[0\].phases"),
        ((*FIRST, "sockets", 0, "count"), 1.5, r"sockets\[0\].count"),
        ((*FIRST, "price", "per_kwh"), -1, r"price.per_kwh"),
        ((*FIRST, "links", 0, 0), 99, r"links\[0\]\[0\].*99, allowed: a whole number, 0..3"),
        ((*FIRST, "links", 0, 1), 1e9, r"links\[0\]\[1\].*the link's length"),
        ((*FIRST, "links", 0), [1], r"links\[0\]"),
        (("left_out", "outside the map"), -1, r"left_out.outside the map"),
    ],
)
def test_what_is_wrong_is_named_with_its_value_and_what_is_allowed(
    town: RoadGraph, stations: Stations, tmp_path: Path, path: tuple[str | int, ...], value: object, named: str
) -> None:
    raw = json.loads(stations_bytes(town, stations))
    change(path, value)(raw)
    (tmp_path / STATIONS_FILE).write_text(json.dumps(raw), encoding="utf-8")
    with pytest.raises(GraphFormatError, match=rf"{STATIONS_FILE}.*{named}"):
        load_stations(tmp_path, town)


@pytest.mark.parametrize("content", [b"", b"nonsense", b"[]", b"\xff\xfe", b'{"stations": NaN}', b"[" * 100_000])
def test_what_is_no_file_of_stations_is_refused(town: RoadGraph, tmp_path: Path, content: bytes) -> None:
    (tmp_path / STATIONS_FILE).write_bytes(content)
    with pytest.raises(GraphFormatError, match=STATIONS_FILE):
        load_stations(tmp_path, town)


def test_a_file_cut_anywhere_is_refused(town: RoadGraph, stations: Stations, tmp_path: Path) -> None:
    content = stations_bytes(town, stations)
    for end in range(0, len(content) - 2, 37):
        (tmp_path / STATIONS_FILE).write_bytes(content[:end])
        with pytest.raises(GraphFormatError):
            load_stations(tmp_path, town)


def test_a_file_too_large_and_a_folder_in_its_place_are_refused(
    town: RoadGraph, stations: Stations, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_stations(tmp_path, town, stations)
    monkeypatch.setattr(files, "MOST_BYTES", 100)
    with pytest.raises(GraphFormatError, match="MiB"):
        load_stations(tmp_path, town)
    (tmp_path / "other" / STATIONS_FILE).mkdir(parents=True)
    (tmp_path / "pipe").mkdir()
    os.mkfifo(tmp_path / "pipe" / STATIONS_FILE)
    for folder in ("other", "pipe"):
        with pytest.raises(GraphFormatError, match="is no file"):
            load_stations(tmp_path / folder, town)


def test_a_file_that_can_not_be_written_leaves_the_old_one(
    town: RoadGraph, stations: Stations, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_stations(tmp_path, town, stations)
    before = (tmp_path / STATIONS_FILE).read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space"):
        save_stations(tmp_path, town, NO_STATIONS)
    assert sorted(os.listdir(tmp_path)) == ["drawn.osm.pbf", STATIONS_FILE]
    assert (tmp_path / STATIONS_FILE).read_bytes() == before


@pytest.mark.parametrize("output_w", [3_680.0, 22_170.25, 1.0, 7_400.1, 350_000.0, 4e6])
def test_outputs_come_back_as_they_were(town: RoadGraph, tmp_path: Path, output_w: float) -> None:
    drawn = station("a", 500, 0, sockets=(Socket(Connector.TYPE2, output_w),), position=(LinkPosition(0, 1.0),))
    save_stations(tmp_path, town, Stations((drawn,), (SOURCE,)))
    assert load_stations(tmp_path, town).stations == (drawn,)


VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-(2**60), 2**60), st.floats(allow_nan=False), st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(st.text(max_size=5), inner, max_size=3)),
    max_leaves=5,
)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_value_anywhere_is_refused_or_read_as_it_is_written_again(
    town: RoadGraph, stations: Stations, tmp_path: Path, data: st.DataObject
) -> None:
    raw = json.loads(stations_bytes(town, stations))
    holder: Any = {"": raw}
    key: Any = ""
    while isinstance(holder[key], dict | list) and holder[key] and data.draw(st.booleans() | st.just(True)):
        holder = holder[key]
        key = data.draw(st.sampled_from(sorted(holder) if isinstance(holder, dict) else range(len(holder))))
    holder[key] = data.draw(VALUES)
    (tmp_path / STATIONS_FILE).write_text(
        json.dumps(raw if holder is not raw or key else holder[key]), encoding="utf-8"
    )
    try:
        loaded = load_stations(tmp_path, town)
    except GraphFormatError:
        return
    save_stations(tmp_path, town, loaded)
    assert load_stations(tmp_path, town) == loaded
