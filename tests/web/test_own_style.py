"""The map on the style of a tile server of one's own, and the benchmark that visits the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from benchmarks.browser import served
from benchmarks.web import measured_visits, times_rows, weight_rows
from tests.web.map_page import MapPage

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser

    from tests.web.served import ServedMap

STYLE_PATH: Final = "/styles/plain.json"
PINK: Final = {
    "version": 8,
    "sources": {},
    "layers": [{"id": "ground", "type": "background", "paint": {"background-color": "#ff00aa"}}],
}


def test_named_style_is_drawn_below_the_area_instead_of_the_graph(browser: Browser, tmp_path: Path) -> None:
    with served(tmp_path, JOULEPATH_MAP_STYLE_URL=STYLE_PATH) as address:
        context = browser.new_context()
        page = MapPage(context.new_page(), address)
        page.page.route(f"{address}{STYLE_PATH}", lambda route: route.fulfill(json=PINK))
        page.open("?tab=range&start=43.872,-36.433&soc=30")
        picture = page.picture()
        context.close()
    assert not page.faults
    pink = (picture[..., 0] > 0.9) & (picture[..., 1] < 0.1) & (picture[..., 2] > 0.6)
    assert 0.2 < pink.mean() < 0.99  # ground all around, the area over it


def test_benchmark_counts_every_kind_of_content_and_less_when_it_comes_again(
    browser: Browser, served: ServedMap
) -> None:
    figures = measured_visits(browser, served.address, repeat=1, ready_s=1.0)
    assert figures.graph == "highlands"
    for weight in figures.first.weights:
        assert weight.requests > 0, weight.kind
        assert weight.wire_bytes > 0, weight.kind
    assert sum(weight.wire_bytes for weight in figures.again[0].weights) < 0.1 * sum(
        weight.wire_bytes for weight in figures.first.weights
    )
    assert len(times_rows(figures)) == 3
    assert weight_rows(figures)[-1][0] == "all"
