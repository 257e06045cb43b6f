"""POST /matrix on the hand-made grid: the figures of POST /route, pair by pair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from app.http.examples.answers import MATRIX_REQUESTS
from app.main import create_app
from app.schemas.matrix import MatrixRequest
from app.service.service import Service
from tests.app.expected import TABLE, VEHICLE, check_problem

if TYPE_CHECKING:
    from app.settings import Settings

PLACES = [{"lat": 46.5, "lon": 8.003}, {"lat": 46.518, "lon": 8.02}, [8.01, 46.507]]
MATRIX: dict[str, Any] = {"sources": PLACES, "soc": 0.5}
FIGURES = ("energy_kwh", "battery_kwh", "duration_s", "distance_m", "soc_end", "soc_min")
FAR = {"lat": 46.505, "lon": 8.005}


def ask(client: TestClient, **change: object) -> dict[str, Any]:
    response = client.post("/matrix", json=MATRIX | change)
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    assert answer["stats"].pop("seconds") >= 0
    return answer


def route_of(client: TestClient, start: object, goal: object, **change: object) -> dict[str, Any]:
    asked = {"start": start, "goal": goal, "links": False, **change}
    (route,) = client.post("/route", json=asked).json()["routes"]
    assert isinstance(route, dict)
    return route


def check_pairs(client: TestClient, sources: list[Any], targets: list[Any], **change: object) -> None:
    answer = ask(client, sources=sources, targets=targets, **change)
    for i, source in enumerate(sources):
        for j, target in enumerate(targets):
            route = route_of(client, source, target, **({"soc": 0.5} | change))
            assert answer["feasible"][i][j] is route["feasible"]
            assert answer["reason"][i][j] == (None if route["feasible"] else "charge")
            assert answer["deficit_kwh"][i][j] == pytest.approx(route["deficit_kwh"], rel=1e-9, abs=1e-12)
            for name in FIGURES:
                expected = route[name] if route["feasible"] else None
                found = answer[name][i][j]
                assert found == (None if expected is None else pytest.approx(expected, rel=1e-9, abs=1e-12)), name


def test_places_far_off_their_road_are_warned_of_each_once(client: TestClient) -> None:
    of_route = client.post("/route", json={"start": FAR, "goal": PLACES[0], "soc": 0.5}).json()["warnings"][-1]
    moved = of_route.removeprefix("start")
    assert moved.endswith("' and was moved there")
    assert ask(client, sources=[PLACES[0], FAR])["warnings"][-1:] == [f"sources[1]{moved}"]
    both = ask(client, sources=[FAR, PLACES[0]], targets=[PLACES[1], FAR])["warnings"]
    assert both[-2:] == [f"sources[0]{moved}", f"targets[1]{moved}"]
    assert not any("moved" in warning for warning in ask(client)["warnings"])


on_a_street = st.builds(
    lambda street, share, eastward: [8.0 + share, 46.5 + street] if eastward else [8.0 + street, 46.5 + share],
    st.sampled_from([0.0, 0.01, 0.0199999]),
    st.floats(0.0001, 0.0199),
    st.booleans(),
)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(on_a_street, min_size=1, max_size=3),
    st.lists(on_a_street, min_size=1, max_size=3),
    st.sampled_from([0.5, 1.0, 0.004, 0.002]),
    st.sampled_from(
        [
            {},
            {"vehicle": "bmw-i3-60ah", "conditions": {"ambient_c": -5, "regen_limited": True}},
            {"vehicle": VEHICLE, "weights": {"energy": 1, "time": 10}, "stops": "counted"},
            {"vehicle": TABLE, "weights": {"time": 1}, "stops": "none"},
            {"vehicle": "vw-id4", "effects": {"heating_cop": 2.0}, "conditions": {"ambient_c": 0, "road": "wet"}},
            {"reserve_soc": 0.0015, "link_model": "printed"},
        ]
    ),
)
def test_every_entry_equals_the_route_of_its_pair(client, sources, targets, soc, change) -> None:
    check_pairs(client, sources, targets, soc=soc, **change)


def test_matrix_without_targets_is_from_each_source_to_each(client: TestClient) -> None:
    square, written_out = ask(client), ask(client, targets=PLACES)
    assert square.pop("request")["targets"] is None
    assert written_out.pop("request")["targets"] == PLACES
    assert square == written_out
    assert [square["energy_kwh"][k][k] for k in range(3)] == [0.0] * 3
    assert [place["asked"] for place in square["sources"]][:2] == PLACES[:2]
    assert square["terrain"]["graph"] == "grid"


def test_matrix_request_as_understood_sent_again_answers_the_same(client: TestClient) -> None:
    answer = ask(client, targets=PLACES[:1], vehicle="bmw-i3-60ah", weights={"time": 3})
    assert answer["request"]["graph"] == "grid"
    assert ask(client, **answer["request"]) == answer


def test_pair_beyond_the_charge_has_no_figures_but_what_is_missing(client: TestClient) -> None:
    answer = ask(client, targets=PLACES[1:2], soc=0.002)
    assert answer["feasible"][0] == [False]
    assert [answer[name][0] for name in FIGURES] == [[None]] * len(FIGURES)
    assert answer["reason"][0] == ["charge"]
    enough = 0.002 + answer["deficit_kwh"][0][0] / 64.0 * 1.02
    assert ask(client, targets=PLACES[1:2], soc=enough)["feasible"][0] == [True]


def test_place_far_from_any_road_is_named_by_list_and_number(settings: Settings, service: Service) -> None:
    strict = Service(settings.model_copy(update={"snap_limit_m": 100.0}))
    with TestClient(create_app(settings, strict)) as client:
        problem = check_problem(
            client.post("/matrix", json=MATRIX | {"sources": [*PLACES, FAR]}), 404, "point_far_from_road"
        )
        assert problem["errors"][0]["field"] == "sources[3]"
        response = client.post("/matrix", json=MATRIX | {"targets": [[8.01, 46.507], [0, 0]]})
        assert check_problem(response, 404, "point_outside_map")["errors"][0]["field"] == "targets[1]"


@pytest.mark.parametrize("field", ["sources", "targets"])
def test_more_places_than_the_setting_allows_are_refused_with_its_name(settings: Settings, field: str) -> None:
    few = settings.model_copy(update={"matrix_limit_places": 2})
    with TestClient(create_app(few, Service(few))) as client:
        response = client.post("/matrix", json={"sources": PLACES[:2], "soc": 0.5} | {field: PLACES})
        (error,) = check_problem(response, 422, "invalid_request")["errors"]
        assert error == {"field": field, "value": "a list of 3", "allowed": "at most 2 (JOULEPATH_MATRIX_LIMIT_PLACES)"}
        assert client.post("/matrix", json={"sources": PLACES[:2], "soc": 0.5}).status_code == 200


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"sources": []}, "sources"),
        ({"targets": []}, "targets"),
        ({"sources": [*PLACES, {"lat": 95, "lon": 8}]}, "sources[3].lat"),
        ({"reserve_soc": 0.6}, "reserve_soc"),
        ({"alternatives": ["eco"]}, "alternatives"),
        ({"weights": {"energy": 0}}, "weights"),
    ],
)
def test_matrix_that_can_not_be_understood_is_refused_with_its_field(
    client: TestClient, change: dict[str, Any], field: str
) -> None:
    problem = check_problem(client.post("/matrix", json=MATRIX | change), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field


def test_matrix_beyond_the_time_limit_answers_503(settings: Settings, service: Service) -> None:
    hasty = settings.model_copy(update={"time_limit_s": 1e-6})
    with TestClient(create_app(hasty, service)) as client:
        check_problem(client.post("/matrix", json=MATRIX), 503, "time_limit")


def test_matrix_search_that_fails_answers_its_problem(settings: Settings) -> None:
    tight = settings.model_copy(update={"label_limit": 3})
    with TestClient(create_app(tight, Service(tight))) as client:
        check_problem(client.post("/matrix", json=MATRIX), 503, "search_limit")


def test_examples_of_the_document_are_valid_requests() -> None:
    for example in MATRIX_REQUESTS.values():
        assert MatrixRequest.model_validate(example["value"]).soc > 0
