"""What drivers read along synthetic roads: their kinds, and which of them are ramps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from energy.stops import FunctionalClass
from routing.graph.signs import RoadSign, RoadSigns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.synth.links import RoadPieces


def road_signs(parts: Sequence[RoadPieces], piece: NDArray[np.int64]) -> RoadSigns:
    """Signs of links; piece: int64 (M,) the piece of each, counted through streets, roads and motorways in that order.

    A kind of road as OpenStreetMap has it, `motorway_link` of the ramps. There are no numbers, no destinations, no
    lanes and no roundabouts in a synthetic region.
    """
    street, road, motorway = parts
    ramp = (motorway.functional_class == FunctionalClass.TRUNK) & motorway.oneway
    is_ramp = np.concatenate((np.zeros(street.tail.size + road.tail.size, np.bool_), ramp))
    road_class = np.concatenate([part.functional_class for part in parts])
    kinds = [RoadSign(highway=kind.name.lower()) for kind in FunctionalClass]
    row = np.array([kind.value for kind in FunctionalClass])
    sign_of_class = np.zeros(int(row.max()) + 1, np.int32)
    sign_of_class[row] = np.arange(row.size)
    sign_idx = np.where(is_ramp, row.size, sign_of_class[road_class]).astype(np.int32)
    signs = (*kinds, RoadSign(highway="motorway_link"))
    return RoadSigns(sign_idx[piece], signs, np.empty(0, np.int32), ())
