"""Loose links become a graph: U-turns, forbidden turns, the strongly connected part, order, read-only arrays."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from routing.errors import ImportFailedError
from routing.graph.earth import EARTH_RADIUS_M, great_circle_m
from routing.graph.road_graph import ARRAY_NAMES, GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph

pytestmark = pytest.mark.nojit

META = GraphMeta(
    "drawn", "test", "none", "none", Terrain.SYNTHETIC, "drawn", 0.0, (0.0, 0.0, 0.0, 0.0), {"footways": 7}
)
PLACES = [(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (3, 3), (4, 3)]


def assembled(links, forbidden=(), meta=META) -> RoadGraph:
    """A graph of straight (tail, head) links between PLACES; way_id is the position in the list."""
    n = len(links)
    tail, head = (np.array([row[k] for row in links], np.int32) for k in (0, 1))
    east, north = np.array(PLACES).T * 10_000
    corners = np.column_stack((tail, head)).ravel()
    return assemble_graph(
        meta,
        ("", "High Street"),
        LooseNodes(north / 1e7, east / 1e7, 100.0 + np.arange(len(PLACES)), 1000 + np.arange(len(PLACES))),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=np.hypot(east[head] - east[tail], north[head] - north[tail]) / 100.0,
            speed_limit_mps=np.full(n, 10.0),
            functional_class=np.full(n, 6, np.int8),
            cross=np.zeros(n, np.int8),
            urban=np.ones(n, bool),
            structure=np.zeros(n, bool),
            way_id=np.arange(n),
            name_idx=np.ones(n, np.int32),
            geometry_first=np.arange(n + 1) * 2,
            geometry_lon_e7=east[corners].astype(np.int32),
            geometry_lat_e7=north[corners].astype(np.int32),
            forbidden_turns=np.array(forbidden, np.int64).reshape(-1, 2),
        ),
    )


def both_ways(*streets):
    return [link for a, b in streets for link in ((a, b), (b, a))]


def ends(graph: RoadGraph, link: int) -> tuple[int, int]:
    """Outside ids of a link's nodes, counted from 0."""
    return int(graph.node_id[graph.tail[link]]) - 1000, int(graph.node_id[graph.head[link]]) - 1000


def turns(graph: RoadGraph) -> set[tuple[tuple[int, int], tuple[int, int]]]:
    return {(ends(graph, i), ends(graph, int(j))) for i in range(graph.link_count) for j in graph.successors(i)}


def test_u_turns_on_a_road_are_permitted_at_its_dead_ends_only():
    # 0 --- 1 --- 2
    graph = assembled(both_ways((0, 1), (1, 2)))
    assert turns(graph) == {
        ((0, 1), (1, 2)),
        ((1, 2), (2, 1)),
        ((2, 1), (1, 0)),
        ((1, 0), (0, 1)),
    }


def test_u_turns_where_the_only_other_turn_is_forbidden_are_permitted():
    # a sign forbids to go on from 0-1 to 1-2: the vehicle turns round, and the far street is lost
    graph = assembled(both_ways((0, 1), (1, 2)), forbidden=[(0, 2)])
    assert turns(graph) == {((0, 1), (1, 0)), ((1, 0), (0, 1))}
    assert graph.node_count == 2
    assert graph.meta.dropped["not_connected"] == 2


def test_forbidden_turns_are_taken_out_and_others_stay():
    #       3
    #       |
    # 0 --- 1 --- 2
    streets = both_ways((0, 1), (1, 2), (1, 3))
    before = turns(assembled(streets))
    after = turns(assembled(streets, forbidden=[(0, 4)]))
    assert before - after == {((0, 1), (1, 3))}
    assert after < before


def test_links_outside_the_largest_strongly_connected_part_are_dropped_and_counted():
    # a triangle with a dead end to turn round in, a oneway out of it with no way back, a street of its own far away
    kept = both_ways((0, 1), (1, 3), (3, 0), (3, 4))
    graph = assembled([*kept, (1, 2), *both_ways((5, 6))])
    assert sorted(ends(graph, link) for link in range(graph.link_count)) == sorted(kept)
    assert graph.meta.dropped == {"footways": 7, "not_connected": 3, "not_connected_m": 200}
    # the oneway of 100 m, and the street of 100 m, a road once in both directions; places are middles of links
    assert sorted((part.link_count, part.length_m, part.name) for part in graph.meta.cut_off) == [
        (1, 100.0, "High Street"),
        (2, 100.0, "High Street"),
    ]
    assert graph.node_id.tolist() == [1000, 1001, 1003, 1004]
    assert graph.node_height_m.tolist() == [100.0, 101.0, 103.0, 104.0]


def test_ring_without_a_dead_end_keeps_one_direction():
    # nobody may turn round on it, so that one direction never leads to the other
    graph = assembled(both_ways((0, 1), (1, 3), (3, 0)))
    assert graph.link_count == 3
    assert graph.meta.dropped["not_connected"] == 3
    assert "not_connected_m" not in graph.meta.dropped  # each road is there in its other direction
    assert graph.meta.cut_off == ()


def test_part_with_most_road_is_kept_though_another_has_more_links():
    # two streets of 100 m beside one of 316 m that is not joined: 4 links and 200 m against 2 links and 316 m
    graph = assembled([*both_ways((0, 1), (1, 3)), *both_ways((2, 5))])
    assert sorted(ends(graph, link) for link in range(graph.link_count)) == [(2, 5), (5, 2)]
    (part,) = graph.meta.cut_off
    assert (part.link_count, part.length_m) == (4, 200.0)
    assert (part.lat_deg, part.lon_deg) in {(0.0, 0.0), (0.0, 0.001), (0.001, 0.001)}


def test_oneway_ring_is_kept_whole_and_has_no_reverse_links():
    graph = assembled([(0, 1), (1, 3), (3, 0)])
    assert graph.link_count == 3
    assert graph.reverse_idx.tolist() == [-1, -1, -1]
    assert turns(graph) == {((0, 1), (1, 3)), ((1, 3), (3, 0)), ((3, 0), (0, 1))}


def test_links_in_any_order_are_sorted_by_tail_with_their_columns():
    graph = assembled(both_ways((3, 1), (2, 1), (1, 0)))
    assert np.all(np.diff(graph.tail) >= 0)
    loose = both_ways((3, 1), (2, 1), (1, 0))
    for link in range(graph.link_count):
        assert loose[graph.way_id[link]] == ends(graph, link)
        reverse = int(graph.reverse_idx[link])
        assert ends(graph, reverse) == ends(graph, link)[::-1]
        line = graph.geometry(link)
        tail, head = graph.tail[link], graph.head[link]
        np.testing.assert_allclose(line[0], (graph.node_lon_deg[tail], graph.node_lat_deg[tail]))
        np.testing.assert_allclose(line[-1], (graph.node_lon_deg[head], graph.node_lat_deg[head]))
    np.testing.assert_array_equal(graph.climb_m(), graph.node_height_m[graph.head] - graph.node_height_m[graph.tail])


def test_bbox_of_a_graph_spans_its_kept_links_only():
    graph = assembled([*both_ways((0, 1), (1, 3), (3, 0)), *both_ways((5, 6))])
    assert graph.meta.bbox == (0.0, 0.0, 0.001, 0.001)


def test_every_link_of_an_assembled_graph_reaches_every_other_one():
    rng = np.random.default_rng(3)
    for _ in range(20):
        pairs = {(int(a), int(b)) for a, b in rng.integers(0, len(PLACES), (14, 2)) if a != b}
        links = sorted(pairs)
        forbidden = [
            (i, j) for i, a in enumerate(links) for j, b in enumerate(links) if a[1] == b[0] and rng.random() < 0.15
        ]
        try:
            graph = assembled(links, forbidden)
        except ImportFailedError:
            continue
        banned = {(links[i], links[j]) for i, j in forbidden}
        assert not turns(graph) & banned
        for start in range(graph.link_count):
            seen, queue = {start}, [start]
            while queue:
                following = set(graph.successors(queue.pop()).tolist()) - seen
                seen |= following
                queue += following
            assert len(seen) == graph.link_count


def test_arrays_of_a_graph_are_read_only():
    graph = assembled(both_ways((0, 1), (1, 3), (3, 0)))
    for name in ARRAY_NAMES:
        array = getattr(graph, name)
        with pytest.raises(ValueError, match="read-only"):
            array[0] = array[0]
    with pytest.raises(dataclasses.FrozenInstanceError):
        graph.names = ()  # type: ignore[misc]


@pytest.mark.parametrize("links", [[(0, 1)], [(0, 1), (1, 2)], [(0, 1), (3, 4)]])
def test_links_that_lead_nowhere_are_refused(links):
    with pytest.raises(ImportFailedError) as refusal:
        assembled(links)
    assert refusal.value.field == "links"
    assert refusal.value.value == len(links)


def test_great_circle_along_a_meridian_and_the_equator_is_the_arc():
    # one degree of a great circle is R·π/180
    degree_m = EARTH_RADIUS_M * np.pi / 180.0
    assert great_circle_m(10.0, 7.0, 11.0, 7.0) == pytest.approx(degree_m, rel=1e-12)
    assert great_circle_m(0.0, 7.0, 0.0, 8.0) == pytest.approx(degree_m, rel=1e-12)
    assert great_circle_m(0.0, 0.0, 0.0, 180.0) == pytest.approx(180.0 * degree_m, rel=1e-12)
    assert great_circle_m(42.0, 1.5, 42.0, 1.5) == 0.0
