"""Who is let in: keys and their roles, rates, names of the service, pages of others; and headers for browsers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import pytest
from starlette.testclient import TestClient

from app.access.keys import add_key, remove_key
from app.access.roles import HEALTH, Role
from app.errors.problems import KINDS
from app.http.gate import host_name, listening_settings
from app.main import create_app
from app.schemas.problem import ErrorCode

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from app.service.service import Service
    from app.settings import Settings

ROUTE: Final = {"start": [8.001, 46.5], "goal": [8.019, 46.52], "soc": 0.8}
ELSEWHERE: Final = "203.0.113.5"


def refused(response: Any, code: ErrorCode) -> dict[str, Any]:
    """A problem of this code, and its status."""
    problem: dict[str, Any] = response.json()
    assert problem["code"] == code.value, problem
    assert response.status_code == problem["status"] == KINDS[code].status
    assert response.headers["content-type"] == "application/problem+json"
    return problem


def client_with(service: Service, settings: Settings, host: str = "testclient", **changes: Any) -> TestClient:
    """A client, seen at an address, of the service under other settings."""
    return TestClient(create_app(settings.model_copy(update=changes), service), client=(host, 50_000))


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[Role, str]]:
    """A file with a key of each role, and the keys."""
    path = tmp_path_factory.mktemp("keys") / "keys.json"
    return path, {role: add_key(path, f"{role.value}-key", role) for role in Role}


@pytest.fixture(scope="module")
def guarded(service: Service, settings: Settings, keys: tuple[Path, dict[Role, str]]) -> Iterator[TestClient]:
    """A client of the service that demands keys."""
    with client_with(service, settings, keys_file=keys[0]) as client:
        yield client


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


def test_without_a_key_everything_but_health_page_and_description_is_refused(guarded: TestClient) -> None:
    for path in ("/healthz", "/readyz", "/", "/web/js/main.js", "/web/settings.json", "/docs", "/openapi.json"):
        assert guarded.get(path).status_code == 200, path
    for path in ("/vehicles", "/graphs", "/diagnoses", "/nothing-here", "/range?lat=46.5&lon=8&soc=0.5"):
        response = guarded.get(path)
        refused(response, ErrorCode.UNAUTHORIZED)
        assert response.headers["www-authenticate"] == 'Bearer realm="joulepath"'
    refused(guarded.post("/route", json=ROUTE), ErrorCode.UNAUTHORIZED)
    refused(guarded.post("/reload"), ErrorCode.UNAUTHORIZED)


def test_faces_of_other_engines_need_a_key_which_may_come_without_a_scheme(
    guarded: TestClient, keys: tuple[Path, dict[Role, str]]
) -> None:
    key = keys[1][Role.READ]
    sent = {"coordinates": [[8.001, 46.5], [8.011, 46.51]]}
    address = "/ors/v2/directions/driving-car"
    refused(guarded.post(address, json=sent), ErrorCode.UNAUTHORIZED)
    refused(guarded.get("/osrm/nearest/v1/driving/8.001,46.5"), ErrorCode.UNAUTHORIZED)
    refused(guarded.post(address, json=sent, headers={"Authorization": "no-such-key"}), ErrorCode.UNAUTHORIZED)
    assert guarded.post(address, json=sent, headers={"Authorization": key}).status_code == 200


def test_every_endpoint_says_in_its_description_what_it_answers_without_a_key(guarded: TestClient) -> None:
    paths = guarded.get("/openapi.json").json()["paths"]
    for path, operations in paths.items():
        for method, operation in operations.items():
            if path not in HEALTH:
                refused(guarded.request(method.upper(), path), ErrorCode.UNAUTHORIZED)
                examples = operation["responses"]["401"]["content"]["application/problem+json"]["examples"]
                assert examples["unauthorized"]["value"]["status"] == 401
                assert {"421", "429"} <= set(operation["responses"])
                assert ("403" in operation["responses"]) == (method != "get")


def test_key_is_taken_in_either_header_and_an_unknown_one_is_not(
    guarded: TestClient, keys: tuple[Path, dict[Role, str]]
) -> None:
    key = keys[1][Role.READ]
    for headers in (bearer(key), {"Authorization": f"bearer  {key}"}, {"X-API-Key": key}):
        assert guarded.get("/vehicles", headers=headers).status_code == 200
    for wrong in (
        bearer(key[:-1]),
        bearer(""),
        {"X-API-Key": "no-key"},
        {"Authorization": "Basic eA=="},
    ):
        response = guarded.get("/vehicles", headers=wrong)
        refused(response, ErrorCode.UNAUTHORIZED)
        assert key not in response.text
    assert 'error="invalid_token"' in guarded.get("/vehicles", headers=bearer("x")).headers["www-authenticate"]
    assert guarded.get(f"/vehicles?key={key}").status_code == 401  # addresses are logged and shared


@pytest.mark.parametrize(
    ("role", "statuses"),
    [(Role.READ, (200, 403, 403)), (Role.WRITE, (200, 404, 403)), (Role.ADMIN, (200, 404, 404))],
)
def test_role_allows_what_it_says(
    guarded: TestClient, keys: tuple[Path, dict[Role, str]], role: Role, statuses: tuple[int, int, int]
) -> None:
    headers = bearer(keys[1][role])
    got = (
        guarded.post("/route", json=ROUTE, headers=headers),
        guarded.delete("/vehicles/nothing", headers=headers),
        guarded.post("/administrative", headers=headers),  # there is none yet: 404 once it is let in
    )
    assert tuple(response.status_code for response in got) == statuses
    for response in got:
        if response.status_code == 403:
            refused(response, ErrorCode.FORBIDDEN)


def test_body_of_a_request_without_a_key_is_not_read(guarded: TestClient, settings: Settings) -> None:
    large = b" " * (settings.body_limit_bytes + 1)  # which would be refused for its size otherwise
    refused(guarded.post("/route", content=large), ErrorCode.UNAUTHORIZED)


def test_removed_key_is_refused_while_the_service_runs(service: Service, settings: Settings, tmp_path: Path) -> None:
    path = tmp_path / "keys.json"
    anna, bert = add_key(path, "anna", Role.READ), add_key(path, "bert", Role.READ)
    remove_key(path, "anna")
    with client_with(service, settings, keys_file=path) as client:
        refused(client.get("/vehicles", headers=bearer(anna)), ErrorCode.UNAUTHORIZED)
        assert client.get("/vehicles", headers=bearer(bert)).status_code == 200


def test_description_names_the_keys_only_where_they_are_demanded(guarded: TestClient, client: TestClient) -> None:
    document = guarded.get("/openapi.json").json()
    assert {"bearer": []} in document["security"]
    assert document["paths"]["/readyz"]["get"]["security"] == []
    assert "security" not in client.get("/openapi.json").json()


def test_client_that_asks_too_often_is_refused_and_told_when_to_try_again(service: Service, settings: Settings) -> None:
    with client_with(service, settings, ELSEWHERE, rate_limit_per_s=0.5, rate_burst=10) as client:
        assert [client.get("/vehicles").status_code for _ in range(10)] == [200] * 10
        response = client.get("/vehicles")
        refused(response, ErrorCode.RATE_LIMITED)
        assert int(response.headers["retry-after"]) in (1, 2)
        assert client.get("/healthz").status_code == 200
    with client_with(service, settings, ELSEWHERE, rate_limit_per_s=0.5, rate_burst=10) as client:
        assert [client.post("/route", json=ROUTE).status_code for _ in range(3)] == [200, 200, 429]


def test_this_machine_has_no_rate(service: Service, settings: Settings) -> None:
    with client_with(service, settings, "127.0.0.1", rate_limit_per_s=0.5, rate_burst=1) as client:
        assert {client.get("/vehicles").status_code for _ in range(20)} == {200}


def test_key_has_a_rate_of_its_own_wherever_it_comes_from(service: Service, settings: Settings, tmp_path: Path) -> None:
    path = tmp_path / "keys.json"
    few, many = add_key(path, "few", Role.READ, daily_quota=2), add_key(path, "many", Role.READ)
    with client_with(service, settings, "127.0.0.1", keys_file=path) as client:
        assert [client.get("/vehicles", headers=bearer(few)).status_code for _ in range(3)] == [200, 200, 429]
        assert client.get("/vehicles", headers=bearer(many)).status_code == 200


def test_guesses_of_keys_count_against_their_address(service: Service, settings: Settings, tmp_path: Path) -> None:
    path = tmp_path / "keys.json"
    key = add_key(path, "anna", Role.READ)
    with client_with(service, settings, ELSEWHERE, keys_file=path, rate_limit_per_s=0.5, rate_burst=5) as client:
        guesses = [client.get("/vehicles", headers=bearer(f"jp_00_{n}")).status_code for n in range(8)]
        assert guesses == [401] * 5 + [429] * 3
        assert client.get("/vehicles", headers=bearer(key)).status_code == 200


@pytest.mark.fault("any-host", now="421 `unknown_host` where names are set, and on this machine")
@pytest.mark.parametrize(
    ("host", "let_in"),
    [
        ("energy.example", True),
        ("ENERGY.example:8443", True),
        ("energy.example.", True),
        ("a.fleet.example", True),
        ("[::1]:8000", True),
        ("fleet.example", False),
        ("notfleet.example", False),
        ("energy.example.evil.example", False),
        ("evil.example", False),
        ("", False),
    ],
)
def test_service_answers_by_its_own_names_only(service: Service, settings: Settings, host: str, let_in: bool) -> None:
    names = ("energy.example", "*.fleet.example", "[::1]")
    with client_with(service, settings, allowed_hosts=names) as client:
        response = client.get("/vehicles", headers={"Host": host})
        if let_in:
            assert response.status_code == 200
        else:
            refused(response, ErrorCode.UNKNOWN_HOST)
        assert client.get("/healthz", headers={"Host": host}).status_code == 200


@pytest.mark.fault("foreign-page", now="403 `wrong_origin`")
@pytest.mark.parametrize(
    ("headers", "let_in"),
    [
        ({}, True),  # no browser
        ({"Origin": "http://testserver"}, True),
        ({"Origin": "https://testserver"}, True),  # a proxy ends TLS
        ({"Sec-Fetch-Site": "same-origin", "Origin": "http://other-name-by-proxy.example"}, True),
        ({"Sec-Fetch-Site": "none"}, True),
        ({"Origin": "https://map.example"}, True),  # in the settings of these tests
        ({"Origin": "https://map.example", "Sec-Fetch-Site": "cross-site"}, True),
        ({"Origin": "https://evil.example"}, False),
        ({"Origin": "https://evil.example", "Sec-Fetch-Site": "cross-site"}, False),
        ({"Origin": "https://sub.testserver", "Sec-Fetch-Site": "same-site"}, False),
        ({"Origin": "http://testserver:8080"}, False),
        ({"Origin": "null"}, False),
        ({"Sec-Fetch-Site": "cross-site"}, False),
    ],
)
def test_foreign_page_can_send_nothing(client: TestClient, headers: dict[str, str], let_in: bool) -> None:
    form = {"files": {"recordings": ("a.csv", b"time_s,speed_kmh\n", "text/csv")}}
    for response in (
        client.delete("/vehicles/nothing", headers=headers),
        client.post("/diagnoses", headers=headers, files=form["files"]),
        client.post("/route", headers=headers, json=ROUTE),
    ):
        if let_in:
            assert response.status_code not in (401, 403, 421)
        else:
            refused(response, ErrorCode.WRONG_ORIGIN)
    assert client.get("/vehicles", headers=headers).status_code == 200


@pytest.mark.parametrize("content_type", ["text/plain", "application/x-www-form-urlencoded", None])
def test_what_a_form_or_a_simple_request_of_a_foreign_page_could_send_is_read_as_no_json(
    client: TestClient, content_type: str | None
) -> None:
    headers = {} if content_type is None else {"Content-Type": content_type}
    for path, body in (("/route", b'{"start": [8, 46.5]}'), ("/diagnoses", b'{"recordings": ["*"]}')):
        response = client.post(path, content=body, headers=headers)
        assert response.status_code in (415, 422)
        assert "Content-Type" in response.text


def test_every_answer_has_the_headers_that_browsers_obey(client: TestClient, guarded: TestClient) -> None:
    for response in (
        client.get("/vehicles"),
        client.get("/"),
        client.get("/docs"),
        client.get("/web/js/main.js"),
        client.get("/nothing-here"),
        client.post("/route", json={}),
        guarded.get("/vehicles"),
    ):
        headers = response.headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "same-origin"
        assert headers["cross-origin-opener-policy"] == "same-origin"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert "frame-ancestors" in headers["content-security-policy"]
        assert "server" not in headers


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.7", ""])
def test_server_that_others_can_reach_demands_keys_unless_told_otherwise(
    settings: Settings, tmp_path: Path, host: str
) -> None:
    path = tmp_path / "keys.json"
    for refused_settings in (settings, settings.model_copy(update={"keys_file": path})):
        with pytest.raises(Exception, match="keys add NAME"):
            listening_settings(refused_settings, host)
    add_key(path, "anna", Role.READ)
    assert listening_settings(settings.model_copy(update={"keys_file": path}), host).keys_file == path
    opened = listening_settings(settings.model_copy(update={"open_without_keys": True}), host)
    assert opened.keys_file is None
    assert opened.allowed_hosts == ()


def test_server_on_this_machines_own_address_is_open_and_called_by_its_names(settings: Settings) -> None:
    local = listening_settings(settings, "127.0.0.1")
    assert local.keys_file is None
    assert local.allowed_hosts == ("localhost", "127.0.0.1", "[::1]")
    named = settings.model_copy(update={"allowed_hosts": ("energy.example",)})
    assert listening_settings(named, "127.0.0.1").allowed_hosts == ("energy.example",)


@pytest.mark.parametrize(
    ("header", "name"),
    [("A.example:80", "a.example"), ("[::1]", "[::1]"), ("[::1]:80", "[::1]"), ("a", "a")],
)
def test_name_of_a_host_is_without_its_port(header: str, name: str) -> None:
    assert host_name(header) == name
