"""A diagnosis laid upon a graph: what planning got wrong on each trip, and where on the roads differences stay."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from app.diagnosing.residuals import window_residuals
from diagnosis.answer.learned import learned_vehicle
from diagnosis.answer.places import TripResidual, link_features, link_residuals
from diagnosis.answer.profile_split import profile_split
from diagnosis.causes.driven import median_ambient
from diagnosis.errors import DiagnosisError
from energy.errors import EnergyError

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.diagnosing.order import Diagnosed
    from diagnosis.answer.results import ProfileSplit, TripTimeline
    from diagnosis.matching.map_matcher import Match
    from diagnosis.matching.matched_drives import MatchedDrives
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle
    from routing.planner import Planner

STAGE: Final = "matching to the graph"


@dataclass(frozen=True, slots=True)
class OnGraph:
    """A diagnosis with its trips' profiles, GeoJSON text of the residuals on links, and which trips are not on it.

    places: None where no trip is on the graph.
    """

    diagnosed: Diagnosed
    places: str | None
    unmatched: tuple[str, ...]


def on_graph(
    diagnosed: Diagnosed,
    planner: Planner,
    drives: MatchedDrives,
    vehicle: Vehicle,
    progress: Callable[[str, float], None],
) -> OnGraph:
    """Match the recordings of a diagnosis to a graph; drives: those of this graph that are matched already.

    Residuals are what was measured less the model with all findings. A recording that can't be matched, or be driven on
    the graph's heights, is left out and named with the reason.
    """
    timelines = {trip.id: trip.timeline for trip in diagnosed.diagnosis.trips}
    residuals: list[tuple[TripResidual, Match]] = []
    splits: list[ProfileSplit] = []
    unmatched: list[str] = []
    for done, recording in enumerate(diagnosed.recordings):
        progress(STAGE, done / len(diagnosed.recordings))
        try:
            match = drives.match(recording)
            split = profile_split(recording, match, planner, vehicle)
            splits.append(replace(split, forecast_kwh=_forecast_kwh(diagnosed, recording, match, planner, vehicle)))
            if recording.id in timelines and timelines[recording.id].begin_s.size:
                residuals.append((_residual(timelines[recording.id], recording), match))
        except (DiagnosisError, EnergyError) as error:
            unmatched.append(f"{recording.id}: {error}")
    if not splits:
        return OnGraph(diagnosed, None, tuple(unmatched))
    features = link_features(link_residuals(residuals), planner.graph)
    diagnosis = replace(diagnosed.diagnosis, profile=tuple(splits))
    collection = {"type": features["type"], "kind": "links", "graph": planner.graph.meta.name, **features}
    text = json.dumps(collection, ensure_ascii=False, allow_nan=False)
    return OnGraph(replace(diagnosed, diagnosis=diagnosis), text, tuple(unmatched))


def _forecast_kwh(
    diagnosed: Diagnosed, recording: Recording, match: Match, planner: Planner, vehicle: Vehicle
) -> float | None:
    """Planned energy with what was learned, at the trip's temperature; None where that is no vehicle."""
    try:
        learned = learned_vehicle(vehicle, diagnosed.diagnosis)
        return profile_split(recording, match, planner, learned, conditions=median_ambient(recording)).planned_kwh
    except EnergyError:
        return None


def _residual(timeline: TripTimeline, recording: Recording) -> TripResidual:
    """What a trip's windows took more than the model with all findings; nothing between them."""
    windows = window_residuals(timeline, recording)
    edges_s = np.column_stack((windows.begin_s, windows.end_s)).ravel()
    steps_j = np.column_stack((windows.energy_j, np.zeros(windows.energy_j.size))).ravel()[:-1]
    kept = np.diff(edges_s) > 0.0  # a window that follows at once leaves no time between
    return TripResidual(recording.id, np.append(edges_s[:-1][kept], edges_s[-1]), steps_j[kept])
