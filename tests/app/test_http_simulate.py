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


def test_simulate_beyond_the_charge_reports_it_below_zero(client: TestClient) -> None:
    answer = ask(client, {"chain": [{"length_m": 9000, "grade": 0.08, "speed_limit_kmh": 50}], "soc": 0.001})
    assert answer["soc_end"] < 0
    assert answer["warnings"]
