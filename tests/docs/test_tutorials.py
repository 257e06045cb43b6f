"""Tutorials do what they say: their blocks run in order in an empty folder and print what the pages show."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from benchmarks.browser import CHROMIUM_VARIABLE
from tests.docs.tutorial import TUTORIALS, Reader, blocks, matches

if TYPE_CHECKING:
    from pathlib import Path

PAGES = sorted(TUTORIALS.glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_blocks_of_a_tutorial_print_what_it_shows(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    for name in [name for name in os.environ if name.startswith("JOULEPATH_") and name != CHROMIUM_VARIABLE]:
        monkeypatch.delenv(name)
    folder = tmp_path / "reader"
    folder.mkdir()
    monkeypatch.chdir(folder)
    read = list(blocks(page.read_text(encoding="utf-8")))
    assert sum(block.language == "text" for block in read) >= 2
    with Reader(folder, lambda: request.getfixturevalue("browser")) as reader:
        for block in read:
            reader.follow(block)


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("a 1.5 kWh\n", "a 1.5 kWh\n", True),
        ("a 1.5 kWh\n", "a 1.6 kWh\n", False),
        ("in …, 3\n", "in /some/where, 3\n", True),
        ("in …, 3\n", "in /some\nwhere, 3\n", False),
        ("first\n…\nlast\n", "first\nx\ny\nlast\n", True),
        ("first\n…\nlast\n", "first\nlast\n", True),
        ("first\n…\n", "first\nsecond\n", True),
        ("first\n", "first\nsecond\n", False),
    ],
)
def test_mark_stands_for_the_rest_of_a_line_or_for_lines(shown: str, printed: str, same: bool) -> None:
    assert matches(shown, printed) is same
