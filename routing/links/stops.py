"""How likely links of a graph end in a stop, and for how long."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from energy.chain.chain import StopRule
from energy.chain.kernels_chain import MEDIUM
from energy.stops import FunctionalClass
from routing.graph.road_graph import ALL_LINKS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from energy.stops import StopSettings
    from routing.graph.road_graph import RoadGraph, SomeLinks


def link_stops(
    graph: RoadGraph,
    settings: StopSettings,
    rule: StopRule = StopRule.EXPECTED,
    links: SomeLinks = ALL_LINKS,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stop probability and stop time [s] at the end of links, float64 (k,); motorways and ferries have none (eq. 28).

    The rule `counted` depends on the way so far and has no probability of its own: that of `expected` is its target.
    """
    urban = graph.urban[links].astype(np.intp)
    motorway = graph.functional_class[links] == FunctionalClass.MOTORWAY
    cross = np.where(motorway, 0, graph.cross[links]).astype(np.intp)
    if graph.ferries is not None:
        carried_s = graph.ferries.carried_s(np.arange(graph.link_count)[links] if isinstance(links, slice) else links)
        cross = cross if carried_s is None else np.where(carried_s > 0.0, 0, cross)
    probability, wait = settings.probability_frac[urban, cross], settings.time_s[urban, cross]
    if rule is StopRule.NONE:
        return np.zeros_like(probability), np.zeros_like(wait)
    if rule is StopRule.CROSSINGS:
        return np.where((probability > 0.0) & (cross >= MEDIUM), 1.0, 0.0), wait
    return probability, wait
