"""Every error is a problem with its code, and names field, value and allowed range."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from app.errors.handlers import install_error_handlers, problem_response
from app.errors.problems import KINDS
from app.errors.raised import OverloadedError
from app.errors.table import HTTP_CODES
from app.errors.table import TABLE as KINDS_OF_ERROR
from app.main import create_app
from app.schemas.problem import ErrorCode
from diagnosis.errors import ComparisonError
from energy.errors import LinkError, Refusal
from routing.errors import GraphFormatError, NegativeCycleError, NoPathError, TimeUpError
from tests.app.expected import CHAIN_LINK, TABLE, VEHICLE, check_problem

if TYPE_CHECKING:
    from app.service.service import Service
    from app.settings import Settings

ROUTE: dict[str, Any] = {"start": [8.0, 46.5], "goal": {"lat": 46.52, "lon": 8.02}, "soc": 0.5}
JSON_HEADER = {"Content-Type": "application/json"}


@pytest.mark.parametrize(
    ("change", "field", "value", "allowed"),
    [
        ({"soc": 1.4}, "soc", 1.4, "at most 1"),
        ({"soc": 80}, "soc", 80, "at most 1; did you mean 0.8?"),
        ({"soc": 101}, "soc", 101, "at most 1"),
        ({"soc": -0.1}, "soc", -0.1, "at least 0"),
        ({"soc": "0.5"}, "soc", "0.5", "a valid number"),
        ({"soc": True}, "soc", True, "a valid number"),
        ({"soc": None}, "soc", None, "a valid number"),
        ({"start": {"lat": 95, "lon": 8}}, "start.lat", 95, "at most 90; did you mean lat 8, lon 95?"),
        ({"start": {"lat": 46.5}}, "start.lon", None, "required"),
        ({"start": [200, 46.5]}, "start[0]", 200, "at most 180; did you mean -160?"),
        ({"start": {"lat": 46.5, "lon": -540}}, "start.lon", -540, "at least -180; did you mean 180?"),
        ({"start": {"lat": 46.5, "lon": 1e9}}, "start.lon", 1e9, "at most 180"),
        ({"start": [8.0]}, "start[1]", None, "required"),
        ({"start": [8, 46, 1, 1]}, "start", [8, 46, 1, 1], "at most 2 items"),
        ({"goal": 7}, "goal", 7, "an object with lat and lon, a list [lon, lat], or a text that names a place"),
        ({"vehicle": 7}, "vehicle", 7, "the id of a vehicle, or an object that describes one"),
        ({"vehicle": VEHICLE | {"kind": "steam"}}, "vehicle.kind", "steam", "'physical' or 'consumption_table'"),
        ({"vehicle": VEHICLE | {"sd": {"mass_kg": -1}}}, "vehicle.sd.mass_kg", -1, "at least 0"),
        ({"vehicle": VEHICLE | {"effects": {"colour": 1}}}, "vehicle.effects.colour", 1, "no field of this name"),
        ({"vehicle": {"consumption": {}}}, "vehicle.kind", None, "required"),
        ({"vehicle": VEHICLE | {"mass_kg": 0}}, "vehicle.mass_kg", 0, "at least 1"),
        ({"vehicle": VEHICLE | {"road_load": {"a_lbf": 20}}}, "vehicle.road_load.b_lbf_per_mph", None, "required"),
        ({"weather": {}}, "weather", {}, "no field of this name"),
        ({"conditions": {"ambient_c": 90}}, "conditions.ambient_c", 90, "at most 56.85"),
        ({"conditions": {"wind_speed_mps": -1}}, "conditions.wind_speed_mps", -1, "at least 0"),
        ({"conditions": {"cabin_start_c": 5}}, "conditions.cabin_start_c", 5, "only together with ambient_c"),
        ({"effects": {"heating_cop": 0}}, "effects.heating_cop", 0, "at least 0.5"),
        ({"alternatives": ["best"]}, "alternatives[0]", "best", "'eco', 'fastest' or 'balanced'"),
        ({"alternatives": ["eco", "eco"]}, "alternatives", ["eco", "eco"], "each at most once"),
        ({"pareto": {"epsilon_frac": 0.0}}, "pareto.epsilon_frac", 0.0, "at least 0.001"),
        ({"pareto": {"most": 51}}, "pareto.most", 51, "at most 50"),
        ({"weights": {"energy": -1}}, "weights.energy", -1, "at least 0"),
        ({"weights": {}}, "weights", "all 0", "at least one of energy, time, distance above 0"),
        ({"reserve_soc": 0.9}, "reserve_soc", 0.9, "at most soc, 0.5"),
        ({"link_model": "exact"}, "link_model", "exact", "'integrated' or 'printed'"),
        ({"stops": "all"}, "stops", "all", "'expected', 'counted', 'none' or 'crossings'"),
        ({"links": "no"}, "links", "no", "a valid boolean"),
    ],
)
def test_route_with_a_bad_field_names_field_value_and_allowed_range(
    client: TestClient, change: dict[str, Any], field: str, value: object, allowed: str
) -> None:
    problem = check_problem(client.post("/route", json=ROUTE | change), 422, "invalid_request")
    assert problem["errors"][0] == {"field": field, "value": value, "allowed": allowed}
    assert field in problem["detail"]


INLINE: dict[str, dict[str, Any]] = {
    "/route": ROUTE,
    "/range": {"origin": ROUTE["start"], "soc": 0.5},
    "/matrix": {"sources": [ROUTE["start"]], "targets": [ROUTE["goal"]], "soc": 0.5},
    "/simulate": {"chain": [CHAIN_LINK], "soc": 0.5},
}
PLUGS: dict[str, Any] = {"connectors": ["type2"], "ac_kw": 11}


@pytest.mark.parametrize("path", INLINE)
@pytest.mark.parametrize(
    ("vehicle", "field", "allowed"),
    [
        (VEHICLE | {"charging": PLUGS | {"connectors": ["type2", "type2"]}}, "charging.connectors", "each once"),
        (VEHICLE | {"charging": PLUGS | {"connectors": ["ccs2"]}}, "charging.curve_kw", "with the connectors ccs2"),
        (VEHICLE | {"charging": PLUGS | {"ac_one_phase_kw": 20}}, "charging.ac_one_phase_kw", "to ac_kw"),
        (VEHICLE | {"effects": {"cabin_target_c": 25, "cooling_target_c": 20}}, "effects.cooling_target_c", "25"),
        (VEHICLE | {"road_load": {"a_n": 0, "b_n_per_kmh": -5, "c_n_per_kmh2": 0}}, "road_load", "at least 0 N"),
        (
            VEHICLE | {"acceleration": {"speed_kmh": [0, 10, 5], "accel_mps2": [1, 1], "decel_mps2": [-1, -1]}},
            "acceleration.speed_kmh",
            "rising",
        ),
        (TABLE | {"consumption": {"speed_kmh": [50, 40], "kwh_per_100km": [9, 9]}}, "consumption.speed_kmh", "rising"),
        (TABLE | {"descent_wh_per_m": 100}, "descent_wh_per_m", "at most ascent_wh_per_m"),
    ],
)
def test_contradiction_in_a_vehicle_of_a_request_is_named_by_its_path_from_the_root(
    client: TestClient, path: str, vehicle: dict[str, Any], field: str, allowed: str
) -> None:
    problem = check_problem(client.post(path, json=INLINE[path] | {"vehicle": vehicle}), 422, "invalid_vehicle")
    assert problem["errors"][0]["field"] == f"vehicle.{field}"
    assert allowed in problem["errors"][0]["allowed"]
    assert problem["detail"].startswith(f"vehicle.{field} is ")


def test_deviations_that_no_vehicle_can_have_are_named_by_their_path_from_the_root(client: TestClient) -> None:
    body = ROUTE | {"vehicle": VEHICLE | {"sd": {"mass_kg": 1e9}}, "uncertainty": True}
    problem = check_problem(client.post("/route", json=body), 422, "invalid_vehicle")
    assert problem["errors"][0]["field"] == "vehicle.sd"
    assert problem["detail"].startswith("vehicle.sd is ")


@pytest.mark.parametrize("missing", ["start", "goal", "soc"])
def test_route_without_a_required_field_names_it(client: TestClient, missing: str) -> None:
    body = {key: value for key, value in ROUTE.items() if key != missing}
    problem = check_problem(client.post("/route", json=body), 422, "invalid_request")
    assert problem["errors"] == [{"field": missing, "value": None, "allowed": "required"}]
    assert problem["detail"] == f"{missing} is missing, it is required"


@pytest.mark.parametrize("other", [{"weights": {"energy": 1}}, {"alternatives": ["eco"]}])
def test_pareto_set_with_weights_or_alternatives_is_refused(client: TestClient, other: dict[str, Any]) -> None:
    response = client.post("/route", json=ROUTE | {"pareto": {}} | other)
    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == "pareto"


def test_route_with_weights_and_alternatives_is_refused(client: TestClient) -> None:
    body = ROUTE | {"weights": {"energy": 1}, "alternatives": ["eco"]}
    problem = check_problem(client.post("/route", json=body), 422, "invalid_request")
    assert "not both" in problem["detail"]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "9" * 400])
@pytest.mark.parametrize("field", ["soc", "reserve_soc"])
def test_route_with_a_number_that_is_not_finite_is_refused_in_valid_json(
    client: TestClient, field: str, number: str
) -> None:
    body = json.dumps(ROUTE | {field: 0.123}).replace("0.123", number)
    problem = check_problem(client.post("/route", content=body, headers=JSON_HEADER), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field


@pytest.mark.parametrize(
    "body",
    [
        b"{",
        b"",
        b"\xff\xfe{",
        b"[" * 50_000,
        b'{"a":' * 10_000,
        b'{"soc": ' + b"9" * 5000 + b"}",
        b'"\\ud800"',
        b"null",
    ],
    ids=["cut off", "empty", "not utf-8", "deep list", "deep object", "5000 digits", "lone surrogate", "null"],
)
@pytest.mark.parametrize("path", ["/route", "/range", "/simulate"])
def test_body_that_is_no_request_is_refused(client: TestClient, path: str, body: bytes) -> None:
    response = client.post(path, content=body, headers=JSON_HEADER)
    code = "malformed_json" if "malformed" in response.text else "invalid_request"
    check_problem(response, 422, code)


def test_body_with_a_lone_surrogate_as_field_name_is_refused(client: TestClient) -> None:
    body = json.dumps(ROUTE | {"\ud800": 1})
    check_problem(client.post("/route", content=body, headers=JSON_HEADER), 422, "invalid_request")


def test_body_of_another_content_type_names_the_right_one(client: TestClient) -> None:
    problem = check_problem(client.post("/route", data={"soc": "0.5"}), 422, "invalid_request")
    assert "application/json" in problem["errors"][0]["allowed"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (
            {"drive_eff": 1.0, "recuperation_eff": 1.0, "road_load": {"a_n": -5, "b_n_per_kmh": 0, "c_n_per_kmh2": 0}},
            "road_load",
        ),
        (
            {"acceleration": {"speed_kmh": [0, 50, 40], "accel_mps2": [1, 1], "decel_mps2": [-1, -1]}},
            "acceleration.speed_kmh",
        ),
        (
            {"acceleration": {"speed_kmh": [0, 50], "accel_mps2": [1, 1], "decel_mps2": [-1]}},
            "acceleration.accel_mps2",
        ),
    ],
)
def test_inline_vehicle_that_contradicts_itself_names_the_field_as_sent(
    client: TestClient, change: dict[str, Any], field: str
) -> None:
    body = {"chain": [CHAIN_LINK], "vehicle": VEHICLE | change}
    problem = check_problem(client.post("/simulate", json=body), 422, "invalid_vehicle")
    assert problem["errors"][0]["field"] == f"vehicle.{field}"


@pytest.mark.parametrize(
    ("method", "path", "body", "field"),
    [
        ("GET", "/vehicles/delorean", None, "vehicle"),
        ("POST", "/route", ROUTE | {"vehicle": "delorean"}, "vehicle"),
        ("GET", "/range?lat=46.5&lon=8&soc=0.5&vehicle=delorean", None, "vehicle"),
    ],
)
def test_unknown_vehicle_answers_404_and_lists_known_ones(
    client: TestClient, method: str, path: str, body: object, field: str
) -> None:
    problem = check_problem(client.request(method, path, json=body), 404, "unknown_vehicle")
    assert problem["errors"][0]["field"] == field
    assert re.fullmatch(r"one of ([a-z0-9-]+, ){9}[a-z0-9-]+ and \d+ more", problem["errors"][0]["allowed"])


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("GET", "/graphs/atlantis", None),
        ("POST", "/route", ROUTE | {"graph": "atlantis"}),
        ("GET", "/range?lat=46.5&lon=8&soc=0.5&graph=atlantis", None),
        ("POST", "/simulate", {"graph": "atlantis", "links": [{"id": 0}]}),
    ],
)
def test_unknown_graph_answers_404_and_lists_the_known(
    client: TestClient, method: str, path: str, body: object
) -> None:
    problem = check_problem(client.request(method, path, json=body), 404, "unknown_graph")
    assert problem["errors"] == [{"field": "graph", "value": "atlantis", "allowed": "one of grid, level"}]


@pytest.mark.parametrize(
    ("method", "path", "body", "field"),
    [
        ("POST", "/route", ROUTE | {"start": {"lat": 60, "lon": 8}}, "start"),
        ("POST", "/route", ROUTE | {"goal": [9, 46.5]}, "goal"),
        ("GET", "/range?lat=60&lon=8&soc=0.5", None, "origin"),
    ],
)
def test_place_outside_the_map_answers_404_with_its_extent(
    client: TestClient, method: str, path: str, body: object, field: str
) -> None:
    problem = check_problem(client.request(method, path, json=body), 404, "point_outside_map")
    assert problem["errors"][0]["field"] == field
    assert problem["errors"][0]["allowed"] == "lat 46.5..46.52, lon 8..8.02"


@pytest.mark.parametrize(
    ("place", "field", "value"),
    [({"lat": 139.7, "lon": 35.6}, "start.lat", 139.7), ([35.6, -139.7], "start[1]", -139.7)],
)
def test_latitude_that_can_only_be_a_longitude_is_asked_about(
    client: TestClient, place: object, field: str, value: float
) -> None:
    problem = check_problem(client.post("/route", json=ROUTE | {"start": place}), 422, "invalid_request")
    assert [(error["field"], error["value"]) for error in problem["errors"]] == [(field, value)]
    assert problem["errors"][0]["allowed"].endswith(f"90; did you mean lat 35.6, lon {value}?")


@pytest.mark.parametrize(
    ("method", "path", "body", "field"),
    [
        ("GET", "/range?lat=139.7&lon=35.6&soc=0.5", None, "lat"),
        ("POST", "/range", {"origin": {"lat": 139.7, "lon": 35.6}, "soc": 0.5}, "origin.lat"),
        ("POST", "/route", ROUTE | {"via": [[8.0, 46.5], [35.6, 139.7]]}, "via[1][1]"),
        ("POST", "/matrix", {"sources": [[35.6, 139.7]], "soc": 0.5}, "sources[0][1]"),
    ],
)
def test_latitude_that_can_only_be_a_longitude_is_asked_about_wherever_it_is_sent(
    client: TestClient, method: str, path: str, body: object, field: str
) -> None:
    problem = check_problem(client.request(method, path, json=body), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field
    assert problem["errors"][0]["allowed"] == "at most 90; did you mean lat 35.6, lon 139.7?"


def test_swapped_place_of_this_map_is_asked_about(client: TestClient) -> None:
    answer = client.post("/route", json=ROUTE | {"goal": {"lat": 8.01, "lon": 46.507}})
    assert check_problem(answer, 404, "point_outside_map")["detail"].endswith("; did you mean lat 46.507, lon 8.01?")


def test_place_far_from_any_road_answers_404_with_the_limit(settings: Settings) -> None:
    with TestClient(create_app(settings.model_copy(update={"snap_limit_m": 100.0}))) as strict:
        response = strict.post("/route", json=ROUTE | {"start": {"lat": 46.505, "lon": 8.005}})
    problem = check_problem(response, 404, "point_far_from_road")
    assert problem["errors"][0]["field"] == "start"
    assert problem["errors"][0]["value"] == {"lat": 46.505, "lon": 8.005}
    assert "at most 100 m" in problem["errors"][0]["allowed"]


def test_search_beyond_its_label_limit_answers_503(settings: Settings) -> None:
    tight = settings.model_copy(update={"label_limit": 3})
    with TestClient(create_app(tight)) as limited:
        response = limited.get("/range?lat=46.5&lon=8&soc=0.9")
    problem = check_problem(response, 503, "search_limit")
    assert response.headers["retry-after"] == "5"
    assert "at most 3 labels" in problem["errors"][0]["allowed"]


@pytest.mark.parametrize(
    ("error", "code", "retry_s"), [(TimeUpError(30.0), "time_limit", "5"), (OverloadedError(3.2), "overloaded", "4")]
)
def test_answer_that_takes_too_long_is_503_and_says_when_to_ask_again(
    error: Exception, code: str, retry_s: str
) -> None:
    response = problem_response(error, "/route")
    assert response.status_code == 503
    assert json.loads(bytes(response.body))["code"] == code
    assert response.headers["Retry-After"] == retry_s


@pytest.mark.parametrize(
    ("body", "field", "value"),
    [
        ({"start": {f"k{k}": k for k in range(1001)}}, "start", "an object of 1001 fields"),
        ({f"k{k}": k for k in range(300_000)}, "", "an object of 300000 fields"),
        ({"via": [[] for _ in range(50_001)]}, "via", "a list of 50001 items"),
        ([[[0] * 50_001]], "[0][0]", "a list of 50001 items"),
    ],
)
def test_list_or_object_longer_than_any_request_needs_is_refused(
    settings: Settings, service: Service, body: object, field: str, value: str
) -> None:
    wide = settings.model_copy(update={"body_limit_bytes": 8_000_000})
    with TestClient(create_app(wide, service)) as client:
        problem = check_problem(client.post("/route", json=body), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field
    assert problem["errors"][0]["value"] == value


@pytest.mark.parametrize("path", ["/readyz", "/vehicles", "/graphs", "/range?lat=46.5&lon=8&soc=0.5"])
def test_service_that_has_not_started_answers_503(settings: Settings, path: str) -> None:
    not_started = TestClient(create_app(settings))
    check_problem(not_started.get(path), 503, "not_ready")


def test_healthz_of_a_service_that_has_not_started_answers_200(settings: Settings) -> None:
    assert TestClient(create_app(settings)).get("/healthz").json() == {"status": "ok"}


def test_body_above_the_limit_by_its_declared_length_answers_413(client: TestClient, settings: Settings) -> None:
    body = b" " * (settings.body_limit_bytes + 1)
    problem = check_problem(client.post("/route", content=body, headers=JSON_HEADER), 413, "body_too_large")
    assert "100000 bytes" in problem["detail"]


def test_body_above_the_limit_in_chunks_answers_413(client: TestClient, settings: Settings) -> None:
    chunks = (b" " * 1000 for _ in range(settings.body_limit_bytes // 1000 + 1))
    check_problem(client.post("/route", content=chunks, headers=JSON_HEADER), 413, "body_too_large")


def test_body_at_the_limit_is_read(client: TestClient, settings: Settings) -> None:
    body = json.dumps(ROUTE | {"vehicle": "delorean"}).encode()
    body += b" " * (settings.body_limit_bytes - len(body))
    check_problem(client.post("/route", content=body, headers=JSON_HEADER), 404, "unknown_vehicle")


def test_unknown_address_answers_404(client: TestClient) -> None:
    check_problem(client.get("/nothing/here"), 404, "not_found")


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("DELETE", "/route", "POST"),
        ("GET", "/simulate", "POST"),
        ("PUT", "/range", "GET, POST"),
        ("PUT", "/vehicles", "GET"),
        ("PATCH", "/vehicles/bmw-i3-60ah", "DELETE, GET, PUT"),
        ("DELETE", "/reload", "POST"),
        ("DELETE", "/graphs/grid", "GET"),
    ],
)
def test_unknown_method_answers_405_with_the_allowed(client: TestClient, method: str, path: str, allowed: str) -> None:
    response = client.request(method, path)
    check_problem(response, 405, "method_not_allowed")
    assert response.headers["allow"] == allowed


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("lat=46.5&lon=8&soc=nan", "soc"),
        ("lat=46.5&lon=8&soc=2", "soc"),
        ("lat=north&lon=8&soc=0.5", "lat"),
        ("lat=46.5&lon=8&soc=0.5&colour=red", "colour"),
        ("lat=46.5&lon=8&soc=0.5&bands=0", "bands"),
        ("lat=46.5&lon=8&soc=0.5&bands=21", "bands"),
        ("lat=46.5&lon=8&soc=0.5&bands=99999999999999999999", "bands[0]"),
        ("lat=46.5&lon=8&soc=0.5&bands=0.1,many", "bands"),
        ("lat=46.5&lon=8&soc=0.5&bands=0.1,0.7", "bands"),
        ("lat=46.5&lon=8&soc=0.5&bands=0.1,1.7", "bands[1]"),
        ("lat=46.5&lon=8&soc=0.5&reserve_soc=0.6", "reserve_soc"),
        ("lat=46.5&lon=8", "soc"),
    ],
)
def test_range_with_a_bad_parameter_names_it(client: TestClient, query: str, field: str) -> None:
    problem = check_problem(client.get(f"/range?{query}"), 422, "invalid_request")
    assert problem["errors"][0]["field"] == field


@pytest.mark.parametrize(
    ("links", "position"),
    [
        ([{"id": 999}], 0),
        ([{"id": 0}, {"id": 0}], 1),
        ([{"id": 0, "from_m": 50, "to_m": 10}], 0),
        ([{"id": 0, "to_m": 1e6}], 0),
    ],
    ids=["no such link", "not consecutive", "backwards", "beyond its end"],
)
def test_simulate_with_a_link_that_cannot_follow_names_its_position(
    client: TestClient, links: list[dict[str, float]], position: int
) -> None:
    problem = check_problem(client.post("/simulate", json={"links": links}), 422, "invalid_link")
    assert problem["errors"][0]["field"].startswith(f"links[{position}].")


@pytest.mark.parametrize(
    "body",
    [{}, {"links": [{"id": 0}], "chain": [CHAIN_LINK]}, {"chain": [CHAIN_LINK], "graph": "grid"}, {"chain": []}],
    ids=["neither", "both", "graph with a chain", "empty"],
)
def test_simulate_without_exactly_one_form_is_refused(client: TestClient, body: dict[str, Any]) -> None:
    check_problem(client.post("/simulate", json=body), 422, "invalid_request")


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (NegativeCycleError(3), 422, "energy_gain"),
        (NoPathError("no road leads to the goal"), 404, "no_path"),
        (LinkError("length_m", 2, 0.0, "above 0"), 422, "invalid_link"),
        (ComparisonError("series", "absent", "a measured one"), 422, "diagnosis_failed"),
        (GraphFormatError("grid", "version", 1, "2"), 409, "graph_damaged"),
        (GraphFormatError("grid", "version", 1, "2; import the map again"), 409, "graph_damaged"),
        (ZeroDivisionError("division by zero"), 500, "internal"),
    ],
)
def test_error_of_the_packages_has_its_status_and_code(error: Exception, status: int, code: str) -> None:
    response = problem_response(error, "/route")
    problem = json.loads(bytes(response.body))
    assert (response.status_code, problem["code"]) == (status, code)
    assert "division" not in problem["detail"]


def test_refusal_that_no_request_can_cause_is_a_fault_that_the_server_logs() -> None:
    damaged = Refusal("version", 1, "2")  # without a code
    app = FastAPI()
    install_error_handlers(app, lambda _: set())

    @app.get("/")
    def fail() -> None:
        raise damaged

    with pytest.raises(Refusal):  # passed on to the server after the answer
        TestClient(app).get("/")
    check_problem(TestClient(app, raise_server_exceptions=False).get("/"), 500, "internal")


def refusals(of: type[Refusal] = Refusal) -> list[type[Refusal]]:
    """All classes of refusals that are loaded with the application."""
    return [of, *(found for below in of.__subclasses__() for found in refusals(below))]


def test_every_error_code_is_reachable_from_the_table_and_refusals() -> None:
    own = {ErrorCode(refused.code) for refused in refusals() if refused.code}
    reached = {code for code, _ in KINDS_OF_ERROR.values()} | own | set(HTTP_CODES.values()) | {ErrorCode.INTERNAL}
    assert reached == set(ErrorCode) == set(KINDS)


@pytest.mark.parametrize("refused", [kind for kind in refusals() if kind.code], ids=lambda kind: kind.__name__)
def test_refusal_with_a_code_is_answered_by_it_and_no_class_before(refused: type[Refusal]) -> None:
    order = refused.__mro__
    assert not [kind for kind in order[: order.index(Refusal)] if kind in KINDS_OF_ERROR]
