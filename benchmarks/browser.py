"""A real browser and a real service for it, for benchmarks, browser tests and the pictures of the documentation."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
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
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)
START_S: Final = 180.0
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
def served(environment: Mapping[str, str] | None = None) -> Iterator[str]:
    """The service in a process and with a database of its own, on a free port; its address without a slash at the end.

    Raises RuntimeError with what it said where it does not come up.
    """
    with tempfile.TemporaryDirectory(prefix="joulepath-web-") as scratch:
        port = _free_port()
        url = f"http://127.0.0.1:{port}"
        log = Path(scratch) / "service.log"
        own = {"JOULEPATH_DATABASE_URL": f"sqlite:///{scratch}/joulepath.sqlite", **(environment or {})}
        command = [sys.executable, "-m", "app.cli", "serve", "--port", str(port)]
        with log.open("w", encoding="utf-8") as said:
            process = subprocess.Popen(
                command, cwd=ROOT, env={**os.environ, **own}, stdout=said, stderr=subprocess.STDOUT
            )
        try:
            _wait_until_ready(url, process, log)
            yield url
        finally:
            process.terminate()
            try:
                process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _wait_until_ready(url: str, process: subprocess.Popen[bytes], log: Path) -> None:
    until = time.monotonic() + START_S
    while time.monotonic() < until:
        if process.poll() is not None:
            raise RuntimeError(f"the service ended at once:\n{log.read_text(encoding='utf-8')}")
        try:
            with urllib.request.urlopen(f"{url}/readyz", timeout=5.0):
                return
        except (urllib.error.URLError, OSError):
            time.sleep(0.05)
    raise RuntimeError(f"the service was not ready within {START_S:g} s:\n{log.read_text(encoding='utf-8')}")


def _free_port() -> int:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return int(listening.getsockname()[1])
