"""What a way does to a battery whatever charge it begins with, and what no way between two places is better than."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.units import JOULE_PER_KWH, SECOND_PER_HOUR
from routing.weights import Weights

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.places import LinkPosition
    from routing.search.found import FoundPath

STEPS: Final = 6  # of the bound between two ways that are neighbours
ROUNDING_FRAC: Final = 1e-9
SAME_FRAC: Final = 1e-8  # beyond what lines allow for
ROUNDING_J: Final = 1e-3
LIKELY_FRAC: Final = 0.997  # of its time, that a way takes which takes less energy than is likely; assumed
THRIFT_FRACS: Final = (0.1, 0.3, 0.5)  # of its energy, that it may take less for the time that is worth that; assumed
UNSURE_FRAC: Final = 0.1  # by how much two guesses of its energy differ where more than the first of these is tried
NO_LINKS: Final = np.empty(0, np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A way as a profile of the battery: charge s at its beginning becomes min(s − energy_j, capacity − spill_j).

    It takes no less than need_j of charge above the reserve: the most that any of its beginnings takes, ≥ 0. spill_j:
    the most that any of its endings takes, which a full battery lacks at the end. longest_j: the most that any stretch
    of it takes, which a full battery must have above the reserve. links: int32 (n,), from start to goal; none of a
    bound, which no way is better than and which may be none itself.
    """

    time_s: float
    energy_j: float
    need_j: float
    spill_j: float
    longest_j: float
    distance_m: float = 0.0
    links: NDArray[np.int32] = field(default_factory=lambda: NO_LINKS)
    start: LinkPosition | None = None
    goal: LinkPosition | None = None
    is_bound: bool = False

    @property
    def held_bytes(self) -> int:
        """Memory of it [B]."""
        return 200 + self.links.nbytes


def profile_of(path: FoundPath, energy_j: NDArray[np.float64], time_s: float, distance_m: float) -> Way:
    """The way of a path, of what each of its links takes without limits, float64 (n,) [J]."""
    used = np.concatenate(([0.0], np.cumsum(energy_j)))
    return Way(
        time_s=time_s,
        energy_j=float(used[-1]),
        need_j=float(used.max()),
        spill_j=float(used[-1] - used.min()),
        longest_j=float((used - np.minimum.accumulate(used)).max()),
        distance_m=distance_m,
        links=np.array(path.links, np.int32),
        start=path.start,
        goal=path.goal,
    )


def bound_of(time_s: float, energy_j: float) -> Way:
    """What no way is better than that takes at least so much time and energy."""
    need_j = max(energy_j, 0.0)
    return Way(time_s, energy_j, need_j, need_j, need_j, is_bound=True)


def likely_between(weights: Weights, ways: Sequence[tuple[Way | None, Way | None]]) -> tuple[Way, ...]:
    """What ways from one place to another likely take, that cost no more than any by weights; none where unknown.

    ways: the best by weights to, or from, a third place that both are on the way to, or from, the longer and the
    shorter of them: no way costs less than the difference of theirs.
    """
    a_second, a_joule = weights.time / SECOND_PER_HOUR, weights.energy / JOULE_PER_KWH
    likely = []
    for longer, shorter in ways:
        if longer is not None and shorter is not None:
            time_s, energy_j = longer.time_s - shorter.time_s, longer.energy_j - shorter.energy_j
            likely.append((a_second * time_s + a_joule * energy_j, time_s, energy_j))
    if not likely:
        return ()
    cost, time_s, energy_j = max(likely)
    if a_second <= 0.0:
        return (bound_of(max(time_s, 0.0), energy_j),)
    energies = [likely_j for _, _, likely_j in likely]
    low_j, high_j = min(energies), max(energies)
    unsure = high_j - low_j > UNSURE_FRAC * abs(low_j) or len(likely) < 2
    taken = {energy_j, low_j} if unsure else {energy_j}
    taken |= {low_j - share * abs(low_j) for share in (THRIFT_FRACS if unsure else THRIFT_FRACS[:1])}
    return tuple(
        bound_of(max(LIKELY_FRAC * (cost - a_joule * least_j) / a_second, 0.0), least_j) for least_j in sorted(taken)
    )


@dataclass(frozen=True, slots=True)
class Line:
    """No way has a_second · time + a_joule · energy below cost: what a search by a weighting proves."""

    a_second: float
    a_joule: float
    cost: float

    def is_of(self, weights: Weights) -> bool:
        """Whether it is of a search by these weights."""
        return self.a_second == weights.time / SECOND_PER_HOUR and self.a_joule == weights.energy / JOULE_PER_KWH

    @classmethod
    def of(cls, weights: Weights, cost: float) -> Line:
        """Of a search by weights of time and energy, and the least cost that it found."""
        slack = ROUNDING_FRAC * abs(cost)
        return cls(weights.time / SECOND_PER_HOUR, weights.energy / JOULE_PER_KWH, cost - slack)


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Ways between two places that are known, and what is proven of all others.

    ways: none as good as another one in time, energy, need, spill and longest. lines: of searches. whole_s, whole_j:
    all ways that take no longer, and no more energy, are among them or no better than one of them. given_up: whether
    comparing all ways took too much room.
    """

    ways: tuple[Way, ...]
    lines: tuple[Line, ...]
    whole_s: float = 0.0
    whole_j: float = math.inf
    given_up: bool = False
    _bounds: list[tuple[Way, ...]] = field(default_factory=list, init=False, repr=False)  # once they are asked for

    @property
    def held_bytes(self) -> int:
        """Memory of it [B]."""
        return 1000 + sum(way.held_bytes for way in self.ways) + 100 * len(self.lines)

    def holds(self, weights: Weights) -> bool:
        """Whether the best way by weights is among those known."""
        return self.is_all or any(line.is_of(weights) for line in self.lines)

    def best(self, weights: Weights) -> Way | None:
        """The known way that costs least by weights."""
        a_second, a_joule = weights.time / SECOND_PER_HOUR, weights.energy / JOULE_PER_KWH
        return min(self.ways, key=lambda way: a_second * way.time_s + a_joule * way.energy_j, default=None)

    @property
    def is_all(self) -> bool:
        """Whether all ways are known."""
        return self.whole_s == self.whole_j == math.inf

    def is_whole(self, most_s: float, most_j: float) -> bool:
        """Whether all ways that take no more are known, or some where nothing says how far to compare on."""
        is_whole = self.whole_s >= most_s or (most_s == math.inf and self.whole_s > 0.0)
        return is_whole and self.whole_j >= most_j

    def least_cost(self, weights: Weights) -> float:
        """No way costs less by weights; inf where there is no way, −inf where nothing is known by these weights."""
        if not self.ways:
            return math.inf
        if self.is_all:
            unit = Line.of(weights, 0.0)
            return min(unit.a_second * way.time_s + unit.a_joule * way.energy_j for way in self.ways)
        return max((line.cost for line in self.lines if line.is_of(weights)), default=-math.inf)

    def bounds(self) -> tuple[Way, ...]:
        """Bounds such that every way is one of ways or no better than one of ways or bounds, up to rounding."""
        if not self._bounds:
            self._bounds.append(self._made_bounds())
        return self._bounds[0]

    def _made_bounds(self) -> tuple[Way, ...]:
        if not self.ways or self.is_all:
            return ()
        front = front_of([(way.time_s, way.energy_j) for way in self.ways])
        # a way with the time and energy of a known one, of which less is needed on the way
        found = [
            bound_of(way.time_s, way.energy_j)
            for way in self.ways
            if (way.time_s, way.energy_j) in front
            and max(way.need_j, way.spill_j, way.longest_j) > max(way.energy_j, 0.0) + ROUNDING_J
        ]
        edges = [(self._least_s(math.inf), math.inf), *front, (math.inf, self._least_j(math.inf))]
        between: list[tuple[float, float]] = []
        for (before_s, before_j), (after_s, _) in pairwise(edges):
            between += self._between(before_s, before_j, after_s)
        found = [way for way in found if way.time_s > self.whole_s or way.energy_j > self.whole_j]
        if 0.0 < self.whole_s < math.inf:  # slower ways than those that were compared, of which less may be needed
            found.append(bound_of(self.whole_s, self._least_j(math.inf)))
        if self.whole_j < math.inf:  # as well as such that take more
            found.append(bound_of(self._least_s(math.inf), self.whole_j))
        slow = front_of([(max(time_s, self.whole_s), energy_j) for time_s, energy_j in between])
        return (*found, *(bound_of(*point) for point in slow if point[0] < math.inf))

    def chord_at(self, bound: Way) -> Weights | None:
        """The weighting in which the two known ways beside a bound are equal; None where it is known already."""
        front = front_of([(way.time_s, way.energy_j) for way in self.ways])
        for (before_s, before_j), (after_s, after_j) in pairwise(front):
            if before_s <= bound.time_s < after_s and bound.energy_j < before_j:
                energy = (after_s - before_s) / SECOND_PER_HOUR
                time = (before_j - after_j) / JOULE_PER_KWH
                weights = Weights(energy / max(energy, time), time / max(energy, time), 0.0)
                new = Line.of(weights, 0.0)
                slope = new.a_joule / new.a_second
                known = any(
                    line.a_second > 0.0 and abs(line.a_joule / line.a_second - slope) <= SAME_FRAC * slope
                    for line in self.lines
                )
                return None if known else weights
        return None

    def _between(self, before_s: float, before_j: float, after_s: float) -> list[tuple[float, float]]:
        """Time and energy of bounds on ways that are faster than after and take less than its neighbour before."""
        low_s, low_j = max(before_s, self._least_s(before_j)), self._least_j(after_s)
        enough_j = before_j - ROUNDING_J - SAME_FRAC * (abs(before_j) if before_j < math.inf else 0.0)
        if low_s >= after_s * (1.0 - SAME_FRAC) or low_j >= enough_j:
            return []
        if not math.isfinite(after_s):
            return [(low_s, low_j)]
        times = np.linspace(low_s, after_s, STEPS + 1).tolist()
        energies = [self._least_j(to_s) for to_s in times[1:]]
        return [(from_s, energy_j) for from_s, energy_j in zip(times, energies, strict=False) if energy_j < enough_j]

    def _least_j(self, time_s: float) -> float:
        """No way that takes at most a time takes less energy [J]."""
        return max(
            (
                (line.cost - (line.a_second * time_s if line.a_second > 0.0 else 0.0)) / line.a_joule
                for line in self.lines
                if line.a_joule > 0.0
            ),
            default=-math.inf,
        )

    def _least_s(self, energy_j: float) -> float:
        """No way that takes at most an energy takes less time [s]."""
        return max(
            (
                (line.cost - (line.a_joule * energy_j if line.a_joule > 0.0 else 0.0)) / line.a_second
                for line in self.lines
                if line.a_second > 0.0
            ),
            default=0.0,
        )


def front_of(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points that no other one is as good as in both, by the first."""
    kept: list[tuple[float, float]] = []
    for point in sorted(set(points)):
        if not kept or point[1] < kept[-1][1]:
            kept.append(point)
    return kept


def undominated(ways: Sequence[Way]) -> tuple[Way, ...]:
    """Ways that no other one is as good as in all that they do to a battery; the first of equal ones."""
    kept: list[Way] = []
    for way in sorted(ways, key=_takes):
        if not any(
            all(a <= b + 1e-9 * abs(b) for a, b in zip(_takes(other), _takes(way), strict=True)) for other in kept
        ):
            kept.append(way)
    return tuple(kept)


def _takes(way: Way) -> tuple[float, ...]:
    return way.time_s, way.energy_j, way.need_j, way.spill_j, way.longest_j


def joined(first: Way, second: Way) -> Way:
    """One way after the other as a profile of the battery; its links are those of neither."""
    return Way(
        time_s=first.time_s + second.time_s,
        energy_j=first.energy_j + second.energy_j,
        need_j=max(first.need_j, first.energy_j + second.need_j),
        spill_j=max(first.spill_j + second.energy_j, second.spill_j),
        longest_j=max(first.longest_j, second.longest_j, first.spill_j + second.need_j),
        distance_m=first.distance_m + second.distance_m,
        is_bound=first.is_bound or second.is_bound,
    )


def stay_of(seconds: float, gain_j: float, least_j: float) -> Way:
    """A fixed stay as a profile: gain_j is charged, up to a full battery, after arriving least_j above the reserve."""
    return Way(seconds, -gain_j, least_j, 0.0, least_j)
