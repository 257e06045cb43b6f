"""Uploads to a full queue, to a full disk, and patterns from many clients at once: refused at once, and no 5xx else."""

from __future__ import annotations

import json
import resource
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from http.client import HTTPConnection
from typing import TYPE_CHECKING, Any

import pytest

from tests.app.expected import check_problem
from tests.faults.measured import REPOSITORY
from tests.faults.test_jobs import CAR, queued

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager
    from pathlib import Path

    from starlette.testclient import TestClient

    Serving = Callable[..., AbstractContextManager[TestClient]]


FORM = {"content-type": "multipart/form-data; boundary=x"}
SERVE = """
import sys
import uvicorn
from app.main import create_app
from app.service.service import Service
from app.settings import Settings
settings = Settings(
    graph_dirs=(), database_url=f"sqlite:///{sys.argv[1]}/vehicles.sqlite", recordings_dir=f"{sys.argv[1]}/d"
)
uvicorn.run(create_app(settings, Service(settings, {})), port=int(sys.argv[2]), log_level="warning")
"""
FULL_DISK = """
import json, resource, signal, sys
from pathlib import Path
from starlette.testclient import TestClient
from app.main import create_app
from app.service.service import Service
from app.settings import Settings
folder = Path(sys.argv[1])
settings = Settings(graph_dirs=(), database_url=f"sqlite:///{folder}/vehicles.sqlite")
with TestClient(create_app(settings, Service(settings, {}))) as client:
    client.get("/diagnoses")
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    found = []
    for size in (900_000, 3_000_000):
        resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, resource.RLIM_INFINITY))
        answer = client.post("/diagnoses", files=[("recordings", ("a.csv", b"1" * size))])
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        found.append((answer.status_code, answer.json()))
    files = [str(path) for path in Path(sys.argv[2]).rglob("*.csv")]
print(json.dumps([found, files]))
"""


def test_full_queue_is_told_before_an_upload_is_read(serving: Serving) -> None:
    with serving(diagnosis_queue_limit=1) as client:
        path = queued(client, "long")
        refused = client.post("/diagnoses", content=b"x" * 10, headers=FORM)
        check_problem(refused, 429, "too_many_diagnoses")
        assert (refused.headers["connection"], int(refused.headers["retry-after"]) > 0) == ("close", True)
        client.delete(path)
        check_problem(client.post("/diagnoses", content=b"x" * 10, headers=FORM), 422, "malformed_form")


@pytest.mark.fault("disk-full", now="507 `storage_full`, and nothing is kept")
@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="files can't be limited here")
def test_disk_that_is_full_at_an_upload_answers_507_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "spool").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(tmp_path), str(tmp_path / "spool")],
        capture_output=True,
        text=True,
        check=True,
        cwd=REPOSITORY,
        env={"PATH": "", "TMPDIR": str(tmp_path / "spool"), "HOME": str(tmp_path)},
        timeout=60.0,
    )
    found, files = json.loads(done.stdout.splitlines()[-1])
    for status, problem in found:
        assert (status, problem["code"]) == (507, "storage_full"), problem
        assert "can't be stored (File too large)" in problem["detail"]
    assert files == []


@pytest.mark.fault("patterns", now="one `**` at most, the search limited in entries and time; ends by SIGTERM")
def test_service_ends_by_a_signal_beside_patterns_of_clients_that_are_gone(tmp_path: Path) -> None:
    within = tmp_path
    for _ in range(12):
        within = within / "d"
        within.mkdir()
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    body = json.dumps({"recordings": ["**/" * 60 + "x.csv", "*/" * 60 + "x.csv"]}).encode()
    request = b"POST /diagnoses HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n%s"
    server = subprocess.Popen([sys.executable, "-c", SERVE, str(tmp_path), str(port)], cwd=REPOSITORY)
    try:
        reached(port)
        for _ in range(45):
            with socket.create_connection(("127.0.0.1", port), 10.0) as client:
                client.sendall(request % (len(body), body))
        assert reached(port) == 200
        server.send_signal(signal.SIGTERM)
        assert server.wait(20.0) in (0, -signal.SIGTERM)
    finally:
        server.kill()
        server.wait()


def reached(port: int) -> int:
    """The status of a short call, as soon as the service answers."""
    last_s = time.monotonic() + 30.0
    while True:
        try:
            with closing(HTTPConnection("127.0.0.1", port, timeout=10.0)) as connection:
                connection.request("GET", "/diagnoses")
                with connection.getresponse() as answer:
                    return answer.status
        except ConnectionRefusedError:
            if time.monotonic() > last_s:
                raise
            time.sleep(0.1)


@pytest.mark.fault("patterns", now="other requests are answered meanwhile")
def test_patterns_of_many_clients_leave_the_service_reachable(serving: Serving, recordings_dir: Path) -> None:
    within = recordings_dir
    for _ in range(30):
        within = within / "d"
        within.mkdir()
        (within / "up").symlink_to(recordings_dir)
    patterns = ["**/" * 60 + "x.csv", "*/" * 60 + "x.csv", "**/x.csv"]

    def ask(number: int) -> tuple[int, dict[str, Any]]:
        body = {"recordings": [patterns[number % len(patterns)]], "vehicle": CAR}
        answer = client.post("/diagnoses", json=body)
        return answer.status_code, answer.json()

    with serving() as client, ThreadPoolExecutor(45) as pool:
        asked = [pool.submit(ask, number) for number in range(45)]
        assert client.get("/diagnoses").status_code == 200
        codes = {answered.result(20.0)[1]["code"] for answered in asked}
        assert codes <= {"invalid_request", "too_many_diagnoses"}
