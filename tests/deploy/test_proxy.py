"""nginx with deploy/nginx.conf before a running service: what it keeps away from it, and what it lets through."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import httpx2
import pytest

from benchmarks.browser import served
from tests.deploy.files import NGINX, text_of

if TYPE_CHECKING:
    from collections.abc import Iterator

HALF_SENT = 500
WAIT_S = 1  # in place of the 10 s of the file
SAID_WITHIN_S = 10.0
QUIET_S = 0.5  # without a new line of the log
UNPACKED = Path(sys.prefix, "nginx", "usr", "sbin", "nginx")  # by `make nginx`
ROUTE = {"start": [-36.433, 43.872], "goal": [-35.19, 43.697], "soc": 0.5, "links": False}


@dataclass(frozen=True)
class Proxied:
    """A service behind nginx: the address of each, and the service's log."""

    port: int
    client: httpx2.Client
    log: Path

    def connected(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=30.0)

    def said(self) -> str:
        """The service's log, once nothing has been added for a while: a line follows its answer."""
        before, until = "", time.monotonic() + SAID_WITHIN_S
        while (said := self.log.read_text(encoding="utf-8")) != before and time.monotonic() < until:
            before = said
            time.sleep(QUIET_S)
        return said

    def requests(self, method: str = "[A-Z]+") -> list[str]:
        """What has reached the service; those of a client that hung up are said when their end is known."""
        return re.findall(rf"^INFO: +({method} /\S*) \d{{3}} ", self.said(), re.MULTILINE)


def program() -> str:
    found = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin") or (UNPACKED.is_file() and str(UNPACKED))
    assert found, "no nginx: run `make nginx`, or install the package nginx"
    return found


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


def adapted(folder: Path, port: int, service: str) -> str:
    """The file as it is, but for what this machine decides: ports, folders, the worker's user, shorter waits."""
    text = text_of(NGINX)
    for before, after in (
        ("joulepath:8000", service.removeprefix("http://")),
        ("listen 8080", f"listen 127.0.0.1:{port}"),
        ("/tmp/nginx", f"{folder}/nginx"),
        ("/dev/stdout", f"{folder}/access.log"),
        ("client_header_timeout 10s", f"client_header_timeout {WAIT_S}s"),
        ("client_body_timeout 10s", f"client_body_timeout {WAIT_S}s"),
    ):
        assert before in text, before
        text = text.replace(before, after)
    as_root = "user root;\n" if Path("/proc/self").stat().st_uid == 0 else ""  # its folders are the test's own
    return f"{as_root}daemon off;\n{text}"


@contextmanager
def proxied(folder: Path) -> Iterator[Proxied]:
    with served(folder) as service:
        port = free_port()
        file = folder / "nginx.conf"
        file.write_text(adapted(folder, port, service), encoding="utf-8")
        with (folder / "nginx.log").open("wb") as said:
            process = subprocess.Popen([program(), "-p", str(folder), "-c", str(file)], stdout=said, stderr=said)
        try:
            with httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=60.0, trust_env=False) as client:
                until = time.monotonic() + 30.0
                while True:
                    assert process.poll() is None, (folder / "nginx.log").read_text(encoding="utf-8")
                    try:
                        client.get("/healthz").raise_for_status()
                        break
                    except httpx2.ConnectError:
                        assert time.monotonic() < until
                        time.sleep(0.05)
                yield Proxied(port, client, folder / "service.log")
        finally:
            process.terminate()
            process.wait(30.0)


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Proxied]:
    with proxied(tmp_path_factory.mktemp("proxied")) as found:
        yield found


def received(connection: socket.socket) -> bytes:
    """All that comes until the other side closes."""
    parts = []
    try:
        while part := connection.recv(65536):
            parts.append(part)
    except ConnectionResetError:
        pass  # a way to close
    return b"".join(parts)


def test_map_route_and_upload_go_through(behind: Proxied) -> None:
    assert behind.client.get("/").status_code == 200
    answer = behind.client.post("/route", json=ROUTE)
    assert (answer.status_code, answer.json()["routes"][0]["feasible"]) == (200, True)
    files = {"recordings": ("drive.csv", b"time_s,speed_kmh\n" + b"0,1\n" * 1_500_000, "text/csv")}  # 6 MB
    answer = behind.client.post("/diagnoses", data={"vehicle": "hyundai-kona-64"}, files=files)
    assert answer.status_code == 202, answer.text
    assert "nginx/" not in str(answer.headers)


def test_hundreds_of_half_sent_heads_hinder_nobody_and_are_closed(behind: Proxied) -> None:
    behind.client.get("/healthz")
    before = len(behind.requests("GET"))
    with ExitStack() as stack:
        held = [stack.enter_context(behind.connected()) for _ in range(HALF_SENT)]
        for connection in held:
            connection.sendall(b"GET /graphs HTTP/1.1\r\nHost: localhost\r\nX-Half: ")
        for _ in range(5):
            assert behind.client.get("/healthz").status_code == 200
        for connection in held:
            assert b" 200 " not in received(connection)[:20]
    assert behind.requests("GET")[before:] == ["GET /healthz"] * 5


def test_half_sent_body_is_closed_and_never_reaches_the_service(behind: Proxied) -> None:
    before = len(behind.requests())
    with behind.connected() as connection:
        head = (
            "POST /route HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 1000\r\n\r\n"
        )
        connection.sendall(head.encode() + b'{"start"')
        assert b" 200 " not in received(connection)[:20]
    assert behind.requests()[before:] == []


def test_body_that_is_too_large_is_refused_before_it_reaches_the_service(behind: Proxied) -> None:
    most = b'{"start":0}'.ljust(4 * 2**20)
    headers = {"Content-Type": "application/json"}
    assert behind.client.post("/route", content=most, headers=headers).json()["code"] == "invalid_request"
    before = len(behind.requests())
    over = behind.client.post("/route", content=most + b" ", headers=headers)
    assert (over.status_code, over.headers["content-type"]) == (413, "application/problem+json")
    assert over.json()["code"] == "body_too_large"
    assert behind.requests()[before:] == []


def test_client_cannot_make_up_its_address(behind: Proxied) -> None:
    behind.client.get("/readyz", headers={"X-Forwarded-For": "203.0.113.9"})
    said = behind.said()
    assert "GET /readyz" in said
    assert "203.0.113.9" not in said


def test_what_is_for_operators_is_not_there_from_outside(behind: Proxied) -> None:
    before = len(behind.requests())
    assert behind.client.post("/reload").status_code == 404
    assert behind.client.get("/metrics").status_code == 404
    assert behind.requests()[before:] == []


def test_address_that_asks_too_often_is_told_so(behind: Proxied) -> None:
    answers = [behind.client.get("/healthz") for _ in range(600)]
    found = [answer.status_code for answer in answers]
    assert set(found) == {200, 429}
    assert found.count(200) >= 200
    refused = answers[found.index(429)]
    assert (refused.headers["retry-after"], refused.json()["status"]) == ("1", 429)
