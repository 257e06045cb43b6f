from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from routing.stations.reading import ReadStations, read_stations

Reading = Callable[..., ReadStations]


@pytest.fixture
def read_text(tmp_path: Path) -> Reading:
    """Read stations of a text, or of what is written as JSON."""

    def read(content: object, name: str = "stations.txt", encoding: str = "utf-8") -> ReadStations:
        path = tmp_path / name
        text = content if isinstance(content, str) else json.dumps(content)
        path.write_bytes(text.encode(encoding))
        return read_stations(path)

    return read
