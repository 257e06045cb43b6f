"""The pictures of the web map in README.md, taken in a real browser; run as `python -m docs.draw_web` to renew them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Final

from PIL import Image
from playwright.sync_api import sync_playwright

from benchmarks.browser import VIEWPORT, launched, served
from benchmarks.web import DRAWN, WAIT_MS

if TYPE_CHECKING:
    from playwright.sync_api import Page

IMAGES: Final = Path(__file__).resolve().parent / "images"
JOURNEY: Final = "start=43.872,-36.433&goal=43.697,-35.19&soc=50"
PICTURES: Final = {
    "web-route.png": f"?{JOURNEY}",
    "web-charging.png": f"?{JOURNEY.replace('soc=50', 'soc=25')}&charge=1&departure=2026-11-30T08:15&sure=90",
    "web-range.png": "?tab=range&start=43.872,-36.433&soc=50",
}
SCROLLED_TO: Final = {"web-charging.png": "#routes .route-cards"}  # what begins the panel
FURTHER: Final = "#routes .busy-line"  # while further plans are asked for
SETTLE_MS: Final = 1500  # after the answer is there: the map moves to it and fetches its tiles


def draw() -> None:
    """Take every picture anew."""
    with served() as url, sync_playwright() as playwright, launched(playwright) as browser:
        for name, query in PICTURES.items():
            context = browser.new_context(viewport=VIEWPORT, reduced_motion="reduce")
            page = context.new_page()
            page.goto(f"{url}/{query}")
            _settle(page)
            if name in SCROLLED_TO:
                page.wait_for_timeout(SETTLE_MS)
                page.wait_for_selector(FURTHER, state="detached", timeout=WAIT_MS)
                page.locator(SCROLLED_TO[name]).evaluate("shown => shown.scrollIntoView()")
                page.locator(SCROLLED_TO[name]).evaluate("shown => shown.closest('main').scrollBy(0, -110)")
            with Image.open(io.BytesIO(page.screenshot())) as taken:
                taken.convert("RGB").save(IMAGES / name, optimize=True)
            context.close()


def _settle(page: Page) -> None:
    page.wait_for_selector(DRAWN, timeout=WAIT_MS)
    page.wait_for_selector("#legend:not([hidden])", timeout=WAIT_MS)
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(SETTLE_MS)


if __name__ == "__main__":
    draw()
