"""Every threat of the security page names tests that there are."""

from __future__ import annotations

import ast
import re
from typing import Final

import pytest

from tests.docs.named_code import ROOT

pytestmark = pytest.mark.nojit

PAGE: Final = ROOT / "docs" / "security.md"
NAMED: Final = re.compile(r"`(tests/[\w/]+\.py): (test_\w+)`")


def threats() -> dict[str, list[tuple[str, str]]]:
    """File and name of the tests of each threat."""
    table = PAGE.read_text(encoding="utf-8").partition("\n## What it holds out against\n")[2].partition("\n## ")[0]
    rows = [line.split(" | ") for line in table.splitlines() if line.startswith("| ")][1:]
    return {row[0].removeprefix("| "): NAMED.findall(row[-1]) for row in rows}


def functions_of(path: str) -> set[str]:
    file = ROOT / path
    tree = ast.parse(file.read_text(encoding="utf-8")) if file.is_file() else ast.Module([], [])
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_every_threat_names_a_test_and_every_test_named_is_there() -> None:
    found = threats()
    assert len(found) >= 20
    for threat, named in found.items():
        assert named, f"{threat}: no test is named"
        missing = [name for path, name in named if name not in functions_of(path)]
        assert not missing, f"{threat}: {missing}"


def test_every_test_that_the_page_names_is_named_in_full() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert len(re.findall(r"`[^`]*\btest_\w+`", text)) == len(NAMED.findall(text))
