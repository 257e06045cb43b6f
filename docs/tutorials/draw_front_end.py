"""The picture of the tutorial on a front end of one's own: `python -m docs.tutorials.draw_front_end` renews it.

The page is the one that the tutorial shows, on another origin than the service's.
"""

from __future__ import annotations

import io
import re
import tempfile
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Final

from PIL import Image
from playwright.sync_api import sync_playwright

from benchmarks.browser import launched, served
from benchmarks.web import WAIT_MS

DOCS: Final = Path(__file__).resolve().parents[1]
PICTURE: Final = DOCS / "images" / "own-front-end.png"
SERVICE: Final = "http://127.0.0.1:8000"
ANSWERED: Final = "() => document.getElementById('said').textContent.includes('kWh')"
SETTLE_MS: Final = 1500  # after the answer is there: tiles come in
COLOURS: Final = 64


def draw() -> None:
    """Take the picture anew."""
    tutorial = (DOCS / "tutorials" / "own-front-end.md").read_text(encoding="utf-8")
    (page_text,) = re.findall(r"^```html\n(.*?)^```$", tutorial, re.MULTILINE | re.DOTALL)
    with tempfile.TemporaryDirectory() as folder:
        files = ThreadingHTTPServer(("127.0.0.1", 0), partial(SimpleHTTPRequestHandler, directory=folder))
        Thread(target=files.serve_forever, daemon=True).start()
        own = f"http://127.0.0.1:{files.server_port}"
        with files, served(JOULEPATH_CORS_ORIGINS=own) as service, sync_playwright() as playwright:
            (Path(folder) / "index.html").write_text(page_text.replace(SERVICE, service), encoding="utf-8")
            with launched(playwright) as browser:
                page = browser.new_page(viewport={"width": 900, "height": 600})
                page.goto(own)
                page.wait_for_function(ANSWERED, timeout=WAIT_MS)
                page.wait_for_load_state("networkidle")
                page.wait_for_timeout(SETTLE_MS)
                with Image.open(io.BytesIO(page.screenshot())) as taken:
                    taken.convert("RGB").quantize(COLOURS).save(PICTURE, optimize=True)
            files.shutdown()


if __name__ == "__main__":
    draw()
