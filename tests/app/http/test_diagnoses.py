"""POST /diagnoses: recordings in, a job that can be watched and cancelled, and what it leaves."""

from __future__ import annotations

import errno
import json
import os
import re
import socket
import sqlite3
import time
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from energy.vehicle.vehicle import Vehicle
from tests.app.expected import TABLE, VEHICLE, check_problem, database_in
from tests.app.recorded import write_recording, write_winter

if TYPE_CHECKING:
    from collections.abc import Iterator

    from httpx import Response


CAR = "hyundai-kona-64"
BAD = b"time_s,speed_kmh,power_w\n0,10,500\n1,ten,500\n2,11,500\n"
LIMIT_BYTES = 2_000_000
LIMIT_FILES = 15
LONGEST_WAIT_S = 120.0
ROUTE = {"start": [8.003, 46.5], "goal": [8.02, 46.518], "soc": 0.5}


@contextmanager
def started(settings: Settings, service: Service, folder: Path, **changes: Any) -> Iterator[TestClient]:
    """A client of an application of its own on a database in a folder, with graphs that are loaded already."""
    chosen = settings.model_copy(update={"database_url": database_in(folder), **changes})
    own = Service(chosen, {})
    own.atlas = service.atlas
    with TestClient(create_app(own.settings, own)) as client:
        yield client


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory, service: Service) -> Path:
    """A folder of recordings: ten cold drives in `winter`, one that can't be read, and a link that leads outside."""
    folder = tmp_path_factory.mktemp("recordings")
    car = service.known_vehicle(CAR)
    assert isinstance(car, Vehicle)
    write_winter(folder / "winter", car)
    (folder / "winter" / "notes.txt").write_text("no recording", encoding="utf-8")
    (folder / "bad").mkdir()
    (folder / "bad" / "broken.csv").write_bytes(BAD)
    outside = write_recording(folder.parent / f"{folder.name}-outside.csv", car, ambient_c=0.0, seed=99)
    (folder / "link.csv").symlink_to(outside)
    return folder


@pytest.fixture(scope="module")
def running(
    settings: Settings, service: Service, recordings: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[TestClient]:
    """A client of an application with a folder of recordings and small limits."""
    limits = {"diagnosis_limit_bytes": LIMIT_BYTES, "diagnosis_limit_files": LIMIT_FILES}
    folder = tmp_path_factory.mktemp("diagnoses")
    with started(settings, service, folder, recordings_dir=recordings, **limits) as client:
        yield client


def uploads(folder: Path, pattern: str = "*.csv") -> list[tuple[str, Any]]:
    return [("recordings", (path.name, path.read_bytes(), "text/csv")) for path in sorted(folder.glob(pattern))]


def finished(client: TestClient, response: Response) -> dict[str, Any]:
    """A diagnosis after its end, from the response that queued it."""
    assert response.status_code == 202, response.text
    last_s = time.monotonic() + LONGEST_WAIT_S
    while time.monotonic() < last_s:
        answer: dict[str, Any] = client.get(response.headers["location"]).json()
        if answer["state"] not in ("queued", "running"):
            return answer
        time.sleep(0.1)
    raise AssertionError(f"not finished: {answer}")


@pytest.fixture(scope="module")
def done(running: TestClient, recordings: Path) -> dict[str, Any]:
    """A finished diagnosis of uploaded drives, one of which can't be read."""
    files = [*uploads(recordings / "winter"), ("recordings", ("broken.csv", BAD, "text/csv"))]
    form = {"vehicle": CAR, "holdout": ["winter-0[37]"], "seed": "3"}
    return finished(running, running.post("/diagnoses", data=form, files=files))


def test_diagnosis_of_uploads_is_done_with_its_result_and_links(done: dict[str, Any]) -> None:
    assert (done["state"], done["progress"], done["stage"]) == ("done", 1.0, "")
    assert done["problem"] is None
    assert done["vehicle"] == CAR
    assert done["request"]["seed"] == 3
    assert len(done["request"]["recordings"]) == 11
    assert done["result"]["fit"]["held_out_trips"] == ["winter-03", "winter-07"]
    assert len(done["result"]["trips"]) == 10
    assert done["links"]["report"] == f"/diagnoses/{done['id']}/report"


def test_file_that_cannot_be_read_is_left_aside_and_named_with_its_row(done: dict[str, Any]) -> None:
    (refused,) = done["refused"]
    assert refused["file"] == "broken.csv"
    assert refused["error"].startswith("broken.csv, row 3: speed_kmh is ten")
    assert done["result"]["refused"] == done["refused"]


def test_heater_is_found_as_left_out_physics(done: dict[str, Any]) -> None:
    assert done["result"]["verdict"] == "left_out_physics"
    assert "thermal" in {finding["family"] for finding in done["result"]["findings"]}


def test_report_is_a_page_that_may_load_nothing(running: TestClient, done: dict[str, Any]) -> None:
    page = running.get(done["links"]["report"])
    assert page.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in page.headers["content-security-policy"]
    assert page.text.lower().startswith("<!doctype html>")


def test_effects_name_the_diagnosis_and_the_vehicle(running: TestClient, done: dict[str, Any]) -> None:
    effects = running.get(done["links"]["effects"]).json()
    learned_from = effects["learned_from"]
    assert (learned_from["vehicle"], learned_from["diagnosis"]) == (CAR, done["id"])
    assert (learned_from["trips"], learned_from["held_out_trips"]) == (8, 2)


def test_list_has_the_diagnosis_with_its_verdict_and_without_its_result(
    running: TestClient, done: dict[str, Any]
) -> None:
    lines = {line["id"]: line for line in running.get("/diagnoses").json()["diagnoses"]}
    line = lines[done["id"]]
    assert (line["state"], line["verdict"], line["recordings"]) == ("done", "left_out_physics", 11)
    assert "Heating the cabin in the cold took " in line["text"]
    assert line["text"] in done["result"]["text"]
    assert "result" not in line


def test_learned_effects_by_id_answer_as_the_same_sent_inline(running: TestClient, done: dict[str, Any]) -> None:
    inline = running.get(done["links"]["effects"]).json()
    body = {**ROUTE, "vehicle": CAR, "conditions": {"ambient_c": -5}}
    plain, by_id, as_object = (
        running.post("/route", json=body if effects is None else {**body, "effects": effects}).json()
        for effects in (None, done["id"], inline)
    )
    assert by_id["routes"] == as_object["routes"]
    assert by_id["routes"][0]["energy_kwh"] != plain["routes"][0]["energy_kwh"]
    assert by_id["request"]["effects"] == done["id"]
    assert as_object["request"]["effects"]["learned_from"]["diagnosis"] == done["id"]
    assert by_id["warnings"] == as_object["warnings"] == plain["warnings"]


def test_range_takes_learned_effects_in_its_address(running: TestClient, done: dict[str, Any]) -> None:
    query = f"lat=46.5&lon=8.003&soc=0.01&vehicle={CAR}&ambient_c=-5&effects={done['id']}"
    by_address = running.get(f"/range?{query}").json()
    by_body = running.post("/range", json=by_address["request"]).json()
    assert by_address["features"] == by_body["features"]


def test_effects_of_another_vehicle_are_a_warning_everywhere(running: TestClient, done: dict[str, Any]) -> None:
    expected = f"the effects were learned on vehicle '{CAR}', this is vehicle 'nissan-leaf'"
    other = {"vehicle": "nissan-leaf", "effects": done["id"]}
    assert expected in running.post("/route", json={**ROUTE, **other}).json()["warnings"]
    query = f"lat=46.5&lon=8.003&soc=0.01&vehicle=nissan-leaf&effects={done['id']}"
    assert expected in running.get(f"/range?{query}").json()["warnings"]
    assert expected in running.post("/simulate", json={"links": [{"id": 0}], **other}).json()["warnings"]
    chain = {"chain": [{"length_m": 100, "speed_limit_kmh": 50}], "vehicle": VEHICLE, "effects": done["id"]}
    assert "this is an inline vehicle" in running.post("/simulate", json=chain).json()["warnings"][0]


def test_diagnosis_whose_files_are_all_bad_fails_and_names_them(running: TestClient, recordings: Path) -> None:
    body = {"recordings": ["bad"], "vehicle": CAR}
    failed = finished(running, running.post("/diagnoses", json=body))
    assert failed["state"] == "failed"
    assert failed["problem"]["code"] == "unusable_recordings"
    (field,) = failed["problem"]["errors"]
    assert field["value"] == "bad/broken.csv"
    assert "row 3" in field["allowed"]
    assert failed["refused"][0]["file"] == "bad/broken.csv"
    assert str(recordings) not in json.dumps(failed)
    problem = check_problem(running.get(f"/diagnoses/{failed['id']}/report"), 409, "diagnosis_not_done")
    assert "failed" in problem["detail"]
    check_problem(running.get(f"/diagnoses/{failed['id']}/effects"), 409, "diagnosis_not_done")
    check_problem(running.post("/route", json={**ROUTE, "effects": failed["id"]}), 404, "unknown_effects")
    assert running.delete(f"/diagnoses/{failed['id']}").status_code == 204
    check_problem(running.get(f"/diagnoses/{failed['id']}"), 404, "unknown_diagnosis")


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (("GET", "/diagnoses/20200101-000000000000"), "unknown_diagnosis"),
        (("GET", "/diagnoses/Nothing%00/report"), "unknown_diagnosis"),
        (("GET", "/diagnoses/x/effects"), "unknown_diagnosis"),
        (("DELETE", "/diagnoses/x"), "unknown_diagnosis"),
        (("GET", "/range?lat=46.5&lon=8.003&soc=0.01&effects=nothing"), "unknown_effects"),
    ],
)
def test_id_that_is_not_there_answers_404(running: TestClient, call: tuple[str, str], code: str) -> None:
    check_problem(running.request(*call), 404, code)


ONE_FILE = [("recordings", ("drive.csv", BAD, "text/csv"))]


@pytest.mark.parametrize(
    ("form", "field", "part"),
    [
        ({"seed": "many"}, "seed", "valid integer"),
        ({"seed": ["1", "2"]}, "seed", "once"),
        ({"holdout_fraction": "0.95"}, "holdout_fraction", "at most 0.9"),
        ({"holdout_fraction": "NaN"}, "holdout_fraction", "finite"),
        ({"hide": ["ok", ""]}, "hide[1]", "at least 1"),
        ({"holdout": "winter*"}, "holdout", "drive"),
        ({"hold_out": "drive"}, "hold_out", "no field of this name"),
        ({"vehicle": "{broken"}, "vehicle", "JSON object"),
        ({"vehicle": json.dumps({**VEHICLE, "mass_kg": -1})}, "vehicle.mass_kg", "at least 1"),
        ({"vehicle": json.dumps(TABLE)}, "vehicle", "by its physics"),
    ],
)
def test_bad_field_of_a_form_is_refused_at_once(
    running: TestClient, form: dict[str, Any], field: str, part: str
) -> None:
    problem = check_problem(running.post("/diagnoses", data=form, files=ONE_FILE), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field
    assert part in problem["errors"][0]["allowed"]


@pytest.mark.parametrize(
    ("files", "field"),
    [
        ([("recordings", ("a.csv", BAD)), ("recordings", ("x/a.csv", BAD))], "recordings[1]"),
        ([("recordings", ("..", BAD))], "recordings[0]"),
        ([("recordings", ("n" * 300, BAD))], "recordings[0]"),
        ([("recordings", (None, BAD))], "recordings[0]"),
        ([("hide", ("a.csv", BAD))], "hide"),
        ([("seed", (None, b"1"))], "recordings"),
        ([("recordings", (f"{k}.csv", BAD)) for k in range(LIMIT_FILES + 1)], "recordings"),
    ],
)
def test_files_that_cannot_be_taken_are_refused_at_once(running: TestClient, files: list[Any], field: str) -> None:
    problem = check_problem(running.post("/diagnoses", files=files), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field


def test_uploaded_file_is_kept_by_its_name_alone_wherever_its_path_leads(running: TestClient) -> None:
    queued = running.post("/diagnoses", files=[("recordings", ("../../etc/drive.csv", BAD))])
    assert queued.json()["request"]["recordings"] == ["drive.csv"]
    running.delete(queued.headers["location"])


def test_unknown_vehicle_of_a_diagnosis_answers_404(running: TestClient) -> None:
    check_problem(running.post("/diagnoses", data={"vehicle": "delorean"}, files=ONE_FILE), 404, "unknown_vehicle")


@pytest.mark.parametrize(
    ("media_type", "content", "status", "code"),
    [
        ("text/csv", BAD, 415, "unsupported_media_type"),
        ("multipart/form-data", b"x", 422, "malformed_form"),
        ("multipart/form-data; boundary=x", b"--y\r\nnonsense", 422, "malformed_form"),
        (
            "multipart/form-data; boundary=x; charset=undefined",
            b'--x\r\nContent-Disposition: form-data; name="a"',
            422,
            "",
        ),
        ("application/json", b"{", 422, "malformed_json"),
        ("application/json", b"\xff", 422, "malformed_json"),
    ],
)
def test_body_that_cannot_be_read_is_refused(
    running: TestClient, media_type: str, content: bytes, status: int, code: str
) -> None:
    response = running.post("/diagnoses", content=content, headers={"content-type": media_type})
    check_problem(response, status, code or response.json()["code"])


def test_upload_on_a_full_disk_answers_507_and_leaves_nothing(
    running: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    files = [("recordings", ("a.csv", b"time_s,speed_kmh,power_w\n0,0,400\n"))]
    before = running.get("/diagnoses").json()
    check_problem(running.post("/diagnoses", files=files), 507, "storage_full")
    assert running.get("/diagnoses").json() == before


def test_upload_beyond_the_limit_is_refused_by_its_declared_length(running: TestClient) -> None:
    files = [("recordings", ("drive.csv", b"1" * (LIMIT_BYTES + 1)))]
    problem = check_problem(running.post("/diagnoses", files=files), 413, "body_too_large")
    assert str(LIMIT_BYTES) in problem["detail"]


def test_upload_beyond_the_limit_is_refused_while_it_arrives(running: TestClient) -> None:
    def parts() -> Iterator[bytes]:
        yield b'--x\r\nContent-Disposition: form-data; name="recordings"; filename="a.csv"\r\n\r\n'
        for _ in range(40):
            yield b"1" * (LIMIT_BYTES // 20)
        yield b"\r\n--x--\r\n"

    header = {"content-type": "multipart/form-data; boundary=x"}
    check_problem(running.post("/diagnoses", content=parts(), headers=header), 413, "body_too_large")


@pytest.mark.parametrize(
    "pattern",
    [
        "../*.csv",
        "winter/../../x",
        "/etc/passwd",
        "C:\\drive.csv",
        "link.csv",
        "*.csv",
        "nothing*",
        "winter/*.txt",
        "\0",
        "**x",
    ],
)
def test_recordings_outside_of_the_folder_cannot_be_named(running: TestClient, pattern: str) -> None:
    problem = check_problem(running.post("/diagnoses", json={"recordings": [pattern]}), 422, "invalid_request")
    assert problem["errors"][0]["field"] == "recordings[0]"


def test_recordings_on_the_server_are_counted_and_measured(
    settings: Settings, service: Service, recordings: Path, tmp_path: Path
) -> None:
    with started(settings, service, tmp_path, recordings_dir=recordings, diagnosis_limit_files=9) as client:
        check_problem(client.post("/diagnoses", json={"recordings": ["winter"]}), 422, "invalid_request")
    with started(settings, service, tmp_path, recordings_dir=recordings, diagnosis_limit_bytes=10_000) as client:
        check_problem(client.post("/diagnoses", json={"recordings": ["winter"]}), 413, "body_too_large")


def test_recordings_on_the_server_need_a_configured_folder(client: TestClient) -> None:
    problem = check_problem(client.post("/diagnoses", json={"recordings": ["winter"]}), 422, "invalid_request")
    assert "no folder of recordings is configured" in problem["detail"]


def test_empty_folder_of_recordings_in_the_environment_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_RECORDINGS_DIR", "")
    assert Settings().recordings_dir is None


def test_full_queue_answers_429_and_a_cancelled_diagnosis_makes_room(
    settings: Settings, service: Service, recordings: Path, tmp_path: Path
) -> None:
    with started(settings, service, tmp_path, recordings_dir=recordings, diagnosis_queue_limit=2) as client:
        body = {"recordings": ["winter/*.csv"], "vehicle": CAR}
        first, second = (client.post("/diagnoses", json=body) for _ in range(2))
        full = client.post("/diagnoses", json=body)
        check_problem(full, 429, "too_many_diagnoses")
        assert int(full.headers["retry-after"]) > 0
        figures = client.get("/metrics").text
        counts = [float(count) for count in re.findall(r'joulepath_diagnoses\{state="\w+"\} (\S+)', figures)]
        assert sum(counts) == 2
        cancelled = client.delete(first.headers["location"])
        assert (cancelled.status_code, cancelled.json()["state"]) == (200, "cancelled")
        assert client.post("/diagnoses", json=body).status_code == 202
        assert client.delete(second.headers["location"]).json()["state"] == "cancelled"
        assert client.get(first.headers["location"]).json()["state"] == "cancelled"
        assert client.delete(first.headers["location"]).status_code == 204
        check_problem(client.delete(first.headers["location"]), 404, "unknown_diagnosis")


def test_diagnosis_that_runs_when_the_service_stops_is_interrupted(
    settings: Settings, service: Service, recordings: Path, tmp_path: Path
) -> None:
    with started(settings, service, tmp_path, recordings_dir=recordings) as client:
        queued = client.post("/diagnoses", json={"recordings": ["winter"], "vehicle": CAR})
    with started(settings, service, tmp_path) as client:
        interrupted = client.get(queued.headers["location"]).json()
    assert interrupted["state"] == "failed"
    assert interrupted["problem"]["code"] == "diagnosis_interrupted"


@pytest.mark.parametrize(
    ("worker", "state"),
    [
        (f"{socket.gethostname()}:{2**22 + 1}:aa", "failed"),  # beyond the largest process id of Linux
        (f"{socket.gethostname()}:{os.getpid()}:aa", "failed"),  # this process, before it was started again
        (f"{socket.gethostname()}:{os.getppid()}:aa", "running"),
        ("another-host:1:aa", "running"),
    ],
    ids=["ended", "started again", "of a process that runs", "of another machine"],
)
def test_diagnosis_of_a_worker_that_is_gone_is_interrupted(
    settings: Settings, service: Service, recordings: Path, tmp_path: Path, worker: str, state: str
) -> None:
    with started(settings, service, tmp_path, recordings_dir=recordings) as client:
        path = client.post("/diagnoses", json={"recordings": ["winter"], "vehicle": CAR}).headers["location"]
        client.delete(path)
        with closing(sqlite3.connect(tmp_path / "vehicles.sqlite")) as connection:
            connection.execute("UPDATE diagnoses SET state = 'running', worker = ?", (worker,))
            connection.commit()
        assert client.get("/diagnoses").json()["diagnoses"][0]["state"] == state


def test_stored_diagnosis_that_is_damaged_answers_409(
    settings: Settings, service: Service, recordings: Path, tmp_path: Path
) -> None:
    with started(settings, service, tmp_path, recordings_dir=recordings) as client:
        path = client.post("/diagnoses", json={"recordings": ["winter"], "vehicle": CAR}).headers["location"]
        client.delete(path)
        with closing(sqlite3.connect(tmp_path / "vehicles.sqlite")) as connection:
            connection.execute("UPDATE diagnoses SET result = '{'")
            connection.commit()
        check_problem(client.get(path), 409, "diagnosis_damaged")
        assert client.delete(path).status_code == 204
