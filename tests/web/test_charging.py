"""Charging stops on the map: planned, shown as cards and along time, moved to other stations, left out, explained."""

from __future__ import annotations

import re
import unicodedata
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.web.accessible import check_accessible
from tests.web.conftest import PATIENCE_MS
from tests.web.map_page import PHONE, MapPage, check_shown, places_as_sent
from tests.web.test_places import box_of, click_map, pixel_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, Locator, Route

    from tests.web.conftest import Visit
    from tests.web.served import ServedMap

START, GOAL = (43.872, -36.433), (43.697, -35.19)
QUERY: Final = f"?start={START[0]},{START[1]}&goal={GOAL[0]},{GOAL[1]}&soc=25&charge=1"
SENT = places_as_sent(START, GOAL)
CHARGING: Final = {
    "arrive_soc": 0.1,
    "goal_soc": 0.1,
    "max_soc": 0.8,
    "overhead_s": 300,
    "objective": "time",
}
ASKED: Final = {
    "start": SENT[0],
    "goal": SENT[1],
    "soc": 0.25,
    "reserve_soc": 0.1,
    "graph": "highlands",
    "charging": CHARGING,
}
DEPARTURE: Final = "2026-11-30T08:15"


@pytest.fixture(scope="module", autouse=True)
def _known_ways(served: ServedMap) -> None:
    """The ways between stations are searched for before a page waits for them, which takes long on a busy machine."""
    served.ask("/route", ASKED)


def stops_of(page: MapPage) -> Locator:
    """The cards of the stops."""
    return page.page.locator("#routes .plan-stop")


def stop_names(page: MapPage) -> list[str]:
    """Names of the stations of the shown plan."""
    return stops_of(page).locator("h3").all_inner_texts()


def check_stops(page: MapPage, route: Any) -> None:
    """The cards show station, charge, energy, power and price of each stop of the answer."""
    stops = route["charging"]["stops"]
    expect(stops_of(page)).to_have_count(len(stops))
    for card, stop in zip(stops_of(page).all(), stops, strict=True):
        text = card.inner_text()
        assert stop["station"]["name"] in text
        check_shown(text, "kWh", stop["charged_kwh"])
        assert f" at {stop['mean_power_kw']:.0f} kW" in text
        check_shown(text, stop["currency"], stop["price"])
        assert f"{100 * stop['arrive_soc']:.0f} % → {100 * stop['depart_soc']:.0f} %" in text


def with_plans(page: MapPage) -> MapPage:
    """The page with a plan of one or more stops, and the further plans, which are asked for and drawn after it."""
    expect(stops_of(page)).not_to_have_count(0)
    expect(page.page.get_by_role("radio", name="Most reserve")).to_have_count(1)
    return page


@pytest.fixture
def planned(visit: Visit) -> MapPage:
    """A page with plans."""
    return with_plans(visit(QUERY))


@pytest.fixture(scope="module")
def looked_at(browser: Browser, served: ServedMap, _known_ways: None) -> Iterator[MapPage]:
    """One page with plans for tests that look at it one after the other; the last one plans anew."""
    context = browser.new_context(
        viewport={"width": 1280, "height": 800}, locale="en-GB", color_scheme="light", reduced_motion="reduce"
    )
    context.set_default_timeout(PATIENCE_MS)
    page = MapPage(context.new_page(), served.address)
    page.open(QUERY)
    yield with_plans(page)
    context.close()
    assert not page.faults, "\n".join(page.faults)


def test_plan_is_shown_as_the_service_answers(looked_at: MapPage, served: ServedMap):
    answer = served.ask("/route", ASKED)
    assert looked_at.sent[0] == ("/route", ASKED)
    best = answer["routes"][0]
    check_stops(looked_at, best)
    assert len(best["charging"]["stops"]) > 0
    totals = looked_at.page.locator(".plan-totals").inner_text()
    minutes = round(best["charging"]["totals"]["total_s"] / 60)
    assert f"{minutes // 60} h {minutes % 60:02d} min" in totals
    (source,) = best["charging"]["sources"]
    expect(looked_at.page.locator("#routes")).to_contain_text(f"Data: {source['name']} ({source['licence']})")
    expect(looked_at.page.locator("#announcer")).to_contain_text("charging stop")
    markers = looked_at.page.locator("[data-marker^=stop]")
    expect(markers).to_have_count(len(best["charging"]["stops"]))


def test_timeline_is_walked_with_keys_and_shows_its_place_on_the_map_and_in_the_list(
    looked_at: MapPage, served: ServedMap
):
    charging = served.ask("/route", ASKED)["routes"][0]["charging"]
    slider = looked_at.page.get_by_role("slider", name="Time along the plan")
    before = looked_at.picture()
    slider.focus()
    looked_at.page.keyboard.press("End")
    check_shown(slider.get_attribute("aria-valuetext") or "", "%", 100 * charging["goal"]["arrive_soc"])
    assert looked_at.changed_frac(before, 1e-5) < 0.002
    looked_at.page.keyboard.press("Home")
    check_shown(slider.get_attribute("aria-valuetext") or "", "%", 25)
    box = box_of(slider)
    stop, whole_s = charging["stops"][0], charging["totals"]["total_s"]
    middle = (stop["arrive_s"] + 0.7 * (stop["depart_s"] - stop["arrive_s"])) / whole_s
    looked_at.page.mouse.move(box["x"] + 44 + middle * (box["width"] - 58), box["y"] + 60)
    expect(looked_at.page.get_by_role("region", name="Charge over time")).to_contain_text(
        f"charging, {stop['station']['name']}"
    )
    expect(stops_of(looked_at).first).to_have_attribute("data-looked", "")
    looked_at.page.get_by_role("button", name="Along the way").click()
    expect(looked_at.page.get_by_role("slider", name="Place along the route")).to_be_visible()
    expect(slider).to_be_hidden()
    looked_at.page.get_by_role("button", name="Along time").click()
    expect(slider).to_be_visible()


def test_further_plans_come_by_themselves_and_are_looked_at(looked_at: MapPage, served: ServedMap):
    routes = served.ask("/route", ASKED | {"charging": CHARGING | {"alternatives": 3}})["routes"]
    cards = looked_at.page.locator("#routes .route-card")
    assert len(routes) > 1
    expect(cards).to_have_count(len(routes))
    assert looked_at.sent == [("/route", ASKED), ("/route", ASKED | {"charging": CHARGING | {"alternatives": 3}})]
    looked_at.page.get_by_role("radio", name=re.compile("^Most reserve")).locator("..").click()
    (reserve,) = [route for route in routes if route["name"] == "most reserve"]
    check_stops(looked_at, reserve)
    assert looked_at.address_query()["route"] == "most reserve"
    check_shown(cards.nth(len(routes) - 1).inner_text(), "%", 100 * reserve["charging"]["goal"]["arrive_soc"])


def test_offered_stations_stay_while_the_plan_is_drawn_anew(looked_at: MapPage):
    (name, *_) = stop_names(looked_at)
    opener = stops_of(looked_at).first.get_by_role("button", name="Another station")
    opener.click()
    near = looked_at.page.get_by_role("list", name=f"Stations near {name}").get_by_role("button")
    expect(near.first).to_be_focused()
    offered = near.count()
    looked_at.page.evaluate("document.querySelector('button[aria-label^=\"Units:\"]').click()")  # the focus stays
    expect(looked_at.page.locator(".plan-drive").first).to_contain_text(" mi ")
    expect(near).to_have_count(offered)
    expect(near.first).to_be_focused()
    expect(opener).to_have_attribute("aria-expanded", "true")
    opener.click()
    expect(near).to_have_count(0)


def test_stop_that_is_left_out_is_not_in_the_next_plan(looked_at: MapPage):
    looked_at.page.get_by_role("radio", name=re.compile("^Best")).locator("..").click()
    name = stop_names(looked_at)[0]
    with looked_at.asking("/route") as without:
        stops_of(looked_at).first.get_by_role("button", name=f"Not at {name}").click()
    (gone,) = without.body["charging"]["excluded_stations"]
    check_stops(looked_at, without.answer["routes"][0])
    assert gone not in [stop["station"]["id"] for stop in without.answer["routes"][0]["charging"]["stops"]]
    assert looked_at.address_query()["notat"] == gone


def test_departure_gives_times_of_day_and_is_kept_in_the_address(planned: MapPage):
    with planned.asking("/route"):
        planned.page.get_by_label("Departure").fill(DEPARTURE)
    with planned.asking("/route") as sure:
        planned.page.get_by_label("How sure", exact=True).select_option(label="95 % sure at every stop")
    assert sure.body["charging"]["departure_time"] == DEPARTURE
    assert sure.body["charging"]["confidence"] == 0.95
    charging = sure.answer["routes"][0]["charging"]
    plan = planned.page.locator("#routes .plan")
    kept = charging["probability_kept"]
    expect(planned.page.locator(".plan-totals")).to_contain_text(f"{100 * kept:.0f} % sure to arrive everywhere")
    for stop in charging["stops"]:
        expect(plan).to_contain_text(f"{stop['arrive_time'][11:16]} → {stop['depart_time'][11:16]}")
    expect(plan).to_contain_text(charging["goal"]["arrive_time"][11:16])
    assert planned.address_query()["departure"] == DEPARTURE
    assert planned.address_query()["sure"] == "95"


def with_promise(route: Route) -> None:
    """The service's answer with what it says of a stop that is hard to keep."""
    answer = route.fetch().json()
    for plan in answer["routes"]:
        stop = plan["charging"]["stops"][0]
        stop |= {"arrive_soc_p10": 0.123, "arrive_soc_p50": 0.2, "arrive_soc_p90": 0.311, "probability_kept": 0.964}
        stop |= {"gatekeeper": True, "price": None, "overhead_s": stop["overhead_s"] + 5400.0}
        stop["waiting_s"] = plan["charging"]["totals"]["waiting_s"] = 5400.0
        halt = {name: stop[name] for name in ("at", "link_id", "offset_m", "price", "currency", "overhead_s")}
        halt |= {"station": stop["station"] | {"name": "Turning Place"}, "leg": 1, "along_m": stop["along_m"] + 9000.0}
        halt |= {"arrive_s": stop["depart_s"] + 300.0, "depart_s": stop["depart_s"] + 600.0, "waiting_s": 0.0}
        plan["charging"]["halts"] = [halt | {"arrive_time": None, "depart_time": None, "soc": 0.4}]
        place = {"station_id": "x", "station_name": "Far Away", "at": stop["at"], "drive_s": 1260.0}
        stop["fallback"] = place | {"arrive_soc": -0.04, "reached": False, "wait_s": 0.0, "open_soc": -0.04}
        plan["charging"]["proof"] = {"proven": False, "short_by": 130.0, "unproven": "time was up"}
    route.fulfill(json=answer)


def test_stop_says_how_sure_it_is_how_long_it_waits_where_else_to_go_and_that_there_is_no_way_without_it(visit: Visit):
    page = visit(opened=False)
    page.page.route("**/route", with_promise)
    page.open(QUERY)
    card = stops_of(page).first
    expect(card).to_contain_text("12–31 % on arrival, 96 % sure of ≥ 10 %")
    expect(card).to_contain_text("Should it fail: Far Away, 21 min farther, not reached: 4 % short")
    expect(card).to_contain_text("no way without it")
    expect(card).to_contain_text("+ 5 min stop")
    expect(card).to_contain_text("Closed on arrival, opens 1 h 30 min later")
    expect(page.page.locator(".plan-sums")).to_contain_text("Waiting 1 h 30 min")
    expect(page.page.locator(".plan-halt")).to_contain_text("a halt at Turning Place without charging")
    expect(page.page.get_by_role("img", name="Halt without charging, Turning Place")).to_have_count(1)
    expect(page.page.locator("#routes")).to_contain_text("Another plan may be better by at most 2 min: time was up.")
    expect(page.page.locator(".timeline-whisker")).to_have_count(2)  # at the stop and at the goal


def test_stop_says_that_it_is_not_known_whether_there_is_a_way_without_it_and_how_long_its_fallback_is_closed(
    visit: Visit,
):
    def unknown(route: Route) -> None:
        answer = route.fetch().json()
        stop = answer["routes"][0]["charging"]["stops"][0]
        place = {"station_id": "x", "station_name": "Far Away", "at": stop["at"], "drive_s": 1260.0}
        shut = {"arrive_soc": 0.08, "reached": True, "wait_s": 5400.0, "open_soc": 0.05}
        stop |= {"gatekeeper": None, "fallback": place | shut}
        route.fulfill(json=answer)

    page = visit(opened=False)
    page.page.route("**/route", unknown)
    page.open(QUERY)
    card = stops_of(page).first
    expect(card).to_contain_text("Whether there is a way without it is not known")
    expect(card).to_contain_text("Far Away, 21 min farther, arriving with 8 %, closed for 1 h 30 min: 5 % left then")


def test_other_station_is_chosen_with_the_keyboard_and_kept_in_the_link(planned: MapPage):
    before = stop_names(planned)
    stops_of(planned).first.get_by_role("button", name="Another station").focus()
    planned.page.keyboard.press("Enter")
    near = planned.page.get_by_role("list", name=f"Stations near {before[0]}").get_by_role("button")
    expect(near.first).to_be_focused()
    chosen = near.first.locator(".grow").inner_text()
    with planned.asking("/route") as again:
        planned.page.keyboard.press("Enter")
    (sent,) = again.body["charging"]["via_stations"]
    route = again.answer["routes"][0]
    check_stops(planned, route)
    assert sent["station"] in [stop["station"]["id"] for stop in route["charging"]["stops"]]
    assert any(chosen.startswith(name) for name in stop_names(planned))
    asked = len(planned.sent)
    planned.open(planned.page.url.removeprefix(f"{planned.address}/"))
    assert planned.sent[asked] == ("/route", again.body)
    check_stops(planned, route)
    forget = planned.page.get_by_role("list", name="Chosen stations").get_by_role("button")
    with planned.asking("/route"):
        forget.first.click()
    with planned.asking("/route") as forgotten:
        forget.first.click()
    assert forgotten.body == ASKED


def test_other_stations_that_are_closed_on_arrival_are_marked(visit: Visit, served: ServedMap):
    late = "2026-11-29T22:00"
    page = visit(f"{QUERY}&departure={late}&chargeat=43.7862446,-36.1999686,synth:town-25")
    stops_of(page).first.get_by_role("button", name="Another station").click()
    near = page.page.get_by_role("list", name=f"Stations near {stop_names(page)[0]}").get_by_role("button")
    expect(near.first).to_be_focused()
    open_then = served.ask(f"/graphs/highlands/stations?limit=1000&open_at={late}")["features"]
    names = {station["properties"]["name"] for station in open_then}
    marked = [" · closed at 22:" in text for text in near.all_inner_texts()]
    assert marked == [
        name not in names
        for name in near.locator(".grow").evaluate_all("shown => shown.map((text) => text.firstChild.textContent)")
    ]
    assert True in marked
    expect(page.page.locator("#routes")).to_contain_text("without charging: that would not help, or it is closed then.")


def test_stop_that_is_dragged_to_another_station_is_planned_there(planned: MapPage, served: ServedMap):
    stop = served.ask("/route", ASKED)["routes"][0]["charging"]["stops"][0]["station"]
    fitting = served.ask("/graphs/highlands/stations?connectors=ccs2&limit=1000")["features"]
    planned.picture()
    start, goal = (box_of(planned.marker(title)) for title in ("Start", "Goal"))
    pixels_a_degree = (goal["x"] - start["x"]) / (GOAL[1] - START[1])
    places = np.array([feature["geometry"]["coordinates"] for feature in fitting])
    apart_deg = places - (stop["at"]["lon"], stop["at"]["lat"])
    apart = apart_deg * pixels_a_degree / (1.0, -np.cos(np.radians(stop["at"]["lat"])))
    here, shown = box_of(planned.page.locator("[data-marker=stop-0]")), box_of(planned.page.locator("#map"))
    x, y = here["x"] + here["width"] / 2, here["y"] + here["height"] / 2
    inside = (x + apart[:, 0] > shown["x"] + 40) & (y + apart[:, 1] > shown["y"] + 200)
    far = np.where(inside & (np.hypot(*apart.T) > 40), np.hypot(*apart.T), np.inf)
    wanted = int(far.argmin())
    planned.page.mouse.move(x, y)
    planned.page.mouse.down()
    planned.page.mouse.move(x + apart[wanted, 0] / 2, y + apart[wanted, 1] / 2, steps=4)
    planned.page.mouse.move(x + apart[wanted, 0], y + apart[wanted, 1], steps=4)
    with planned.asking("/route") as moved:
        planned.page.mouse.up()
    assert [chosen["station"] for chosen in moved.body["charging"]["via_stations"]] == [fitting[wanted]["id"]]
    assert moved.body["charging"]["excluded_stations"] == [stop["id"]]
    expect(planned.page.locator(".chosen-stations")).to_contain_text(fitting[wanted]["properties"]["name"])


def test_stations_are_drawn_by_power_and_shown_where_they_are_clicked_with_what_is_known(
    visit: Visit, served: ServedMap
):
    listed = served.ask("/graphs/highlands/stations?limit=1000")
    strongest = served.ask("/graphs/highlands/stations?limit=1000&min_power_kw=300")["features"][0]
    page = visit()
    before = page.picture()
    page.page.get_by_role("button", name="Charging stations on the map").click()
    assert page.changed_frac(before, 0.001) < 0.2
    assert page.address_query() == {"stations": "1"}
    lon, lat = strongest["geometry"]["coordinates"]
    click_map(page, pixel_of(page, served, (lat, lon)))
    card = page.page.get_by_role("region", name="Charging station", exact=True)
    expect(card).to_contain_text("300 kW")
    expect(card.get_by_role("heading")).to_have_text(strongest["properties"]["name"])
    assert not page.sent
    page.page.get_by_role("button", name="Close the station").click()
    expect(card).to_be_hidden()
    page.page.get_by_role("button", name="List those in view").click()
    entries = page.page.get_by_role("list", name="Charging stations in view").get_by_role("button")
    expect(entries.first).to_contain_text("300 kW")
    name = entries.first.locator(".grow").inner_text()
    (station,) = [feature for feature in listed["features"] if feature["properties"]["name"] == name][:1]
    entries.first.click()
    facts = station["properties"]
    for text in (name, "300 kW", facts["operator"], "CCS 2", "EUR", f"Data: {listed['sources'][0]['name']}"):
        expect(card).to_contain_text(text)
    expect(card).to_contain_text(listed["sources"][0]["licence"])
    card.get_by_role("button", name="Charge here").click()
    expect(page.page.get_by_role("switch", name="Charging stops")).to_be_checked()
    expect(page.page.locator(".chosen-stations")).to_contain_text(name)
    card.get_by_role("button", name="Not here").click()
    assert page.address_query()["notat"] == station["id"]
    page.page.keyboard.press("Escape")
    expect(card).to_be_hidden()


def test_no_plan_says_why_and_its_remedy_makes_one(visit: Visit):
    page = visit(f"{QUERY.replace('soc=25', 'soc=11')}&leastkw=100")
    notice = page.page.locator("#routes .notice.bad")
    expect(notice).to_contain_text("No plan with charging stops")
    page.page.locator("#charging").get_by_role("button", name="What would help").click()
    expect(notice.get_by_role("button", name="Depart with")).to_be_focused()
    expect(page.page.locator("#announcer")).to_contain_text("no plan")
    check_accessible(page.page)
    with page.asking("/route") as remedied:
        notice.get_by_role("button", name="Depart with").click()
    assert remedied.body["soc"] > 0.11
    assert remedied.answer["no_plan"] is None
    expect(notice).to_have_count(0)
    check_stops(page, remedied.answer["routes"][0])


def test_lack_of_stations_and_of_plugs_is_told_before_anything_is_asked(visit: Visit, served: ServedMap):
    page = visit("?charge=1&graph=coquimbo")
    expect(page.page.locator("#charging .notice")).to_contain_text("no charging stations on the map coquimbo")
    bare = [vehicle for vehicle in served.ask("/vehicles")["vehicles"] if not vehicle["connectors"]]
    if bare:
        page.page.get_by_label("Vehicle", exact=True).select_option(bare[0]["id"])
        expect(page.page.locator("#charging .notice")).to_contain_text(f"how the {bare[0]['name']} charges")


def test_vehicle_is_found_by_a_part_of_its_name(page: MapPage, served: ServedMap):
    picker = page.page.get_by_label("Vehicle", exact=True)
    makes = picker.locator("optgroup").evaluate_all("groups => groups.map((group) => group.label)")
    assert makes == sorted(makes, key=lambda make: unicodedata.normalize("NFD", make)[0].lower())
    assert len(makes) == len(set(makes)) > 40
    search = page.page.get_by_label("Search vehicles")
    search.fill("zoe 50")
    found = page.page.get_by_role("list", name="Vehicles found").get_by_role("button")
    expect(found.first).to_contain_text("Zoe")
    page.page.keyboard.press("ArrowDown")
    expect(found.first).to_be_focused()
    name = found.first.locator(".grow").inner_text()
    page.page.keyboard.press("Enter")
    expect(search).to_have_value("")
    expect(picker.locator("option:checked")).to_have_text(name)
    (wanted,) = [vehicle["id"] for vehicle in served.ask("/vehicles")["vehicles"] if vehicle["name"] == name]
    assert page.address_query() == {"vehicle": wanted}


def test_plan_keeps_the_rules_of_wcag_at_a_desk_on_a_phone_and_in_the_dark(visit: Visit):
    page = visit(f"{QUERY}&departure={DEPARTURE}&sure=90&stations=1&stay=600")
    expect(stops_of(page)).not_to_have_count(0)
    for folded in page.page.locator("#panel details > summary:visible").all():
        folded.click()
    stops_of(page).first.get_by_role("button", name="Another station").click()
    stops_of(page).first.locator("h3 button").click()
    expect(page.page.locator("#station-card")).to_contain_text("Data:")
    check_accessible(page.page)
    page.page.set_viewport_size(PHONE)
    check_accessible(page.page)
    assert page.width_px() <= PHONE["width"]
    page.page.emulate_media(color_scheme="dark")
    expect(page.page.locator("html")).to_have_attribute("data-theme", "dark")
    page.page.set_viewport_size({"width": 1280, "height": 800})
    check_accessible(page.page)


def test_stay_at_the_goal_and_networks_are_chosen_by_keyboard_on_a_phone_and_kept_in_the_link(visit: Visit):
    page = visit(QUERY, **PHONE)
    stay = page.page.get_by_label("Charge at the goal", exact=True)
    expect(page.page.get_by_label("Power there")).to_be_hidden()
    stay.focus()
    with page.asking("/route"):
        page.page.keyboard.type("10 h")
    with page.asking("/route") as powered:
        page.page.get_by_label("Power there").select_option(label="7.4 kW")
    assert powered.body["charging"]["stays"] == [{"at": "goal", "minutes": 600, "power_kw": 7.4}]
    charged = powered.answer["routes"][0]["charging"]["goal"]["stay"]
    goal = page.page.locator(".plan-end").last
    expect(goal).to_contain_text(f"charged there to {100 * charged['depart_soc']:.0f} %")
    folded = page.page.locator("#charging details > summary")
    folded.focus()
    page.page.keyboard.press("Enter")
    avoid, prefer = page.page.get_by_label("Networks to avoid"), page.page.get_by_label("Networks to prefer")
    avoid.fill("voltway, Town Works")
    with page.asking("/route") as avoided:
        avoid.press("Tab")
    assert avoided.body["charging"]["networks"] == {"avoided": ["voltway", "Town Works"]}
    prefer.fill("Voltway")
    with page.asking("/route") as preferred:
        prefer.press("Enter")
    assert preferred.body["charging"]["networks"] == {"preferred": ["Voltway"], "avoided": ["Town Works"]}
    expect(avoid).to_have_value("Town Works")
    query = page.address_query()
    assert {name: query[name] for name in ("stay", "staykw", "prefer", "avoid")} == {
        "stay": "600",
        "staykw": "7.4",
        "prefer": "Voltway",
        "avoid": "Town Works",
    }
    asked = len(page.sent)
    page.open(page.page.url.removeprefix(f"{page.address}/"))
    assert page.sent[asked] == ("/route", preferred.body)
