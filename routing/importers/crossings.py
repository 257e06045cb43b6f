"""Where a driver may have to stop: the `cross` value at the end of every directed link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.stops import Cross, FunctionalClass
from routing.importers.tags import ControlKind, Facing

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from routing.importers.chains import Chains, Pieces
    from routing.importers.roads import Roads
    from routing.importers.tags import Control

APPROACH_M: Final = 50.0  # a sign or signal nearer than this before a junction belongs to the junction (assumed)
SAME_JUNCTION_M: Final = 35.0  # signals nearer than this to each other are one stop (assumed: two carriageways)
CROSS_OF_CONTROL: Final[Mapping[ControlKind, Cross]] = {
    ControlKind.SIGNALS: Cross.LARGE,
    ControlKind.STOP: Cross.LARGE,
    ControlKind.STOP_ALL: Cross.LARGE,
    ControlKind.GIVE_WAY: Cross.MEDIUM,
    ControlKind.MINI_ROUNDABOUT: Cross.MEDIUM,
    ControlKind.PEDESTRIAN_SIGNALS: Cross.SMALL,
    ControlKind.LEVEL_CROSSING: Cross.SMALL,
}
ROUNDABOUT_ENTRY: Final = Cross.MEDIUM
# Unclassified and residential roads are of one rank: neither has the right of way by its class.
_RANK: Final = np.array([0, 1, 2, 3, 4, 5, 5, 6], np.int64)
_RANKS: Final = 7


@dataclass(frozen=True, slots=True)
class Stops:
    """Controls placed on the road network.

    entry: cross value by (point before, point), for the step that reaches a sign or the junction it stands before.
    minor: cross value by junction point, for the smaller roads that meet there (a sign on the junction itself).
    everyone: cross value by junction point, for all roads. nodes: points at which a way must be cut for its sign.
    signalled: junction points at which signals rule, so that no other rule applies.
    """

    entry: Mapping[tuple[int, int], Cross]
    minor: Mapping[int, Cross]
    everyone: Mapping[int, Cross]
    nodes: tuple[int, ...]
    signalled: frozenset[int]


class _Net:
    """Neighbours of the points near controls."""

    def __init__(self, roads: Roads, chains: Chains) -> None:
        steps = chains.steps()
        here, there = chains.point[steps], chains.point[steps + 1]
        way = chains.way[steps]
        origin = np.concatenate((here, there))
        order = np.argsort(origin, kind="stable")
        self.first = np.searchsorted(origin[order], np.arange(chains.point_count + 1))
        self.target = np.concatenate((there, here))[order]
        self.step_m = np.concatenate((chains.step_m[steps],) * 2)[order]
        # along: the step follows the order of the way's points
        self.along = np.concatenate((np.ones(here.size, np.bool_), np.zeros(there.size, np.bool_)))[order]
        self.open = np.concatenate((roads.ways.forward[way], roads.ways.backward[way]))[order]

    def neighbours(self, point: int) -> list[tuple[int, float, bool, bool]]:
        """(point, step [m], along its way, may be driven) for each step from a point."""
        part = slice(int(self.first[point]), int(self.first[point + 1]))
        return list(
            zip(
                self.target[part].tolist(),
                self.step_m[part].tolist(),
                self.along[part].tolist(),
                self.open[part].tolist(),
                strict=True,
            )
        )

    def junction_ahead(self, point: int, following: int, step_m: float) -> tuple[int, int, float] | None:
        """(point before, junction, distance) on leaving a point by a step, None where it is beyond APPROACH_M."""
        before, here, distance = point, following, step_m
        while distance <= APPROACH_M:
            onward = [n for n in self.neighbours(here) if n[0] != before]
            if len(self.neighbours(here)) != 2:
                return (before, here, distance) if len(self.neighbours(here)) > 2 else None
            if len(onward) != 1:
                return None
            before, here, distance = here, onward[0][0], distance + onward[0][1]
        return None


def place_controls(roads: Roads, chains: Chains) -> Stops:
    """Assign every sign and signal to the step of road that it stops, in O(controls).

    One on a junction holds for all its roads, except give-way and stop signs: for the smaller ones. One between
    junctions holds in the direction it is tagged for; untagged, towards a junction within APPROACH_M, else for both.
    One that stands within APPROACH_M before a junction is moved to it.
    """
    net = _Net(roads, chains)
    entry: dict[tuple[int, int], Cross] = {}
    minor: dict[int, Cross] = {}
    everyone: dict[int, Cross] = {}
    nodes: list[int] = []
    signalled: set[int] = set()
    for point, control in roads.controls.items():
        level = CROSS_OF_CONTROL[control.kind]
        around = net.neighbours(point)
        if len(around) != 2:
            yielding = control.kind in (ControlKind.STOP, ControlKind.GIVE_WAY)
            target = minor if yielding else everyone
            target[point] = max(level, target.get(point, Cross.NONE))
            if control.kind is ControlKind.SIGNALS:
                signalled.add(point)
            continue
        for (before, *_), (after, step_m, along, drivable) in ((around[0], around[1]), (around[1], around[0])):
            if not drivable or not _faces(control, along):
                continue
            ahead = net.junction_ahead(point, after, step_m)
            if ahead is None and _other_way_is_nearer(net, control, point, around, after):
                continue
            key = (before, point) if ahead is None else (ahead[0], ahead[1])
            entry[key] = max(level, entry.get(key, Cross.NONE))
            if ahead is None:
                nodes.append(point)
            elif control.kind is ControlKind.SIGNALS:
                signalled.add(ahead[1])
    return Stops(entry, minor, everyone, tuple(nodes), frozenset(signalled))


def _faces(control: Control, along: bool) -> bool:
    if control.facing in (Facing.UNSAID, Facing.BOTH):
        return True
    return along == (control.facing is Facing.FORWARD)


def _other_way_is_nearer(
    net: _Net, control: Control, point: int, around: list[tuple[int, float, bool, bool]], after: int
) -> bool:
    """Whether an unmarked sign stands before a junction in the other driving direction, and so only for that one."""
    if control.facing is not Facing.UNSAID:
        return False
    return any(
        drivable and net.junction_ahead(point, target, step_m) is not None
        for target, step_m, _, drivable in around
        if target != after
    )


def cross_at_heads(
    roads: Roads,
    chains: Chains,
    pieces: Pieces,
    stops: Stops,
    piece: NDArray[np.int64],
    reversed_: NDArray[np.bool_],
) -> NDArray[np.int8]:
    """`cross` at the head of directed links, int8 (M,).

    piece: int64 (M,) the piece a link drives, reversed_: bool (M,) against the order of its points.
    """
    ways = roads.ways
    way_of_piece = chains.way[pieces.begin]
    size = chains.point_count
    rank = _RANK[ways.functional_class]
    # legs at each node: by rank without ramps; rings of roundabouts; motorways
    ends = np.concatenate((pieces.tail, pieces.head))
    leg_way = np.concatenate((way_of_piece, way_of_piece))
    legs = np.bincount(ends, minlength=size)
    plain = ~ways.ramp[leg_way]
    by_rank = np.zeros((_RANKS, size), np.int32)
    for r in range(_RANKS):
        by_rank[r] = np.bincount(ends[plain & (rank[leg_way] == r)], minlength=size)
    at_least = np.cumsum(by_rank, axis=0)  # legs of rank r or greater roads
    ring = np.bincount(ends, ways.roundabout[leg_way], size) > 0

    way = way_of_piece[piece]
    head = np.where(reversed_, pieces.tail[piece], pieces.head[piece])
    tail = np.where(reversed_, pieces.head[piece], pieces.tail[piece])
    own_rank = rank[way]
    junction = legs[head] >= 3
    cross = np.zeros(piece.size, np.int8)

    # smaller road meets a greater one: at least two legs of a rank above its own pass through
    major_rank = (at_least >= 2).argmax(axis=0)[head]
    passes = at_least[-1][head] >= 2
    ranks_below = np.where(passes & junction, own_rank - major_rank, 0)
    cross[ranks_below == 1] = Cross.SMALL
    cross[ranks_below >= 2] = Cross.MEDIUM
    ramp_ends = ways.ramp[way] & passes & junction
    cross[ramp_ends] = np.where(major_rank[ramp_ends] <= FunctionalClass.TRUNK, Cross.SMALL, Cross.MEDIUM)
    cross[ring[head] & ~ways.roundabout[way]] = ROUNDABOUT_ENTRY
    cross[ways.roundabout[way]] = Cross.NONE

    signalled = np.zeros(size, np.bool_)
    signalled[list(stops.signalled)] = True
    cross[signalled[head]] = Cross.NONE
    minor = np.zeros(size, np.int8)
    minor[list(stops.minor)] = list(stops.minor.values())
    smaller = (ranks_below > 0) | (junction & ~ways.roundabout[way] & (own_rank >= _first_signed_rank(at_least)[head]))
    cross = np.where(smaller, np.maximum(cross, minor[head]), cross).astype(np.int8)
    everyone = np.zeros(size, np.int8)
    everyone[list(stops.everyone)] = list(stops.everyone.values())
    cross = np.maximum(cross, everyone[head])
    last = np.where(reversed_, chains.point[pieces.begin[piece]], chains.point[pieces.end[piece]])
    before = np.where(reversed_, chains.point[pieces.begin[piece] + 1], chains.point[pieces.end[piece] - 1])
    for k in np.flatnonzero(np.isin(last, [b for _, b in stops.entry])).tolist():
        cross[k] = max(int(cross[k]), int(stops.entry.get((int(before[k]), int(last[k])), Cross.NONE)))

    within = signalled[head] & signalled[tail] & (pieces.length_m[piece] < SAME_JUNCTION_M)
    cross[within] = Cross.NONE
    motorway_ahead = at_least[FunctionalClass.MOTORWAY][head] > 0
    cross[motorway_ahead | (ways.functional_class[way] == FunctionalClass.MOTORWAY)] = Cross.NONE
    return cross


def _first_signed_rank(at_least: NDArray[np.int32]) -> NDArray[np.int64]:
    """Rank from which a sign on the junction point holds: below the greatest road, or all where all are of one rank."""
    any_leg = at_least > 0
    greatest = any_leg.argmax(axis=0)
    smallest = (at_least == at_least[-1]).argmax(axis=0)
    result: NDArray[np.int64] = np.where(smallest > greatest, greatest + 1, greatest)
    return result
