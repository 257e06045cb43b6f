"""Errors of the app itself."""

from __future__ import annotations

from energy.errors import LinkError


class TimeLimitError(Exception):
    """No answer within the time allowed."""

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        super().__init__(
            f"no answer within {limit_s:g} s; ask for a shorter route, less charge, fewer alternatives or places"
        )


class NotReadyError(Exception):
    """Graphs are not loaded yet."""

    def __init__(self) -> None:
        super().__init__("graphs are being loaded and kernels compiled; try again in a moment")


class BodyTooLargeError(Exception):
    """A request body above the limit."""

    def __init__(self, limit_bytes: int) -> None:
        self.limit_bytes = limit_bytes
        super().__init__(f"the request body is too large, allowed: at most {limit_bytes} bytes")


class CommandError(Exception):
    """A command that can't be carried out, with the reason as its message."""


class ChainLinkError(LinkError):
    """A link given by its numbers that cannot be driven: field and value are those that were sent."""
