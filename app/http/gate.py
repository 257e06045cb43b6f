"""ASGI middleware that lets requests in: by host, origin, key and rate; and sends the headers that browsers obey."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.access.addresses import client_of, is_loopback, parsed
from app.access.errors import (
    AccessError,
    ForbiddenError,
    KeyFileError,
    RateLimitedError,
    UnauthorizedError,
    UnknownHostError,
    WrongOriginError,
)
from app.access.keys import KeyRing, read_keys
from app.access.rates import RateLimits
from app.access.roles import HEALTH, READING, need_of
from app.errors.handlers import problem_response

if TYPE_CHECKING:
    from collections.abc import Mapping

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from app.access.keys import ApiKey
    from app.settings import Settings

ASKED: Final = frozenset({b"host", b"origin", b"sec-fetch-site", b"authorization", b"x-api-key"})
LOCAL_NAMES: Final = ("localhost", "127.0.0.1", "[::1]")
HEADERS: Final = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
POLICY: Final = b"content-security-policy"
DATA_POLICY: Final = (POLICY, b"default-src 'none'; frame-ancestors 'none'")  # of what is no page


class SecurityHeaders:
    """Sends with every answer what keeps browsers from guessing, framing and passing on."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and the headers with its answer."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = [*message.get("headers", ()), *HEADERS]
                if not any(name == POLICY for name, _ in headers):
                    headers.append(DATA_POLICY)
                message["headers"] = headers
            await send(message)

        await self.app(scope, receive, send_with_headers)


class Gate:
    """Answers requests that are not let in, and passes the others on.

    Health is open to anybody, by any name, at any rate. The name of a request's key stands in `scope["state"]`.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self.app = app
        self._keys = None if settings.keys_file is None else KeyRing(settings.keys_file)
        self._hosts = frozenset(name for name in settings.allowed_hosts if not name.startswith("*."))
        self._parents = tuple(name[1:] for name in settings.allowed_hosts if name.startswith("*."))
        self._origins = frozenset(origin.lower() for origin in settings.cors_origins)
        self._rates = RateLimits(settings.rate_limit_per_s, settings.rate_burst, settings.daily_quota)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request in, or answer why not."""
        if scope["type"] == "http":
            try:
                self._let_in(scope)
            except AccessError as error:
                await problem_response(error, scope["path"], _answer_headers(error))(scope, receive, send)
                return
        await self.app(scope, receive, send)

    def _let_in(self, scope: Scope) -> None:
        path, method = scope["path"].removeprefix(scope.get("root_path", "")), scope["method"]
        if path in HEALTH:
            return
        headers = {name: value.decode("latin-1") for name, value in scope["headers"] if name in ASKED}
        if self._hosts or self._parents:
            self._check_host(headers.get(b"host", ""))
        if method not in READING:
            self._check_origin(headers)
        need = need_of(method, path)
        sent = _sent_key(headers) if self._keys is not None else ""
        key = self._keys.known(sent) if self._keys is not None and sent else None
        self._take(scope, key, need.units)
        if self._keys is None or need.role is None:
            return
        if key is None:
            raise UnauthorizedError(bool(sent))
        if not key.role.allows(need.role):
            raise ForbiddenError(key.role.value, need.role.value)
        scope.setdefault("state", {})["key_name"] = key.name

    def _check_host(self, host: str) -> None:
        name = host_name(host)
        if name not in self._hosts and not name.endswith(self._parents or ("\0",)):
            raise UnknownHostError(host)

    def _check_origin(self, headers: Mapping[bytes, str]) -> None:
        """Refuse what a browser sends on behalf of a foreign page (Fetch Metadata; RFC 6454 section 7)."""
        origin, site = headers.get(b"origin"), headers.get(b"sec-fetch-site")
        if "*" in self._origins or (origin is not None and origin.lower() in self._origins):
            return
        if site is not None and site not in ("same-origin", "none"):
            raise WrongOriginError("Sec-Fetch-Site", site) if origin is None else WrongOriginError("Origin", origin)
        # behind a proxy the scheme may be another, so that only name and port are compared
        if (
            site is None
            and origin is not None
            and origin.partition("://")[2].lower() != headers.get(b"host", "").lower()
        ):
            raise WrongOriginError("Origin", origin)

    def _take(self, scope: Scope, key: ApiKey | None, units: float) -> None:
        if key is not None:
            self._rates.take(f"key {key.id}", units, key.daily_quota)
            return
        host = (scope.get("client") or ("", 0))[0]
        address = parsed(host)
        if address is not None and not address.is_loopback:  # this machine has no limit
            self._rates.take(client_of(host), units)


def host_name(host: str) -> str:
    """The name in a Host header, in lower case, without its port."""
    name = host[: host.find("]") + 1] if host.startswith("[") else host.partition(":")[0]
    return name.lower().rstrip(".")


def listening_settings(settings: Settings, host: str) -> Settings:
    """Settings of a server that listens there.

    On this machine's own addresses, it is called by their names unless others are allowed. Elsewhere keys are demanded,
    or it must be said that they are not. Raises KeyFileError where there are none.
    """
    changes: dict[str, object] = {}
    local = is_loopback(host)
    if local and not settings.allowed_hosts:
        named = f"[{host}]" if ":" in host else host
        changes["allowed_hosts"] = tuple(dict.fromkeys((*LOCAL_NAMES, named.lower())))
    if settings.keys_file is not None and not read_keys(settings.keys_file):
        if not settings.open_without_keys:
            raise KeyFileError(
                "keys_file",
                str(settings.keys_file),
                "a file with a key; make one: joulepath keys add NAME --role write",
            )
        changes["keys_file"] = None
    elif settings.keys_file is None and not local and not settings.open_without_keys:
        raise KeyFileError(
            "host",
            host,
            "this machine's own address; to be reached from elsewhere set JOULEPATH_KEYS_FILE and make a key with"
            " `joulepath keys add NAME`, or set JOULEPATH_OPEN_WITHOUT_KEYS=1 to let anybody in",
        )
    return settings.model_copy(update=changes)


def _sent_key(headers: Mapping[bytes, str]) -> str:
    """The key of a request; openrouteservice's clients send it without the scheme."""
    scheme, _, value = headers.get(b"authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return value.strip()
    return headers.get(b"x-api-key", "").strip() or ("" if value else scheme)


def _answer_headers(error: AccessError) -> dict[str, str]:
    if isinstance(error, RateLimitedError):
        return {"Retry-After": str(error.retry_s)}
    if isinstance(error, UnauthorizedError):
        return {"WWW-Authenticate": 'Bearer realm="joulepath"' + (', error="invalid_token"' if error.sent else "")}
    return {}
