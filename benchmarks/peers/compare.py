"""The same questions to every engine in turn, so that load on the machine hits all of them."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from benchmarks.peers.pairs import on_those_roads
from benchmarks.peers.questions import Question

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any

    from benchmarks.peers.questions import Engine, EngineAnswer, Place
    from routing.graph.road_graph import RoadGraph

WARM_UP: Final = 5  # rounds asked untimed
TRIES: Final = 10  # places looked at for one that counts
DEFAULT_CHARGE_FRAC: Final = 0.04  # of a range, where no engine that thinks in minutes says how far it should go
MOST_CHARGE_FRAC: Final = 0.9
LEAST_NODES: Final = 500  # of a range that counts
SAME_REACH: Final = 0.03
BISECTIONS: Final = 20
ASKED_BEFORE: Final = 1e-4  # a charge that much higher is a new question: an answer kept from before is of no use


@dataclass(frozen=True, slots=True)
class Competitor:
    """An engine and its name; charge_scale: its charge for a range over ours, None where it thinks in minutes."""

    name: str
    engine: Engine
    charge_scale: float | None


@dataclass(frozen=True, slots=True)
class Rounds:
    """Answers by round and competitor; reached: nodes of our graph within a range, or as the engine counts its own.

    left_out: places that an engine refused or put on another road.
    """

    names: tuple[str, ...]
    answers: list[list[EngineAnswer]]
    reached: list[list[int]]
    left_out: int


def measure_routes(
    competitors: Sequence[Competitor],
    pairs: Iterable[tuple[Place, Place]],
    count: int,
    progress: Callable[[float], None] = lambda done: None,
) -> Rounds:
    """Ask for routes, each pair once; the engine that is asked first changes from pair to pair."""
    answers: list[list[EngineAnswer]] = []
    looked = 0
    for start, goal in pairs:
        question = Question(start, goal)
        answered = _ask_all(competitors, [question] * len(competitors), first=looked)
        if all(answer.refused is None and on_those_roads(question, answer) for answer in answered):
            answers.append(answered)
        looked += 1
        progress(min(1.0, len(answers) / (count + WARM_UP)))
        if len(answers) == count + WARM_UP or looked == TRIES * (count + WARM_UP):
            break
    return Rounds(_names(competitors), answers[WARM_UP:], [], looked - len(answers))


def measure_ranges(
    competitors: Sequence[Competitor],
    graph: RoadGraph,
    origins: Iterable[Place],
    count: int,
    minutes: float,
    progress: Callable[[float], None] = lambda done: None,
) -> Rounds:
    """Ask for ranges that reach as far as some minutes do, within 3 % of nodes; the first competitor is ours."""
    answers, reached, looked = [], [], 0
    for origin in origins:
        looked += 1
        charge_frac = _charge_as_far(competitors, graph, origin, minutes)
        if charge_frac is not None:
            questions = [
                Question(
                    origin, None, minutes if competitor.charge_scale is None else charge_frac * competitor.charge_scale
                )
                for competitor in competitors
            ]
            answered = _ask_all(competitors, questions, first=looked)
            if all(answer.refused is None for answer in answered):
                answers.append(answered)
                reached.append([_nodes(graph, answer) for answer in answered])
        progress(min(1.0, len(answers) / count))
        if len(answers) == count or looked == TRIES * count:
            break
    return Rounds(_names(competitors), answers, reached, looked - len(answers))


def energy_ratio(rounds: Rounds, name: str) -> float:
    """Median over routes of the energy that an engine states over that of ours; 1 where it states none."""
    column = rounds.names.index(name)
    energies_kwh = ((answered[column].energy_kwh, answered[0].energy_kwh) for answered in rounds.answers)
    ratios = [theirs / own for theirs, own in energies_kwh if theirs and own]
    return statistics.median(ratios) if ratios else 1.0


def charge_reaching(engine: Engine, graph: RoadGraph, origin: Place, nodes: int) -> float | None:
    """Charge at departure that reaches about so many nodes; None where 90 % does not, or the engine refuses."""
    least, most = 0.0, MOST_CHARGE_FRAC
    for _ in range(BISECTIONS):
        middle = 0.5 * (least + most)
        answer = engine.ask(Question(origin, None, middle))
        if answer.refused is not None:
            return None
        found = _nodes(graph, answer)
        if abs(found - nodes) <= SAME_REACH * nodes:
            return middle * (1.0 + ASKED_BEFORE)
        least, most = (middle, most) if found < nodes else (least, middle)
    return None


def nodes_within(graph: RoadGraph, shape: list[Any]) -> int:
    """How many nodes of a graph lie within the coordinates of a MultiPolygon."""
    polygons = shapely.MultiPolygon([shapely.Polygon(rings[0], rings[1:]) for rings in shape])
    shapely.prepare(polygons)
    return int(np.count_nonzero(shapely.contains_xy(polygons, graph.node_lon_deg, graph.node_lat_deg)))


def _charge_as_far(competitors: Sequence[Competitor], graph: RoadGraph, origin: Place, minutes: float) -> float | None:
    timed = next((competitor for competitor in competitors if competitor.charge_scale is None), None)
    if timed is None:
        return DEFAULT_CHARGE_FRAC
    answer = timed.engine.ask(Question(origin, None, minutes))
    nodes = 0 if answer.refused is not None else _nodes(graph, answer)
    return charge_reaching(competitors[0].engine, graph, origin, nodes) if nodes >= LEAST_NODES else None


def _nodes(graph: RoadGraph, answer: EngineAnswer) -> int:
    return nodes_within(graph, answer.shape) if answer.shape is not None else answer.reached or 0


def _ask_all(competitors: Sequence[Competitor], questions: Sequence[Question], first: int) -> list[EngineAnswer]:
    """Answers in the order of the competitors, of whom another one begins each time."""
    answers: list[EngineAnswer | None] = [None] * len(competitors)
    for k in range(len(competitors)):
        i = (first + k) % len(competitors)
        answers[i] = competitors[i].engine.ask(questions[i])
    return [answer for answer in answers if answer is not None]


def _names(competitors: Sequence[Competitor]) -> tuple[str, ...]:
    return tuple(competitor.name for competitor in competitors)
