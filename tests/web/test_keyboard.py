"""A whole journey without a mouse, announced to those who listen."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from playwright.sync_api import expect

if TYPE_CHECKING:
    from tests.web.map_page import MapPage

MOST_STEPS = 60


def tab_to(page: MapPage, name: str) -> None:
    """Press Tab until the element with this accessible name has the focus."""
    keyboard = page.page.keyboard
    for _ in range(MOST_STEPS):
        keyboard.press("Tab")
        if re.search(name, focused_name(page)):
            return
    raise AssertionError(f"Tab never led to {name}")


def focused_name(page: MapPage) -> str:
    """Accessible name of what has the focus: its aria-label, its label or its text; empty where nothing has it."""
    found: str = page.page.evaluate(
        """() => {
          const at = document.activeElement;
          const labels = [...(at.labels ?? [])].map((one) => one.textContent).join(" ");
          return at === document.body ? "" : at.getAttribute("aria-label") || labels || at.textContent;
        }"""
    )
    return found


def test_journey_is_planned_with_the_keyboard_alone(page: MapPage):
    keyboard = page.page.keyboard
    tab_to(page, "Start, latitude")
    keyboard.type("43.872, -36.433")
    tab_to(page, "Goal, latitude")
    keyboard.type("43.697, -35.19")
    with page.asking("/route") as first:
        keyboard.press("Enter")
    assert first.body["soc"] == 0.8
    tab_to(page, "^Charge now")
    with page.asking("/route") as more:
        for _ in range(5):
            keyboard.press("ArrowRight")
        expect(page.page.get_by_label("Charge now")).to_have_value("85")
    assert more.body["soc"] > 0.8
    expect(page.page.locator("#routes")).to_have_attribute("aria-busy", "false")
    tab_to(page, "^Eco:")
    keyboard.press("ArrowDown")
    expect(page.page.get_by_role("radio", name="Balanced:")).to_be_checked()
    tab_to(page, "Place along the route")
    keyboard.press("PageUp")
    expect(page.page.get_by_role("slider", name="Place along the route")).not_to_have_attribute("aria-valuenow", "0.0")


def test_focus_stays_where_it_was_when_answers_come(page: MapPage):
    page.type_place("Start", (43.872, -36.433))
    with page.asking("/route"):
        page.type_place("Goal", (43.697, -35.19))
    expect(page.page.get_by_role("radio", name="Eco:")).to_be_attached()
    slider = page.page.get_by_label("Charge now")
    slider.focus()
    with page.asking("/route"):
        page.page.keyboard.press("ArrowLeft")
    expect(page.page.locator("#routes")).to_have_attribute("aria-busy", "false")
    expect(slider).to_be_focused()


def test_first_tab_stop_skips_the_map(page: MapPage):
    page.page.keyboard.press("Tab")
    expect(page.page.locator("a.skip")).to_be_focused()
    page.page.keyboard.press("Enter")
    expect(page.page.locator("#panel")).to_be_focused()


def test_results_are_announced_in_a_live_region(page: MapPage):
    announcer = page.page.locator("#announcer")
    assert announcer.get_attribute("aria-live") == "polite"
    page.type_place("Start", (43.872, -36.433))
    expect(announcer).to_contain_text("km² with at least 10 % left")
    page.type_place("Goal", (43.697, -35.19))
    expect(announcer).to_contain_text(re.compile(r"Eco: [\d.]+ kWh, .* arrives with \d+ %"))
