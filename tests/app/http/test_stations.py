"""GET /graphs/{name}/stations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from routing.stations.files import STATIONS_FILE, stations_bytes
from tests.app.conftest import VEHICLES, street_grid
from tests.app.expected import check_problem, database_in
from tests.app.stations_beside import grid_stations
from tests.app.tiles.tile_reader import read_tile

if TYPE_CHECKING:
    from collections.abc import Iterator

STATIONS = "/graphs/grid/stations"


@pytest.fixture(scope="module")
def charged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A client of the grid with stations, beside a level one without and one whose stations are damaged."""
    folder = tmp_path_factory.mktemp("graphs")
    grid, level = street_grid("grid", Terrain.SYNTHETIC), street_grid("level", Terrain.ABSENT)
    save_graph(grid, folder / "grid", {STATIONS_FILE: stations_bytes(grid, grid_stations(grid))})
    save_graph(level, folder / "level")
    save_graph(street_grid("torn", Terrain.ABSENT), folder / "torn", {STATIONS_FILE: b'{"format_version": 9}'})
    settings = Settings(
        graph_dirs=(folder,), vehicle_dir=VEHICLES, database_url=database_in(folder), default_graph="grid"
    )
    service = Service(settings)
    service.load_all()
    with TestClient(create_app(settings, service)) as client:
        yield client


def ids(answer: dict[str, Any]) -> list[str]:
    return [feature["id"] for feature in answer["features"]]


def test_stations_are_geojson_with_their_sources_and_what_is_known_of_them(charged: TestClient) -> None:
    answered = charged.get(STATIONS)
    assert answered.status_code == 200
    assert answered.headers["content-type"] == "application/geo+json"
    answer = answered.json()
    assert answer["type"] == "FeatureCollection"
    assert ids(answer) == ["ocm:3", "ocm:4", "osm:n1", "osm:n2"]
    assert [(source["key"], source["licence"]) for source in answer["sources"]] == [
        ("ocm", "CC-BY-4.0"),
        ("osm", "ODbL-1.0"),
    ]
    assert (answer["matched"], answer["returned"], answer["next"], answer["graph"]) == (4, 4, None, "grid")
    assert answer["left_out"] == {"outside the map": 7}
    first = answer["features"][0]
    assert first["geometry"] == {"type": "Point", "coordinates": [8.015, 46.5199]}
    known = first["properties"]
    assert known["sockets"] == [{"connector": "ccs2", "output_kw": 150.0, "count": 4, "phases": None}]
    assert known["power_kw"] == 150.0
    assert known["price"]["per_kwh"] == 0.49
    assert known["open"] is None
    assert known["source"] == "ocm"
    assert len(known["roads"]) == 2
    assert 0.0 < known["road_distance_m"] < 30.0
    bare = answer["features"][1]["properties"]
    assert (bare["sockets"], bare["power_kw"], bare["operational"]) == ([], None, False)


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ("bbox=8.0,46.495,8.01,46.515", ["osm:n1", "osm:n2"]),
        ("connectors=ccs2", ["ocm:3", "osm:n2"]),
        ("connectors=ccs2,type2&min_power_kw=22", ["ocm:3", "osm:n1", "osm:n2"]),
        ("connectors=type2&min_power_kw=50", []),
        ("min_power_kw=50", ["ocm:3", "osm:n2"]),
        ("network=IONI", ["osm:n2"]),
        ("access=public,customers", ["ocm:4", "osm:n2"]),
        ("open_at=2026-11-29T12:00", ["ocm:3", "ocm:4", "osm:n2"]),  # a Sunday
        ("open_at=2026-11-30T12:00", ["ocm:3", "ocm:4", "osm:n1", "osm:n2"]),
    ],
)
def test_filters_answer_what_is_as_asked(charged: TestClient, query: str, found: list[str]) -> None:
    answer = charged.get(f"{STATIONS}?{query}").json()
    assert ids(answer) == found
    assert answer["matched"] == len(found)


def test_of_open_stations_it_is_said_what_is_not_known(charged: TestClient) -> None:
    answer = charged.get(f"{STATIONS}?open_at=2026-11-30T12:00").json()
    assert [feature["properties"]["open"] for feature in answer["features"]] == [
        "unknown",
        "unknown",
        "open",
        "unknown",
    ]
    (warning,) = answer["warnings"]
    assert warning.startswith("of 3 of 4 stations it is not known")
    assert "2 say no opening hours" in warning
    assert "ocm:3: '8 to 6'" in warning


def test_pages_follow_each_other_and_together_have_each_station_once(charged: TestClient) -> None:
    address, seen = f"{STATIONS}?limit=1&connectors=ccs2,type2", []
    while address:
        answer = charged.get(address).json()
        assert (answer["matched"], answer["returned"]) == (3, 1)
        seen += ids(answer)
        address = answer["next"]
    assert seen == ["ocm:3", "osm:n1", "osm:n2"]
    assert charged.get(f"{STATIONS}?after=zzz").json()["features"] == []


def test_an_answer_that_the_caller_has_is_not_sent_again(charged: TestClient) -> None:
    answered = charged.get(STATIONS)
    tag = answered.headers["etag"]
    again = charged.get(STATIONS, headers={"If-None-Match": tag})
    assert (again.status_code, again.content) == (304, b"")
    assert charged.get(f"{STATIONS}?limit=2", headers={"If-None-Match": tag}).status_code == 200
    plain = charged.get(STATIONS, headers={"If-None-Match": tag, "Accept-Encoding": "identity"})
    assert plain.status_code == 200
    assert plain.json() == answered.json()


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("bbox=1,2,3", "bbox"),
        ("bbox=a,b,c,d", "bbox"),
        ("bbox=0,50,1,40", "bbox"),
        ("bbox=0,0,nan,1", "bbox"),
        ("bbox=-200,0,1,1", "bbox"),
        ("connectors=type9", "connectors"),
        ("connectors=", "connectors"),
        ("access=open", "access"),
        ("min_power_kw=-1", "min_power_kw"),
        ("min_power_kw=nan", "min_power_kw"),
        ("limit=0", "limit"),
        ("limit=100000", "limit"),
        ("open_at=noon", "open_at"),
        ("open_at=2026-11-30T12:00Z", "open_at"),
        ("plug=ccs2", "plug"),
        (f"network={'x' * 300}", "network"),
    ],
)
def test_what_is_asked_wrongly_is_named(charged: TestClient, query: str, field: str) -> None:
    problem = check_problem(charged.get(f"{STATIONS}?{query}"), 422, "invalid_request")
    assert [error["field"] for error in problem["errors"]] == [field]
    assert problem["errors"][0]["allowed"]


def test_a_time_with_a_zone_is_refused_in_words_that_say_what_is_meant(charged: TestClient) -> None:
    problem = check_problem(charged.get(f"{STATIONS}?open_at=2026-11-30T12:00Z"), 422, "invalid_request")
    assert problem["errors"][0]["allowed"] == "a local time without a time zone, such as 2026-11-30T08:15"


def test_a_graph_without_stations_has_none_and_an_unknown_one_is_named(charged: TestClient) -> None:
    answer = charged.get("/graphs/level/stations").json()
    assert (answer["features"], answer["sources"], answer["matched"]) == ([], [], 0)
    check_problem(charged.get("/graphs/atlantis/stations"), 404, "unknown_graph")


def test_damaged_stations_are_named_and_the_graph_is_answered_on_all_the_same(charged: TestClient) -> None:
    problem = check_problem(charged.get("/graphs/torn/stations"), 409, "graph_damaged")
    assert STATIONS_FILE in problem["detail"]
    assert "format_version" in problem["detail"]
    places = {"start": {"lat": 46.5, "lon": 8.003}, "goal": {"lat": 46.518, "lon": 8.02}}
    assert charged.post("/route", json={**places, "soc": 0.4, "graph": "torn"}).status_code == 200
    assert charged.get("/graphs/torn/tiles.json").status_code == 200


def test_tiles_show_stations_by_power_and_name_their_sources(charged: TestClient) -> None:
    described = charged.get("/graphs/grid/tiles.json").json()
    assert [layer["id"] for layer in described["vector_layers"]] == ["roads", "stations"]
    assert "© OpenStreetMap contributors" in described["attribution"]
    tile = charged.get(described["tiles"][0].format(z=10, x=534, y=362)).content
    roads, stations = read_tile(tile)
    assert (roads.name, stations.name) == ("roads", "stations")
    assert {feature.attributes["power_kw"] for feature in stations.features} <= {0, 22, 150}
    assert stations.features[-1].attributes["power_kw"] == 150  # the strongest is drawn on top
    assert set(stations.features[-1].attributes) <= set(described["vector_layers"][1]["fields"])
    level = charged.get("/graphs/level/tiles.json").json()
    assert [layer["id"] for layer in level["vector_layers"]] == ["roads"]
