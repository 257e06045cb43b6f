"""Front ends that other people have written, on pages of another origin than the service's."""

from __future__ import annotations

import json
import os
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

import pytest

from app.http.web import library_folder
from benchmarks.browser import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

PACKAGES: Final = ROOT / ".venv/clients/node_modules"
FOLDERS: Final = {"lib": PACKAGES, "maplibre": library_folder(), "pages": Path(__file__).with_name("pages")}


class _Files(SimpleHTTPRequestHandler):
    """Files of the packages and the pages."""

    def translate_path(self, path: str) -> str:
        folder, _, rest = path.partition("?")[0].lstrip("/").partition("/")
        return str(FOLDERS[folder] / rest) if folder in FOLDERS and ".." not in rest else os.devnull

    def log_message(self, format: str, *args: object) -> None:
        pass


@contextmanager
def served_pages() -> Iterator[str]:
    """The address of a server with the pages, which is another origin than that of the service."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Files)) as server:
        thread = Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/pages"
        finally:
            server.shutdown()
            thread.join()


def packages() -> Path:
    """The folder of the packages; skips where they are missing, except in CI."""
    if not (PACKAGES / "leaflet-routing-machine").is_dir():
        reason = "there are no front ends in .venv/clients; `make clients` brings them"
        if os.environ.get("CI"):
            pytest.fail(f"{reason}. CI must have them")
        pytest.skip(reason)
    return PACKAGES


def page_address(pages: str, name: str, service: str, places: Sequence[Sequence[float]] = (), **asked: str) -> str:
    """The address of a page that asks a service."""
    sent = {"service": service, "places": json.dumps([list(place) for place in places]), **asked}
    return f"{pages}/{name}.html?{urlencode(sent)}"
