"""The map shows the roads that the drives of a diagnosis are on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from playwright.sync_api import expect

from tests.web.conftest import CAR
from tests.web.diagnosed import done

if TYPE_CHECKING:
    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap

ROUTE = "start=43.872,-36.433&goal=43.8,-35.9"
METRES = {"m": 1.0, "km": 1000.0}


def scale_m(page: MapPage) -> float:
    """Length that the map's scale shows [m]."""
    page.picture()
    value, unit = page.page.locator(".maplibregl-ctrl-scale").inner_text().split()
    return float(value) * METRES[unit]


def test_map_goes_to_the_graph_of_the_drives_and_near_to_them(visit: Visit, elsewhere: dict[str, Any]) -> None:
    whole = scale_m(visit("?graph=coquimbo"))
    page = visit(f"?tab=diagnosis&diagnosis={elsewhere['id']}")
    expect(page.page.locator("#toast")).to_contain_text("The map shows the roads of coquimbo")
    assert page.address_query()["graph"] == "coquimbo"
    expect(page.page.locator("#attribution")).to_contain_text("OpenStreetMap")
    page.drawn()
    assert scale_m(page) < 0.5 * whole
    page.page.get_by_role("tab", name="Route").click()
    expect(page.page.get_by_label("Road network")).to_have_value("coquimbo")


def test_map_with_places_keeps_its_graph_until_it_is_told_to_change(visit: Visit, elsewhere: dict[str, Any]) -> None:
    page = visit(f"?tab=diagnosis&diagnosis={elsewhere['id']}&{ROUTE}")
    offer = page.page.locator("#pane-diagnosis").get_by_text("These drives are on the roads of coquimbo, the map shows")
    expect(offer).to_contain_text("Places on highlands are removed")
    assert "graph" not in page.address_query()
    page.page.get_by_role("button", name="Show coquimbo").click()
    expect(offer).to_be_hidden()
    page.drawn()
    assert page.address_query()["graph"] == "coquimbo"
    assert not {"start", "goal"} & set(page.address_query())
    assert scale_m(page) <= 500.0


def test_map_that_shows_the_drives_graph_stays(visit: Visit, elsewhere: dict[str, Any]) -> None:
    page = visit(f"?tab=diagnosis&diagnosis={elsewhere['id']}&graph=coquimbo")
    expect(page.page.locator("#legend")).to_contain_text("All drives, by road")
    expect(page.page.locator("#toast")).to_be_hidden()
    expect(page.page.get_by_role("button", name="Show coquimbo")).to_have_count(0)
    assert scale_m(page) <= 500.0


def test_tracks_that_were_matched_to_no_graph_bring_the_one_that_holds_them(
    visit: Visit, served: ServedMap, elsewhere: dict[str, Any]
) -> None:
    same = elsewhere["request"]["recordings"]
    found = done(served, recordings=same, vehicle=CAR)
    page = visit(f"?tab=diagnosis&diagnosis={found['id']}")
    expect(page.page.locator("#toast")).to_contain_text("The map shows the roads of coquimbo")
    expect(page.page.locator("#legend")).to_contain_text("All drives, by stretch")
    assert scale_m(page) <= 500.0
