"""A browser, the service that it talks to, and pages that fail their test on any error of their own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import pytest
from playwright.sync_api import expect

from benchmarks.browser import ROOT
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from tests.app.recorded import write_winter
from tests.web.diagnosed import done
from tests.web.map_page import MapPage
from tests.web.road_drives import write_road_drives
from tests.web.served import serving

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, BrowserContext

    from tests.web.served import ServedMap

CAR: Final = "hyundai-kona-64"
PATIENCE_MS: Final = 20_000

expect.set_options(timeout=PATIENCE_MS)


class Visit(Protocol):
    """Opens pages in contexts of their own."""

    def __call__(
        self, query: str = "", *, width: int = 1280, height: int = 800, dark: bool = False, opened: bool = True
    ) -> MapPage:
        """A page of that size; its address ends in the query. opened: False to do that later."""


@pytest.fixture(scope="session")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of recordings with a subfolder `winter`: ten drives with a heater that the model does not know."""
    folder = tmp_path_factory.mktemp("recordings")
    write_winter(folder / "winter", _car())
    return folder


def _car() -> Vehicle:
    car = load_vehicle(ROOT / f"data/vehicles/{CAR}.toml")
    assert isinstance(car, Vehicle)
    return car


@pytest.fixture(scope="session")
def served(tmp_path_factory: pytest.TempPathFactory, recordings: Path, chromium: str) -> Iterator[ServedMap]:
    """The service on the bundled graphs and vehicles, with an empty database."""
    with serving(tmp_path_factory.mktemp("served"), JOULEPATH_RECORDINGS_DIR=str(recordings)) as running:
        yield running


@pytest.fixture(scope="session")
def elsewhere(served: ServedMap, recordings: Path) -> dict[str, Any]:
    """A diagnosis of drives on another graph than the default one."""
    ends = {"start": [-71.25, -29.90], "goal": [-71.33, -29.96], "soc": 0.8, "graph": "coquimbo", "links": False}
    line = served.ask("/route", ends)["routes"][0]["geometry"]["coordinates"]
    write_road_drives(recordings / "road", _car(), line)
    found = done(served, recordings=["road/*.csv"], vehicle=CAR, graph="coquimbo")
    assert found["warnings"] == []
    return found


@pytest.fixture
def visit(browser: Browser, served: ServedMap) -> Iterator[Visit]:
    """Opens watched pages; at the end of the test, none of them may have shown a fault."""
    contexts: list[BrowserContext] = []
    pages: list[MapPage] = []

    def opened_page(
        query: str = "", *, width: int = 1280, height: int = 800, dark: bool = False, opened: bool = True
    ) -> MapPage:
        options: dict[str, Any] = {"color_scheme": "dark" if dark else "light", "reduced_motion": "reduce"}
        context = browser.new_context(viewport={"width": width, "height": height}, locale="en-GB", **options)
        context.set_default_timeout(PATIENCE_MS)
        contexts.append(context)
        made = MapPage(context.new_page(), served.address)
        pages.append(made)
        if opened:
            made.open(query)
        return made

    yield opened_page
    for context in contexts:
        context.close()
    faults = [fault for page in pages for fault in page.faults]
    assert not faults, "\n".join(faults)


@pytest.fixture
def page(visit: Visit) -> MapPage:
    """The first page, with the map drawn."""
    return visit()
