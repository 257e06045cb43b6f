"""How far bands reach along roads and by bearing: the same as slower ways of finding it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from routing.errors import AbandonedError
from routing.graph.earth import METRE_PER_DEGREE
from routing.graph.link_copies import LinkCopies
from routing.graph.road_graph import RoadGraph
from routing.places import LinkPosition, Point
from routing.range.area import RoadEnergies
from routing.range.kernels_reach import PAUSE_NODES
from routing.range.reach import BEARINGS, RoadDistances, RoadReach, bearing_reach_m
from routing.range.rings import rings_of
from routing.time_budget import TimeBudget, within
from tests.routing.drawn_streets import drawn_streets

NODES = 9


@st.composite
def drawn_graphs(draw) -> RoadGraph:
    """Nine places on a circular way and other links between them, most of them longer than they look."""
    node = st.integers(0, NODES - 1)
    others = draw(st.lists(st.tuples(node, node).filter(lambda pair: pair[0] != pair[1]), max_size=30))
    links = [*((k, (k + 1) % NODES) for k in range(NODES)), *others]
    return drawn_streets(
        "drawn",
        [(float(k % 3), float(k // 3)) for k in range(NODES)],
        links,
        np.zeros(NODES),
        speed_limit_mps=np.full(len(links), 15.0),
        cross=np.zeros(len(links), np.int64),
        detour=np.array(draw(st.lists(st.floats(1.0, 9.0), min_size=len(links), max_size=len(links)))),
    )


def drawn_place(data: st.DataObject, graph: RoadGraph) -> list[LinkPosition]:
    """A place on a link, and on the one the other way where there is one."""
    link = data.draw(st.integers(0, graph.link_count - 1))
    length_m = float(graph.length_m[link])
    offset_m = data.draw(st.sampled_from((0.0, 0.3, 1.0))) * length_m
    back = int(graph.reverse_idx[link])
    other = [LinkPosition(back, float(graph.length_m[back]) - offset_m)] if back >= 0 else []
    return [LinkPosition(link, offset_m), *[place for place in other if place.offset_m >= 0.0]]


def slow_distances_m(graph: RoadGraph, places: list[LinkPosition], *, homeward: bool) -> NDArray[np.float64]:
    """Scipy's distances from a node at the place, or to it, on a dense matrix."""
    length_m = np.full((graph.node_count + 1, graph.node_count + 1), np.inf)
    near, far = (graph.head, graph.tail) if homeward else (graph.tail, graph.head)
    np.minimum.at(length_m, (near, far), graph.length_m)
    for place in places:
        away_m = place.offset_m if homeward else float(graph.length_m[place.link_idx]) - place.offset_m
        # scipy takes an entry of a dense matrix that is 0 for no link
        length_m[-1, far[place.link_idx]] = min(length_m[-1, far[place.link_idx]], max(away_m, 1e-6))
    return np.asarray(dijkstra(length_m, indices=graph.node_count))[:-1]


@settings(max_examples=60, deadline=None)
@given(drawn_graphs(), st.data(), st.booleans())
def test_road_distances_are_those_of_scipy(graph, data, homeward):
    places = drawn_place(data, graph)
    wanted = np.array(data.draw(st.lists(st.booleans(), min_size=graph.node_count, max_size=graph.node_count)), bool)
    found_m = RoadDistances(graph).of_nodes(places, wanted, homeward=homeward)
    expected_m = slow_distances_m(graph, places, homeward=homeward)
    assert found_m[wanted] == pytest.approx(expected_m[wanted], abs=1e-5)
    assert (found_m >= expected_m - 1e-5).all()


def straight_road(nodes: int) -> RoadGraph:
    """Nodes 10 m apart, towards the north, with links both ways."""
    links = [(k, k + 1) for k in range(nodes - 1)] + [(k + 1, k) for k in range(nodes - 1)]
    return drawn_streets(
        "road",
        [(0.0, 0.0009 * k) for k in range(nodes)],
        links,
        np.zeros(nodes),
        speed_limit_mps=np.full(len(links), 15.0),
        cross=np.zeros(len(links), np.int64),
    )


def test_road_distances_are_found_beyond_a_pause_and_not_where_nobody_waits():
    graph = straight_road(PAUSE_NODES + 100)
    place = [LinkPosition(0, 0.0)]  # on the link that leaves the southernmost node
    distances, everywhere = RoadDistances(graph), np.ones(graph.node_count, np.bool_)
    found_m = distances.of_nodes(place, everywhere, homeward=False)
    northward = graph.tail < graph.head
    assert found_m[1:] == pytest.approx(np.cumsum(graph.length_m[northward]))
    budget = TimeBudget()
    budget.abandon()
    with within(budget), pytest.raises(AbandonedError):
        distances.of_nodes(place, everywhere, homeward=False)


@pytest.mark.parametrize("homeward", [False, True])
def test_road_distances_on_a_graph_with_copies_are_those_without(homeward):
    plain = straight_road(6)
    of = np.array([0, 3])
    tail, head, length_m = (np.append(part, part[of]) for part in (plain.tail, plain.head, plain.length_m))
    copied = replace(plain, tail=tail, head=head, length_m=length_m, copies=LinkCopies(of))
    place, everywhere = [LinkPosition(4, 1.0)], np.ones(plain.node_count, np.bool_)
    found_m, expected_m = (
        RoadDistances(graph).of_nodes(place, everywhere, homeward=homeward) for graph in (copied, plain)
    )
    assert found_m.tolist() == expected_m.tolist()


def slow_reach(
    graph: RoadGraph,
    node_m: NDArray[np.float64],
    energies: RoadEnergies,
    budget_j: float,
    places: list[LinkPosition],
    *,
    homeward: bool,
) -> RoadReach:
    """Link by link."""
    node_j = energies.node_energy_j
    inside = [*node_m[(node_j <= budget_j) & np.isfinite(node_m)].tolist(), 0.0]
    begun = {place.link_idx: place.offset_m for place in places}
    ends = []
    for link in range(graph.link_count):
        near, far = (graph.head, graph.tail) if homeward else (graph.tail, graph.head)
        end_j, length_m = float(node_j[far[link]]), float(graph.length_m[link])
        from_m, to_m = float(energies.from_m[link]), float(energies.to_m[link])
        ways = []  # energy, distance, how far along the link, counted from where it is entered, at its beginning
        if node_j[near[link]] <= budget_j:
            ways.append((float(node_j[near[link]]), float(node_m[near[link]]), 0.0, False))
        if link in begun:
            ways.append((0.0, 0.0, length_m - begun[link] if homeward else begun[link], True))
        for begin_j, begin_m, skipped_m, at_start in ways:
            if end_j <= budget_j or (at_start and to_m < from_m):
                continue
            driven_m = 0.0 if to_m < from_m else (length_m - from_m if homeward else to_m) - skipped_m
            span_j = min(end_j, energies.most_energy_j) - begin_j
            part = (budget_j - begin_j) / span_j if span_j > 0.0 else 1.0
            ends.append(begin_m + min(max(part, 0.0), 1.0) * max(driven_m, 0.0))
    return RoadReach(min(ends, default=None), max((*inside, *ends)))


@settings(max_examples=60, deadline=None)
@given(drawn_graphs(), st.data(), st.booleans())
def test_reach_along_roads_is_that_of_each_link_looked_at(graph, data, homeward):
    places = drawn_place(data, graph)
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    driven = rng.random(graph.link_count) < 0.7
    part = np.sort(rng.choice([0.0, 0.4, 1.0], (2, graph.link_count)), axis=0) * graph.length_m
    energies = RoadEnergies(
        node_energy_j=np.where(rng.random(graph.node_count) < 0.6, rng.uniform(0.0, 10.0, graph.node_count), np.inf),
        tail_energy_j=None,
        head_energy_j=None,
        from_m=part[0],
        to_m=np.where(driven, part[1], -1.0),
        most_energy_j=10.0,
    )
    budget_j = data.draw(st.sampled_from((0.0, 3.0, 7.0, 10.0)))
    distances = RoadDistances(graph)
    node_m = distances.of_nodes(places, energies.node_energy_j <= budget_j, homeward=homeward)
    found = distances.reach(node_m, energies, budget_j, places, homeward=homeward)
    whole_m = distances.of_nodes(places, np.ones(graph.node_count, np.bool_), homeward=homeward)
    expected = slow_reach(graph, whole_m, energies, budget_j, places, homeward=homeward)
    assert found.farthest_m == pytest.approx(expected.farthest_m)
    assert (found.nearest_m is None) == (expected.nearest_m is None)
    assert found.nearest_m is None or found.nearest_m == pytest.approx(expected.nearest_m)


def slow_bearing_reach_m(area: shapely.MultiPolygon, origin: Point) -> list[float]:
    """The farthest point that each ray has in common with the outline, by shapely."""
    scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(origin.lat_deg)), 1.0))
    flat = shapely.transform(area, lambda lonlat: (lonlat - (origin.lon_deg, origin.lat_deg)) * scale)
    farthest = []
    for bearing in np.radians(np.arange(BEARINGS) * (360.0 / BEARINGS)):
        ray = shapely.LineString([(0.0, 0.0), (1e6 * np.sin(bearing), 1e6 * np.cos(bearing))])
        crossed = shapely.get_coordinates(shapely.intersection(ray, flat.boundary))
        farthest.append(float(np.hypot(*crossed.T).max(initial=0.0)))
    return farthest


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 3))
def test_reach_by_bearing_is_that_of_rays_cut_by_the_outline(seed, parts):
    rng = np.random.default_rng(seed)
    discs = [
        shapely.Point(*place).buffer(size).symmetric_difference(shapely.Point(*place).buffer(0.3 * size))
        for place, size in zip(rng.uniform(-0.2, 0.2, (parts, 2)), rng.uniform(0.02, 0.3, parts), strict=True)
    ]
    area = shapely.union_all([*discs, shapely.Point(0.0, 0.0).buffer(0.01, quad_segs=3)])
    shape = shapely.transform(area, lambda lonlat: np.round(lonlat + np.array((8.0, 56.0)), 7))
    whole = shapely.MultiPolygon(shapely.get_parts(shape))
    origin = Point(56.0003, 8.0001)
    assert bearing_reach_m(rings_of(whole), origin) == pytest.approx(slow_bearing_reach_m(whole, origin), abs=1e-3)
