"""Trips of a diagnosis along time: in windows, with where each was driven, for charts and for a map's cursor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final
from urllib.parse import quote

import numpy as np

from app.diagnosing.residuals import window_edges_s
from app.diagnosing.tracks import places_at
from app.errors.diagnosing import storable
from app.schemas.diagnosis import TripLinks, TripOutline, TripTimelineAnswer
from app.store.diagnoses import TripDocument
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from app.diagnosing.order import Diagnosed
    from diagnosis.answer.results import TripAccount
    from diagnosis.recordings.reading import Recording

MOST_POINTS: Final = 600  # of one trip: a chart has about as many pixels


def trip_documents(diagnosed: Diagnosed, diagnosis_id: str) -> tuple[TripDocument, ...]:
    """Outline and timeline of every trip of a diagnosis, as they are stored under its id."""
    recordings = {recording.id: recording for recording in diagnosed.recordings}
    found = []
    for trip in diagnosed.diagnosis.trips:
        timeline = trip_timeline(trip, recordings[trip.id])
        outline = TripOutline(
            id=timeline.id,
            held_out=timeline.held_out,
            points=len(timeline.t_s),
            duration_s=round(trip.duration_s, 1),
            bbox=_bbox(timeline),
            links=TripLinks(self=f"/diagnoses/{diagnosis_id}/trips/{quote(timeline.id, safe='')}"),
        )
        found.append(TripDocument(timeline.id, outline.model_dump_json(), timeline.model_dump_json()))
    return tuple(found)


def trip_timeline(trip: TripAccount, recording: Recording) -> TripTimelineAnswer:
    """One trip along time, in at most MOST_POINTS points: each of one window, or of the means over several."""
    timeline = trip.timeline
    begin_s, end_s = window_edges_s(timeline)
    merged = max(-(-begin_s.size // MOST_POINTS), 1)
    first = np.arange(0, begin_s.size, merged)
    last = np.minimum(first + merged, begin_s.size) - 1
    duration_s = np.add.reduceat(timeline.duration_s, first)

    def means(values: NDArray[np.float64]) -> list[float]:
        return _rounded(np.add.reduceat(values * timeline.duration_s, first) / duration_s)

    places = places_at(recording, float(recording.time_s[0]) + 0.5 * (begin_s[first] + end_s[last]))
    return TripTimelineAnswer(
        id=storable(trip.id),
        held_out=trip.held_out,
        t_s=_rounded(begin_s[first]),
        duration_s=_rounded(duration_s),
        speed_kmh=means(KMH_PER_MPS * timeline.speed_mps),
        measured_w=means(timeline.measured_w),
        before_w=means(timeline.before_w),
        after_w=means(timeline.after_w),
        lat=None if places is None else _coordinates(places[:, 0]),
        lon=None if places is None else _coordinates(places[:, 1]),
    )


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [round(value, 1) for value in values.tolist()]


def _coordinates(values: NDArray[np.float64]) -> list[float | None]:
    """Coordinates to a tenth of a metre, None for those that are not known."""
    return [None if np.isnan(value) else round(value, 6) for value in values.tolist()]


def _bbox(timeline: TripTimelineAnswer) -> tuple[float, float, float, float] | None:
    """West, south, east, north of a timeline's positions; None without any."""
    lat, lon = ([degree for degree in values or [] if degree is not None] for values in (timeline.lat, timeline.lon))
    return (min(lon), min(lat), max(lon), max(lat)) if lat and lon else None
