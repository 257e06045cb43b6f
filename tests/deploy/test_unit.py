"""The unit of systemd, as systemd itself reads it."""

from __future__ import annotations

import shutil
import subprocess
from typing import TYPE_CHECKING

from tests.deploy.files import UNIT, text_of, unit

if TYPE_CHECKING:
    from pathlib import Path


def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path: Path) -> None:
    """Its program is put where the test may write."""
    analyze = shutil.which("systemd-analyze")
    assert analyze is not None, "no systemd-analyze: install systemd"
    program = tmp_path / "bin" / "joulepath"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\n", encoding="utf-8")
    program.chmod(0o755)
    copy = tmp_path / UNIT.name
    copy.write_text(text_of(UNIT).replace("/opt/joulepath", str(tmp_path)), encoding="utf-8")
    checked = subprocess.run([analyze, "verify", str(copy)], capture_output=True, text=True, check=False)
    assert (checked.returncode, checked.stdout + checked.stderr) == (0, "")
    exposed = subprocess.run(
        [analyze, "security", "--offline=true", "--threshold=20", str(copy)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert exposed.returncode == 0, exposed.stdout + exposed.stderr


def test_unit_is_hardened_restarted_and_reloaded() -> None:
    found = unit()
    assert found["ProtectSystem"] == ["strict"]
    assert found["ExecReload"] == ["/bin/kill -HUP $MAINPID"]
    assert found["Restart"] == ["on-failure"]
    assert found["NoNewPrivileges"] == ["yes"]
    assert found["MemoryMax"]
