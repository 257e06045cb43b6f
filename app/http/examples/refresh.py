"""Ask the bundled graph for the answers that the OpenAPI document shows: `python -m app.http.examples.refresh`.

With `--diagnoses`, only for those of diagnoses, which take half a minute.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from app.http.examples.answers import MATRIX_REQUESTS, RANGE_REQUESTS, ROUTE_REQUESTS, SIMULATE_REQUESTS, VEHICLE_BODIES
from app.http.examples.diagnoses import diagnosis_answers
from app.places.parameters import ReverseParameters, SearchParameters
from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest
from app.schemas.route import RouteRequest
from app.schemas.simulation import SimulateRequest
from app.schemas.vehicles.vehicle import InlineTableVehicle
from app.service.service import Service
from app.settings import Settings
from app.stations.parameters import StationParameters

SHOWN = {"links": 2, "vehicles": 3, "steps": 3, "alternatives": 2}
SHOWN_POINTS = 4
SHOWN_STATIONS = 2
SHOWN_PLACES = 2
SHOWN_OF_DIAGNOSES = 2


def refresh(*, diagnoses_only: bool = False) -> None:
    """Write one file an answer, with lists of links and points shortened."""
    with tempfile.TemporaryDirectory() as folder:
        recordings = Path(folder) / "recordings"
        recordings.mkdir()
        database = f"sqlite:///{folder}/vehicles.sqlite"
        service = Service(Settings(database_url=database, recordings_dir=recordings))
        answers = {name: _first(answer) for name, answer in diagnosis_answers(service).items()}
        if not diagnoses_only:
            answers |= _answers(service)
    for name, answer in answers.items():
        text = json.dumps(_shortened(answer), indent=1, ensure_ascii=False)
        (Path(__file__).parent / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def _answers(service: Service) -> dict[str, Any]:
    eco = RouteRequest.model_validate(ROUTE_REQUESTS["eco"]["value"])
    journey = RouteRequest.model_validate(ROUTE_REQUESTS["charging"]["value"])
    impossible = RouteRequest.model_validate(ROUTE_REQUESTS["no plan"]["value"])
    steps = RouteRequest.model_validate(ROUTE_REQUESTS["steps"]["value"])
    square = MatrixRequest.model_validate(MATRIX_REQUESTS["all to all"]["value"])
    bands = RangeRequest.model_validate(RANGE_REQUESTS["charges left"]["value"])
    chain = SimulateRequest.model_validate(SIMULATE_REQUESTS["chain"]["value"])
    table = InlineTableVehicle.model_validate(VEHICLE_BODIES["consumption table"]["value"])
    answers = {
        "route": service.route(eco),
        "route_charging": service.route(journey),
        "route_no_plan": service.route(impossible),
        "route_steps": service.route(steps),
        "matrix": service.matrix(square),
        "range": service.range(bands),
        "simulate": service.simulate(chain),
        "vehicles": service.list_vehicles(),
        "vehicle": service.show_vehicle("hyundai-kona-64"),
        "vehicle_stored": service.put_vehicle("my-van", table)[0],
        "graphs": service.list_graphs(),
        "graph": service.show_graph(service.settings.default_graph),
        "stations": service.stations(service.settings.default_graph).collection(
            StationParameters(limit=SHOWN_STATIONS)
        ),
    }
    shown = {name: answer.model_dump(mode="json") for name, answer in answers.items()}
    at = {"lat": 44.4401, "lon": -36.781}
    asked = {"q": "mill street", "limit": SHOWN_PLACES, **at}
    nominatim = json.loads(service.places.search_json(SearchParameters.model_validate(asked | {"format": "jsonv2"})))
    shown |= {
        "search": json.loads(service.places.search_json(SearchParameters.model_validate(asked))),
        "search_nominatim": nominatim[0],
        "reverse": json.loads(service.places.reverse_json(ReverseParameters.model_validate(at))),
        "reverse_nominatim": json.loads(
            service.places.reverse_json(ReverseParameters.model_validate(at | {"format": "jsonv2"}))
        ),
    }
    return shown | {"route_geojson": json.loads(service.route_geojson(eco))}


def _first(value: Any) -> Any:
    """A diagnosis with the first few of what it lists; numbers that stand together are kept as they are."""
    if isinstance(value, dict):
        return {key: _first(item) for key, item in value.items()}
    if isinstance(value, list) and value and isinstance(value[0], (dict, str)):
        return [_first(item) for item in value[:SHOWN_OF_DIAGNOSES]]
    is_series = isinstance(value, list) and bool(value) and not isinstance(value[0], list)
    return value[:SHOWN_POINTS] if is_series else value


def _shortened(value: Any) -> Any:
    if isinstance(value, dict):
        return {
            key: item[: SHOWN[key]] if key in SHOWN and isinstance(item, list) else _shortened(item)
            for key, item in value.items()
        }
    if isinstance(value, list):
        if value and _is_position(value[0]) and len(value) > SHOWN_POINTS:
            kept = SHOWN_POINTS - 1
            step = len(value) // kept
            return [*value[: kept * step : step], value[-1]]
        if _is_polygon(value):
            return [_shortened(value[0])]  # the first shell, without holes
        return [_shortened(item) for item in value]
    return value


def _is_polygon(value: list[Any]) -> bool:
    """Whether a list holds rings, or polygons."""
    ring = value[0] if value else None
    return isinstance(ring, list) and bool(ring) and isinstance(ring[0], list)


def _is_position(value: object) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(isinstance(part, float) for part in value)


if __name__ == "__main__":
    refresh(diagnoses_only="--diagnoses" in sys.argv[1:])
