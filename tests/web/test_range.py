"""The area that can be reached: follows every choice, is drawn and shown as the service answers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.web.map_page import check_shown, shown_number

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap

PLACE = {"lat": 43.872, "lon": -36.433}
QUERY = "?tab=range&start=43.872,-36.433&soc=30"
ASKED = {"origin": PLACE, "soc": 0.3, "reserve_soc": 0.1, "graph": "highlands", "bands": [0.1, 0.15, 0.2, 0.25]}


def bands_of(answer: Any) -> list[dict[str, Any]]:
    """Properties of the bands of an answer, the outermost first."""
    return [feature["properties"] for feature in answer["features"] if feature["properties"]["kind"] == "band"]


def areas_km2(page: MapPage) -> list[float]:
    """The areas that the table shows."""
    rows = page.page.locator("#range tbody tr")
    return [shown_number(rows.nth(i).inner_text(), "km²")[0] for i in range(rows.count())]


def check_table(page: MapPage, answer: Any) -> None:
    """The table shows each band of the answer, and the screen reader hears of the outermost."""
    bands = bands_of(answer)
    rows = page.page.locator("#range tbody tr")
    expect(rows).to_have_count(len(bands))
    for i, band in enumerate(bands):
        expect(rows.nth(i)).to_contain_text("km²")
        check_shown(rows.nth(i).inner_text(), "%", 100 * band["soc_left"])
        check_shown(rows.nth(i).inner_text(), "km²", band["area_km2"])
    check_shown(page.page.locator("#announcer").inner_text(), "km²", bands[0]["area_km2"])


def test_range_is_drawn_and_shown_as_the_service_answers(visit: Visit, served: ServedMap):
    page = visit("?tab=range&soc=30")
    before = page.picture()
    with page.asking("/range") as found:
        page.type_place("Place", (PLACE["lat"], PLACE["lon"]))
    assert found.body == ASKED
    check_table(page, served.ask("/range", ASKED))
    legend = page.page.locator("#legend")
    expect(legend.get_by_role("listitem")).to_have_count(4)
    assert page.changed_frac(before, 0.01) < 0.6
    page.page.get_by_role("button", name="Remove place").click()
    expect(legend).to_be_hidden()
    expect(page.page.locator("#range tbody")).to_have_count(0)


def test_more_charge_reaches_a_larger_area_and_more_reserve_a_smaller_one(visit: Visit):
    page = visit(QUERY)
    outermost = []
    for percent in (15, 30, 60):
        with page.asking("/range") as found:
            page.page.get_by_label("Charge now").fill(str(percent))
        assert found.body["soc"] == percent / 100
        check_table(page, found.answer)
        outermost.append(areas_km2(page)[0])
    assert outermost == sorted(set(outermost))
    with page.asking("/range") as kept:
        page.page.get_by_label("Reserve").fill("40")
    assert kept.body["reserve_soc"] == 0.4
    check_table(page, kept.answer)
    assert areas_km2(page)[0] < outermost[-1]


def test_reserve_never_exceeds_the_charge(visit: Visit):
    page = visit(QUERY)
    with page.asking("/range") as found:
        page.page.get_by_label("Charge now").fill("5")
    assert (found.body["soc"], found.body["reserve_soc"]) == (0.05, 0.05)
    expect(page.page.get_by_label("Reserve")).to_have_value("5")


def test_slider_that_is_moved_fast_asks_less_often_and_shows_the_last_answer(visit: Visit, served: ServedMap):
    page = visit(QUERY)
    expect(page.page.locator("#range tbody tr")).to_have_count(4)
    page.sent.clear()
    slider = page.page.get_by_label("Charge now")
    slider.focus()
    for _ in range(20):
        page.page.keyboard.press("ArrowRight")
    expect(slider).to_have_value("50")
    last = served.ask("/range", {**ASKED, "soc": 0.5, "bands": [0.1, 0.2, 0.3, 0.4]})
    expect(page.page.locator("#announcer")).to_contain_text(f"{bands_of(last)[0]['area_km2']:,.0f} km²")
    check_table(page, last)
    charges = [body["soc"] for _, body in page.sent]
    assert charges[-1] == 0.5
    assert len(charges) < 20


def test_answer_that_was_overtaken_is_never_shown(visit: Visit):
    page = visit(QUERY)
    expect(page.page.locator("#range tbody tr")).to_have_count(4)

    def late(route: Any) -> None:
        if route.request.post_data_json["soc"] != 0.2:
            route.continue_()  # the answer for 20 % never comes

    page.page.route("**/range", late)
    with page.page.expect_request("**/range"):
        page.page.get_by_label("Charge now").fill("20")
    expect(page.page.locator("#range .busy-line")).to_be_visible()
    with page.asking("/range") as found:
        page.page.get_by_label("Charge now").fill("60")
    check_table(page, found.answer)
    assert found.body["soc"] == 0.6


def test_range_modes_are_asked_for_and_shown(visit: Visit, served: ServedMap):
    page = visit(QUERY)
    modes = {"To here": {"reverse": True}, "Round trip": {"round_trip": True}, "From here": {}}
    outermost_km2 = {}
    for label, asked in modes.items():
        with page.asking("/range") as found:
            page.page.get_by_role("radio", name=label).check()
        assert found.body == {**ASKED, **asked}
        check_table(page, served.ask("/range", {**ASKED, **asked}))
        outermost_km2[label] = areas_km2(page)[0]
    assert outermost_km2["Round trip"] < min(outermost_km2["To here"], outermost_km2["From here"])


def test_bands_slider_changes_how_many_there_are(visit: Visit):
    page = visit(QUERY)
    for count in (1, 6):
        with page.asking("/range") as found:
            page.page.get_by_label("Bands").fill(str(count))
        assert len(bands_of(found.answer)) == count
        check_table(page, found.answer)
        expect(page.page.locator("#legend").get_by_role("listitem")).to_have_count(count)


def test_cold_snow_and_payload_each_shrink_the_area_and_defaults_bring_it_back(visit: Visit):
    page = visit(QUERY)
    expect(page.page.locator("#range tbody tr")).to_have_count(4)
    area = areas_km2(page)[0]
    first = area
    page.page.get_by_text("Weather and load").click()
    with page.asking("/range"):
        page.page.get_by_label("Count the air temperature").check()
    steps = (
        (lambda: page.page.get_by_label("Air temperature", exact=True).fill("-10"), {"ambient_c": -10}),
        (lambda: page.page.get_by_role("radio", name="Snow").check(), {"road": "snow"}),
        (lambda: page.page.get_by_label("Payload").fill("300"), {"payload_kg": 300}),
    )
    conditions: dict[str, Any] = {}
    for step, sets in steps:
        conditions |= sets
        with page.asking("/range") as found:
            step()
        assert found.body["conditions"] == conditions
        check_table(page, found.answer)
        assert areas_km2(page)[0] < area
        area = areas_km2(page)[0]
    expect(page.page.locator("#conditions summary")).to_contain_text("−10 °C, snow, 300 kg")
    with page.asking("/range") as back:
        page.page.get_by_role("button", name="Back to defaults").click()
    assert back.body == ASKED
    check_table(page, back.answer)
    assert areas_km2(page)[0] == first


def test_uncertain_range_shows_how_sure_each_area_is(visit: Visit):
    page = visit(QUERY)
    page.page.get_by_text("Weather and load").click()
    with page.asking("/range") as found:
        page.page.get_by_label("Show how sure the answer is").check()
    assert found.body["uncertainty"] is True
    expect(page.page.locator("#range thead th")).to_have_count(3)
    rows = page.page.locator("#range tbody tr")
    expect(rows).to_have_count(len(bands_of(found.answer)))
    shown = {rows.nth(i).get_by_role("cell").nth(2).inner_text() for i in range(rows.count())}
    assert shown == {f"{100 * band['probability']:.0f} %" for band in bands_of(found.answer)}


def dark_frac(picture: NDArray[np.float64]) -> float:
    """Share of pixels as dark as the dashes that are drawn where the map ends."""
    return float(np.mean(picture.max(axis=2) < 0.25))


def test_range_that_ends_with_the_map_is_dashed_there_and_says_so(visit: Visit):
    page = visit("?tab=range&graph=coquimbo&start=-29.95,-71.25&soc=1&reserve=0&bands=1")
    legend = page.page.locator("#legend")
    expect(legend.get_by_role("listitem")).to_have_count(1)
    before = page.picture()
    with page.asking("/range") as found:
        page.page.get_by_label("Charge now").fill("4")
    outer = bands_of(found.answer)[0]
    assert outer["reaches_map_edge"] is True
    expect(legend.get_by_role("listitem")).to_have_text([re.compile("≥ 0 %"), "beyond this map"])
    expect(page.page.locator("#range")).to_contain_text("map ends")
    (told,) = [text for text in page.page.locator("#range p").all_inner_texts() if "as the crow flies" in text]
    check_shown(told.split("beyond this map")[1], "kWh", outer["map_edge_left_kwh"])
    check_shown(told.split("along roads")[0].split("up to")[1], "km", outer["road_farthest_km"])
    page.changed_frac(before, 0.01)
    assert dark_frac(page.picture()) > dark_frac(before) + 1e-4
    page.page.get_by_role("button", name="Remove place").click()
    expect(legend).to_be_hidden()


def test_miles_are_shown_in_place_of_kilometres(visit: Visit):
    page = visit(QUERY)
    expect(page.page.locator("#range tbody tr")).to_have_count(4)
    km2 = areas_km2(page)[0]
    page.page.get_by_role("button", name="Units: kilometres").click()
    expect(page.page.locator("#range tbody")).to_contain_text("mi²")
    text = page.page.locator("#range tbody tr").first.inner_text()
    assert shown_number(text, "mi²")[0] == pytest.approx(km2 / 1.609344**2, rel=0.01, abs=1)
    assert page.address_query()["units"] == "mi"
    expect(page.page.locator(".maplibregl-ctrl-scale")).to_contain_text("mi")
