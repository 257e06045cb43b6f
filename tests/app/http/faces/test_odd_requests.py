"""Odd requests to the faces of other engines: none is a fault, and each refusal is in the engine's own form."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any, Final

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings
from tests.fuzz.faces import ask

if TYPE_CHECKING:
    from app.service.service import Service
    from app.settings import FaceName

SEEDS: Final = 1000
CORNERS: Final = ([8.001, 46.5], [8.019, 46.52], [8.01, 46.511])  # of the drawn map

START, GOAL = ({"lon": lon, "lat": lat} for lon, lat in CORNERS[:2])
TRIP: Final[dict[str, Any]] = {"locations": [START, GOAL], "costing": "auto"}
HERE: Final[dict[str, Any]] = {"locations": [START], "costing": "auto"}


def test_odd_requests_are_answered_or_refused_in_the_engines_own_form(client: TestClient) -> None:
    ends: Counter[str] = Counter()
    faults = []
    for seed in range(SEEDS):
        request, end = ask(client, seed, CORNERS)
        ends[end] += 1
        if not end.isdecimal():
            faults.append(f"{end}: {request}")
    assert not faults, "\n".join(faults)
    assert ends["200"] > 0.05 * SEEDS
    assert ends["400"] > 0.05 * SEEDS


@pytest.mark.parametrize(
    ("path", "sent", "status"),
    [
        ("/valhalla/route", {**TRIP, "id": "\udfff"}, 200),
        ("/valhalla/route", {**TRIP, "locations": [{**START, "name": "\udfff"}, {**GOAL, "street": 10**40}]}, 200),
        ("/valhalla/route", {**TRIP, "costing_options": {"auto": {"\udfff": 1}}}, 200),
        ("/valhalla/route", {**TRIP, "language": "\udfff", "elevation_interval": 1e-9}, 200),
        ("/valhalla/route", {**TRIP, "locations": [START, START], "elevation_interval": 30}, 200),
        ("/valhalla/height", {"shape": [{**START, "\udfff": 1}, {**GOAL, "y": 10**40}]}, 200),
        ("/valhalla/isochrone", {**HERE, "contours": [{"time": 10**6}, {"time": 1e-9}, {"time": 10**6}]}, 200),
        ("/valhalla/isochrone", {**HERE, "contours": [{"charge": 0.8}, {"charge": 0}]}, 200),
        ("/valhalla/sources_to_targets", {"sources": [START], "targets": [START] * 101, "costing": "auto"}, 400),
        ("/ors/v2/directions/ev", {"coordinates": CORNERS, "id": 10**40}, 400),
        ("/ors/v2/directions/ev", {"coordinates": CORNERS, "ev": {}, "options": {"ev": {"\udfff": 10**40}}}, 200),
        ("/ors/v2/directions/ev", {"coordinates": [CORNERS[0]] * 2, "elevation": True, "geometry_simplify": True}, 200),
        ("/ors/v2/directions/ev/gpx", {"coordinates": [CORNERS[0]] * 2}, 200),
        ("/ors/v2/isochrones/ev", {"locations": CORNERS[:1], "range": [600, 600.0000000001, 1e-9]}, 200),
        ("/ors/v2/isochrones/ev", {"locations": CORNERS[:1], "range": [1000], "interval": 1e-300}, 400),
        ("/osrm/table/v1/ev", {"coordinates": CORNERS, "fallback_speed": 1e-300}, 400),
        ("/osrm/route/v1/ev", {"coordinates": [[180.0, 46.5], [-180.0, 46.5]]}, 400),
    ],
)
def test_requests_that_were_thought_out_are_answered_or_refused(
    client: TestClient, path: str, sent: dict[str, Any], status: int
) -> None:
    answer = client.post(path, content=json.dumps(sent), headers={"Content-Type": "application/json"})
    assert answer.status_code == status, answer.text


@pytest.mark.parametrize(
    ("path", "kinds"),
    [
        ("/osrm/trip/v1/driving/1,2;3,4", {"NotImplemented"}),
        ("/osrm/route/v2/driving/1,2;3,4", {"InvalidVersion"}),
        ("/osrm/no_such/v1/driving/1,2;3,4", {"InvalidService"}),
        ("/osrm/route", {"InvalidVersion", "InvalidUrl"}),
        ("/osrm/", {"InvalidUrl"}),
        ("/osrm/route/v1/driving/1,2;3,4?hints=;;;", {"InvalidOptions"}),
        ("/osrm/route/v1/driving/1,2;3,4?format=flatbuffers", {"NotImplemented"}),
        ("/osrm/route/v1/driving/1,2;3,4.flatbuffers", {"NotImplemented"}),
    ],
)
def test_addresses_that_osrm_would_refuse_have_its_codes(client: TestClient, path: str, kinds: set[str]) -> None:
    answer = client.get(path)
    assert answer.status_code == 400
    assert answer.json()["code"] in kinds


@pytest.mark.parametrize("faces", [(), ("osrm",), ("ors", "valhalla")])
def test_settings_say_which_faces_there_are(service: Service, settings: Settings, faces: tuple[FaceName, ...]) -> None:
    asking = {"osrm": "/osrm/nearest/v1/driving/8,46.5", "ors": "/ors/v2/health", "valhalla": "/valhalla/status"}
    with TestClient(create_app(settings.model_copy(update={"faces": faces}), service)) as client:
        for name, path in asking.items():
            assert (client.get(path).status_code == 200) == (name in faces)


def test_faces_are_read_from_a_list_with_commas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_FACES", "valhalla, osrm")
    assert Settings().faces == ("valhalla", "osrm")
    monkeypatch.setenv("JOULEPATH_FACES", "")
    assert Settings().faces == ()
    monkeypatch.setenv("JOULEPATH_FACES", "graphhopper")
    with pytest.raises(ValueError, match="osrm"):
        Settings()
