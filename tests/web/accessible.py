"""What axe-core finds on a page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from axe_playwright_python.sync_playwright import Axe

if TYPE_CHECKING:
    from playwright.sync_api import Page

RULES: Final = {
    "resultTypes": ["violations"],
    "runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
}


def check_accessible(page: Page) -> None:
    """No rule of axe-core is broken in what the page shows."""
    results = Axe().run(page, options=RULES)
    assert results.violations_count == 0, results.generate_report()
