"""A PostgreSQL server for the tests of the store."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from tests.app.store.postgresql_server import NoServerError, Server

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(scope="session")
def postgresql() -> Iterator[Server]:
    """A running server; skips where the machine has none, except in CI."""
    try:
        server = Server()
    except NoServerError as error:
        if os.environ.get("CI"):
            pytest.fail(f"{error}. CI must have it")
        pytest.skip(str(error))
    try:
        server.start()
        yield server
    finally:
        server.remove()
