"""Start, goal and via points: clicked, typed, dragged, and moved with the keyboard."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.web.map_page import places_as_sent

if TYPE_CHECKING:
    from playwright.sync_api import Locator

    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage, Place
    from tests.web.served import ServedMap

START, GOAL, BETWEEN = (43.872, -36.433), (43.697, -35.19), (43.7696, -35.9)
ROUTE_QUERY = f"?start={START[0]},{START[1]}&goal={GOAL[0]},{GOAL[1]}"
IN_TOWN = "?graph=coquimbo&soc=20&start=-29.92,-71.255"  # has roads all around
REFUSED = {
    "somewhere": "Write latitude and longitude",
    "95, 10": "The latitude is 95, allowed: −90 to 90",
    "45, 181": "The longitude is 181, allowed: −180 to 180",
}
STEP_PX = 12
MARGIN_PX = 20  # between the bounds of a graph and the edges of the map at first


def mercator(place: Place) -> tuple[float, float]:
    """Place in the web Mercator square, 0..1 from west to east and from north to south (EPSG:3857)."""
    lat, lon = (math.radians(angle) for angle in place)
    return 0.5 + lon / math.tau, 0.5 - math.asinh(math.tan(lat)) / math.tau


def pixel_of(page: MapPage, served: ServedMap, place: Place) -> tuple[float, float]:
    """Where a place lies on the map [px from its upper left corner] as long as nobody moved it: all of it is shown."""
    west, south, east, north = served.ask("/graphs/highlands/tiles.json")["bounds"]
    west_x, low = mercator((south, west))
    east_x, high = mercator((north, east))
    box = box_of(page.page.locator("#map"))
    scale = min((box["width"] - 2 * MARGIN_PX) / (east_x - west_x), (box["height"] - 2 * MARGIN_PX) / (low - high))
    x, y = mercator(place)
    return box["width"] / 2 + (x - (west_x + east_x) / 2) * scale, box["height"] / 2 + (y - (low + high) / 2) * scale


def box_of(element: Locator) -> dict[str, float]:
    """Where an element is on the page [px]."""
    box = element.bounding_box()
    assert box
    return {"x": box["x"], "y": box["y"], "width": box["width"], "height": box["height"]}


def tip_of(marker: Locator) -> tuple[float, float]:
    """Middle of a marker on the page [px]."""
    box = box_of(marker)
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def click_map(page: MapPage, pixel: tuple[float, float]) -> None:
    page.page.locator("#map").click(position={"x": pixel[0], "y": pixel[1]})


def test_first_click_sets_the_start_and_second_the_goal_where_they_were_made(page: MapPage, served: ServedMap):
    per_pixel_deg = abs(served_width_deg(served)) / 800
    with page.asking("/range") as area:
        click_map(page, pixel_of(page, served, START))
    expect(page.page.locator("#map-hint")).to_have_text("Click the map to set goal")
    with page.asking("/route") as found:
        click_map(page, pixel_of(page, served, GOAL))
    expect(page.page.locator("#map-hint")).to_be_hidden()
    assert page.place("Start") == pytest.approx(START, abs=per_pixel_deg)
    assert page.place("Goal") == pytest.approx(GOAL, abs=per_pixel_deg)
    for sent, title in ((found.body["start"], "Start"), (found.body["goal"], "Goal")):
        assert (sent["lat"], sent["lon"]) == pytest.approx(page.place(title), abs=1e-5)
    assert area.body["origin"] == found.body["start"]


def served_width_deg(served: ServedMap) -> float:
    west, _, east, _ = served.ask("/graphs/highlands/tiles.json")["bounds"]
    return float(east - west)


def test_typed_coordinates_are_asked_for_and_marked(page: MapPage, served: ServedMap):
    page.type_place("Start", START)
    with page.asking("/route") as found:
        page.type_place("Goal", GOAL)
    assert [found.body["start"], found.body["goal"]] == places_as_sent(START, GOAL)
    assert page.address_query()["start"] == "43.872,-36.433"
    expect(page.marker("Start")).to_be_visible()
    expect(page.marker("Goal")).to_be_visible()


def test_text_that_is_no_place_is_refused_beside_the_field(page: MapPage):
    box = page.place_box("Start")
    for typed, message in REFUSED.items():
        box.fill(typed)
        box.press("Enter")
        expect(page.page.get_by_role("status").filter(has_text=message)).to_be_visible()
        expect(box).to_have_attribute("aria-invalid", "true")
    assert not page.sent
    box.fill("43.872 -36.433")
    with page.asking("/range"):
        box.press("Enter")
    expect(page.page.get_by_text(message)).to_be_hidden()
    expect(box).to_have_value("43.87200, -36.43300")


def test_what_is_being_typed_stays_while_another_place_is_set_and_goes_with_clear(page: MapPage, served: ServedMap):
    goal = page.place_box("Goal")
    goal.press_sequentially("43.69")
    with page.asking("/range"):
        click_map(page, pixel_of(page, served, START))
    expect(goal).to_have_value("43.69")
    expect(goal).to_have_attribute("aria-invalid", "true")
    expect(page.page.get_by_text(REFUSED["somewhere"])).to_be_visible()
    page.page.get_by_role("button", name="Clear").click()
    expect(goal).to_have_value("")
    expect(page.place_box("Start")).to_have_value("")


def test_dragged_marker_takes_its_place_along(visit: Visit):
    page = visit(IN_TOWN)
    x, y = tip_of(page.marker("Start"))
    before = page.place("Start")
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + 30, y, steps=4)
    with page.asking("/range") as area:
        page.page.mouse.up()
    lat, lon = page.place("Start")
    assert lat == pytest.approx(before[0], abs=2e-4)
    assert 0.001 < lon - before[1] < 0.1
    assert area.body["origin"] == pytest.approx({"lat": lat, "lon": lon}, abs=1e-5)
    assert tip_of(page.marker("Start")) == pytest.approx((x + 30, y), abs=2)


def test_arrow_keys_move_a_marker_by_its_step(visit: Visit):
    page = visit(IN_TOWN)
    marker = page.marker("Start")
    (x, y), (lat, lon) = tip_of(marker), page.place("Start")
    marker.focus()
    with page.asking("/range"):
        page.page.keyboard.press("ArrowRight")
    assert tip_of(marker) == pytest.approx((x + STEP_PX, y), abs=1)
    with page.asking("/range"):
        page.page.keyboard.press("Shift+ArrowDown")
    assert tip_of(marker) == pytest.approx((x + STEP_PX, y + 5 * STEP_PX), abs=1)
    assert page.place("Start")[0] < lat
    assert page.place("Start")[1] > lon
    expect(marker).to_be_focused()


def test_swap_turns_the_journey_round_and_clear_empties_it(visit: Visit):
    page = visit(f"{ROUTE_QUERY}&via={BETWEEN[0]},{BETWEEN[1]};43.75,-35.6")
    with page.asking("/route") as found:
        page.page.get_by_role("button", name="Swap").click()
    assert [found.body["start"], *found.body["via"], found.body["goal"]] == places_as_sent(
        GOAL, (43.75, -35.6), BETWEEN, START
    )
    page.page.get_by_role("button", name="Clear").click()
    expect(page.place_box("Start")).to_have_value("")
    expect(page.place_box("Goal")).to_have_value("")
    expect(page.page.get_by_label("Via point 1, latitude and longitude")).to_have_count(0)
    expect(page.page.locator("[data-marker]")).to_have_count(0)
    assert page.address_query() == {}


def test_via_point_is_added_on_the_way_moved_and_removed(visit: Visit, served: ServedMap):
    page = visit(ROUTE_QUERY)
    expect(page.page.get_by_role("radio", name="Eco:")).to_be_attached()
    ((_, asked),) = page.sent
    with page.asking("/route") as added:
        page.page.get_by_role("button", name="Via point").click()
    (via,) = added.body["via"]
    way = np.asarray(served.ask("/route", asked)["routes"][0]["geometry"]["coordinates"])
    assert np.abs(way - (via["lon"], via["lat"])).max(axis=1).min() < 1e-3, "it lies on the way"
    with page.asking("/route") as moved:
        page.type_place("Via point 1", BETWEEN)
    assert moved.body["via"] == places_as_sent(BETWEEN)
    assert moved.answer["snapped"]["via"][0]["asked"] == moved.body["via"][0]
    expect(page.marker("Via point 1")).to_be_visible()
    with page.asking("/route") as without:
        page.page.get_by_role("button", name="Remove via point 1").click()
    assert "via" not in without.body
    expect(page.marker("Via point 1")).to_have_count(0)


def test_place_is_set_anew_by_its_button_and_a_click_and_escape_ends_that(visit: Visit, served: ServedMap):
    page = visit(f"?start={START[0]},{START[1]}")
    aim = page.page.get_by_role("button", name="Set start on the map")
    aim.click()
    expect(aim).to_have_attribute("aria-pressed", "true")
    page.page.keyboard.press("Escape")
    expect(aim).to_have_attribute("aria-pressed", "false")
    aim.click()
    with page.asking("/range"):
        click_map(page, pixel_of(page, served, BETWEEN))
    assert page.place("Start") == pytest.approx(BETWEEN, abs=served_width_deg(served) / 800)
    expect(page.place_box("Goal")).to_have_value("")


def test_other_graph_drops_places_that_lie_outside(visit: Visit):
    page = visit(ROUTE_QUERY)
    page.page.get_by_label("Road network").select_option("coquimbo")
    expect(page.page.get_by_text("Places outside of this map were removed.")).to_be_visible()
    expect(page.place_box("Start")).to_have_value("")
    assert page.address_query() == {"graph": "coquimbo"}
