"""Lean answers and formats over HTTP."""

from __future__ import annotations

import gzip
import json
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest
from shapely.geometry import shape
from starlette.testclient import TestClient

from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from tests.app.expected import check_problem, database_in

if TYPE_CHECKING:
    from collections.abc import Iterator

ROUTE: dict[str, Any] = {"start": [8.001, 46.5], "via": [[8.02, 46.505]], "goal": [8.0, 46.515], "soc": 0.5}
RANGE = "/range?lat=46.5&lon=8.003&soc=0.006"
GEOJSON = {"Accept": "application/geo+json"}
# the example of README.md
LONG: dict[str, Any] = {"start": [-36.433, 43.872], "goal": [-35.19, 43.697], "soc": 0.5, "vehicle": "hyundai-kona-64"}


def ask(client: TestClient, **changes: Any) -> dict[str, Any]:
    response = client.post("/route", json=ROUTE | changes)
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


@pytest.fixture(scope="module")
def highlands(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = Settings(database_url=database_in(tmp_path_factory.mktemp("lean")))
    service = Service(settings)
    with TestClient(create_app(settings, service)) as client:
        yield client


def sent_bytes(client: TestClient, method: str, path: str, body: dict[str, Any] | None = None) -> int:
    """Bytes of an answer as it goes over the wire."""
    with client.stream(method, path, json=body, headers={"Accept-Encoding": "gzip"}) as response:
        assert response.status_code == 200
        assert response.headers["content-encoding"] == "gzip"
        return len(b"".join(response.iter_raw()))


def test_route_of_137_km_with_polyline_and_without_links_is_at_most_20_kb(highlands: TestClient) -> None:
    two = LONG | {"links": False, "geometry_format": "polyline6", "alternatives": ["eco", "fastest"]}
    assert highlands.post("/route", json=two).json()["routes"][0]["distance_m"] == pytest.approx(137_000, rel=0.01)
    assert sent_bytes(highlands, "POST", "/route", two) <= 20_000


@pytest.mark.parametrize("asked", ["soc=0.1", "soc=0.3", "soc=0.8", "soc=1", "soc=0.1&outline=filled"])
def test_three_bands_on_highlands_are_at_most_60_kb_and_nest(highlands: TestClient, asked: str) -> None:
    path = f"/range?lat=44.3536&lon=-36.5003&bands=3&{asked}"
    assert sent_bytes(highlands, "GET", path) <= 60_000
    areas = [shape(band["geometry"]) for band in highlands.get(path).json()["features"][:-1]]
    assert all(area.is_valid for area in areas)
    for outer, inner in pairwise(areas):
        assert inner.difference(outer).area < 1e-9  # a square of 3 m, what rounding leaves of filled outlines


def test_answer_of_two_figures_has_nothing_else(client: TestClient) -> None:
    whole = ask(client)
    few = ask(client, fields=["routes.distance_m", "routes.energy_parts_kwh.rolling"])
    (route,) = whole["routes"]
    rolling = route["energy_parts_kwh"]["rolling"]
    assert few == {"routes": [{"distance_m": route["distance_m"], "energy_parts_kwh": {"rolling": rolling}}]}


@pytest.mark.parametrize(
    ("name", "likely"),
    [
        ("routes.distnace_m", "routes.distance_m"),
        ("distance_m", "routes.distance_m"),
        ("routes.link", "routes.links"),
        ("energy", "routes.weights.energy"),
    ],
)
def test_unknown_name_is_refused_with_those_most_like_it(client: TestClient, name: str, likely: str) -> None:
    response = client.post("/route", json=ROUTE | {"fields": ["routes.name", name]})
    problem = check_problem(response, 422, "invalid_request")
    (error,) = problem["errors"]
    assert (error["field"], error["value"]) == ("fields[1]", name)
    assert likely in error["allowed"].rpartition("did you mean ")[2]


def test_unknown_name_in_an_address_and_of_a_matrix_is_refused_too(client: TestClient) -> None:
    (error,) = check_problem(client.get(f"{RANGE}&fields=features.properties.area"), 422, "invalid_request")["errors"]
    assert "features.properties.area_km2" in error["allowed"]
    body = {"sources": [[8.001, 46.5]], "soc": 0.5, "fields": ["energy"]}
    (error,) = check_problem(client.post("/matrix", json=body), 422, "invalid_request")["errors"]
    assert "energy_kwh" in error["allowed"]


def test_matrix_has_the_parts_and_digits_that_are_asked_for(client: TestClient) -> None:
    body = {"sources": [[8.001, 46.5], [8.019, 46.52]], "soc": 0.5}
    whole = client.post("/matrix", json=body).json()["energy_kwh"]
    few = client.post("/matrix", json=body | {"fields": ["energy_kwh"], "compact": True}).json()
    assert few == {"energy_kwh": [[float(f"{figure:.6g}") for figure in row] for row in whole]}


def test_overview_simplifies_lines_or_leaves_them_out(client: TestClient) -> None:
    full = ask(client, steps=True)["routes"][0]
    simple = ask(client, steps=True, overview="simplified")["routes"][0]
    none = ask(client, overview="none")["routes"][0]
    line, short = full["geometry"]["coordinates"], simple["geometry"]["coordinates"]
    assert none["geometry"] is None
    assert len(short) < len(line)
    assert set(map(tuple, short)) <= set(map(tuple, line))
    assert simple["links"][-1]["geometry_end"] == simple["steps"][-1]["geometry_last"] == len(short) - 1
    assert short[simple["steps"][0]["geometry_first"]] == line[0]
    assert simple["distance_m"] == full["distance_m"]


def test_lines_are_texts_where_that_is_asked_for_but_not_in_geojson(client: TestClient) -> None:
    (route,) = ask(client, geometry_format="polyline5")["routes"]
    assert isinstance(route["geometry"], str)
    response = client.post("/route", json=ROUTE | {"geometry_format": "polyline5"}, headers=GEOJSON)
    (error,) = check_problem(response, 422, "invalid_request")["errors"]
    assert (error["field"], error["allowed"]) == ("geometry_format", "'geojson' in GeoJSON")


def test_geojson_is_compact_and_coloured(client: TestClient) -> None:
    plain = ask(client)["routes"][0]
    features = client.post("/route", json=ROUTE, headers=GEOJSON).json()["features"]
    route = features[0]["properties"]
    assert route["energy_kwh"] == float(f"{plain['energy_kwh']:.6g}") != plain["energy_kwh"]
    kept = {name: energy for name, energy in plain["energy_parts_kwh"].items() if energy != 0.0}
    assert route["energy_parts_kwh"] == {name: float(f"{energy:.6g}") for name, energy in kept.items()}
    assert features[0]["geometry"] == plain["geometry"]
    assert route["stroke"] == "#0b7a55"
    assert [point["properties"]["marker-color"] for point in features[1:]] == ["#0b7a55", "#5a3fb5", "#b3421b"]
    beyond = client.post("/route", json=ROUTE | {"soc": 0.001}, headers=GEOJSON).json()["features"][0]
    assert beyond["properties"]["stroke"] == "#8a9293"


def test_geojson_with_fields_stays_geojson(client: TestClient) -> None:
    body = ROUTE | {"fields": ["routes.distance_m", "routes.geometry", "snapped"]}
    found = client.post("/route", json=body, headers=GEOJSON).json()
    assert set(found) == {"type", "features", "snapped"}
    assert [feature["geometry"]["type"] for feature in found["features"]] == ["LineString", *["Point"] * 3]
    assert set(found["features"][0]["properties"]) == {"name", "distance_m", "stroke"}
    areas = client.get(f"{RANGE}&fields=features.properties.area_km2").json()
    assert {"type", "features"} == set(areas)
    assert areas["features"][0]["geometry"] is None
    assert set(areas["features"][0]["properties"]) == {"kind", "area_km2", "stroke", "fill"}


def test_range_with_no_tolerance_is_as_it_was_drawn(client: TestClient) -> None:
    exact = client.get(f"{RANGE}&tolerance_m=0").json()["features"][0]
    simple = client.get(RANGE).json()["features"][0]
    far = client.get(f"{RANGE}&tolerance_m=200").json()["features"][0]
    sizes = [len(json.dumps(band["geometry"])) for band in (exact, simple, far)]
    assert sizes == sorted(sizes, reverse=True)
    assert [band["properties"]["tolerance_m"] < 20.0 for band in (exact, simple, far)] == [True, True, False]
    check_problem(client.get(f"{RANGE}&tolerance_m=-1"), 422, "invalid_request")


@pytest.mark.parametrize(
    ("path", "form", "accept", "begins"),
    [
        ("/route", "gpx", "application/gpx+xml", b"<?xml"),
        ("/route", "kml", "application/vnd.google-earth.kml+xml", b"<?xml"),
        ("/route", "parquet", "application/vnd.apache.parquet", b"PAR1"),
        ("/route", "csv", "text/csv", b"route,id,"),
        ("/route", "geojson", "application/geo+json", b'{"'),
        ("/range", "kml", "application/vnd.google-earth.kml+xml", b"<?xml"),
        ("/range", "parquet", "application/vnd.apache.parquet", b"PAR1"),
        ("/matrix", "csv", "text/csv", b"source,target,"),
        ("/matrix", "parquet", "application/vnd.apache.parquet", b"PAR1"),
    ],
)
def test_formats_are_asked_for_by_address_and_by_accept(
    client: TestClient, path: str, form: str, accept: str, begins: bytes
) -> None:
    bodies = {"/route": ROUTE, "/range": {"origin": [8.003, 46.5], "soc": 0.006}}
    body = bodies.get(path, {"sources": [[8.001, 46.5], [8.019, 46.52]], "soc": 0.5})
    named = client.post(f"{path}?format={form}", json=body, headers={"Accept": "application/json"})
    accepted = client.post(path, json=body, headers={"Accept": f"text/html, {accept};q=0.9"})
    for response in (named, accepted):
        assert response.status_code == 200, response.text
        assert response.headers["content-type"].partition(";")[0] == accept
        assert response.content.startswith(begins)
        assert "Accept" in response.headers["vary"].split(", ")
    saved = named.headers.get("content-disposition")
    assert saved == (None if form == "geojson" else f'attachment; filename="{path[1:]}.{form}"')


def test_range_in_the_address_takes_formats_and_refuses_others(client: TestClient) -> None:
    assert client.get(f"{RANGE}&format=kml").content.startswith(b"<?xml")
    assert client.get(RANGE, headers={"Accept": "text/html,*/*"}).headers["content-type"] == "application/geo+json"
    check_problem(client.get(f"{RANGE}&format=gpx"), 422, "invalid_request")
    check_problem(client.post("/route?format=shp", json=ROUTE), 422, "invalid_request")


def test_files_are_compressed(client: TestClient) -> None:
    with client.stream("POST", "/route?format=gpx", json=ROUTE, headers={"Accept-Encoding": "gzip"}) as response:
        assert gzip.decompress(b"".join(response.iter_raw())).startswith(b"<?xml")
        assert response.headers["vary"].startswith("Accept, Accept-Encoding")
