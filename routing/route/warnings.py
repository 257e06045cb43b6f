"""What an answer is to be read with: the data it rests on, and where its search was not exact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import LinkModel, StopRule
from energy.units import JOULE_PER_KWH
from energy.vehicle.vehicle import Powertrain
from routing.graph.road_graph import Terrain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.graph.road_graph import GraphMeta, RoadGraph
    from routing.queries import RangeQuery, RouteQuery
    from routing.route.route import Route
    from routing.search.space import SearchSpace


def search_warnings(
    meta: GraphMeta, space: SearchSpace, query: RouteQuery | RangeQuery, crowded: bool, unpaid_j: float
) -> tuple[str, ...]:
    """Warnings of an answer on a graph: its terrain, the link model and rules, and what its search left unproven.

    crowded: dominance was relaxed on some link; unpaid_j: as of SearchCounts [J].
    """
    warnings = []
    if meta.terrain is Terrain.ABSENT:
        warnings.append(f"graph {meta.name!r} has no terrain: every road counts as flat, climbs are missing")
    elif meta.terrain is Terrain.SYNTHETIC:
        warnings.append(f"graph {meta.name!r} has synthetic terrain: it is no real place or not its real heights")
    if query.stop_rule is StopRule.COUNTED:
        warnings.append("stops 'counted' depend on the way so far: the search used 'expected', the figures 'counted'")
    if query.link_model is LinkModel.PRINTED:
        warnings.append("link model 'printed' does not conserve energy: label-correcting search")
    elif not space.conserving:
        load = f"{space.least_load_n:.1f} N"
        warnings.append(f"the road load falls to {load} under these conditions: label-correcting search")
    if query.vehicle.powertrain is Powertrain.ICE:
        warnings.append("combustion vehicle: energies are fuel energy, soc is the share of the tank")
    if crowded:
        warnings.append("very many short links: dominance was relaxed, a route some Wh better may exist")
    if unpaid_j > 0.0:
        warnings.append(
            "the battery fills up while cabin or tyres warm up: a better way, or one that just keeps the reserve, "
            f"could take at most {unpaid_j / JOULE_PER_KWH:.2g} kWh less"
        )
    return tuple(warnings)


def ferry_note(graph: RoadGraph) -> tuple[str, ...]:
    """What an answer without routes is to be read with on a graph that has ferries."""
    if graph.ferries is None:
        return ()
    return (f"graph {graph.meta.name!r} has ferries, and ways may go by them: {_ON_BOARD}",)


def ferry_warnings(graph: RoadGraph, routes: Sequence[Route]) -> tuple[str, ...]:
    """What is to be said of each route that goes by ferry: which, and for how long."""
    if graph.ferries is None:
        return ()
    warnings = []
    for route in routes:
        rides: list[tuple[str, float]] = []
        links = np.array(route.links.link_idx, np.int64)
        carried_s = graph.ferries.carried_s(links) if links.size else None
        if carried_s is None:
            continue
        before = False
        for name, seconds in zip(route.links.road_name, carried_s.tolist(), strict=True):
            if seconds > 0.0 and before and rides[-1][0] == name:
                rides[-1] = (name, rides[-1][1] + seconds)
            elif seconds > 0.0:
                rides.append((name, seconds))
            before = seconds > 0.0
        said = ", ".join(f"{repr(name) if name else 'without a name'} ({s / 60.0:.0f} min)" for name, s in rides)
        whole_min = sum(s for _, s in rides) / 60.0
        warnings.append(f"route {route.name!r} goes by ferry for {whole_min:.0f} min: {said}; {_ON_BOARD}")
    return tuple(warnings)


_ON_BOARD: Final = "on board nothing is taken from the battery, and waiting and timetables do not count"
