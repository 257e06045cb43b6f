"""ASGI middleware that observes each request: its id, times in the answer, a line in the log, figures to collect."""

from __future__ import annotations

import logging
import re
import secrets
import time
from typing import TYPE_CHECKING, Any, Final

from opentelemetry import trace
from starlette.datastructures import MutableHeaders

from app.errors.handlers import CLIENT_GONE, REQUEST_ID
from app.http.metrics import METHODS, OTHER
from app.logs import ACCESS, RequestLine
from app.observation import Observation, observing

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from app.http.metrics import Metrics

LOG: Final = logging.getLogger(ACCESS)
KEY_NAME: Final = "key_name"  # in the state of a request whose key was looked at
PLACES_IN_PATH: Final = "/osrm/"  # of addresses that have places there, not in the query
_SANE_ID: Final = re.compile(rb"[A-Za-z0-9][A-Za-z0-9._:-]{0,63}")


class Observed:
    """Passes a request on, and tells what was observed of it once it is answered.

    log_client: whether the client's address stands in the log. Bodies, queries, headers and addresses with what stands
    in them are neither logged nor counted.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, *, log_client: bool) -> None:
        self.app = app
        self._metrics = metrics
        self._log_client = log_client

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        began = time.perf_counter()
        observed = Observation(_request_id(scope))
        status = CLIENT_GONE  # where nothing is sent

        async def send_observed(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                headers = MutableHeaders(scope=message)
                headers[REQUEST_ID] = observed.request_id
                headers["Server-Timing"] = _timing(observed, time.perf_counter() - began)
            await send(message)

        scope[REQUEST_ID] = observed.request_id
        span = trace.get_current_span()
        if span.is_recording():  # that of the framework, where OpenTelemetry is set up; it has the query, with places
            span.set_attributes({"url.query": "REDACTED", "request_id": observed.request_id})
            if PLACES_IN_PATH in scope["path"]:
                span.set_attribute("url.path", "REDACTED")
        try:
            with observing(observed):
                await self.app(scope, receive, send_observed)
        except Exception:
            status = 500
            raise
        finally:
            self._tell(scope, status, time.perf_counter() - began, observed)

    def _tell(self, scope: Scope, status: int, seconds: float, observed: Observation) -> None:
        method = scope["method"] if scope["method"] in METHODS else OTHER
        endpoint = _endpoint(scope)
        self._metrics.count(method, endpoint, status, seconds, observed)
        if LOG.isEnabledFor(logging.INFO):
            client = scope.get("client") if self._log_client else None
            address = client[0] if client else None
            key = scope.get("state", {}).get(KEY_NAME)
            LOG.info("%s", RequestLine(method, endpoint, status, seconds, observed, address, key))


def _request_id(scope: Scope) -> str:
    """The id that came with a request where it is short and plain, else a new one."""
    for name, value in scope["headers"]:
        if name == b"x-request-id" and _SANE_ID.fullmatch(value):
            known: str = value.decode("ascii")
            return known
    return secrets.token_hex(8)


def _endpoint(scope: Scope) -> str:
    """The address of a request as the API writes it, of a bounded set."""
    route: Any = scope.get("route")
    path = getattr(route, "path", None)
    return path if isinstance(path, str) else OTHER


def _timing(observed: Observation, seconds: float) -> str:
    """The Server-Timing header: stages and the whole until now [ms]."""
    stages = [f"{name};dur={1000.0 * stage_s:.1f}" for name, stage_s in observed.stage_s.items()]
    return ", ".join([*stages, f"total;dur={1000.0 * seconds:.1f}"])
