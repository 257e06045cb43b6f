"""Node heights of synthetic roads: the ground, cut and filled until no road is steeper than its class allows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from energy.stops import FunctionalClass

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Steepest grade of a link by class: assumed, after common design practice for mountain roads.
GRADE_LIMIT: Final = np.zeros(len(FunctionalClass))
GRADE_LIMIT[FunctionalClass.MOTORWAY] = 0.06
GRADE_LIMIT[FunctionalClass.TRUNK] = 0.08
GRADE_LIMIT[FunctionalClass.PRIMARY] = 0.10
GRADE_LIMIT[FunctionalClass.SECONDARY] = 0.11
GRADE_LIMIT[FunctionalClass.TERTIARY] = 0.12
GRADE_LIMIT[FunctionalClass.UNCLASSIFIED] = 0.14
GRADE_LIMIT[FunctionalClass.RESIDENTIAL] = 0.15
GRADE_LIMIT[FunctionalClass.SERVICE] = 0.18
GRADE_LIMIT.flags.writeable = False
CUT_SHARE: Final = 0.75  # between cutting only (1) and filling only (0)


def graded_heights_m(
    ground_m: NDArray[np.float64],
    tail: NDArray[np.int64],
    head: NDArray[np.int64],
    length_m: NDArray[np.float64],
    limit: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Node heights near the ground with |Δh| ≤ limit · length on every link, float64 (N,) [m].

    A mix of the highest such surface below the ground and the lowest above it; any mix keeps the limits. Both are
    shortest-path distances from an extra node that every node is joined to at the price of its height.
    O(M log N).
    """
    count = ground_m.size
    rise = length_m * limit * (1.0 - 1e-9)
    base, top = float(ground_m.min()) - 1.0, float(ground_m.max()) + 1.0
    row = np.concatenate((tail, head, np.full(count, count)))
    col = np.concatenate((head, tail, np.arange(count)))
    order = np.lexsort((np.concatenate((rise, rise, np.zeros(count))), col, row))
    row, col = row[order], col[order]
    first = np.ones(row.size, bool)  # of parallel links the shortest binds
    first[1:] = (np.diff(row) != 0) | (np.diff(col) != 0)
    surfaces = []
    for price in (ground_m - base, top - ground_m):
        data = np.concatenate((rise, rise, price))[order]
        matrix = csr_array((data[first], (row[first], col[first])), shape=(count + 1, count + 1))
        surfaces.append(dijkstra(matrix, indices=[count])[0, :count])
    heights: NDArray[np.float64] = CUT_SHARE * (surfaces[0] + base) + (1.0 - CUT_SHARE) * (top - surfaces[1])
    return heights
