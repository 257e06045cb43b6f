"""Folders of uploads: held as long as their process lives, and swept afterwards."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from typing import TYPE_CHECKING

import pytest

from app.diagnosing.arrivals import Arrivals
from app.diagnosing.spool import ABANDONED_S, UNLOCKED_PREFIX, Spool, sweep
from app.errors.diagnosing import TooManyDiagnosesError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = pytest.mark.nojit

LEAVE = """
import os
from app.diagnosing.spool import Spool
spool = Spool()
(spool.new_folder() / "drive.csv").write_text("x")
print(spool.folder, flush=True)
os._exit(1)
"""


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder in place of the system's for temporary files."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    yield tmp_path
    tempfile.tempdir = None


def test_folder_of_a_process_that_is_gone_is_swept_and_that_of_one_that_lives_is_not(temporary: Path) -> None:
    living = Spool()
    gone = subprocess.run([sys.executable, "-c", LEAVE], capture_output=True, text=True, check=False).stdout.strip()
    assert os.path.exists(gone)
    assert [str(folder) for folder in sweep()] == [gone]
    assert not os.path.exists(gone)
    assert living.new_folder().is_dir()
    living.close()
    assert list(temporary.iterdir()) == []


def test_folder_of_an_older_version_is_swept_once_nothing_changes_in_it(temporary: Path) -> None:
    old, new = (temporary / f"{UNLOCKED_PREFIX}{name}" for name in ("old", "new"))
    for folder in (old, new):
        folder.mkdir()
    before_s = old.stat().st_mtime - ABANDONED_S - 60.0
    os.utime(old, (before_s, before_s))
    assert sweep() == [old]


def test_link_by_the_name_of_such_a_folder_is_not_followed(temporary: Path) -> None:
    (temporary / "kept").mkdir()
    (temporary / "joulepath-spool-link").symlink_to(temporary / "kept")
    assert sweep() == []
    assert (temporary / "kept").is_dir()


def test_bodies_that_arrive_hold_places_in_the_queue_until_they_end() -> None:
    arrivals = Arrivals(2)
    first = arrivals.begin(0)
    with pytest.raises(TooManyDiagnosesError, match="at most 2"):
        arrivals.begin(1)
    first.end()
    first.end()
    arrivals.begin(1)
    with pytest.raises(TooManyDiagnosesError):
        arrivals.begin(1)
