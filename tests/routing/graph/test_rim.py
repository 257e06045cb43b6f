"""Where a map ends though its roads go on, on drawn maps and on real ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.stops import FunctionalClass
from routing.graph.rim import map_rim
from tests.routing.drawn_streets import drawn_streets

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from routing.graph.road_graph import RoadGraph

Place = tuple[float, float]
Street = tuple[Place, Place, FunctionalClass]
SIDE = 12


def town(streets: Sequence[Street]) -> tuple[RoadGraph, list[Place]]:
    """A map of straight streets both ways, and its places in the order of their node ids."""
    places = sorted({place for street in streets for place in street[:2]})
    number = {place: k for k, place in enumerate(places)}
    links = [(number[a], number[b]) for a, b, _ in streets] + [(number[b], number[a]) for a, b, _ in streets]
    graph = drawn_streets(
        "town",
        places,
        links,
        np.zeros(len(places)),
        speed_limit_mps=np.full(len(links), 50.0 / 3.6),
        cross=np.zeros(len(links), np.int64),
    )
    kinds = {frozenset((number[a], number[b])): kind for a, b, kind in streets}
    ids = graph.node_id
    classes = [kinds[frozenset((int(ids[a]), int(ids[b])))] for a, b in zip(graph.tail, graph.head, strict=True)]
    return replace(graph, functional_class=np.array(classes, np.int8)), places


def grid(kept: Callable[[float, float], bool], through_every: int = 4) -> list[Street]:
    """Streets a step apart, every so many of them a through road, with a dead end of a minor street at each crossing.

    kept: whether a place is on the map; streets are cut at the last place that is.
    """
    streets: list[Street] = []
    for row in range(SIDE):
        for column in range(SIDE):
            here = (float(column), float(row))
            for there, at in (((column + 1.0, row + 0.0), row), ((column + 0.0, row + 1.0), column)):
                kind = FunctionalClass.SECONDARY if at % through_every == 2 else FunctionalClass.RESIDENTIAL
                middle = (0.5 * (here[0] + there[0]), 0.5 * (here[1] + there[1]))
                if kept(*here) and kept(*middle):
                    streets.append((here, middle, kind))
                if kept(*middle) and kept(*there):
                    streets.append((middle, there, kind))
            yard = (here[0] + 0.2, here[1] + 0.2)
            if kept(*here) and kept(*yard):
                streets.append((here, yard, FunctionalClass.SERVICE))
    return streets


def rim_places(streets: Sequence[Street]) -> set[Place]:
    """The places of a drawn map at which it cuts a road."""
    graph, places = town(streets)
    return {places[int(graph.node_id[node])] for node in map_rim(graph).node_idx}


def cut_by_box() -> list[Street]:
    return grid(lambda east, north: 2.5 <= east <= 8.6 and 2.5 <= north <= 8.6)


def test_through_roads_that_a_box_cuts_are_the_rim_and_no_others():
    cut = {(2.5, 6.0), (8.5, 6.0), (6.0, 2.5), (6.0, 8.5)}
    assert rim_places(cut_by_box()) == cut


def through_ends(streets: Sequence[Street]) -> set[Place]:
    """The places of a drawn map at which a through road ends, as far as they are joined to the rest."""
    graph, places = town(streets)
    neighbours: dict[Place, set[Place]] = {place: set() for place in places}
    for a, b, _ in streets:
        neighbours[a].add(b)
        neighbours[b].add(a)
    kept = {places[k] for k in graph.node_id.tolist()}
    through = {place for a, b, kind in streets for place in (a, b) if kind == FunctionalClass.SECONDARY}
    return {place for place in kept & through if len(neighbours[place]) == 1}


def test_through_roads_that_a_slanting_polygon_cuts_are_the_rim():
    streets = grid(lambda east, north: 6.2 < east + north < 16.2 and abs(east - north) < 6.2)
    assert len(through_ends(streets)) >= 4
    assert rim_places(streets) == through_ends(streets)


def island() -> list[Street]:
    """A ring road along the coast, roads inside, and yards that end anywhere, at the coast too."""
    inside = grid(lambda east, north: 3.0 <= east <= 9.0 and 3.0 <= north <= 9.0)
    coast: list[Street] = []
    for k in range(6):
        for a, b in (
            ((3.0 + k, 3.0), (4.0 + k, 3.0)),
            ((3.0 + k, 9.0), (4.0 + k, 9.0)),
            ((3.0, 3.0 + k), (3.0, 4.0 + k)),
            ((9.0, 3.0 + k), (9.0, 4.0 + k)),
        ):
            coast.append((a, b, FunctionalClass.PRIMARY))
    quays: list[Street] = [((3.0 + k, 3.0), (3.0 + k, 2.7), FunctionalClass.SERVICE) for k in range(6)]
    return [*inside, *coast, *quays]


def test_coast_of_an_island_is_no_rim():
    assert rim_places(island()) == set()


def test_roads_to_capes_are_no_rim_where_other_roads_end_at_the_coast_as_often():
    capes: list[Street] = [((3.0, 5.0), (2.6, 5.0), FunctionalClass.TERTIARY)]
    inland: list[Street] = [((5.0 + k, 5.0), (5.1 + k, 5.3), FunctionalClass.TERTIARY) for k in range(3)]
    streets = [street for street in island() if street[2] != FunctionalClass.SERVICE]
    quays: list[Street] = [((3.0 + k, 3.0), (3.0 + k, 2.7), FunctionalClass.SERVICE) for k in range(6)]
    assert rim_places([*streets, *quays, *capes, *inland]) == set()


def test_both_ends_of_a_single_street_are_the_rim_whatever_its_class():
    for kind in FunctionalClass:
        assert rim_places([((0.0, 0.0), (1.0, 0.0), kind), ((1.0, 0.0), (2.0, 0.0), kind)]) == {
            (0.0, 0.0),
            (2.0, 0.0),
        }


def test_dual_carriageway_that_is_cut_ends_at_its_last_place_for_turning():
    # the lanes are 20 m apart, joined at the south and 8 km north of it; a town lies round the south
    south, north = (5.0, 0.0), (5.0, 8.0)
    there = [south, (5.02, 4.0), (5.02, 7.9), north]
    back = [north, (4.98, 7.9), (4.98, 4.0), south]
    streets: list[tuple[Place, Place]] = [*pairwise(there), *pairwise(back)]
    cross = [(2.0, 0.0), (3.0, -1.0), (5.0, -1.0), (7.0, -1.0), (8.0, 0.0)]
    for a, b in [*pairwise(cross), ((5.0, -1.0), south), ((2.0, 0.0), south), (south, (8.0, 0.0))]:
        streets += [(a, b), (b, a)]
    places = sorted({place for street in streets for place in street})
    number = {place: k for k, place in enumerate(places)}
    graph = drawn_streets(
        "lanes",
        places,
        [(number[a], number[b]) for a, b in streets],
        np.zeros(len(places)),
        speed_limit_mps=np.full(len(streets), 30.0),
        cross=np.zeros(len(streets), np.int64),
    )
    trunk = replace(graph, functional_class=np.full(graph.link_count, FunctionalClass.TRUNK, np.int8))
    assert [places[k] for k in trunk.node_id[map_rim(trunk).node_idx]] == [north]
    minor = replace(graph, functional_class=np.full(graph.link_count, FunctionalClass.RESIDENTIAL, np.int8))
    assert map_rim(minor).node.sum() == 0


def test_ring_without_ends_has_no_rim():
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    ring = [(a, b, FunctionalClass.PRIMARY) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    assert rim_places(ring) == set()


def test_links_of_the_rim_are_those_that_lead_to_or_from_its_nodes():
    graph, _ = town(cut_by_box())
    rim = map_rim(graph)
    np.testing.assert_array_equal(rim.link, rim.node[graph.tail] | rim.node[graph.head])
    assert rim.link.sum() == 2 * rim.node.sum()


@settings(max_examples=15, deadline=None)
@given(west=st.floats(0.6, 3.9), south=st.floats(0.6, 3.9), east=st.floats(6.1, 10.4), north=st.floats(6.1, 10.4))
def test_any_box_cuts_each_through_road_at_its_rim(west, south, east, north):
    streets = grid(lambda x, y: west <= x <= east and south <= y <= north)
    assert rim_places(streets) == through_ends(streets)
