"""Matrix requests into routing.route.matrix, and its rows into answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from app.conversions.conditions import conditions_from
from app.conversions.graph import terrain_note
from app.conversions.place import point_from_place, snapped
from app.schemas.matrix import MatrixResponse, MatrixStats
from app.schemas.place import Snapped
from energy.units import JOULE_PER_KWH
from routing.queries import MatrixQuery
from routing.route.matrix import NotDriven
from routing.weights import ECO, Weights

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.schemas.matrix import MatrixRequest
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.route.matrix import MatrixAnswer, MatrixEntry

Figure = TypeVar("Figure")


def matrix_query(sent: MatrixRequest, vehicle: AnyVehicle) -> MatrixQuery:
    """What the planner is asked; vehicle: with the effects of the request."""
    weights = sent.weights
    targets = sent.sources if sent.targets is None else sent.targets
    return MatrixQuery(
        sources=tuple(point_from_place(place) for place in sent.sources),
        targets=tuple(point_from_place(place) for place in targets),
        soc_frac=sent.soc,
        vehicle=vehicle,
        reserve_soc_frac=sent.reserve_soc,
        weights=ECO if weights is None else Weights(weights.energy, weights.time, weights.distance),
        link_model=sent.link_model,
        stop_rule=sent.stops,
        conditions=conditions_from(sent.conditions),
    )


def matrix_response(answer: MatrixAnswer, understood: MatrixRequest, graph: RoadGraph) -> MatrixResponse:
    """Figures of all pairs, with null where a pair can't be driven."""

    def each(figure: Callable[[MatrixEntry], Figure]) -> list[list[Figure]]:
        return [[figure(entry) for entry in row.entries] for row in answer.rows]

    def driven(figure: Callable[[MatrixEntry], float]) -> list[list[float | None]]:
        return each(lambda entry: figure(entry) if entry.reason is None else None)

    return MatrixResponse(
        feasible=each(lambda entry: entry.reason is None),
        energy_kwh=driven(lambda entry: entry.energy_j / JOULE_PER_KWH),
        battery_kwh=driven(lambda entry: entry.battery_j / JOULE_PER_KWH),
        duration_s=driven(lambda entry: entry.duration_s),
        distance_m=driven(lambda entry: entry.distance_m),
        soc_end=driven(lambda entry: entry.soc_end_frac),
        soc_min=driven(lambda entry: entry.soc_min_frac),
        reason=each(lambda entry: entry.reason),
        deficit_kwh=each(lambda entry: None if entry.reason is NotDriven.NO_PATH else entry.deficit_j / JOULE_PER_KWH),
        sources=[Snapped.model_validate(snapped(place)) for place in answer.sources],
        targets=[Snapped.model_validate(snapped(place)) for place in answer.targets],
        request=understood,
        warnings=list(answer.warnings),
        stats=MatrixStats(
            labels_made=sum(row.labels_made for row in answer.rows),
            labels_settled=sum(row.labels_settled for row in answer.rows),
            seconds=sum(row.seconds for row in answer.rows),
            entries_alone=sum(row.alone for row in answer.rows),
        ),
        terrain=terrain_note(graph),
    )
