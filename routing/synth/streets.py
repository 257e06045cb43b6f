"""Streets of synthetic towns: warped lattices with arterials, dead ends and service roads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree

from energy.stops import FunctionalClass
from routing.synth.polylines import offsets
from routing.synth.settlements import Rank

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.synth.settlements import Settlements
    from routing.synth.terrain import Landscape

LINKS_PER_NODE: Final = 1.36
ARTERIAL_EVERY: Final = 5  # lattice lines
ARTERIAL_FROM: Final = 60  # nodes; smaller places have one main street only
SERVICE_SHARE: Final = 0.07  # service roads per street node


@dataclass(frozen=True, slots=True)
class Streets:
    """Street network of all settlements.

    x_m, y_m, place: (n,) nodes and their settlement; centre: int64 (settlements,) node in the middle of each.
    tail, head: int64 (k,) street links; functional_class: int8 (k,); line: int64 (k,) street each belongs to.
    """

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    place: NDArray[np.int64]
    centre: NDArray[np.int64]
    tail: NDArray[np.int64]
    head: NDArray[np.int64]
    functional_class: NDArray[np.int8]
    line: NDArray[np.int64]


def lay_streets(land: Landscape, places: Settlements, rng: np.random.Generator) -> Streets:
    """Street networks of all settlements at once, each connected; flat ground is built on first."""
    count = places.x_m.size
    nodes = np.maximum(1, np.round(places.streets / LINKS_PER_NODE).astype(np.int64))
    half = np.ceil(0.95 * np.sqrt(nodes)).astype(np.int64) + 2
    side = 2 * half + 1
    first = offsets(side * side)
    place = np.repeat(np.arange(count), side * side)
    within = np.arange(place.size) - first[place]
    i, j = within // side[place] - half[place], within % side[place] - half[place]
    x, y = _warped(places, i, j, place, rng)
    slope = (
        np.hypot(
            land.sample_m(x + 80.0, y) - land.sample_m(x - 80.0, y),
            land.sample_m(x, y + 80.0) - land.sample_m(x, y - 80.0),
        )
        / 160.0
    )
    narrow = np.where(places.rank[place] >= Rank.VILLAGE, 1.7, 1.15)
    score = np.hypot(i, narrow * j) * (1.0 + (slope / 0.07) ** 2) * (1.0 + 0.25 * rng.random(place.size))
    score[(i == 0) & (j == 0)] = -1.0
    inside = (x > 50.0) & (y > 50.0) & (x < land.extent_x_m - 50.0) & (y < land.extent_y_m - 50.0)
    score[~inside] = np.inf
    order = np.lexsort((score, place))
    chosen = np.zeros(place.size, bool)
    chosen[order] = (np.arange(place.size) - first[place[order]]) < nodes[place[order]]
    chosen &= inside | ((i == 0) & (j == 0))

    along = np.flatnonzero(chosen & (i < half[place]))
    along = along[chosen[along + side[place[along]]]]
    across = np.flatnonzero(chosen & (j < half[place]))
    across = across[chosen[across + 1]]
    tail = np.concatenate((along, across))
    head = np.concatenate((along + side[place[along]], across + 1))
    runs_along = np.arange(tail.size) < along.size
    number = np.where(runs_along, j[tail], i[tail])
    arterial = (number % ARTERIAL_EVERY == 0) & (nodes[place[tail]] >= ARTERIAL_FROM)
    spine = arterial | (number == 0)  # straight through the middle, so that a main road needs no detour
    kept = _kept(tail, head, spine, place, places.streets, rng)
    tail, head, runs_along, number, arterial = (v[kept] for v in (tail, head, runs_along, number, arterial))

    centre = first[:-1] + (side * side) // 2
    links = csr_array((np.ones(tail.size, np.int8), (tail, head)), shape=(place.size, place.size))
    _, part = connected_components(links, directed=False)
    node_kept = chosen & (part == part[centre][place])
    link_kept = node_kept[tail]
    tail, head, runs_along, number, arterial = (v[link_kept] for v in (tail, head, runs_along, number, arterial))
    rank = np.cumsum(node_kept) - 1
    main = (number == 0) & arterial & (places.rank[place[tail]] == Rank.CITY)
    road_class = np.where(
        main, FunctionalClass.SECONDARY, np.where(arterial, FunctionalClass.TERTIARY, FunctionalClass.RESIDENTIAL)
    ).astype(np.int8)
    line = (place[tail] * 2 + runs_along) * 256 + np.mod(number, 256)
    return _with_service_roads(
        Streets(x[node_kept], y[node_kept], place[node_kept], rank[centre], rank[tail], rank[head], road_class, line),
        places,
        rng,
    )


def _warped(
    places: Settlements, i: NDArray[np.int64], j: NDArray[np.int64], place: NDArray[np.int64], rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions of lattice points: turned by an angle of their own, bent by slow waves, jittered; the centre stays."""
    count = places.x_m.size
    spacing_m = rng.uniform(84.0, 112.0, count)
    turn = rng.uniform(0.0, np.pi / 2.0, count)
    u, v = i * spacing_m[place], j * spacing_m[place] * 1.12
    dx, dy = np.zeros(place.size), np.zeros(place.size)
    for _ in range(3):
        direction = rng.uniform(0.0, 2.0 * np.pi, count)[place]
        wave_m = (rng.uniform(6.0, 14.0, count) * spacing_m)[place]
        amplitude_m = (rng.uniform(0.02, 0.055, count))[place] * wave_m
        phase = (u * np.cos(direction) + v * np.sin(direction)) * 2.0 * np.pi / wave_m
        dx += amplitude_m * np.sin(phase) * -np.sin(direction)
        dy += amplitude_m * np.sin(phase) * np.cos(direction)
    calm = 0.09 * spacing_m[place] * ((i != 0) | (j != 0))
    u, v = u + dx + calm * rng.standard_normal(place.size), v + dy + calm * rng.standard_normal(place.size)
    cos, sin = np.cos(turn)[place], np.sin(turn)[place]
    return places.x_m[place] + u * cos - v * sin, places.y_m[place] + u * sin + v * cos


def _kept(
    tail: NDArray[np.int64],
    head: NDArray[np.int64],
    preferred: NDArray[np.bool_],
    place: NDArray[np.int64],
    wanted: NDArray[np.int64],
    rng: np.random.Generator,
) -> NDArray[np.bool_]:
    """The preferred links, a spanning tree, and at random as many other links as the settlement wants."""
    weight = np.where(preferred, 0.1, 1.0) + 0.5 * rng.random(tail.size)
    size = place.size
    tree = minimum_spanning_tree(csr_array((weight, (tail, head)), shape=(size, size))).tocoo()
    key = tail * size + head
    in_tree = np.isin(key, tree.row.astype(np.int64) * size + tree.col)
    owner = place[tail]
    surely = in_tree | preferred
    base = np.bincount(owner[surely], minlength=wanted.size)
    spare = np.bincount(owner[~surely], minlength=wanted.size)
    share = np.clip((wanted - base) / np.maximum(spare, 1), 0.0, 1.0)
    kept: NDArray[np.bool_] = surely | (rng.random(tail.size) < share[owner])
    return kept


def _with_service_roads(streets: Streets, places: Settlements, rng: np.random.Generator) -> Streets:
    """The same streets with short dead ends: yards, farms, car parks."""
    chance = np.where(places.rank[streets.place] == Rank.HAMLET, 0.25, SERVICE_SHARE)
    at = np.flatnonzero(rng.random(streets.x_m.size) < chance)
    angle, length_m = rng.uniform(0.0, 2.0 * np.pi, at.size), rng.uniform(28.0, 48.0, at.size)
    new = streets.x_m.size + np.arange(at.size)
    return Streets(
        x_m=np.concatenate((streets.x_m, streets.x_m[at] + length_m * np.cos(angle))),
        y_m=np.concatenate((streets.y_m, streets.y_m[at] + length_m * np.sin(angle))),
        place=np.concatenate((streets.place, streets.place[at])),
        centre=streets.centre,
        tail=np.concatenate((streets.tail, at)),
        head=np.concatenate((streets.head, new)),
        functional_class=np.concatenate((streets.functional_class, np.full(at.size, FunctionalClass.SERVICE, np.int8))),
        line=np.concatenate((streets.line, (streets.place[at] * 2) * 256 + 255)),
    )


def main_streets(streets: Streets, gate: NDArray[np.int64], gate_class: NDArray[np.int8]) -> NDArray[np.int8]:
    """Classes of street links once the roads that enter at gates run on to the middle of the place, int8 (k,)."""
    size = streets.x_m.size
    length = np.hypot(
        streets.x_m[streets.tail] - streets.x_m[streets.head], streets.y_m[streets.tail] - streets.y_m[streets.head]
    )
    straight = (streets.functional_class <= FunctionalClass.TERTIARY) | (streets.line % 256 == 0)
    length = length * np.where(straight, 0.6, 1.0)
    length[streets.functional_class == FunctionalClass.SERVICE] *= 50.0
    both = (np.concatenate((streets.tail, streets.head)), np.concatenate((streets.head, streets.tail)))
    graph = csr_array((np.concatenate((length, length)), both), shape=(size, size))
    key = both[0] * size + both[1]
    by_key = np.argsort(key, kind="stable")
    _, before, _ = dijkstra(graph, indices=np.unique(streets.centre), return_predecessors=True, min_only=True)
    road_class = streets.functional_class.copy()
    for entering in range(FunctionalClass.UNCLASSIFIED, FunctionalClass.MOTORWAY, -1):
        current = np.unique(gate[gate_class == entering])
        as_street = max(entering, int(FunctionalClass.PRIMARY))
        while current.size:
            current = current[before[current] >= 0]
            previous = before[current].astype(np.int64)
            step = by_key[np.searchsorted(key[by_key], current * size + previous)] % streets.tail.size
            road_class[step] = np.minimum(road_class[step], as_street)
            current = np.unique(previous)
    return road_class
