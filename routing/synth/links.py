"""Two-way and oneway road pieces between nodes, before they become directed links."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from routing.synth.polylines import Polylines, offsets

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Nodes:
    """x_m, y_m: float64 (n,); ground_m: float64 (n,) height of the ground, or of the corridor a road follows."""

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    ground_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RoadPieces:
    """Road pieces, one row each; tail and head count in one common list of nodes.

    limit_kmh: int64; urban, oneway: bool; way: int64 road or street they belong to; shape: their polylines, whose
    ends are the nodes' own coordinates.
    """

    tail: NDArray[np.int64]
    head: NDArray[np.int64]
    functional_class: NDArray[np.int8]
    limit_kmh: NDArray[np.int64]
    urban: NDArray[np.bool_]
    oneway: NDArray[np.bool_]
    way: NDArray[np.int64]
    shape: Polylines


def joined_pieces(parts: Sequence[RoadPieces]) -> RoadPieces:
    """All pieces in one table."""
    columns = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts])
        for f in fields(RoadPieces)
        if f.name != "shape"
    }
    counts = np.concatenate([np.diff(part.shape.first) for part in parts])
    shape = Polylines(
        offsets(counts),
        np.concatenate([part.shape.x_m for part in parts]),
        np.concatenate([part.shape.y_m for part in parts]),
    )
    return RoadPieces(**columns, shape=shape)


def joined_nodes(parts: Sequence[Nodes]) -> Nodes:
    """All nodes in one table."""
    return Nodes(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Nodes)))
