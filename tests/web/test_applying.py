"""What a diagnosis has learned, looked at before it is applied."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.app.totals import OPEN_CAR, write_totals
from tests.web.accessible import check_accessible
from tests.web.conftest import CAR
from tests.web.diagnosed import done
from tests.web.map_page import PHONE, check_shown

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Locator, Response, Route

    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap

ENDS = {"start": {"lat": 43.872, "lon": -36.433}, "goal": {"lat": 43.8, "lon": -35.9}}
ROUTE = "start=43.872,-36.433&goal=43.8,-35.9"


@pytest.fixture(scope="module")
def clear(served: ServedMap) -> dict[str, Any]:
    """A diagnosis that names its cause, of drives without positions."""
    return done(served, recordings=["winter/*.csv"], vehicle=CAR)


@pytest.fixture(scope="module")
def uncertain(served: ServedMap, recordings: Path) -> dict[str, Any]:
    """A diagnosis that can't tell heat from cold tyres."""
    (recordings / "totals").mkdir()
    write_totals(recordings / "totals" / "totals.csv")
    found = done(served, recordings=["totals/totals.csv"], vehicle=OPEN_CAR)
    assert found["result"]["verdict"] == "cannot_tell"
    return found


def comparison(page: MapPage) -> Locator:
    return page.page.get_by_role("region", name="What it changes")


def apply_button(page: MapPage) -> Locator:
    return page.page.get_by_role("button", name="Apply to the next route")


def check_sides(page: MapPage, before: dict[str, Any], after: dict[str, Any]) -> None:
    """The comparison shows energy and charge on arrival of two answers, and how much more or less the second takes."""
    for kind, answer in (("before", before), ("after", after)):
        text = comparison(page).locator(f".from-to .{kind}").inner_text()
        check_shown(text, "kWh", answer["battery_kwh"])
        check_shown(text, "%", 100.0 * answer["soc_end"])
    change = after["battery_kwh"] / before["battery_kwh"] - 1.0
    sentence = comparison(page).get_by_text("That is").inner_text()
    check_shown(sentence, "%", 100.0 * abs(change))
    assert ("more energy" if change > 0.0 else "less energy") in sentence


def test_chosen_route_is_shown_before_and_after_and_nothing_is_applied_until_it_is(
    visit: Visit, clear: dict[str, Any], served: ServedMap
) -> None:
    page = visit(opened=False)
    held: list[Route] = []
    waiting = True

    def asked_for(route: Route) -> None:
        if waiting:
            held.append(route)
        else:
            route.continue_()

    page.page.route("**/route", asked_for)
    page.page.goto(
        f"{page.address}/?tab=diagnosis&diagnosis={clear['id']}&{ROUTE}&soc=70&conditions=ambient_c:-10&vehicle={CAR}"
    )
    expect(comparison(page)).to_contain_text("Driving it before and after")
    expect(apply_button(page)).to_be_disabled()
    waiting = False
    for route in held:
        route.continue_()
    asked = {**ENDS, "soc": 0.7, "reserve_soc": 0.1, "vehicle": CAR, "conditions": {"ambient_c": -10}}
    before, after = (
        served.ask("/route", {**asked, **effects})["routes"][0] for effects in ({}, {"effects": clear["id"]})
    )
    check_sides(page, before, after)
    comparison(page).get_by_text("By cause").click()
    row = comparison(page).get_by_role("row", name=re.compile("^Cabin climate"))
    cells = row.get_by_role("cell").all_inner_texts()
    assert cells[:2] == [f"{answer['energy_parts_kwh']['cabin']:.2f}" for answer in (before, after)]
    expect(apply_button(page)).to_be_enabled()
    assert "effects" not in page.address_query()
    apply_button(page).click()
    assert page.address_query()["effects"] == clear["id"]
    page.drawn()


def test_route_without_a_temperature_is_shown_at_the_drives_median_too(visit: Visit, clear: dict[str, Any]) -> None:
    page = visit(f"?tab=diagnosis&diagnosis={clear['id']}&{ROUTE}")
    expect(comparison(page)).to_contain_text("no temperature set")
    ambients = sorted(trip["ambient_c"] for trip in clear["result"]["trips"])
    middle = 0.5 * (ambients[4] + ambients[5])
    expect(comparison(page)).to_contain_text(f"At {middle:.0f} °C, the median of the drives:")


def test_without_a_route_a_made_up_way_is_driven_no_faster_than_the_drives(
    visit: Visit, clear: dict[str, Any], served: ServedMap
) -> None:
    page = visit(opened=False)
    answers: dict[bool, dict[str, Any]] = {}
    bodies: list[dict[str, Any]] = []

    def heard(response: Response) -> None:
        if response.url.endswith("/simulate"):
            body = response.request.post_data_json
            bodies.append(body)
            answers["effects" in body] = response.json()

    page.page.on("response", heard)
    page.open(f"?tab=diagnosis&diagnosis={clear['id']}")
    expect(comparison(page)).to_contain_text("a made-up level way as long as the median drive")
    expect(apply_button(page)).to_be_enabled()
    check_sides(page, answers[False], answers[True])
    fastest = served.ask(f"/diagnoses/{clear['id']}/effects")["learned_from"]["speed_kmh"]
    assert max(link["speed_limit_kmh"] for link in bodies[0]["chain"]) <= fastest + 0.5
    assert "learned at up to" not in comparison(page).inner_text()


def test_uncertain_causes_are_named_and_applied_only_once_that_is_agreed_to(
    visit: Visit, uncertain: dict[str, Any]
) -> None:
    page = visit(f"?tab=diagnosis&diagnosis={uncertain['id']}&{ROUTE}")
    expect(comparison(page)).to_contain_text("That is")
    card = page.page.get_by_role("region", name="Verdict")
    expect(card).to_contain_text(
        "Heating the cabin in the cold could as well be tyres that roll harder in the cold. What would tell: a"
        " recording with ten minutes at standstill"
    )
    agreed = page.page.get_by_role("checkbox", name="Apply it although its cause is uncertain")
    expect(apply_button(page)).to_be_disabled()
    agreed.check()
    expect(apply_button(page)).to_be_enabled()
    agreed.uncheck()
    expect(apply_button(page)).to_be_disabled()
    agreed.check()
    with page.asking("/route") as applied:
        apply_button(page).click()
    assert applied.body["effects"] == uncertain["id"]
    expect(page.page.locator("#routes")).to_contain_text("could not tell their causes apart")
    page.page.get_by_role("tab", name="Diagnosis").click()
    page.page.get_by_role("button", name="Leave out again").click()
    expect(agreed).not_to_be_checked()
    expect(apply_button(page)).to_be_disabled()


def test_clear_causes_ask_for_no_agreement(visit: Visit, clear: dict[str, Any]) -> None:
    page = visit(f"?tab=diagnosis&diagnosis={clear['id']}")
    expect(apply_button(page)).to_be_enabled()
    expect(page.page.get_by_role("checkbox", name=re.compile("uncertain"))).to_have_count(0)


def test_nothing_carried_is_said_with_its_reason_in_place_of_the_button(visit: Visit, served: ServedMap) -> None:
    few = done(served, recordings=["winter/winter-00.csv"], vehicle=CAR)
    page = visit(f"?tab=diagnosis&diagnosis={few['id']}")
    card = page.page.get_by_role("region", name="Verdict")
    expect(card).to_contain_text("Nothing is carried over to routes.")
    expect(card).to_contain_text("the drives are too few")
    expect(apply_button(page)).to_have_count(0)
    expect(comparison(page)).to_have_count(0)


def test_without_a_route_places_of_a_drive_on_the_shown_roads_are_its_ends(
    visit: Visit, elsewhere: dict[str, Any]
) -> None:
    page = visit(opened=False)
    bodies: list[dict[str, Any]] = []
    page.page.on(
        "request", lambda request: bodies.append(request.post_data_json) if request.url.endswith("/route") else None
    )
    page.open(f"?tab=diagnosis&diagnosis={elsewhere['id']}")
    expect(comparison(page)).to_contain_text(re.compile(r"the way from where drive road-\d\d began"))
    assert {body["graph"] for body in bodies} == {"coquimbo"}
    assert all(-71.4 < body[end]["lon"] < -71.2 for body in bodies for end in ("start", "goal"))


def test_speeds_that_no_drive_had_are_told_before_they_are_applied(visit: Visit, elsewhere: dict[str, Any]) -> None:
    page = visit(f"?tab=diagnosis&diagnosis={elsewhere['id']}&{ROUTE}")
    expect(comparison(page)).to_contain_text(re.compile(r"The effects were learned at up to \d+ km/h, here up to 1"))


def test_uncertain_card_keeps_the_rules_of_wcag_light_dark_and_on_a_phone(
    visit: Visit, uncertain: dict[str, Any]
) -> None:
    page = visit(f"?tab=diagnosis&diagnosis={uncertain['id']}&{ROUTE}")
    expect(comparison(page)).to_contain_text("That is")
    comparison(page).get_by_text("By cause").click()
    check_accessible(page.page)
    page.page.get_by_role("button", name="Use dark colours").click()
    page.drawn()
    check_accessible(page.page)
    page.page.set_viewport_size(PHONE)
    check_accessible(page.page)
    assert page.width_px() <= PHONE["width"]
