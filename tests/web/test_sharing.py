"""The address holds what was chosen: a link that is sent on shows the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

from playwright.sync_api import expect

if TYPE_CHECKING:
    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage


def choose_much(page: MapPage) -> None:
    """Choose something in every panel."""
    page.page.get_by_label("Vehicle", exact=True).select_option("bmw-i3-60ah")
    page.page.get_by_label("Charge now").fill("90")
    page.page.get_by_label("Reserve").fill("5")
    page.page.get_by_text("Weather and load").click()
    page.page.get_by_role("radio", name="Wet").check()
    page.page.get_by_label("Payload").fill("120")
    page.page.get_by_role("button", name="Units: kilometres").click()
    page.type_place("Start", (43.872, -36.433))
    with page.asking("/route"):  # a later choice would take the question back
        page.type_place("Goal", (43.8, -35.9))


def test_shared_link_opens_the_same_in_another_browser(visit: Visit):
    page = visit()
    choose_much(page)
    with page.asking("/route"):
        page.page.get_by_role("button", name="Via point").click()
    with page.asking("/route") as here:
        page.type_place("Via point 1", (43.77, -36.1))
    route = page.page.get_by_role("radio", name="Fastest:")
    route.locator("..").click()
    page.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.page.get_by_role("button", name="Share").click()
    expect(page.page.locator("#toast")).to_be_visible()
    link = page.page.evaluate("navigator.clipboard.readText()")
    assert link == page.page.url

    other = visit(link.removeprefix(f"{page.address}/"))
    shown = other.page.get_by_role("radio", name="Fastest:")
    expect(shown).to_be_checked()
    assert other.sent[-1] == page.sent[-1]
    assert other.sent[-1][1]["conditions"] == {"road": "wet", "payload_kg": 120}
    assert other.sent[-1][1]["vehicle"] == here.body["vehicle"] == "bmw-i3-60ah"
    assert shown.get_attribute("aria-label") == route.get_attribute("aria-label")
    assert other.page.url == page.page.url
    assert other.place("Via point 1") == (43.77, -36.1)


def test_address_with_nonsense_opens_the_defaults(visit: Visit):
    page = visit(opened=False)
    page.page.goto(
        f"{page.address}/?tab=moon&soc=900&start=here&via=;;&bands=99&conditions=road:lava,ambient_c:900&units=furlong"
    )
    page.drawn()
    expect(page.page.get_by_role("tab", name="Route")).to_have_attribute("aria-selected", "true")
    expect(page.page.get_by_label("Charge now")).to_have_value("80")
    expect(page.place_box("Start")).to_have_value("")
    assert not page.sent
