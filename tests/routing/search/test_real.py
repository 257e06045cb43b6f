"""The search on a real map: reduced costs, early stop, charge limits, weightings, and the twin on a part of it."""

from __future__ import annotations

import itertools
import math
import os
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from energy.chain.chain import LinkModel, StopRule
from energy.chain.kernels_link import link_energy
from energy.conditions import Conditions, RoadSurface
from energy.force.effects import drive_of
from energy.force.kernels_physics import road_at
from energy.stops import StopSettings
from energy.units import JOULE_PER_KWH, JOULE_PER_WH
from energy.vehicle.files import load_vehicles
from energy.vehicle.vehicle import Vehicle
from routing.errors import ImportFailedError, NegativeCycleError
from routing.graph.networkx_graph import to_networkx
from routing.graph.road_graph import LooseLinks, LooseNodes, RoadGraph, assemble_graph
from routing.importers.region import DEFAULT_SMOOTHING_M, import_region
from routing.places import LinkPosition, LinkSpan, Point
from routing.planner import Planner
from routing.queries import RangeQuery, RouteQuery
from routing.route.route import Route
from routing.search.found import Limits
from routing.search.reference import EnergySearch
from routing.search.search import find_path, reach
from routing.search.space import SearchSpace, search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import BALANCED, ECO, FASTEST, Weights

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.shared_data

REPOSITORY = Path(__file__).resolve().parents[3]
MAPS = REPOSITORY.parent / "shared/data/maps"
KONA, I3, PETROL = "hyundai-kona-64", "bmw-i3-60ah", "toyota-corolla-petrol"
SHORTEST = Weights(0.0, 0.0, 1.0)
NAMED = (("eco", ECO), ("fastest", FASTEST), ("balanced", BALANCED), ("shortest", SHORTEST))


@pytest.fixture(scope="module")
def andorra() -> RoadGraph:
    """Andorra with measured heights."""
    if not MAPS.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no real maps in {MAPS}: CI must have them")
        pytest.skip("no real maps beside the repository (shared/data/maps)")
    tiles = [MAPS / "N42E001.hgt.zip"]
    return import_region(MAPS / "andorra.osm.pbf", tiles, "andorra", smoothing_m=DEFAULT_SMOOTHING_M)


@pytest.fixture(scope="module")
def vehicles() -> dict[str, Vehicle]:
    """The bundled vehicles, and one without any loss."""
    known = dict(load_vehicles(REPOSITORY / "data/vehicles"))
    return known | {"lossless": replace(known[KONA], id="lossless", drive_eff=1.0, recuperation_eff=1.0)}


@pytest.fixture(scope="module")
def planner(andorra: RoadGraph) -> Planner:
    return Planner(andorra)


def space_of(graph: RoadGraph, car: Vehicle, rule: StopRule = StopRule.EXPECTED) -> SearchSpace:
    return search_space(graph, car, LinkModel.INTEGRATED, rule, StopSettings())


def middle_of(graph: RoadGraph, link: int, share: float = 0.5) -> LinkPosition:
    return LinkPosition(link, share * float(graph.length_m[link]))


def node_point(graph: RoadGraph, node: int) -> Point:
    return Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))


def node_pairs(graph: RoadGraph, count: int, seed: int) -> list[tuple[Point, Point]]:
    """Places some way apart."""
    rng = np.random.default_rng(seed)
    pairs = rng.choice(graph.node_count, (count, 2), replace=False).tolist()
    return [(node_point(graph, a), node_point(graph, b)) for a, b in pairs]


def cost_of(route: Route, weights: Weights) -> float:
    """What a search minimises: recuperation that a full battery can't take counts for nothing."""
    energy_j = route.energy_j + route.braked_away_j
    return (
        weights.energy * energy_j / JOULE_PER_KWH
        + weights.time * route.duration_s / 3600.0
        + weights.distance * route.distance_m / 1000.0
    )


@pytest.mark.parametrize("rule", [StopRule.EXPECTED, StopRule.NONE])
@pytest.mark.parametrize(
    "car", [KONA, I3, "nissan-leaf", "vw-id4", "tesla-model-3", "chevrolet-bolt", PETROL, "lossless"]
)
def test_reduced_costs_on_real_terrain_are_never_negative(andorra, vehicles, car, rule):
    space = space_of(andorra, vehicles[car], rule)
    pool = WorkspacePool(andorra.link_count)
    for link in np.random.default_rng(1).choice(andorra.link_count, 4, replace=False).tolist():
        reached = reach(space, pool, Limits(), [middle_of(andorra, link)], andorra.head, andorra.node_count)
        assert reached.counts.reduced_below_zero == 0
        assert not reached.counts.label_correcting
        assert np.isfinite(reached.node_energy_j).all()


def test_link_energies_on_real_terrain_are_often_negative(andorra, vehicles):
    # without them the potential would not be put to the test
    g, physics = space_of(andorra, vehicles[KONA]).arrays, drive_of(vehicles[KONA]).physics
    energy_j = np.array(
        [
            link_energy(physics, road_at(g.roads, k), length, limit, 0.0, limit, limit, 0.0, 0.0)[0]
            for k, (length, limit) in enumerate(zip(andorra.length_m, andorra.speed_limit_mps, strict=True))
        ]
    )
    assert 0.2 < np.mean(energy_j < 0.0) < 0.5


@pytest.mark.parametrize("car", [KONA, PETROL, "lossless"])
@pytest.mark.parametrize("limits", [Limits(), Limits(-2e6, 5e6), Limits(0.0, 8e6)])
def test_early_stop_at_a_goal_equals_one_to_all(andorra, vehicles, car, limits):
    space = space_of(andorra, vehicles[car])
    pool = WorkspacePool(andorra.link_count)
    start = middle_of(andorra, 4000)
    reached = reach(space, pool, limits, [start], andorra.head, andorra.node_count)
    found = 0
    for node in np.random.default_rng(2).choice(andorra.node_count, 60, replace=False).tolist():
        ends = [
            LinkPosition(link, float(andorra.length_m[link])) for link in np.flatnonzero(andorra.head == node).tolist()
        ]
        path, _ = find_path(space, pool, ECO, limits, [start], ends)
        expected = math.inf if path is None else path.energy_j
        assert reached.node_energy_j[node] == pytest.approx(expected, rel=1e-9, abs=1e-6)
        found += path is not None
    assert found > 0


@pytest.mark.parametrize("car", [KONA, PETROL])
def test_path_costs_are_the_sum_over_its_links(andorra, planner, vehicles, car):
    space = space_of(andorra, vehicles[car])
    pool = WorkspacePool(andorra.link_count)
    links = np.random.default_rng(3).choice(andorra.link_count, (25, 2), replace=False).tolist()
    for (a, b), (_, weights) in zip(links, itertools.cycle(NAMED), strict=False):
        start, goal = middle_of(andorra, a), middle_of(andorra, b)
        path, _ = find_path(space, pool, weights, Limits(), [start], [goal])
        assert path is not None
        last = len(path.links) - 1
        spans = tuple(
            LinkSpan(
                link,
                start.offset_m if k == 0 else 0.0,
                goal.offset_m if k == last else float(andorra.length_m[link]),
            )
            for k, link in enumerate(path.links)
        )
        driven = planner.simulate(spans, vehicles[car])  # refuses forbidden turns and gaps
        assert path.energy_j == pytest.approx(driven.energy_j, rel=1e-9)
        assert path.time_s == pytest.approx(driven.duration_s, rel=1e-9)
        assert path.distance_m == pytest.approx(driven.distance_m, rel=1e-9)
        cost = weights.energy * driven.energy_j / JOULE_PER_KWH
        cost += weights.time * driven.duration_s / 3600.0 + weights.distance * driven.distance_m / 1000.0
        assert path.cost == pytest.approx(cost, rel=1e-9)


def cut_out(graph: RoadGraph, lat_deg: float, lon_deg: float, links: int) -> RoadGraph:
    """The links nearest to a place, as far as they are strongly connected."""
    shrink = math.cos(math.radians(lat_deg))
    away = np.hypot((graph.node_lon_deg - lon_deg) * shrink, graph.node_lat_deg - lat_deg)
    kept = np.sort(np.argsort(np.maximum(away[graph.tail], away[graph.head]), kind="stable")[:links])
    points = np.diff(graph.geometry_first)[kept]
    first = np.concatenate(([0], np.cumsum(points)))
    row = np.repeat(graph.geometry_first[kept] - first[:-1], points) + np.arange(first[-1])
    place = {link: k for k, link in enumerate(kept.tolist())}
    following = [np.flatnonzero(graph.tail[kept] == node) for node in graph.head[kept].tolist()]
    forbidden = [
        (k, int(j))
        for k, link in enumerate(kept.tolist())
        for j in following[k]
        if kept[j] not in graph.successors(link) and kept[j] != graph.reverse_idx[link]
    ]
    assert len(place) == links
    return assemble_graph(
        graph.meta,
        graph.names,
        LooseNodes(graph.node_lat_deg, graph.node_lon_deg, graph.node_height_m, graph.node_id),
        LooseLinks(
            tail=graph.tail[kept],
            head=graph.head[kept],
            length_m=graph.length_m[kept],
            speed_limit_mps=graph.speed_limit_mps[kept],
            functional_class=graph.functional_class[kept],
            cross=graph.cross[kept],
            urban=graph.urban[kept],
            structure=graph.structure[kept],
            way_id=graph.way_id[kept],
            name_idx=graph.name_idx[kept],
            geometry_first=first,
            geometry_lon_e7=graph.geometry_lon_e7[row],
            geometry_lat_e7=graph.geometry_lat_e7[row],
            forbidden_turns=np.array(forbidden, np.int64).reshape(-1, 2),
        ),
    )


def lead_of_all_kinetic_energy(space: SearchSpace, fastest_mps: float):
    """Dominance that needs no theorem: a lead of all kinetic energy at the top speed and of 120 s of auxiliaries."""
    physics = space.physics
    lead_j = physics.drive_factor * space.half_inertia_kg * fastest_mps**2 + 120.0 * physics.aux_move_w
    return lambda a, b: a.energy_j + lead_j <= b.energy_j


@pytest.mark.parametrize(
    ("car", "lat_deg", "lon_deg", "limits"),
    [
        (KONA, 42.5063, 1.5218, Limits()),  # the capital: short links, many stops
        (KONA, 42.5063, 1.5218, Limits(-4e5, 1.5e6)),
        (PETROL, 42.5428, 1.7336, Limits()),  # the pass of Envalira
        ("lossless", 42.5833, 1.6644, Limits(-math.inf, 2e6)),
    ],
)
def test_node_energies_on_a_real_cut_out_equal_the_twin(andorra, vehicles, car, lat_deg, lon_deg, limits):
    graph = cut_out(andorra, lat_deg, lon_deg, 400)
    assert graph.link_count > 200
    space = space_of(graph, vehicles[car])
    start = middle_of(graph, graph.link_count // 2)
    reached = reach(space, WorkspacePool(graph.link_count), limits, [start], graph.head, graph.node_count)
    nx_graph = to_networkx(graph)
    edge = next((u, v, k) for u, v, k, d in nx_graph.edges(keys=True, data=True) if d["idx"] == start.link_idx)
    dominance = None
    if limits.least_energy_j == -math.inf:
        dominance = lead_of_all_kinetic_energy(space, float(graph.speed_limit_mps.max()))
    twin = EnergySearch(nx_graph, drive_of(vehicles[car]), StopSettings(), ECO, limits, dominance)
    expected = twin.energy_to_nodes([(edge, start.offset_m)])
    assert len(expected) > 20
    for idx, node in enumerate(graph.node_id.tolist()):
        assert reached.node_energy_j[idx] == pytest.approx(expected.get(node, math.inf), rel=1e-9, abs=1e-3)


def test_descent_with_a_full_battery_is_braked_away(andorra, planner, vehicles):
    car = vehicles[KONA]
    top = int(np.argmax(andorra.node_height_m))
    low = int(np.argmin(andorra.node_height_m))
    query = RouteQuery(node_point(andorra, top), node_point(andorra, low), 1.0, car)
    (full,) = planner.route(query).routes
    assert full.feasible
    assert full.braked_away_j > 0.0
    charge = [full.soc_start_frac, *(link.soc_end_frac for link in full.links)]
    assert max(charge) == 1.0
    # what was braked away and what is left in the battery add up to what was recuperated
    kept_j = (full.soc_end_frac - 1.0) * car.usable_capacity_wh * JOULE_PER_WH
    assert kept_j + full.braked_away_j == pytest.approx(-full.energy_j, rel=1e-9)
    (half,) = planner.route(replace(query, soc_frac=0.5)).routes
    assert half.braked_away_j == 0.0
    assert half.soc_end_frac > 0.5


def test_reserve_on_feasible_routes_is_kept_at_every_link(andorra, planner, vehicles):
    feasible = 0
    for start, goal in node_pairs(andorra, 12, seed=4):
        answer = planner.route(RouteQuery(start, goal, 0.04, vehicles[KONA], 0.01, NAMED))
        for route in answer.routes:
            ends = [link.soc_end_frac for link in route.links]
            assert route.feasible == (min(ends) >= 0.01 - 1e-9)
            assert route.soc_min_frac == min(route.soc_start_frac, *ends)
            assert (route.deficit_j == 0.0) == route.feasible
            feasible += route.feasible
        assert len({route.feasible for route in answer.routes}) == 1  # one weighting finds a way if any does
    assert 0 < feasible < 48


@pytest.mark.parametrize("reserve", [0.0, 0.1])
def test_charge_just_above_the_need_is_feasible_and_just_below_is_not(andorra, planner, vehicles, reserve):
    for start, goal in node_pairs(andorra, 6, seed=5):
        query = RouteQuery(start, goal, 0.9, vehicles[I3], reserve)
        (route,) = planner.route(query).routes
        used = (
            np.cumsum([link.result.energy_j for link in route.links]) / JOULE_PER_WH / vehicles[I3].usable_capacity_wh
        )
        if route.braked_away_j > 0.0 or used.max() <= 1e-6:
            continue  # downhill all along: any charge will do
        need = reserve + float(used.max())
        (above,) = planner.route(replace(query, soc_frac=need + 1e-7)).routes
        assert above.feasible
        assert above.remedy is None
        assert above.soc_min_frac >= reserve
        # the route may be another one that dips less; the cheapest one must not do with less than it needs
        (below,) = planner.route(replace(query, soc_frac=need - 1e-3)).routes
        if below.feasible:
            assert below.energy_j > route.energy_j
            continue
        assert below.remedy is not None
        capacity_j = vehicles[I3].usable_capacity_wh * JOULE_PER_WH
        assert below.deficit_j == pytest.approx((reserve - below.soc_min_frac) * capacity_j, rel=1e-9)
        assert below.remedy.charge_needed_wh * JOULE_PER_WH == pytest.approx(below.deficit_j, rel=1e-9)
        assert below.furthest is not None
        (mended,) = planner.route(replace(query, soc_frac=below.remedy.soc_start_needed_frac + 1e-9)).routes
        assert mended.feasible


def test_weightings_without_limits_are_each_the_best_in_their_own_cost(andorra, planner, vehicles):
    for start, goal in node_pairs(andorra, 12, seed=6):
        answer = planner.route(RouteQuery(start, goal, 0.6, vehicles[KONA], 0.0, NAMED))
        assert {stats.method for stats in answer.stats} == {"label-setting"}
        for mine, other in itertools.product(answer.routes, repeat=2):
            assert cost_of(mine, mine.weights) <= cost_of(other, mine.weights) + 1e-9
        eco, fastest, balanced, shortest = answer.routes
        assert eco.energy_j <= balanced.energy_j + 1e-3 <= fastest.energy_j + 2e-3
        assert fastest.duration_s <= balanced.duration_s + 1e-6 <= eco.duration_s + 2e-6
        assert shortest.distance_m <= min(eco.distance_m, fastest.distance_m) + 1e-6


def test_weightings_under_a_binding_reserve_search_pareto_and_keep_it(andorra, planner, vehicles):
    car, bound = vehicles[KONA], 0
    for start, goal in node_pairs(andorra, 25, seed=7):
        free = planner.route(RouteQuery(start, goal, 0.6, car, 0.0, NAMED)).routes
        least, most = (-(r.soc_min_frac - 0.6) for r in free[:2])
        if most - least < 2e-4:
            continue
        soc = 0.5 * (least + most)  # between what the eco route and what the fastest one need
        answer = planner.route(RouteQuery(start, goal, soc, car, 0.0, NAMED))
        assert all(route.feasible for route in answer.routes)
        assert answer.stats[0].method == "label-setting"
        assert answer.stats[1].method == "label-setting-pareto"
        fastest = answer.routes[1]
        assert fastest.soc_min_frac >= -1e-9
        assert fastest.duration_s >= free[1].duration_s - 1e-6
        for mine, other in itertools.product(answer.routes, repeat=2):
            assert cost_of(mine, mine.weights) <= cost_of(other, mine.weights) + 1e-9
        bound += 1
    assert bound >= 3


def test_search_that_would_need_too_many_labels_answers_with_a_bound_that_holds(andorra, planner, vehicles):
    hasty, car, bounded = Planner(andorra), vehicles[KONA], 0
    hasty._search.pareto_limit = 100
    for start, goal in node_pairs(andorra, 25, seed=7):
        free = planner.route(RouteQuery(start, goal, 0.6, car, 0.0, NAMED[:2])).routes
        least, most = (-(r.soc_min_frac - 0.6) for r in free)
        if most - least < 2e-4:
            continue
        query = RouteQuery(start, goal, 0.5 * (least + most), car, 0.0, NAMED[1:2])
        (exact,), answer = planner.route(query).routes, hasty.route(query)
        (near,) = answer.routes
        assert answer.stats[0].method == "label-setting-bounded"
        assert near.feasible
        (short_by,) = (float(w.split("at most ")[1].split(" ")[0]) for w in answer.warnings if "not proven best" in w)
        assert exact.duration_s - 1e-6 <= near.duration_s <= exact.duration_s + short_by * 3600.0 * 1.01
        bounded += 1
    assert bounded >= 3


SKIES = {
    "cold, snow, limited recuperation": Conditions(ambient_k=265.0, road=RoadSurface.SNOW, regen_limited=True),
    "storm": Conditions(wind_speed_mps=25.0, wind_from_rad=2.0),
    "hot, loaded": Conditions(ambient_k=308.0, payload_kg=350.0, drag_factor=1.3, altitude_density=True),
}


@pytest.mark.parametrize("sky", SKIES)
@pytest.mark.parametrize("car", [KONA, PETROL, "lossless", "example-tomtom-table", "example-here-table"])
def test_reduced_costs_in_any_weather_are_never_negative_on_real_terrain(andorra, vehicles, car, sky):
    conditions = SKIES[sky] if not car.endswith("table") else Conditions(ambient_k=SKIES[sky].ambient_k)
    space = search_space(andorra, vehicles[car], LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings(), conditions)
    pool = WorkspacePool(andorra.link_count)
    for link in np.random.default_rng(1).choice(andorra.link_count, 3, replace=False).tolist():
        for limits in (Limits(), Limits(-5e6, math.inf)):
            reached = reach(space, pool, limits, [middle_of(andorra, link)], andorra.head, andorra.node_count)
            assert reached.counts.reduced_below_zero == 0
            assert np.isfinite(reached.node_energy_j).all()


@pytest.mark.parametrize("sky", SKIES)
def test_route_in_any_weather_takes_what_driving_its_links_takes(andorra, planner, vehicles, sky):
    conditions = SKIES[sky]
    for start, goal in node_pairs(andorra, 8, seed=11):
        query = RouteQuery(start, goal, 0.97, vehicles[KONA], 0.0, NAMED[:2], conditions=conditions)
        for route in planner.route(query).routes:
            spans = tuple(LinkSpan(link.link_idx, link.from_m, link.to_m) for link in route.links)
            driven = planner.simulate(spans, vehicles[KONA], conditions=conditions, soc_start_frac=0.97)
            assert driven.energy_j == pytest.approx(route.energy_j, rel=1e-9)
            assert driven.parts.total_j() == pytest.approx(driven.energy_j, rel=1e-9)
        eco, fastest = planner.route(query).routes
        assert cost_of(eco, ECO) <= cost_of(fastest, ECO) + 1e-9


@pytest.mark.parametrize("sky", SKIES)
def test_node_energies_in_weather_on_a_real_cut_out_equal_the_twin(andorra, vehicles, sky):
    graph = cut_out(andorra, 42.5063, 1.5218, 250)
    conditions, car = SKIES[sky], vehicles[KONA]
    space = search_space(graph, car, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings(), conditions)
    start = middle_of(graph, graph.link_count // 2)
    reached = reach(space, WorkspacePool(graph.link_count), Limits(), [start], graph.head, graph.node_count)
    nx_graph = to_networkx(graph)
    edge = next((u, v, k) for u, v, k, d in nx_graph.edges(keys=True, data=True) if d["idx"] == start.link_idx)
    p = space.physics
    lead_j = 2.0 * p.drive_factor * space.half_inertia_kg * float(graph.speed_limit_mps.max()) ** 2
    lead_j += 120.0 * (p.aux_move_w + p.cabin_w) + p.cabin_start_w * (120.0 + p.cabin_time_s)
    twin = EnergySearch(
        nx_graph,
        drive_of(car, conditions),
        StopSettings(),
        ECO,
        Limits(),
        lambda a, b: a.energy_j + lead_j <= b.energy_j,
    )
    expected = twin.energy_to_nodes([(edge, start.offset_m)])
    assert len(expected) > 20
    for idx, node in enumerate(graph.node_id.tolist()):
        assert reached.node_energy_j[idx] == pytest.approx(expected.get(node, math.inf), rel=1e-9, abs=1e-3)


@contextmanager
def suppress_cycle(graph: RoadGraph) -> Iterator[None]:
    """Let a search end in a cycle that gains energy, if the error says so clearly."""
    cycle: NegativeCycleError | None = None
    try:
        yield
    except NegativeCycleError as error:
        cycle = error
    if cycle is not None:
        assert 0 <= cycle.link_idx < graph.link_count
        assert "use link_model 'integrated'" in str(cycle)


@pytest.mark.parametrize("car", [KONA, PETROL])
def test_printed_model_is_label_correcting_or_names_the_cycle(andorra, planner, vehicles, car):
    for start, goal in node_pairs(andorra, 6, seed=8):
        query = RouteQuery(start, goal, 0.9, vehicles[car], 0.0, NAMED, LinkModel.PRINTED)
        answer = None
        with suppress_cycle(andorra):
            answer = planner.route(query)
        if answer is None:
            continue
        assert answer.stats[0].method == answer.stats[2].method == "label-correcting"
        assert any("label-correcting" in warning for warning in answer.warnings)
        for mine, other in itertools.product(answer.routes[::2], answer.routes):
            assert cost_of(mine, mine.weights) <= cost_of(other, mine.weights) + 1e-9


def test_fastest_route_of_the_printed_model_is_beaten_by_no_other(andorra, planner, vehicles):
    for start, goal in node_pairs(andorra, 6, seed=8):
        query = RouteQuery(start, goal, 0.9, vehicles[KONA], 0.0, NAMED, LinkModel.PRINTED)
        routes = planner.route(query).routes
        assert routes[1].duration_s <= min(route.duration_s for route in routes) + 1e-6


def test_import_of_an_empty_file_is_refused(tmp_path: Path) -> None:
    empty = tmp_path / "empty.osm.pbf"
    empty.write_bytes(b"")
    with pytest.raises(ImportFailedError):
        import_region(empty, [], "empty", smoothing_m=DEFAULT_SMOOTHING_M)


def test_uncertainty_of_a_route_brackets_its_energy_and_grows_with_distance(andorra, planner, vehicles):
    spreads = []
    for start, goal in node_pairs(andorra, 10, seed=21):
        (route,) = planner.route(RouteQuery(start, goal, 0.3, vehicles[KONA], 0.05, uncertainty=True)).routes
        (plain,) = planner.route(RouteQuery(start, goal, 0.3, vehicles[KONA], 0.05)).routes
        assert plain.uncertainty is None
        assert plain.energy_j == route.energy_j
        spread = route.uncertainty
        assert spread.energy_p10_j < spread.energy_p50_j < spread.energy_p90_j
        assert spread.arrival_soc_p10_frac <= spread.arrival_soc_p50_frac <= spread.arrival_soc_p90_frac
        assert spread.energy_p10_j < route.energy_j < spread.energy_p90_j
        assert 0.0 <= spread.above_reserve_frac <= 1.0
        spreads.append((route.distance_m, spread.energy_p90_j - spread.energy_p10_j))
    distance, width = np.array(spreads).T
    assert np.corrcoef(distance, width)[0, 1] > 0.8


def test_uncertain_range_shrinks_with_the_probability_asked_for(andorra, planner, vehicles):
    origin = node_point(andorra, 900)
    query = RangeQuery(origin, 0.12, vehicles[KONA], 0.02, (0.06,))
    plain = planner.range(query).bands
    bands = planner.range(replace(query, uncertainty=True)).bands
    assert [(b.soc_left_frac, b.probability_frac) for b in bands] == [
        (soc, chance) for soc in (0.02, 0.06) for chance in (0.1, 0.5, 0.9)
    ]
    for k, sure in ((0, plain[0]), (3, plain[1])):
        likely, middle, cautious = bands[k : k + 3]
        assert likely.node_count >= middle.node_count >= cautious.node_count
        assert likely.node_count > cautious.node_count
        assert middle.node_count == sure.node_count  # half of the drives come further than the model says
        for inner, outer in ((cautious, middle), (middle, likely)):
            assert inner.area.difference(outer.area).area <= 1e-6 * outer.area.area
