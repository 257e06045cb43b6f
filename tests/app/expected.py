"""What several tests send, and what they expect of every problem."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from app.http.examples.answers import VEHICLE_BODIES

if TYPE_CHECKING:
    from pathlib import Path

    from httpx import Response

VEHICLE: dict[str, Any] = {
    "mass_kg": 1500,
    "road_load": {"a_n": 120, "b_n_per_kmh": 0.5, "c_n_per_kmh2": 0.03},
    "drive_eff": 0.9,
    "recuperation_eff": 0.6,
    "aux_power_w": 400,
    "usable_capacity_kwh": 40,
}
TABLE: dict[str, Any] = VEHICLE_BODIES["consumption table"]["value"]
TOMTOM: dict[str, Any] = VEHICLE_BODIES["tomtom"]["value"]
HERE: dict[str, Any] = VEHICLE_BODIES["here"]["value"]
MAPBOX: dict[str, Any] = VEHICLE_BODIES["mapbox"]["value"]
CHAIN_LINK: dict[str, Any] = {"length_m": 100, "speed_limit_kmh": 50}


def database_in(folder: Path) -> str:
    """URL of a database in a folder."""
    return f"sqlite:///{folder / 'vehicles.sqlite'}"


def check_problem(response: Response, status: int, code: str) -> dict[str, Any]:
    """The problem of a response, checked for what all problems share."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    problem: dict[str, Any] = json.loads(response.text, parse_constant=refuse_constant)
    assert set(problem) == {"type", "title", "status", "detail", "instance", "code", "errors"}
    assert problem["code"] == code
    assert problem["status"] == status
    assert problem["type"] == f"urn:joulepath:problem:{code}"
    assert problem["instance"] == response.request.url.path
    return problem


def refuse_constant(name: str) -> None:
    raise AssertionError(f"{name} is not JSON")
