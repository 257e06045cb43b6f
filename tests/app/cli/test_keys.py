"""The commands on keys, and a server that refuses to be reached without them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from app.access.keys import KeyRing
from app.access.roles import Role
from app.cli.main import cli
from tests.app.server_process import ROOT, server_process

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "keys.json"
    monkeypatch.setenv("JOULEPATH_KEYS_FILE", str(path))
    return path


def run(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(cli, list(arguments))
    return result.exit_code, result.stdout, result.stderr


def test_key_is_printed_once_listed_without_its_hash_and_removed(file: Path) -> None:
    code, printed, _ = run("keys", "add", "anna", "--role", "write", "--daily-quota", "500")
    assert code == 0
    known = KeyRing(file).known(printed.strip())
    assert known is not None
    assert known.role is Role.WRITE
    assert run("keys", "add", "bert")[0] == 0
    _, listed, _ = run("keys", "list", "--json")
    assert [(key["name"], key["role"], key["daily_quota"]) for key in json.loads(listed)] == [
        ("anna", "write", 500),
        ("bert", "read", None),
    ]
    assert known.hash not in listed
    assert "anna" in run("keys", "list")[1]
    assert run("keys", "remove", "anna")[0] == 0
    assert KeyRing(file).known(printed.strip()) is None


def test_wrong_names_and_files_end_in_one_line(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for arguments in (("add", "two words"), ("remove", "nobody"), ("list", "--file", str(file.parent))):
        code, _, said = run("keys", *arguments)
        assert code == 2
        assert "Traceback" not in said
        assert said.strip()
    monkeypatch.delenv("JOULEPATH_KEYS_FILE")
    code, _, said = run("keys", "list")
    assert code == 2
    assert "JOULEPATH_KEYS_FILE" in said


def test_server_that_others_can_reach_does_not_start_without_keys(tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
    command = [sys.executable, "-m", "app.cli", "serve", "--host", "0.0.0.0", "--port", "0"]
    ended = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=120, check=False)
    assert ended.returncode == 2
    assert b"JOULEPATH_KEYS_FILE" in ended.stderr
    assert b"JOULEPATH_OPEN_WITHOUT_KEYS=1" in ended.stderr
    assert b"Traceback" not in ended.stderr


def test_served_service_demands_keys_knows_its_names_and_takes_new_keys_at_once(
    tmp_path: Path, graph_dir: Path
) -> None:
    path = str(tmp_path / "keys.json")
    assert run("keys", "add", "anna", "--file", path)[0] == 0
    with server_process(tmp_path, graph_dir, JOULEPATH_KEYS_FILE=path) as running:
        assert running.get("/readyz").startswith(b"HTTP/1.1 200")
        assert running.get("/vehicles").startswith(b"HTTP/1.1 401")
        key = run("keys", "add", "bert", "--file", path)[1].strip()
        headers = f"Authorization: Bearer {key}\r\n"
        while not running.get("/vehicles", headers).startswith(b"HTTP/1.1 200"):
            assert running.process.poll() is None
        foreign = running.ask(b"GET /vehicles HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n")
        assert foreign.startswith(b"HTTP/1.1 421")
