"""Who stops at the junctions of a synthetic region: signals, give-way signs, priority to the right."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from energy.stops import Cross, FunctionalClass

if TYPE_CHECKING:
    from numpy.typing import NDArray


def stop_levels(
    node_count: int,
    head: NDArray[np.int64],
    functional_class: NDArray[np.int8],
    urban: NDArray[np.bool_],
    node_of_end: NDArray[np.int64],
    class_of_end: NDArray[np.int8],
) -> NDArray[np.int8]:
    """Cross level at the end of each directed link, int8 (M,).

    node_of_end, class_of_end: node and class of every end of every piece, which makes up the arms of a junction.
    Signals (large) where two roads of at least tertiary class cross in a town; medium where a road meets one that is
    more important by two classes or more, small by one; small where equal streets meet in a town; none on motorways.
    """
    arms = np.bincount(node_of_end, minlength=node_count)
    best = np.full(node_count, 99, np.int64)
    np.minimum.at(best, node_of_end, class_of_end.astype(np.int64))
    main_arms = np.bincount(node_of_end[class_of_end <= FunctionalClass.TERTIARY], minlength=node_count)
    in_town = np.zeros(node_count, bool)
    in_town[head[urban]] = True
    yields = functional_class - best[head]
    levels = np.full(head.size, Cross.NONE, np.int8)
    junction = arms[head] >= 3
    levels[junction & urban & (functional_class >= FunctionalClass.RESIDENTIAL)] = Cross.SMALL
    levels[junction & (yields == 1)] = Cross.SMALL
    levels[junction & (yields >= 2)] = Cross.MEDIUM
    signals = in_town & (main_arms >= 4)
    levels[signals[head]] = Cross.LARGE
    levels[functional_class == FunctionalClass.MOTORWAY] = Cross.NONE
    return levels
