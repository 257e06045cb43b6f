"""Comparing recorded answers names what differs, however little."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from benchmarks.answers import compare, first_difference, stable

if TYPE_CHECKING:
    from pathlib import Path


def recorded(path: Path, **bodies: Any) -> Path:
    """A file with a line for each body."""
    lines = [json.dumps({"case": case, "request": {"path": "/route"}, "body": body}) for case, body in bodies.items()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


def test_equal_files_compare_without_a_difference(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [recorded(tmp_path / name, first={"energy_kwh": 0.1}, second=[]) for name in ("a", "b")]
    assert compare(*files) == 0
    assert capsys.readouterr().out == "2 of 2 lines are equal\n"


def test_differing_line_is_printed_with_its_request_and_first_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = recorded(tmp_path / "a", first={"routes": [{"soc": 0.5}, {"soc": 0.1}]}, second=1)
    after = recorded(tmp_path / "b", first={"routes": [{"soc": 0.5}, {"soc": 0.2}]}, third=1)
    assert compare(before, after) == 1
    assert capsys.readouterr().out.splitlines() == [
        'first: {"path": "/route"}',
        "  body.routes[1].soc: 0.1, and 0.2",
        'second: {"path": "/route"}',
        f"  only in {before}",
        'third: {"path": "/route"}',
        f"  only in {after}",
        "0 of 3 lines are equal",
    ]


@pytest.mark.parametrize(
    ("left", "right", "difference"),
    [
        ({"x": 0.0}, {"x": -0.0}, "x: 0.0, and -0.0"),
        ({"x": 1}, {"x": 1.0}, "x: 1, and 1.0"),
        ({"x": 1}, {"x": True}, "x: 1, and true"),
        ({"x": 0.1}, {"x": 0.1 + 2**-56}, "x: 0.1, and 0.10000000000000002"),
        ({"x": 1}, {}, "x: only in the first"),
        ({"x": [1, 2]}, {"x": [1]}, "x: 2 items, and 1 items"),
    ],
)
def test_values_that_are_written_differently_differ(left: Any, right: Any, difference: str) -> None:
    assert first_difference(left, right) == difference


def test_stable_body_has_no_time_in_it_at_any_depth() -> None:
    assert stable({"stats": [{"seconds": 0.1, "labels_made": 3}], "created": "today"}) == {
        "stats": [{"labels_made": 3}]
    }
