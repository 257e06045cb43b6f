"""The ground that is written beside a graph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from routing.ground.files import GROUND_FILE, ground_bytes
from routing.ground.levels import ground_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from routing.graph.road_graph import RoadGraph
    from routing.ground.features import RawGround


@dataclass(frozen=True, slots=True)
class GroundBeside:
    """The ground as files by name, none where there is none; shapes by layer, and what was left out, by reason."""

    files: Mapping[str, bytes]
    counts: Mapping[str, int]
    left_out: Mapping[str, int]

    @property
    def size_bytes(self) -> int:
        """Of the file."""
        return sum(map(len, self.files.values()))


def ground_beside(graph: RoadGraph, raw: RawGround) -> GroundBeside:
    """The ground around a graph's roads."""
    ground = ground_of(raw, graph.meta.bbox)
    counts = ground.counts()
    files = {GROUND_FILE: ground_bytes(ground, f"{graph.meta.attribution}, {graph.meta.licence}")} if counts else {}
    return GroundBeside(files, counts, ground.left_out)
