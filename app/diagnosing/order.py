"""A diagnosis from files of recordings to what it says, for the command line and the service alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from app.errors.diagnosing import RefusedFile, UnusableRecordingsError, storable
from diagnosis.errors import DiagnosisCancelled
from diagnosis.holdout import drawn_trips, named_trips
from diagnosis.recordings.files import UnpackedBytes
from diagnosis.recordings.reading import read_recordings

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from diagnosis.answer.results import Diagnosis
    from diagnosis.heights.sources import HeightSource
    from diagnosis.matching.matched_drives import MatchedDrives
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle

    Progress = Callable[[str, float], None]

READING: Final = "reading"
FILLING: Final = "filling in heights"
READING_SHARE: Final = 0.2  # of all the time, about
FILLING_SHARE: Final = 0.1  # of it, where heights may be filled in


@dataclass(frozen=True, slots=True)
class DiagnosisOrder:
    """What is to be diagnosed: files of recordings, the vehicle that drove them, and how they are used.

    hidden: patterns of columns that are dropped while reading. held_out: ids of trips, or patterns of ids, that are
    kept out of the fit; held_out_frac: and of all trips this share, drawn at random by the seed [-]. dem: elevation
    files, from which drives without height get theirs. unpacked_bytes: most that all files unpack to, None
    for no limit.
    """

    files: tuple[Path, ...]
    vehicle: Vehicle
    hidden: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()
    held_out_frac: float = 0.0
    seed: int = 1
    dem: tuple[Path, ...] = ()
    unpacked_bytes: int | None = None


@dataclass(frozen=True, slots=True)
class Diagnosed:
    """A diagnosis, the recordings that it rests on, and the files that could not be used."""

    diagnosis: Diagnosis
    recordings: tuple[Recording, ...]
    refused: tuple[RefusedFile, ...]


def carry_out(
    order: DiagnosisOrder,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    *,
    drives: MatchedDrives | None = None,
) -> Diagnosed:
    """Read the recordings, choose what is held out, and diagnose; a file that can't be used is left aside and named.

    progress: called with the name of a stage and the share of the whole that is done. drives: of the graph from which
    drives without height get theirs, where the order's elevation files do not have it. Raises UnusableRecordingsError
    where no file is left, ImportFailedError of an elevation file, HoldoutError, other DiagnosisErrors of the engine,
    and DiagnosisCancelled.
    """
    # these take a while to import, and only here they are needed
    from diagnosis.engine import DiagnosisSettings, diagnose
    from diagnosis.heights.filling import with_heights

    sources = _height_sources(order, drives)
    begun = READING_SHARE + (FILLING_SHARE if sources else 0.0)

    def file_read(done: int, count: int) -> None:
        if cancelled is not None and cancelled():
            raise DiagnosisCancelled(f"cancelled after {done} of {count} files were read")
        if progress is not None:
            progress(READING, READING_SHARE * done / count)

    def filled(done: float) -> None:
        if cancelled is not None and cancelled():
            raise DiagnosisCancelled("cancelled while heights were filled in")
        if progress is not None:
            progress(FILLING, READING_SHARE + FILLING_SHARE * done)

    def advanced(stage: str, done: float) -> None:
        if progress is not None:
            progress(stage, begun + (1.0 - begun) * done)

    together = None if order.unpacked_bytes is None else UnpackedBytes(order.unpacked_bytes)
    recordings, errors = read_recordings(order.files, order.hidden, file_read, together=together)
    refused = tuple(RefusedFile(storable(error.path), storable(str(error))) for error in errors)
    if not recordings:
        raise UnusableRecordingsError(refused)
    recordings = with_heights(recordings, sources, filled)
    diagnosis = diagnose(
        recordings,
        order.vehicle,
        held_out=held_out_trips(recordings, order),
        settings=DiagnosisSettings(seed=order.seed),
        progress=advanced,
        cancelled=cancelled,
    )
    return Diagnosed(diagnosis, tuple(recordings), refused)


def _height_sources(order: DiagnosisOrder, drives: MatchedDrives | None) -> list[HeightSource]:
    from diagnosis.heights.sources import ElevationFiles, GraphHeights

    found: list[HeightSource] = [ElevationFiles(order.dem)] if order.dem else []
    return found if drives is None else [*found, GraphHeights(drives)]


def held_out_trips(recordings: Sequence[Recording], order: DiagnosisOrder) -> frozenset[str]:
    """Ids of the trips that an order keeps out of the fit; raises HoldoutError."""
    trip_ids = [recording.id for recording in recordings]
    drawn = drawn_trips(
        trip_ids, [_mean_ambient_k(recording) for recording in recordings], order.held_out_frac, order.seed
    )
    return named_trips(trip_ids, order.held_out) | drawn


def _mean_ambient_k(recording: Recording) -> float | None:
    if recording.ambient_k is None or bool(np.isnan(recording.ambient_k).all()):
        return None
    return float(np.nanmean(recording.ambient_k))
