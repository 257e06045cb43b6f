"""The expanded state graph, drawn out: what every search must find, by Bellman-Ford with fronts of labels.

There is no potential, no order of settling and no comparison of unequal states here. A front keeps every label that
another one in the same state does not beat in all that can matter on any way on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from energy.chain.kernels_link import link_energy
from energy.force.kernels_physics import accepted_j, cabin_energy_j, road_in_time
from energy.units import JOULE_PER_KWH, METRE_PER_KM, SECOND_PER_HOUR
from routing.places import LinkPosition
from routing.search.found import Limits
from routing.search.space import SearchSpace
from routing.weights import Weights

if TYPE_CHECKING:
    from collections.abc import Iterator

    from routing.graph.road_graph import RoadGraph

State = tuple[int, float, float, float]  # link, entry speed [m/s], probability of having stopped, offset [m]
Label = tuple[float, float, float]  # battery energy [J], time [s], distance [m] since departure
Step = tuple[float, float, float, State]  # the same three of one link, without climate, and the state after it


@dataclass(frozen=True, slots=True)
class Fronts:
    """Labels of each state, over all ways of at most so many links; whole if longer ways add nothing."""

    labels: dict[State, list[Label]]
    links: int
    whole: bool


class StateGraph:
    """States and transitions of one search space, made as they are reached."""

    def __init__(self, graph: RoadGraph, space: SearchSpace, limits: Limits, weights: Weights) -> None:
        self.graph, self.space, self.limits, self.weights = graph, space, limits, weights
        p = space.physics
        self._warms = p.tyre_time_s > 0.0
        self._timed = self._warms or p.cabin_start_w > 0.0
        self._lossy_tyres = self._warms and p.loss_per_n2 + p.loss_per_w > 0.0
        self._steps: dict[State, tuple[Step, ...]] = {}

    def fronts(self, starts: list[LinkPosition], most_links: int, most_labels: int) -> Fronts:
        """Bellman-Ford: after round n every way of n + 1 links is counted; at least all ways of 2 links are."""
        fresh: dict[State, list[Label]] = {(s.link_idx, 0.0, 0.0, s.offset_m): [(0.0, 0.0, 0.0)] for s in starts}
        kept = {state: list(labels) for state, labels in fresh.items()}
        count, links = len(kept), 1
        while fresh and links < most_links and count <= most_labels:
            reached: dict[State, list[Label]] = {}
            for state, labels in fresh.items():
                for label in labels:
                    if label not in kept[state]:
                        continue  # beaten in the meantime
                    for after, made in self._driven_on(state, label):
                        front = kept.setdefault(after, [])
                        if any(self._beats(other, made) for other in front):
                            continue
                        front[:] = [other for other in front if not self._beats(made, other)]
                        front.append(made)
                        reached.setdefault(after, []).append(made)
                        count += 1
            fresh, links = reached, links + 1
        return Fronts(kept, links, not fresh)

    def arrivals(self, fronts: Fronts, goal: LinkPosition) -> Iterator[tuple[float, Label]]:
        """Cost and label of each way of coming to rest at a place within the limits."""
        g, p = self.space.arrays, self.space.physics
        limit = float(g.speed_limit_mps[goal.link_idx])
        for (link, v, stopped, offset), labels in fronts.labels.items():
            if link != goal.link_idx or goal.offset_m <= offset:
                continue
            ds = goal.offset_m - offset
            for label in labels:
                road = road_in_time(p, g.roads, link, label[1], ds / limit)
                energy, time, _ = link_energy(p, road, ds, v, stopped, limit, limit, 1.0, 0.0)
                made = self._charged(label, energy, time, ds)
                if made is not None:
                    yield self.cost(made), made

    def arrivals_at_ends(self, fronts: Fronts) -> dict[int, float]:
        """Least battery energy of coming to rest at the end of each link that can be reached so [J]."""
        ends = {state[0]: LinkPosition(state[0], float(self.graph.length_m[state[0]])) for state in fronts.labels}
        by_link: dict[int, Fronts] = {link: Fronts({}, fronts.links, fronts.whole) for link in ends}
        for state, labels in fronts.labels.items():
            by_link[state[0]].labels[state] = labels
        least = {}
        for link, end in ends.items():
            energies = [label[0] for _, label in self.arrivals(by_link[link], end)]
            if energies:
                least[link] = min(energies)
        return least

    def cheapest(self, fronts: Fronts, goal: LinkPosition) -> float:
        """Least cost of coming to rest at a place, inf where no way does."""
        return min((cost for cost, _ in self.arrivals(fronts, goal)), default=math.inf)

    def cost(self, label: Label) -> float:
        """What the weighting makes of energy, time and distance."""
        w = self.weights
        return (
            w.energy * label[0] / JOULE_PER_KWH
            + w.time * label[1] / SECOND_PER_HOUR
            + w.distance * label[2] / METRE_PER_KM
        )

    def _beats(self, a: Label, b: Label) -> bool:
        """Whether a label is worth no less than another one in the same state, whatever follows.

        With the same state both take the same times from here on. More charge never turns into less. Later means a
        warmer cabin and warmer tyres, which take no more; where losses grow with the square of the force, warmer
        tyres may cost more in braking, so that only equal times can be compared.
        """
        if a[0] > b[0] or (self.weights.distance > 0.0 and a[2] > b[2]):
            return False
        if self.weights.time > 0.0 and a[1] > b[1]:
            return False
        if self._timed and a[1] < b[1]:
            return False
        return not (self._lossy_tyres and a[1] != b[1])

    def _charged(self, label: Label, energy: float, time: float, ds: float) -> Label | None:
        """The label after a drive, with climate and the battery's limits; None beyond the reserve."""
        p, full = self.space.physics, self.limits.least_energy_j
        energy = accepted_j(p, label[0], energy + cabin_energy_j(p, label[1], label[1] + time), full)
        used = max(label[0] + energy, full)
        return None if used > self.limits.most_energy_j else (used, label[1] + time, label[2] + ds)

    def _driven_on(self, state: State, label: Label) -> Iterator[tuple[State, Label]]:
        for energy, time, ds, after in self._transitions(state, label[1]):
            made = self._charged(label, energy, time, ds)
            if made is not None:
                yield after, made

    def _transitions(self, state: State, clock_s: float) -> tuple[Step, ...]:
        """Every permitted way on from a state; only tyres that warm up make it depend on the clock."""
        known = None if self._warms else self._steps.get(state)
        if known is not None:
            return known
        g, p = self.space.arrays, self.space.physics
        link, v, stopped, offset = state
        limit, ds = float(g.speed_limit_mps[link]), float(g.length_m[link]) - offset
        road = road_in_time(p, g.roads, link, clock_s, ds / limit)
        p_stop, wait = float(g.stop_probability_frac[link]), float(g.stop_time_s[link])
        steps = []
        for following in self.graph.successors(link).tolist():
            energy, time, end = link_energy(
                p, road, ds, v, stopped, limit, float(g.speed_limit_mps[following]), p_stop, wait
            )
            steps.append((energy, time, ds, (following, end, p_stop, 0.0)))
        self._steps[state] = tuple(steps)
        return self._steps[state]
