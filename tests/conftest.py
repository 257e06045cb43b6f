"""What holds for all tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

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


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Show the properties named `measured` that tests record, whichever process they ran in."""
    for report in (*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")):
        for name, text in report.user_properties:
            if name == "measured":
                terminalreporter.write_line(text)
