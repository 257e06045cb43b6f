"""Worlds and labels in a folder: made, sealed before the tool runs, opened after it has answered."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from proof.errors import BrokenSealError
from proof.plans import made
from proof.worlds.sealing import LABEL_FILE, SEAL_FILE, SealError, check_seal, label_text, write_labels
from proof.worlds.share import ShareError
from proof.worlds.world import EffectTruth, FaultTruth, OutsideTruth, WorldKind, WorldLabel, write_world

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from proof.plans import PlannedWorld

WORLDS: Final = "worlds"
LABELS: Final = "labels"
PLACE_FILE: Final = "place.txt"
SEEDS_FILE: Final = "seeds.json"
SEALED_FILE: Final = "sealed.json"


def make_into(place: PlannedWorld, folder: Path) -> str | None:
    """Make a world into folder/worlds and its label into folder/labels; returns the world's id.

    None where no drives could be drawn that carry what is ordered.
    """
    try:
        world, label = made(place)
    except ShareError:
        return None
    whole, part = folder / WORLDS / world.id, folder / WORLDS / f".{world.id}"
    shutil.rmtree(part, ignore_errors=True)
    write_world(world, part)
    shutil.rmtree(whole, ignore_errors=True)
    part.rename(whole)
    own = folder / LABELS / label.world_id
    own.mkdir(parents=True, exist_ok=True)
    (own / LABEL_FILE).write_text(label_text(label), encoding="utf-8")
    (own / PLACE_FILE).write_text(place.digest() + "\n", encoding="utf-8")
    return world.id


def made_before(folder: Path) -> dict[str, str]:
    """Ids of the worlds that are there with their labels, by the digest of what made them."""
    found = {}
    for file in sorted((folder / LABELS).glob(f"*/{PLACE_FILE}")):
        if (folder / WORLDS / file.parent.name).is_dir() and (file.parent / LABEL_FILE).is_file():
            found[file.read_text(encoding="utf-8").strip()] = file.parent.name
    return found


@dataclass(frozen=True, slots=True)
class Seal:
    """What was sealed: SHA-256 over labels and seeds, digest of the plan, ids of the worlds, orders left unmade."""

    sha256: str
    plan: str
    worlds: tuple[str, ...]
    unmade: int


def seal_all(seeds: Mapping[str, PlannedWorld], folder: Path, plan: str, unmade: int) -> Seal:
    """Seal the labels and seeds of worlds by id, and write the seal down."""
    labels = folder / LABELS
    for other in labels.glob(f"*/{LABEL_FILE}"):
        if other.parent.name not in seeds:
            shutil.rmtree(other.parent)
    write_labels((read_label(labels / world_id / LABEL_FILE) for world_id in sorted(seeds)), labels)
    seed_of = {world_id: [seeds[world_id].entropy, *seeds[world_id].key] for world_id in sorted(seeds)}
    (labels / SEEDS_FILE).write_text(json.dumps(seed_of, indent=1) + "\n", encoding="utf-8")
    seal = Seal(_digest(folder), plan, tuple(sorted(seeds)), unmade)
    (folder / SEALED_FILE).write_text(json.dumps(asdict(seal), indent=1) + "\n", encoding="utf-8")
    return seal


def read_seal(folder: Path) -> Seal | None:
    """What was sealed in a folder, None where nothing was."""
    file = folder / SEALED_FILE
    if not file.is_file():
        return None
    read: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return Seal(read["sha256"], read["plan"], tuple(read["worlds"]), read["unmade"])


def open_labels(folder: Path, digest: str) -> dict[str, WorldLabel]:
    """The labels by world, if they are the ones that were sealed; else raises BrokenSealError naming what is not."""
    labels = folder / LABELS
    try:
        found = _digest(folder)
        if found != digest:
            raise BrokenSealError(f"seal of {labels} is {found}, allowed: {digest}, as before the tool ran")
        check_seal(labels, json.loads((labels / SEAL_FILE).read_text(encoding="utf-8")))
    except SealError as error:
        raise BrokenSealError(str(error)) from error
    except FileNotFoundError as error:
        raise BrokenSealError(f"{error.filename} is missing, allowed: as sealed before the tool ran") from error
    return {path.parent.name: read_label(path) for path in sorted(labels.glob(f"*/{LABEL_FILE}"))}


def read_label(file: Path) -> WorldLabel:
    """A label as it was written."""
    read: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    read["kind"] = WorldKind(read["kind"])
    read["effects"] = {
        name: EffectTruth(**{**truth, "trips": tuple(truth["trips"])}) for name, truth in read["effects"].items()
    }
    read["outside"] = None if read["outside"] is None else OutsideTruth(**read["outside"])
    for name in ("families", "confounded_with", "separating_trips"):
        read[name] = tuple(read[name])
    if read["fault"] is not None:
        read["fault"] = FaultTruth(**{**read["fault"], "trips": tuple(read["fault"]["trips"])})
    return WorldLabel(**read)


def _digest(folder: Path) -> str:
    both = b"".join((folder / LABELS / name).read_bytes() for name in (SEAL_FILE, SEEDS_FILE))
    return hashlib.sha256(both).hexdigest()
