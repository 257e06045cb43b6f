"""Labels written and hashed before any tool runs, so that a label which was changed afterwards is seen."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from proof.worlds.world import WorldLabel

LABEL_FILE: Final = "label.json"
SEAL_FILE: Final = "seal.json"


class SealError(Exception):
    """A label that is not the one that was sealed: names the world and what is wrong with it."""

    def __init__(self, world_id: str, found: str, allowed: str) -> None:
        self.world_id = world_id
        self.found = found
        self.allowed = allowed
        super().__init__(f"label of world {world_id!r} is {found}, allowed: {allowed}")


def label_text(label: WorldLabel) -> str:
    """The label as the JSON text that is written and hashed: sorted keys, numbers in full."""
    return json.dumps(_plain(asdict(label)), indent=1, sort_keys=True, allow_nan=False) + "\n"


def seal(labels: Iterable[WorldLabel]) -> dict[str, str]:
    """SHA-256 of each label's text by world, as hexadecimal digits."""
    return {label.world_id: _digest(label_text(label)) for label in labels}


def write_labels(labels: Iterable[WorldLabel], folder: Path) -> dict[str, str]:
    """Write a label.json a world and seal.json over all of them into a folder of their own; returns the seal."""
    labels = tuple(labels)
    for label in labels:
        own = folder / label.world_id
        own.mkdir(parents=True, exist_ok=True)
        (own / LABEL_FILE).write_text(label_text(label), encoding="utf-8")
    sealed = seal(labels)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / SEAL_FILE).write_text(json.dumps(sealed, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    return sealed


def check_seal(folder: Path, sealed: Mapping[str, str]) -> None:
    """Raise SealError for the first label in the folder that is missing, changed or not sealed."""
    found = {path.parent.name: path for path in sorted(folder.glob(f"*/{LABEL_FILE}"))}
    for world_id in sorted(sealed):
        if world_id not in found:
            raise SealError(world_id, "missing", "there")
        digest = _digest(found[world_id].read_text(encoding="utf-8"))
        if digest != sealed[world_id]:
            raise SealError(world_id, f"changed (SHA-256 {digest})", f"the sealed one ({sealed[world_id]})")
    for world_id in sorted(set(found) - set(sealed)):
        raise SealError(world_id, "there but not sealed", "a label that the seal names")


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Mappings and sequences as json knows them."""
    if hasattr(value, "items"):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
