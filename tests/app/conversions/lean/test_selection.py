"""Answers with the parts that are asked for, in few digits."""

from __future__ import annotations

from app.conversions.lean.digits import compacted
from app.conversions.lean.selection import asks_for, lean_answer, part_of, picked, selection_of
from app.schemas.place import LatLon

ANSWER = {
    "routes": [
        {"name": "eco", "distance_m": 1234.56789, "energy_parts_kwh": {"rolling": 1.23456789, "wind": 0.0}, "soc": 0.0},
        {"name": "fastest", "distance_m": 2.0, "energy_parts_kwh": {"rolling": 0.0, "wind": -1e-9}, "soc": 1},
    ],
    "snapped": {"start": LatLon(lat=44.12345678, lon=-36.1)},
    "request": {"soc": 0.123456789},
    "warnings": [],
}


def test_names_stand_for_all_below_them_whatever_their_order() -> None:
    assert selection_of(["routes.name", "routes", "warnings"]) == {"routes": None, "warnings": None}
    assert selection_of(["routes", "routes.legs.from_m"]) == {"routes": None}
    assert selection_of(None) is None


def test_parts_of_lists_and_models_are_picked() -> None:
    chosen = selection_of(["routes.name", "routes.energy_parts_kwh.wind", "snapped.start.lat"])
    assert picked(ANSWER, chosen) == {
        "routes": [
            {"name": "eco", "energy_parts_kwh": {"wind": 0.0}},
            {"name": "fastest", "energy_parts_kwh": {"wind": -1e-9}},
        ],
        "snapped": {"start": {"lat": 44.12345678}},
    }
    assert asks_for(chosen, "routes")
    assert not asks_for(chosen, "routes", "links")
    assert part_of(chosen, "routes", "name") is None


def test_compact_answers_round_figures_and_leave_out_energies_of_zero_only() -> None:
    found = compacted(ANSWER)
    first, second = found["routes"]
    assert first == {"name": "eco", "distance_m": 1234.57, "energy_parts_kwh": {"rolling": 1.23457}, "soc": 0.0}
    assert second["energy_parts_kwh"] == {"wind": -1e-9}
    assert found["snapped"]["start"] == {"lat": 44.12345678, "lon": -36.1}
    assert found["request"] == {"soc": 0.123456789}
    assert lean_answer(ANSWER, ["warnings"], True) == {"warnings": []}
    assert lean_answer(ANSWER, None, None) == ANSWER
