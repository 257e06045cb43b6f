"""The ground of a map as it was read, and as it is kept: shapes by layer, class and the zoom levels that show them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from routing.ground.kinds import Layer


@dataclass(slots=True)
class RawGround:
    """What was read: shapes by layer and class in degrees (lon, lat), each as well-known binary in hexadecimal.

    Areas may be given by their rims as lines.

    coast: lines with land on their left. left_out: counts by reason.
    """

    layers: list[Layer] = field(default_factory=list)
    classes: list[str] = field(default_factory=list)
    names: list[Mapping[str, str]] = field(default_factory=list)
    ranks: list[int] = field(default_factory=list)
    shapes: list[str] = field(default_factory=list)
    coast: list[str] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)

    def add(self, kind: tuple[Layer, str], names: Mapping[str, str], shape: str, rank: int = 0) -> None:
        """Take a shape."""
        self.layers.append(kind[0])
        self.classes.append(kind[1])
        self.names.append(names)
        self.ranks.append(rank)
        self.shapes.append(shape)

    def leave_out(self, reason: str, count: int = 1) -> None:
        """Count what is not kept."""
        if count:
            self.left_out[reason] += count


@dataclass(frozen=True, slots=True)
class LayerShapes:
    """Shapes of one layer, all arrays of the same length.

    first_zoom, last_zoom: between which a shape is drawn, both included. shape: shapely geometries in degrees.
    names: by language, "" for the local one.
    """

    shape: NDArray[np.object_]
    kind: list[str]
    names: list[Mapping[str, str]]
    rank: NDArray[np.int64]
    first_zoom: NDArray[np.int64]
    last_zoom: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Ground:
    """The ground of a graph by layer, and what was left out, by reason."""

    layers: Mapping[Layer, LayerShapes]
    left_out: Mapping[str, int]

    def counts(self) -> dict[str, int]:
        """How many shapes each layer has, over all zoom levels."""
        return {str(layer): len(shapes.kind) for layer, shapes in self.layers.items() if shapes.kind}
