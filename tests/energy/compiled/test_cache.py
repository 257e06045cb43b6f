"""Where kernels are cached, and what is said while they are compiled."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[3]
KERNEL: Final = """
import energy.compiled.cache
from numba import njit

@njit(cache=True)
def twice(x):
    return 2 * x
"""
TALKATIVE: Final = """
from energy.compiled import progress
progress.QUIET_S = progress.LINE_S = 0.0
progress.TICK_S = 0.001
progress.compilations.watch(progress.Display())
"""
RUN: Final = "from energy.kernels_twice import twice; print(twice(21), sum(twice.stats.cache_hits.values()))"


def packages_in(folder: Path) -> Path:
    """The part of the packages that compiling takes, with a kernel of its own, in another place."""
    shutil.copytree(ROOT / "energy" / "compiled", folder / "energy" / "compiled")
    for file in ("energy/__init__.py", "energy/kernels_twice.py"):
        (folder / file).write_text(KERNEL if "kernels" in file else '"""Energy."""\n', encoding="utf-8")
    return folder


def run_in(folder: Path, before: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    plain = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")} | environment
    program = f"import sys; sys.path.insert(0, {str(folder)!r})\n{before}\n{RUN}"
    command = [sys.executable, "-P", "-c", program]
    return subprocess.run(command, env=plain, cwd=folder, capture_output=True, text=True, check=False)


def test_kernel_that_is_compiled_in_one_place_is_not_compiled_again_in_another(tmp_path: Path) -> None:
    first, second = packages_in(tmp_path / "a"), packages_in(tmp_path / "b")
    cache = str(tmp_path / "cache")
    assert run_in(first, XDG_CACHE_HOME=cache).stdout == "42 0\n"
    assert run_in(second, XDG_CACHE_HOME=cache).stdout == "42 1\n"


def test_kernel_is_named_on_an_output_that_is_no_terminal_while_it_is_compiled_and_never_again(tmp_path: Path) -> None:
    place, cache = packages_in(tmp_path / "a"), str(tmp_path / "cache")
    said = run_in(place, TALKATIVE, XDG_CACHE_HOME=cache).stderr.splitlines()
    assert said[0] == "compiling kernels, once for this version: 0 done, now kernels_twice.twice (0 s)"
    assert run_in(place, TALKATIVE, XDG_CACHE_HOME=cache).stderr == ""


def test_kernel_whose_text_differs_is_compiled_anew(tmp_path: Path) -> None:
    first, second = packages_in(tmp_path / "a"), packages_in(tmp_path / "b")
    (second / "energy/kernels_twice.py").write_text(KERNEL.replace("2 * x", "x + x"), encoding="utf-8")
    cache = str(tmp_path / "cache")
    assert run_in(first, XDG_CACHE_HOME=cache).stdout == "42 0\n"
    assert run_in(second, XDG_CACHE_HOME=cache).stdout == "42 0\n"


def test_folder_that_cannot_be_written_is_named_and_nothing_is_left_behind(tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("a file, where no folder can be made", encoding="utf-8")
    (tmp_path / "scratch").mkdir()
    place = packages_in(tmp_path / "a")
    ran = run_in(place, XDG_CACHE_HOME=str(tmp_path / "cache"), TMPDIR=str(tmp_path / "scratch"))
    assert ran.stdout == "42 0\n"
    assert f"can't be kept in {tmp_path / 'cache'}" in ran.stderr
    assert list((tmp_path / "scratch").iterdir()) == []


def test_folder_of_the_users_choice_is_numbas_own(tmp_path: Path) -> None:
    place, chosen = packages_in(tmp_path / "a"), tmp_path / "chosen"
    assert run_in(place, NUMBA_CACHE_DIR=str(chosen)).stdout == "42 0\n"
    assert [file.suffix for file in sorted(chosen.rglob("*.nb?"))] == [".nbc", ".nbi"]
