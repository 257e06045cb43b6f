"""Recorded positions matched to the links of a road graph (docs/matching.md)."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from diagnosis.errors import DiagnosisError
from diagnosis.matching import kernels_viterbi as kernels
from diagnosis.matching.kernels_viterbi import Frontier, RoadArrays
from diagnosis.matching.likeliest_way import MatchSettings, TrackMatcher
from diagnosis.matching.matched_way import Gap, GapReason, PlacedWay, Stretch, place_samples
from diagnosis.matching.tracks import NoPositionsError, Track, positions_deg, track_of
from routing.graph.earth import E7, METRE_PER_DEGREE
from routing.graph.link_bans import whole_successors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.recordings.reading import Recording
    from routing.graph.road_graph import RoadGraph

__all__ = ["Gap", "GapReason", "MapMatcher", "Match", "MatchSettings", "NoPositionsError", "OutsideMapError", "Stretch"]


class OutsideMapError(DiagnosisError):
    """A recording that was driven elsewhere; bbox and map_bbox: west, south, east, north [deg]."""

    def __init__(
        self,
        recording_id: str,
        bbox: tuple[float, float, float, float],
        graph_name: str,
        map_bbox: tuple[float, float, float, float],
    ) -> None:
        self.recording_id = recording_id
        self.bbox = bbox
        self.graph_name = graph_name
        self.map_bbox = map_bbox
        here, there = (f"lat {s:.5f}..{n:.5f}, lon {w:.5f}..{e:.5f}" for w, s, e, n in (bbox, map_bbox))
        super().__init__(
            f"recording {recording_id!r}: positions are at {here}, allowed: within graph {graph_name!r}, {there}"
        )


@dataclass(frozen=True, slots=True)
class Match:
    """Where a recording of n samples was driven.

    link: int64 (n,) directed link of each sample, −1 where none. position_m: float64 (n,) from the link's beginning,
    NaN where none. offset_m: float64 (n,) from the recorded position to the link, NaN where either is missing.
    matched_frac: share of the driven way on links. mean_offset_m: mean of offset_m. position_sd_m: of the positions
    across the road, the likeliest of those tried.
    """

    recording_id: str
    link: NDArray[np.int64]
    position_m: NDArray[np.float64]
    offset_m: NDArray[np.float64]
    stretches: tuple[Stretch, ...]
    gaps: tuple[Gap, ...]
    matched_frac: float
    mean_offset_m: float
    position_sd_m: float


class MapMatcher:
    """Matches recordings to one frozen graph; safe to share between threads, its index is built once."""

    def __init__(self, graph: RoadGraph, settings: MatchSettings | None = None) -> None:
        self.graph = graph
        self.settings = settings or MatchSettings()
        first, successor = whole_successors(graph)
        self._roads = RoadArrays(
            graph.length_m,
            first,
            successor,
            graph.geometry_first,
            graph.geometry_lon_e7,
            graph.geometry_lat_e7,
        )
        begin = graph.geometry_first[:-1]
        west, south, east, north = (
            of.reduceat(values, begin) / E7
            for of in (np.minimum, np.maximum)
            for values in (graph.geometry_lon_e7, graph.geometry_lat_e7)
        )
        boxes = shapely.box(west, south, east, north)
        boxes[graph.is_ferry() | graph.is_copy()] = shapely.Point()  # nobody drives there
        self._tree = shapely.STRtree(list(boxes))
        self._tree.query(shapely.Point(0.0, 0.0))  # it is built at the first question
        self._frontiers: list[Frontier] = []
        self._lock = threading.Lock()

    def match(self, recording: Recording) -> Match:
        """The likeliest way of a recording over the graph, with what could not be matched.

        The way driven between samples is ∫v dt. Samples without a position, or with the same one as before, are placed
        by it. Raises NoPositionsError, and OutsideMapError where no position lies within the graph's bounds.
        """
        track = track_of(recording, self.settings.step_m, self.settings.pause_s)
        self._check_area(recording)
        frontier = self._frontier()
        try:
            limit_mps = self.graph.speed_limit_mps
            way = TrackMatcher(self._roads, limit_mps, self._tree, frontier, track, self.settings).best()
        finally:
            with self._lock:
                self._frontiers.append(frontier)
        placed = place_samples(recording, track, way.runs, self.graph.length_m)
        offset_m = self._offset_m(recording, track, placed)
        driven_m = sum(float(track.odometer_m[part.last] - track.odometer_m[part.first]) for part in placed.stretches)
        whole_m = float(track.odometer_m[-1])
        return Match(
            recording_id=recording.id,
            link=placed.link,
            position_m=placed.position_m,
            offset_m=offset_m,
            stretches=placed.stretches,
            gaps=placed.gaps,
            matched_frac=driven_m / whole_m if whole_m > 0.0 else 0.0,
            mean_offset_m=float(np.nanmean(offset_m)) if placed.stretches else math.nan,
            position_sd_m=way.position_sd_m,
        )

    def _frontier(self) -> Frontier:
        with self._lock:
            if self._frontiers:
                return self._frontiers.pop()
        links, transitions = self.graph.link_count, self._roads.successor.size
        return Frontier(
            entry_m=np.empty(links),
            parent=np.empty(links, np.int32),
            epoch=np.zeros(links, np.int64),
            settled=np.zeros(links, np.int64),
            heap_m=np.empty(transitions + 1),
            heap_link=np.empty(transitions + 1, np.int32),
            counter=np.zeros(2, np.int64),
        )

    def _check_area(self, recording: Recording) -> None:
        lat, lon, fix = positions_deg(recording)
        lat, lon = lat[fix], lon[fix]
        west, south, east, north = bbox = self.graph.meta.bbox
        if not ((lat >= south) & (lat <= north) & (lon >= west) & (lon <= east)).any():
            here = (float(lon.min()), float(lat.min()), float(lon.max()), float(lat.max()))
            raise OutsideMapError(recording.id, here, self.graph.meta.name, bbox)

    def _offset_m(self, recording: Recording, track: Track, placed: PlacedWay) -> NDArray[np.float64]:
        """Distance of each recorded position from its link, float64 (n,) [m], NaN where either is missing."""
        lat, lon, _ = positions_deg(recording)
        fix = track.fix[placed.link[track.fix] >= 0]
        distance, position, heading = (np.empty(fix.size) for _ in range(3))
        kernels.project(
            self._roads, METRE_PER_DEGREE, lat[fix], lon[fix], placed.link[fix], position, distance, heading
        )
        offset = np.full(recording.time_s.size, np.nan)
        offset[fix] = distance
        return offset
