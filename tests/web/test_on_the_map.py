"""What lies on the map is clicked and pointed at: routes, hot stretches, residuals; files come in and go out."""

from __future__ import annotations

import json
import re
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from playwright.sync_api import expect

from benchmarks.browser import ROOT
from energy.replay.replay import DrivenProfile, replay
from energy.units import KMH_PER_MPS
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from routing.graph.earth import METRE_PER_DEGREE
from tests.web.conftest import CAR
from tests.web.map_page import shown_number
from tests.web.test_places import box_of, click_map, mercator
from tests.web.test_range import ASKED as RANGE_ASKED
from tests.web.test_range import QUERY as RANGE_QUERY
from tests.web.test_routes import ASKED, GOAL, QUERY, START, card, saved

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from playwright.sync_api import JSHandle

    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap

BELOW_MARKER_PX = 5  # from a marker's lower edge to its place
APART_PX = 30  # of a place that is clicked from all that could be hit in its stead
BESIDE_PX = 8  # of a place that is clicked from what lies over the map
CURSOR_PX = 11  # radius of the cursor on the map, with its edge
STREET = ((-29.92, -71.255), (-29.905, -71.24))
CONSUMER_W = 2500.0
SAME_COLOUR = 0.03
LONGEST_S = 60.0
MADE_FILES = """([names, text]) => {
  const transfer = new DataTransfer();
  for (const name of names) transfer.items.add(new File([text], name));
  return transfer;
}"""


@dataclass(frozen=True)
class Looked:
    """A page that shows routes, what the service answers for them, and where places lie on its map."""

    page: MapPage
    routes: dict[str, dict[str, Any]]

    def pixels_of(self, positions: Any) -> NDArray[np.float64]:
        """Where positions [lon, lat] lie on the map [px from its upper left corner], shape (n, 2)."""
        box = box_of(self.page.page.locator("#map"))
        known = np.array([mercator(START), mercator(GOAL)])
        shown = []
        for title in ("Start", "Goal"):
            marker = box_of(self.page.marker(title))
            x, y = marker["x"] + marker["width"] / 2, marker["y"] + marker["height"] + BELOW_MARKER_PX
            shown.append((x - box["x"], y - box["y"]))
        scale = np.linalg.norm(np.diff(shown, axis=0)) / np.linalg.norm(np.diff(known, axis=0))
        points = np.array([mercator((lat, lon)) for lon, lat in positions])
        pixels: NDArray[np.float64] = np.mean(shown, axis=0) + (points - known.mean(axis=0)) * scale
        return pixels

    def line(self, name: str) -> NDArray[np.float64]:
        """Where a route's coordinates lie on the map [px], shape (n, 2)."""
        return self.pixels_of(self.routes[name]["geometry"]["coordinates"])

    def clickable(self, pixels: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of these pixels lie on the map beside the legend and the markers."""
        map_box = box_of(self.page.page.locator("#map"))
        free = np.all(
            (pixels > APART_PX) & (pixels < (map_box["width"] - APART_PX, map_box["height"] - APART_PX)), axis=1
        )
        for over in [self.page.page.locator("#legend"), self.page.marker("Start"), self.page.marker("Goal")]:
            box = box_of(over)
            low = np.array((box["x"] - map_box["x"], box["y"] - map_box["y"]))
            high = low + np.array((box["width"], box["height"]))
            free &= ~np.all((pixels > low - BESIDE_PX) & (pixels < high + BESIDE_PX), axis=1)
        return np.asarray(free)

    def along_m(self, name: str) -> NDArray[np.float64]:
        """Distance of a route's coordinates from its start [m]: even between the ends of a link."""
        route = self.routes[name]
        lon, lat = np.asarray(route["geometry"]["coordinates"]).T
        drawn = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(lon) * np.cos(np.radians(lat[:-1])), np.diff(lat)))))
        ends = [0, *(link["geometry_end"] for link in route["links"])]
        lengths_m = np.cumsum([0.0, *(link["length_m"] for link in route["links"])])
        return np.asarray(np.interp(drawn, drawn[ends], lengths_m))

    def point_at(self, name: str, along_m: float) -> NDArray[np.float64]:
        """Where the place at a distance along a route lies on the map [px], shape (2,)."""
        at_m, line = self.along_m(name), self.line(name)
        return np.array([np.interp(along_m, at_m, line[:, 0]), np.interp(along_m, at_m, line[:, 1])])


@pytest.fixture
def looked(visit: Visit, served: ServedMap) -> Looked:
    """The page with a journey of several routes, of which eco is looked at."""
    page = visit(QUERY)
    expect(card(page, "Eco")).to_be_checked()
    page.picture()
    return Looked(page, {route["name"]: route for route in served.ask("/route", ASKED)["routes"]})


def check_only_changed_around(
    before: NDArray[np.float64], after: NDArray[np.float64], pixel: NDArray[np.float64]
) -> None:
    """Two pictures differ in the cursor's disc around this pixel, and nowhere else."""
    rows, columns = np.nonzero(np.abs(before - after).max(axis=2) > 0.02)
    assert rows.size > 0.3 * np.pi * CURSOR_PX**2
    changed = np.column_stack((columns, rows)) + 0.5
    assert (changed.min(axis=0) + changed.max(axis=0)) / 2 == pytest.approx(pixel, abs=3.0)
    assert np.hypot(*(changed - pixel).T).max() < CURSOR_PX + 4


def test_click_on_another_routes_line_makes_it_the_chosen_one(looked: Looked) -> None:
    other = looked.line("fastest")
    rivals = np.concatenate([looked.line("eco"), looked.line("balanced")])
    apart_px = np.hypot(*(other[:, None, :] - rivals[None, :, :]).transpose(2, 0, 1)).min(axis=1)
    apart_px[~looked.clickable(other)] = 0.0
    assert apart_px.max() > APART_PX
    click_map(looked.page, tuple(other[apart_px.argmax()]))
    expect(card(looked.page, "Fastest")).to_be_checked()
    expect(looked.page.page.locator("#announcer")).to_contain_text("Fastest")
    assert looked.page.address_query()["route"] == "fastest"
    assert looked.page.place("Goal") == GOAL
    assert len(looked.page.sent) == 1


def test_pointer_on_the_chosen_line_moves_the_charts_cursor(looked: Looked) -> None:
    page = looked.page.page
    reading = page.locator(".profile-reading")
    slider = page.get_by_role("slider", name="Place along the route")
    expect(reading).to_contain_text("Point at the chart")
    box = box_of(page.locator("#map"))
    pixel_km = 1e-3 * looked.routes["eco"]["distance_m"] / np.hypot(*np.diff(looked.line("eco"), axis=0).T).sum()
    for share in (0.3, 0.6):
        wanted_m = share * looked.routes["eco"]["distance_m"]
        x, y = looked.point_at("eco", wanted_m)
        page.mouse.move(box["x"] + x, box["y"] + y)
        expect(reading).not_to_contain_text("Point at the chart")
        found_km = float(slider.get_attribute("aria-valuenow") or "")
        assert found_km == pytest.approx(wanted_m / 1000, abs=0.1 + 4 * pixel_km)
        assert shown_number(reading.inner_text(), "km")[0] == pytest.approx(found_km, abs=0.1)
        expect(page.locator(".profile-cursor circle")).to_have_count(3)
    page.mouse.move(box["x"] + 5, box["y"] + box["height"] / 2)
    expect(reading).to_contain_text("Point at the chart")


def test_pointer_on_the_chart_shows_its_place_on_the_map(looked: Looked) -> None:
    page = looked.page.page
    plot = page.get_by_role("slider", name="Place along the route")
    box = box_of(plot)
    bare = looked.page.picture()
    for share in (0.4, 0.8):
        page.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
        after = looked.page.picture()
        along_km = float(plot.get_attribute("aria-valuenow") or "")
        assert along_km == pytest.approx(share * looked.routes["eco"]["distance_m"] / 1000, rel=0.1)
        check_only_changed_around(bare, after, looked.point_at("eco", 1000 * along_km))
    page.mouse.move(box["x"] - 100, box["y"] + box["height"] / 2)
    assert looked.page.changed_frac(after, 1e-5) < 0.002
    assert np.abs(looked.page.picture() - bare).max() < 0.02


def test_click_on_a_hot_stretchs_line_marks_it_in_the_list(looked: Looked) -> None:
    hot = looked.routes["eco"]["hot_links"]
    buttons = looked.page.page.locator("#routes ol").get_by_role("button")
    expect(buttons).to_have_count(len(hot))
    pressed = buttons.and_(looked.page.page.locator("[aria-pressed=true]"))
    expect(pressed).to_have_count(0)
    middles = np.array([looked.point_at("eco", (stretch["from_m"] + stretch["to_m"]) / 2) for stretch in hot])
    lengths_m = np.array([stretch["to_m"] - stretch["from_m"] for stretch in hot])
    picked = int(np.where(looked.clickable(middles), lengths_m, 0.0).argmax())
    click_map(looked.page, tuple(middles[picked]))
    expect(buttons.nth(picked)).to_have_attribute("aria-pressed", "true")
    expect(pressed).to_have_count(1)
    expect(looked.page.page.locator(".profile-stretch")).to_have_count(1)
    assert looked.page.place("Goal") == GOAL


def test_range_is_saved_as_geojson_that_is_the_answer(visit: Visit, served: ServedMap) -> None:
    page = visit(RANGE_QUERY)
    with page.asking("/range") as found:
        page.page.get_by_label("Bands").fill("2")
    expect(page.page.locator("#range tbody tr")).to_have_count(2)
    name, text = saved(page, "GeoJSON")
    assert name == "range.geojson"
    collection = json.loads(text)
    assert collection == found.answer
    again = served.ask("/range", {**RANGE_ASKED, "bands": found.body["bands"]})
    assert collection["features"] == again["features"]


def test_dropped_recordings_are_listed_in_the_form(visit: Visit) -> None:
    page = visit("?tab=diagnosis").page
    zone = page.locator(".drop-zone")
    begin = page.get_by_role("button", name=re.compile("^Diagnose"))
    expect(begin).to_be_disabled()

    def files(*names: str) -> JSHandle:
        return page.evaluate_handle(MADE_FILES, [names, "time_s,speed_kmh,power_w\n" + 100 * "0,10,500\n"])

    zone.dispatch_event("dragover", {"dataTransfer": files("monday.csv")})
    expect(zone).to_have_attribute("data-over", "")
    zone.dispatch_event("drop", {"dataTransfer": files("monday.csv", "tuesday.jsonl", "notes.txt")})
    expect(zone).not_to_have_attribute("data-over", "")
    names = page.get_by_role("form", name="New diagnosis").locator(".file-name")
    expect(names).to_have_text(["monday.csv", "tuesday.jsonl"])
    expect(page.locator("#toast")).to_contain_text("1 file left aside")
    zone.dispatch_event("drop", {"dataTransfer": files("wednesday.csv.gz", "monday.csv")})
    expect(names).to_have_text(["monday.csv", "tuesday.jsonl", "wednesday.csv.gz"])
    expect(begin).to_have_text("Diagnose 3 recordings")
    expect(begin).to_be_enabled()
    page.get_by_role("button", name="Leave out tuesday.jsonl").click()
    expect(names).to_have_text(["monday.csv", "wednesday.csv.gz"])


def under(page: MapPage, over: str, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which pixels of the map's picture lie under another element."""
    map_box, box = box_of(page.page.locator("#map")), box_of(page.page.locator(over))
    west_px, north_px = int(box["x"] - map_box["x"]), int(box["y"] - map_box["y"])
    covered = np.zeros(shape[:2], np.bool_)
    covered[north_px : north_px + int(box["height"]) + 1, west_px : west_px + int(box["width"]) + 1] = True
    return covered


def same_colour(picture: NDArray[np.float64], rgb: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which pixels of a picture have a colour, shape (height, width)."""
    return np.asarray(np.abs(picture - rgb).max(axis=2) < SAME_COLOUR)


def drive_along(positions: NDArray[np.float64], car: Vehicle, top_kmh: float) -> bytes:
    """A recording of a flat drive along positions (n, 2) [lon, lat], whose second half has a consumer of its own."""
    lon, lat = positions.T
    east_m = np.diff(lon) * METRE_PER_DEGREE * np.cos(np.radians(lat[:-1]))
    at_m = np.concatenate(([0.0], np.cumsum(np.hypot(east_m, np.diff(lat) * METRE_PER_DEGREE))))
    top_mps = top_kmh / KMH_PER_MPS
    steady = np.full(int(at_m[-1] / top_mps - top_mps), top_mps)
    speed = np.concatenate((np.arange(0.0, top_mps), steady, np.arange(top_mps, 0.0, -1.0), [0.0]))
    time_s = np.arange(float(speed.size))
    way_m = np.concatenate(([0.0], np.cumsum(0.5 * (speed[:-1] + speed[1:]))))
    steps_w = replay(car, DrivenProfile(time_s, speed)).power_w
    power_w = np.append(steps_w, steps_w[-1]) + CONSUMER_W * (way_m > at_m[-1] / 2)
    table = np.column_stack(
        (time_s, speed * KMH_PER_MPS, power_w, np.interp(way_m, at_m, lat), np.interp(way_m, at_m, lon))
    )
    rows = "\n".join(",".join(f"{value:.7f}" for value in row) for row in table)
    return f"time_s,speed_kmh,power_w,lat,lon\n{rows}\n".encode()


@pytest.fixture(scope="module")
def driven(served: ServedMap) -> dict[str, Any]:
    """A diagnosis of three drives along streets of coquimbo, done."""
    car = load_vehicle(ROOT / f"data/vehicles/{CAR}.toml")
    assert isinstance(car, Vehicle)
    start, goal = ({"lat": lat, "lon": lon} for lat, lon in STREET)
    (route,) = served.ask("/route", {"graph": "coquimbo", "start": start, "goal": goal, "soc": 0.8})["routes"][:1]
    positions = np.asarray(route["geometry"]["coordinates"])
    files = [("recordings", (f"drive-{kmh}.csv", drive_along(positions, car, kmh), "text/csv")) for kmh in (28, 33, 38)]
    queued = served.client.post("/diagnoses", data={"vehicle": CAR, "graph": "coquimbo"}, files=files)
    assert queued.status_code == 202, queued.text
    answer: dict[str, Any] = queued.json()
    last_s = time.monotonic() + LONGEST_S
    while answer["state"] in ("queued", "running") and time.monotonic() < last_s:
        time.sleep(0.2)
        answer = served.ask(f"/diagnoses/{answer['id']}")
    assert answer["state"] == "done", answer
    return answer


def test_residuals_are_coloured_on_the_map_shown_under_the_pointer_and_leave_with_the_tab(
    visit: Visit, driven: dict[str, Any], served: ServedMap
) -> None:
    residuals = served.ask(driven["links"]["residuals"])
    assert residuals["kind"] == "links"
    links = [link["properties"] for link in residuals["features"]]
    most = max(links, key=lambda link: link["mean_w"])
    coloured = [link for link in links if link["stroke"] == most["stroke"] and link["stroke-opacity"] == 1.0]
    assert most["mean_w"] == pytest.approx(CONSUMER_W, rel=0.1)
    page = visit(f"?graph=coquimbo&tab=diagnosis&diagnosis={driven['id']}")
    legend = page.page.locator("#legend")
    expect(legend).to_contain_text("Measured less modelled")
    expect(legend).to_contain_text("All drives, by road")
    expect(legend.get_by_role("img", name=re.compile("blue"))).to_be_visible()
    drawn = page.picture()
    red = np.array(to_rgb(most["stroke"]))
    rows, columns = np.nonzero(same_colour(drawn, red) & ~under(page, "#legend", drawn.shape))
    assert rows.size > 500
    expect(legend.locator(".residual-readout")).to_have_text("Point at a road to read it.")
    middle = rows.size // 2
    page.page.locator("#map").hover(position={"x": int(columns[middle]), "y": int(rows[middle])})
    expect(legend).to_contain_text(" W")
    readout = legend.locator(".residual-readout").inner_text()
    shown_w = shown_number(readout, "W")[0]
    pointed = [
        link for link in coloured if link["name"] in readout and shown_w == pytest.approx(link["mean_w"], rel=0.01)
    ]
    assert pointed, readout
    low_w, high_w = pointed[0]["ci95"]
    assert ("95 %" in readout) == (low_w < high_w), readout
    page.page.get_by_role("tab", name="Route").click()
    expect(legend).to_be_hidden()
    assert np.count_nonzero(same_colour(page.picture(), red)) < 0.02 * rows.size


def test_report_of_a_result_opens_as_a_page_of_its_own(visit: Visit, driven: dict[str, Any]) -> None:
    page = visit(f"?graph=coquimbo&tab=diagnosis&diagnosis={driven['id']}").page
    with page.context.expect_event(
        "response", lambda response: response.url.endswith(driven["links"]["report"])
    ) as answered:
        with page.expect_popup() as opened:
            page.get_by_role("link", name="Report", exact=True).click()
        report = opened.value
        report.wait_for_load_state()
    assert answered.value.status == 200
    assert report.title().startswith(f"Diagnosis of {CAR}:")
    expect(report.locator("body")).to_contain_text("drive-33")


def test_extents_over_the_antimeridian_are_the_small_ones(page: MapPage):
    found = page.page.evaluate(
        """async () => {
          const { extentOf } = await import("/web/js/map/view.js");
          return [[[179.9, -17], [-179.8, -16]], [[-36, 43], [12, 44]], [[-71, -30]]].map(extentOf);
        }"""
    )
    assert found == [[179.9, -17, pytest.approx(180.2), -16], [-36, 43, 12, 44], [-71, -30, -71, -30]]
