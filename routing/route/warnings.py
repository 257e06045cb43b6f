"""What an answer is to be read with: the data it rests on, and where its search was not exact."""

from __future__ import annotations

from typing import TYPE_CHECKING

from energy.chain.chain import LinkModel, StopRule
from energy.units import JOULE_PER_KWH
from energy.vehicle.vehicle import Powertrain
from routing.graph.road_graph import Terrain

if TYPE_CHECKING:
    from routing.graph.road_graph import GraphMeta
    from routing.queries import RangeQuery, RouteQuery
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
