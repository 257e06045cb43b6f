"""Clients that are generated from the OpenAPI document drive the service, in Python and in TypeScript."""

from __future__ import annotations

import json
import os
import shutil
import sys
from typing import TYPE_CHECKING, Any

import pytest

from tests.app.clients.conftest import HERE, run

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.testclient import TestClient


@pytest.fixture(scope="module")
def expected(client: TestClient) -> dict[str, Any]:
    """What the scripts print, asked for without a client of their kind."""
    trip = {"start": {"lat": 46.5, "lon": 8.003}, "goal": {"lat": 46.518, "lon": 8.02}, "soc": 0.4, "graph": "grid"}
    route = client.post("/route", json=trip).json()["routes"][0]
    return {
        "graphs": sorted(graph["name"] for graph in client.get("/graphs").json()["graphs"]),
        "energy_kwh": route["energy_kwh"],
        "points": len(route["geometry"]["coordinates"]),
        "bands": 4,
        "problem": ["unknown_graph", 404],
    }


def test_python_client_drives_the_service(
    address: str, document: Path, generators: Path, tmp_path: Path, expected: dict[str, Any]
) -> None:
    programs = generators / "python" / "bin"
    said = run(
        [programs / "openapi-python-client", "generate", "--path", document, "--config", HERE / "python/config.yaml",
         "--output-path", tmp_path / "client", "--fail-on-warning"],
        tmp_path,
        PATH=f"{programs}:{os.environ['PATH']}",
    )  # fmt: skip
    assert "warning" not in said.lower()
    found = run([programs / "python", HERE / "python/drive.py", address], tmp_path, PYTHONPATH=str(tmp_path / "client"))
    assert json.loads(found) == expected
    run(
        [sys.executable, "-m", "mypy", "--strict", "--python-executable", programs / "python",
         "--config-file", os.devnull, "--cache-dir", tmp_path / "cache", "--follow-imports", "silent",
         HERE / "python/drive.py"],
        tmp_path,
        MYPYPATH=str(tmp_path / "client"),
        PATH=os.environ["PATH"],
    )  # fmt: skip


def test_typescript_client_drives_the_service(
    address: str, document: Path, generators: Path, tmp_path: Path, expected: dict[str, Any]
) -> None:
    for name in ("package.json", "tsconfig.json", "drive.ts", "wrong.ts"):
        shutil.copy(HERE / "typescript" / name, tmp_path)
    (tmp_path / "node_modules").symlink_to(generators / "node_modules")
    programs = generators / "node_modules" / ".bin"
    flags = ("--default-non-nullable", "false")  # what has a default may be left out of requests
    run([programs / "openapi-typescript", document, *flags, "--output", tmp_path / "joulepath.d.ts"], tmp_path)
    run([programs / "tsc", "--project", tmp_path], tmp_path)  # which fails, too, where wrong.ts is not refused
    assert json.loads(run(["node", tmp_path / "built" / "drive.js", address], tmp_path)) == expected
