"""The service as a process of its own, as `joulepath serve` starts it."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import httpx2

from benchmarks.browser import served

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@dataclass(frozen=True)
class ServedMap:
    """A running service, asked without a browser."""

    address: str
    client: httpx2.Client

    def ask(self, path: str, body: Any = None) -> Any:
        """The answer of GET, or of POST where there is a body, read as JSON."""
        response = self.client.get(path) if body is None else self.client.post(path, json=body)
        assert response.is_success, response.text
        return response.json()


@contextmanager
def serving(folder: Path, **settings: str) -> Iterator[ServedMap]:
    """A service with its database and log in a folder; settings by their names in the environment."""
    with (
        served(folder, **settings) as address,
        httpx2.Client(base_url=address, timeout=60.0, trust_env=False) as client,
    ):
        yield ServedMap(address, client)
