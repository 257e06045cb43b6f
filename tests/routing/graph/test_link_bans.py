"""Bans over several links: a graph with copies lets drive exactly what the bans let drive."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule
from energy.stops import StopSettings
from routing.errors import GraphFormatError
from routing.graph.conditional_limits import EVERY_DAY, ConditionalLimits
from routing.graph.ferries import Ferries
from routing.graph.files import load_graph, save_graph
from routing.graph.link_bans import LinkBan, carried, whole_successors
from routing.graph.link_copies import link_copies_from
from routing.graph.networkx_graph import from_networkx, to_networkx
from routing.graph.road_graph import ARRAY_NAMES, RoadGraph
from routing.graph.snap import RoadIndex
from routing.graph.structure import check_structure
from routing.places import LinkPosition, Point
from routing.search.found import Limits
from routing.search.search import find_path
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import FASTEST
from tests.routing.search.test_exact import maps, vehicle

WALK = 5  # links
ALIVE = 40  # links further, by when a walk that ends nowhere has ended


@st.composite
def banned(draw: Any, nodes: int = 4) -> tuple[RoadGraph, list[LinkBan]]:
    """A map, and bans and orders over chains of its links, that share links and overlap as they like."""
    graph = draw(maps(nodes))
    bans = []
    for _ in range(draw(st.integers(1, 4))):
        chains = []
        first = draw(st.integers(0, graph.link_count - 1))
        for _ in range(draw(st.integers(1, 2))):
            chain = [first]
            for _ in range(draw(st.integers(2, 3))):
                chain.append(draw(st.sampled_from(graph.successors(chain[-1]).tolist())))
            chains.append(tuple(chain))
        bans.append(LinkBan(tuple(dict.fromkeys(chains)), draw(st.booleans())))
    return graph, bans


def is_legal(graph: RoadGraph, bans: list[LinkBan], walk: tuple[int, ...]) -> bool:
    """Whether the last link of a walk may follow the others, from the words of the bans alone."""
    to, way = walk[-1], walk[:-1]
    for ban in bans:
        ahead = set()
        for chain in ban.chains:
            for driven in range(2 if ban.only else len(chain) - 1, len(chain)):
                if way[-driven:] == chain[:driven]:
                    ahead.add(chain[driven])
        if not ban.only and to in ahead:
            return False
        if ban.only and to not in ahead and ahead & set(graph.successors(way[-1]).tolist()):
            return False
    return True


def onward(graph: RoadGraph, bans: list[LinkBan], walk: tuple[int, ...]) -> list[tuple[int, ...]]:
    """A walk with each link that may follow it; where none may, one may turn round."""
    following = [(*walk, to) for to in graph.successors(walk[-1]).tolist()]
    legal = [on for on in following if is_legal(graph, bans, on)]
    twin = int(graph.reverse_idx[walk[-1]])
    if legal or twin < 0:
        return legal
    no_orders = [ban for ban in bans if not ban.only]
    return [on for on in [(*walk, twin)] if is_legal(graph, no_orders, on)]


def legal_walks(graph: RoadGraph, bans: list[LinkBan]) -> set[tuple[int, ...]]:
    memory = max(len(chain) for ban in bans for chain in ban.chains)

    @cache
    def ends_nowhere(tail: tuple[int, ...], further: int) -> bool:
        return further > 0 and all(ends_nowhere(on[-memory:], further - 1) for on in onward(graph, bans, tail))

    walks = {(link,) for link in range(graph.link_count)}
    for _ in range(WALK - 1):
        walks = {on for walk in walks for on in onward(graph, bans, walk)}
    return {walk for walk in walks if not ends_nowhere(walk[-memory:], ALIVE)}


def driven_walks(graph: RoadGraph) -> list[tuple[int, ...]]:
    """All walks of a graph with copies from its own links, by the links that copies lie on."""
    walks = [(link,) for link in range(graph.road_link_count)]
    for _ in range(WALK - 1):
        walks = [(*walk, to) for walk in walks for to in graph.successors(walk[-1]).tolist()]
    return [graph.originals(walk) for walk in walks]


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(banned())
def test_a_graph_with_copies_lets_drive_what_bans_let_drive_and_nothing_else(case):
    graph, bans = case
    copied, left = carried(graph, bans)
    assume(left == 0)
    walks = driven_walks(copied)
    assert len(set(walks)) == len(walks)
    assert set(walks) == legal_walks(graph, bans)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(banned(nodes=6))
def test_every_link_of_a_graph_with_copies_leads_to_every_other_one_and_copies_lie_on_links(case):
    graph, bans = case
    copied, left = carried(graph, bans)
    assert 0 <= left <= len(bans)
    for begin in range(copied.link_count):
        reached, ahead = {begin}, [begin]
        while ahead:
            for to in copied.successors(ahead.pop()).tolist():
                if to not in reached:
                    reached.add(to)
                    ahead.append(to)
        assert set(copied.originals(tuple(reached))) == set(range(graph.link_count))
    assert copied.road_link_count == graph.link_count
    for copy in range(copied.road_link_count, copied.link_count):
        (link,) = copied.originals((copy,))
        assert copied.copies_of(link).count(copy) == 1
        assert copied.geometry(copy).tolist() == copied.geometry(link).tolist()
        for name in ("tail", "head", "length_m", "speed_limit_mps", "cross", "way_id", "name_idx"):
            assert getattr(copied, name)[copy] == getattr(graph, name)[link]
    first, successor = whole_successors(copied)
    for link in range(graph.link_count):
        may_follow = {*graph.successors(link).tolist(), int(graph.reverse_idx[link])}
        assert set(successor[first[link] : first[link + 1]].tolist()) <= may_follow
    assert first[graph.link_count] == first[copied.link_count]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(banned(nodes=5))
def test_any_graph_with_copies_is_sound_and_one_whose_copy_is_the_other_direction_of_a_link_is_not(case):
    copied, _ = carried(*case)
    assume(copied.copies is not None)
    arrays = {name: getattr(copied, name) for name in ARRAY_NAMES}
    check_structure("graph", arrays, copied.copies)
    twins = copied.reverse_idx.copy()
    of = int(copied.copies.of[0])
    assume(twins[of] >= 0)
    twins[twins[of]] = copied.road_link_count
    with pytest.raises(GraphFormatError, match="reverse_idx"):
        check_structure("graph", arrays | {"reverse_idx": twins}, copied.copies)


def leads_on(graph: RoadGraph, walk: tuple[int, ...]) -> bool:
    """Whether a graph with copies lets drive links one after the other."""
    here = {walk[0]}
    for link in walk[1:]:
        here = {to for at in here for to in graph.successors(at).tolist() if graph.originals((to,)) == (link,)}
    return bool(here)


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
@given(banned(nodes=5), st.data())
def test_the_fastest_way_with_bans_is_the_fastest_legal_one(case, data):
    graph, bans = case
    copied, left = carried(graph, bans)
    assume(left == 0)
    ends = [data.draw(st.integers(0, graph.link_count - 1)) for _ in range(2)]
    start = LinkPosition(ends[0], 0.0)
    at_m = 0.9 * float(graph.length_m[ends[1]])
    goals = [LinkPosition(link, at_m) for link in (ends[1], *copied.copies_of(ends[1]))]
    space = search_space(copied, vehicle(), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    path, _ = find_path(space, WorkspacePool(copied.link_count), FASTEST, Limits(), [start], goals)
    plain = search_space(graph, vehicle(), LinkModel.INTEGRATED, StopRule.NONE, StopSettings())
    free, _ = find_path(
        plain, WorkspacePool(graph.link_count), FASTEST, Limits(), [start], [LinkPosition(ends[1], at_m)]
    )
    assert path is not None
    assert max(path.links) < graph.link_count
    assert path.goal == LinkPosition(ends[1], at_m)
    assert all(path.links[: k + 1] in onward(graph, bans, path.links[:k]) for k in range(1, len(path.links)))
    if leads_on(copied, free.links):
        assert path.cost <= free.cost * (1.0 + 1e-12)
        # where bans leave nothing else at the end of a link, vehicles turn there, which no one may without them
        if leads_on(graph, path.links):
            assert path.cost == pytest.approx(free.cost, rel=1e-12)


@pytest.fixture
def ring() -> tuple[RoadGraph, LinkBan]:
    """A block of streets both ways, and a ban of driving round two of its corners."""
    from routing.graph.practice import practice_graph

    graph = practice_graph()
    chain = [0]
    for _ in range(2):
        chain.append(int(graph.successors(chain[-1])[0]))
    return graph, LinkBan((tuple(chain),), only=False)


def test_a_ban_that_would_cut_roads_off_is_left_and_the_others_are_carried(ring):
    graph, ban = ring
    copied, left = carried(graph, [ban])  # round the block is the only way
    assert left == 1
    assert copied is graph


def crossing() -> tuple[RoadGraph, tuple[int, int, int]]:
    """Three nodes, streets both ways between all of them and twice so between two; a chain over one link."""
    from tests.routing.search.test_exact import SPEEDS, graph_of

    pairs = [(0, 1), (1, 2), (2, 3), (3, 0), (1, 3), (3, 1), (2, 0), (0, 2), (1, 0), (2, 1)]
    graph = graph_of([(a, b, 100.0 + 10.0 * k, SPEEDS[2], 0) for k, (a, b) in enumerate(pairs)], [0.0] * 4)
    chain = [int(np.flatnonzero((graph.tail == a) & (graph.head == b))[0]) for a, b in ((0, 1), (1, 2), (2, 3))]
    return graph, (chain[0], chain[1], chain[2])


def test_copies_bring_limits_and_ferries_of_their_links_and_last_in_files_and_exports(tmp_path):
    graph, chain = crossing()
    limits = ConditionalLimits(
        np.array([chain[1], 0]),
        np.array([5.0, 6.0]),
        np.array([False, True]),
        *(np.array([v] * 2) for v in (EVERY_DAY, 0, 1440)),
    )
    graph = replace(graph, conditional=limits, ferries=Ferries(np.array([chain[1]]), np.array([60.0])))
    copied, left = carried(graph, [LinkBan((chain,), only=False)])
    assert left == 0
    (copy,) = copied.copies_of(chain[1])
    assert chain[2] not in copied.successors(copy).tolist()
    assert chain[2] in copied.successors(chain[1]).tolist()
    assert copied.successors(chain[0]).tolist().count(copy) == 1
    assert chain[1] not in copied.successors(chain[0]).tolist()
    assert copied.conditional.link.tolist() == [chain[1], 0, copy]
    assert copied.ferries.columns() == {"link": [chain[1], copy], "duration_s": [60.0, 60.0]}
    save_graph(copied, tmp_path / "graph")
    for again in (load_graph(tmp_path / "graph"), from_networkx(to_networkx(copied))):
        assert again.copies.columns() == copied.copies.columns()
        assert again.successor.tolist() == copied.successor.tolist()


def test_places_are_on_links_and_on_their_copies_but_never_on_a_copy_first():
    graph, chain = crossing()
    copied, _ = carried(graph, [LinkBan((chain,), only=False)])
    line = graph.geometry(chain[1])
    lon, lat = (0.5 * (line[0] + line[-1])).tolist()
    point, positions = RoadIndex(copied).snap("start", Point(lat, lon), 1000.0)
    links = [place.link_idx for place in positions]
    assert point.link_idx < copied.road_link_count
    assert links[0] == point.link_idx
    assert set(copied.copies_of(links[0])) <= set(links)


@pytest.mark.parametrize("of", [[], [7], [-1], [0, 1], ["a"]])
def test_damaged_copies_are_refused(of):
    tail, head = np.array([0, 1, 2, 0]), np.array([1, 2, 0, 2])
    assert link_copies_from({"of": [0]}, np.array([0, 1, 0]), np.array([1, 0, 1])).of.tolist() == [0]
    with pytest.raises((KeyError, TypeError, ValueError)):
        link_copies_from({"of": of}, tail, head)
