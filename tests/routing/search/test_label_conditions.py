"""What the labels of a finished search prove by themselves: no transition improves any of them, and costs add up."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from energy.chain.chain import LinkModel, StopRule
from energy.chain.kernels_link import link_energy
from energy.conditions import STILL, Conditions
from energy.force.kernels_physics import accepted_j, cabin_energy_j, road_in_time
from energy.stops import StopSettings
from energy.vehicle.files import load_vehicles
from energy.vehicle.vehicle import Vehicle
from routing.dominance.kernels_dominates import climate_debt_j, dominates_by
from routing.dominance.kernels_rules import NOISE_COST, SearchRules
from routing.dominance.kernels_slack import Entry, LinkAhead, slack_of
from routing.graph.road_graph import RoadGraph
from routing.importers.region import DEFAULT_SMOOTHING_M, import_region
from routing.links.kernels_tables import borrowed_links
from routing.places import LinkPosition
from routing.search import found, kernels_workspace, search
from routing.search.found import Limits
from routing.search.kernels_workspace import COST, DISTANCE, ENERGY, KEY, OFFSET, SPEED, STOPPED, TIME
from routing.search.space import SearchSpace, search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import BALANCED, ECO, FASTEST, Weights

pytestmark = pytest.mark.shared_data

REPOSITORY = Path(__file__).resolve().parents[3]
MAPS = REPOSITORY.parent / "shared/data/maps"
ROUNDING = 1e-9  # advantages smaller than this are rounding
KONA, PETROL = "hyundai-kona-64", "toyota-corolla-petrol"


@pytest.fixture(scope="module")
def andorra() -> RoadGraph:
    """Andorra with measured heights."""
    if not MAPS.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no real maps in {MAPS}: CI must have them")
        pytest.skip("no real maps beside the repository (shared/data/maps)")
    return import_region(
        MAPS / "andorra.osm.pbf", [MAPS / "N42E001.hgt.zip"], "andorra", smoothing_m=DEFAULT_SMOOTHING_M
    )


@pytest.fixture(scope="module")
def cars() -> dict[str, Vehicle]:
    known = dict(load_vehicles(REPOSITORY / "data/vehicles"))
    return known | {"lossless": replace(known[KONA], id="lossless", drive_eff=1.0, recuperation_eff=1.0)}


@dataclass(frozen=True, slots=True)
class Settled:
    """The labels of a finished search that no other dominates; by_link: their rows."""

    number: np.ndarray
    pointer: np.ndarray
    by_link: dict[int, list[int]]
    rules: SearchRules
    counts: found.SearchCounts


def settled(graph: RoadGraph, space: SearchSpace, limits: Limits, weights: Weights, start: LinkPosition) -> Settled:
    """Everything that one search from a start to all places leaves in its workspace."""
    pareto = limits.held and (weights.time > 0.0 or weights.distance > 0.0)
    rules = search.search_rules(space, weights, limits, pareto, 5_000_000)
    with space.drives.lent() as lent:
        ws, _, goal, counts = search.run_once(
            space, WorkspacePool(graph.link_count), rules, [start], (), lent, space.lower_bound.undirected
        )
    assert goal == -1
    made = int(ws.counter[kernels_workspace.LABELS])
    by_link: dict[int, list[int]] = {}
    for row, (link, parent, state) in enumerate(ws.pointer[:made, : kernels_workspace.STATE].tolist()):
        if state != kernels_workspace.DEAD and parent >= 0:
            by_link.setdefault(link, []).append(row)
    return Settled(ws.number[:made].copy(), ws.pointer[:made].copy(), by_link, rules, counts)


def driven(space, limits, link, label, following):
    """Energy used, time and state after driving a label's link towards a successor, by the link model alone."""
    g, p = space.arrays, space.physics
    used, clock, v, stopped, offset = (float(label[k]) for k in (ENERGY, TIME, SPEED, STOPPED, OFFSET))
    limit, ds = float(g.speed_limit_mps[link]), float(g.length_m[link]) - offset
    road = road_in_time(p, g.roads, link, clock, ds / limit)
    p_stop = float(g.stop_probability_frac[link])
    e, t, end = link_energy(
        p, road, ds, v, stopped, limit, float(g.speed_limit_mps[following]), p_stop, float(g.stop_time_s[link])
    )
    e = accepted_j(p, used, e + cabin_energy_j(p, clock, clock + t), limits.least_energy_j)
    return max(used + e, limits.least_energy_j), clock + t, float(label[DISTANCE]) + ds, end, p_stop


def dominates_plainly(space, r, link, a, b):
    """Whether label a dominates label b on a link, by the lemmas of docs/search-proof.md."""
    debt = (a[COST] - r.energy_weight * a[ENERGY]) - (b[COST] - r.energy_weight * b[ENERGY])
    if a[COST] > b[COST]:
        return False
    if r.pareto and (a[ENERGY] > b[ENERGY] or (debt > NOISE_COST and r.least_energy_j != -math.inf)):
        return False
    debt_j = climate_debt_j(space.slack, a[TIME], b[TIME])
    entry_a, entry_b = (Entry(label[SPEED], label[STOPPED], 0.0) for label in (a, b))
    if entry_a == entry_b:
        return a[COST] + r.energy_weight * debt_j <= b[COST] and (not r.limited or a[ENERGY] + debt_j <= b[ENERGY])
    g = space.arrays
    ahead = LinkAhead(link, g.length_m[link], g.speed_limit_mps[link], g.top_class[link])
    slack = slack_of(space.physics, space.slack, r.half_inertia_kg, borrowed_links(g), ahead, entry_a, entry_b)
    return dominates_by(r, a[COST], a[ENERGY], b[COST], b[ENERGY], slack, debt_j, 0.0)


def check_labels(graph, space, limits, weights, start):
    """Feasible, tight and closed: how many transitions there were, and how many made no label of their own."""
    s = settled(graph, space, limits, weights, start)
    r = s.rules
    assert s.counts.reduced_below_zero == 0
    assert s.counts.crowded == 0
    child = {
        (int(s.pointer[row, kernels_workspace.PARENT]), link): row for link, rows in s.by_link.items() for row in rows
    }
    parents = {parent for parent, _ in child} | {row for rows in s.by_link.values() for row in rows}
    beyond = dominated = 0
    for row in parents:
        label, link = s.number[row], int(s.pointer[row, kernels_workspace.LINK])
        for following in graph.successors(link).tolist():
            used, clock, far, end, p_stop = driven(space, limits, link, label, following)
            if used > limits.most_energy_j:
                beyond += 1
                assert (row, following) not in child
                continue
            cost = float(label[COST]) + r.energy_weight * (used - float(label[ENERGY]))
            cost += r.time_weight * (clock - float(label[TIME])) + r.distance_weight * (far - float(label[DISTANCE]))
            kept = child.get((row, following))
            if kept is not None:
                mine = s.number[kept]
                assert mine[ENERGY] == pytest.approx(used, rel=1e-9, abs=1e-6)
                assert (mine[TIME], mine[DISTANCE]) == pytest.approx((clock, far), rel=1e-9)
                assert (mine[SPEED], mine[STOPPED]) == (end, p_stop)
                assert mine[COST] == pytest.approx(cost, rel=1e-9, abs=1e-12)
                assert mine[KEY] >= label[KEY] - 1e-9 * (abs(label[KEY]) + r.energy_weight * 3600.0)
                continue
            dominated += 1
            used, cost = used + ROUNDING * (abs(used) + 1e3), cost + ROUNDING * (abs(cost) + r.energy_weight * 1e3)
            made = np.zeros(8)
            made[[COST, ENERGY, TIME, SPEED, STOPPED]] = cost, used, clock, end, p_stop
            assert any(dominates_plainly(space, r, following, s.number[other], made) for other in s.by_link[following])
    return s, dominated, beyond


SEARCHES = {
    "eco": (KONA, STILL, Limits(), ECO, StopRule.EXPECTED),
    "petrol, without stops": (PETROL, STILL, Limits(), ECO, StopRule.NONE),
    "lossless, nearly full": ("lossless", STILL, Limits(-3e6, 8e6), ECO, StopRule.EXPECTED),
    "fastest": (KONA, STILL, Limits(), FASTEST, StopRule.EXPECTED),
    "balanced within a reserve": (KONA, STILL, Limits(-math.inf, 3e6), BALANCED, StopRule.NONE),
    "wind": (KONA, Conditions(wind_speed_mps=10.0, wind_from_rad=2.0), Limits(), ECO, StopRule.EXPECTED),
    "cold": (KONA, Conditions(ambient_k=263.0), Limits(-math.inf, 9e6), ECO, StopRule.EXPECTED),
}


@pytest.mark.parametrize("name", SEARCHES)
def test_no_transition_of_a_whole_map_improves_a_label_and_every_label_has_a_tight_parent(andorra, cars, name):
    car, sky, limits, weights, rule = SEARCHES[name]
    space = search_space(andorra, cars[car], LinkModel.INTEGRATED, rule, StopSettings(), sky)
    s, dominated, beyond = check_labels(andorra, space, limits, weights, LinkPosition(4000, 0.0))
    assert dominated > 0.1 * sum(map(len, s.by_link.values()))
    assert (beyond > 0) == (limits.most_energy_j < math.inf)
    assert len(s.by_link) > (0.99 * andorra.link_count if limits == Limits() else 300)
