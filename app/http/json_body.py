"""JSON bodies that cannot stall the service: read off the event loop where long, and of bounded lists and objects."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from fastapi import Request
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool

from app.errors.raised import OversizedBodyError, RefusedBodyError

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterable

    from starlette.responses import Response

MAX_MEMBERS: Final = 1000  # of one object: no schema has as many fields
MAX_ITEMS: Final = 50_000  # of one list, as the links of a simulation
AT_ONCE_BYTES: Final = 16_384  # longer bodies are read on a thread


class BoundedRequest(Request):
    """A request whose JSON is looked at before it is validated, which takes a second for 300,000 unknown fields."""

    async def json(self) -> Any:
        """The body; raises json.JSONDecodeError, or RefusedBodyError for a list or object that no request has."""
        return await read_json(await self.body())


class BoundedRoute(APIRoute):
    """An endpoint whose requests are bounded."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """What answers a request."""
        handler = super().get_route_handler()

        async def bounded(request: Request) -> Response:
            return await handler(BoundedRequest(request.scope, request.receive))

        return bounded


async def read_json(body: bytes) -> Any:
    """What a body says; raises json.JSONDecodeError, RecursionError, or RefusedBodyError for what no request has."""
    return _read(body) if len(body) <= AT_ONCE_BYTES else await run_in_threadpool(_read, body)


def _read(body: bytes) -> Any:
    read = json.loads(body)
    waiting: list[tuple[str, Any]] = [("", read)] if isinstance(read, (dict, list)) else []
    while waiting:
        path, value = waiting.pop()
        inner: Iterable[tuple[str, Any]]
        if isinstance(value, dict):
            if len(value) > MAX_MEMBERS:
                allowed = f"at most {MAX_MEMBERS} fields"
                raise RefusedBodyError(OversizedBodyError(path, f"an object of {len(value)} fields", allowed))
            inner = ((f"{path}.{key[:MAX_MEMBERS]}".removeprefix("."), member) for key, member in value.items())
        else:
            if len(value) > MAX_ITEMS:
                allowed = f"at most {MAX_ITEMS} items"
                raise RefusedBodyError(OversizedBodyError(path, f"a list of {len(value)} items", allowed))
            inner = ((f"{path}[{k}]", item) for k, item in enumerate(value))
        waiting.extend(pair for pair in inner if isinstance(pair[1], (dict, list)))
    return read
