"""A PostgreSQL server for the tests of the store."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.app.store.postgresql_server import running_server

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.app.store.postgresql_server import Server


@pytest.fixture(scope="session")
def postgresql() -> Iterator[Server]:
    """A running server; skips where the machine has none, except in CI."""
    with running_server() as server:
        yield server
