"""POST /route with charging stops, on the hand-made grid with four stations."""

from __future__ import annotations

import itertools
import json
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any, Final

import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from shapely.geometry import shape
from starlette.testclient import TestClient

from app.main import create_app
from app.schemas.route import RouteFeatureCollection, RouteResponse
from app.service.service import Service
from energy.charging.charging import Connector
from tests.app.charged import (
    ARRIVE_SOC,
    CAPACITY_KWH,
    CAR,
    CHARGES,
    GOAL_SOC,
    ROUTE,
    START,
    charged_settings,
    timeless,
)
from tests.app.expected import check_problem

if TYPE_CHECKING:
    from collections.abc import Iterator

FAR_CORNER = [8.0, 46.518]
STATIONS = {"osm:n1", "osm:n2", "ocm:3", "ocm:4"}


@pytest.fixture(scope="module")
def charged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A client of the grid with stations, a level one without and one whose stations are damaged."""
    settings = charged_settings(tmp_path_factory.mktemp("graphs"))
    service = Service(settings)
    service.load_all()
    with TestClient(create_app(settings, service)) as client:
        yield client


def body(charging: dict[str, Any] | None = None, **change: object) -> dict[str, Any]:
    return ROUTE | {"charging": ROUTE["charging"] | (charging or {})} | change


def ask(client: TestClient, charging: dict[str, Any] | None = None, **change: object) -> dict[str, Any]:
    response = client.post("/route", json=body(charging, **change))
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


def check_plan(route: dict[str, Any], arrive_soc: float, goal_soc: float, capacity_kwh: float = CAPACITY_KWH) -> None:
    """What holds of every plan: charge and time go on, sums add up, promises are kept."""
    plan, legs = route["charging"], route["legs"]
    assert route["feasible"] is True
    stops = {stop["leg"]: stop for stop in plan["stops"]}
    assert len(stops) == len(plan["stops"])
    assert sorted(stops) == [k for k, leg in enumerate(legs) if leg["ends_at"] == "stop"]
    assert legs[-1]["ends_at"] == "goal"
    clock_s, soc = 0.0, route["soc_start"]
    for k, leg in enumerate(legs):
        assert leg["soc_start"] == pytest.approx(soc, abs=1e-9)
        assert leg["soc_start"] - leg["soc_end"] == pytest.approx(leg["battery_kwh"] / capacity_kwh, abs=1e-9)
        clock_s, soc = clock_s + leg["duration_s"], leg["soc_end"]
        if k not in stops:
            continue
        stop = stops[k]
        assert stop["along_m"] == leg["to_m"]
        assert (stop["arrive_s"], stop["arrive_soc"]) == pytest.approx((clock_s, soc), abs=1e-6)
        if stop["station"] is not None:
            assert stop["arrive_soc"] >= arrive_soc - 1e-9
            assert stop["charged_kwh"] > 0.0
        assert stop["charged_kwh"] == pytest.approx((stop["depart_soc"] - soc) * capacity_kwh, abs=1e-9)
        assert stop["drawn_kwh"] >= stop["charged_kwh"]
        assert stop["depart_s"] - stop["arrive_s"] == pytest.approx(stop["overhead_s"] + stop["charging_s"], abs=1e-6)
        assert 0.0 <= stop["waiting_s"] <= stop["overhead_s"]
        if stop["power_bands"]:
            assert sum(band["seconds"] for band in stop["power_bands"]) == pytest.approx(stop["charging_s"], abs=1e-6)
        clock_s, soc = stop["depart_s"], stop["depart_soc"]
    totals = plan["totals"]
    assert totals["waiting_s"] == sum(stop["waiting_s"] for stop in plan["stops"])
    assert plan["goal"]["arrive_s"] == pytest.approx(clock_s, abs=1e-6)
    assert plan["goal"]["arrive_soc"] == pytest.approx(soc, abs=1e-9)
    assert soc >= goal_soc - 1e-9
    assert totals["total_s"] == pytest.approx(route["total_s"], abs=1e-6) == pytest.approx(clock_s, abs=1e-6)
    assert totals["driving_s"] == pytest.approx(route["duration_s"], abs=1e-6)
    assert totals["total_s"] == totals["driving_s"] + totals["charging_s"] + totals["overhead_s"]
    assert sum(leg["duration_s"] for leg in legs) == pytest.approx(route["duration_s"], abs=1e-6)
    used = {stop["station"]["source"] for stop in plan["stops"] if stop["station"] is not None}
    assert used <= {source["key"] for source in plan["sources"]}
    for source in plan["sources"]:
        assert source["licence"]
        assert source["name"]


def test_plan_is_a_route_over_a_station_whose_charge_and_time_add_up(charged: TestClient) -> None:
    answer = ask(charged)
    (route,) = answer["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    (stop,) = route["charging"]["stops"]
    assert stop["station"]["id"] in {"osm:n2", "ocm:3"}
    assert (stop["socket"]["connector"], stop["socket"]["output_kw"]) == ("ccs2", 150.0)
    assert stop["overhead_s"] == 60.0
    assert answer["no_plan"] is None
    assert answer["planning"]["labels_settled"] > 0
    assert route["soc_end"] == pytest.approx(GOAL_SOC, abs=1e-9)  # no more is charged than the goal asks for


def test_charge_of_links_jumps_where_it_is_charged_and_nowhere_else(charged: TestClient) -> None:
    (route,) = ask(charged)["routes"]
    leg_ends = {leg["last_link"]: leg for leg in route["legs"]}
    soc, jumps = route["soc_start"], 0
    for k, link in enumerate(route["links"]):
        assert soc - link["soc_end"] == pytest.approx(link["energy_wh"] / 1000.0 / CAPACITY_KWH, abs=1e-9)
        soc = link["soc_end"]
        if k in leg_ends and leg_ends[k]["ends_at"] == "stop":
            assert link["rest"] is True
            soc = route["legs"][route["legs"].index(leg_ends[k]) + 1]["soc_start"]
            jumps += 1
    assert jumps == 1


def test_route_within_the_charge_is_a_plan_without_stops_along_the_fastest_way(charged: TestClient) -> None:
    (route,) = ask(charged, soc=1.0)["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    assert route["charging"]["stops"] == []
    assert route["charging"]["sources"] == []
    assert route["total_s"] == route["duration_s"]
    plain = charged.post("/route", json=ROUTE | {"charging": None, "soc": 1.0, "alternatives": ["fastest"]}).json()
    assert route["duration_s"] == pytest.approx(plain["routes"][0]["duration_s"], rel=1e-9)
    assert plain["routes"][0]["charging"] is None
    assert plain["routes"][0]["total_s"] == plain["routes"][0]["duration_s"]
    assert (plain["planning"], plain["no_plan"]) == (None, None)


def test_no_plan_says_why_and_shows_the_way_without_charging(charged: TestClient) -> None:
    answer = ask(charged, {"max_soc": 0.35}, soc=0.3)
    no_plan = answer["no_plan"]
    assert no_plan["missing_kwh"] > 0.0
    assert no_plan["reason"]
    (route,) = answer["routes"]
    assert (route["name"], route["feasible"], route["charging"]) == ("eco", False, None)
    assert route["deficit_kwh"] > 0.0
    (charge,) = [each for each in no_plan["helps"] if each["kind"] == "soc"]
    assert charge["unit"] == "fraction"
    assert charge["text"].startswith(f"departing with {100 * charge['value']:.0f} % instead of 30 %")
    assert ask(charged, {"max_soc": 0.35}, soc=charge["value"])["no_plan"] is None


def test_as_understood_sent_again_the_answer_is_the_same(charged: TestClient) -> None:
    answer = ask(charged, {"departure_time": "2026-11-30T08:15", "connectors": ["ccs2"], "min_power_kw": 50})
    understood = answer["request"]
    assert understood["charging"]["departure_time"] == "2026-11-30T08:15:00"
    again = charged.post("/route", json=understood)
    assert timeless(again.json()) == timeless(answer)


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"links": False, "soc": 1.0},
        {"goal": START},
        {"soc": 0.01},
        {"via": [[8.0, 46.518], [8.0, 46.518]], "uncertainty": True},
        {"charging": {"departure_time": "2026-11-30T08:15", "stays": [{"at": "goal", "minutes": 60, "power_kw": 11}]}},
        {"charging": {"alternatives": 3, "speed_caps_kmh": [60], "objective": "energy", "confidence": 0.9}},
    ],
    ids=["plain", "without stops", "of nothing", "no plan", "via", "stay", "alternatives"],
)
@pytest.mark.parametrize(
    ("media_type", "schema"),
    [("application/json", RouteResponse), ("application/geo+json", RouteFeatureCollection)],
)
def test_plan_is_written_as_its_schema_writes_it(
    charged: TestClient,
    media_type: str,
    schema: type[RouteResponse | RouteFeatureCollection],
    change: dict[str, object],
) -> None:
    response = charged.post("/route", json=ROUTE | {"compact": False} | change, headers={"Accept": media_type})
    assert response.status_code == 200, response.text
    assert schema.model_validate_json(response.content).model_dump_json() == response.text


def test_geojson_has_lines_for_legs_and_points_for_stops(charged: TestClient) -> None:
    asked = body(via=[FAR_CORNER]) | {"compact": False}
    response = charged.post("/route", json=asked, headers={"Accept": "application/geo+json"})
    features = response.json()["features"]
    plain = timeless(ask(charged, via=[FAR_CORNER]))
    route = features[0]
    assert route["properties"].pop("stroke") == "#0b7a55"
    assert {**route["properties"], "geometry": route["geometry"]} == plain["routes"][0]
    legs = [feature for feature in features if feature["properties"].get("kind") == "leg"]
    stops = [feature for feature in features if feature["properties"].get("kind") == "stop"]
    assert [leg["properties"]["leg"] for leg in legs] == list(range(len(route["properties"]["legs"])))
    assert len(stops) == len(route["properties"]["charging"]["stops"]) > 0
    line = [position for leg in legs for position in leg["geometry"]["coordinates"]]
    assert [key for key, _ in itertools.groupby(map(tuple, line))] == [
        key for key, _ in itertools.groupby(map(tuple, route["geometry"]["coordinates"]))
    ]
    for stop in stops:
        assert shape(stop["geometry"]).distance(shape(route["geometry"])) < 1e-6
        assert stop["properties"]["route"] == route["properties"]["name"]
        end = legs[stop["properties"]["leg"]]["geometry"]["coordinates"][-1]
        assert stop["geometry"]["coordinates"] == pytest.approx(end, abs=2e-7)
    assert [feature["properties"]["kind"] for feature in features[-3:]] == ["start", "via", "goal"]


def test_times_of_arrival_are_local_ones_after_the_departure(charged: TestClient) -> None:
    departure = "2026-11-30T23:59:30"
    by_charging = ask(charged, {"departure_time": departure})
    by_conditions = ask(charged, conditions={"departure": departure})
    (stop,) = by_charging["routes"][0]["charging"]["stops"]
    arrive = datetime.fromisoformat(departure) + timedelta(seconds=round(stop["arrive_s"]))
    assert stop["arrive_time"] == arrive.isoformat()
    assert by_conditions["routes"] == by_charging["routes"]
    assert ask(charged)["routes"][0]["charging"]["stops"][0]["arrive_time"] is None


def test_waiting_for_a_station_to_open_is_said_of_the_stop_and_in_sum(charged: TestClient) -> None:
    slow = {"stations": ["osm:n1"], "connectors": ["type2"], "departure_time": "2026-11-30T07:50"}
    (route,) = ask(charged, slow)["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    (stop,) = route["charging"]["stops"]
    assert stop["waiting_s"] == pytest.approx(600.0 - stop["arrive_s"])
    assert stop["overhead_s"] == pytest.approx(60.0 + stop["waiting_s"])
    assert stop["arrive_time"] < "2026-11-30T08:00"
    (later,) = ask(charged, slow | {"departure_time": "2026-11-30T08:00"})["routes"]
    assert later["charging"]["totals"]["waiting_s"] == 0.0


def test_a_departure_at_the_end_of_the_calendar_has_no_times_of_arrival_after_it(charged: TestClient) -> None:
    (route,) = ask(charged, {"departure_time": "9999-12-31T23:59:59"})["routes"]
    assert route["charging"]["goal"]["arrive_time"] is None


def test_legs_end_at_via_points_and_stops(charged: TestClient) -> None:
    (route,) = ask(charged, via=[FAR_CORNER])["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    assert [leg["ends_at"] for leg in route["legs"]].count("via") == 1


def test_a_stay_charges_at_its_via_point_and_at_the_goal(charged: TestClient) -> None:
    stays = [{"at": 0, "minutes": 3, "power_kw": 11}, {"at": "goal", "minutes": 600, "power_kw": 11}]
    (route,) = ask(charged, {"stays": stays, "goal_soc": 0.02}, via=[FAR_CORNER])["routes"]
    stay = next(stop for stop in route["charging"]["stops"] if stop["station"] is None)
    assert stay["depart_s"] - stay["arrive_s"] == pytest.approx(180.0)
    assert 0.0 < stay["charged_kwh"] < 11.0 * 0.05
    assert stay["socket"] is None
    at_goal = route["charging"]["goal"]["stay"]
    assert at_goal["depart_soc"] == pytest.approx(1.0)
    assert at_goal["depart_s"] - route["charging"]["goal"]["arrive_s"] == pytest.approx(36_000.0)


def test_a_via_point_that_is_a_station_is_a_stop(charged: TestClient) -> None:
    chosen = {"via_stations": [{"via": 0, "station": "osm:n2"}]}
    at_station = {"via": [[8.005, 46.5101]]}
    (route,) = ask(charged, chosen, **at_station)["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    assert [stop["station"]["id"] for stop in route["charging"]["stops"]] == ["osm:n2"]
    assert [leg["ends_at"] for leg in route["legs"]] == ["stop", "goal"]
    (enough,) = ask(charged, chosen, soc=0.9, **at_station)["routes"]
    assert [leg["ends_at"] for leg in enough["legs"]] == ["via", "goal"]
    (other,) = ask(charged, {"excluded_stations": ["osm:n2"]})["routes"]
    assert "osm:n2" not in {stop["station"]["id"] for stop in other["charging"]["stops"]}


NEAR_N2: Final = {"via": [[8.005, 46.5101]]}
N2: Final = {"via_stations": [{"via": 0, "station": "osm:n2"}]}


@pytest.mark.parametrize(
    ("charging", "why"),
    [
        ({"networks": {"excluded": ["ionity"]}}, "its network is excluded"),
        ({"stations": ["ocm:3"]}, "it is not in stations"),
        ({"via_stations": [{"via": 0, "station": "ocm:4"}]}, "it is out of order"),
        ({"via_stations": [{"via": 0, "station": "osm:n1"}]}, "it has none of the connectors asked for"),
        (
            {"via_stations": [{"via": 0, "station": "osm:n1"}], "connectors": None, "min_power_kw": 50},
            "less than 50 kW",
        ),
    ],
)
def test_a_chosen_station_that_is_excluded_otherwise_is_passed_with_a_warning(
    charged: TestClient, charging: dict[str, Any], why: str
) -> None:
    chosen = N2 | charging
    answer = ask(charged, chosen, soc=0.6, **NEAR_N2)
    (route,) = answer["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    station = chosen["via_stations"][0]["station"]
    assert station not in {stop["station"]["id"] for stop in route["charging"]["stops"]}
    assert route["legs"][0]["ends_at"] in ("via", "stop")
    (said,) = [text for text in answer["warnings"] if text.startswith("via[0], station ")]
    assert "is passed without charging: " in said
    assert why in said


def test_a_chosen_station_that_is_closed_on_arrival_is_passed_with_a_warning(charged: TestClient) -> None:
    chosen = {"via_stations": [{"via": 0, "station": "osm:n1"}], "connectors": ["ccs2", "type2"]}
    at_night = chosen | {"departure_time": "2026-11-30T03:00"}
    answer = ask(charged, at_night, via=[[8.005, 46.5001]])
    (route,) = answer["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    assert {stop["station"]["id"] for stop in route["charging"]["stops"]} == {"osm:n2"}
    (said,) = [text for text in answer["warnings"] if "via[0]" in text]
    minutes = round((5 * 3600.0 - route["legs"][0]["duration_s"]) / 60.0)
    assert said == (
        "best: via[0], station Market «1», is passed without charging: "
        f"it is closed on arrival, for another {minutes} min"
    )
    by_day = ask(charged, chosen | {"departure_time": "2026-11-30T10:00"}, via=[[8.005, 46.5001]])
    assert not [text for text in by_day["warnings"] if "via[0]" in text]


def test_a_via_point_that_is_a_station_is_met_there_and_not_moved_to_a_road(charged: TestClient) -> None:
    off_road = [[8.005, 46.5125]]
    chosen = ask(charged, N2, via=off_road)
    (said,) = [text for text in chosen["warnings"] if "via[0]" in text]
    assert said == "via[0] is 267 m from station 'osm:n2', whose place is taken for it"
    (snapped,) = chosen["snapped"]["via"]
    (stop,) = chosen["routes"][0]["charging"]["stops"]
    assert snapped["asked"] == {"lat": 46.5125, "lon": 8.005}
    assert (snapped["link_id"], snapped["on_road"]) == (stop["link_id"], stop["at"])
    (plain,) = [text for text in ask(charged, via=off_road)["warnings"] if "via[0]" in text]
    assert plain.endswith("and was moved there")
    none = ask(charged, N2 | {"max_soc": 0.35}, via=off_road, soc=0.3)
    assert none["no_plan"] is not None
    assert said in none["warnings"]
    assert none["snapped"]["via"] == [snapped]


def test_a_speed_cap_stands_at_the_legs_that_keep_it(charged: TestClient) -> None:
    free = ask(charged, {"objective": "energy"}, soc=0.8)["routes"][0]
    slow = ask(charged, {"objective": "energy", "speed_caps_kmh": [35]}, soc=0.8)["routes"][0]
    check_plan(slow, ARRIVE_SOC, GOAL_SOC)
    assert [leg["speed_cap_kmh"] for leg in slow["legs"]] == [35.0]
    assert slow["energy_kwh"] < free["energy_kwh"]
    assert max(link["speed_end_kmh"] for link in slow["links"]) <= 35.0 + 1e-9
    assert max(link["speed_limit_kmh"] for link in slow["links"]) > 35.0


def test_confidence_keeps_more_than_the_mean(charged: TestClient) -> None:
    plain, sure = ask(charged, soc=0.5), ask(charged, {"confidence": 0.9}, soc=0.5)
    assert (plain["no_plan"], sure["no_plan"]) == (None, None)
    assert sure["routes"][0]["soc_end"] > plain["routes"][0]["soc_end"]
    assert sure["routes"][0]["total_s"] > plain["routes"][0]["total_s"]


def test_an_excluded_network_is_not_stopped_at_and_a_preferred_one_costs_less(charged: TestClient) -> None:
    without = ask(charged, {"networks": {"excluded": ["IONITY"]}})
    stations = {stop["station"]["id"] for stop in without["routes"][0]["charging"]["stops"]}
    assert "osm:n2" not in stations
    only = {"stations": ["osm:n2"]}
    plain, preferred = ask(charged, only), ask(charged, only | {"networks": {"preferred": ["ionity"]}})
    values = [answer["routes"][0]["charging"]["objective_value"] for answer in (plain, preferred)]
    assert values[1] < values[0]


def test_price_stands_where_the_station_has_one_in_numbers(charged: TestClient) -> None:
    priced = ask(charged, {"stations": ["ocm:3"]})
    (stop,) = priced["routes"][0]["charging"]["stops"]
    assert stop["price"] == pytest.approx(0.49 * stop["drawn_kwh"])
    totals = priced["routes"][0]["charging"]["totals"]
    assert (totals["price"], totals["currency"]) == (stop["price"], "EUR")
    free = ask(charged, {"stations": ["osm:n2"]})["routes"][0]["charging"]
    assert (free["totals"]["price"], free["totals"]["currency"]) == (None, "")


def test_planning_is_a_stage_of_its_own(charged: TestClient) -> None:
    timing = charged.post("/route", json=ROUTE).headers["server-timing"]
    assert "plan;dur=" in timing
    assert "search;dur=" not in timing
    assert 'joulepath_stage_seconds_count{endpoint="/route",stage="plan"}' in charged.get("/metrics").text


ERRORS: Final[list[tuple[str, dict[str, Any], dict[str, Any], str, object, str]]] = [
    ("arrive above max", {"arrive_soc": 0.9}, {}, "charging.arrive_soc", 0.9, "below max_soc, 0.8"),
    ("percent", {"goal_soc": 20}, {}, "charging.goal_soc", 20, "did you mean 0.2?"),
    ("max below reserve", {"max_soc": 0.3}, {"reserve_soc": 0.31}, "charging.max_soc", 0.3, "above reserve_soc, 0.31"),
    ("unknown station", {"stations": ["osm:n3"]}, {}, "charging.stations[0]", "osm:n3", "did you mean 'osm:n"),
    ("excluded", {"excluded_stations": ["n9"]}, {}, "charging.excluded_stations[0]", "n9", "ids of stations of graph"),
    (
        "via station",
        {"via_stations": [{"via": 0, "station": "ocm:n2"}]},
        {"via": [START]},
        "charging.via_stations[0].station",
        "ocm:n2",
        "did you mean 'osm:n2'",
    ),
    ("no via point", {"via_stations": [{"via": 0, "station": "osm:n2"}]}, {}, "charging.via_stations[0].via", 0, "via"),
    ("id without source", {"stations": ["n2"]}, {}, "charging.stations[0]", "n2", "did you mean 'osm:n2'?"),
    ("plug in other letters", {"connectors": ["CCS 2"]}, {}, "charging.connectors[0]", "CCS 2", "did you mean 'ccs2'?"),
    ("no plug", {"connectors": ["wallbox"]}, {}, "charging.connectors[0]", "wallbox", "'type1', 'type2', 'type3'"),
    ("objective", {"objective": "costs"}, {}, "charging.objective", "costs", "did you mean 'cost'?"),
    ("no such plug", {"connectors": ["chademo"]}, {}, "charging.connectors[0]", "chademo", "fit the vehicle: ccs2"),
    (
        "plug of no station",
        {"connectors": ["chademo"]},
        {"vehicle": CAR | {"charging": CHARGES | {"connectors": ["ccs2", "chademo"]}}},
        "charging.connectors",
        ["chademo"],
        "plugs that stations of graph 'grid' have: ccs2, type2",
    ),
    ("too much power", {"min_power_kw": 151}, {}, "charging.min_power_kw", 151, "at most 150"),
    (
        "unknown network",
        {"networks": {"avoided": ["Ionitty"]}},
        {},
        "charging.networks.avoided[0]",
        "Ionitty",
        "did you mean 'Ionity'?",
    ),
    (
        "twice",
        {"networks": {"avoided": ["Town"], "excluded": ["town"]}},
        {},
        "charging.networks.excluded[0]",
        "town",
        "each network once; it is avoided[0], too",
    ),
    (
        "stay at no place",
        {"stays": [{"at": "Goal", "minutes": 5}]},
        {},
        "charging.stays[0].at",
        "Goal",
        "a position in via, from 0, or goal",
    ),
    ("stay of a text", {"stays": ["goal,600"]}, {}, "charging.stays[0]", "goal,600", "an object"),
    (
        "stay of text minutes",
        {"stays": [{"at": "goal", "minutes": "60"}]},
        {},
        "charging.stays[0].minutes",
        "60",
        "a valid number",
    ),
    (
        "stay of no power",
        {"stays": [{"at": "goal", "minutes": 60, "power_kw": -1}]},
        {},
        "charging.stays[0].power_kw",
        -1,
        "at least 0",
    ),
    ("cap as a text", {"speed_caps_kmh": "115"}, {}, "charging.speed_caps_kmh", "115", "a valid list"),
    ("caps of one speed", {"speed_caps_kmh": [90, 90]}, {}, "charging.speed_caps_kmh", [90.0, 90.0], "each once"),
    (
        "time zone",
        {"departure_time": "2026-11-30T08:15+01:00"},
        {},
        "charging.departure_time",
        "2026-11-30T08:15+01:00",
        "without a time zone",
    ),
    ("no such day", {"departure_time": "2026-11-31T08:15"}, {}, "charging.departure_time", "2026-11-31T08:15", "local"),
    (
        "network as a text",
        {"networks": {"preferred": "Ionity"}},
        {},
        "charging.networks.preferred",
        "Ionity",
        "a valid list",
    ),
    (
        "factor",
        {"networks": {"preferred_factor": 2}},
        {},
        "charging.networks.preferred_factor",
        2,
        "at most 1",
    ),
    ("stay nowhere", {"stays": [{"at": 0, "minutes": 5}]}, {}, "charging.stays[0].at", 0, "goal"),
    (
        "two departures",
        {"departure_time": "2026-11-30T08:15"},
        {"conditions": {"departure": "2026-11-30T08:16"}},
        "charging.departure_time",
        "2026-11-30 08:15:00",
        "that of conditions.departure",
    ),
    ("weights", {}, {"weights": {"time": 1}}, "weights", "sent with charging", "weights without charging"),
    ("pareto", {}, {"pareto": {}}, "pareto", "sent with charging", "pareto without charging"),
    ("names", {}, {"alternatives": ["eco"]}, "alternatives", "sent with charging", "alternatives without charging"),
    ("counters", {}, {"stops": "counted"}, "stops", "counted", "expected, none or crossings"),
    ("petrol", {}, {"vehicle": "toyota-corolla-petrol"}, "vehicle", "toyota-corolla-petrol", "with `charging`"),
    (
        "no stations",
        {"stations": ["fast"]},
        {"graph": "level"},
        "charging.stations[0]",
        "fast",
        "ids of stations of graph 'level', which has none",
    ),
    (
        "fewer stops than stations",
        {"most_stops": 0, "via_stations": [{"via": 0, "station": "osm:n2"}]},
        {"via": [[8.01, 46.509]]},
        "charging.most_stops",
        0,
        "at least 1, as many as via_stations",
    ),
    ("confidence", {"confidence": 1}, {}, "charging.confidence", 1, "at most 0.999"),
    ("confidence in percent", {"confidence": 95}, {}, "charging.confidence", 95, "did you mean 0.95?"),
    ("no time", {"departure_time": "8:15"}, {}, "charging.departure_time", "8:15", "such as 2026-11-30T08:15"),
    ("field", {"speed": 1}, {}, "charging.speed", 1, "no field of this name"),
    ("slow", {"speed_caps_kmh": [5]}, {}, "charging.speed_caps_kmh[0]", 5, "at least 30"),
]


@pytest.mark.parametrize(
    ("charging", "change", "field", "value", "allowed"), [case[1:] for case in ERRORS], ids=[case[0] for case in ERRORS]
)
def test_what_contradicts_or_is_unknown_is_refused_by_field_value_and_range(
    charged: TestClient, charging: dict[str, Any], change: dict[str, Any], field: str, value: object, allowed: str
) -> None:
    problem = check_problem(charged.post("/route", json=body(charging, **change)), 422, "invalid_request")
    (wrong,) = problem["errors"]
    assert (wrong["field"], wrong["value"]) == (field, value)
    assert allowed in wrong["allowed"]
    assert allowed in problem["detail"]


def test_a_sent_vehicle_that_does_not_say_how_it_charges_is_refused(charged: TestClient) -> None:
    without = {name: value for name, value in CAR.items() if name != "charging"}
    problem = check_problem(charged.post("/route", json=body(vehicle=without)), 422, "invalid_vehicle")
    assert problem["errors"][0]["field"] == "vehicle.charging"


def test_contradiction_in_how_a_sent_vehicle_charges_is_named_by_its_path(charged: TestClient) -> None:
    twice = CAR | {"charging": CHARGES | {"connectors": ["ccs2", "ccs2"]}}
    problem = check_problem(charged.post("/route", json=body(vehicle=twice)), 422, "invalid_vehicle")
    assert problem["errors"][0]["field"] == "vehicle.charging.connectors"
    assert problem["detail"].startswith("vehicle.charging.connectors is ccs2, ccs2, allowed: ")


def test_a_cap_below_what_is_kept_by_default_is_the_field_that_is_named(charged: TestClient) -> None:
    problem = check_problem(
        charged.post("/route", json=ROUTE | {"charging": {"max_soc": 0.05}}), 422, "invalid_request"
    )
    (wrong,) = problem["errors"]
    assert (wrong["field"], wrong["value"], wrong["allowed"]) == ("charging.max_soc", 0.05, "above arrive_soc, 0.1")


def test_without_stops_no_station_is_looked_at(charged: TestClient) -> None:
    answer = ask(charged, {"most_stops": 0})
    assert answer["no_plan"]["reason"].endswith("no station may be used: at most 0 stops")
    assert answer["planning"]["leg_searches"] < 20


def test_a_graph_without_stations_answers_the_plan_where_the_charge_suffices(charged: TestClient) -> None:
    asked = {"networks": {"avoided": ["Ionity"], "excluded": ["Town"]}, "min_power_kw": 50}
    answer = ask(charged, asked, graph="level", soc=1.0)
    assert answer["no_plan"] is None
    (route,) = answer["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    assert route["charging"]["stops"] == route["charging"]["sources"] == []
    assert route["charging"]["proof"]["proven"] is True


def test_a_graph_without_stations_answers_the_plan_where_a_stay_suffices(charged: TestClient) -> None:
    stay = {"stays": [{"at": 0, "minutes": 120, "power_kw": 11}]}
    (route,) = ask(charged, stay, graph="level", via=[[8.01, 46.509]])["routes"]
    check_plan(route, ARRIVE_SOC, GOAL_SOC)
    (stop,) = route["charging"]["stops"]
    assert stop["station"] is None
    goal = {"goal_soc": 0.05, "stays": [{"at": "goal", "minutes": 480, "power_kw": 11}]}
    (route,) = ask(charged, goal, graph="level")["routes"]
    assert route["charging"]["goal"]["stay"]["depart_soc"] == pytest.approx(1.0)


def test_a_graph_without_stations_answers_no_plan_that_says_how_to_add_some(charged: TestClient) -> None:
    answer = ask(charged, graph="level", soc=0.1)
    no_plan = answer["no_plan"]
    assert no_plan["reason"].endswith("graph 'level' has no charging stations")
    assert no_plan["missing_kwh"] > 0.0
    assert no_plan["last_reached"] is None
    assert no_plan["helps"][-1] == {
        "kind": "stations",
        "value": None,
        "unit": None,
        "text": "charging stations: joulepath stations import FILE --graph level",
    }
    assert [each["kind"] for each in no_plan["helps"][:-1]] == ["soc"]
    (route,) = answer["routes"]
    assert route["charging"] is None
    assert route["feasible"] is False


def test_damaged_stations_are_named_where_stops_are_asked_for(charged: TestClient) -> None:
    response = charged.post("/route", json=body(graph="torn"))
    problem = check_problem(response, 409, "graph_damaged")
    assert "stations.json" in problem["detail"]
    plain = charged.post("/route", json=ROUTE | {"graph": "torn", "charging": None})
    assert plain.status_code == 200


fractions = st.floats(0.0, 1.0)
charging_bodies = st.fixed_dictionaries(
    {},
    optional={
        "arrive_soc": fractions,
        "goal_soc": fractions,
        "max_soc": fractions,
        "overhead_s": st.floats(0.0, 7200.0),
        "connectors": st.lists(st.sampled_from([plug.value for plug in Connector]), min_size=1, max_size=3),
        "min_power_kw": st.floats(0.0, 200.0),
        "networks": st.fixed_dictionaries(
            {},
            optional={
                "preferred": st.just(["Ionity"]),
                "avoided": st.just(["town"]),
                "excluded": st.sampled_from([[], ["Town"], ["nobody"]]),
                "preferred_factor": st.floats(0.1, 1.0),
            },
        ),
        "stations": st.lists(st.sampled_from(sorted(STATIONS)), min_size=1, max_size=3, unique=True),
        "stays": st.lists(
            st.fixed_dictionaries(
                {"at": st.sampled_from(["goal", 0, 1]), "minutes": st.floats(0.1, 10_000.0)},
                optional={"power_kw": st.floats(0.0, 400.0)},
            ),
            max_size=3,
        ),
        "departure_time": st.datetimes(datetime(1, 1, 1), datetime(9999, 12, 31)).map(datetime.isoformat),
        "objective": st.sampled_from(["time", "energy", "cost"]),
        "time_value_per_h": st.floats(0.0, 1000.0),
        "confidence": st.floats(0.5, 0.999),
        "speed_caps_kmh": st.lists(st.floats(30.0, 200.0), max_size=2, unique=True),
        "most_stops": st.integers(0, 50),
        "alternatives": st.integers(0, 3),
    },
)


@given(
    charging=charging_bodies,
    soc=fractions,
    reserve=st.sampled_from([0.0, 0.05]),
    capacity_kwh=st.floats(0.3, 3.0),
    via=st.lists(st.sampled_from([FAR_CORNER, [8.01, 46.51], START]), max_size=2),
    conditions=st.sampled_from([None, {"ambient_c": -10}, {"regen_limited": True}, {"speed_factor": 0.8}]),
)
@hypothesis_settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_any_request_is_answered_or_refused_and_every_plan_keeps_what_it_says(
    charged: TestClient,
    charging: dict[str, Any],
    soc: float,
    reserve: float,
    capacity_kwh: float,
    via: list[list[float]],
    conditions: dict[str, Any] | None,
) -> None:
    vehicle = CAR | {"usable_capacity_kwh": capacity_kwh}
    sent = ROUTE | {"soc": soc, "reserve_soc": min(reserve, soc), "vehicle": vehicle, "via": via}
    response = charged.post("/route", json=sent | {"charging": charging, "conditions": conditions})
    if response.status_code == 422:
        problem = check_problem(response, 422, response.json()["code"])
        assert problem["errors"]
        return
    assert response.status_code == 200, response.text
    answer = response.json()
    assert json.loads(RouteResponse.model_validate(answer).model_dump_json()) == answer
    arrive, goal = charging.get("arrive_soc", 0.1), charging.get("goal_soc", 0.1)
    if any(stay["at"] == "goal" for stay in charging.get("stays", [])):
        goal = 0.0
    if answer["no_plan"] is not None:
        assert [route["charging"] for route in answer["routes"]] == [None]
        return
    for route in answer["routes"]:
        if conditions is None:
            check_plan(route, max(arrive, sent["reserve_soc"]), max(goal, sent["reserve_soc"]), capacity_kwh)
        assert len(route["charging"]["stops"]) <= charging.get("most_stops", 20) + len(charging.get("stays", []))
