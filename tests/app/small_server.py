"""A server of its own for tests: `python -m tests.app.small_server FD`, on a listening socket that it is given.

GET /hoard opens files until no descriptor is free, /release closes them, /block holds the event loop.
"""

from __future__ import annotations

import socket
import sys
import time
from typing import TYPE_CHECKING, Any

from app.http.server import run_server
from app.settings import Settings

if TYPE_CHECKING:
    from io import BufferedReader

    from starlette.types import Receive, Scope, Send

hoarded: list[BufferedReader] = []


def do(path: str) -> None:
    if path == "/block":
        time.sleep(600.0)
    if path == "/release":
        for file in hoarded:
            file.close()
    while path == "/hoard":
        try:
            hoarded.append(open("/dev/null", "rb"))  # noqa: SIM115 - kept open
        except OSError:
            return


async def application(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] != "http":
        return
    do(scope["path"])
    start: dict[str, Any] = {"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"0")]}
    await send(start)
    await send({"type": "http.response.body", "body": b""})


if __name__ == "__main__":
    listening = socket.socket(fileno=int(sys.argv[1]))
    run_server(application, Settings(), "", 0, [listening])
