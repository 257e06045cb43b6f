"""Folders of uploads: held as long as their process lives, and swept afterwards."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from typing import TYPE_CHECKING

import pytest

from app.diagnosing.arrivals import Arrivals, ArrivingFile
from app.diagnosing.spool import ABANDONED_S, UNLOCKED_PREFIX, Spool, sweep
from app.errors.diagnosing import TooManyUploadsError, UploadsFullError

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


def test_uploads_that_arrive_are_limited_in_all_and_of_one_client(temporary: Path) -> None:
    spool = Spool()
    arrivals = Arrivals(4, spool.new_folder)
    first, _ = arrivals.begin("a"), arrivals.begin("a")
    with pytest.raises(TooManyUploadsError, match=r"2 uploads of one client .* at most 2"):
        arrivals.begin("a")
    others = [arrivals.begin("b"), arrivals.begin(None)]
    with pytest.raises(TooManyUploadsError, match=r"4 uploads in all .* at most 4"):
        arrivals.begin("c")
    first.end()
    first.end()
    arrivals.begin("c")
    with pytest.raises(TooManyUploadsError, match="in all"):
        arrivals.begin("a")
    others[1].end()
    arrivals.begin("a")
    spool.close()


def test_upload_that_has_ended_leaves_no_file_and_one_without_a_folder_takes_no_place(temporary: Path) -> None:
    spool = Spool()
    arrivals = Arrivals(1, spool.new_folder)
    arrival = arrivals.begin(None)
    file = ArrivingFile(arrival.folder / "1")
    for data in (b"ab", b"c"):
        file.write(data)
    assert file.path.read_bytes() == b"abc"
    arrival.end()
    assert list(spool.folder.iterdir()) == []
    spool.close()
    for _ in range(2):
        with pytest.raises(UploadsFullError):
            arrivals.begin(None)
