"""Drives along links of a graph as a logger would record them, with a receiver's errors."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnosis.matching.matched_way import JUNCTION_M
from diagnosis.recordings.reading import Recording
from energy.chain.profile import chain_profile
from energy.stops import Cross, FunctionalClass
from routing.graph.earth import METRE_PER_DEGREE, great_circle_m
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph
from routing.places import LinkSpan

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from energy.vehicle.files import AnyVehicle
    from routing.planner import Planner

ERROR_TIME_S = 30.0  # in which a receiver's error decays to 1/e
WHITE_FRAC = 0.3  # of the error's variance that no sample shares with the next one


@dataclass(frozen=True)
class MapDrive:
    """A recording and the truth: link and position on it of each sample."""

    recording: Recording
    link: NDArray[np.int64]
    position_m: NDArray[np.float64]

    def right_frac(self, link: NDArray[np.int64]) -> float:
        """Share of the way on the right link."""
        step_m = self.recording.speed_mps * np.gradient(self.recording.time_s)
        return float(step_m[link == self.link].sum() / step_m.sum())


def place_deg(graph: RoadGraph, link: int, position_m: float) -> tuple[float, float]:
    """Latitude and longitude of a position on a link [deg]."""
    lonlat = graph.geometry(link)
    shrink = np.cos(np.radians(lonlat[0, 1]))
    along = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(lonlat[:, 0]) * shrink, np.diff(lonlat[:, 1])))))
    at = position_m / float(graph.length_m[link]) * along[-1]
    return float(np.interp(at, along, lonlat[:, 1])), float(np.interp(at, along, lonlat[:, 0]))


def drive_at(
    graph: RoadGraph,
    spans: Sequence[LinkSpan],
    time_s: NDArray[np.float64],
    way_m: NDArray[np.float64],
    *,
    trip_id: str = "T1",
    error_sd_m: float = 0.0,
    odometer_scale: float = 1.0,
    seed: int = 0,
) -> MapDrive:
    """A drive over stretches of links that is way_m from their beginning at each time, float64 (n,).

    A sample where one stretch ends is on the next one, whatever the last bit of the lengths' sum is.
    """
    ends = np.concatenate(([0.0], np.cumsum([span.to_m - span.from_m for span in spans])))
    at = np.clip(np.searchsorted(ends, way_m + JUNCTION_M, side="right") - 1, 0, len(spans) - 1)
    link = np.array([span.link_idx for span in spans], np.int64)[at]
    position = np.array([span.from_m for span in spans])[at] + np.maximum(way_m - ends[at], 0.0)
    places = np.array([place_deg(graph, int(a), float(b)) for a, b in zip(link, position, strict=True)])
    north, east = error_sd_m * _errors(time_s.size, np.random.default_rng(seed))
    lat = places[:, 0] + north / METRE_PER_DEGREE
    lon = places[:, 1] + east / (METRE_PER_DEGREE * np.cos(np.radians(places[:, 0])))
    recording = Recording(
        id=trip_id,
        time_s=time_s,
        speed_mps=np.maximum(np.gradient(way_m, time_s), 0.0) * odometer_scale,
        power_w=np.full(time_s.size, 1000.0),
        latitude_deg=lat,
        longitude_deg=lon,
    )
    return MapDrive(recording, link, position)


def drive_planned(
    planner: Planner,
    vehicle: AnyVehicle,
    spans: tuple[LinkSpan, ...],
    *,
    trip_id: str = "T1",
    error_sd_m: float = 0.0,
    odometer_scale: float = 1.0,
    seed: int = 0,
) -> MapDrive:
    """A drive over stretches of links as the link model drives it, a sample a second."""
    plan = chain_profile(vehicle, planner.chain(spans))
    moves = np.concatenate(([True], np.diff(plan.time_s) > 0.0))
    time_s = np.arange(0.0, float(plan.time_s[-1]) + 1.0)
    way_m = np.interp(time_s, plan.time_s[moves], plan.distance_m[moves])
    return drive_at(
        planner.graph,
        spans,
        time_s,
        way_m,
        trip_id=trip_id,
        error_sd_m=error_sd_m,
        odometer_scale=odometer_scale,
        seed=seed,
    )


def _errors(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Errors north and east of standard deviation 1, float64 (2, n): part white, part decaying (Gauss–Markov)."""
    kept = np.exp(-1.0 / ERROR_TIME_S)
    slow = rng.normal(size=(2, count))
    for k in range(1, count):
        slow[:, k] = kept * slow[:, k - 1] + np.sqrt(1.0 - kept**2) * slow[:, k]
    return np.asarray(np.sqrt(1.0 - WHITE_FRAC) * slow + np.sqrt(WHITE_FRAC) * rng.normal(size=(2, count)))


def streets(
    places_m: Mapping[int, tuple[float, float]],
    ways: Sequence[tuple[int, int]],
    *,
    oneways: Sequence[tuple[int, int]] = (),
    forbidden: Sequence[tuple[tuple[int, int], tuple[int, int]]] = (),
    height_m: Mapping[int, float] | None = None,
) -> RoadGraph:
    """A map of straight streets between places, metres east and north of 45° N 5° E; forbidden: pairs of links."""
    links = [pair for a, b in ways for pair in ((a, b), (b, a))] + list(oneways)
    number = {name: k for k, name in enumerate(places_m)}
    lat = np.array([45.0 + north / METRE_PER_DEGREE for _, north in places_m.values()])
    lon = np.array([5.0 + east / (METRE_PER_DEGREE * np.cos(np.radians(45.0))) for east, _ in places_m.values()])
    tail, head = (np.array([number[link[side]] for link in links], np.int32) for side in (0, 1))
    n = len(links)
    ends = np.column_stack((tail, head)).ravel()
    heights = np.array([(height_m or {}).get(name, 0.0) for name in places_m])
    return assemble_graph(
        GraphMeta("drawn", "test", "none", "none", Terrain.SYNTHETIC, "drawn", 0.0, (0.0, 0.0, 0.0, 0.0)),
        ("",),
        LooseNodes(lat, lon, heights, np.array(list(places_m))),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=great_circle_m(lat[tail], lon[tail], lat[head], lon[head]),
            speed_limit_mps=np.full(n, 50.0 / 3.6),
            functional_class=np.full(n, FunctionalClass.RESIDENTIAL, np.int8),
            cross=np.full(n, Cross.NONE, np.int8),
            urban=np.ones(n, bool),
            structure=np.zeros(n, bool),
            way_id=np.arange(n, dtype=np.int64),
            name_idx=np.zeros(n, np.int32),
            geometry_first=2 * np.arange(n + 1, dtype=np.int64),
            geometry_lon_e7=np.round(lon[ends] * 1e7).astype(np.int32),
            geometry_lat_e7=np.round(lat[ends] * 1e7).astype(np.int32),
            forbidden_turns=np.array([[links.index(a), links.index(b)] for a, b in forbidden], np.int64).reshape(-1, 2),
        ),
    )


def link_between(graph: RoadGraph, a: int, b: int) -> int:
    """The link from one drawn place to another."""
    tail, head = graph.node_id[graph.tail], graph.node_id[graph.head]
    return int(np.flatnonzero((tail == a) & (head == b))[0])


def whole(graph: RoadGraph, places: Sequence[int]) -> tuple[LinkSpan, ...]:
    """The whole links along drawn places."""
    links = [link_between(graph, a, b) for a, b in pairwise(places)]
    return tuple(LinkSpan(link, 0.0, float(graph.length_m[link])) for link in links)


def steady(graph: RoadGraph, spans: Sequence[LinkSpan], speed_mps: float = 10.0, **options: Any) -> MapDrive:
    """A drive over stretches of links at one speed, a sample a second."""
    way_m = np.arange(0.0, sum(span.to_m - span.from_m for span in spans), speed_mps)
    return drive_at(graph, spans, np.arange(way_m.size, dtype=np.float64), way_m, **options)
