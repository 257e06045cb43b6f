"""Simulation requests into chains, and what driving them takes into answers."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Final

import numpy as np

from app.conversions.course import stops_of
from app.conversions.graph import terrain_note
from app.conversions.route import parts_kwh, parts_wh, rows_of
from app.errors.raised import ChainLinkError
from app.schemas.as_json import as_json
from app.schemas.simulation import (
    ChainLinkSent,
    CrossName,
    FunctionalClassName,
    GraphLinkSent,
    SimulateEcho,
    SimulateRequest,
    SimulateResponse,
    SpeedProfileAnswer,
)
from energy.battery import soc_along
from energy.chain.chain import Chain
from energy.errors import LinkError
from energy.stops import Cross, StopSettings
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, KMH_PER_MPS
from routing.places import LinkSpan

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.conversions.course import Course, DrivenCourse
    from app.schemas.vehicles.vehicle import VehicleChoice
    from energy.chain.chain import LinkResults
    from energy.chain.profile import SpeedProfile
    from routing.graph.road_graph import RoadGraph


# names inside, on the left, are those of a chain in SI units; on the right, those of links that are sent
SENT_FIELDS: Final[Mapping[str, str]] = {
    "length_m": "length_m",
    "grade_frac": "grade",
    "speed_limit_mps": "speed_limit_kmh",
    "stop_probability_frac": "stop_probability",
    "stop_time_s": "stop_time_s",
    "stop_class": "cross",
    "altitude_m": "altitude_m",
    "heading": "heading_deg",
}

CROSS: Final[Mapping[CrossName, int]] = {name: int(Cross[name.name]) for name in CrossName}


def spans_from_links(sent: Sequence[GraphLinkSent], graph: RoadGraph) -> tuple[LinkSpan, ...]:
    """Links of a graph with their missing ends filled in; ids are left to the planner to check."""
    spans = []
    for link in sent:
        known = link.id < graph.road_link_count
        end_m = float(graph.length_m[link.id]) if known else 0.0
        spans.append(LinkSpan(link.id, link.from_m or 0.0, end_m if link.to_m is None else link.to_m, link.rest))
    return tuple(spans)


def chain_from_numbers(sent: Sequence[ChainLinkSent], settings: StopSettings) -> Chain:
    """A chain in SI units; stop probability and time by urban, cross and class where none is sent."""
    urban = np.array([link.urban for link in sent], np.intp)
    cross = np.array([CROSS[link.cross] for link in sent], np.intp)
    # the settings have no stop at a crossing of none (StopSettings)
    motorway = np.array([link.functional_class is FunctionalClassName.MOTORWAY for link in sent])
    probability = np.where(motorway, 0.0, settings.probability_frac[urban, cross])
    # those not sent are NaN here, which nobody can send
    sent_probability = np.array([link.stop_probability for link in sent], np.float64)
    sent_time_s = np.array([link.stop_time_s for link in sent], np.float64)
    altitude_m = [link.altitude_m for link in sent if link.altitude_m is not None]
    heading_rad = np.radians([link.heading_deg for link in sent if link.heading_deg is not None])
    return Chain(
        length_m=np.array([link.length_m for link in sent], np.float64),
        grade_frac=np.array([link.grade for link in sent], np.float64),
        speed_limit_mps=np.array([link.speed_limit_kmh for link in sent], np.float64) / KMH_PER_MPS,
        stop_probability_frac=np.where(np.isnan(sent_probability), probability, sent_probability),
        stop_time_s=np.where(np.isnan(sent_time_s), settings.time_s[urban, cross], sent_time_s),
        stop_class=(4 * urban + cross).astype(np.int8),
        altitude_m=np.array(altitude_m, np.float64) if altitude_m else None,
        heading=np.column_stack((np.sin(heading_rad), np.cos(heading_rad))) if heading_rad.size else None,
    )


def chain_link_error(error: LinkError, sent: Sequence[ChainLinkSent]) -> ChainLinkError:
    """An error of a chain by numbers in the names and units of the request."""
    field = SENT_FIELDS.get(error.field, error.field)
    value = getattr(sent[error.position], field, None)
    if value is None:  # not sent
        value = error.value
    return ChainLinkError(field, error.position, value.value if isinstance(value, Enum) else value, error.allowed)


def simulation_answer(driven: DrivenCourse, course: Course, sent: SimulateRequest) -> SimulateResponse:
    """What driving a course takes; sent: the request as understood."""
    return SimulateResponse.model_validate(_response(driven, course, sent))


def simulation_json(driven: DrivenCourse, course: Course, sent: SimulateRequest) -> bytes:
    """The JSON of simulation_answer, made without an object for each link."""
    return as_json(_response(driven, course, sent))


def _response(driven: DrivenCourse, course: Course, sent: SimulateRequest) -> dict[str, object]:
    """The fields of a SimulateResponse in their order."""
    result = driven.result
    soc: list[float] | None = None
    braked_away_kwh: float | None = None
    if sent.soc is not None:
        soc_frac, braked_away_j = soc_along(result.links.energy_j, sent.soc, course.vehicle.usable_capacity_wh)
        soc = soc_frac.tolist()
        braked_away_kwh = float(braked_away_j.sum()) / JOULE_PER_KWH
    return {
        "distance_m": result.distance_m,
        "duration_s": result.duration_s,
        "standstill_s": result.standstill_s,
        "stop_count": float(result.stop_count),
        "energy_kwh": result.energy_j / JOULE_PER_KWH,
        "battery_kwh": None if braked_away_kwh is None else result.energy_j / JOULE_PER_KWH + braked_away_kwh,
        "energy_parts_kwh": parts_kwh(result.parts),
        "braked_away_kwh": braked_away_kwh,
        "soc_start": sent.soc,
        "soc_end": None if soc is None else soc[-1],
        "soc_min": None if soc is None or sent.soc is None else min(sent.soc, *soc),
        "links": _links(result.links, course, soc),
        "profile": None if driven.profile is None else profile_answer(driven.profile),
        "request": SimulateEcho(
            graph=sent.graph,
            vehicle=_vehicle(sent),
            soc=sent.soc,
            model=sent.model,
            link_model=sent.link_model,
            stops=stops_of(sent),
            arrive_stopped=sent.arrive_stopped,
            conditions=sent.conditions,
            effects=sent.effects,
            profile=sent.profile,
        ),
        "warnings": [*course.warnings, *(["the charge falls below 0"] if soc is not None and min(soc) < 0.0 else [])],
        "terrain": None if course.graph is None else terrain_note(course.graph),
    }


def _links(links: LinkResults, course: Course, soc: list[float] | None) -> list[dict[str, object]]:
    """The fields of SimulatedLink in their order, one dictionary a link."""
    chain, count = course.chain, len(links)
    ids: list[int | None] = [None] * count
    from_m, to_m, rests = [0.0] * count, chain.length_m.tolist(), [False] * count
    if course.graph is not None:
        ids = [span.link_idx for span in course.spans]
        from_m, to_m = [span.from_m for span in course.spans], [span.to_m for span in course.spans]
        rests = [span.rest for span in course.spans]
    columns: dict[str, Sequence[object]] = {
        "position": range(count),
        "id": ids,
        "from_m": from_m,
        "to_m": to_m,
        "rest": rests,
        "length_m": np.subtract(to_m, from_m).tolist(),
        "duration_s": links.duration_s.tolist(),
        "standstill_s": links.standstill_s.tolist(),
        "energy_wh": (links.energy_j / JOULE_PER_WH).tolist(),
        "energy_parts_wh": parts_wh(links.parts_j),
        "soc_end": [None] * count if soc is None else soc,
        "grade": chain.grade_frac.tolist(),
        "speed_limit_kmh": (chain.speed_limit_mps * KMH_PER_MPS).tolist(),
        "speed_end_kmh": (links.carried_mps * KMH_PER_MPS).tolist(),
        "stop_probability": links.stop_probability_frac.tolist(),
    }
    return rows_of(count, dict.fromkeys(columns), columns.items())


def profile_answer(profile: SpeedProfile) -> SpeedProfileAnswer:
    """A speed profile to the millimetre, the millisecond and the metre an hour."""
    return SpeedProfileAnswer(
        distance_m=profile.distance_m.round(3).tolist(),
        time_s=profile.time_s.round(3).tolist(),
        speed_kmh=(profile.speed_mps * KMH_PER_MPS).round(3).tolist(),
        stops=profile.stop_rule,
    )


def _vehicle(sent: SimulateRequest) -> VehicleChoice:
    assert sent.vehicle is not None, "the understood request names its vehicle"
    return sent.vehicle
