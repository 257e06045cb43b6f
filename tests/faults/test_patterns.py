"""Patterns that are made to take long: they end within their limits, whatever the folder holds."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import pytest

from app.diagnosing.sources import MOST_SEARCH_S, files_below
from app.errors.diagnosing import SourceError

if TYPE_CHECKING:
    from pathlib import Path


def deep(folder: Path) -> Path:
    """Folders in folders, 40 deep, each with a link to the first and to itself."""
    within = folder
    for _ in range(40):
        within = within / "d"
        within.mkdir(parents=True)
        (within / "up").symlink_to(folder)
        (within / "here").symlink_to(".")
        (within / "drive.csv").write_text("x", encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    "pattern",
    ["**/" * 60 + "x.csv", "*/" * 60 + "x.csv", "up/" * 60 + "x.csv", "d/here/" * 40 + "*" * 99 + "a*b*c*d*e.csv"],
    ids=["any depth again and again", "through links", "by links", "many stars"],
)
def test_pattern_that_multiplies_ways_ends_soon(tmp_path: Path, pattern: str) -> None:
    folder = deep(tmp_path / "drives")
    begin_s = time.process_time()
    with pytest.raises(SourceError, match=r"recordings\[0\]"):
        files_below(folder, [pattern])
    assert time.process_time() - begin_s < 2.0 * MOST_SEARCH_S


def test_name_of_many_stars_takes_time_in_proportion_to_them(tmp_path: Path) -> None:
    (tmp_path / ("a" * 200 + ".csv")).write_text("x", encoding="utf-8")
    begin_s = time.process_time()
    with pytest.raises(SourceError, match="that is there"):
        files_below(tmp_path, ["*a" * 100 + "b.csv"])
    assert time.process_time() - begin_s < MOST_SEARCH_S


def test_each_drive_of_deep_folders_is_named_once_beside_links_in_circles(tmp_path: Path) -> None:
    assert len(files_below(deep(tmp_path / "drives"), ["**/*.csv"])) == 40
