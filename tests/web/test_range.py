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
    for by, outline in (("Minutes", "Filled"), ("km", "Along roads")):
        page.page.get_by_role("radio", name=outline).check()
        with page.asking("/range") as found:
            page.page.get_by_role("radio", name=by, exact=True).check()
        assert bands_of(found.answer)[0]["reaches_map_edge"] is True
        expect(legend.get_by_role("listitem")).to_have_text([re.compile("≤"), "beyond this map"])
        expect(page.page.locator("#range")).to_contain_text("along roads, and beyond this map.")
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


def test_bands_by_energy_time_and_distance_are_asked_for_and_shown_in_their_units(visit: Visit, served: ServedMap):
    page = visit(QUERY)
    shown = page.page
    legend, panel = shown.locator("#legend"), shown.locator("#range")
    plain = {key: value for key, value in ASKED.items() if key != "bands"}
    by = {
        "Energy": ({"by": "energy", "limits": [3, 6, 9, 12]}, "Energy taken", "kWh"),
        "Minutes": ({"by": "time", "limits": [15, 30, 45, 60]}, "Driving time", "min"),
        "km": ({"by": "distance", "limits": [20, 40, 60, 80]}, "Distance driven", "km"),
    }
    with page.asking("/range"):
        shown.get_by_role("radio", name="Round trip").check()
    for label, (asked, head, unit) in by.items():
        with page.asking("/range") as found:
            shown.get_by_role("radio", name=label, exact=True).check()
        assert found.body == {**plain, **asked, **({"round_trip": True} if label == "Energy" else {})}
        bands = bands_of(served.ask("/range", found.body))
        expect(legend.get_by_role("heading")).to_have_text(head)
        for lines in (legend.get_by_role("listitem"), shown.locator("#range tbody tr")):
            expect(lines).to_have_count(len(bands))
            for line, band in zip(lines.all_inner_texts(), bands, strict=True):
                check_shown(line, unit, band["limit"])
                check_shown(line, "km²", band["area_km2"])
        for trip in ("To here", "Round trip"):
            expect(shown.get_by_role("radio", name=trip)).to_be_enabled(enabled=label == "Energy")
        check_shown(panel.inner_text().split("Farthest")[1], "km", bands[0]["reach_farthest_km"])
        expect(shown.locator("#announcer")).to_contain_text(f"{bands[0]['limit']:g} {unit}")
    with page.asking("/range") as miles:
        shown.get_by_role("button", name="Units: kilometres").click()
    assert miles.body["limits"] == pytest.approx([10 * k * 1.609344 for k in (1, 2, 3, 4)])
    expect(legend.get_by_role("listitem").first).to_contain_text("≤ 40 mi")
    with page.asking("/range") as back:
        shown.get_by_role("radio", name="Charge", exact=True).check()
    assert back.body == {**ASKED, "round_trip": True}


def test_values_of_ones_own_and_the_outline_are_in_the_link(visit: Visit):
    page = visit(QUERY)
    values = page.page.get_by_label("Values of your own")
    values.fill("twelve")
    values.press("Enter")
    expect(page.page.locator("#range .message")).to_contain_text("“twelve” is no number")
    expect(values).to_have_attribute("aria-invalid", "true")
    with page.asking("/range") as left:
        values.fill("12.5; 5, 20 %")
        values.press("Enter")
    assert left.body == {**ASKED, "bands": [0.1, 0.125, 0.2]}
    expect(page.page.locator("#range")).to_contain_text("Not drawn: 5 %, for the reserve is 10 %")
    expect(page.page.locator("#legend")).to_contain_text("≥ 12.5 %")
    with page.asking("/range"):
        page.page.get_by_role("radio", name="Minutes").check()
    expect(values).to_have_value("")
    with page.asking("/range"):
        values.fill("12,7.5")
        values.press("Enter")
    with page.asking("/range") as filled:
        page.page.get_by_role("radio", name="Filled").check()
    assert (filled.body["limits"], filled.body["outline"]) == ([7.5, 12], "filled")
    outline = page.page.locator("#range p").filter(has_text="Filled: gaps narrower than")
    worst = max(band["false_in_share"] for band in bands_of(filled.answer))
    check_shown(outline.inner_text(), "%", 100 * worst)
    check_shown(outline.inner_text(), "m", filled.answer["filling"]["gap_m"])
    assert page.address_query()["left"] == "5,12.5,20"

    other = visit(page.page.url.removeprefix(f"{page.address}/"))
    assert other.sent[-1] == page.sent[-1]
    expect(other.page.get_by_label("Values of your own")).to_have_value("7.5, 12")
    with other.asking("/range") as again:
        other.page.get_by_role("radio", name="Charge", exact=True).check()
    assert again.body == {**left.body, "outline": "filled"}
    with other.asking("/range") as automatic:
        other.page.get_by_role("button", name="Back to automatic values").click()
    assert automatic.body == {**ASKED, "outline": "filled"}


VALUES = (  # text, what it is of, the values read, or part of what is said
    ("10, 20 30", "time", [10, 20, 30]),
    ("30;10;10", "time", [10, 30]),
    ("7,5; 10 kWh", "energy", [7.5, 10]),
    ("0", "charge", [0]),
    ("  ", "time", None),
    ("0", "time", "A value is 0, allowed: 0.01 to 10,000"),
    ("101", "charge", "A value is 101, allowed: 0 to 100"),
    ("-5", "distance", "A value is -5"),
    ("1e3", "distance", "“1e3” is no number"),
    ("1,2,3,4,5,6,7,8,9", "energy", "There are 9 values, allowed: at most 8"),
)
AUTOMATIC = (  # of the reserve 10 % and four bands: what it is of, charge, battery [kWh], the values
    ("energy", 0.8, 64.0, [10, 20, 30, 40]),
    ("energy", 0.11, 64.0, [0.15, 0.3, 0.45, 0.6]),
    ("energy", 0.1, 64.0, []),
    ("energy", 0.05, 64.0, []),
    ("energy", 0.8, None, [10, 20, 30, 40]),
    ("time", 0.0, 64.0, [15, 30, 45, 60]),
    ("charge", 0.11, 64.0, [10, 11]),
    ("charge", 0.1034, 64.0, [10]),
)


def test_values_are_read_and_made_as_they_should_be(page: MapPage):
    read, made = page.page.evaluate(
        """async ([texts, journeys]) => {
          const { automaticValues, valuesFromText } = await import("/web/js/journey/limits.js");
          const { INITIAL } = await import("/web/js/journey/journey.js");
          return [
            texts.map(([text, by]) => valuesFromText(text, by, { unit: { energy: "kWh" }[by] })),
            journeys.map(([by, soc, kwh]) => automaticValues({ ...INITIAL, by, soc }, kwh)),
          ];
        }""",
        [VALUES, AUTOMATIC],
    )
    for (text, _, expected), found in zip(VALUES, read, strict=True):
        if isinstance(expected, str):
            assert expected in found["error"], text
        else:
            assert found == {"values": expected, "error": ""}, text
    assert made == [values for *_, values in AUTOMATIC]
