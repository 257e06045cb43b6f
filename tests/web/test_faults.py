"""What goes wrong is said in words, and a way on is there."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

if TYPE_CHECKING:
    from playwright.sync_api import Locator

    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap

RANGE = "?tab=range&start=43.872,-36.433&soc=30"
ROUTE = "?start=43.872,-36.433&goal=43.8,-35.9"
FAR_FROM_ROADS = (43.79, -35.8)


def alert(page: MapPage) -> Locator:
    """The message that is shown in place of results."""
    return page.page.locator("#pane-plan").get_by_role("alert")


def refuse(page: MapPage, path: str, status: int, body: Any) -> None:
    """Answer calls of a path with a problem document from now on."""
    page.refused.add(status)
    text = json.dumps(body)
    page.page.route(
        f"**{path}", lambda route: route.fulfill(status=status, content_type="application/problem+json", body=text)
    )


def documented_problems(served: ServedMap, path: str) -> list[dict[str, Any]]:
    """The problem documents that the service's OpenAPI document gives as examples for POST."""
    answers = served.ask("/openapi.json")["paths"][path]["post"]["responses"]
    found = []
    for status, answer in answers.items():
        if int(status) >= 400:
            content = answer["content"]["application/problem+json"]
            found += [example["value"] for example in content.get("examples", {}).values()]
    return found


def test_place_far_from_any_road_is_shown_and_another_place_mends_it(visit: Visit):
    page = visit(RANGE)
    page.refused.add(404)
    with page.asking("/range") as far:
        page.type_place("Place", FAR_FROM_ROADS)
    expect(alert(page)).to_contain_text(far.answer["detail"])
    expect(page.page.locator("#range tbody")).to_have_count(0)
    expect(page.page.locator("#legend")).to_be_hidden()
    page.type_place("Place", (43.872, -36.433))
    expect(page.page.locator("#range tbody tr")).to_have_count(4)
    expect(alert(page)).to_have_count(0)


def test_unknown_vehicle_of_an_address_is_shown_and_replaced(visit: Visit):
    page = visit(opened=False)
    page.refused.add(404)
    page.open(f"{ROUTE}&vehicle=moon-buggy")
    expect(alert(page)).to_contain_text("moon-buggy")
    expect(page.page.locator("#vehicle")).to_contain_text("The service does not know this vehicle.")
    page.page.get_by_role("button", name="Take the default vehicle").click()
    expect(page.page.get_by_role("radio", name="Eco:")).to_be_attached()
    expect(alert(page)).to_have_count(0)
    assert "vehicle" not in page.address_query()


def test_unknown_graph_of_an_address_is_replaced_by_the_default(visit: Visit):
    page = visit("?graph=atlantis")
    expect(page.page.locator("#toast")).to_contain_text("There is no graph atlantis here")
    expect(page.page.get_by_label("Road network")).to_have_value("highlands")
    assert page.address_query() == {}


@pytest.mark.parametrize("path", ["/route", "/range"])
def test_every_documented_problem_is_shown_and_goes_away_with_a_good_answer(visit: Visit, served: ServedMap, path: str):
    page = visit(RANGE if path == "/range" else ROUTE)
    documented = documented_problems(served, path)
    assert len(documented) > 8
    for i, problem in enumerate(documented):
        refuse(page, path, problem["status"], problem)
        page.page.get_by_label("Charge now").fill(str(40 + i))
        unknown = problem["code"] == "unknown_vehicle"
        expect(alert(page)).to_contain_text("does not know the vehicle" if unknown else problem["detail"])
        page.page.unroute(f"**{path}")
    with page.asking(path):
        page.page.get_by_label("Charge now").fill("90")
    expect(alert(page)).to_have_count(0)


def test_service_out_of_reach_is_shown_and_trying_again_works_when_it_is_back(visit: Visit):
    page = visit(ROUTE)
    page.refused.add(0)
    page.page.route("**/route", lambda route: route.abort("connectionrefused"))
    page.page.get_by_label("Charge now").fill("70")
    expect(alert(page)).to_contain_text("The service does not answer")
    page.page.unroute("**/route")
    with page.asking("/route") as again:
        alert(page).get_by_role("button", name="Try again").click()
    assert again.body["soc"] == 0.7
    expect(page.page.get_by_role("radio", name="Eco:")).to_be_attached()
    expect(alert(page)).to_have_count(0)


def test_answer_that_is_no_json_is_shown(visit: Visit):
    page = visit(RANGE)
    page.refused.add(502)
    page.page.route("**/range", lambda route: route.fulfill(status=502, content_type="text/html", body="<h1>Bad</h1>"))
    page.page.get_by_label("Charge now").fill("70")
    expect(alert(page)).to_contain_text("The service answered 502 with something that can't be read.")


def test_map_without_tiles_says_so_and_the_panel_still_answers(visit: Visit):
    page = visit(opened=False)
    page.refused.add(503)
    problem = {"detail": "the service is starting", "code": "not_ready", "errors": []}
    refuse(page, "/tiles.json", 503, problem)
    page.page.goto(f"{page.address}/")
    expect(page.page.locator(".map-error")).to_contain_text("the service is starting")
    with page.asking("/range"):
        page.type_place("Start", (43.872, -36.433))
    expect(page.page.locator("#range tbody tr")).to_have_count(4)


def test_page_that_can_not_start_says_why_and_starts_again(visit: Visit):
    page = visit(opened=False)
    refuse(page, "/graphs", 503, {"detail": "graphs are being loaded", "code": "not_ready", "errors": []})
    page.page.goto(f"{page.address}/")
    expect(page.page.get_by_role("alert").filter(has_text="graphs are being loaded")).to_be_visible()
    page.page.unroute("**/graphs")
    page.page.get_by_role("button", name="Try again").click()
    page.drawn()
    expect(page.page.get_by_label("Road network")).to_have_value("highlands")
