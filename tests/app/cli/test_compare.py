"""`joulepath compare`, end to end."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from diagnosis.comparison.comparison import compare
from diagnosis.comparison.report import comparison_figures
from diagnosis.comparison.trips import read_trips

if TYPE_CHECKING:
    from pathlib import Path

    from typer.testing import Result

TABLE = """\
trip,type,series,distance_km,duration_s,stops,standstill_s,energy_kwh
1,urban,measured,10,1800,20,300,1.5
2,urban,measured,10,1700,0,200,1.4
3,highway,measured,80,2800,0,0,14.0
1,urban,fast,10,1500,22,310,1.65
2,urban,fast,10,1500,2,200,1.26
4,highway,fast,80,2600,0,0,15.0
"""


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("COLUMNS", "160")
    path = tmp_path / "trips.csv"
    path.write_text(TABLE, encoding="utf-8")
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["compare", *map(str, arguments)])


def test_tables_are_shown_and_files_written(table: Path, tmp_path: Path) -> None:
    result = run(table, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "+10.0 %" in result.stdout
    assert "−10.0 % to +10.0 %" in result.stdout
    assert "Paired t-test" in result.stdout
    assert "1 trip only in measured, left out: 3" in result.stderr
    assert "1 trip only in fast, left out: 4" in result.stderr
    assert (tmp_path / "out" / "comparison.json").is_file()


def test_json_is_the_file_that_is_written(table: Path, tmp_path: Path) -> None:
    result = run(table, "--out", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    printed = json.loads(result.stdout)
    assert printed == json.loads((tmp_path / "out" / "comparison.json").read_text(encoding="utf-8"))
    assert printed == json.loads(json.dumps(comparison_figures(compare(read_trips([table])))))


def test_another_series_can_be_the_measured_one(table: Path, tmp_path: Path) -> None:
    result = run(table, "--out", tmp_path / "out", "--measured", "fast", "--json")
    assert json.loads(result.stdout)["series"][0]["series"] == "measured"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{table}", "--measured", "logger"], "measured series is 'logger', allowed: 'measured', 'fast'"),
        (["{table}", "{table}"], "line 2: trip is '1'"),
        (["{folder}/absent.csv"], "No such file or directory"),
    ],
)
def test_errors_end_in_one_line_and_code_two(table: Path, tmp_path: Path, arguments: list[str], message: str) -> None:
    out = tmp_path / "out"
    result = run(*(text.format(table=table, folder=tmp_path) for text in arguments), "--out", out)
    assert result.exit_code == 2
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert not out.exists()


@pytest.mark.parametrize("content", ["[" * 100_000, f"[{'1' * 5000}]", '[{"trip": "\\ud800"}]'])
def test_json_that_cannot_be_read_ends_in_one_line(tmp_path: Path, content: str) -> None:
    (tmp_path / "trips.json").write_text(content, encoding="ascii")
    result = run(tmp_path / "trips.json", "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_smallest_and_largest_energies_are_compared(table: Path, tmp_path: Path) -> None:
    text = TABLE.replace(",1.5\n", ",1e-6\n").replace(",1.4\n", ",1e-6\n").replace(",1.65\n", ",1e5\n")
    table.write_text(text.replace(",1.26\n", ",-1e5\n"), encoding="utf-8")
    result = run(table, "--out", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["series"][0]["energy_error_percent"]["max"] == pytest.approx(1e13)


def test_bad_value_is_named_with_its_place(table: Path, tmp_path: Path) -> None:
    table.write_text(TABLE.replace("1800", "-1"), encoding="utf-8")
    result = run(table, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert f"{table}, line 2: duration_s is '-1', allowed: a number above 0" in result.stderr
