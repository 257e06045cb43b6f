"""Why a request is not let in; the values of keys are never told."""

from __future__ import annotations

import math

from energy.errors import Refusal


class AccessError(Refusal):
    """A request that is not let in."""


class UnknownHostError(AccessError):
    """The service is called by a name that is not its own."""

    code = "unknown_host"

    def __init__(self, host: str) -> None:
        allowed = "a name of JOULEPATH_ALLOWED_HOSTS"
        super().__init__("Host", host, allowed, message=f"Host is {host!r}, allowed: {allowed}")


class WrongOriginError(AccessError):
    """A page of another origin sends what changes something or takes work."""

    code = "wrong_origin"

    def __init__(self, field: str, value: str) -> None:
        allowed = "pages of this service, and of JOULEPATH_CORS_ORIGINS"
        super().__init__(field, value, allowed, message=f"{field} is {value!r}, allowed: {allowed}")


class RefusedPreflightError(AccessError):
    """A browser asks for a page of another origin whether it may call, and it may not."""

    code = "wrong_origin"

    def __init__(self, field: str, value: str, allowed: str) -> None:
        super().__init__(field, value, allowed, message=f"{field} is {value!r}, allowed: {allowed}")


class UnauthorizedError(AccessError):
    """No key was sent, or one that is not known."""

    code = "unauthorized"

    def __init__(self, sent: bool) -> None:
        self.sent = sent
        allowed = "a key of `joulepath keys add`, as Authorization: Bearer KEY or X-API-Key: KEY"
        message = f"{'the key is not known' if sent else 'no key was sent'}, allowed: {allowed}"
        super().__init__("Authorization", None, allowed, message=message)


class ForbiddenError(AccessError):
    """A key whose role does not allow what is asked for."""

    code = "forbidden"

    def __init__(self, role: str, needed: str) -> None:
        allowed = f"a key with the role {needed}" if needed == "admin" else f"a key with the role {needed} or above"
        super().__init__("Authorization", role, allowed, message=f"the key has the role {role}, allowed: {allowed}")


class RateLimitedError(AccessError):
    """More than one client may ask for; retry_s: when it may ask again [s]."""

    code = "rate_limited"

    def __init__(self, allowed: str, retry_s: float) -> None:
        self.retry_s = max(1, math.ceil(retry_s))
        super().__init__(
            "", None, allowed, message=f"too much was asked for, allowed: {allowed}; again in {retry_s:.0f} s"
        )


class KeyFileError(Refusal):
    """A file of keys that can't be read or written, or a name in it that can't be taken."""
