"""ASGI middleware that lets pages of other origins in, and says why not where it doesn't."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Final

from starlette.datastructures import Headers
from starlette.middleware.cors import CORSMiddleware

from app.access.errors import RefusedPreflightError
from app.errors.handlers import problem_response

if TYPE_CHECKING:
    from collections.abc import Collection

    from starlette.types import ASGIApp, Receive, Scope, Send

LOG: Final = logging.getLogger(__name__)
METHODS: Final = ("GET", "POST", "PUT", "DELETE")
# what pages of other origins may read besides what browsers always show
READABLE: Final = ("Content-Disposition", "ETag", "Location", "Retry-After", "Server-Timing", "X-Request-Id")
PRIVATE_NETWORK: Final = "access-control-request-private-network"
MOST_LOGGED: Final = 100  # origins that are refused, each once


class CrossOrigin(CORSMiddleware):
    """Cross-origin requests by the Fetch standard; a preflight that is refused is answered as a problem.

    Browsers keep the answer to a preflight from the page, but show it to those who look, and it is logged.
    """

    def __init__(self, app: ASGIApp, origins: Collection[str]) -> None:
        super().__init__(
            app, allow_origins=origins, allow_methods=METHODS, allow_headers=["*"], expose_headers=READABLE
        )
        self._logged: set[str] = set()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer a preflight."""
        if scope["type"] == "http" and scope["method"] == "OPTIONS":
            error = self._refused(Headers(scope=scope))
            if error is not None:
                headers = {"Vary": self.preflight_headers["Vary"]}
                await problem_response(error, scope["path"], headers)(scope, receive, send)
                return
        await super().__call__(scope, receive, send)

    def _refused(self, headers: Headers) -> RefusedPreflightError | None:
        """Why a preflight is refused; None where it is not, and for other requests."""
        origin, method = headers.get("origin"), headers.get("access-control-request-method")
        if origin is None or method is None:
            return None
        if not self.is_allowed_origin(origin):
            if origin not in self._logged and len(self._logged) < MOST_LOGGED:
                self._logged.add(origin)
                LOG.warning("a page of %.200r is not let in: JOULEPATH_CORS_ORIGINS does not name it", origin)
            return RefusedPreflightError(
                "Origin",
                origin,
                "an origin of JOULEPATH_CORS_ORIGINS, with scheme and port as the browser sends it, "
                "or * there for all (docs/answers.md)",
            )
        if method not in METHODS:
            return RefusedPreflightError("Access-Control-Request-Method", method, ", ".join(METHODS))
        if PRIVATE_NETWORK in headers:
            allowed = "left out: a public page may not call a private network"
            return RefusedPreflightError("Access-Control-Request-Private-Network", headers[PRIVATE_NETWORK], allowed)
        return None
