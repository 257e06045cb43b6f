"""Routes beside each other: what is shown is what the service answers, on the map, in the chart and as files."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.web.map_page import check_shown, picture_of, places_as_sent, shown_number

if TYPE_CHECKING:
    from playwright.sync_api import Locator

    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap

START, GOAL, BETWEEN = (43.872, -36.433), (43.697, -35.19), (43.77, -35.9)
QUERY = f"?start={START[0]},{START[1]}&goal={GOAL[0]},{GOAL[1]}&soc=60"
SENT = places_as_sent(START, GOAL)
ASKED = {
    "start": SENT[0],
    "goal": SENT[1],
    "soc": 0.6,
    "reserve_soc": 0.1,
    "graph": "highlands",
    "alternatives": ["eco", "balanced", "fastest"],
}
GPX = {"gpx": "http://www.topografix.com/GPX/1/1"}


def card(page: MapPage, name: str) -> Locator:
    """The card of an alternative, a radio button."""
    return page.page.get_by_role("radio", name=re.compile(f"^{name}:"))


def shown_routes(page: MapPage) -> dict[str, str]:
    """What the cards say, by the name of the alternative."""
    expect(card(page, "Eco")).to_be_visible()
    return {name.lower(): card(page, name).get_attribute("aria-label") or "" for name in ("Eco", "Balanced", "Fastest")}


def check_cards(page: MapPage, answer: Any) -> None:
    """The cards show energy, charge on arrival and distance of the answer's routes."""
    texts = shown_routes(page)
    for route in answer["routes"]:
        text = texts[route["name"]]
        check_shown(text, "kWh", route["battery_kwh"])
        check_shown(text, "% on arrival", 100 * route["soc_end"])
        check_shown(text, "km,", route["distance_m"] / 1000)


def saved(page: MapPage, button: str) -> tuple[str, str]:
    """Name and text of the file that a button offers."""
    with page.page.expect_download() as caught:
        page.page.get_by_role("button", name=button, exact=True).click()
    return caught.value.suggested_filename, Path(caught.value.path()).read_text(encoding="utf-8")


@pytest.fixture
def routes(visit: Visit) -> MapPage:
    """The page with a journey that the charge suffices for."""
    page = visit(QUERY)
    expect(card(page, "Eco")).to_be_attached()
    return page


def test_routes_are_shown_as_the_service_answers_and_eco_takes_the_least(routes: MapPage, served: ServedMap):
    answer = served.ask("/route", ASKED)
    assert routes.sent == [("/route", ASKED)]
    check_cards(routes, answer)
    texts = shown_routes(routes)
    energy_kwh = {name: shown_number(text, "kWh")[0] for name, text in texts.items()}
    assert energy_kwh["eco"] <= energy_kwh["balanced"] <= energy_kwh["fastest"]
    assert energy_kwh["eco"] < energy_kwh["fastest"]
    check_shown(routes.page.locator("#announcer").inner_text(), "kWh", answer["routes"][0]["battery_kwh"])


def test_chosen_route_is_looked_at_in_all_places(routes: MapPage, served: ServedMap):
    answer = {route["name"]: route for route in served.ask("/route", ASKED)["routes"]}
    parts = routes.page.get_by_role("table", name=re.compile("Energy by cause"))
    check_shown(parts.locator("tfoot").inner_text(), "kWh", answer["eco"]["battery_kwh"])
    before = routes.picture()
    card(routes, "Eco").focus()
    routes.page.keyboard.press("ArrowDown")
    routes.page.keyboard.press("ArrowDown")
    expect(card(routes, "Fastest")).to_be_checked()
    check_shown(parts.locator("tfoot").inner_text(), "kWh", answer["fastest"]["battery_kwh"])
    assert routes.address_query()["route"] == "fastest"
    expect(routes.page.get_by_role("region", name="Along the route")).to_contain_text("Fastest")
    assert routes.changed_frac(before, 0.002) < 0.2
    assert len(routes.sent) == 1


def test_energy_parts_add_up_to_the_routes_energy(routes: MapPage):
    parts = routes.page.get_by_role("table", name=re.compile("Energy by cause"))
    rows = parts.locator("tbody tr td:last-child").all_inner_texts()
    total, _ = shown_number(parts.locator("tfoot").inner_text(), "kWh")
    assert sum(shown_number(text, "kWh")[0] for text in rows) == pytest.approx(total, abs=0.06 * len(rows))


def test_line_takes_other_colours_with_their_legend(routes: MapPage):
    before = routes.picture()
    ramp = routes.page.locator("#legend").get_by_role("img")
    expect(ramp).to_have_count(1)
    for label, ramps in (("Consumption", 1), ("Route", 0)):
        routes.page.get_by_label("Line shows").select_option(label=label)
        expect(ramp).to_have_count(ramps)
        assert routes.changed_frac(before, 0.0005) < 0.1
        before = routes.picture()
    assert routes.address_query()["colour"] == "plain"


def test_cursor_of_the_chart_is_moved_with_keys_and_shown_on_the_map(routes: MapPage, served: ServedMap):
    eco = served.ask("/route", ASKED)["routes"][0]
    slider = routes.page.get_by_role("slider", name="Place along the route")
    before = routes.picture()
    slider.focus()
    routes.page.keyboard.press("End")
    assert float(slider.get_attribute("aria-valuenow") or "") == pytest.approx(eco["distance_m"] / 1000, abs=0.06)
    value_text = slider.get_attribute("aria-valuetext") or ""
    check_shown(value_text, "%", 100 * eco["soc_end"])
    assert routes.changed_frac(before, 1e-5) < 0.002
    at_end = routes.picture()
    routes.page.keyboard.press("Home")
    assert slider.get_attribute("aria-valuenow") == "0.0"
    for _ in range(10):
        routes.page.keyboard.press("ArrowRight")
    assert float(slider.get_attribute("aria-valuenow") or "") == pytest.approx(eco["distance_m"] / 10_000, abs=0.1)
    assert routes.changed_frac(at_end, 1e-5) < 0.002


def test_chart_shows_charge_height_and_speed_and_can_be_folded(routes: MapPage):
    chart = routes.page.get_by_role("region", name="Along the route")
    plot = chart.get_by_role("slider")
    assert np.ptp(picture_of(plot.screenshot()).reshape(-1, 3), axis=0).max() > 0.3
    for name in ("Charge", "Height", "Speed"):
        expect(chart.get_by_role("button", name=name)).to_have_attribute("aria-pressed", "true")
        expect(plot).to_contain_text(f"{name}, ")
    chart.get_by_role("button", name="Height").click()
    expect(chart.get_by_role("button", name="Height")).to_have_attribute("aria-pressed", "false")
    expect(plot).not_to_contain_text("Height, ")
    chart.get_by_role("button", name="Hide chart").click()
    expect(plot).to_be_hidden()
    chart.get_by_role("button", name="Show chart").click()
    expect(plot).to_be_visible()


def test_hot_stretch_is_zoomed_to_marked_and_left_again(routes: MapPage, served: ServedMap):
    hot = served.ask("/route", ASKED)["routes"][0]["hot_links"]
    stretches = routes.page.locator("#routes ol").get_by_role("button")
    expect(stretches).to_have_count(len(hot))
    for stretch, link in zip(stretches.all(), hot, strict=True):
        check_shown(stretch.inner_text(), "kWh", link["energy_kwh"])
    before = routes.picture()
    stretches.first.click()
    expect(stretches.first).to_have_attribute("aria-pressed", "true")
    expect(routes.page.locator(".profile-stretch")).to_have_count(1)
    assert routes.changed_frac(before, 0.05) > 0.05
    stretches.first.click()
    expect(stretches.first).to_have_attribute("aria-pressed", "false")
    expect(routes.page.locator(".profile-stretch")).to_have_count(0)


def test_route_out_of_reach_says_what_is_missing_and_its_remedy_makes_it_work(visit: Visit, served: ServedMap):
    page = visit(QUERY.replace("soc=60", "soc=25"))
    notice = page.page.locator("#routes .notice.bad")
    expect(notice).to_contain_text("Out of reach")
    eco = served.ask("/route", {**ASKED, "soc": 0.25})["routes"][0]
    assert eco["feasible"] is False
    check_shown(notice.inner_text(), "kWh are missing", eco["deficit_kwh"])
    expect(page.page.locator("[data-marker]")).to_have_count(3)
    expect(page.page.locator("#announcer")).to_contain_text("out of reach")
    with page.asking("/route") as remedied:
        notice.get_by_role("button", name=re.compile("Set charge to")).click()
    assert remedied.body["soc"] == pytest.approx(eco["remedy"]["soc_start_needed"], abs=0.01)
    assert remedied.answer["routes"][0]["feasible"] is True
    expect(notice).to_have_count(0)
    check_cards(page, remedied.answer)
    expect(page.page.locator("[data-marker]")).to_have_count(2)


def test_via_point_makes_legs_that_add_up(visit: Visit, served: ServedMap):
    page = visit(f"{QUERY}&via={BETWEEN[0]},{BETWEEN[1]}")
    expect(card(page, "Eco")).to_be_attached()
    eco = served.ask("/route", {**ASKED, "via": places_as_sent(BETWEEN)})["routes"][0]
    rows = page.page.get_by_role("table", name="From place to place").locator("tbody tr")
    expect(rows).to_have_count(2)
    for row, leg in zip(rows.all(), eco["legs"], strict=True):
        check_shown(row.inner_text(), "kWh", leg["battery_kwh"])
        check_shown(row.inner_text(), "%", 100 * leg["soc_end"])
    assert sum(leg["energy_kwh"] for leg in eco["legs"]) == pytest.approx(eco["energy_kwh"], rel=1e-6)


def test_cold_takes_more_energy_and_uncertainty_widens_the_answer(routes: MapPage):
    warm_kwh = shown_number(shown_routes(routes)["eco"], "kWh")[0]
    routes.page.get_by_text("Weather and load").click()
    with routes.asking("/route"):
        routes.page.get_by_label("Count the air temperature").check()
    with routes.asking("/route") as cold:
        routes.page.get_by_label("Air temperature", exact=True).fill("-15")
    expect(card(routes, "Eco")).to_have_attribute(
        "aria-label", re.compile(f"{cold.answer['routes'][0]['battery_kwh']:.1f} kWh")
    )
    check_cards(routes, cold.answer)
    assert shown_number(shown_routes(routes)["eco"], "kWh")[0] > 1.05 * warm_kwh
    with routes.asking("/route") as unsure:
        routes.page.get_by_label("Show how sure the answer is").check()
    eco = unsure.answer["routes"][0]["uncertainty"]
    sure = f"{100 * eco['soc_end_p10']:.0f}–{100 * eco['soc_end_p90']:.0f} %"
    expect(card(routes, "Eco")).to_have_attribute("aria-label", re.compile(re.escape(sure)))


def test_routes_are_saved_as_geojson_that_holds_the_answer(routes: MapPage, served: ServedMap):
    name, text = saved(routes, "GeoJSON")
    assert name.endswith(".geojson")
    collection = json.loads(text)
    assert collection["type"] == "FeatureCollection"
    lines = [feature for feature in collection["features"] if feature["geometry"]["type"] == "LineString"]
    answer = served.ask("/route", ASKED)["routes"]
    assert [line["properties"]["name"] for line in lines] == [route["name"] for route in answer]
    for line, route in zip(lines, answer, strict=True):
        assert line["geometry"] == route["geometry"]
        assert line["properties"]["energy_kwh"] == pytest.approx(route["energy_kwh"])


def test_route_is_saved_as_gpx_with_heights(routes: MapPage, served: ServedMap):
    name, text = saved(routes, "GPX")
    assert name.endswith(".gpx")
    root = ElementTree.fromstring(text)
    assert root.tag == f"{{{GPX['gpx']}}}gpx"
    assert root.get("version") == "1.1"
    eco = served.ask("/route", ASKED)["routes"][0]
    points = root.findall(".//gpx:trkpt", GPX)
    track = [(float(point.get("lon", "")), float(point.get("lat", ""))) for point in points]
    assert np.asarray(track) == pytest.approx(np.asarray(eco["geometry"]["coordinates"]), abs=1e-6)
    heights_m = [float(point.findtext("gpx:ele", "", GPX)) for point in points]
    assert heights_m[0] == pytest.approx(eco["height_start_m"], abs=0.06)
    assert heights_m[-1] == pytest.approx(eco["links"][-1]["height_end_m"], abs=0.06)
    assert len(root.findall("gpx:wpt", GPX)) == 2


def test_miles_are_shown_beside_the_same_energy(routes: MapPage):
    before = shown_routes(routes)["eco"]
    routes.page.get_by_role("button", name="Units: kilometres").click()
    after = shown_routes(routes)["eco"]
    assert shown_number(after, "mi,")[0] == pytest.approx(shown_number(before, "km,")[0] / 1.609344, abs=1)
    assert shown_number(after, "kWh") == shown_number(before, "kWh")
    expect(routes.page.get_by_role("slider", name="Place along the route")).to_contain_text("mi")
