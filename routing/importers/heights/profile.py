"""Road profiles: heights smoothed along the road, carried over bridges and tunnels, with limited grades."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import splu

from energy.stops import FunctionalClass

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.importers.chains import Chains

PASSES: Final = 4  # of the exponential kernel, so that the whole is close to a Gaussian
_TINY_MASS_M: Final = 1e-6  # keeps a road that is a bridge from end to end solvable
_SHORTEST_STEP_M: Final = 0.05
_LEVEL_M: Final = 1e-6

# Steepest grade by functional class. AASHTO's Green Book permits about 6 % on freeways and 8 % on rural arterials in
# mountains; motorways and trunk roads get 1 to 2 points more. The rest is assumed: mountain roads seldom exceed 15 %,
# the steepest residential streets lie at 20 to 35 %, of which an elevation model of 30 to 90 m sees the mean only.
STEEPEST_GRADE: Final = {
    FunctionalClass.MOTORWAY: 0.07,
    FunctionalClass.TRUNK: 0.10,
    FunctionalClass.PRIMARY: 0.12,
    FunctionalClass.SECONDARY: 0.14,
    FunctionalClass.TERTIARY: 0.16,
    FunctionalClass.UNCLASSIFIED: 0.20,
    FunctionalClass.RESIDENTIAL: 0.20,
    FunctionalClass.SERVICE: 0.20,
}


def smooth_along_roads(
    chains: Chains, structure: NDArray[np.bool_], height_m: NDArray[np.float64], smoothing_m: float
) -> NDArray[np.float64]:
    """Heights of points smoothed along the road network, float64 (P,) [m], one height a point, junctions included.

    Each of PASSES passes minimises sum m·(h - h_before)² + λ·sum (h_i - h_j)²/d over points of mass m (half the length
    of the roads at them) and steps of length d: diffusion along the road. On a long road the kernel has the variance
    PASSES·2λ, set to smoothing_m²/12, that of a moving average over smoothing_m. Points inside bridges and tunnels
    have no mass, which makes their heights run straight between the ends, and harmonic where structures branch.
    structure: bool (W,) by way. A sparse factorisation, near to O(P) on road networks.
    """
    here, there, step_m = _edges(chains)
    on_structure = structure[chains.way[chains.steps()]]
    ground_m = np.where(on_structure, 0.0, step_m) / 2.0
    size = chains.point_count
    mass = np.bincount(here, ground_m, size) + np.bincount(there, ground_m, size) + _TINY_MASS_M
    variance_m2 = max(smoothing_m, 1.0) ** 2 / 12.0  # at 1 m: interpolates the structures and nothing else
    matrix = diags_array(mass) + _laplacian(here, there, 1.0 / step_m, size) * (variance_m2 / (2.0 * PASSES))
    factor = splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    middle = float(height_m.mean())  # solving for the difference keeps digits
    smoothed = height_m - middle
    for _ in range(PASSES):
        smoothed = factor.solve(mass * smoothed)
    return smoothed + middle


def limit_grades(
    chains: Chains,
    functional_class: NDArray[np.int8],
    height_m: NDArray[np.float64],
    level: NDArray[np.bool_] | None = None,
) -> NDArray[np.float64]:
    """Heights of points with no step steeper than its road class allows, float64 (P,) [m].

    With c(x, y) the climb that the limits allow between two points, min over y of h(y) + c is the highest permitted
    profile below h, and max over y of h(y) - c the lowest above it (McShane, Bull. AMS 40, 1934,
    doi:10.1090/S0002-9904-1934-05978-0). Their mean is permitted too, since permitted profiles form a convex set; two
    more envelopes bring it back towards h wherever the limits leave room. Equals h where h obeys the limits together
    with its surroundings. Four shortest-path runs, O(P log P).
    functional_class: int8 (W,) by way. level: bool (W,) ways that are level, to a millionth of a metre a step.
    """
    here, there, step_m = _edges(chains)
    way = chains.way[chains.steps()]
    allowed = np.array([STEEPEST_GRADE[c] for c in FunctionalClass])[functional_class[way]]
    climb_m = allowed * step_m
    if level is not None:
        climb_m[level[way]] = _LEVEL_M  # a stored zero would be no edge

    def below(profile_m: NDArray[np.float64]) -> NDArray[np.float64]:
        return _highest_below(here, there, climb_m, profile_m)

    mean_m = (below(height_m) - below(-height_m)) / 2.0
    raised_m = below(np.maximum(height_m, mean_m))  # at least the mean, at most h where h is above the mean
    return -below(-np.minimum(height_m, raised_m))  # at most raised_m, at least h where h is below it


def _highest_below(
    here: NDArray[np.int64], there: NDArray[np.int64], climb_m: NDArray[np.float64], height_m: NDArray[np.float64]
) -> NDArray[np.float64]:
    size = height_m.size
    base = float(height_m.min()) - 1.0  # a stored zero would be no edge
    order = np.lexsort((climb_m, np.maximum(here, there), np.minimum(here, there)))
    low, high = np.minimum(here, there)[order], np.maximum(here, there)[order]
    first = np.ones(order.size, np.bool_)
    first[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    low, high, climb = low[first], high[first], climb_m[order][first]  # of parallel steps the shortest
    points = np.arange(size)
    source = np.full(size, size)
    graph = csr_array(
        coo_array(
            (
                np.concatenate((climb, climb, height_m - base)),
                (np.concatenate((low, high, source)), np.concatenate((high, low, points))),
            ),
            shape=(size + 1, size + 1),
        )
    )
    reached: NDArray[np.float64] = dijkstra(graph, directed=True, indices=np.array([size]))[0, :size]
    return reached + base


def _edges(chains: Chains) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    steps = chains.steps()
    here, there = chains.point[steps], chains.point[steps + 1]
    return here, there, np.maximum(chains.step_m[steps], _SHORTEST_STEP_M)


def _laplacian(here: NDArray[np.int64], there: NDArray[np.int64], weight: NDArray[np.float64], size: int) -> csr_array:
    rows = np.concatenate((here, there, here, there))
    columns = np.concatenate((there, here, here, there))
    values = np.concatenate((-weight, -weight, weight, weight))
    return csr_array(coo_array((values, (rows, columns)), shape=(size, size)))
