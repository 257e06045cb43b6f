"""Roundabouts on a route: which exit, counted as a driver counts, and what kind of roundabout it is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from routing.guidance.bearings import bearing_deg, leaving_deg, modifier_of, turned_deg
from routing.guidance.step import Modifier, StepType
from routing.guidance.surroundings import RING, surroundings_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.guidance.labels import Labels
    from routing.guidance.manoeuvre import Arm

SMALL_M: Final = 15.0  # radius up to which a roundabout is taken as a plain junction, as OSRM's documentation has it
MOST_LINKS: Final = 80  # of a ring
MOST_ARMS: Final = 4  # of a small one
CLEAR_DEG: Final = 50.0  # between the ways out of a small one: each is a turn of its own
OFF_DEG: Final = 35.0  # how far a way out may be off straight on, left or right to be called so


class Ring(NamedTuple):
    """A roundabout all round: its links in driving order, length [m], middle (lon, lat) and sense."""

    links: tuple[int, ...]
    length_m: float
    middle: NDArray[np.float64]
    clockwise: bool

    @property
    def radius_m(self) -> float:
        """Radius of a circle of its length [m]."""
        return self.length_m / (2.0 * math.pi)


def exits_at(arms: list[tuple[int, Arm]], ring: Ring | None) -> list[Arm]:
    """Roads of a junction on a ring by which it can be left, another ring that touches it among them."""
    inside = () if ring is None else ring.links
    return [arm for out, arm in arms if arm.entry and (not arm.bits & RING or (bool(inside) and out not in inside))]


def exit_number(
    passed: list[list[tuple[int, Arm]]],
    last: list[tuple[int, Arm]],
    taken_link: int,
    ring: Ring | None,
    *,
    clockwise: bool,
) -> int:
    """Which exit is taken. passed: the roads of each junction passed on the ring; last, taken_link: where it is left.

    Ways out that a car may not take are none. Of several at one junction the one on the outer side comes first.
    """
    before = sum(len(exits_at(arms, ring)) for arms in passed)
    return before + _place_among(exits_at(last, ring), next(arm for out, arm in last if out == taken_link), clockwise)


def mini_exit_number(arms: list[tuple[int, Arm]], taken_link: int, *, clockwise: bool) -> int:
    """Which exit of a mini roundabout is taken, of the roads at its node."""
    taken = next(arm for out, arm in arms if out == taken_link)
    return _place_among([arm for _, arm in arms if arm.entry], taken, clockwise)


def _place_among(arms: list[Arm], taken: Arm, clockwise: bool) -> int:
    """The place of a road among others, from the outer side inwards, 1 for the first."""
    return 1 + sum((arm.turn_deg > taken.turn_deg) != clockwise for arm in arms if arm is not taken)


def ring_of(graph: RoadGraph, link: int) -> Ring | None:
    """The roundabout that a link is part of, None where it does not close."""
    around, signs = surroundings_of(graph), graph.signs
    if signs is None:
        return None
    links, at = [link], link
    while len(links) <= MOST_LINKS:
        follows = graph.originals(graph.successors(at).tolist())
        on = [k for k in follows if around.bits[signs.sign_idx[k]] & RING]
        if not on:
            return None
        at = link if link in on else _onwards(graph, at, on)
        if at == link:
            break
        if at in links:
            return None
        links.append(at)
    else:
        return None
    line = np.concatenate([graph.geometry(k)[:-1] for k in links])
    east = (line[:, 0] - line[0, 0] + 180.0) % 360.0 - 180.0
    north = line[:, 1] - line[0, 1]
    double_area = float((east * np.roll(north, -1) - np.roll(east, -1) * north).sum())
    middle = np.array((line[0, 0] + east.mean(), line[0, 1] + north.mean()))
    return Ring(tuple(links), float(graph.length_m[links].sum()), middle, double_area < 0.0)


def _onwards(graph: RoadGraph, link: int, following: list[int]) -> int:
    """The link by which a ring goes on: the straightest of those of rings, where another one touches it."""
    if len(following) == 1:
        return following[0]
    before = (leaving_deg(graph, np.array([link]), np.array([True]))[0] + 180.0) % 360.0
    after = leaving_deg(graph, np.array(following), np.zeros(len(following), np.bool_))
    return min(zip(after.tolist(), following, strict=True), key=lambda way: abs(turned_deg(before, way[0])))[1]


def name_of(graph: RoadGraph, labels: Labels, ring: Ring) -> str:
    """The roundabout's own name: one that no road that meets it has. Empty where it has none."""
    names = {labels.label(link).name for link in ring.links} - {""}
    nodes = {int(graph.head[link]) for link in ring.links}
    around = surroundings_of(graph)
    inside = set(ring.links)
    for node in nodes:
        out = range(int(around.out_first[node]), int(around.out_first[node + 1]))
        into = around.oneway[around.oneway_first[node] : around.oneway_first[node + 1]].tolist()
        names -= {labels.label(link).name for link in (*out, *into) if link not in inside}
    return min(names) if names else ""


def small_turn(graph: RoadGraph, ring: Ring, entry_node: int, exit_node: int, taken_link: int) -> Modifier | None:
    """The turn that a small roundabout is to a driver, None where it is not as clear as a crossing.

    Clear: at most MOST_ARMS ways out, well apart, and the one taken goes straight on, to a side, or back.
    """
    if ring.radius_m > SMALL_M:
        return None
    around = surroundings_of(graph)
    inside = set(ring.links)
    ways: dict[int, float] = {}
    place = {node: _place(graph, node) for node in {int(graph.head[link]) for link in ring.links}}
    for node, here in place.items():
        for out in range(int(around.out_first[node]), int(around.out_first[node + 1])):
            if out not in inside:
                ways[out] = bearing_deg(ring.middle, here)
    before = bearing_deg(place[entry_node], ring.middle)
    turns = sorted(turned_deg(before, after) for after in ways.values())
    apart = np.diff([*turns, turns[0] + 360.0]) if turns else np.empty(0)
    if not 2 <= len(turns) <= MOST_ARMS or float(apart.min()) < CLEAR_DEG or taken_link not in ways:
        return None
    turn = turned_deg(before, bearing_deg(ring.middle, place[exit_node]))
    if exit_node == entry_node or abs(turn) > 180.0 - OFF_DEG:
        return Modifier.UTURN
    if min(abs(turn), abs(abs(turn) - 90.0)) > OFF_DEG:
        return None
    return Modifier.STRAIGHT if abs(turn) <= OFF_DEG else modifier_of(math.copysign(90.0, turn))


def _place(graph: RoadGraph, node: int) -> NDArray[np.float64]:
    return np.array((graph.node_lon_deg[node], graph.node_lat_deg[node]))


def entering(turn_deg: float, *, clockwise: bool) -> Modifier:
    """The turn into a roundabout, to its outer side where it is nearly straight."""
    found = modifier_of(turn_deg)
    if found is not Modifier.STRAIGHT:
        return found
    return Modifier.SLIGHT_LEFT if clockwise else Modifier.SLIGHT_RIGHT


def kind_of(rotary: str, small: Modifier | None) -> StepType:
    """What kind of manoeuvre a roundabout is."""
    if rotary:
        return StepType.ROTARY
    return StepType.ROUNDABOUT if small is None else StepType.ROUNDABOUT_TURN
