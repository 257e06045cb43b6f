"""The server's limits, held against clients that attack them; each against a process of its own."""

from __future__ import annotations

import logging
import signal
import socket
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

import pytest

from app.http.server import BoundedRate
from tests.app.server_process import received, server_process, small_server

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.app.server_process import ServerProcess

DESCRIPTORS: Final = 192
HALF_HEAD: Final = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Half: "
HALF_BODY: Final = (
    b"POST /route HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{"
)
SHORT: Final = {
    "JOULEPATH_HEAD_LIMIT_S": "0.6",
    "JOULEPATH_BODY_WAIT_S": "0.6",
    "JOULEPATH_LEAST_BYTES_PER_S": "100000",
}
PATIENT: Final = {"JOULEPATH_HEAD_LIMIT_S": "600", "JOULEPATH_BODY_WAIT_S": "600"}


@pytest.fixture(scope="module")
def hasty(tmp_path_factory: pytest.TempPathFactory, graph_dir: Path) -> Iterator[ServerProcess]:
    """A server that waits for nobody for longer than a second."""
    with server_process(tmp_path_factory.mktemp("hasty"), graph_dir, **SHORT) as running:
        yield running


@pytest.fixture(scope="module")
def crowded(tmp_path_factory: pytest.TempPathFactory, graph_dir: Path) -> Iterator[ServerProcess]:
    """A server of few descriptors, that waits for ten minutes."""
    folder = tmp_path_factory.mktemp("crowded")
    with server_process(folder, graph_dir, DESCRIPTORS, JOULEPATH_STOP_LIMIT_S="3", **PATIENT) as running:
        yield running


@pytest.mark.fault(
    "half-sent-headers", now="reachable all the time; the one silent longest gives way; lines of the log are bounded"
)
@pytest.mark.parametrize("half", [HALF_HEAD, HALF_BODY], ids=["heads", "bodies"])
def test_more_half_sent_requests_than_descriptors_leave_the_server_reachable_and_its_log_short(
    crowded: ServerProcess, half: bytes
) -> None:
    logged = crowded.log.stat().st_size
    with ExitStack() as opened:
        for count in range(3 * DESCRIPTORS):
            opened.enter_context(crowded.connect(half))
            if count % DESCRIPTORS == 0:
                assert crowded.get("/healthz").startswith(b"HTTP/1.1 200")
        began = time.monotonic()
        assert crowded.get("/healthz").startswith(b"HTTP/1.1 200")
        assert time.monotonic() - began < 10.0
    line = 100 if half is HALF_BODY else 0  # the application's own line of each request that has begun
    assert crowded.log.stat().st_size - logged < 20_000 + 3 * DESCRIPTORS * line


def test_half_sent_head_is_answered_408_in_time(hasty: ServerProcess) -> None:
    answer = hasty.ask(HALF_HEAD)
    assert answer.startswith(b"HTTP/1.1 408 ")
    assert b'"request_timeout"' in answer


def test_head_that_trickles_is_answered_408_in_time(hasty: ServerProcess) -> None:
    with hasty.connect(HALF_HEAD) as connection:
        began = time.monotonic()
        while time.monotonic() - began < 10.0:
            try:
                connection.sendall(b"x")
            except ConnectionError:
                break
            time.sleep(0.1)
        assert time.monotonic() - began < 5.0


def test_next_head_on_a_kept_connection_has_the_same_limit(hasty: ServerProcess) -> None:
    with hasty.connect(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n") as connection:
        assert connection.recv(65536).startswith(b"HTTP/1.1 200")
        connection.sendall(HALF_HEAD)
        assert b"HTTP/1.1 408 " in received(connection)


def test_head_without_end_is_refused_before_it_fills_the_memory(hasty: ServerProcess) -> None:
    with hasty.connect(HALF_HEAD) as connection:
        sent = 0
        while sent < 10_000_000:
            try:
                connection.sendall(b"x" * 10_000)
            except ConnectionError:
                break
            sent += 10_000
    assert sent < 10_000_000


def test_half_sent_body_is_answered_408_in_time(hasty: ServerProcess) -> None:
    answer = hasty.ask(HALF_BODY)
    assert answer.startswith(b"HTTP/1.1 408 ")
    assert b"body arrives too slowly" in answer


def test_clients_that_are_slow_or_gone_leave_no_traceback(hasty: ServerProcess) -> None:
    form = (
        b"POST /diagnoses HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000\r\n"
        b"Content-Type: multipart/form-data; boundary=x\r\n\r\n--x\r\n"
    )
    for half in (HALF_BODY, form):
        hasty.connect(half).close()
        assert hasty.ask(half).startswith(b"HTTP/1.1 408 ")
    assert hasty.get("/healthz").startswith(b"HTTP/1.1 200")
    assert "Traceback" not in hasty.log.read_text()


@pytest.mark.parametrize("host", ["127.0.0.1", "foreign.example"])
def test_request_whose_body_is_no_http_is_answered_once_and_leaves_no_traceback(
    hasty: ServerProcess, host: str
) -> None:
    head = f"POST /nowhere HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n"
    for framing in ("Transfer-Encoding: chunked\r\n\r\nzz\r\n", "Transfer-Encoding: chunked\r\n\r\n-1\r\n{}\r\n"):
        answered = hasty.ask((head + framing).encode())
        assert answered.count(b"HTTP/1.1 ") == 1
    assert "Traceback" not in hasty.log.read_text(encoding="utf-8")


def test_log_lines_beyond_the_rate_are_left_out_and_counted() -> None:
    logger = logging.Logger("a server")
    written: list[logging.LogRecord] = []
    handler = logging.Handler()
    handler.emit = written.append  # type: ignore[method-assign]
    logger.addHandler(handler)
    bound = BoundedRate(per_s=0.5)
    logger.addFilter(bound)
    for _ in range(1000):
        logger.error("out of descriptors")
    assert 5 <= len(written) <= 10  # ten seconds' worth at once
    assert bound.dropped == 1000 - len(written)


def test_body_that_keeps_to_the_least_rate_is_taken_however_long_it_takes(hasty: ServerProcess) -> None:
    body = b" " * 400_000 + b"{}"
    head = f"POST /route HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {len(body)}\r\n".encode()
    with hasty.connect(head + b"Content-Type: application/json\r\nConnection: close\r\n\r\n") as connection:
        for begin in range(0, len(body), 50_000):
            connection.sendall(body[begin : begin + 50_000])
            time.sleep(0.25)  # 2 s in all, three times the wait, at twice the rate
        assert received(connection).startswith(b"HTTP/1.1 422 ")


def test_answer_that_nobody_reads_ends_its_connection(hasty: ServerProcess) -> None:
    ask = b"GET /openapi.json HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.settimeout(30.0)
        connection.connect(("127.0.0.1", hasty.port))
        connection.sendall(ask * 40)  # some megabytes, more than the system takes
        until = time.monotonic() + 60.0
        while "did not read its answer" not in hasty.log.read_text():
            assert time.monotonic() < until
            time.sleep(0.1)


def test_address_with_too_many_connections_loses_the_one_that_waits_longest_and_no_other_does(
    tmp_path: Path, graph_dir: Path
) -> None:
    limits = {"JOULEPATH_ADDRESS_CONNECTION_LIMIT": "3", "JOULEPATH_TRUSTED_PROXIES": "192.0.2.1"}
    with server_process(tmp_path, graph_dir, **PATIENT, **limits) as running, ExitStack() as opened:
        waiting = [opened.enter_context(running.connect(HALF_HEAD)) for _ in range(3)]
        time.sleep(0.5)
        waiting[0].sendall(b"x")  # so that the second one waits longest
        time.sleep(0.2)
        assert running.get("/healthz").startswith(b"HTTP/1.1 200")
        assert received(waiting[1]) == b""
        for kept in (waiting[0], waiting[2]):
            kept.sendall(b"\r\nConnection: close\r\n\r\n")
            assert received(kept).startswith(b"HTTP/1.1 200")


def test_process_ends_in_time_whatever_holds_it(tmp_path: Path) -> None:
    with small_server(tmp_path, JOULEPATH_STOP_LIMIT_S="1.5") as running:
        assert running.get("/").startswith(b"HTTP/1.1 200")
        with running.connect(b"GET /block HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"):
            time.sleep(0.5)
            began = time.monotonic()
            running.process.send_signal(signal.SIGTERM)
            assert running.process.wait(30.0) == 1
        assert 1.0 < time.monotonic() - began < 8.0
        assert "not stopped within 1.5 s" in running.log.read_text()


def test_server_without_a_free_descriptor_writes_little_and_answers_again_when_there_is_one(tmp_path: Path) -> None:
    with small_server(tmp_path, 128) as running, running.connect() as kept, ExitStack() as opened:
        for path in (b"/hoard", b"/release"):
            kept.sendall(b"GET " + path + b" HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert kept.recv(65536).startswith(b"HTTP/1.1 200")
            if path == b"/hoard":
                for _ in range(200):
                    opened.enter_context(running.connect(HALF_HEAD))
                time.sleep(3.0)
                assert running.log.stat().st_size < 200_000
        assert running.get("/").startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize(
    ("proxies", "sent", "limited"),
    [
        ("127.0.0.1", "203.0.113.5", True),
        ("127.0.0.1", "127.0.0.1, 203.0.113.5", True),  # the first is what the client made up
        ("192.0.2.1", "203.0.113.5", False),  # it comes from this machine, which has no rate
    ],
)
def test_proxy_is_believed_whose_client_it_names_and_nobody_else_is(
    tmp_path: Path, graph_dir: Path, proxies: str, sent: str, limited: bool
) -> None:
    limits = {"JOULEPATH_TRUSTED_PROXIES": proxies, "JOULEPATH_RATE_LIMIT_PER_S": "0.01", "JOULEPATH_RATE_BURST": "1"}
    with server_process(tmp_path, graph_dir, **limits) as running:
        answers = [running.get("/vehicles", f"X-Forwarded-For: {sent}\r\n").split(b" ", 2)[1] for _ in range(2)]
    assert answers == [b"200", b"429" if limited else b"200"]


def test_server_names_no_software(hasty: ServerProcess) -> None:
    head = hasty.get("/healthz").partition(b"\r\n\r\n")[0].lower()
    assert b"server:" not in head
    assert b"uvicorn" not in head


@pytest.mark.fault("half-sent-body", now="ends within `JOULEPATH_STOP_LIMIT_S`")
def test_told_to_stop_the_server_ends_in_time_in_spite_of_a_half_sent_body(crowded: ServerProcess) -> None:
    with crowded.connect(HALF_BODY):
        time.sleep(0.3)
        began = time.monotonic()
        crowded.process.send_signal(signal.SIGTERM)
        crowded.process.wait(30.0)
        assert time.monotonic() - began < 8.0
    assert "Traceback" not in crowded.log.read_text()
