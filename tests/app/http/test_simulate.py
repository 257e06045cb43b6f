"""POST /simulate: links of a graph, and chains by their numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from starlette.testclient import TestClient

ROUTE: dict[str, Any] = {"start": [8.003, 46.5], "goal": [8.02, 46.518], "soc": 0.5}


def ask(client: TestClient, body: dict[str, Any]) -> dict[str, Any]:
    response = client.post("/simulate", json=body)
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


@pytest.mark.parametrize("stops", ["expected", "counted", "none"])
@pytest.mark.parametrize("link_model", ["integrated", "printed"])
def test_simulate_of_a_routes_links_takes_the_routes_energy(client: TestClient, link_model: str, stops: str) -> None:
    model = {"link_model": link_model, "stops": stops}
    (route,) = client.post("/route", json=ROUTE | model).json()["routes"]
    links = [{key: link[key] for key in ("id", "from_m", "to_m")} for link in route["links"]]
    answer = ask(client, {"links": links, "soc": 0.5, **model})
    assert answer["energy_kwh"] == pytest.approx(route["energy_kwh"], rel=1e-9)
    assert answer["duration_s"] == pytest.approx(route["duration_s"], rel=1e-9)
    assert answer["distance_m"] == pytest.approx(route["distance_m"], rel=1e-9)
    assert answer["soc_end"] == pytest.approx(route["soc_end"], rel=1e-9)
    for simulated, driven in zip(answer["links"], route["links"], strict=True):
        for name in set(simulated) & set(driven):
            assert simulated[name] == pytest.approx(driven[name], rel=1e-9, abs=1e-9), name


def test_simulate_of_whole_links_fills_in_their_ends(client: TestClient) -> None:
    answer = ask(client, {"links": [{"id": 0}]})
    (link,) = answer["links"]
    assert (link["from_m"], link["to_m"]) == (0, link["length_m"])
    assert answer["soc_end"] is None
    assert answer["terrain"]["graph"] == "grid"
    assert answer["request"]["vehicle"] == "hyundai-kona-64"


def test_simulate_of_a_chain_answers_parts_that_add_up(client: TestClient) -> None:
    chain = [
        {"length_m": 400, "grade": 0.02, "speed_limit_kmh": 50, "cross": "large", "urban": True},
        {"length_m": 2500, "grade": -0.01, "speed_limit_kmh": 80},
    ]
    answer = ask(client, {"chain": chain, "soc": 0.5})
    assert answer["distance_m"] == 2900
    assert answer["energy_kwh"] == pytest.approx(sum(answer["energy_parts_kwh"].values()), rel=1e-9)
    assert answer["energy_kwh"] == pytest.approx(sum(link["energy_wh"] for link in answer["links"]) / 1000, rel=1e-9)
    assert answer["links"][0]["stop_probability"] == 0.5
    assert answer["soc_end"] == pytest.approx(0.5 - answer["energy_kwh"] / 64.0)
    assert answer["terrain"] is None


def test_simulate_of_a_chain_with_its_own_stop_probability_uses_it(client: TestClient) -> None:
    link = {"length_m": 400, "speed_limit_kmh": 50, "cross": "large", "urban": True}
    chain = [link | {"stop_probability": 1, "stop_time_s": 30}, link]
    answer = ask(client, {"chain": chain})
    assert answer["links"][0]["standstill_s"] == pytest.approx(30)


def test_simulate_of_a_motorway_has_no_stops(client: TestClient) -> None:
    link = {"length_m": 900, "speed_limit_kmh": 130, "cross": "large", "functional_class": "motorway"}
    assert ask(client, {"chain": [link, link], "arrive_stopped": False})["stop_count"] == 0


def test_simulate_of_a_descent_with_a_full_battery_reports_what_is_braked_away(client: TestClient) -> None:
    answer = ask(client, {"chain": [{"length_m": 3000, "grade": -0.08, "speed_limit_kmh": 50}], "soc": 1})
    assert answer["energy_kwh"] < 0
    assert answer["soc_end"] == 1
    assert answer["braked_away_kwh"] == pytest.approx(-answer["energy_kwh"])
    assert answer["battery_kwh"] == pytest.approx(0.0, abs=1e-9)
    assert ask(client, {"chain": [{"length_m": 3000, "speed_limit_kmh": 50}]})["battery_kwh"] is None


def test_simulate_beyond_the_charge_reports_it_below_zero(client: TestClient) -> None:
    answer = ask(client, {"chain": [{"length_m": 9000, "grade": 0.08, "speed_limit_kmh": 50}], "soc": 0.001})
    assert answer["soc_end"] < 0
    assert answer["warnings"]


def test_simulate_under_crossings_stops_where_a_minor_road_meets_a_major_one(client: TestClient) -> None:
    link = {"length_m": 400, "speed_limit_kmh": 50, "urban": True}
    chain = [link | {"cross": cross} for cross in ("small", "medium", "large", "none")]
    answer = ask(client, {"chain": chain, "stops": "crossings"})
    assert [part["stop_probability"] for part in answer["links"]] == [0, 1, 1, 1]  # the last one arrives
    assert answer["stop_count"] == 2


TOWN: list[dict[str, Any]] = [
    {"length_m": 900, "speed_limit_kmh": 80, "grade": 0.02},
    {"length_m": 30, "speed_limit_kmh": 80},
    {"length_m": 30, "speed_limit_kmh": 50},
    {"length_m": 600, "speed_limit_kmh": 30, "cross": "medium", "urban": True},
    {"length_m": 700, "speed_limit_kmh": 50, "grade": -0.03},
]


def test_simulate_by_time_steps_looks_several_links_ahead(client: TestClient) -> None:
    answer = ask(client, {"chain": TOWN, "model": "timestep", "soc": 0.5})
    fast = ask(client, {"chain": TOWN, "stops": "crossings", "soc": 0.5})
    assert answer["request"]["stops"] == "crossings"
    assert answer["stop_count"] == fast["stop_count"] == 1
    assert answer["links"][0]["speed_end_kmh"] < fast["links"][0]["speed_end_kmh"] == pytest.approx(80)
    assert answer["energy_kwh"] == pytest.approx(fast["energy_kwh"], rel=0.1)
    assert answer["energy_kwh"] == pytest.approx(sum(answer["energy_parts_kwh"].values()), rel=1e-9)
    assert answer["soc_end"] == pytest.approx(0.5 - answer["energy_kwh"] / 64.0, abs=1e-3)
    assert [link["stop_probability"] for link in answer["links"]] == [0, 0, 0, 1, 1]
    assert [link["speed_end_kmh"] == 0 for link in answer["links"]] == [False, False, False, True, True]
    assert answer["profile"] is None


def test_simulate_by_time_steps_of_a_routes_links_is_near_the_fast_model(client: TestClient) -> None:
    (route,) = client.post("/route", json=ROUTE).json()["routes"]
    links = [{key: link[key] for key in ("id", "from_m", "to_m")} for link in route["links"]]
    both = [ask(client, {"links": links, "stops": "none", "model": model}) for model in ("fast", "timestep")]
    assert both[1]["distance_m"] == both[0]["distance_m"]
    assert both[1]["energy_kwh"] == pytest.approx(both[0]["energy_kwh"], rel=0.1)
    assert both[1]["terrain"] == both[0]["terrain"]


@pytest.mark.parametrize("model", ["fast", "timestep"])
def test_simulate_with_a_profile_answers_speed_over_way_and_time(client: TestClient, model: str) -> None:
    answer = ask(client, {"chain": TOWN, "model": model, "profile": True})
    profile = answer["profile"]
    assert profile["stops"] == ("counted" if model == "fast" else "crossings")
    assert len({len(profile[name]) for name in ("distance_m", "time_s", "speed_kmh")}) == 1
    assert profile["distance_m"][-1] == pytest.approx(answer["distance_m"], abs=0.01)
    for name in ("distance_m", "time_s"):
        assert profile[name][0] == 0
        assert profile[name] == sorted(profile[name])
    assert max(profile["speed_kmh"]) == pytest.approx(80)
    assert profile["speed_kmh"][-1] == 0
    if model == "timestep":
        assert profile["time_s"][-1] == pytest.approx(answer["duration_s"], abs=0.01)


def test_simulate_echoes_what_was_asked(client: TestClient) -> None:
    body = {"chain": TOWN, "conditions": {"ambient_c": -5, "payload_kg": 80}, "effects": {"heating_cop": 2.5}}
    understood = ask(client, body)["request"]
    assert (understood["model"], understood["stops"], understood["profile"]) == ("fast", "expected", False)
    assert understood["conditions"]["ambient_c"] == -5
    assert understood["conditions"]["drag_factor"] == 1
    assert understood["effects"]["heating_cop"] == 2.5
    assert ask(client, {"chain": TOWN})["request"]["conditions"] is None


@pytest.mark.parametrize("model", ["fast", "timestep"])
@pytest.mark.parametrize(
    ("conditions", "part"),
    [
        ({"ambient_c": -5}, "cabin"),
        ({"ambient_c": -5}, "tyre_temperature"),
        ({"ambient_c": -5}, "battery_resistance"),
        ({"payload_kg": 300}, "payload"),
        ({"drag_factor": 1.25}, "drag"),
        ({"road": "snow"}, "road_surface"),
        ({"wind_speed_mps": 8, "wind_from_deg": 90}, "wind"),
    ],
)
def test_simulate_under_conditions_takes_more_and_says_for_what(
    client: TestClient, model: str, conditions: dict[str, Any], part: str
) -> None:
    chain = [link | {"heading_deg": 90, "altitude_m": 400} for link in TOWN]
    still = ask(client, {"chain": chain, "model": model})
    answer = ask(client, {"chain": chain, "model": model, "conditions": conditions})
    assert still["energy_parts_kwh"][part] == pytest.approx(0, abs=1e-12)
    assert answer["energy_parts_kwh"][part] > 0
    assert answer["energy_kwh"] > still["energy_kwh"]


def test_simulate_with_effects_changes_their_strength(client: TestClient) -> None:
    body = {"chain": TOWN, "conditions": {"ambient_c": -5}}
    resistance = ask(client, body | {"effects": {"heating_cop": 1}})
    pump = ask(client, body | {"effects": {"heating_cop": 3}})
    assert pump["energy_parts_kwh"]["cabin"] < resistance["energy_parts_kwh"]["cabin"]


def test_simulate_of_a_graphs_links_knows_their_heading_and_altitude(client: TestClient) -> None:
    links = [{"id": 0}]  # from node 0 eastwards
    against, behind = (
        ask(client, {"links": links, "conditions": {"wind_speed_mps": 8, "wind_from_deg": degrees}})
        for degrees in (90, 270)
    )
    assert against["energy_parts_kwh"]["wind"] > 0 > behind["energy_parts_kwh"]["wind"]
    thin = ask(client, {"links": links, "conditions": {"altitude_density": True}})
    assert thin["energy_parts_kwh"]["air_density"] < 0  # 500 m up


@pytest.mark.parametrize(
    ("body", "code", "field"),
    [
        ({"model": "exact"}, "invalid_request", "model"),
        ({"model": "timestep", "stops": "expected"}, "invalid_request", "stops"),
        ({"model": "timestep", "link_model": "printed"}, "invalid_request", "link_model"),
        ({"conditions": {"ambient_c": 80}}, "invalid_request", "conditions.ambient_c"),
        ({"conditions": {"sun_w": 300}}, "invalid_request", "conditions.sun_w"),
        ({"conditions": {"cabin_start_c": 30}}, "invalid_request", "conditions.cabin_start_c"),
        ({"conditions": {"snow": True}}, "invalid_request", "conditions.snow"),
        ({"effects": {"heating_cop": 0}}, "invalid_request", "effects.heating_cop"),
        ({"conditions": {"wind_speed_mps": 5}}, "invalid_conditions", "conditions.wind_speed_mps"),
        ({"conditions": {"altitude_density": True}}, "invalid_conditions", "conditions.altitude_density"),
        ({"effects": {"regen_cold_none_c": 20}}, "invalid_conditions", "effects.regen_cold_none_c"),
    ],
)
def test_simulate_refuses_what_does_not_go_together(
    client: TestClient, body: dict[str, Any], code: str, field: str
) -> None:
    response = client.post("/simulate", json={"chain": TOWN} | body)
    assert response.status_code == 422
    problem = response.json()
    assert problem["code"] == code
    assert problem["errors"][0]["field"] == field


@pytest.mark.parametrize("name", ["altitude_m", "heading_deg"])
def test_simulate_refuses_a_chain_of_which_some_links_lack_a_number(client: TestClient, name: str) -> None:
    chain = [TOWN[0] | {name: 90}, TOWN[1]]
    problem = client.post("/simulate", json={"chain": chain}).json()
    assert problem["errors"][0]["field"] == f"chain[1].{name}"


def test_simulate_by_time_steps_of_a_crawl_is_refused(client: TestClient) -> None:
    chain = [{"length_m": 1e6, "speed_limit_kmh": 1}]
    problem = client.post("/simulate", json={"chain": chain, "model": "timestep"}).json()
    assert problem["code"] == "invalid_link"
    assert problem["errors"][0]["field"] == "chain[0].speed_limit_kmh"
    assert problem["errors"][0]["value"] == 1
    assert problem["detail"].startswith("speed_limit_kmh of link 0 is 1.0, allowed: at most 10000000 steps of 0.1 s")


def test_simulate_by_time_steps_of_a_long_drive_is_refused_with_a_profile_only(client: TestClient) -> None:
    # 1000 km at 4 km/h is 250 h, 9 million steps
    body = {"chain": [TOWN[0], {"length_m": 1e6, "speed_limit_kmh": 4}], "model": "timestep"}
    problem = client.post("/simulate", json=body | {"profile": True}).json()
    (error,) = problem["errors"]
    assert (problem["code"], error["field"], error["value"]) == ("invalid_link", "chain[1].speed_limit_kmh", 4)
    assert error["allowed"] == "at most 2000000 steps of 0.1 s for the whole drive with a profile"
    assert ask(client, body)["duration_s"] > 900_000


def test_simulate_refuses_a_limit_above_200_kmh_by_the_name_that_was_sent(client: TestClient) -> None:
    problem = client.post("/simulate", json={"chain": [{"length_m": 500, "speed_limit_kmh": 360}]}).json()
    (error,) = problem["errors"]
    assert (problem["code"], error["field"], error["value"]) == ("invalid_request", "chain[0].speed_limit_kmh", 360)
    assert error["allowed"] == "at most 200"


def test_simulate_at_200_kmh_is_driven(client: TestClient) -> None:
    answer = ask(client, {"chain": [{"length_m": 50_000, "speed_limit_kmh": 200}]})
    assert answer["links"][0]["speed_limit_kmh"] == pytest.approx(200)


def test_simulate_of_a_graphs_links_keeps_their_name_in_an_error(client: TestClient) -> None:
    problem = client.post("/simulate", json={"links": [{"id": 0}, {"id": 0}]}).json()
    assert problem["code"] == "invalid_link"
    assert problem["errors"][0]["field"] == "links[1].id"


def test_simulate_of_a_consumption_table_by_time_steps_is_refused(client: TestClient) -> None:
    table = {
        "kind": "consumption_table",
        "consumption": {"speed_kmh": [30, 90, 130], "kwh_per_100km": [13, 21, 34]},
        "ascent_wh_per_m": 7.5,
        "descent_wh_per_m": 4.9,
        "aux_power_w": 600,
        "usable_capacity_kwh": 60,
    }
    fast = ask(client, {"chain": TOWN, "vehicle": table, "profile": True})
    assert fast["energy_parts_kwh"]["consumption_table"] > 0
    problem = client.post("/simulate", json={"chain": TOWN, "vehicle": table, "model": "timestep"}).json()
    assert (problem["code"], problem["errors"][0]["field"]) == ("invalid_conditions", "model")
