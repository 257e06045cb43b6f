"""Uploads that arrive slowly or in many parts: they keep nobody out of the queue, and nothing of them in memory."""

from __future__ import annotations

import json
import re
import socket
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import street_grid
from tests.app.server_process import PATIENCE_S, ServerProcess, received, server_process

if TYPE_CHECKING:
    from collections.abc import Iterator

DRIVE = b"time_s,speed_kmh,power_w\n0,0,400\n1,3.6,2500\n"
END = b"\r\n--x--\r\n"


def part(number: int, content: bytes) -> bytes:
    head = f'--x\r\nContent-Disposition: form-data; name="recordings"; filename="drive-{number}.csv"\r\n\r\n'
    return head.encode() + content


def head(length: int, client: str) -> bytes:
    return (
        "POST /diagnoses HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
        "Content-Type: multipart/form-data; boundary=x\r\n"
        f"X-Forwarded-For: {client}\r\nContent-Length: {length}\r\n\r\n"
    ).encode()


def half_sent(server: ServerProcess, client: str) -> socket.socket:
    """An upload whose client has sent less than it has announced."""
    return server.connect(head(10_000, client) + part(1, DRIVE))


def uploaded(server: ServerProcess, client: str) -> tuple[int, dict[str, Any]]:
    """Status and JSON of what is answered to a whole upload."""
    body = part(1, DRIVE) + END
    answer = server.ask(head(len(body), client) + body)
    return int(answer.split()[1]), json.loads(answer.partition(b"\r\n\r\n")[2])


def until(what: str, holds: Any) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end_s, what
        time.sleep(0.02)


@pytest.fixture
def spool(tmp_path: Path) -> Path:
    folder = tmp_path / "spool"
    folder.mkdir()
    return folder


@pytest.fixture
def server(tmp_path: Path, spool: Path) -> Iterator[ServerProcess]:
    save_graph(street_grid("grid", Terrain.SYNTHETIC), tmp_path / "graphs" / "grid")
    with server_process(
        tmp_path,
        tmp_path / "graphs",
        TMPDIR=str(spool),
        JOULEPATH_DIAGNOSIS_QUEUE_LIMIT="1",
        JOULEPATH_DIAGNOSIS_UPLOAD_LIMIT="4",
    ) as running:
        yield running


def is_idle(server: ServerProcess) -> bool:
    """Whether no diagnosis waits or runs."""
    listed = json.loads(server.get("/diagnoses").partition(b"\r\n\r\n")[2])["diagnoses"]
    return not {"queued", "running"} & {each["state"] for each in listed}


def arriving(spool: Path) -> list[Path]:
    """Files of uploads that are not whole."""
    return [path for path in spool.glob("joulepath-spool-*/*/*") if path.is_file()]


def test_slow_uploads_hold_no_place_in_the_queue_and_of_one_client_not_all_that_there_are(
    server: ServerProcess, spool: Path
) -> None:
    with ExitStack() as opened:
        slow = [opened.enter_context(half_sent(server, "203.0.113.7")) for _ in range(2)]
        until("two uploads arrive", lambda: len(arriving(spool)) == 2)
        status, problem = uploaded(server, "203.0.113.7")
        assert (status, problem["code"]) == (429, "too_many_diagnoses")
        assert "2 uploads of one client" in problem["detail"]
        status, queued = uploaded(server, "203.0.113.8")  # the queue has one place, and it is free
        assert status == 202, queued
        until("the diagnosis ends", lambda: is_idle(server))  # a full queue is told before a body is read
        for client in ("203.0.113.9", "203.0.113.10"):
            opened.enter_context(half_sent(server, client))
        until("four uploads arrive", lambda: len(arriving(spool)) == 4)
        status, problem = uploaded(server, "203.0.113.11")
        assert status == 429
        assert "4 uploads in all" in problem["detail"]
        slow[0].close()
        until("its place is free", lambda: uploaded(server, "203.0.113.11")[0] == 202)
    until("nothing is left of them", lambda: arriving(spool) == [])


def test_parts_of_an_upload_lie_on_the_disk_while_they_arrive_and_not_in_memory(
    server: ServerProcess, spool: Path
) -> None:
    count, content = 120, b"1" * 900_000
    before = resident_bytes(server)
    with server.connect(head(2 * count * len(content), "203.0.113.7")) as connection:
        for number in range(count):
            connection.sendall(part(number, content) + b"\r\n")
        until(
            "all parts but the last are whole",
            lambda: sum(path.stat().st_size == len(content) for path in arriving(spool)) >= count - 1,
        )
        assert resident_bytes(server) - before < 30e6 < count * len(content) / 3
    until("they are gone with their client", lambda: arriving(spool) == [])


def resident_bytes(server: ServerProcess) -> int:
    """Memory of the process now."""
    status = Path(f"/proc/{server.process.pid}/status")
    if not status.exists():
        pytest.skip("memory is looked at in /proc")
    (kilobytes,) = re.findall(r"^VmRSS:\s+(\d+) kB$", status.read_text(), re.MULTILINE)
    return 1024 * int(kilobytes)


def test_fields_beside_the_files_have_a_limit_of_their_own(server: ServerProcess) -> None:
    field = b'--x\r\nContent-Disposition: form-data; name="hide"\r\n\r\n' + b"a" * 100_000 + b"\r\n"
    with server.connect(head(10**8, "203.0.113.7")) as connection:
        connection.sendall(11 * field)
        answer = received(connection)
    assert answer.split()[1] == b"422"
    assert b"malformed_form" in answer
    assert b"fields and names of files have more than 1048576 bytes" in answer


def test_more_files_than_allowed_are_refused_while_they_arrive(tmp_path: Path, spool: Path) -> None:
    save_graph(street_grid("grid", Terrain.SYNTHETIC), tmp_path / "graphs" / "grid")
    limits = {"TMPDIR": str(spool), "JOULEPATH_DIAGNOSIS_LIMIT_FILES": "3"}
    with (
        server_process(tmp_path, tmp_path / "graphs", **limits) as server,
        server.connect(head(10**6, "203.0.113.7")) as connection,
    ):
        connection.sendall(b"".join(part(number, DRIVE) + b"\r\n" for number in range(4)))
        answer = received(connection)
        assert answer.split()[1] == b"422"
        assert b"more than 3 files" in answer
