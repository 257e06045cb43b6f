"""The tool at one world: it is given a folder of recordings and a vehicle file, and nothing else."""

from __future__ import annotations

import hashlib
import time
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.engine import diagnose
from diagnosis.fit.selection import LEAST_TRIPS
from diagnosis.holdout import drawn_trips
from diagnosis.recordings.reading import read_recordings
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from proof.answers import Answer, answer_of, write_answer
from proof.errors import ProofError
from proof.rules import simpler_rules
from proof.source import OF_THE_TOOL, source_hash

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from diagnosis.recordings.reading import Recording

HOLDOUT_FRAC: Final = 0.3
VEHICLE: Final = "vehicle.toml"


def answered(world: Path, file: Path, rules: bool) -> str:
    """Let the tool answer the world of a folder into a file; returns the world's id, the folder's name.

    rules: whether simpler rules are asked as well. A tool that breaks has answered too: what broke is written down, so
    that it counts as a miss and the other worlds go on.
    """
    began = time.perf_counter()
    try:
        recordings, vehicle, held_out = read(world)
        diagnosis = diagnose(recordings, vehicle, held_out=held_out)
        seconds = time.perf_counter() - began
        enough = len(recordings) - len(held_out) >= LEAST_TRIPS
        others = simpler_rules(recordings, vehicle, held_out) if rules and enough else ()
        answer = answer_of(world.name, source_hash(OF_THE_TOOL), diagnosis, others, seconds)
    except Exception as error:
        broke = f"{type(error).__name__}: {error}"
        answer = Answer(world.name, source_hash(OF_THE_TOOL), "", error=broke, seconds=time.perf_counter() - began)
    write_answer(answer, file)
    return world.name


def read(world: Path) -> tuple[list[Recording], Vehicle, frozenset[str]]:
    """The recordings and the vehicle in a world's folder, and which trips are held out: drawn by the world's name."""
    vehicle = load_vehicle(world / VEHICLE)
    if not isinstance(vehicle, Vehicle):
        raise ProofError(f"{world / VEHICLE} is a consumption table, allowed: a vehicle that is given by its physics")
    recordings, errors = read_recordings([world])
    if errors:
        raise errors[0]
    return recordings, vehicle, held_out_of(recordings, seed_of(world.name))


def held_out_of(recordings: Sequence[Recording], seed: int) -> frozenset[str]:
    """HOLDOUT_FRAC of the trips, as warm and as cold as the others."""
    warmth = [
        None if recording.ambient_k is None else float(np.nanmean(recording.ambient_k)) for recording in recordings
    ]
    return drawn_trips([recording.id for recording in recordings], warmth, HOLDOUT_FRAC, seed)


def seed_of(name: str) -> int:
    """A seed from a name, 0..2³¹−1."""
    return int(hashlib.sha256(name.encode()).hexdigest()[:8], 16) % 2**31
