"""GET /search, GET /reverse, and texts in place of coordinates."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.places.answer import NominatimCollection, NominatimPlace, PhotonCollection
from app.service.service import Service
from app.settings import Settings
from routing.gazetteer.building import content_of
from routing.gazetteer.entries import Collected, Entry, House, Kind
from routing.gazetteer.files import PLACES_FILE, index_bytes
from routing.gazetteer.graphs import streets_of
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import VEHICLES, street_grid
from tests.app.expected import check_problem, database_in

if TYPE_CHECKING:
    from collections.abc import Iterator

SOC = {"soc": 0.5, "vehicle": "hyundai-kona-64"}


def place(value: str, name: str, lat: float, lon: float, **names: str) -> Entry:
    kind = Kind.CITY if value == "town" else Kind.POINT
    key = "place" if value == "town" else "amenity"
    return Entry(kind, "n", 7, key, value, name, names, lat, lon, 0.5 if value == "town" else 0.2)


def grid_index() -> bytes:
    """The streets of the grid, a town in its middle, two cafés of one name, a house."""
    found: Collected = streets_of(street_grid("grid", Terrain.ABSENT))
    found.entries += [
        place("town", "Mittelstadt", 46.51, 8.01, en="Middletown"),
        place("cafe", "Gasthof Bär", 46.5001, 8.005),
        place("cafe", "Gasthof Löwe", 46.5001, 8.001),
        place("cafe", "Gasthof Löwe", 46.5199, 8.019),
    ]
    found.houses.append(House("w", 9, "12", "Street 0", 80050000, 465001000, "6490"))
    found.country, found.country_names = "ch", {"": "Schweiz", "en": "Switzerland"}
    return index_bytes(content_of(found, None, "grid"), "drawn", "nobody, CC0-1.0")


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A client of the grid with an index, beside a graph without and one whose index is damaged."""
    folder = tmp_path_factory.mktemp("graphs")
    save_graph(street_grid("grid", Terrain.ABSENT), folder / "grid", {PLACES_FILE: grid_index()})
    save_graph(street_grid("bare", Terrain.ABSENT), folder / "bare")
    empty = index_bytes(content_of(Collected(), None, "empty"), "drawn")
    save_graph(street_grid("empty", Terrain.ABSENT), folder / "empty", {PLACES_FILE: empty})
    settings = Settings(
        graph_dirs=(folder,), vehicle_dir=VEHICLES, database_url=database_in(folder), default_graph="grid"
    )
    service = Service(settings)
    service.load_all()
    with TestClient(create_app(settings, service)) as client:
        yield client


def test_a_search_is_answered_as_photon_does(named: TestClient) -> None:
    answered = named.get("/search", params={"q": "gasthof baer"})
    assert answered.headers["content-type"] == "application/geo+json"
    feature = answered.json()["features"][0]
    assert feature["geometry"] == {"type": "Point", "coordinates": [8.005, 46.5001]}
    assert feature["properties"] == {
        "osm_type": "N",
        "osm_id": 7,
        "osm_key": "amenity",
        "osm_value": "cafe",
        "type": "other",
        "name": "Gasthof Bär",
        "city": "Mittelstadt",
        "country": "Schweiz",
        "countrycode": "CH",
        "extra": {"graph": "grid", "match": feature["properties"]["extra"]["match"]},
    }
    PhotonCollection.model_validate(answered.json())


@pytest.mark.parametrize("form", ["jsonv2", "nominatim", "json"])
def test_a_search_is_answered_as_nominatim_does(named: TestClient, form: str) -> None:
    answered = named.get("/search", params={"q": "Street 0 12", "format": form, "addressdetails": 1, "zoom": 18})
    assert answered.headers["content-type"] == "application/json"
    found = answered.json()[0]
    NominatimPlace.model_validate(found)
    assert found["class" if form == "json" else "category"] == "place"
    assert (found["osm_type"], found["osm_id"], found["type"], found["place_rank"]) == ("way", 9, "house", 30)
    assert (found["lat"], found["lon"]) == ("46.5001000", "8.0050000")
    assert [type(part) for part in found["boundingbox"]] == [str] * 4
    south, north, west, east = map(float, found["boundingbox"])
    assert south < 46.5001 < north
    assert west < 8.005 < east
    assert found["address"] == {
        "house_number": "12",
        "road": "Street 0",
        "city": "Mittelstadt",
        "postcode": "6490",
        "country": "Schweiz",
        "country_code": "ch",
    }
    assert found["licence"] == "nobody, CC0-1.0"


def test_addresses_that_clients_of_photon_and_nominatim_have_are_the_same(named: TestClient) -> None:
    found = named.get("/search", params={"q": "mittelstadt"}).json()
    for address in ("/api", "/api/", "/search/"):
        assert named.get(address, params={"q": "mittelstadt"}, follow_redirects=False).json() == found
    assert named.get("/reverse/?lat=46.5&lon=8", follow_redirects=False).status_code == 200


def test_nominatims_geojson_is_a_collection_with_boxes(named: TestClient) -> None:
    answered = named.get("/search", params={"q": "Mittelstadt", "format": "geojson"}).json()
    NominatimCollection.model_validate(answered)
    assert answered["features"][0]["properties"]["addresstype"] == "town"


@pytest.mark.parametrize(
    ("lang", "header", "name"),
    [
        (None, None, "Mittelstadt"),
        ("en", None, "Middletown"),
        (None, "fr;q=0.9, en-GB;q=0.8, de;q=0.1", "Middletown"),
        ("de", "en", "Mittelstadt"),
        (None, "*;q=x, ;;;", "Mittelstadt"),
    ],
)
def test_names_are_in_the_language_of_the_parameter_or_the_header(
    named: TestClient, lang: str | None, header: str | None, name: str
) -> None:
    params = {"q": "mittelstadt"} | ({"lang": lang} if lang else {})
    headers = {"Accept-Language": header} if header else {"Accept-Language": ""}
    found = named.get("/search", params=params, headers=headers).json()["features"][0]["properties"]
    assert found["name"] == name


def test_reverse_answers_the_house_in_both_forms_and_nothing_far_away(named: TestClient) -> None:
    at = {"lat": 46.5002, "lon": 8.00501}
    photon = named.get("/reverse", params=at).json()["features"]
    assert [(feature["properties"]["street"], feature["properties"]["housenumber"]) for feature in photon] == [
        ("Street 0", "12")
    ]
    assert 0.0 < photon[0]["properties"]["extra"]["distance_m"] < 20.0
    nominatim = named.get("/reverse", params=at | {"format": "json"}).json()
    assert nominatim["address"]["house_number"] == "12"
    town = named.get("/reverse", params=at | {"format": "jsonv2", "zoom": 10}).json()
    assert town["name"] == "Mittelstadt"
    far = {"lat": -20.0, "lon": 8.0}
    assert named.get("/reverse", params=far).json()["features"] == []
    assert named.get("/reverse", params=far | {"format": "jsonv2"}).json() == {"error": "Unable to geocode"}


@pytest.mark.parametrize(
    ("address", "field"),
    [
        ("/search", "q"),
        ("/search?q=", "q"),
        ("/search?q=%20%20", "q"),
        ("/search?q=" + "a" * 201, "q"),
        ("/search?q=a&limit=0", "limit"),
        ("/search?q=a&limit=51", "limit"),
        ("/search?q=a&lat=46", "lon"),
        ("/search?q=a&lat=120&lon=8", "lat"),
        ("/search?q=a&format=xml", "format"),
        ("/search?q=a&bbox=1,2,3", "bbox"),
        ("/reverse?lat=46", "lon"),
        ("/reverse?lat=46&lon=8&radius=-1", "radius"),
    ],
)
def test_bad_parameters_name_the_field(named: TestClient, address: str, field: str) -> None:
    problem = check_problem(named.get(address), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field


def test_a_graph_without_an_index_is_told_with_how_to_make_one(named: TestClient) -> None:
    for address in ("/search?q=a&graph=bare", "/reverse?lat=46.5&lon=8&graph=bare"):
        problem = check_problem(named.get(address), 404, "no_places")
        assert "joulepath places build" in problem["errors"][0]["allowed"]
    check_problem(named.get("/search?q=a&graph=nowhere"), 404, "unknown_graph")
    assert check_problem(
        named.post("/route", json=SOC | {"start": "a", "goal": "b", "graph": "bare"}), 404, "no_places"
    )


def test_texts_on_a_graph_whose_index_is_empty_are_refused_with_how_to_fill_it(named: TestClient) -> None:
    sent = SOC | {"start": "a", "goal": "b", "graph": "empty"}
    problem = check_problem(named.post("/route", json=sent), 404, "no_places")
    assert problem["detail"].startswith("graph 'empty' has an empty index of places, allowed: ")
    assert (problem["errors"][0]["field"], problem["errors"][0]["value"]) == ("graph", "empty")
    assert named.get("/search?q=a&graph=empty").json()["features"] == []
    assert named.post("/route", json=SOC | {"start": "46.5, 8.0", "goal": "46.52N 8.02E", "graph": "empty"}).is_success


def test_an_index_is_taken_in_once_it_is_there_and_a_damaged_one_told(
    named: TestClient, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("later")
    save_graph(street_grid("grid", Terrain.ABSENT), folder / "grid")
    settings = Settings(
        graph_dirs=(folder,), vehicle_dir=VEHICLES, database_url=database_in(folder), default_graph="grid"
    )
    with TestClient(create_app(settings, Service(settings))) as client:
        check_problem(client.get("/search?q=gasthof"), 404, "no_places")
        (folder / "grid" / PLACES_FILE).write_bytes(b"torn")
        check_problem(client.get("/search?q=gasthof"), 409, "graph_damaged")
        (folder / "grid" / PLACES_FILE).unlink()
        (folder / "grid" / PLACES_FILE).write_bytes(grid_index())
        assert client.get("/search?q=gasthof").json()["features"]


def test_a_route_goes_between_texts_and_tells_what_they_were_taken_for(named: TestClient) -> None:
    sent = SOC | {"start": "gasthof bar", "goal": "Street 11", "via": ["mittelstadt", [8.0, 46.51]]}
    answered = named.post("/route", json=sent)
    assert answered.status_code == 200, answered.text
    answer = answered.json()
    assert [found["field"] for found in answer["places"]] == ["start", "via[0]", "goal"]
    start = answer["places"][0]
    assert (start["text"], start["label"], start["graph"]) == (
        "gasthof bar",
        "Gasthof Bär, Mittelstadt, Schweiz",
        "grid",
    )
    assert {other["label"].partition(",")[0] for other in start["alternatives"]} <= {"Gasthof Löwe"}
    assert answer["request"]["start"] == {"lat": 46.5001, "lon": 8.005}
    assert answer["snapped"]["start"]["asked"] == {"lat": 46.5001, "lon": 8.005}
    assert named.post("/route", json=answer["request"]).json()["places"] == []  # what was understood can be sent again
    geojson = named.post("/route", json=sent, headers={"Accept": "application/geo+json"}).json()
    assert geojson["places"] == answer["places"]


def test_coordinates_typed_as_a_text_are_coordinates(named: TestClient) -> None:
    texts = named.post("/route", json=SOC | {"start": "46.5, 8.0", "goal": "46.52N 8.02E"}).json()
    pairs = named.post("/route", json=SOC | {"start": [8.0, 46.5], "goal": {"lat": 46.52, "lon": 8.02}}).json()
    assert texts["routes"] == pairs["routes"]
    bare = named.post("/route", json=SOC | {"start": "46.5, 8.0", "goal": "46.52N 8.02E", "graph": "bare"})
    assert bare.status_code == 200, bare.text  # which needs no index


def test_a_range_starts_at_a_text(named: TestClient) -> None:
    answer = named.post("/range", json=SOC | {"origin": "mittelstadt"}).json()
    assert answer["places"][0]["label"] == "Mittelstadt, Schweiz"


def test_what_several_places_fit_is_refused_with_what_was_found(named: TestClient) -> None:
    problem = check_problem(
        named.post("/route", json=SOC | {"start": [8.01, 46.51], "goal": "löwe"}), 422, "ambiguous_place"
    )
    found: Any = problem["errors"][0]
    assert (found["field"], found["value"]) == ("goal", "löwe")
    assert found["allowed"].count("Gasthof Löwe") == 2
    suggested = found["suggestions"]
    assert sorted(place["lat"] for place in suggested) == [46.5001, 46.5199]
    assert all(place["label"].startswith("Gasthof Löwe") and place["kind"] == "point" for place in suggested)
    picked = {"lat": suggested[1]["lat"], "lon": suggested[1]["lon"]}
    assert named.post("/route", json=SOC | {"start": [8.01, 46.51], "goal": picked}).status_code == 200


def test_all_texts_that_are_not_taken_are_named_with_what_they_may_mean(named: TestClient) -> None:
    sent = SOC | {"start": "mittelstadt bahnhof", "via": ["mittelstadt"], "goal": "xyzzy"}
    problem = check_problem(named.post("/route", json=sent), 422, "unknown_place")
    first, last = problem["errors"]
    assert (first["field"], first["value"], last["field"], last["value"]) == (
        "start",
        "mittelstadt bahnhof",
        "goal",
        "xyzzy",
    )
    assert [place["label"] for place in first["suggestions"]] == ["Mittelstadt, Schweiz"]
    assert "suggestions" not in last
    assert "start is mittelstadt bahnhof" in problem["detail"]
    assert "goal is xyzzy" in problem["detail"]


def test_other_problems_have_no_suggestions(named: TestClient) -> None:
    problem = check_problem(
        named.post("/route", json={"start": [8.0, 46.5], "goal": [8.0, 46.5]}), 422, "invalid_request"
    )
    assert all("suggestions" not in field for field in problem["errors"])


@pytest.mark.parametrize("text", ["xyzzy", "\0", '"', "🦊", "' OR 1=1 --", "-", "\ud83e"])
def test_an_unknown_text_is_refused_with_field_and_value(named: TestClient, text: str) -> None:
    sent = json.dumps(SOC | {"start": [8.0, 46.5], "goal": text})
    answered = named.post("/route", content=sent, headers={"Content-Type": "application/json"})
    assert check_problem(answered, 422, answered.json()["code"])["code"] in ("unknown_place", "invalid_request")
    assert answered.json()["errors"][0]["field"] == "goal"


@pytest.mark.parametrize("text", ["", "a" * 201])
def test_an_empty_or_long_text_is_refused_before_it_is_looked_up(named: TestClient, text: str) -> None:
    problem = check_problem(
        named.post("/route", json=SOC | {"start": [8.0, 46.5], "goal": text}), 422, "invalid_request"
    )
    assert problem["errors"][0]["field"] == "goal"
