"""Where heights come from: elevation files, and the heights of a graph along the links that were driven."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np
from scipy.ndimage import maximum_filter1d

from diagnosis.errors import DiagnosisError
from diagnosis.heights.drivable import drivable, steepest_grade
from diagnosis.heights.way import SectionHeights, places_along, sample_heights, sections
from diagnosis.matching.tracks import NoPositionsError
from energy.replay.replay import SMOOTHING_M, smoothed_height_m
from routing.errors import ImportFailedError
from routing.graph.road_graph import Terrain
from routing.importers.heights.elevation import tiles_at

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from diagnosis.heights.way import Places, SampleHeights, Section
    from diagnosis.matching.matched_drives import MatchedDrives
    from diagnosis.recordings.recording import Recording

    Progress = Callable[[float], None]

SPEED_PLACES: Final = 17  # places around one of which the fastest tells the kind of road, 250 m to each side


@dataclass(frozen=True, slots=True)
class LookedUp:
    """Heights of a drive, None where none was found; how they were made, and why none was looked up, in words."""

    heights: SampleHeights | None
    how: str = ""
    why_not: str = ""


class HeightSource(Protocol):
    """What tells the heights of drives by their positions."""

    @property
    def name(self) -> str:
        """What it is called."""

    def look_up(self, recordings: Sequence[Recording], progress: Progress) -> list[LookedUp]:
        """The heights of each recording; progress is called with the share that is done."""


@dataclass(frozen=True, slots=True)
class ElevationFiles:
    """GeoTIFF, .hgt and .hgt.zip files; where they overlap the first one named wins.

    Raises ImportFailedError where one is not there.
    """

    paths: tuple[Path, ...]

    def __post_init__(self) -> None:
        for path in self.paths:
            if not path.is_file():
                raise ImportFailedError("dem", path, "no such file")

    @property
    def name(self) -> str:
        """The files' names."""
        return ", ".join(path.name for path in self.paths)

    def look_up(self, recordings: Sequence[Recording], progress: Progress) -> list[LookedUp]:
        """Bilinear heights of the recordings' positions, smoothed along the way; raises ImportFailedError of a file.

        The length is that over which replays smooth recorded heights once more; both together smooth as much as the
        import of maps does. Straight lines stand where no road can follow the ground. Files are read one after the
        other, so that one at a time is in memory.
        """
        drives = [_placed(recording) for recording in recordings]
        places = [place for drive in drives if isinstance(drive, list) for _, place in drive]
        if not places:
            return [LookedUp(None, why_not=str(drive)) for drive in drives]
        height_m, cell_m = self._sampled(
            np.concatenate([place.lat_deg for place in places]),
            np.concatenate([place.lon_deg for place in places]),
            progress,
        )
        found = []
        begin = 0
        for recording, drive in zip(recordings, drives, strict=True):
            if isinstance(drive, str):
                found.append(LookedUp(None, why_not=drive))
                continue
            first, known = begin, []
            for section, place in drive:
                end = begin + place.place_m.size
                known.append(_on_road(recording, section, place.place_m, height_m[begin:end]))
                begin = end
            widest_m = float(np.nanmax(cell_m[first:begin], initial=0.0))
            how = f"cells of {widest_m:.0f} m, smoothed over {SMOOTHING_M:g} m of way"
            found.append(LookedUp(sample_heights(known, SMOOTHING_M), how))
        return found

    def _sampled(
        self, lat: NDArray[np.float64], lon: NDArray[np.float64], progress: Progress
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Height and width of the cell at places, float64 (k,) each [m], NaN where no file has a height of its own."""
        height_m, cell_m = np.full(lat.size, np.nan), np.full(lat.size, np.nan)
        for done, path in enumerate(self.paths, start=1):
            missing = np.flatnonzero(np.isnan(height_m))
            for tile, at in tiles_at(path, lon[missing], lat[missing])[1]:
                within = missing[at]
                here = within[tile.measured(lon[within], lat[within])]
                height_m[here], cell_m[here] = tile.sample(lon[here], lat[here]), tile.cell_m
            progress(done / len(self.paths))
        return height_m, cell_m


@dataclass(frozen=True, slots=True)
class GraphHeights:
    """The heights of a graph along the links that drives were matched to."""

    drives: MatchedDrives

    @property
    def name(self) -> str:
        """The graph's name."""
        return f"graph {self.drives.graph.meta.name}"

    def look_up(self, recordings: Sequence[Recording], progress: Progress) -> list[LookedUp]:
        """Heights of nodes, straight along each link; bridges and tunnels are as the graph has them."""
        if self.drives.graph.meta.terrain is Terrain.ABSENT:
            return [LookedUp(None, why_not="it has no heights")] * len(recordings)
        found = []
        for done, recording in enumerate(recordings, start=1):
            found.append(self._looked_up(recording))
            progress(done / len(recordings))
        return found

    def _looked_up(self, recording: Recording) -> LookedUp:
        graph = self.drives.graph
        try:
            match = self.drives.match(recording)
        except DiagnosisError as error:
            return LookedUp(None, why_not=str(error))
        height_m = np.full(recording.time_s.size, np.nan)
        placed = match.link >= 0
        link = match.link[placed]
        share = match.position_m[placed] / graph.length_m[link]
        height_m[placed] = graph.node_height_m[graph.tail[link]] + share * graph.climb_m(link)
        known = []
        for section in sections(recording):
            place_m, index = np.unique(section.way_m, return_index=True)
            on_road = np.zeros(index.size, np.bool_)
            known.append(SectionHeights(section, place_m, height_m[section.samples][index], on_road))
        smoothing_m = graph.meta.smoothing_m
        how = f"smoothed over {smoothing_m:g} m of road" if smoothing_m > 0.0 else "straight between its nodes"
        return LookedUp(sample_heights(known, 0.0), how)


def _on_road(
    recording: Recording, section: Section, place_m: NDArray[np.float64], height_m: NDArray[np.float64]
) -> SectionHeights:
    """Heights of the ground along a section, marked where no road driven so fast can follow it."""
    off_road = np.zeros(place_m.size, np.bool_)
    known = np.flatnonzero(~np.isnan(height_m))
    if known.size > 2:
        at_m = place_m[known]
        speed = np.interp(at_m, section.way_m, recording.speed_mps[section.samples])
        grade = steepest_grade(maximum_filter1d(speed, SPEED_PLACES))
        climb_m = np.concatenate(([0.0], np.cumsum(0.5 * (grade[1:] + grade[:-1]) * np.diff(at_m))))
        off_road[known] = ~drivable(smoothed_height_m(at_m, height_m[known]), climb_m)
    return SectionHeights(section, place_m, height_m, off_road)


def _placed(recording: Recording) -> list[tuple[Section, Places]] | str:
    """Sections of a recording with their places, or why it has none."""
    parts = sections(recording)
    try:
        return list(zip(parts, places_along(recording, parts), strict=True))
    except NoPositionsError as error:
        return f"{error.channel} is {error.found}"
