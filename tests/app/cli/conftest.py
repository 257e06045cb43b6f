"""Where commands of a test look for graphs and keep vehicles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from app.settings import Settings


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch, settings: Settings) -> None:
    monkeypatch.setenv("JOULEPATH_GRAPH_DIRS", str(settings.graph_dirs[0]))
    monkeypatch.setenv("JOULEPATH_DEFAULT_GRAPH", "grid")
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", settings.database_url)
    monkeypatch.setenv("COLUMNS", "200")
