"""joulepath prove: a table with targets, and the same as files."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from proof.plans import places, small_plan
from proof.runs import plan_digest
from proof.sealed import SEALED_FILE

if TYPE_CHECKING:
    from pathlib import Path

    from typer.testing import Result


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(cli, ["prove", *map(str, arguments)])


def test_out_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    result = run("--out", tmp_path / "out")
    assert (result.exit_code, "allowed: a folder" in result.output) == (2, True)


def test_recordings_that_are_not_there_are_named(tmp_path: Path) -> None:
    result = run("--recordings", tmp_path / "none", "--out", tmp_path / "out")
    assert (result.exit_code, "--recordings is" in result.output) == (2, True)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("arguments", [("--worlds", "huge"), ("--seed", "-1"), ("--workers", "0")])
def test_values_out_of_range_are_refused(arguments: tuple[str, str], tmp_path: Path) -> None:
    result = run(*arguments, "--out", tmp_path / "out")
    assert (result.exit_code, arguments[0] in result.output) == (2, True)


def test_a_scheduler_that_does_not_answer_is_named(tmp_path: Path) -> None:
    result = run("--worlds", "small", "--scheduler", "nowhere://1", "--out", tmp_path / "out")
    assert (result.exit_code, "--scheduler is 'nowhere://1'" in result.output) == (2, True)


def test_a_folder_with_another_proof_is_refused(tmp_path: Path) -> None:
    seal = {"sha256": "0", "plan": plan_digest(places(small_plan(), 1)), "worlds": [], "unmade": 0}
    (tmp_path / SEALED_FILE).write_text(json.dumps(seal), encoding="utf-8")
    result = run("--worlds", "small", "--seed", "2", "--out", tmp_path)
    assert (result.exit_code, "a proof of another plan or seed" in result.output) == (2, True)


def test_without_dask_the_extra_is_named(tmp_path: Path) -> None:
    """In a process of its own, from which the package is kept away."""
    out = str(tmp_path / "out")
    run_it = f"cli(['prove', '--worlds', 'small', '--out', {out!r}])"
    code = f"import sys; sys.modules['dask'] = None; from app.cli.main import cli; {run_it}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "dask is not installed: install joulepath with the extra `proof`" in " ".join(done.stderr.split())
