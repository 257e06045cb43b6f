"""A real browser and a real service for it, for benchmarks, browser tests and the pictures of the documentation."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright, ViewportSize

ROOT: Final = Path(__file__).resolve().parent.parent
CHROMIUM_NAMES: Final = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHROMIUM_VARIABLE: Final = "JOULEPATH_CHROMIUM"
VIEWPORT: Final[ViewportSize] = {"width": 1280, "height": 800}
# no sandbox: it can't be had as root; the rest keeps it from asking hosts outside, and draws WebGL without a card
LAUNCH_FLAGS: Final = (
    "--no-sandbox",
    "--no-first-run",
    "--no-proxy-server",
    "--disable-quic",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)
LISTENING: Final = re.compile(r"Uvicorn running on (http://127\.0\.0\.1:\d+)")
START_S: Final = 300.0  # a first start compiles
STOP_S: Final = 15.0


class NoBrowserError(RuntimeError):
    """No Chromium on this machine."""

    def __init__(self) -> None:
        super().__init__(
            f"no Chromium found (looked for {', '.join(CHROMIUM_NAMES)}); install the package chromium, "
            f"or name the program in {CHROMIUM_VARIABLE}"
        )


def chromium_path() -> str:
    """The browser's program; raises NoBrowserError."""
    given = os.environ.get(CHROMIUM_VARIABLE)
    found = given or next((path for name in CHROMIUM_NAMES if (path := shutil.which(name))), None)
    if not found:
        raise NoBrowserError
    return found


@contextmanager
def launched(playwright: Playwright) -> Iterator[Browser]:
    """A headless browser; raises NoBrowserError."""
    browser = playwright.chromium.launch(executable_path=chromium_path(), args=list(LAUNCH_FLAGS))
    try:
        yield browser
    finally:
        browser.close()


@contextmanager
def served(folder: Path | None = None, **settings: str) -> Iterator[str]:
    """The service in a process and with a database of its own, on a free port; its address without a slash at the end.

    folder: for its database and log, a temporary one by default. settings: by their names in the environment; those of
    this process' environment don't count. Raises RuntimeError with what it said where it does not come up.
    """
    with tempfile.TemporaryDirectory(prefix="joulepath-web-") as scratch:
        home = folder or Path(scratch)
        log = home / "service.log"
        environment = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
        environment |= {"JOULEPATH_DATABASE_URL": f"sqlite:///{home / 'joulepath.sqlite'}", **settings}
        command = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
        with log.open("wb") as said:
            process = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=said, stderr=subprocess.STDOUT)
        try:
            yield _address(process, log)
        finally:
            process.terminate()
            try:
                process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _address(process: subprocess.Popen[bytes], log: Path) -> str:
    """Where it listens, as soon as it says so."""
    until = time.monotonic() + START_S
    while time.monotonic() < until and process.poll() is None:
        if listening := LISTENING.search(log.read_text(encoding="utf-8", errors="replace")):
            return listening.group(1)
        time.sleep(0.02)
    said = log.read_text(encoding="utf-8", errors="replace")
    raise RuntimeError(f"the service did not start within {START_S:g} s:\n{said}")
