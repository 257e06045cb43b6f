"""leaflet-routing-machine, its geocoder, and MapLibre's directions, as they are published, in a browser."""

from __future__ import annotations

import json
import subprocess
from typing import TYPE_CHECKING, Any, Final

import pytest

from tests.app.http.faces.front_ends import packages, page_address
from tests.app.http.faces.on_the_map import ALSENWICK, AT_SEA, ID4, PASS_ROAD, VALLEY_ROAD

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from tests.web.served import ServedMap

FOUND: Final = "() => window.found.length > 0 && window.found.at(-1).length"
LAST: Final = """() => window.found.at(-1).map((route) => ({
    name: route.name,
    points: route.coordinates.length,
    way_m: route.summary.totalDistance,
    texts: route.instructions.map((instruction) => instruction.text),
    turns: route.instructions.map((instruction) => instruction.type),
    ends: route.waypointIndices.map((k) => [route.coordinates[k].lng, route.coordinates[k].lat]),
}))"""
# every text of every step in every language of the library; what it can't make a text of is thrown
TEXTS: Final = """
const texts = require("osrm-text-instructions")("v5");
const { supportedCodes } = require("osrm-text-instructions/languages");
const steps = JSON.parse(require("fs").readFileSync(0));
const unknown = [];
console.log = (line) => unknown.push(line);
const made = supportedCodes.map((code) => steps.map((step) => texts.compile(code, step, { legCount: 1, legIndex: 0 })));
process.stdout.write(JSON.stringify({ codes: supportedCodes, made, unknown }));
"""


def opened(page: Page, address: str) -> Any:
    page.goto(address)
    page.wait_for_function(FOUND)
    return page.evaluate(LAST)


def test_leaflet_routing_machine_draws_routes_with_texts(page: Page, pages: str, served: ServedMap) -> None:
    routes = opened(page, page_address(pages, "leaflet", served.address, [ALSENWICK, PASS_ROAD], profile=ID4))
    own = served.ask("/route", {"start": ALSENWICK, "goal": PASS_ROAD, "vehicle": "vw-id4", "soc": 0.9})["routes"][0]
    assert routes[0]["way_m"] == pytest.approx(own["distance_m"], abs=0.06)
    assert routes[0]["texts"][0].startswith("Head northeast on ")
    assert routes[0]["texts"][-1].startswith("You have arrived at your destination")
    assert not any("{" in text or "undefined" in text for text in routes[0]["texts"])
    assert len(routes) > 1
    assert page.locator(".leaflet-routing-alt").count() == len(routes)
    assert page.locator(".leaflet-routing-alt").first.inner_text().startswith(routes[0]["name"])
    assert page.locator("path.leaflet-interactive").count() > 0


def test_leaflet_routing_machine_goes_over_places_and_moves_them(page: Page, pages: str, served: ServedMap) -> None:
    routes = opened(page, page_address(pages, "leaflet", served.address, [ALSENWICK, VALLEY_ROAD, PASS_ROAD]))
    for end, place in zip(routes[0]["ends"], [ALSENWICK, VALLEY_ROAD, PASS_ROAD], strict=True):
        assert end == pytest.approx(place, abs=1e-3)
    page.evaluate("window.found.length = 0; window.control.spliceWaypoints(1, 1)")
    page.wait_for_function(FOUND)
    assert len(page.evaluate(LAST)[0]["ends"]) == 2


def test_leaflet_routing_machine_speaks_german_by_its_own_library(page: Page, pages: str, served: ServedMap) -> None:
    routes = opened(page, page_address(pages, "leaflet", served.address, [ALSENWICK, PASS_ROAD], language="de"))
    assert routes[0]["texts"][0].startswith("Fahren Sie Richtung Nordosten")
    assert routes[0]["texts"][-1].startswith("Sie haben Ihr Ziel erreicht")


def test_leaflet_routing_machine_hears_a_refusal(page: Page, pages: str, served: ServedMap) -> None:
    page.goto(page_address(pages, "leaflet", served.address, [ALSENWICK, AT_SEA]))
    page.wait_for_function("() => window.refused.length > 0")
    answer = page.evaluate("window.refused[0].target.responseText")
    assert json.loads(answer)["code"] == "NoSegment"


@pytest.mark.parametrize("form", ["nominatim", "photon"])
def test_leaflet_control_geocoder_finds_places_by_name_and_by_position(
    page: Page, pages: str, served: ServedMap, form: str
) -> None:
    page.goto(page_address(pages, "leaflet", served.address))
    (first, *_) = page.evaluate(f"window.geocoders.{form}.geocode('Rowan Lane, Alsenwick')")
    assert "Rowan Lane" in first["name"]
    assert [first["center"]["lng"], first["center"]["lat"]] == pytest.approx(ALSENWICK, abs=0.02)
    place = f"{{lat: {ALSENWICK[1]}, lng: {ALSENWICK[0]}}}"
    (near, *_) = page.evaluate(f"window.geocoders.{form}.reverse({place}, 256 * 2 ** 17)")
    assert "Alsenwick" in near["name"]


def drawn(page: Page, address: str, places: list[list[float]]) -> Any:
    page.goto(address)
    page.wait_for_function("() => window.directions")
    page.evaluate("(places) => window.directions.setWaypoints(places)", places)
    page.wait_for_function("() => window.answers.length > 0 && window.directions.routelines.length > 0")
    return page.evaluate(
        """() => ({
            code: window.answers.at(-1).code,
            snapped: window.directions.snappointsCoordinates,
            legs: window.directions.routelines.map((route) =>
                [...new Set(route.map((part) => part.properties.legIndex))]),
            parts: window.directions.routelines[0].map((part) => part.geometry.coordinates),
        })"""
    )


@pytest.mark.parametrize(
    ("options", "post"),
    [
        ({}, "false"),
        ({"geometries": "polyline6", "overview": "full", "alternatives": "true"}, "false"),
        ({"geometries": "geojson", "overview": "simplified"}, "false"),
        ({"geometries": "polyline6", "overview": "full"}, "true"),
    ],
)
def test_maplibre_directions_draw_each_leg_between_the_places_on_the_road(
    page: Page, pages: str, served: ServedMap, options: dict[str, str], post: str
) -> None:
    address = page_address(pages, "maplibre", served.address, profile=ID4, options=json.dumps(options), post=post)
    found = drawn(page, address, [ALSENWICK, VALLEY_ROAD, PASS_ROAD])
    assert found["code"] == "Ok"
    assert len(found["legs"]) >= (2 if "alternatives" in options else 1)
    assert all(legs == [0, 1] for legs in found["legs"])
    first, last = found["parts"]
    for at, place in ((first[0], 0), (last[0], 1), (last[-1], 2)):
        assert at == pytest.approx(found["snapped"][place], abs=2e-5)


def test_osrm_text_instructions_make_texts_of_all_steps_in_all_languages(served: ServedMap) -> None:
    folder = packages()
    places = ";".join(f"{lon},{lat}" for lon, lat in (ALSENWICK, VALLEY_ROAD, PASS_ROAD))
    routes = served.ask(f"/osrm/route/v1/driving/{places}?steps=true&alternatives=true")["routes"]
    steps = [step for route in routes for leg in route["legs"] for step in leg["steps"]]
    run = subprocess.run(
        ["node", "-e", TEXTS], input=json.dumps(steps), cwd=folder, capture_output=True, text=True, check=True
    )
    answer = json.loads(run.stdout)
    assert len(answer["codes"]) > 20
    assert answer["unknown"] == []
    for texts in answer["made"]:
        assert len(texts) == len(steps)
        assert all(text and "{" not in text and "undefined" not in text for text in texts)
