"""What needs which role: every endpoint by name, so that a new one is thought about."""

from __future__ import annotations

from typing import Final

import pytest

from app.access.roles import HEALTH, Role, need_of
from app.main import described_routes

READ: Final = {
    "POST /route",
    "POST /matrix",
    "GET /range",
    "POST /range",
    "POST /simulate",
    "GET /vehicles",
    "GET /vehicles/{id}",
    "GET /diagnoses",
    "GET /diagnoses/{id}",
    "GET /diagnoses/{id}/report",
    "GET /diagnoses/{id}/effects",
    "GET /diagnoses/{id}/residuals",
    "GET /diagnoses/{id}/trips",
    "GET /diagnoses/{id}/trips/{trip}",
    "GET /graphs",
    "GET /graphs/{name}",
    "GET /graphs/{name}/stations",
    "GET /graphs/{name}/tiles.json",
    "GET /graphs/{name}/tiles/{z}/{x}/{y}.mvt",
    "GET /graphs/{name}/heights/{z}/{x}/{y}.png",
}
WRITE: Final = {"PUT /vehicles/{id}", "DELETE /vehicles/{id}", "POST /diagnoses", "DELETE /diagnoses/{id}"}


def test_every_endpoint_of_reading_and_writing_has_its_role_and_any_other_change_is_for_admins() -> None:
    found = {
        f"{method} {route.path}": need_of(method, route.path).role
        for route in described_routes()
        for method in route.methods
        if route.path not in HEALTH
    }
    assert {name for name, role in found.items() if role is None} == set()
    assert {name for name in READ | WRITE if name not in found} == set()
    for name, role in found.items():
        reads = name.startswith("GET ") or name in READ
        expected = Role.WRITE if name in WRITE else Role.READ if reads else Role.ADMIN
        assert role is expected, name


@pytest.mark.parametrize(
    ("method", "path"),
    [("POST", "/reload"), ("PATCH", "/vehicles/x"), ("POST", "/"), ("DELETE", "/web/x"), ("PUT", "/diagnoses")],
)
def test_change_that_is_not_known_is_for_admins(method: str, path: str) -> None:
    assert need_of(method, path).role is Role.ADMIN


@pytest.mark.parametrize("path", ["/web/../vehicles", "/Docs", "//docs", "/docsx", "/webs", "/metrics"])
def test_path_that_only_looks_public_needs_a_key(path: str) -> None:
    role = need_of("GET", path).role
    assert role is (None if path.startswith("/web/") else Role.READ)


def test_roles_hold_each_other() -> None:
    assert [[has.allows(needed) for needed in Role] for has in Role] == [
        [True, False, False],
        [True, True, False],
        [True, True, True],
    ]


@pytest.mark.parametrize(
    "path", ["/osrm/route/v1/driving/8,46;9,46", "/ors/v2/directions/driving-car/json", "/valhalla/route"]
)
def test_faces_cost_as_much_as_what_they_ask_and_are_for_readers(path: str) -> None:
    for method in ("GET", "POST"):
        assert need_of(method, path) == need_of("POST", "/route")
    assert need_of("POST", "/ors/v2/matrix/ev@0.5") == need_of("POST", "/matrix")
    assert need_of("DELETE", path).role is Role.ADMIN
