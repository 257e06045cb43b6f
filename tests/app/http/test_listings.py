"""GET /vehicles, /graphs, /healthz and /readyz."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from starlette.testclient import TestClient


def test_vehicles_are_listed_in_the_order_of_their_ids(client: TestClient) -> None:
    answer = client.get("/vehicles").json()
    ids = [vehicle["id"] for vehicle in answer["vehicles"]]
    assert ids == sorted(ids)
    assert [v["id"] for v in answer["vehicles"] if v["default"]] == [answer["default"]] == ["hyundai-kona-64"]


def test_vehicle_is_shown_in_human_units_with_a_source_for_each_number(client: TestClient) -> None:
    kona = client.get("/vehicles/hyundai-kona-64").json()
    assert kona["usable_capacity_kwh"] == 64
    # target coefficient A, 24.859 lbf, times 4.4482216 N/lbf
    assert kona["road_load"]["a_n"] == pytest.approx(110.578, abs=1e-3)
    assert kona["acceleration"]["speed_kmh"] == [10 * k for k in range(14)]
    leaves: set[str] = set()
    for field, value in kona.items():
        if field not in ("id", "kind", "name", "powertrain", "effects", "sources", "sd"):
            leaves |= {f"{field}.{part}" for part in value} if isinstance(value, dict) else {field}
    assert leaves <= set(kona["sources"])
    assert all(kona["sources"].values())


def test_graphs_are_listed_with_source_and_licence(client: TestClient) -> None:
    answer = client.get("/graphs").json()
    assert answer["default"] == "grid"
    assert [(g["name"], g["terrain"], g["default"]) for g in answer["graphs"]] == [
        ("grid", "synthetic", True),
        ("level", "absent", False),
    ]
    assert answer["graphs"][0]["licence"] == "CC0-1.0"


def test_graph_is_shown_with_its_extent(client: TestClient) -> None:
    grid = client.get("/graphs/grid").json()
    assert (grid["node_count"], grid["link_count"]) == (9, 24)
    assert (grid["height_min_m"], grid["height_max_m"]) == (500, 560)
    assert grid["bbox"] == [8.0, 46.5, 8.02, 46.52]
    lengths = {kind["functional_class"]: kind["length_km"] for kind in grid["road_classes"]}
    assert lengths["tertiary"] == pytest.approx(grid["length_km"])


def test_readyz_of_a_started_service_names_its_graphs(client: TestClient) -> None:
    answer = client.get("/readyz").json()
    assert answer["status"] == "ready"
    assert answer["graphs"] == [
        {"name": "grid", "loaded": True, "version": None},
        {"name": "level", "loaded": True, "version": None},
    ]
    assert answer["database"] == {"reachable": True, "reason": None}
