"""Where in the world measured and simulated energy part: residuals on links, and as GeoJSON."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy import stats

from diagnosis.answer.regimes import CONFIDENCE_FRAC
from diagnosis.errors import DiagnosisError
from energy.units import JOULE_PER_WH, METRE_PER_KM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.matching.map_matcher import Match
    from routing.graph.road_graph import RoadGraph

# nine classes from less than simulated to more: ColorBrewer's RdBu, safe for colour-blind readers
COLOURS: Final = ("#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582", "#d6604d", "#b2182b")
FULL_SCALE_QUANTILE: Final = 0.95  # of the places' |mean_w|, beyond which colours don't change
UNCERTAIN_OPACITY: Final = 0.35


@dataclass(frozen=True, slots=True)
class TripResidual:
    """What one trip took more than simulated, in steps.

    time_s: float64 (n+1,) rising edges, on the recording's clock. residual_j: float64 (n,) measured less simulated [J].
    Raises DiagnosisError naming the trip and the field.
    """

    trip_id: str
    time_s: NDArray[np.float64]
    residual_j: NDArray[np.float64]

    def __post_init__(self) -> None:
        n = self.residual_j.size
        if self.time_s.shape != (n + 1,) or n == 0:
            raise DiagnosisError(f"time_s of trip {self.trip_id!r} has {self.time_s.size} edges, allowed: {n + 1}, > 1")
        if not bool((np.diff(self.time_s) > 0.0).all()):
            raise DiagnosisError(f"time_s of trip {self.trip_id!r} falls or stands still, allowed: rising")
        if not bool(np.isfinite(self.residual_j).all()):
            at = int(np.argmin(np.isfinite(self.residual_j)))
            raise DiagnosisError(f"residual_j of trip {self.trip_id!r}, step {at}, is not finite")

    def until_j(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Residual energy up to times, its power even within a step and 0 outside the edges, float64 as time_s [J]."""
        return np.interp(time_s, self.time_s, np.concatenate(([0.0], np.cumsum(self.residual_j))))


@dataclass(frozen=True, slots=True)
class PlaceResidual:
    """What trips took more than simulated at one place.

    place: link. energy_j: over all passes. mean_w, wh_per_km: energy over time and over way
    driven there, with the 95 % intervals that the delete-one-trip jackknife gives, None for fewer than two trips.
    wh_per_km is NaN where nothing moved.
    """

    place: int
    trips: int
    passes: int
    energy_j: float
    duration_s: float
    distance_m: float
    mean_w: float
    mean_w_ci95: tuple[float, float] | None
    wh_per_km: float
    wh_per_km_ci95: tuple[float, float] | None

    @property
    def departs(self) -> bool:
        """Whether the interval of the mean power leaves 0 out."""
        return self.mean_w_ci95 is not None and (self.mean_w_ci95[0] > 0.0 or self.mean_w_ci95[1] < 0.0)


@dataclass(frozen=True, slots=True)
class _Passes:
    """Passes of one trip through places, one value each."""

    place: NDArray[np.int64]
    enter_s: NDArray[np.float64]
    leave_s: NDArray[np.float64]
    distance_m: NDArray[np.float64]


def link_residuals(trips: Sequence[tuple[TripResidual, Match]]) -> tuple[PlaceResidual, ...]:
    """Residuals of trips on the links that they were matched to, by link; steps off all links are left out.

    The energy of a step that lies on several links is shared out by time. Raises DiagnosisError where a trip's match is
    that of another recording, or a trip is there twice.
    """
    passes = []
    for trip, match in trips:
        if trip.trip_id != match.recording_id:
            raise DiagnosisError(f"trip {trip.trip_id!r} comes with the match of recording {match.recording_id!r}")
        parts = match.stretches
        passes.append(
            _Passes(
                place=_joined([part.links for part in parts], np.int64),
                enter_s=_joined([part.enter_s[:-1] for part in parts], np.float64),
                leave_s=_joined([part.enter_s[1:] for part in parts], np.float64),
                distance_m=_joined([part.to_m - part.from_m for part in parts], np.float64),
            )
        )
    return _summed([trip for trip, _ in trips], passes)


def link_features(residuals: Sequence[PlaceResidual], graph: RoadGraph) -> dict[str, Any]:
    """Links as a GeoJSON FeatureCollection (RFC 7946) of LineStrings, coloured by mean power."""
    full_w = _full_scale_w(residuals)
    return _collection(
        [
            _feature(
                {"type": "LineString", "coordinates": graph.geometry(residual.place).round(7).tolist()},
                {
                    "link": residual.place,
                    "name": graph.names[int(graph.name_idx[residual.place])],
                    **_properties(residual, full_w),
                    "stroke-width": 4,
                },
            )
            for residual in residuals
        ]
    )


def colour(mean_w: float, full_w: float) -> str:
    """Colour of a mean power, blue below 0 and red above, pale near 0 and full from ±full_w on [W]."""
    share = 0.0 if full_w <= 0.0 else min(max(mean_w / full_w, -1.0), 1.0)
    middle = len(COLOURS) // 2
    return COLOURS[middle + round(share * middle)]


def _joined(arrays: Sequence[NDArray[Any]], kind: type) -> NDArray[Any]:
    return np.concatenate([np.empty(0, kind), *arrays])


def _summed(trips: Sequence[TripResidual], passes: Sequence[_Passes]) -> tuple[PlaceResidual, ...]:
    """Residuals by place from each trip's passes."""
    ids = [trip.trip_id for trip in trips]
    for trip_id in {trip_id for trip_id in ids if ids.count(trip_id) > 1}:
        raise DiagnosisError(f"trip {trip_id!r} is there {ids.count(trip_id)} times, allowed: once")
    place = _joined([passed.place for passed in passes], np.int64)
    if place.size == 0:
        return ()
    number = np.repeat(np.arange(len(trips)), [passed.place.size for passed in passes])
    figures = np.column_stack(
        [
            np.concatenate(
                [
                    trip.until_j(passed.leave_s) - trip.until_j(passed.enter_s)
                    for trip, passed in zip(trips, passes, strict=True)
                ]
            ),
            np.concatenate([passed.leave_s - passed.enter_s for passed in passes]),
            np.concatenate([passed.distance_m for passed in passes]),
            np.ones(place.size),
        ]
    )
    order = np.lexsort((number, place))
    place, number, figures = place[order], number[order], figures[order]
    new_place = np.concatenate(([True], np.diff(place) != 0))
    new_trip = np.flatnonzero(new_place | np.concatenate(([True], np.diff(number) != 0)))
    by_trip = np.add.reduceat(figures, new_trip, axis=0)
    edges = np.concatenate((np.searchsorted(new_trip, np.flatnonzero(new_place)), [new_trip.size]))
    places = place[new_place].tolist()
    return tuple(
        _place(places[k], by_trip[edges[k] : edges[k + 1]])
        for k in range(len(places))
        if by_trip[edges[k] : edges[k + 1], 1].sum() > 0.0
    )


def _place(place: int, by_trip: NDArray[np.float64]) -> PlaceResidual:
    """One place from each trip's energy, time, way and number of passes there, float64 (trips, 4)."""
    energy, time, way = by_trip[:, 0], by_trip[:, 1], by_trip[:, 2] / METRE_PER_KM * JOULE_PER_WH
    mean_w, wh_per_km = _ratio(energy, time), _ratio(energy, way)
    return PlaceResidual(
        place=place,
        trips=by_trip.shape[0],
        passes=round(float(by_trip[:, 3].sum())),
        energy_j=float(energy.sum()),
        duration_s=float(time.sum()),
        distance_m=float(by_trip[:, 2].sum()),
        mean_w=mean_w,
        mean_w_ci95=_interval(energy, time),
        wh_per_km=wh_per_km,
        wh_per_km_ci95=_interval(energy, way),
    )


def _ratio(above: NDArray[np.float64], below: NDArray[np.float64]) -> float:
    return float(above.sum()) / float(below.sum()) if float(below.sum()) > 0.0 else math.nan


def _interval(above: NDArray[np.float64], below: NDArray[np.float64]) -> tuple[float, float] | None:
    """95 % interval of a ratio of sums over trips by the delete-one jackknife, as diagnosis.answer.regimes has it."""
    n = above.size
    others = below.sum() - below
    if n < 2 or not bool((others > 0.0).all()):
        return None
    without = (above.sum() - above) / others
    sd = math.sqrt((n - 1) / n * float(np.square(without - without.mean()).sum()))
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE_FRAC, n - 1)) * sd
    mean = _ratio(above, below)
    return mean - half, mean + half


def _full_scale_w(residuals: Sequence[PlaceResidual]) -> float:
    if not residuals:
        return 0.0
    return float(np.quantile([abs(residual.mean_w) for residual in residuals], FULL_SCALE_QUANTILE))


def _properties(residual: PlaceResidual, full_w: float) -> dict[str, Any]:
    return {
        "mean_w": round(residual.mean_w, 1),
        "ci95": _rounded(residual.mean_w_ci95),
        "wh_per_km": None if math.isnan(residual.wh_per_km) else round(residual.wh_per_km, 2),
        "wh_per_km_ci95": _rounded(residual.wh_per_km_ci95),
        "energy_wh": round(residual.energy_j / JOULE_PER_WH, 3),
        "trips": residual.trips,
        "passes": residual.passes,
        "stroke": colour(residual.mean_w, full_w),
        "stroke-opacity": 1.0 if residual.departs else UNCERTAIN_OPACITY,
    }


def _rounded(interval: tuple[float, float] | None) -> list[float] | None:
    return None if interval is None else [round(interval[0], 2), round(interval[1], 2)]


def _feature(geometry: dict[str, Any], properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _collection(features: list[dict[str, Any]]) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": features}
