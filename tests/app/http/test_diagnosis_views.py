"""What maps, charts and pickers show of a diagnosis: residuals by place, trips along time, verdicts in lists."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pytest

from app.schemas.diagnosis import ResidualCollection, TripTimelineAnswer
from energy.vehicle.vehicle import Vehicle
from tests.app.conftest import SOUTH
from tests.app.expected import check_problem
from tests.app.http.test_diagnoses import CAR, finished, started, uploads
from tests.app.street_drives import CONSUMER_W, FIRST_DEG, MIDDLE_DEG, write_street_drive

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from starlette.testclient import TestClient

    from app.service.service import Service
    from app.settings import Settings

ODD_NAME = "fährt 50%#1? a+b"
CLOCK_S = 1_700_000_000.0


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory, service: Service) -> Path:
    """A folder of three drives with positions, of which two begin late by their clock, and one without."""
    folder = tmp_path_factory.mktemp("drives")
    car = service.known_vehicle(CAR)
    assert isinstance(car, Vehicle)
    write_street_drive(folder / "slow.csv", car, top_kmh=30.0)
    write_street_drive(folder / f"{ODD_NAME}.csv", car, begin_s=CLOCK_S)
    write_street_drive(folder / "fast.csv", car, top_kmh=45.0, begin_s=-50.0)
    write_street_drive(folder / "blind.csv", car, positions=False)
    return folder


@pytest.fixture(scope="module")
def running(
    settings: Settings, service: Service, drives: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[TestClient]:
    """A client of an application with the folder of drives."""
    with started(settings, service, tmp_path_factory.mktemp("views"), recordings_dir=drives) as client:
        yield client


@pytest.fixture(scope="module")
def on_graph(running: TestClient) -> dict[str, Any]:
    """A finished diagnosis of all drives on the graph."""
    body = {"recordings": ["*.csv"], "vehicle": CAR, "graph": "level", "holdout": ["fast"]}
    return finished(running, running.post("/diagnoses", json=body))


@pytest.fixture(scope="module")
def on_tracks(running: TestClient, drives: Path) -> dict[str, Any]:
    """A finished diagnosis of three uploaded drives without a graph."""
    return finished(running, running.post("/diagnoses", data={"vehicle": CAR}, files=uploads(drives, "[!s]*.csv")))


def residuals(client: TestClient, diagnosis: dict[str, Any]) -> dict[str, Any]:
    response = client.get(diagnosis["links"]["residuals"])
    assert response.headers["content-type"] == "application/geo+json"
    ResidualCollection.model_validate_json(response.text, by_alias=True)
    collection: dict[str, Any] = response.json()
    return collection


def trips(client: TestClient, diagnosis: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {trip["id"]: trip for trip in client.get(diagnosis["links"]["trips"]).json()["trips"]}


def test_diagnosis_on_a_graph_has_profiles_and_tells_which_trips_are_not_on_it(on_graph: dict[str, Any]) -> None:
    assert on_graph["state"] == "done", on_graph
    assert on_graph["request"]["graph"] == "level"
    assert {split["trip"] for split in on_graph["result"]["profile"]} == {"slow", "fast", ODD_NAME}
    (warning,) = on_graph["warnings"]
    assert warning.startswith("not on the graph: blind: ")
    assert "latitude_deg" in warning


def test_drives_without_height_get_that_of_the_graph_they_are_on(running: TestClient) -> None:
    body = {"recordings": ["*.csv"], "vehicle": CAR, "graph": "grid"}
    result = finished(running, running.post("/diagnoses", json=body))["result"]
    heights = {note["trip"]: note for note in result["data_quality"] if note["channel"] == "elevation_m"}
    assert {name: note["kind"] for name, note in heights.items()} == {
        "slow": "filled",
        "fast": "filled",
        ODD_NAME: "filled",
        "blind": "missing",
    }
    assert heights["slow"]["text"] == (
        "filled in from graph grid, straight between its nodes; 100% of its way is on it"
    )
    assert heights["blind"]["text"].startswith("not filled in from graph grid: ")
    (lack,) = [lack for lack in result["missing"] if lack["channel"] == "elevation_m"]
    assert lack["trips"] == ["blind"]
    assert "Height was filled in from graph grid on 3 of 4 drives" in result["text"]


def test_residuals_on_links_lie_where_the_consumer_is_on_whatever_the_clocks(
    running: TestClient, on_graph: dict[str, Any]
) -> None:
    collection = residuals(running, on_graph)
    assert (collection["kind"], collection["graph"]) == ("links", "level")
    west, east = sorted(collection["features"], key=lambda feature: feature["geometry"]["coordinates"][0])
    assert (west["properties"]["trips"], east["properties"]["trips"]) == (3, 3)
    # a window of 10 s at 30 to 45 km/h is 80 to 125 m of 690 m long, and may reach over the crossing
    assert abs(west["properties"]["mean_w"]) < 0.1 * CONSUMER_W
    assert east["properties"]["mean_w"] == pytest.approx(CONSUMER_W, rel=0.1)


def test_residuals_without_a_graph_lie_along_the_tracks_of_trips_with_positions(
    running: TestClient, on_tracks: dict[str, Any]
) -> None:
    assert on_tracks["warnings"] == []
    collection = residuals(running, on_tracks)
    assert (collection["kind"], collection["graph"]) == ("tracks", None)
    assert {feature["properties"]["trip"] for feature in collection["features"]} == {"fast", ODD_NAME}
    for feature in collection["features"]:
        line = feature["geometry"]["coordinates"]
        assert all(lat == SOUTH for _, lat in line)
        expected_w = 0.0 if line[-1][0] < MIDDLE_DEG else CONSUMER_W if line[0][0] > MIDDLE_DEG else None
        if expected_w is not None:
            assert feature["properties"]["mean_w"] == pytest.approx(expected_w, abs=0.05 * CONSUMER_W)


def test_trips_are_listed_with_paths_to_their_timelines_whatever_their_names(
    running: TestClient, on_graph: dict[str, Any]
) -> None:
    listed = trips(running, on_graph)
    assert set(listed) == {trip["id"] for trip in on_graph["result"]["trips"]} == {"slow", "fast", "blind", ODD_NAME}
    assert [listed[name]["held_out"] for name in ("slow", "fast")] == [False, True]
    for name, outline in listed.items():
        assert outline["links"]["self"] == f"/diagnoses/{on_graph['id']}/trips/{quote(name, safe='')}"
        timeline = running.get(outline["links"]["self"]).json()
        assert (timeline["id"], len(timeline["t_s"])) == (name, outline["points"])


def test_timeline_has_powers_speeds_and_places_of_one_length(running: TestClient, on_graph: dict[str, Any]) -> None:
    outline = trips(running, on_graph)[ODD_NAME]
    response = running.get(outline["links"]["self"])
    timeline = TripTimelineAnswer.model_validate_json(response.text)
    assert timeline.lat is not None
    assert timeline.lon is not None
    assert timeline.t_s == [10.0 * k for k in range(len(timeline.t_s))]  # since the first sample, not by the clock
    arrays = (timeline.duration_s, timeline.speed_kmh, timeline.measured_w, timeline.before_w, timeline.after_w)
    assert {len(column) for column in (*arrays, timeline.lat, timeline.lon)} == {len(timeline.t_s)}
    assert set(timeline.lat) == {SOUTH}
    east = [degree for degree in timeline.lon if degree is not None]
    assert east == sorted(east)
    assert outline["bbox"] == [east[0], SOUTH, east[-1], SOUTH]
    assert east[0] > FIRST_DEG
    assert max(timeline.speed_kmh) == pytest.approx(36.0, abs=0.1)
    cruising = [k for k, speed in enumerate(timeline.speed_kmh) if speed == 36.0]
    half_window_deg = 0.0007  # 5 s at 36 km/h are 50 m
    for k in cruising[1:-1]:  # power sampled while speed changes reaches into the first and the last
        if abs(east[k] - MIDDLE_DEG) > half_window_deg:
            expected_w = CONSUMER_W if east[k] > MIDDLE_DEG else 0.0
            assert timeline.measured_w[k] - timeline.after_w[k] == pytest.approx(expected_w, abs=1.0)
    assert len(cruising) > 8


def test_list_says_verdict_sentence_and_number_of_recordings(running: TestClient, on_graph: dict[str, Any]) -> None:
    lines = {line["id"]: line for line in running.get("/diagnoses").json()["diagnoses"]}
    line = lines[on_graph["id"]]
    assert (line["verdict"], line["recordings"]) == ("too_few_trips", 4)
    assert line["text"] == on_graph["result"]["text"]


def test_diagnosis_that_is_not_done_has_no_verdict_and_neither_residuals_nor_trips(running: TestClient) -> None:
    body = {"recordings": ["slow.csv", "fast.csv"], "vehicle": CAR}
    queued = running.post("/diagnoses", json=body).json()
    assert (queued["verdict"], queued["text"], queued["recordings"]) == (None, None, 2)
    assert (queued["links"]["residuals"], queued["links"]["trips"]) == (None, None)
    path = queued["links"]["self"]
    running.delete(path)
    for part in ("residuals", "trips", "trips/slow"):
        check_problem(running.get(f"{path}/{part}"), 409, "diagnosis_not_done")


def test_unknown_graph_of_a_diagnosis_is_refused_at_once(running: TestClient, drives: Path) -> None:
    body = {"recordings": ["slow.csv"], "vehicle": CAR, "graph": "atlantis"}
    problem = check_problem(running.post("/diagnoses", json=body), 404, "unknown_graph")
    assert problem["errors"][0]["field"] == "graph"
    form = {"vehicle": CAR, "graph": "atlantis"}
    check_problem(running.post("/diagnoses", data=form, files=uploads(drives, "slow.csv")), 404, "unknown_graph")


@pytest.mark.parametrize("trip", ["monday", "%00", "..%2Fslow", "slow.csv"])
def test_unknown_trip_answers_404(running: TestClient, on_graph: dict[str, Any], trip: str) -> None:
    response = running.get(f"/diagnoses/{on_graph['id']}/trips/{trip}")
    assert response.status_code == 404
    assert response.json()["code"] in ("unknown_trip", "not_found")
