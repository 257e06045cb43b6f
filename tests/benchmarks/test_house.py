"""The figures of how code is laid out, on a checkout that is small enough to count by hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.house import Function, House, measure, table

pytestmark = pytest.mark.nojit

CONTRACT = """
[tool.importlinter]
root_packages = ["house_upper", "house_lower"]
[[tool.importlinter.contracts]]
type = "layers"
layers = ["house_upper", "house_lower"]
"""
FILES = {
    "house_upper/__init__.py": "",
    "house_upper/top.py": "from house_upper.room import a\nfrom house_lower import base\n",
    "house_upper/room/__init__.py": "",
    "house_upper/room/a.py": "from house_upper.room import b\n",
    "house_upper/room/b.py": "from house_upper.room import a, c\n",
    "house_upper/room/c.py": "",
    "house_lower/__init__.py": "",
    "house_lower/base.py": (
        "import house_upper.top\n\n\nclass C:\n    def few(self, a, b, c, d, e, f, g, h, i):\n        return a\n\n\n"
        "def many(a, b, c, d, e, /, f, g, h, *, i, j):\n    return (\n        a\n    )\n"
    ),
}


@pytest.fixture(scope="module")
def houses(tmp_path_factory: pytest.TempPathFactory) -> dict[str, House]:
    root: Path = tmp_path_factory.mktemp("checkout")
    (root / "pyproject.toml").write_text(CONTRACT, encoding="utf-8")
    for name, text in FILES.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return {house.package: house for house in measure(root)}


def test_modules_are_counted_by_folder(houses: dict[str, House]) -> None:
    assert houses["house_upper"].modules == 4
    assert houses["house_upper"].fullest == ("house_upper/room", 3)


def test_circles_are_told_by_their_members_and_one_import_of_each_goes_up(houses: dict[str, House]) -> None:
    assert houses["house_upper"].circles == (("house_upper.room.a", "house_upper.room.b"),)
    assert houses["house_upper"].up == 1
    assert houses["house_upper"].imports == 4


def test_imports_against_the_layers_go_up(houses: dict[str, House]) -> None:
    assert houses["house_lower"].up == 1
    assert houses["house_lower"].circles == ()


def test_functions_have_their_lines_and_arguments_without_self(houses: dict[str, House]) -> None:
    assert set(houses["house_lower"].functions) == {Function("base.few", 2, 9), Function("base.many", 4, 10)}


def test_table_has_a_row_a_package(houses: dict[str, House]) -> None:
    rows = table(houses.values()).splitlines()
    assert rows[3] == "| house_lower | 1 | 1 (`house_lower`) | – | 1 | 0 | 4 (`base.many`) | 0 | 1 | 12 |"
    assert "- circle: `house_upper.room.a`, `house_upper.room.b`" in rows
