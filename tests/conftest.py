"""What holds for all tests."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings
from playwright.sync_api import sync_playwright

from benchmarks.browser import NoBrowserError, chromium_path, launched

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from playwright.sync_api import Browser

# a slow or busy machine is no failure; the same examples each time, so that what passed passes anywhere
settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("drawn", deadline=None)  # pytest --hypothesis-profile drawn looks for more
settings.load_profile("same")


@pytest.fixture(scope="session", autouse=True)
def data_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A data directory in place of the user's own, also for the processes that tests start."""
    folder = tmp_path_factory.mktemp("data-home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(folder))
        patch.delenv("JOULEPATH_DATABASE_URL", raising=False)
        yield folder


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of a Chromium; skips where there is none, except in CI."""
    try:
        return chromium_path()
    except NoBrowserError as error:
        if os.environ.get("CI"):
            pytest.fail(f"{error}. CI must have it")
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def browser(chromium: str) -> Iterator[Browser]:
    """A browser without a window, one for all tests of a process: Playwright can't be started twice in it."""
    with sync_playwright() as playwright, launched(playwright) as running:
        yield running


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Show the properties named `measured` that tests record, whichever process they ran in."""
    for report in (*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")):
        for name, text in report.user_properties:
            if name == "measured":
                terminalreporter.write_line(text)
