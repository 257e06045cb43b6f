"""Requests to a running service over sockets of their own, many at a time, also such as no client library sends."""

from __future__ import annotations

import asyncio
import json
import time
from dataclasses import dataclass, field
from typing import Any, Final
from urllib.parse import urlsplit

ENDLESS_S: Final = 120.0  # without an answer counts as hanging
MOST_HEAD_BYTES: Final = 65_536


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back: status 0 where the connection ended without an answer; seconds: from connecting to the end."""

    status: int
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""
    seconds: float = 0.0

    @property
    def announced(self) -> bool:
        """Whether the service promises such an answer: no fault of its own, and who is refused may come again."""
        if self.status in (429, 503):
            return "retry-after" in self.headers
        return 200 <= self.status < 500

    @property
    def json(self) -> Any:
        """The body."""
        return json.loads(self.body)


class Service:
    """Where a service listens."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        self.host, self.port = str(parts.hostname), int(parts.port or 80)

    async def ask(
        self, method: str, path: str, body: object = None, *, headers: dict[str, str] | None = None, gone_s: float = 0.0
    ) -> Answer:
        """Send one request; gone_s: when to hang up without having read the answer [s], 0 for never."""
        content = b"" if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
        lines = {"Host": f"{self.host}:{self.port}", "Connection": "close", "Content-Length": str(len(content))}
        if body is not None:
            lines["Content-Type"] = "application/json"
        lines |= headers or {}
        head = "".join(f"{name}: {value}\r\n" for name, value in lines.items())
        return await self.send(f"{method} {path} HTTP/1.1\r\n{head}\r\n".encode() + content, gone_s=gone_s)

    async def send(self, sent: bytes, *, gone_s: float = 0.0) -> Answer:
        """Send bytes as they are, and read one answer; raises TimeoutError where none comes."""
        began = time.perf_counter()
        reader, writer = await asyncio.open_connection(self.host, self.port, limit=MOST_HEAD_BYTES)
        try:
            writer.write(sent)
            if gone_s > 0.0:
                await asyncio.sleep(gone_s)
                return Answer(0)
            status, headers, body = await asyncio.wait_for(_read(reader, sent.startswith(b"HEAD ")), ENDLESS_S)
            return Answer(status, headers, body, time.perf_counter() - began)
        except (ConnectionError, asyncio.IncompleteReadError):
            return Answer(0, seconds=time.perf_counter() - began)
        finally:
            if gone_s > 0.0:
                writer.transport.abort()
            writer.close()


async def _read(reader: asyncio.StreamReader, bodiless: bool) -> tuple[int, dict[str, str], bytes]:
    status = 100
    while status < 200:  # those before are on the way to it
        head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").split("\r\n")
        status = int(head[0].split()[1])
    headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in head[1:] if line)}
    if bodiless or status in (204, 304):
        return status, headers, b""
    if headers.get("transfer-encoding") == "chunked":
        body = bytearray()
        while size := int(await reader.readuntil(b"\r\n"), 16):
            body += await reader.readexactly(size)
            await reader.readexactly(2)
        return status, headers, bytes(body)
    if "content-length" in headers:
        return status, headers, await reader.readexactly(int(headers["content-length"]))
    return status, headers, await reader.read()
