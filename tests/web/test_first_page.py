"""What a person sees first, and the frame around it: pickers, units, colours, sizes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.web.map_page import PHONE, check_shown

if TYPE_CHECKING:
    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap


def test_first_page_shows_roads_pickers_and_what_to_do(page: MapPage, served: ServedMap):
    shown = page.page
    expect(shown).to_have_title(re.compile("joulepath"))
    expect(shown.locator("#map-hint")).to_have_text("Click the map to set start")
    expect(shown.get_by_role("tab", name="Route")).to_have_attribute("aria-selected", "true")
    graphs, vehicles = served.ask("/graphs"), served.ask("/vehicles")
    graph_picker, vehicle_picker = shown.get_by_label("Road network"), shown.get_by_label("Vehicle", exact=True)
    expect(graph_picker.locator("option")).to_have_count(len(graphs["graphs"]))
    expect(graph_picker).to_have_value(graphs["default"])
    expect(vehicle_picker.locator("option")).to_have_count(len(vehicles["vehicles"]))
    expect(vehicle_picker).to_have_value(vehicles["default"])
    usable_kwh = served.ask(f"/vehicles/{vehicles['default']}")["usable_capacity_kwh"]
    check_shown(shown.locator("#vehicle").inner_text(), "kWh usable", usable_kwh)
    expect(shown.locator("#attribution")).to_contain_text("Synthetic region")
    assert not page.sent


def test_first_page_draws_roads_over_shaded_ground(page: MapPage):
    colours, counts = np.unique(np.round(page.picture() * 255).reshape(-1, 3), axis=0, return_counts=True)
    orange = (colours[:, 0] - colours[:, 2] > 40) & (colours[:, 0] > 150)
    assert 0.005 < counts[orange].sum() / counts.sum() < 0.2, "roads"
    grey = np.ptp(colours, axis=1) < 25
    assert np.unique(colours[grey].mean(axis=1)).size > 30, "shading"


def test_picked_graph_is_drawn_in_place_of_the_other(page: MapPage):
    before = page.picture()
    page.page.get_by_label("Road network").select_option("coquimbo")
    expect(page.page.locator("#attribution")).to_contain_text("OpenStreetMap")
    page.drawn()
    assert page.address_query() == {"graph": "coquimbo"}
    assert page.changed_frac(before, 0.02) > 0.02
    page.page.get_by_label("Road network").select_option("highlands")
    page.drawn()
    assert page.address_query() == {}


def test_picked_vehicle_is_asked_for_and_shown(page: MapPage, served: ServedMap):
    page.page.get_by_label("Vehicle", exact=True).select_option("bmw-i3-60ah")
    check_shown(
        page.page.locator("#vehicle").inner_text(),
        "kWh usable",
        served.ask("/vehicles/bmw-i3-60ah")["usable_capacity_kwh"],
    )
    with page.asking("/range") as exchange:
        page.type_place("Start", (43.872, -36.433))
    assert exchange.body["vehicle"] == "bmw-i3-60ah"


def test_tabs_are_walked_with_arrow_keys(page: MapPage):
    tabs = [page.page.get_by_role("tab", name=name) for name in ("Route", "Range", "Diagnosis")]
    tabs[0].focus()
    for tab, others in ((tabs[1], "ArrowRight"), (tabs[2], "ArrowRight"), (tabs[0], "ArrowRight"), (tabs[2], "End")):
        page.page.keyboard.press(others)
        expect(tab).to_be_focused()
        expect(tab).to_have_attribute("aria-selected", "true")
    assert page.address_query() == {"tab": "diagnosis"}
    expect(page.page.locator("#pane-diagnosis")).to_be_visible()
    expect(page.page.locator("#pane-plan")).to_be_hidden()


def test_dark_mode_follows_the_system_and_the_button_remembers(visit: Visit):
    dark = visit(dark=True)
    assert dark.picture().mean() < 0.35
    expect(dark.page.locator("html")).to_have_attribute("data-theme", "dark")
    dark.page.get_by_role("button", name="Use light colours").click()
    dark.drawn()
    assert dark.picture().mean() > 0.7
    dark.page.reload()
    dark.drawn()
    expect(dark.page.locator("html")).to_have_attribute("data-theme", "light")


@pytest.mark.parametrize("query", ["", "?tab=range&start=43.872,-36.433", "?tab=diagnosis"])
def test_phone_shows_everything_without_scrolling_sideways(visit: Visit, query: str):
    phone = visit(query, **PHONE)
    width_px = phone.page.evaluate("document.documentElement.scrollWidth")
    assert width_px <= PHONE["width"]
    map_box, panel_box = (phone.page.locator(name).bounding_box() for name in (".map-area", "#panel"))
    assert map_box
    assert panel_box
    assert map_box["width"] == panel_box["width"] == PHONE["width"]
    assert map_box["height"] > 200


def test_panel_and_map_stand_side_by_side_on_a_wide_screen(page: MapPage):
    panel_box, map_box = (page.page.locator(name).bounding_box() for name in ("#panel", "#map"))
    assert panel_box
    assert map_box
    assert (panel_box["x"], panel_box["width"]) == (0, 420)
    assert (map_box["x"], map_box["y"], map_box["width"], map_box["height"]) == (420, 0, 860, 800)
