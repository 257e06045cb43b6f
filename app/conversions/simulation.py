"""Simulation requests into chains, and what driving them takes into answers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from app.conversions.graph import terrain_note
from app.conversions.route import JOULE_PER_KWH, parts_kwh, parts_wh
from app.schemas.simulation import (
    ChainLinkSent,
    CrossName,
    FunctionalClassName,
    GraphLinkSent,
    SimulatedLink,
    SimulateEcho,
    SimulateRequest,
    SimulateResponse,
)
from energy.battery import JOULE_PER_WH, soc_along
from energy.chain import Chain, ChainResult
from energy.stops import Cross, StopSettings
from energy.vehicle import KMH_PER_MPS
from routing.query import LinkSpan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.vehicle import VehicleChoice
    from energy.vehicle import Vehicle
    from routing.graph import RoadGraph


def spans_from_links(sent: Sequence[GraphLinkSent], graph: RoadGraph) -> tuple[LinkSpan, ...]:
    """Links of a graph with their missing ends filled in; ids are left to the planner to check."""
    spans = []
    for link in sent:
        known = link.id < graph.link_count
        end_m = float(graph.length_m[link.id]) if known else 0.0
        spans.append(LinkSpan(link.id, link.from_m or 0.0, end_m if link.to_m is None else link.to_m))
    return tuple(spans)


def chain_from_numbers(sent: Sequence[ChainLinkSent], settings: StopSettings) -> Chain:
    """A chain in SI units; stop probability and time by urban, cross and class where none is sent."""
    probability, time_s, stop_class = [], [], []
    for link in sent:
        cross = Cross[link.cross.name]
        stops = link.functional_class is not FunctionalClassName.MOTORWAY and link.cross is not CrossName.NONE
        default = float(settings.probability_frac[int(link.urban), cross]) if stops else 0.0
        probability.append(default if link.stop_probability is None else link.stop_probability)
        time_s.append(float(settings.time_s[int(link.urban), cross]) if link.stop_time_s is None else link.stop_time_s)
        stop_class.append(4 * int(link.urban) + int(cross))
    return Chain(
        length_m=np.array([link.length_m for link in sent], np.float64),
        grade_frac=np.array([link.grade for link in sent], np.float64),
        speed_limit_mps=np.array([link.speed_limit_kmh for link in sent], np.float64) / KMH_PER_MPS,
        stop_probability_frac=np.array(probability, np.float64),
        stop_time_s=np.array(time_s, np.float64),
        stop_class=np.array(stop_class, np.int8),
    )


def simulation_of_links(
    result: ChainResult, spans: Sequence[LinkSpan], sent: SimulateRequest, vehicle: Vehicle, graph: RoadGraph
) -> SimulateResponse:
    """What driving links of a graph takes."""
    idx = np.array([span.link_idx for span in spans], np.int64)
    return _response(
        result,
        sent,
        vehicle,
        ids=[int(i) for i in idx],
        from_m=[span.from_m for span in spans],
        to_m=[span.to_m for span in spans],
        grades=(graph.climb_m()[idx] / graph.length_m[idx]).tolist(),
        limits_kmh=(graph.speed_limit_mps[idx] * KMH_PER_MPS).tolist(),
        graph=graph,
    )


def simulation_of_chain(result: ChainResult, sent: SimulateRequest, vehicle: Vehicle) -> SimulateResponse:
    """What driving a chain given by its numbers takes."""
    chain = sent.chain or []
    return _response(
        result,
        sent,
        vehicle,
        ids=[None] * len(chain),
        from_m=[0.0] * len(chain),
        to_m=[link.length_m for link in chain],
        grades=[link.grade for link in chain],
        limits_kmh=[link.speed_limit_kmh for link in chain],
        graph=None,
    )


def _response(
    result: ChainResult,
    sent: SimulateRequest,
    vehicle: Vehicle,
    *,
    ids: Sequence[int | None],
    from_m: Sequence[float],
    to_m: Sequence[float],
    grades: Sequence[float],
    limits_kmh: Sequence[float],
    graph: RoadGraph | None,
) -> SimulateResponse:
    soc: list[float] | None = None
    braked_away_kwh: float | None = None
    if sent.soc is not None:
        energy_j = np.array([link.energy_j for link in result.links], np.float64)
        soc_frac, braked_away_j = soc_along(energy_j, sent.soc, vehicle.usable_capacity_wh)
        soc = soc_frac.tolist()
        braked_away_kwh = float(braked_away_j.sum()) / JOULE_PER_KWH
    links = [
        SimulatedLink(
            position=k,
            id=ids[k],
            from_m=from_m[k],
            to_m=to_m[k],
            length_m=to_m[k] - from_m[k],
            duration_s=link.duration_s,
            standstill_s=link.standstill_s,
            energy_wh=link.energy_j / JOULE_PER_WH,
            energy_parts_wh=parts_wh(link.parts_j.tolist()),
            soc_end=None if soc is None else soc[k],
            grade=grades[k],
            speed_limit_kmh=limits_kmh[k],
            speed_end_kmh=link.speed_end_mps * KMH_PER_MPS,
            stop_probability=link.stop_probability_frac,
        )
        for k, link in enumerate(result.links)
    ]
    return SimulateResponse(
        distance_m=result.distance_m,
        duration_s=result.duration_s,
        standstill_s=result.standstill_s,
        stop_count=result.stop_count,
        energy_kwh=result.energy_j / JOULE_PER_KWH,
        energy_parts_kwh=parts_kwh(result.parts),
        braked_away_kwh=braked_away_kwh,
        soc_start=sent.soc,
        soc_end=None if soc is None else soc[-1],
        soc_min=None if soc is None or sent.soc is None else min(sent.soc, *soc),
        links=links,
        request=SimulateEcho(
            graph=sent.graph,
            vehicle=_vehicle(sent),
            soc=sent.soc,
            link_model=sent.link_model,
            stops=sent.stops,
            arrive_stopped=sent.arrive_stopped,
        ),
        warnings=["the charge falls below 0"] if soc is not None and min(soc) < 0.0 else [],
        terrain=None if graph is None else terrain_note(graph),
    )


def _vehicle(sent: SimulateRequest) -> VehicleChoice:
    assert sent.vehicle is not None, "the understood request names its vehicle"
    return sent.vehicle
