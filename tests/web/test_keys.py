"""The map of a service that demands keys: it asks for one, and works with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from app.access.keys import add_key
from app.access.roles import Role
from tests.web.accessible import check_accessible
from tests.web.map_page import MapPage
from tests.web.served import serving

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from playwright.sync_api import Browser

ROUTE = "?start=43.872,-36.433&goal=43.8,-35.9"


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory, chromium: str) -> Iterator[tuple[str, str]]:
    """Address of a service that demands keys, and a key."""
    folder: Path = tmp_path_factory.mktemp("guarded")
    key = add_key(folder / "keys.json", "map", Role.READ)
    with serving(folder, JOULEPATH_KEYS_FILE=str(folder / "keys.json")) as running:
        yield running.address, key


def test_map_asks_for_a_key_says_when_it_is_wrong_and_works_with_the_right_one(
    browser: Browser, guarded: tuple[str, str]
) -> None:
    address, key = guarded
    context = browser.new_context(viewport={"width": 1280, "height": 800}, locale="en-GB", reduced_motion="reduce")
    page = MapPage(context.new_page(), address, refused={401})
    page.page.goto(f"{address}/{ROUTE}")
    box = page.page.get_by_label("Key", exact=True).and_(page.page.locator("input"))
    expect(page.page.get_by_text("This service needs a key.")).to_be_visible()
    expect(page.page.get_by_role("tablist")).to_be_hidden()
    check_accessible(page.page)
    box.fill("jp_0000_wrong")
    box.press("Enter")
    expect(page.page.get_by_role("alert").get_by_text("the key is not known")).to_be_visible()
    box.fill(key)
    page.page.get_by_role("button", name="Use this key").click()
    page.drawn()
    expect(page.page.get_by_role("radio", name="Eco:")).to_be_attached()
    assert key not in page.page.url
    assert page.page.evaluate("Object.values(localStorage).join()").find(key) == -1
    page.refused.add(403)
    page.page.get_by_role("tab", name="Diagnosis").click()
    page.page.locator("input[type=file]").first.set_input_files(
        [{"name": "drive.csv", "mimeType": "text/csv", "buffer": b"time_s,speed_kmh,power_w\n0,0,400\n1,3.6,2500\n"}]
    )
    page.page.get_by_role("button", name="Diagnose").click()
    expect(page.page.get_by_text("the key has the role read")).to_be_visible()
    page.page.get_by_role("button", name="Use another key").click()
    expect(page.page.get_by_text("This service needs a key.")).to_be_visible()
    assert not page.faults, page.faults
    context.close()
