"""Recorded tracks: where a recording was at given times, and what its trip took more than modelled along the way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.diagnosing.residuals import window_residuals
from app.errors.diagnosing import storable
from diagnosis.answer.places import FULL_SCALE_QUANTILE, colour
from diagnosis.matching.tracks import NoPositionsError, odometer_m, positions_deg, thinned
from energy.units import JOULE_PER_WH, METRE_PER_KM

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from app.diagnosing.order import Diagnosed
    from diagnosis.answer.results import TripAccount
    from diagnosis.recordings.reading import Recording

STRETCH_M: Final = 250.0  # as the cells of diagnosis.answer.places
MOST_STRETCHES: Final = 4000  # of a whole answer, about; beyond it stretches grow longer
BRIDGED_M: Final = 250.0  # way between two positions beyond which those between them are not known
END_M: Final = 25.0  # way before the first and after the last position over which the car counts as being there
POINT_M: Final = 25.0  # way between the points of a line
APART_S: Final = 1.0  # time between two windows from which on something lies between them


def places_at(recording: Recording, time_s: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Latitude and longitude at times of the recording's clock, float64 (n, 2) [deg], NaN where they are not known.

    Between two positions it follows the odometer. None where the recording has no positions.
    """
    try:
        lat, lon, fix = positions_deg(recording)
    except NoPositionsError:
        return None
    way = odometer_m(recording)
    at_m = np.interp(time_s, recording.time_s, way)
    after = np.searchsorted(recording.time_s[fix], time_s)
    a, b = fix[np.maximum(after - 1, 0)], fix[np.minimum(after, fix.size - 1)]
    span_m = way[b] - way[a]
    share = np.clip(np.divide(at_m - way[a], span_m, out=np.zeros(time_s.size), where=span_m > 0.0), 0.0, 1.0)
    found = np.column_stack([values[a] + share * (values[b] - values[a]) for values in (lat, lon)])
    found[np.where(a == b, np.abs(at_m - way[a]) > END_M, span_m > BRIDGED_M)] = np.nan
    return found


def track_features(diagnosed: Diagnosed) -> dict[str, Any]:
    """Stretches of recorded tracks as a GeoJSON FeatureCollection (RFC 7946) of LineStrings, coloured by mean power.

    Of recordings with positions only; without any, the collection has no features. A stretch is at least one window
    and, where the track goes on for so long, STRETCH_M of way. Properties are those of links in residuals.geojson, with
    the trip, the time since its first sample and the duration in place of link and name.
    """
    recordings = {recording.id: recording for recording in diagnosed.recordings}
    trips = [(trip, recordings[trip.id]) for trip in diagnosed.diagnosis.trips]
    least_m = max(STRETCH_M, 1000.0 * sum(trip.distance_km for trip, _ in trips) / MOST_STRETCHES)
    features = [feature for trip, recording in trips for feature in _stretches(trip, recording, least_m)]
    sizes_w = [abs(feature["properties"]["mean_w"]) for feature in features]
    full_w = float(np.quantile(sizes_w, FULL_SCALE_QUANTILE)) if sizes_w else 0.0
    for feature in features:
        feature["properties"]["stroke"] = colour(feature["properties"]["mean_w"], full_w)
    return {"type": "FeatureCollection", "kind": "tracks", "graph": None, "features": features}


def _stretches(trip: TripAccount, recording: Recording, least_m: float) -> Iterator[dict[str, Any]]:
    """Features of one trip, not coloured yet."""
    windows = window_residuals(trip.timeline, recording)
    begin, end = places_at(recording, windows.begin_s), places_at(recording, windows.end_s)
    if begin is None or end is None:
        return
    way = odometer_m(recording)
    begin_m, end_m = (np.interp(time_s, recording.time_s, way) for time_s in (windows.begin_s, windows.end_s))
    known = ~np.isnan(begin[:, 0]) & ~np.isnan(end[:, 0])
    follows = np.append((windows.begin_s[1:] - windows.end_s[:-1] < APART_S) & known[1:], False)
    for first, last in _stretch_windows(begin_m, end_m, known, follows, least_m):
        points = _line(recording, way, windows.begin_s[first], windows.end_s[last], begin[first], end[last])
        if len(points) < 2:
            continue  # stood still
        here = slice(first, last + 1)
        duration_s = float(trip.timeline.duration_s[here].sum())
        energy_j, way_m = float(windows.energy_j[here].sum()), float(end_m[last] - begin_m[first])
        per_km = round(energy_j / JOULE_PER_WH / (way_m / METRE_PER_KM), 2) if way_m > 0.0 else None
        properties = {
            "trip": storable(trip.id),
            "t_s": round(float(windows.begin_s[first] - recording.time_s[0]), 1),
            "duration_s": round(duration_s, 1),
            "mean_w": round(energy_j / duration_s, 1),
            "ci95": None,
            "wh_per_km": per_km,
            "wh_per_km_ci95": None,
            "energy_wh": round(energy_j / JOULE_PER_WH, 3),
            "trips": 1,
            "passes": 1,
            "stroke": "",
            "stroke-opacity": 1.0,
            "stroke-width": 4,
        }
        yield {"type": "Feature", "geometry": {"type": "LineString", "coordinates": points}, "properties": properties}


def _stretch_windows(
    begin_m: NDArray[np.float64],
    end_m: NDArray[np.float64],
    known: NDArray[np.bool_],
    follows: NDArray[np.bool_],
    least_m: float,
) -> Iterator[tuple[int, int]]:
    """First and last window of each stretch; follows: whether the next window follows at once.

    What remains at the end of a run of windows joins the stretch before it where it is less than half of one.
    """
    first, before = 0, None
    for k in range(known.size):
        if not known[k]:
            first = k + 1
            continue
        enough = end_m[k] - begin_m[first] >= least_m
        if follows[k] and not enough:
            continue
        short = end_m[k] - begin_m[first] < 0.5 * least_m
        if short and before is not None and before[1] == first - 1 and follows[first - 1]:
            before = (before[0], k)
        else:
            if before is not None:
                yield before
            before = (first, k)
        first = k + 1
    if before is not None:
        yield before


def _line(
    recording: Recording,
    way_m: NDArray[np.float64],
    begin_s: float,
    end_s: float,
    begin_deg: NDArray[np.float64],
    end_deg: NDArray[np.float64],
) -> list[list[float]]:
    """Positions from a time to another, [lon, lat] [deg], POINT_M apart, none twice in a row."""
    lat, lon, fix = positions_deg(recording)
    inside = fix[(recording.time_s[fix] > begin_s) & (recording.time_s[fix] < end_s)]
    inside = inside[thinned(way_m[inside], POINT_M)] if inside.size else inside
    rows = [begin_deg, *np.column_stack((lat[inside], lon[inside])), end_deg]
    points = [[round(float(row[1]), 6), round(float(row[0]), 6)] for row in rows]
    return [point for k, point in enumerate(points) if k == 0 or point != points[k - 1]]
