"""The server under the application: uvicorn, with limits on connections, slow clients, log lines and stopping."""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import threading
import time
from collections import Counter
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Any, Final, cast

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from app.access.addresses import client_of, is_within, networks
from app.errors.problems import KINDS, PROBLEM_TYPE, make_problem, problem_bytes
from app.schemas.problem import ErrorCode

if TYPE_CHECKING:
    import socket
    from collections.abc import Iterable
    from types import FrameType

    from starlette.types import ASGIApp, Message, Receive, Scope, Send
    from uvicorn.protocols.http.h11_impl import RequestResponseCycle

    from app.settings import Settings

LOG: Final = logging.getLogger("uvicorn.error.limits")  # below the logger of the server, past its filter
RESERVED_DESCRIPTORS: Final = 128  # for files, the database and workers; at most half of what there is
ACCEPTED_AT_ONCE: Final = 16  # between two looks at the limit; the system keeps the others waiting
WAITING_CONNECTIONS: Final = 2048  # that the system keeps
CHECKS_A_LIMIT: Final = 4  # how often slow clients are looked for within the shortest limit
LONGEST_CHECK_S: Final = 1.0
REPORT_S: Final = 10.0  # at most one line about closed connections in so long
ERROR_LINES_PER_S: Final = 10.0  # of errors and warnings, each up to a page long
SERVING_FRAC: Final = 0.5  # of the time to stop in, for requests; the rest is for what they leave running
LOGGERS: Final = ("uvicorn.error", "uvicorn.access", "asyncio")


class Phase(Enum):
    """What a connection waits for: a next request, the rest of its head, that of its body, or the service."""

    IDLE = "idle"
    HEAD = "head"
    BODY = "body"
    WORK = "work"


class BoundedRate(logging.Filter):
    """Lets so many lines a second through, ten seconds' worth at once, and counts the others."""

    def __init__(self, per_s: float) -> None:
        super().__init__()
        self.per_s = per_s
        self.dropped = 0
        self._left = 10.0 * per_s
        self._seen_s = time.monotonic()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a line is written."""
        now = time.monotonic()
        self._left = min(self._left + (now - self._seen_s) * self.per_s, 10.0 * self.per_s)
        self._seen_s = now
        if self._left < 1.0:
            self.dropped += 1
            return False
        self._left -= 1.0
        return True


class Connections:
    """The open connections of one server.

    Where one more would be too many, in all or of one address, that one is closed on whose client the server has waited
    longest. A new one is refused only where all others are being answered.
    """

    def __init__(self, settings: Settings, limit: int) -> None:
        self.settings = settings
        self.limit = limit
        self.closed: Counter[str] = Counter()  # by reason
        self._proxies = networks(settings.trusted_proxies)
        self._open: set[LimitedProtocol] = set()
        self._by_client: dict[str, set[LimitedProtocol]] = {}
        self._reported: Counter[str] = Counter()
        self._reported_s = 0.0
        self._filters: list[BoundedRate] = []

    def admit(self, connection: LimitedProtocol, host: str | None) -> bool:
        """Take a new connection in, or say that there is no room."""
        client = None if host is None or is_within(host, self._proxies) else client_of(host)
        of_client = self._by_client.get(client, set()) if client is not None else set()
        crowded = client is not None and len(of_client) >= self.settings.address_connection_limit
        if crowded and not self._make_room(of_client, "one address has too many"):
            return False
        if len(self._open) >= self.limit and not self._make_room(self._open, "too many"):
            return False
        connection.counted_as = client
        self._open.add(connection)
        if client is not None:
            self._by_client.setdefault(client, set()).add(connection)
        return True

    def forget(self, connection: LimitedProtocol) -> None:
        """Count a connection no longer."""
        self._open.discard(connection)
        client = connection.counted_as
        if client is not None and (of_client := self._by_client.get(client)) is not None:
            of_client.discard(connection)
            if not of_client:
                del self._by_client[client]

    def bound_logs(self) -> None:
        """Bound the lines of the server's loggers, in place of an earlier bound."""
        for name in LOGGERS:
            logger = logging.getLogger(name)
            for known in [known for known in logger.filters if isinstance(known, BoundedRate)]:
                logger.removeFilter(known)
            per_s = self.settings.log_limit_per_s
            bound = BoundedRate(per_s if name == "uvicorn.access" else min(per_s, ERROR_LINES_PER_S))
            logger.addFilter(bound)
            self._filters.append(bound)

    def watch(self) -> None:
        """Look for slow clients from now on; to be called on the event loop."""
        loop = asyncio.get_running_loop()
        shortest_s = min(self.settings.head_limit_s, self.settings.body_wait_s)
        every_s = min(shortest_s / CHECKS_A_LIMIT, LONGEST_CHECK_S)

        def look() -> None:
            now = loop.time()
            for connection in list(self._open):
                connection.check(now)
            if now - self._reported_s >= REPORT_S:
                self._report(now)
            loop.call_later(every_s, look)

        loop.call_later(every_s, look)

    def _make_room(self, among: Iterable[LimitedProtocol], reason: str) -> bool:
        waiting = (connection for connection in among if connection.phase is not Phase.WORK)
        longest = min(waiting, key=lambda connection: connection.heard_s, default=None)
        if longest is None:
            self.closed["all are being answered"] += 1
            return False
        self.closed[reason] += 1
        self.forget(longest)
        longest.transport.abort()
        return True

    def _report(self, now: float) -> None:
        self._reported_s = now
        new = self.closed - self._reported
        if new:
            self._reported = Counter(self.closed)
            LOG.warning("connections closed: %s", ", ".join(f"{count} {reason}" for reason, count in new.items()))
        if dropped := sum(bound.dropped for bound in self._filters):
            LOG.warning("%d log lines left out", dropped)
            for bound in self._filters:
                bound.dropped = 0


class LimitedProtocol(H11Protocol):
    """One connection, whose client must send its requests and take its answers within time.

    A head has `head_limit_s`; a body has `body_wait_s` and the time that it takes at `least_bytes_per_s`, and so has an
    answer. What the server itself does not read or write meanwhile does not count.
    """

    def __init__(self, connections: Connections, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.counted_as: str | None = None
        self.phase = Phase.HEAD
        self.heard_s = self._since_s = self._checked_s = self.loop.time()
        self._connections = connections
        self._settings = connections.settings
        self._body_bytes = 0
        self._unread_bytes = 0
        self._unread_until_s = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """A client has connected."""
        peer = transport.get_extra_info("peername")
        if self._connections.admit(self, str(peer[0]) if isinstance(peer, tuple) else None):
            super().connection_made(transport)
            return
        self.transport = transport
        transport.write(_plain_answer(ErrorCode.OVERLOADED, "as many connections are open as are allowed"))
        transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection has ended."""
        self._connections.forget(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Bytes of the client."""
        now = self.heard_s = self.loop.time()
        if self.phase is Phase.IDLE:
            self._enter(Phase.HEAD, now)
        elif self.phase is Phase.BODY:
            self._body_bytes += len(data)
        super().data_received(data)
        self._follow(now)

    def on_response_complete(self) -> None:
        """The answer is written; the client may send its next request."""
        now = self.heard_s = self.loop.time()
        # what comes of a body that nobody has waited for counts as part of the next head
        self._enter(Phase.IDLE if self.conn.their_state is h11.DONE else Phase.HEAD, now)
        super().on_response_complete()
        self._follow(now)

    def check(self, now: float) -> None:
        """Close the connection where its client has had its time."""
        checked_s, self._checked_s = self._checked_s, now
        settings = self._settings
        if unread := self.transport.get_write_buffer_size():
            if unread > self._unread_bytes:
                self._unread_until_s = now + settings.body_wait_s + unread / settings.least_bytes_per_s
            self._unread_bytes = unread
            if now > self._unread_until_s:
                self._connections.closed["did not read its answer"] += 1
                self.transport.abort()
            return
        self._unread_bytes = 0
        waited_s = now - self._since_s
        body_s = settings.body_wait_s + self._body_bytes / settings.least_bytes_per_s
        if self.phase is Phase.HEAD and waited_s > settings.head_limit_s:
            self._give_up("head", f"the request's head did not arrive within {settings.head_limit_s:g} s")
        elif self.phase is Phase.BODY and self.flow.read_paused:
            self._since_s += now - checked_s
        elif self.phase is Phase.BODY and waited_s > body_s:
            allowed = f"{settings.body_wait_s:g} s, and a second more for {settings.least_bytes_per_s:g} bytes each"
            self._give_up("body", f"the request's body arrives too slowly, allowed: {allowed}")

    def shutdown(self) -> None:
        """The server stops: a body may still arrive in half of the time that requests have."""
        super().shutdown()
        if self.phase is Phase.BODY:
            self.loop.call_later(self._settings.stop_limit_s * SERVING_FRAC / 2.0, self._stop_waiting)

    def _stop_waiting(self) -> None:
        if self.phase is Phase.BODY and not self.transport.is_closing():
            self._give_up("body", "the request's body did not arrive before the service stopped")

    def _enter(self, phase: Phase, now: float) -> None:
        self.phase = phase
        self._since_s = now
        self._body_bytes = 0

    def _follow(self, now: float) -> None:
        """Go on to the phase that the request has reached."""
        cycle = cast("RequestResponseCycle | None", self.cycle)  # None until the first request
        if cycle is None or cycle.response_complete:
            return
        phase = Phase.BODY if cycle.more_body else Phase.WORK
        if phase is not self.phase:
            self._enter(phase, now)

    def _give_up(self, part: str, detail: str) -> None:
        self._connections.closed[f"sent its {part} too slowly"] += 1
        answerable = {h11.SEND_RESPONSE, h11.IDLE} if self.conn.trailing_data[0] else {h11.SEND_RESPONSE}
        if self.conn.our_state in answerable and not self.transport.is_closing():
            self.transport.write(_plain_answer(ErrorCode.REQUEST_TIMEOUT, detail))
        if self.phase is Phase.BODY:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        self.transport.close()


class LimitedServer(uvicorn.Server):
    """A server that ends within its time, whatever still runs."""

    def __init__(self, config: uvicorn.Config, connections: Connections, stop_limit_s: float) -> None:
        super().__init__(config)
        self._limits = connections
        self._stop_limit_s = stop_limit_s
        self._last_resort: threading.Timer | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets=sockets)
        if not self.started:
            return
        for listener in (listener for server in self.servers for listener in server.sockets):
            with listener.dup() as same:  # asyncio accepts as many in a row as it lets wait
                same.listen(WAITING_CONNECTIONS)
        self._limits.watch()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to stop."""
        super().handle_exit(sig, frame)
        if self._last_resort is None:
            self._last_resort = threading.Timer(self._stop_limit_s, _end_process, [self._stop_limit_s])
            self._last_resort.daemon = True
            self._last_resort.start()


class Settled:
    """ASGI middleware that lets the server look at all that has come of a request before an answer to it begins.

    Where what follows its head is no HTTP, the server has answered and closed by then: an answer of the application
    would be a second one, which the server takes for a fault of the application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and its answer a turn of the loop later."""

        async def send_settled(message: Message) -> None:
            if message["type"] == "http.response.start":
                await asyncio.sleep(0)
            await send(message)

        await self.app(scope, receive, send_settled)


def run_server(
    application: ASGIApp, settings: Settings, host: str, port: int, sockets: list[socket.socket] | None = None
) -> None:
    """Serve until the process is told to stop; sockets: that listen already, instead of host and port."""
    connections = Connections(settings, connection_limit(settings.connection_limit))
    config = uvicorn.Config(
        Settled(application),
        host=host,
        port=port,
        http=cast("type[asyncio.Protocol]", partial(LimitedProtocol, connections)),
        loop="asyncio",  # others accept connections past the sockets that workers share
        ws="none",
        backlog=ACCEPTED_AT_ONCE,
        server_header=False,
        log_config=None,  # as it is configured
        access_log=False,  # the application's own line a request has no query, in which places stand
        forwarded_allow_ips=list(settings.trusted_proxies),
        timeout_keep_alive=cast("int", settings.keep_alive_s),
        timeout_graceful_shutdown=cast("int", settings.stop_limit_s * SERVING_FRAC),
    )
    connections.bound_logs()
    LimitedServer(config, connections, settings.stop_limit_s).run(sockets)


def connection_limit(wanted: int) -> int:
    """As many connections as are wanted, or as descriptors allow, whose limit is raised as far as the system lets."""
    if sys.platform == "win32":  # where there is no such limit
        return wanted
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = wanted + RESERVED_DESCRIPTORS
    if soft != resource.RLIM_INFINITY and soft < needed:
        soft = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    if soft == resource.RLIM_INFINITY or soft >= needed:
        return wanted
    allowed = soft - min(RESERVED_DESCRIPTORS, soft // 2)
    LOG.warning("%d connections at a time instead of %d: the system allows %d descriptors", allowed, wanted, soft)
    return allowed


def _plain_answer(code: ErrorCode, detail: str) -> bytes:
    """A whole answer, for a client whose request is not known, or not whole."""
    kind = KINDS[code]
    body = problem_bytes(make_problem(code, detail, [], ""))
    retry = "Retry-After: 5\r\n" if kind.status == 503 else ""
    head = f"HTTP/1.1 {kind.status} {kind.title}\r\nContent-Type: {PROBLEM_TYPE}\r\nContent-Length: {len(body)}\r\n"
    return f"{head}{retry}X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n".encode("ascii") + body


def _end_process(stop_limit_s: float) -> None:
    LOG.error("not stopped within %g s: the process ends now", stop_limit_s)
    logging.shutdown()
    os._exit(1)
