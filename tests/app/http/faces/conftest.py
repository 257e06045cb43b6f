"""A running service for clients that other people have written."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.web.served import serving

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.web.served import ServedMap


@pytest.fixture(scope="session")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedMap]:
    """The service on the bundled graphs and vehicles, with an empty database."""
    with serving(tmp_path_factory.mktemp("served"), JOULEPATH_CORS_ORIGINS="*") as running:
        yield running
