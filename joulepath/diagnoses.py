"""What a vehicle's model leaves out, found in recorded drives."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnosis.errors import DiagnosisError
from diagnosis.holdout import drawn_trips, named_trips
from diagnosis.recordings.reading import read_recordings
from energy.vehicle.vehicle import Vehicle as PhysicalVehicle
from joulepath.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from diagnosis.answer.results import Diagnosis as DiagnosisResult
    from diagnosis.answer.results import Finding
    from diagnosis.heights.sources import HeightSource
    from diagnosis.recordings.recording import Recording
    from joulepath.graph import Graph


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """What recorded drives say of a vehicle's model; result: all of it (diagnosis.answer.results).

    refused: what is wrong with recordings that could not be read.
    """

    result: DiagnosisResult
    refused: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """What the drives say as a whole, such as "left_out_physics"."""
        return self.result.verdict.value

    @property
    def text(self) -> str:
        """The conclusions in words."""
        return self.result.text

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Effects that the model left out and the drives speak for."""
        return self.result.findings

    def learned_vehicle(self, vehicle: Vehicle) -> Vehicle:
        """A vehicle with what was learned, for routes and ranges; raises VehicleError or ConditionsError."""
        from diagnosis.answer.learned import learned_vehicle

        return Vehicle(learned_vehicle(_physical(vehicle), self.result))

    def as_json(self) -> dict[str, Any]:
        """The object of diagnosis.json (docs/diagnosis.md)."""
        from diagnosis.answer.results_json import as_json

        found: dict[str, Any] = json.loads(json.dumps(as_json(self.result)))
        return found

    def report_html(self) -> str:
        """The report as a page."""
        from diagnosis.report.page import report_html  # brings the plots along, which take a while to import

        return report_html(self.result)


def diagnose(
    recordings: Iterable[Path | str],
    vehicle: Vehicle,
    *,
    hidden_columns: Sequence[str] = (),
    held_out: Sequence[str] = (),
    held_out_frac: float = 0.0,
    seed: int = 1,
    dem: Sequence[Path | str] = (),
    graph: Graph | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """What recordings say that the vehicle's model leaves out; files, folders or patterns (docs/recordings.md).

    hidden_columns: patterns of columns that are dropped while reading. held_out: ids of trips, or patterns of them,
    that are kept out of the fit; held_out_frac: and of all trips this share, drawn by the seed. dem: elevation files
    (GeoTIFF, .hgt, .hgt.zip), and graph: whose links the drives are matched to; of the first of them that knows it,
    drives with positions and without height get their height. progress: called with the name of a stage and the share
    of it that is done.

    Raises DiagnosisError where no recording can be used, or where the vehicle is a consumption table, and RoutingError
    where an elevation file can't be read.
    """
    from diagnosis.engine import DiagnosisSettings  # takes a while to import
    from diagnosis.engine import diagnose as diagnose_recordings
    from diagnosis.heights.filling import with_heights

    def filled(done: float) -> None:
        if progress is not None:
            progress("filling in heights", done)

    driven = _physical(vehicle)
    sources = _height_sources(dem, graph)
    found, errors = read_recordings(recordings, hidden_columns)
    if not found:
        raise DiagnosisError("; ".join(map(str, errors)) or "no recordings")
    found = with_heights(found, sources, filled)
    trip_ids = [recording.id for recording in found]
    drawn = drawn_trips(trip_ids, [_mean_ambient_k(recording) for recording in found], held_out_frac, seed)
    result = diagnose_recordings(
        found,
        driven,
        held_out=named_trips(trip_ids, held_out) | drawn,
        settings=DiagnosisSettings(seed=seed),
        progress=progress,
    )
    return Diagnosis(result, tuple(map(str, errors)))


def _height_sources(dem: Sequence[Path | str], graph: Graph | None) -> list[HeightSource]:
    from diagnosis.heights.sources import ElevationFiles, GraphHeights
    from diagnosis.matching.matched_drives import MatchedDrives

    found: list[HeightSource] = [ElevationFiles(tuple(map(Path, dem)))] if dem else []
    return found if graph is None else [*found, GraphHeights(MatchedDrives(graph.planner.graph))]


def _physical(vehicle: Vehicle) -> PhysicalVehicle:
    if not isinstance(vehicle.model, PhysicalVehicle):
        raise DiagnosisError(f"vehicle is {vehicle.id!r}, a consumption table, allowed: one given by its physics")
    return vehicle.model


def _mean_ambient_k(recording: Recording) -> float | None:
    if recording.ambient_k is None or bool(np.isnan(recording.ambient_k).all()):
        return None
    return float(np.nanmean(recording.ambient_k))
