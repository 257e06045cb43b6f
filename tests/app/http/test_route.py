"""POST /route on the hand-made grid."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import pytest
from shapely.geometry import shape

from app.schemas.lean.formats import ROUTE_FORMATS, accepted_format
from app.schemas.route import RouteFeatureCollection, RouteRequest, RouteResponse

if TYPE_CHECKING:
    from starlette.testclient import TestClient

START, GOAL = {"lat": 46.5, "lon": 8.003}, {"lat": 46.518, "lon": 8.02}
ROUTE: dict[str, Any] = {"start": START, "goal": GOAL, "soc": 0.5}
LBF_PER_N = 1 / 4.4482216152605
KMH_PER_MPH = 1.609344


def ask(client: TestClient, **change: object) -> dict[str, Any]:
    response = client.post("/route", json=ROUTE | change)
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    for stats in answer["stats"]:
        assert stats.pop("seconds") >= 0
    return answer


def test_route_without_options_answers_one_eco_route_with_its_profile(client: TestClient) -> None:
    answer = ask(client)
    (route,) = answer["routes"]
    assert route["name"] == "eco"
    assert route["feasible"] is True
    assert route["deficit_kwh"] == 0
    assert route["furthest"] is None
    assert route["soc_start"] == 0.5
    assert route["soc_end"] == route["links"][-1]["soc_end"]
    assert route["distance_m"] == pytest.approx(sum(link["length_m"] for link in route["links"]))
    assert route["duration_s"] == pytest.approx(sum(link["duration_s"] for link in route["links"]))
    assert route["energy_kwh"] == pytest.approx(sum(link["energy_wh"] for link in route["links"]) / 1000, rel=1e-9)
    assert route["energy_kwh"] == pytest.approx(sum(route["energy_parts_kwh"].values()), rel=1e-9)
    assert [link["speed_end_kmh"] == 0.0 for link in route["links"]] == [False] * (len(route["links"]) - 1) + [True]
    assert route["geometry"]["coordinates"][0] == [8.003, 46.5]
    assert route["geometry"]["coordinates"][-1] == [8.02, 46.518]
    assert answer["snapped"]["start"]["distance_m"] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("soc", [0.5, 1.0])
def test_battery_energy_of_a_route_and_its_legs_is_the_change_of_charge(client: TestClient, soc: float) -> None:
    hill_top = [8.01, 46.51]
    (route,) = ask(client, start=hill_top, goal=GOAL, soc=soc, via=VIA, vehicle="hyundai-kona-64")["routes"]
    assert route["battery_kwh"] == pytest.approx(64.0 * (soc - route["soc_end"]), abs=1e-9)
    assert route["battery_kwh"] == pytest.approx(route["energy_kwh"] + route["braked_away_kwh"], rel=1e-9)
    assert (route["braked_away_kwh"] > 0.0) == (soc == 1.0)
    before = soc
    for leg in route["legs"]:
        assert leg["battery_kwh"] == pytest.approx(64.0 * (before - leg["soc_end"]), abs=1e-9)
        before = leg["soc_end"]


def test_route_with_both_point_forms_answers_the_same(client: TestClient) -> None:
    pairs = {"start": [START["lon"], START["lat"]], "goal": [GOAL["lon"], GOAL["lat"]]}
    named, paired = ask(client), ask(client, **pairs)
    assert named.pop("request")["start"] == START
    assert paired.pop("request")["start"] == pairs["start"]
    assert named == paired


def test_route_request_as_understood_sent_again_answers_the_same(client: TestClient) -> None:
    answer = ask(client, vehicle="bmw-i3-60ah", alternatives=["fastest", "eco"])
    assert answer["request"]["graph"] == "grid"
    assert answer["request"]["reserve_soc"] == 0
    assert ask(client, **answer["request"]) == answer


def test_route_with_alternatives_answers_them_in_the_order_asked(client: TestClient) -> None:
    routes = ask(client, alternatives=["fastest", "eco", "balanced"])["routes"]
    assert [route["name"] for route in routes] == ["fastest", "eco", "balanced"]
    assert routes[0]["duration_s"] <= routes[1]["duration_s"]
    assert routes[1]["energy_kwh"] <= routes[0]["energy_kwh"]


def test_route_with_weights_on_time_equals_fastest(client: TestClient) -> None:
    (custom,) = ask(client, weights={"time": 3})["routes"]
    (fastest,) = ask(client, alternatives=["fastest"])["routes"]
    assert custom["name"] == "custom"
    assert custom["geometry"] == fastest["geometry"]


def test_route_without_links_leaves_only_them_out(client: TestClient) -> None:
    full, short = ask(client), ask(client, links=False)
    assert short["routes"][0].pop("links") is None
    assert full["routes"][0].pop("links")
    assert short["routes"] == full["routes"]


def test_route_beyond_the_charge_answers_what_is_missing(client: TestClient) -> None:
    answer = ask(client, soc=0.002)
    (route,) = answer["routes"]
    assert route["feasible"] is False
    assert route["deficit_kwh"] > 0
    assert route["soc_min"] < 0
    assert route["furthest"] is not None
    assert route["remedy"]["soc_start_needed"] > 0.002
    enough = ask(client, soc=route["remedy"]["soc_start_needed"] + 1e-6)
    assert enough["routes"][0]["feasible"] is True


def test_route_below_the_reserve_is_not_feasible(client: TestClient) -> None:
    (route,) = ask(client, soc=0.5, reserve_soc=0.499)["routes"]
    assert route["feasible"] is False
    assert 0.4 < route["soc_min"] < 0.499


def test_route_as_geojson_says_the_same(client: TestClient) -> None:
    plain = ask(client)
    response = client.post("/route", json=ROUTE | {"compact": False}, headers={"Accept": "application/geo+json"})
    assert response.headers["content-type"] == "application/geo+json"
    collection = response.json()
    line, start, goal = collection["features"]
    assert line["geometry"] == plain["routes"][0]["geometry"]
    assert line["properties"].pop("stroke") == "#0b7a55"
    assert {**line["properties"], "geometry": line["geometry"]} == plain["routes"][0]
    assert (start["properties"]["kind"], goal["properties"]["kind"]) == ("start", "goal")
    assert start["geometry"]["coordinates"] == line["geometry"]["coordinates"][0]
    assert shape(line["geometry"]).length > 0
    assert collection["terrain"] == plain["terrain"]


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"links": False},
        {"goal": START},
        {"soc": 0.001},
        {"alternatives": ["eco", "fastest"], "uncertainty": True, "via": [[8.0, 46.518], [8.0, 46.518]]},
        {"pareto": {}, "conditions": {"ambient_c": -5, "wind_speed_mps": 8, "wind_from_deg": 90}},
    ],
    ids=["plain", "without links", "of nothing", "beyond the charge", "via", "pareto"],
)
@pytest.mark.parametrize(
    ("media_type", "schema"),
    [("application/json", RouteResponse), ("application/geo+json", RouteFeatureCollection)],
)
def test_route_is_written_as_its_schema_writes_it(
    client: TestClient,
    media_type: str,
    schema: type[RouteResponse | RouteFeatureCollection],
    change: dict[str, object],
) -> None:
    body = ROUTE | {"compact": False} | change
    response = client.post("/route", json=body, headers={"Accept": media_type})
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == media_type
    assert schema.model_validate_json(response.content).model_dump_json() == response.text


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        ("application/geo+json", True),
        ("application/geo+json, application/json", True),
        ("application/json, application/geo+json", False),
        ("application/json;q=0.5, application/geo+json;q=0.9", True),
        ("application/geo+json;q=0, */*", False),
        ("application/geo+json;q=much", False),
        ("application/geo+json;q=nan, */*;q=0.1", False),
        ("application/geo+json;q=0.1, */*;q=0.5", False),
        ("application/geo+json, */*", True),
        ("application/gpx+xml;q=0.2, application/geo+json;q=0.3, text/*;q=0.1", True),
        ("*/*", False),
        ("", False),
    ],
)
def test_accept_header_ranks_geojson_as_the_client_says(accept: str, expected: bool) -> None:
    assert (accepted_format(accept, ROUTE_FORMATS) == "geojson") is expected


def test_answer_names_the_terrain_it_rests_on(client: TestClient) -> None:
    hills, level = ask(client)["terrain"], ask(client, graph="level")["terrain"]
    assert (hills["graph"], hills["terrain"], hills["elevation_method"]) == ("grid", "synthetic", "by hand")
    assert (level["graph"], level["terrain"]) == ("level", "absent")
    assert {"smoothing_m", "source", "attribution", "licence"} <= set(hills)


def test_bundled_vehicle_sent_inline_takes_the_same_energy(client: TestClient) -> None:
    detail = client.get("/vehicles/nissan-leaf").json()
    inline = {key: value for key, value in detail.items() if key not in ("id", "sources")}
    by_id, by_value = ask(client, vehicle="nissan-leaf"), ask(client, vehicle=inline)
    assert by_value["routes"][0]["energy_kwh"] == pytest.approx(by_id["routes"][0]["energy_kwh"], rel=1e-9)
    assert by_value["request"]["vehicle"]["name"] == "Nissan Leaf 40 kWh"


def test_road_load_in_epa_units_takes_the_same_energy(client: TestClient) -> None:
    metric = {"a_n": 120.0, "b_n_per_kmh": 0.5, "c_n_per_kmh2": 0.03}
    epa = {
        "a_lbf": 120.0 * LBF_PER_N,
        "b_lbf_per_mph": 0.5 * LBF_PER_N * KMH_PER_MPH,
        "c_lbf_per_mph2": 0.03 * LBF_PER_N * KMH_PER_MPH**2,
    }
    car = {"mass_kg": 1500, "drive_eff": 0.9, "recuperation_eff": 0.6, "aux_power_w": 400, "usable_capacity_kwh": 40}
    answers = [ask(client, vehicle=car | {"road_load": load}) for load in (metric, epa)]
    energies = [answer["routes"][0]["energy_kwh"] for answer in answers]
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)
    kona = client.get("/vehicles/hyundai-kona-64").json()
    assert answers[0]["request"]["vehicle"]["acceleration"] == kona["acceleration"]


def test_large_answer_is_compressed_for_a_client_that_takes_it(client: TestClient) -> None:
    packed = client.post("/route", json=ROUTE)
    plain = client.post("/route", json=ROUTE, headers={"Accept-Encoding": "identity"})
    assert packed.headers["content-encoding"] == "gzip"
    assert int(packed.headers["content-length"]) < len(packed.content) / 2
    assert "content-encoding" not in plain.headers
    assert packed.json()["routes"] == plain.json()["routes"]
    for answer in (packed, plain):
        names = [name.strip().lower() for name in answer.headers["vary"].split(",")]
        assert sorted(names) == sorted(set(names))
        assert "accept-encoding" in names


def test_allowed_origin_may_read_answers_and_problems(client: TestClient) -> None:
    for body in (ROUTE, {}):
        response = client.post("/route", json=body, headers={"Origin": "https://map.example"})
        assert response.headers["access-control-allow-origin"] == "https://map.example"
    other = client.post("/route", json=ROUTE, headers={"Origin": "https://elsewhere.example"})
    assert "access-control-allow-origin" not in other.headers


WEATHER = {"ambient_c": -8, "road": "snow", "payload_kg": 150, "wind_speed_mps": 6, "wind_from_deg": 200}


def test_route_in_weather_takes_more_and_says_for_what(client: TestClient) -> None:
    (plain,), (cold,) = (ask(client, **change)["routes"] for change in ({}, {"conditions": WEATHER}))
    parts = cold["energy_parts_kwh"]
    assert cold["energy_kwh"] > 1.3 * plain["energy_kwh"]
    assert cold["energy_kwh"] == pytest.approx(sum(parts.values()), rel=1e-9)
    on = {"tyre_temperature", "road_surface", "payload", "air_density", "drag", "wind", "battery_resistance", "cabin"}
    effects = on | {"regen_limit", "load_loss", "consumption_table"}
    assert {name for name in effects if parts[name] != 0.0} == on
    assert all(plain["energy_parts_kwh"][name] == 0.0 for name in effects)


def test_route_with_empty_conditions_is_that_without(client: TestClient) -> None:
    without, empty = ask(client), ask(client, conditions={}, effects={})
    assert without["routes"] == empty["routes"]


def test_route_in_weather_sent_to_simulate_takes_the_same_energy(client: TestClient) -> None:
    answer = ask(client, conditions=WEATHER, effects={"heating_cop": 2.0})
    (route,) = answer["routes"]
    body = {
        "links": [{name: link[name] for name in ("id", "from_m", "to_m")} for link in route["links"]],
        **{
            name: answer["request"][name]
            for name in ("graph", "vehicle", "conditions", "effects", "link_model", "stops")
        },
    }
    driven = client.post("/simulate", json=body).json()
    assert driven["energy_kwh"] == pytest.approx(route["energy_kwh"], rel=1e-12)


def test_route_with_a_better_heat_pump_takes_less(client: TestClient) -> None:
    poor, good = (
        ask(client, conditions=WEATHER, effects={"heating_cop": cop})["routes"][0]["energy_parts_kwh"]["cabin"]
        for cop in (1.0, 3.0)
    )
    assert good < 0.5 * poor


def test_route_names_the_stretches_that_take_the_most(client: TestClient) -> None:
    (route,) = ask(client)["routes"]
    ends = [(hot["first"], hot["last"]) for hot in route["hot_links"]]
    assert ends
    for hot in route["hot_links"]:
        links = route["links"][hot["first"] : hot["last"] + 1]
        assert hot["energy_kwh"] == pytest.approx(sum(link["energy_wh"] for link in links) / 1000)
        assert hot["times_mean"] > 1.0
        assert hot["to_m"] - hot["from_m"] == pytest.approx(sum(link["length_m"] for link in links))
        assert hot["kwh_per_100km"] == pytest.approx(1e5 * hot["energy_kwh"] / (hot["to_m"] - hot["from_m"]))
    # disjoint, and the steepest way up to the middle of the grid is among them
    assert len({k for first, last in ends for k in range(first, last + 1)}) == sum(b - a + 1 for a, b in ends)
    assert {"climb"} <= {hot["reason"] for hot in route["hot_links"]}


def test_route_with_uncertainty_gives_quantiles_around_its_energy(client: TestClient) -> None:
    (plain,), (route,) = (ask(client, **change)["routes"] for change in ({}, {"uncertainty": True}))
    assert plain["uncertainty"] is None
    spread = route.pop("uncertainty")
    plain.pop("uncertainty")
    along = [(link.pop("soc_end_p10"), link["soc_end"], link.pop("soc_end_p90")) for link in route["links"]]
    assert all(low < middle < high for low, middle, high in along)
    assert (along[-1][0], along[-1][2]) == (spread["soc_end_p10"], spread["soc_end_p90"])
    assert {link.pop(name) for link in plain["links"] for name in ("soc_end_p10", "soc_end_p90")} == {None}
    assert route == plain
    assert spread["energy_kwh_p10"] < route["energy_kwh"] < spread["energy_kwh_p90"]
    assert spread["soc_end_p10"] < route["soc_end"] < spread["soc_end_p90"]
    assert spread["probability_above_reserve"] == 1.0
    (tight,) = ask(client, uncertainty=True, soc=0.5, reserve_soc=route["soc_min"])["routes"]
    assert 0.2 < tight["uncertainty"]["probability_above_reserve"] < 0.8


def test_route_of_a_consumption_table_refuses_wind_and_takes_cold(client: TestClient) -> None:
    vehicle = {
        "kind": "consumption_table",
        "name": "van",
        "consumption": {"speed_kmh": [30, 90], "kwh_per_100km": [13, 21]},
        "ascent_wh_per_m": 7.5,
        "descent_wh_per_m": 4.9,
        "aux_power_w": 600,
        "usable_capacity_kwh": 60,
    }
    warm, cold = (
        ask(client, vehicle=vehicle, conditions=c)["routes"][0]["energy_parts_kwh"] for c in ({}, {"ambient_c": -5})
    )
    assert cold["cabin"] > warm["cabin"] == 0.0
    assert warm["consumption_table"] > 0.0
    refused = client.post("/route", json=ROUTE | {"vehicle": vehicle, "conditions": {"wind_speed_mps": 3}})
    assert refused.status_code == 422
    assert refused.json()["code"] == "invalid_conditions"
    assert refused.json()["errors"][0]["field"] == "conditions.wind_speed_mps"


VIA = [{"lat": 46.505, "lon": 8.0}, [8.01, 46.513]]


def test_route_over_via_points_answers_where_they_are_and_each_leg(client: TestClient) -> None:
    (straight,) = ask(client)["routes"]
    answer = ask(client, via=VIA)
    (route,) = answer["routes"]
    assert answer["request"]["via"] == VIA
    assert [place["asked"] for place in answer["snapped"]["via"]] == [VIA[0], {"lat": 46.513, "lon": 8.01}]
    assert ask(client)["snapped"]["via"] == []
    assert len(straight["legs"]) == 1
    assert route["legs"][0]["first_link"] == 0
    assert route["legs"][-1]["last_link"] == len(route["links"]) - 1
    assert route["legs"][-1]["soc_end"] == route["soc_end"]
    assert sum(leg["energy_kwh"] for leg in route["legs"]) == pytest.approx(route["energy_kwh"])
    assert route["energy_kwh"] > straight["energy_kwh"]
    line = route["geometry"]["coordinates"]
    for leg, place in zip(route["legs"], VIA, strict=False):
        last = route["links"][leg["last_link"]]
        assert last["rest"] is True
        assert last["speed_end_kmh"] == 0.0
        lon, lat = place if isinstance(place, list) else (place["lon"], place["lat"])
        assert line[last["geometry_end"]] == pytest.approx([lon, lat], abs=1e-6)
    assert [link["rest"] for link in route["links"]].count(True) == len(VIA)


def test_route_over_via_points_sent_to_simulate_takes_the_same_energy(client: TestClient) -> None:
    answer = ask(client, via=VIA, conditions=WEATHER)
    (route,) = answer["routes"]
    named = ("graph", "vehicle", "conditions", "effects", "link_model", "stops", "soc")
    body = {
        "links": [{name: link[name] for name in ("id", "from_m", "to_m", "rest")} for link in route["links"]],
        **{name: answer["request"][name] for name in named},
    }
    driven = client.post("/simulate", json=body).json()
    assert driven["energy_kwh"] == pytest.approx(route["energy_kwh"], rel=1e-12)
    assert driven["duration_s"] == pytest.approx(route["duration_s"], rel=1e-12)
    assert driven["soc_end"] == pytest.approx(route["soc_end"], rel=1e-12)
    assert [link["rest"] for link in driven["links"]] == [link["rest"] for link in route["links"]]
    stepped = client.post("/simulate", json=body | {"model": "timestep", "stops": "none", "profile": True}).json()
    rests = [k for k, link in enumerate(stepped["links"]) if link["rest"]]
    assert [stepped["links"][k]["speed_end_kmh"] for k in rests] == [0.0, 0.0]
    assert [stepped["links"][k]["standstill_s"] for k in rests] == [0.0, 0.0]


def test_route_heights_and_line_go_with_its_links(client: TestClient) -> None:
    (route,) = ask(client, links=True)["routes"]
    rises = [
        after - before
        for before, after in itertools.pairwise(
            [route["height_start_m"], *(link["height_end_m"] for link in route["links"])]
        )
    ]
    assert sum(rise for rise in rises if rise > 0) == pytest.approx(route["climb_m"])
    for link, rise in zip(route["links"], rises, strict=True):
        assert rise == pytest.approx(link["grade"] * link["length_m"], abs=1e-9)
    ends = [link["geometry_end"] for link in route["links"]]
    assert ends == sorted(set(ends))
    assert ends[-1] == len(route["geometry"]["coordinates"]) - 1


def test_route_over_via_points_as_geojson_has_a_point_for_each(client: TestClient) -> None:
    response = client.post("/route", json=ROUTE | {"via": VIA}, headers={"Accept": "application/geo+json"})
    kinds = [feature["properties"].get("kind") for feature in response.json()["features"]]
    assert kinds == [None, "start", "via", "via", "goal"]


@pytest.mark.parametrize(
    ("via", "status", "field"),
    [
        ([VIA[0], {"lat": 50.0, "lon": 8.0}], 404, "via[1]"),
        ([VIA[0], {"lat": 95.0, "lon": 8.0}], 422, "via[1].lat"),
        ([VIA[0]] * 21, 422, "via"),
        ({"lat": 46.5, "lon": 8.0}, 422, "via"),
    ],
)
def test_via_point_that_cannot_be_is_named(client: TestClient, via: object, status: int, field: str) -> None:
    response = client.post("/route", json=ROUTE | {"via": via})
    assert response.status_code == status, response.text
    assert response.json()["errors"][0]["field"] == field


def test_pareto_set_answers_routes_by_time_and_what_is_proven_of_them(client: TestClient) -> None:
    answer = ask(client, pareto={"epsilon_frac": 0.001, "most": 9}, conditions={"ambient_c": -5})
    routes, claim = answer["routes"], answer["pareto"]
    assert len(routes) >= 2
    assert routes[-1]["name"] == "eco"
    assert [route["duration_s"] for route in routes] == sorted(route["duration_s"] for route in routes)
    assert [route["energy_kwh"] for route in routes] == sorted((r["energy_kwh"] for r in routes), reverse=True)
    assert claim["epsilon_frac"] <= 0.001
    assert claim["energy_slack_kwh"] == pytest.approx(claim["epsilon_frac"] * claim["reference_kwh"])
    assert claim["found"] >= len(routes)
    assert claim["unproven"] is None
    named = ask(client, alternatives=["fastest", "eco", "balanced"], conditions={"ambient_c": -5})
    assert named["pareto"] is None
    for other in named["routes"]:
        assert any(
            route["duration_s"] <= other["duration_s"] * (1.001 + 1e-9)
            and route["energy_kwh"] <= other["energy_kwh"] + claim["energy_slack_kwh"] + 1e-9
            for route in routes
        )
    again = ask(client, **answer["request"])
    assert again == answer


def test_pareto_set_of_a_consumption_table_is_proven_too(client: TestClient) -> None:
    vehicle = {
        "kind": "consumption_table",
        "name": "van",
        "consumption": {"speed_kmh": [30, 90], "kwh_per_100km": [13, 21]},
        "ascent_wh_per_m": 7.5,
        "descent_wh_per_m": 4.9,
        "aux_power_w": 600,
        "usable_capacity_kwh": 60,
    }
    claim = ask(client, vehicle=vehicle, pareto={"epsilon_frac": 0.001})["pareto"]
    assert claim["epsilon_frac"] <= 0.001
    assert claim["reference_kwh"] > 0.0


def test_pareto_set_without_a_proof_says_why(client: TestClient) -> None:
    for change, why in (({"stops": "counted"}, "counted"), ({"soc": 0.002}, "no way keeps the reserve")):
        answer = ask(client, pareto={}, **change)
        assert answer["request"]["pareto"] == {"epsilon_frac": 0.02, "most": 10}
        assert answer["pareto"]["proof"] == "none"
        assert answer["pareto"]["epsilon_frac"] is None
        assert why in answer["pareto"]["unproven"]
        assert any(why in warning for warning in answer["warnings"])
        assert answer["routes"][-1]["name"] == "eco"


def test_pareto_set_from_a_place_to_itself_is_one_route_of_nothing(client: TestClient) -> None:
    answer = ask(client, goal=START, pareto={})
    assert [route["distance_m"] for route in answer["routes"]] == [0.0]
    assert "same place" in answer["pareto"]["unproven"]


def test_pareto_set_as_geojson_says_the_same(client: TestClient) -> None:
    body = ROUTE | {"pareto": {"epsilon_frac": 0.001}, "links": False, "compact": False}
    plain = client.post("/route", json=body).json()
    collection = client.post("/route", json=body, headers={"Accept": "application/geo+json"}).json()
    assert collection["pareto"] == plain["pareto"]
    lines = [f["properties"]["name"] for f in collection["features"] if f["geometry"]["type"] == "LineString"]
    assert lines == [route["name"] for route in plain["routes"]]


@pytest.mark.parametrize("change", [{}, {"stays": [{"at": "goal", "minutes": 60}]}])
def test_more_charge_at_the_goal_than_stations_give_is_refused(client: TestClient, change: dict[str, Any]) -> None:
    charging = {"goal_soc": 0.9, "max_soc": 0.8} | change
    response = client.post("/route", json=ROUTE | {"charging": charging})
    assert response.status_code == 422
    (error,) = response.json()["errors"]
    assert (error["field"], error["value"]) == ("charging.goal_soc", 0.9)
    assert error["allowed"].startswith("at most max_soc, 0.8")


@pytest.mark.parametrize(
    "change",
    [
        {"soc": 0.95, "charging": {"goal_soc": 0.9}},
        {"charging": {"goal_soc": 0.9, "max_soc": 0.9}},
        {"charging": {"goal_soc": 0.9, "stays": [{"at": "goal", "minutes": 60, "power_kw": 11}]}},
    ],
)
def test_charge_at_the_goal_that_can_be_there_is_asked_for(change: dict[str, Any]) -> None:
    assert RouteRequest.model_validate(ROUTE | change).charging is not None
