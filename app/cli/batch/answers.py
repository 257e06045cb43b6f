"""Rows of requests answered, each by itself: an answer or a problem."""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import shapely
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError

from app.cli.batch.opening import opened
from app.conversions.lean.selection import lean_answer
from app.errors.problems import make_problem
from app.errors.table import problem_of
from app.schemas.lean.form import GeometryFormat
from app.schemas.place import LineString
from app.schemas.problem import ErrorCode, FieldProblem
from app.schemas.route import RouteRequest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.cli.batch.opening import ServiceOrder
    from app.cli.batch.requests import RequestRow
    from app.schemas.charging import ChargingPlanAnswer
    from app.schemas.problem import Problem
    from app.schemas.route import RouteResponse
    from app.service.service import Service

LOG = logging.getLogger(__name__)
PATH = "/route"


@dataclass(frozen=True, slots=True)
class RowAnswer:
    """What is to be written for one row, and what is to be counted of it.

    lines: JSON, or flat records with the columns of app.cli.batch.results.COLUMNS. code: of its problem, None without.
    routes, infeasible: how many there are.
    """

    lines: tuple[str, ...] | tuple[dict[str, Any], ...]
    code: ErrorCode | None
    routes: int = 0
    infeasible: int = 0


def answered_rows(
    order: ServiceOrder, rows: Sequence[RequestRow], defaults: Mapping[str, Any], flat: bool
) -> list[RowAnswer]:
    """What POST /route answers to each row, as JSON lines or flat records; runs wherever Dask runs it.

    defaults: fields for rows that do not send them.
    """
    service = opened(order)
    return [_answered(service, row, defaults, flat=flat) for row in rows]


def _answered(service: Service, row: RequestRow, defaults: Mapping[str, Any], *, flat: bool) -> RowAnswer:
    if row.body is None:
        field = FieldProblem(field="", value=None, allowed="a row that can be read")
        return _refused(row, make_problem(ErrorCode.MALFORMED_JSON, row.fault, [field], PATH), flat=flat)
    try:
        sent = RouteRequest.model_validate({**defaults, **row.body})
        if flat:  # whose geometry is binary
            sent = sent.model_copy(update={"geometry_format": GeometryFormat.GEOJSON})
        response = service.route(sent)
    except ValidationError as error:
        return _refused(row, problem_of(RequestValidationError(error.errors()), PATH), flat=flat)
    except Exception as error:  # as over HTTP, whatever fails is the answer of its own row only
        problem = problem_of(error, PATH)
        if problem.code is ErrorCode.INTERNAL:
            LOG.exception("row %d", row.number)
        return _refused(row, problem, flat=flat)
    infeasible = sum(not route.feasible for route in response.routes)
    if flat:
        return RowAnswer(_records(row, response), None, len(response.routes), infeasible)
    answer = lean_answer(response.model_dump(mode="json"), sent.fields, sent.compact)
    lines = (_line(row, response=answer),)
    return RowAnswer(lines, None, len(response.routes), infeasible)


def _refused(row: RequestRow, problem: Problem, *, flat: bool) -> RowAnswer:
    if flat:
        record = {"row": row.number, "id": row.id, "problem_code": problem.code.value, "problem_detail": problem.detail}
        return RowAnswer((record,), problem.code)
    return RowAnswer((_line(row, problem=problem.model_dump(mode="json")),), problem.code)


def _line(row: RequestRow, **content: object) -> str:
    return json.dumps({"row": row.number, "id": row.id, **content}, ensure_ascii=False, allow_nan=False)


def _records(row: RequestRow, response: RouteResponse) -> tuple[dict[str, Any], ...]:
    shared = {
        "row": row.number,
        "id": row.id,
        "start_snapped_m": response.snapped.start.distance_m,
        "goal_snapped_m": response.snapped.goal.distance_m,
        "warnings": "; ".join(response.warnings),
        "no_plan": None if response.no_plan is None else response.no_plan.reason,
    }
    return tuple(
        {
            **shared,
            "route": route.name,
            "feasible": route.feasible,
            "energy_kwh": route.energy_kwh,
            "battery_kwh": route.battery_kwh,
            "duration_s": route.duration_s,
            "total_s": route.total_s,
            "distance_m": route.distance_m,
            "soc_end": route.soc_end,
            "soc_min": route.soc_min,
            "deficit_kwh": route.deficit_kwh,
            "climb_m": route.climb_m,
            "descent_m": route.descent_m,
            **_charging_columns(route.charging),
            "geometry": shapely.to_wkb(shapely.LineString(route.geometry.coordinates))
            if isinstance(route.geometry, LineString)
            else None,
        }
        for route in response.routes
    )


def _charging_columns(plan: ChargingPlanAnswer | None) -> dict[str, Any]:
    if plan is None:
        return {}
    totals = plan.totals
    at_stations = [stop for stop in plan.stops if stop.station is not None]
    fallbacks = [stop.fallback for stop in at_stations if stop.fallback is not None]
    return {
        "stops": len(plan.stops),
        "charging_s": totals.charging_s,
        "charged_kwh": totals.charged_kwh,
        "charging_price": totals.price,
        "charging_currency": totals.currency or None,
        "waiting_s": totals.waiting_s,
        "arrive_time": plan.goal.arrive_time,
        "probability_kept": plan.probability_kept,
        "objective_unit": plan.objective_unit or None,
        "short_by": plan.proof.short_by,
        "least_fallback_soc": min((fallback.arrive_soc for fallback in fallbacks), default=None),
        "stops_without_fallback": len(at_stations) - sum(fallback.reached for fallback in fallbacks),
    }
