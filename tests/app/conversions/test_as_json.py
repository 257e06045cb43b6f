"""Answers written by orjson against what pydantic writes of them."""

from __future__ import annotations

import json

import pytest
from pydantic import BaseModel

from app.schemas.as_json import as_json
from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from app.schemas.simulation import SimulateRequest
from app.service.service import Service
from tests.app.expected import CHAIN_LINK

CORNER, MIDDLE = {"lat": 46.5, "lon": 8.0}, {"lat": 46.51, "lon": 8.01}


def answers(service: Service) -> dict[str, BaseModel]:
    """One answer of each kind."""
    trip = {"start": CORNER, "goal": MIDDLE, "soc": 0.5}
    area = {"origin": CORNER, "soc": 0.001, "bands": 3}
    return {
        "route": service.route(RouteRequest.model_validate({**trip, "uncertainty": True})),
        "range": service.range(RangeRequest.model_validate(area)),
        "range by time": service.range(RangeRequest.model_validate({**area, "bands": 1, "by": "time", "limits": [2]})),
        "matrix": service.matrix(MatrixRequest.model_validate({"sources": [CORNER, MIDDLE], "soc": 0.4})),
        "simulation": service.simulate(SimulateRequest.model_validate({"chain": [CHAIN_LINK] * 3})),
    }


def test_answers_are_those_of_pydantic_to_the_byte(service: Service) -> None:
    for kind, answer in answers(service).items():
        assert as_json(answer) == answer.model_dump_json().encode(), kind


def test_areas_written_from_arrays_are_the_same(service: Service) -> None:
    sent = RangeRequest.model_validate({"origin": CORNER, "soc": 0.001, "bands": 3, "compact": False})
    document, model = json.loads(service.range_json(sent)), json.loads(service.range(sent).model_dump_json())
    assert document["features"] == model["features"]
    assert document["request"] == model["request"]


def test_routes_written_without_their_models_are_the_same(service: Service) -> None:
    trip = {"start": CORNER, "goal": MIDDLE, "via": [MIDDLE], "soc": 0.5}
    weights = {"energy": 1.0, "time": 2.0}
    for changes in ({"uncertainty": True}, {"soc": 0.0}, {"links": False, "weights": weights}, {"goal": CORNER}):
        sent = RouteRequest.model_validate({**trip, **changes})
        document, model = json.loads(service.route_json(sent)), json.loads(service.route(sent).model_dump_json())
        for stats in (*document["stats"], *model["stats"]):
            del stats["seconds"]
        assert json.dumps(document) == json.dumps(model), changes


def test_simulations_written_without_their_models_are_the_same(service: Service) -> None:
    chain = {"chain": [CHAIN_LINK, {**CHAIN_LINK, "grade": -0.02}]}
    driven = {"links": [{"id": 0}]}
    for body in (chain, {**chain, "soc": 0.001}, {**driven, "soc": 0.5}, {**driven, "model": "timestep"}):
        sent = SimulateRequest.model_validate({**body, "profile": True})
        assert service.simulate_json(sent) == service.simulate(sent).model_dump_json().encode(), body


def test_what_is_no_number_becomes_null() -> None:
    assert as_json({"a": float("nan"), "b": float("inf"), "c": (1, 2.0)}) == b'{"a":null,"b":null,"c":[1,2.0]}'


def test_what_no_answer_holds_is_an_error() -> None:
    with pytest.raises(TypeError):
        as_json({"a": object()})
