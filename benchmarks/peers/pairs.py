"""Which places are asked for: the same ones with the same seed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from routing.graph.earth import great_circle_m

if TYPE_CHECKING:
    from collections.abc import Iterator

    from benchmarks.peers.questions import EngineAnswer, Place, Question
    from routing.graph.road_graph import RoadGraph

APART_M: Final = 25_000.0
TOLERANCE: Final = 0.2
TRIES: Final = 10_000
SAME_ROAD_M: Final = 100.0


def draw_pairs(graph: RoadGraph, rng: np.random.Generator) -> Iterator[tuple[Place, Place]]:
    """Random nodes 25 km ± 20 % apart as the crow flies, without end; ValueError on a graph too small for that."""
    tries = 0
    while tries < TRIES:
        tries += 1
        a, b = (_place(graph, int(node)) for node in rng.integers(graph.node_count, size=2))
        if abs(float(great_circle_m(*a, *b)) - APART_M) <= TOLERANCE * APART_M:
            tries = 0
            yield a, b
    raise ValueError(f"graph {graph.meta.name!r}: no two of {TRIES} random nodes are {APART_M / 1e3:g} km apart")


def draw_places(graph: RoadGraph, rng: np.random.Generator) -> Iterator[Place]:
    """Random nodes, without end."""
    while True:
        yield _place(graph, int(rng.integers(graph.node_count)))


def on_those_roads(question: Question, answer: EngineAnswer) -> bool:
    """Whether a route, as far as it has its ends, begins and ends within 100 m of the places that were asked for."""
    if answer.ends is None or question.goal is None:
        return True
    asked = (question.start, question.goal)
    return all(
        float(great_circle_m(*there, *here)) <= SAME_ROAD_M for there, here in zip(answer.ends, asked, strict=True)
    )


def _place(graph: RoadGraph, node: int) -> Place:
    return float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node])
