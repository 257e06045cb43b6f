"""The compiled part of matching: its bounded search against networkx, its sequence against all sequences."""

from __future__ import annotations

import itertools

import networkx as nx
import numpy as np
import pytest

from diagnosis.matching import kernels_viterbi as kernels
from diagnosis.matching.kernels_viterbi import Costs, Places, States, Steps
from diagnosis.matching.map_matcher import MapMatcher


def test_bounded_search_finds_the_lengths_that_networkx_finds(coquimbo):
    graph = coquimbo.graph
    roads, frontier = MapMatcher(graph)._roads, MapMatcher(graph)._frontier()
    turns = nx.DiGraph()
    tails = np.repeat(np.arange(graph.link_count), np.diff(graph.successor_first))
    # the way to a link's beginning: from the end of one link to the end of the next is the next one's length
    turns.add_weighted_edges_from(zip(tails.tolist(), graph.successor.tolist(), graph.length_m[tails], strict=True))
    for start in (7, 12_345, 30_000):
        for bound in (0.0, 150.0, 1200.0):
            epoch = kernels.search(roads, frontier, start, bound)
            found = {
                int(link): float(frontier.entry_m[link]) for link in np.flatnonzero(frontier.epoch == epoch).tolist()
            }
            length = float(graph.length_m[start])
            wanted = nx.single_source_dijkstra_path_length(turns, start, cutoff=bound + length)
            wanted = {link: way - length for link, way in wanted.items() if link != start}
            found.pop(start, None)  # by a loop, which networkx leaves out
            assert found == pytest.approx(wanted, abs=1e-6)


@pytest.mark.nojit
def test_likeliest_sequence_is_the_best_of_all_sequences(town):
    rng = np.random.default_rng(5)
    matcher = MapMatcher(town)
    count, choices = 4, 3
    first = choices * np.arange(count + 1)
    entries = _entries_m(town)
    costs = Costs(6.0, 0.03, 0.0, 20.0, 4.0, 8.0, 9.0, 1e9)
    for _ in range(10):
        link = rng.integers(0, town.link_count, first[-1])
        places = Places(
            first, link, rng.uniform(0.0, 1.0, link.size) * town.length_m[link], rng.uniform(0, 5, link.size)
        )
        driven = rng.uniform(50.0, 400.0, count - 1)
        size = link.size + count
        states = States(np.full(size, np.inf), np.full(size, -1), np.zeros(size, bool))
        steps = Steps(driven, np.zeros(count - 1, bool), np.ones(count))
        kernels.likeliest(matcher._roads, matcher._frontier(), places, steps, costs, states)
        every = itertools.product(*(range(choices + 1) for _ in range(count)))
        best = min(_cost(entries, town, places, driven, costs, chosen) for chosen in every)
        found = min(states.total[first[-2] : link.size].min(), states.total[-1])
        assert found == pytest.approx(best)


def _cost(entries, graph, places, driven, costs, chosen):
    """Cost of a sequence of choices among candidates, the last choice being off all roads, from the definition."""
    first, choices = places.first, int(places.first[1])
    states = [None if c == choices else int(first[t]) + c for t, c in enumerate(chosen)]
    cost = sum(costs.off if state is None else float(places.cost[state]) for state in states)
    for (before, after), way in zip(itertools.pairwise(states), driven.tolist(), strict=True):
        if before is None or after is None:
            cost += 0.0 if before is after else costs.leave
            continue
        shortest = _way(entries, graph, places, before, after)
        cost += min(abs(shortest - way) / (costs.scale_m + costs.scale_frac * way), costs.split)
    return cost


def _way(entries, graph, places, before, after):
    a, b = int(places.link[before]), int(places.link[after])
    from_m, to_m = float(places.position_m[before]), float(places.position_m[after])
    if a == b and to_m >= from_m:
        return to_m - from_m
    return float(graph.length_m[a]) - from_m + entries[a, b] + to_m


def _entries_m(graph):
    """Way from the end of each link to the beginning of each one, by Floyd's and Warshall's recurrence."""
    n = graph.link_count
    entry = np.full((n, n), np.inf)
    for link in range(n):
        entry[link, graph.successors(link)] = 0.0
    for through in range(n):
        by = entry[:, through, None] + graph.length_m[through] + entry[None, through, :]
        entry = np.minimum(entry, by)
    return entry
