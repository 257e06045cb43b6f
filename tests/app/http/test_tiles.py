"""GET /graphs/{name}/tiles.json, and the tiles that it names."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import ValidationError
from starlette.testclient import TestClient

from app.settings import Settings
from app.tiles.address import TileAddress
from tests.app.expected import check_problem
from tests.app.tiles.tile_reader import read_tile

if TYPE_CHECKING:
    from fastapi import FastAPI
    from httpx import Response

MVT = "application/vnd.mapbox-vector-tile"
# zoom 10: column (8.01 / 360 + 0.5) · 1024 = 534.8; row of 46.51° by the Mercator projection 362.2
ROADS = "/graphs/grid/tiles/10/534/362.mvt"
HEIGHTS = "/graphs/grid/heights/10/534/362.png"


def raw(client: TestClient, path: str, **headers: str) -> tuple[Response, bytes]:
    """An answer and its body as it was sent, without what the client does with its encoding."""
    with client.stream("GET", path, headers={"Accept-Encoding": "identity", **headers}) as response:
        return response, b"".join(response.iter_raw())


@pytest.fixture(scope="module")
def tile_json(client: TestClient) -> dict[str, Any]:
    described: dict[str, Any] = client.get("/graphs/grid/tiles.json").json()
    return described


def test_tile_json_names_zooms_bounds_and_layer(tile_json: dict[str, Any]) -> None:
    assert (tile_json["tilejson"], tile_json["scheme"]) == ("3.0.0", "xyz")
    assert (tile_json["minzoom"], tile_json["maxzoom"]) == (0, 14)
    assert tile_json["bounds"] == [8.0, 46.5, 8.02, 46.52]
    assert tile_json["attribution"] == "none needed"
    (layer,) = tile_json["vector_layers"]
    assert layer["id"] == "roads"
    assert set(layer["fields"]) == {"class", "name", "speed_kmh", "oneway", "structure"}


def test_addresses_of_tile_json_lead_to_tiles_that_may_be_kept_for_good(
    client: TestClient, tile_json: dict[str, Any]
) -> None:
    for template, media_type in ((tile_json["tiles"][0], MVT), (tile_json["heights"]["tiles"][0], "image/png")):
        response = client.get(template.format(z=10, x=534, y=362))
        assert response.status_code == 200
        assert response.headers["content-type"] == media_type
        assert response.headers["cache-control"] == "public, max-age=31536000, immutable"


def test_heights_of_tile_json_are_those_of_a_raster_dem_source(tile_json: dict[str, Any]) -> None:
    heights = tile_json["heights"]
    assert (heights["encoding"], heights["tileSize"], heights["minzoom"]) == ("terrarium", 256, 0)
    assert 10 <= heights["maxzoom"] <= 14
    west, south, east, north = heights["bounds"]
    assert west < 8.0 < 8.02 < east
    assert south < 46.5 < 46.52 < north


def test_tile_json_of_a_graph_without_terrain_has_no_heights(client: TestClient) -> None:
    assert client.get("/graphs/level/tiles.json").json()["heights"] is None


@pytest.mark.usefixtures("client")  # which has started the application
def test_tile_json_behind_a_path_prefix_names_it(app: FastAPI) -> None:
    prefixed = TestClient(app, root_path="/energy")
    described = prefixed.get("/energy/graphs/grid/tiles.json").json()
    assert described["tiles"][0].startswith("http://testserver/energy/graphs/grid/tiles/{z}/{x}/{y}.mvt?v=")
    assert described["heights"]["tiles"][0].startswith("http://testserver/energy/graphs/grid/heights/")
    assert prefixed.get(described["tiles"][0].format(z=10, x=534, y=362)).status_code == 200


@pytest.mark.parametrize("path", [ROADS, ROADS + "?v=0123456789abcdef", HEIGHTS])
def test_tile_without_the_current_digest_is_asked_for_again(client: TestClient, path: str) -> None:
    assert client.get(path).headers["cache-control"] == "no-cache"


def test_roads_are_compressed_once_for_a_client_that_takes_it(client: TestClient) -> None:
    packed, packed_body = raw(client, ROADS, **{"Accept-Encoding": "br, gzip"})
    plain, plain_body = raw(client, ROADS)
    assert packed.headers["content-encoding"] == "gzip"
    assert "content-encoding" not in plain.headers
    assert gzip.decompress(packed_body) == plain_body
    assert len(read_tile(plain_body)[0].features) > 0
    for response in (packed, plain):
        assert "Accept-Encoding" in response.headers["vary"]


def test_roads_in_two_encodings_have_two_tags(client: TestClient) -> None:
    tags = {raw(client, ROADS, **{"Accept-Encoding": taken})[0].headers["etag"] for taken in ("gzip", "identity")}
    assert len(tags) == 2
    assert all(tag.startswith('"') and tag.endswith('"') for tag in tags)


def test_heights_are_not_compressed_again(client: TestClient) -> None:
    response, body = raw(client, HEIGHTS, **{"Accept-Encoding": "gzip"})
    assert "content-encoding" not in response.headers
    assert body.startswith(b"\x89PNG\r\n\x1a\n")
    assert len(body) > 1000  # long enough to be compressed otherwise


@pytest.mark.parametrize("path", [ROADS, HEIGHTS])
@pytest.mark.parametrize("form", ["{}", "W/{}", '"other", {}', "*"])
def test_tile_that_the_client_has_is_not_sent_again(client: TestClient, path: str, form: str) -> None:
    tag = client.get(path).headers["etag"]
    response = client.get(path, headers={"If-None-Match": form.format(tag)})
    assert (response.status_code, response.content) == (304, b"")
    assert response.headers["etag"] == tag
    assert response.headers["cache-control"] == "no-cache"


def test_tag_of_another_tile_does_not_keep_this_one(client: TestClient) -> None:
    other = client.get("/graphs/grid/tiles/11/1069/724.mvt").headers["etag"]
    assert client.get(ROADS, headers={"If-None-Match": other}).status_code == 200


def test_tile_without_roads_is_an_empty_answer(client: TestClient) -> None:
    response = client.get("/graphs/grid/tiles/10/0/0.mvt")
    assert (response.status_code, response.content) == (200, b"")


def test_tiles_of_an_unknown_graph_are_a_problem(client: TestClient) -> None:
    for path in ("tiles.json", "tiles/1/0/0.mvt", "heights/1/0/0.png"):
        problem = check_problem(client.get(f"/graphs/atlantis/{path}"), 404, "unknown_graph")
        assert problem["errors"][0]["value"] == "atlantis"


def test_heights_of_a_graph_without_terrain_are_a_problem(client: TestClient) -> None:
    problem = check_problem(client.get("/graphs/level/heights/1/0/0.png"), 404, "not_found")
    assert "graph 'level' has no heights" in problem["detail"]
    assert problem["errors"][0]["field"] == "name"


@pytest.mark.parametrize(
    ("path", "field", "value", "allowed"),
    [
        ("tiles/2/4/0.mvt", "x", 4, "0..3 at zoom 2"),
        ("tiles/2/0/7.mvt", "y", 7, "0..3 at zoom 2"),
        ("heights/0/1/0.png", "x", 1, "0..0 at zoom 0"),
        ("tiles/15/0/0.mvt", "z", "15", "at most 14"),
        ("tiles/-1/0/0.mvt", "z", "-1", "at least 0"),
        ("heights/1/-1/0.png", "x", "-1", "at least 0"),
    ],
)
def test_tile_beyond_the_pyramid_is_a_problem_that_names_the_range(
    client: TestClient, path: str, field: str, value: object, allowed: str
) -> None:
    problem = check_problem(client.get(f"/graphs/grid/{path}"), 422, "invalid_request")
    assert problem["errors"] == [{"field": field, "value": value, "allowed": allowed}]


def test_address_of_the_tests_is_the_tile_of_the_grid() -> None:
    west, south, east, north = TileAddress(10, 534, 362).bounds_deg()
    assert west < 8.0 < 8.02 < east
    assert south < 46.5 < 46.52 < north


def test_tile_json_names_whole_addresses_that_clients_reach(app: FastAPI, client: TestClient) -> None:
    service = app.state.service
    settings = service.settings
    assert client.get("/graphs/grid/tiles.json").json()["tiles"][0].startswith("http://testserver/graphs/grid/tiles/")
    service.settings = settings.model_copy(update={"public_url": "https://maps.example/energy"})
    try:
        found = client.get("/graphs/grid/tiles.json").json()
    finally:
        service.settings = settings
    assert found["tiles"][0].startswith("https://maps.example/energy/graphs/grid/tiles/{z}/{x}/{y}.mvt?v=")
    assert found["heights"]["tiles"][0].startswith("https://maps.example/energy/graphs/grid/heights/")


@pytest.mark.parametrize("address", ["maps.example", "ftp://maps.example", "https://maps.example/?key=1"])
def test_public_address_is_a_whole_one(address: str) -> None:
    with pytest.raises(ValidationError, match="https://HOST/PATH"):
        Settings(public_url=address)


@pytest.mark.parametrize(
    "path",
    ["/graphs", "/graphs/grid", "/vehicles", "/vehicles/hyundai-kona-64", "/graphs/grid/tiles.json"],
)
def test_lists_are_not_sent_again_to_who_has_them(client: TestClient, path: str) -> None:
    first = client.get(path)
    assert first.headers["cache-control"] == "no-cache"
    again = client.get(path, headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", first.headers["etag"])
    other = client.get(path, headers={"If-None-Match": 'W/"0123"'})
    assert other.content == first.content


def test_a_range_is_not_sent_again_to_who_has_it(client: TestClient) -> None:
    asked = {"lat": 46.51, "lon": 8.01, "soc": 0.5, "graph": "grid"}
    first = client.get("/range", params=asked)
    assert first.status_code == 200
    tag = {"If-None-Match": first.headers["etag"]}
    assert client.get("/range", params=asked, headers=tag).status_code == 304
    assert client.get("/range", params={**asked, "soc": 0.4}, headers=tag).status_code == 200
