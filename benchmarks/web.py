"""The web map in a real browser: when the map is drawn, and what the page weighs."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from playwright.sync_api import sync_playwright
from rich.console import Console
from rich.table import Table

from benchmarks.browser import VIEWPORT, launched, served
from benchmarks.machine import this_machine

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page, Request

DRAWN: Final = '#map[data-state="drawn"]'
TARGET_S: Final = 2.0
WAIT_MS: Final = 60_000
# kinds of what is fetched, by the beginning or the end of the path; the first that fits counts
KINDS: Final = (
    ("MapLibre GL", lambda path: path.startswith("/web/lib/")),
    ("page, styles, icon", lambda path: path == "/" or path.endswith((".css", ".svg", ".html"))),
    ("modules", lambda path: path.endswith(".js")),
    ("road tiles", lambda path: path.endswith(".mvt")),
    ("height tiles", lambda path: path.endswith(".png")),
    ("answers of the API", lambda path: True),
)


@dataclass(frozen=True, slots=True)
class Weight:
    """What one kind of content takes: requests, bytes over the wire, bytes when unpacked."""

    kind: str
    requests: int
    wire_bytes: int
    content_bytes: int


@dataclass(frozen=True, slots=True)
class PageVisit:
    """One visit of the page. drawn_s: from the navigation's start until the map stands still with all of its tiles."""

    drawn_s: float
    weights: tuple[Weight, ...]


@dataclass(frozen=True, slots=True)
class WebFigures:
    """ready_s: from the start of the service's process until it answers, kernels compiled before.

    first: the first visit after that, with nothing cached anywhere. fresh: visits of browsers that know nothing, the
    service's tiles made. again: visits of a browser that was there before.
    """

    graph: str
    ready_s: float
    first: PageVisit
    fresh: tuple[PageVisit, ...]
    again: tuple[PageVisit, ...]


def measure_web(repeat: int) -> WebFigures:
    """Start the service, and visit the default graph's map; raises NoBrowserError."""
    with sync_playwright() as playwright, launched(playwright) as browser:
        began = time.perf_counter()
        with served() as address:
            return measured_visits(browser, address, repeat, time.perf_counter() - began)


def measured_visits(browser: Browser, address: str, repeat: int, ready_s: float) -> WebFigures:
    """Visits of a running service; ready_s: what its start took."""
    first = _fresh_visit(browser, address)
    fresh = tuple(_fresh_visit(browser, address) for _ in range(repeat))
    with _context(browser) as context:
        _visit(context, address)
        again = tuple(_visit(context, address) for _ in range(repeat))
        graph = str(context.request.get(f"{address}/graphs").json()["default"])
    return WebFigures(graph, ready_s, first, fresh, again)


@contextmanager
def _context(browser: Browser) -> Iterator[BrowserContext]:
    context = browser.new_context(viewport=VIEWPORT)
    try:
        yield context
    finally:
        context.close()


def _fresh_visit(browser: Browser, url: str) -> PageVisit:
    with _context(browser) as context:
        return _visit(context, url)


def _visit(context: BrowserContext, url: str) -> PageVisit:
    page = context.new_page()
    fetched = _Fetched(page)
    page.goto(url)
    page.wait_for_selector(DRAWN, timeout=WAIT_MS)
    drawn_ms = page.evaluate('performance.getEntriesByName("map-drawn")[0].startTime')
    visit = PageVisit(drawn_ms / 1000.0, fetched.weights())
    page.close()
    return visit


class _Fetched:
    """What a page and its workers fetch."""

    def __init__(self, page: Page) -> None:
        self._finished: list[Request] = []
        page.on("requestfinished", lambda request: self._finished.append(request))

    def weights(self) -> tuple[Weight, ...]:
        """By kind; what the browser's cache answered takes nothing."""
        sums = {kind: [0, 0, 0] for kind, _ in KINDS}
        for request in self._finished:
            if not request.url.startswith("http"):
                continue
            path = urlsplit(request.url).path
            kind = next(kind for kind, fits in KINDS if fits(path))
            sizes, response = request.sizes(), request.response()
            content = len(response.body()) if response is not None and response.status == 200 else 0
            for i, value in enumerate((1, sizes["responseHeadersSize"] + sizes["responseBodySize"], content)):
                sums[kind][i] += max(value, 0)
        return tuple(Weight(kind, *values) for kind, values in sums.items())


def times_rows(figures: WebFigures) -> list[tuple[str, ...]]:
    """One line a kind of visit: until the map is drawn [s], with spread, and what goes over the wire [kB]."""
    rows = []
    for name, visits in (
        ("first after the service's start", (figures.first,)),
        ("new browser", figures.fresh),
        ("same browser again", figures.again),
    ):
        drawn = [visit.drawn_s for visit in visits]
        wire = statistics.median(sum(weight.wire_bytes for weight in visit.weights) for visit in visits)
        spread = f"{min(drawn):.2f}–{max(drawn):.2f}" if len(drawn) > 1 else ""
        rows.append((name, f"{statistics.median(drawn):.2f}", spread, f"{wire / 1000:.0f}"))
    return rows


def weight_rows(figures: WebFigures) -> list[tuple[str, ...]]:
    """One line a kind of content of the first visit, and of one that comes again."""
    rows = []
    for first, again in zip(figures.first.weights, figures.again[-1].weights, strict=True):
        sizes = (first.content_bytes, first.wire_bytes, again.wire_bytes)
        rows.append((first.kind, str(first.requests), *(f"{size / 1000:.0f}" for size in sizes)))
    totals = [sum(int(row[i]) for row in rows) for i in range(1, 5)]
    return [*rows, ("all", *map(str, totals))]


def print_web(repeat: int, as_json: bool) -> None:
    """Measure, and print tables or one JSON object; raises NoBrowserError."""
    machine = this_machine()
    figures = measure_web(repeat)
    if as_json:
        print(json.dumps({"machine": asdict(machine), "web": asdict(figures)}, indent=1))
        return
    console = Console(highlight=False)
    console.print(
        f"{machine.cpu}, {machine.cores} cores, load {machine.load:.2f}; Chromium draws without a graphics card"
    )
    console.print(f"graph {figures.graph}; the service answers {figures.ready_s:.1f} s after its start")
    console.print(_table("until the map is drawn", ("visit", "s", "from–to", "kB over the wire"), times_rows(figures)))
    slowest_s = max(figures.first.drawn_s, *(visit.drawn_s for visit in figures.fresh))
    verdict = "met" if slowest_s <= TARGET_S else "MISSED"
    console.print(f"target: every first map within {TARGET_S:g} s: {slowest_s:.2f} s, {verdict}")
    console.print(_table("page weight", ("what", "requests", "kB", "kB wire", "kB wire again"), weight_rows(figures)))


def _table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    table = Table(title=title, title_justify="left")
    for i, name in enumerate(head):
        table.add_column(name, justify="right" if i else "left")
    for row in rows:
        table.add_row(*row)
    return table
