"""Pages of other origins."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import pytest

from tests.app.expected import check_problem

if TYPE_CHECKING:
    from starlette.testclient import TestClient

ALLOWED, OTHER = "https://map.example", "https://other.example"


def preflight(origin: str, **headers: str) -> dict[str, str]:
    asked = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "content-type,authorization"}
    return {"Origin": origin, **asked, **headers}


def test_preflight_of_a_named_origin_is_answered(client: TestClient) -> None:
    response = client.options("/route", headers=preflight(ALLOWED))
    assert response.status_code == 200
    assert response.headers["access-control-allow-origin"] == ALLOWED
    assert "POST" in response.headers["access-control-allow-methods"]
    assert response.headers["access-control-allow-headers"] == "content-type,authorization"


def test_refused_preflight_says_what_to_set_and_is_logged_once(
    client: TestClient, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, "app.http.cors"):
        for _ in range(2):
            response = client.options("/route", headers=preflight(OTHER))
    problem = check_problem(response, 403, "wrong_origin")
    (error,) = problem["errors"]
    assert (error["field"], error["value"]) == ("Origin", OTHER)
    assert "JOULEPATH_CORS_ORIGINS" in error["allowed"]
    assert "access-control-allow-origin" not in response.headers
    assert "Origin" in response.headers["vary"]
    assert [OTHER in record.getMessage() for record in caplog.records if record.name == "app.http.cors"] == [True]


@pytest.mark.parametrize(
    ("header", "value", "field"),
    [
        ("Access-Control-Request-Method", "PATCH", "Access-Control-Request-Method"),
        ("Access-Control-Request-Private-Network", "true", "Access-Control-Request-Private-Network"),
    ],
)
def test_refused_preflight_names_what_else_is_wrong(client: TestClient, header: str, value: str, field: str) -> None:
    response = client.options("/route", headers=preflight(ALLOWED, **{header: value}))
    (error,) = check_problem(response, 403, "wrong_origin")["errors"]
    assert error["field"] == field


def test_page_of_a_named_origin_may_read_the_headers_that_it_needs(client: TestClient) -> None:
    readable = client.get("/healthz", headers={"Origin": ALLOWED}).headers["access-control-expose-headers"]
    assert {"Server-Timing", "X-Request-Id", "Content-Disposition"} <= set(readable.split(", "))
