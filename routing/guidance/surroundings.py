"""What meets at each node of a graph, found once for all routes on it."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.graph.signs import RoadSign

# what a sign says of a road, as bits
MOTORWAY: Final = 1  # motorways and trunk roads
RAMP: Final = 2  # their ramps
LINK: Final = 4  # ramps and slip roads of whatever kind
RING: Final = 8
RANKS: Final = np.array((0, 1, 2, 3, 4, 5, 5, 7))  # of functional classes: unclassified and residential roads are alike

_BIG: Final = frozenset(("motorway", "trunk"))
_RINGS: Final = frozenset(("roundabout", "circular"))


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Links by the nodes that they join, without copies.

    out_first: int64 (N+1,) first link that leaves a node, links being in the order of their tails. oneway_first: int64
    (N+1,), oneway: int32, links without another direction by the node that they lead to. bits: uint8 (S,) of each sign.
    """

    out_first: NDArray[np.int64]
    oneway_first: NDArray[np.int64]
    oneway: NDArray[np.int32]
    bits: NDArray[np.uint8]


_known: dict[int, Surroundings] = {}


def surroundings_of(graph: RoadGraph) -> Surroundings:
    """Those of a graph; kept as long as its arrays are, in O(M log M) at first: 4 bytes a link, 16 a node."""
    array = (
        graph.tail if graph.signs is None else graph.signs.sign_idx
    )  # neither is shared with a graph that differs here
    known = _known.get(id(array))
    if known is None:
        known = _known[id(array)] = _found(graph)
        weakref.finalize(array, _known.pop, id(array), None)
    return known


def bits_of(graph: RoadGraph, link: NDArray[np.int64]) -> NDArray[np.uint8]:
    """What signs say of links as bits, uint8 (k,); without signs only what is a motorway."""
    if graph.signs is not None:
        return surroundings_of(graph).bits[graph.signs.sign_idx[link]]
    return np.where(graph.functional_class[link] == 0, MOTORWAY, 0).astype(np.uint8)


def _found(graph: RoadGraph) -> Surroundings:
    roads = graph.road_link_count
    nodes = np.arange(graph.node_count + 1)
    oneway = np.flatnonzero(graph.reverse_idx[:roads] < 0)
    oneway = oneway[np.argsort(graph.head[oneway], kind="stable")]
    signs = () if graph.signs is None else graph.signs.signs
    return Surroundings(
        out_first=np.searchsorted(graph.tail[:roads], nodes),
        oneway_first=np.searchsorted(graph.head[oneway], nodes),
        oneway=oneway.astype(np.int32),
        bits=np.array([_bits(sign) for sign in signs], np.uint8),
    )


def _bits(sign: RoadSign) -> int:
    kind, _, link = sign.highway.partition("_")
    big, is_link = kind in _BIG, link == "link"
    bits = LINK if is_link else 0
    if big:
        bits |= RAMP if is_link else MOTORWAY
    return bits | (RING if sign.junction in _RINGS else 0)
