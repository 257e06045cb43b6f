"""The course that a simulation drives: links of a graph or numbers, as a chain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from app.conversions.conditions import conditions_from
from app.schemas.simulation import DEFAULT_STOPS
from energy.chain.chain import Chain, StopRule

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.simulation import SimulateRequest
    from energy.chain.chain import ChainResult
    from energy.chain.profile import SpeedProfile
    from energy.chain.timestep import DriveResult
    from energy.conditions import Conditions
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.places import LinkSpan


@dataclass(frozen=True, slots=True)
class Course:
    """Links to be driven, the vehicle with the effects that apply, and the conditions; spans and graph of a graph.

    warnings: what is to be said with the answer.
    """

    chain: Chain
    vehicle: AnyVehicle
    conditions: Conditions
    spans: Sequence[LinkSpan] = ()
    graph: RoadGraph | None = None
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DrivenCourse:
    """What driving a course takes; profile: where asked for."""

    result: ChainResult | DriveResult
    profile: SpeedProfile | None


def course_of(
    chain: Chain,
    vehicle: AnyVehicle,
    sent: SimulateRequest,
    spans: Sequence[LinkSpan] = (),
    graph: RoadGraph | None = None,
) -> Course:
    """The course of a request; vehicle: with the effects of the request."""
    return Course(chain, vehicle, conditions_from(sent.conditions), spans, graph)


def stops_of(sent: SimulateRequest) -> StopRule:
    """The stop rule of a request; the default depends on the model."""
    return DEFAULT_STOPS[sent.model] if sent.stops is None else sent.stops
