"""A service on a port of this process, and what generates clients for it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest
import uvicorn

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fastapi import FastAPI

HERE: Final = Path(__file__).resolve().parent
GENERATORS: Final = Path(sys.prefix) / "generators"  # what `make test` puts there
START_S: Final = 30.0


def run(command: Sequence[str | Path], folder: Path, **environment: str) -> str:
    """What a program prints; fails with all that it said."""
    done = subprocess.run(command, cwd=folder, env=environment or None, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session")
def generators() -> Path:
    """The folder of the generators of clients; skips where they are missing, except in CI."""
    if not (GENERATORS / "python").is_dir() or not (GENERATORS / "node_modules").is_dir():
        reason = f"no generators of clients in {GENERATORS}; `make test` brings them where there is npm"
        if os.environ.get("CI"):
            pytest.fail(f"{reason}. CI must have them")
        pytest.skip(reason)
    return GENERATORS


@pytest.fixture(scope="module")
def address(app: FastAPI) -> Iterator[str]:
    """The address of the service on small graphs."""
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="warning", lifespan="on"))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    until = time.monotonic() + START_S
    while not server.started:
        assert thread.is_alive()
        assert time.monotonic() < until
        time.sleep(0.05)
    port = server.servers[0].sockets[0].getsockname()[1]
    yield f"http://127.0.0.1:{port}"
    server.should_exit = True
    thread.join(START_S)


@pytest.fixture(scope="module")
def document(app: FastAPI, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The OpenAPI document as a file."""
    path = tmp_path_factory.mktemp("document") / "openapi.json"
    path.write_text(json.dumps(app.openapi()))
    return path
