"""ASGI middleware that refuses request bodies above a limit, by the bytes that really arrive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.errors.handlers import problem_response
from app.errors.raised import BodyTooLargeError

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

UPLOAD_PATH: Final = "/diagnoses"


class BodyLimit:
    """Reads a body whole before the application sees it; 413 as soon as it passes the limit.

    An uploaded form has a limit of its own and is passed on as it arrives, so that it never lies in memory whole; who
    reads it counts what has not declared its length.
    """

    def __init__(self, app: ASGIApp, limit_bytes: int, upload_limit_bytes: int) -> None:
        self.app = app
        self.limit_bytes = limit_bytes
        self.upload_limit_bytes = upload_limit_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on with its body read, or answer 413."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        if _is_upload(scope):
            if self._declared_bytes(scope) > self.upload_limit_bytes:
                await _refuse(self.upload_limit_bytes, scope, receive, send)
            else:
                await self.app(scope, receive, send)
            return
        body = bytearray()
        refused = self._declared_bytes(scope) > self.limit_bytes
        more = not refused
        while more:
            message = await receive()
            if message["type"] != "http.request":  # the client went away
                return
            body += message.get("body", b"")
            more = message.get("more_body", False)
            if len(body) > self.limit_bytes:
                refused = True
                break
        if refused:
            await _refuse(self.limit_bytes, scope, receive, send)
            return
        delivered = False

        async def replay() -> Message:
            nonlocal delivered
            if delivered:
                return await receive()
            delivered = True
            return {"type": "http.request", "body": bytes(body), "more_body": False}

        await self.app(scope, replay, send)

    @staticmethod
    def _declared_bytes(scope: Scope) -> int:
        for name, value in scope["headers"]:
            if name == b"content-length" and value.isdigit():
                return int(value[:20])
        return 0


def _is_upload(scope: Scope) -> bool:
    """Whether a request is one that sends files."""
    if scope["method"] != "POST" or scope["path"] != UPLOAD_PATH:
        return False
    return any(
        name == b"content-type" and value.lower().startswith(b"multipart/form-data") for name, value in scope["headers"]
    )


async def _refuse(limit_bytes: int, scope: Scope, receive: Receive, send: Send) -> None:
    response = problem_response(BodyTooLargeError(limit_bytes), scope["path"], {"Connection": "close"})
    await response(scope, receive, send)
