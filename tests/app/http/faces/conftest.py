"""A running service for clients that other people have written."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.app.http.faces.front_ends import packages, served_pages
from tests.web.served import serving

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, Page

    from tests.web.served import ServedMap


@pytest.fixture(scope="session")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedMap]:
    """The service on the bundled graphs and vehicles, with an empty database."""
    with serving(tmp_path_factory.mktemp("served"), JOULEPATH_CORS_ORIGINS="*") as running:
        yield running


@pytest.fixture(scope="session")
def pages() -> Iterator[str]:
    """Pages with front ends of other people."""
    packages()
    with served_pages() as address:
        yield address


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page on which nothing may go wrong by itself."""
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    context.set_default_timeout(20_000)
    opened = context.new_page()
    faults: list[str] = []
    opened.on("pageerror", lambda error: faults.append(str(error)))
    yield opened
    context.close()
    assert not faults, "\n".join(faults)
