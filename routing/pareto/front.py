"""The Pareto set of time and energy: routes of which one is about as good as any other way, and the proof of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from energy.battery import soc_along
from energy.chain.chain import LinkModel, StopRule
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, SECOND_PER_HOUR
from routing.errors import NoPathError, TimeUpError
from routing.pareto.all_ways import Cover, is_applicable, uncovered_ways
from routing.pareto.bounds import ROUNDING_FRAC, LowerBounds, Trade, chosen, undominated
from routing.route.best_path import method_name
from routing.route.limits import charge_limits
from routing.route.route import ParetoClaim, ParetoProof, SearchStats
from routing.route.via import CHARGE_SLACK_FRAC, WayFinder, same_place
from routing.search.found import Limits, PathOptions
from routing.search.search import find_path
from routing.search.space import potential_share
from routing.weights import ECO, FASTEST, Weights

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.places import LinkPosition, LinkSpan
    from routing.queries import ParetoSettings, RouteQuery
    from routing.route.best_path import RouteSearch
    from routing.search.found import SearchCounts

SWEEPS: Final = 8  # weightings; a search of all ways takes about as long as that many
SWEEPS_ALONE: Final = 48  # where all ways can't be searched
LEAST_REFERENCE_J: Final = 1.0
# of ε up to which routes cover ways: half leaves the rest to the choice among them; more where that takes too much room
COVERED_SHARES: Final = (0.5, 3.0)


@dataclass(frozen=True, slots=True)
class ParetoWay:
    """A way of a Pareto set.

    spans: all stretches. first: for each leg, the position of its first stretch, and their number at the end. trade:
    time [s] and charge used [J]. kept: whether it keeps the reserve. weights: what it is best in, None for nothing.
    """

    spans: tuple[LinkSpan, ...]
    first: tuple[int, ...]
    trade: Trade
    kept: bool
    weights: Weights | None


@dataclass(frozen=True, slots=True)
class ParetoFront:
    """Ways by time, what is proven of them, the searches done, and whether one of them relaxed dominance.

    unpaid_j: as of SearchCounts, the most of all searches.
    """

    ways: tuple[ParetoWay, ...]
    claim: ParetoClaim
    stats: tuple[SearchStats, ...]
    crowded: bool
    unpaid_j: float


class ParetoSearch:
    """The Pareto set of one query.

    settings: ε and the most routes. places: each by its positions on both directions of its road.
    """

    def __init__(
        self,
        search: RouteSearch,
        query: RouteQuery,
        settings: ParetoSettings,
        places: Sequence[tuple[LinkPosition, ...]],
    ) -> None:
        self._search, self._query, self._settings, self._places = search, query, settings, places
        self._space = search.space_of(query, query.vehicle)
        self._capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        self._most_j = charge_limits(query.soc_frac, query.reserve_soc_frac, self._capacity_j).most_energy_j
        self._bounds = LowerBounds()
        self._ways: dict[tuple[LinkSpan, ...], ParetoWay] = {}
        self._stats: list[SearchStats] = []
        self._crowded, self._unpaid_j = False, 0.0

    def front(self) -> ParetoFront:
        """Ways that come within ε of every way that keeps the reserve, as few as that takes, and what is proven.

        Raises NoPathError, NegativeCycleError, SearchLimitError.
        """
        eco, least_proven = self._eco()
        if not eco.spans or not eco.kept:
            what = "no way keeps the reserve on this charge" if eco.spans else "start and goal are the same place"
            claim = ParetoClaim(None, None, 0.0, 1, ParetoProof.NONE, what)
            return ParetoFront((eco,), claim, tuple(self._stats), self._crowded, self._unpaid_j)
        reference_j = self._reference_j(eco)
        unproven = self._unproven()
        compares = (
            unproven is None
            and len(self._places) == 2
            and is_applicable(self._space.physics, carries=self._space.arrays.carries)
        )
        proof, slow = ParetoProof.WEIGHTINGS, ""
        try:
            self._sweep(reference_j, SWEEPS if compares else SWEEPS_ALONE)
            gap = self._gap(reference_j)
            if compares and gap > self._settings.epsilon_frac:
                longest_s = eco.trade.time_s * (1.0 + ROUNDING_FRAC) if least_proven else math.inf
                shares = (share * self._settings.epsilon_frac for share in COVERED_SHARES)
                if any(self._compare_all(share, longest_s, reference_j) for share in shares if share < gap):
                    proof = ParetoProof.ALL_WAYS
        except TimeUpError as error:  # what is found is answered, with what is proven of it
            slow = f"after {error.limit_s:g} s too few ways are found"
        return self._answered(
            reference_j, proof, unproven, slow or "too many states on very short links to compare all ways"
        )

    def _answered(self, reference_j: float, proof: ParetoProof, unproven: str | None, boundless: str) -> ParetoFront:
        """The choice among the ways found, and the claim on it.

        unproven: why nothing can be claimed, boundless: why there may be no bound.
        """
        front = _undominated([way for way in self._ways.values() if way.kept])
        trades = [way.trade for way in front]
        asked = self._settings
        few = chosen(self._bounds, trades, reference_j, self._most_j, asked.epsilon_frac, asked.most)
        gap = self._bounds.gap([trades[k] for k in few], reference_j, self._most_j)
        if unproven is None and not math.isfinite(gap):
            unproven = boundless
        if unproven is None:
            claim = ParetoClaim(gap, gap * reference_j, reference_j, len(front), proof)
        else:
            claim = ParetoClaim(None, None, reference_j, len(front), ParetoProof.NONE, unproven)
        ways = tuple(front[k] for k in few)
        return ParetoFront(ways, claim, tuple(self._stats), self._crowded, self._unpaid_j)

    def _eco(self) -> tuple[ParetoWay, bool]:
        """The way of least energy under the battery's limits, and whether it is proven that none uses less."""
        best = WayFinder(self._search, self._query, self._places).best(ECO)
        for found in best.found:
            self._count(found.counts, found.method)
        if not best.spans:
            return ParetoWay((), best.first, Trade(0.0, 0.0), True, ECO), False
        way = self._driven(best.spans, best.first, ECO)
        proven = way.kept and self._is_best_by_legs() and not self._crowded and self._unpaid_j == 0.0
        if proven:
            self._bounds.add_weighting(ECO, way.trade.energy_j / JOULE_PER_KWH)
        return way, proven

    def _unproven(self) -> str | None:
        """Why nothing can be proven, None where something can."""
        if self._query.stop_rule is StopRule.COUNTED:
            return "stops 'counted' depend on the way so far; the search used 'expected'"
        if self._query.link_model is LinkModel.PRINTED:
            return "link model 'printed' does not conserve energy"
        if not self._is_best_by_legs():
            return "ways over via points are put together leg by leg while cabin or tyres still warm up"
        return None

    def _is_best_by_legs(self) -> bool:
        """Whether the best legs make the best way: links then take the same whenever they are driven."""
        physics = self._space.physics
        return len(self._places) == 2 or (physics.cabin_start_w == 0.0 and physics.tyre_time_s == 0.0)

    def _reference_j(self, eco: ParetoWay) -> float:
        """Charge that the way of least energy uses beyond its gain in potential, ≥ 0 by lemma 1 of docs/search.md."""
        physics, g = self._space.physics, self._space.arrays
        start, goal = (
            float(g.tail_height_m[place.link_idx] + g.grade_frac[place.link_idx] * place.offset_m)
            for place in (self._places[0][0], self._places[-1][0])
        )
        gain_j = potential_share(physics) * physics.weight_n * (goal - start)
        return max(eco.trade.energy_j - gain_j, LEAST_REFERENCE_J)

    def _gap(self, reference_j: float) -> float:
        """The ε that is proven of all ways found."""
        front = _undominated([way for way in self._ways.values() if way.kept])
        return self._bounds.gap([way.trade for way in front], reference_j, self._most_j)

    def _sweep(self, reference_j: float, most: int) -> None:
        """Best ways by weightings, each between two neighbours that are too far apart, without battery limits."""
        self._search_weighting(FASTEST)
        tried: set[tuple[Trade, Trade]] = set()
        for _ in range(most):
            front = [way.trade for way in _undominated(list(self._ways.values()))]
            steps = [step for step in pairwise(front) if step not in tried]
            gaps = [self._bounds.step_gap(*step, reference_j, self._most_j) for step in steps]
            if max(gaps, default=0.0) <= self._settings.epsilon_frac:
                return
            before, after = widest = steps[max(range(len(gaps)), key=gaps.__getitem__)]
            tried.add(widest)
            energy = (after.time_s - before.time_s) / SECOND_PER_HOUR
            time = (before.energy_j - after.energy_j) / JOULE_PER_KWH
            self._search_weighting(Weights(energy / max(energy, time), time / max(energy, time), 0.0))

    def _search_weighting(self, weights: Weights) -> None:
        """Add the best way by a weighting without battery limits, and that no way costs less."""
        spans: tuple[LinkSpan, ...] = ()
        first, cost, clock_s, crowded = [0], 0.0, 0.0, False
        here = self._places[0]
        for k, there in enumerate(self._places[1:]):
            if not same_place(here, there):
                options = PathOptions(label_limit=self._search.label_limit, begin_s=clock_s)
                path, counts = find_path(self._space, self._search.pool, weights, Limits(), here, there, options)
                if path is None:
                    raise NoPathError("no permitted way leads from start to goal")
                stretches = self._search.spans(path)
                spans += (*stretches[:-1], replace(stretches[-1], rest=k + 2 < len(self._places)))
                cost += path.cost
                clock_s += path.time_s - self._space.carried_s(path.links)
                crowded |= counts.crowded > 0
                self._count(counts, method_name(counts, pareto=False))
                here = there
            first.append(len(spans))
        self._driven(spans, tuple(first), weights)
        if self._is_best_by_legs() and not crowded:
            self._bounds.add_weighting(weights, cost)

    def _compare_all(self, epsilon: float, longest_s: float, reference_j: float) -> bool:
        """Add ways until all are covered within an ε; False where that takes too much room."""
        points = [way.trade for way in _undominated([way for way in self._ways.values() if way.kept])]
        cover = Cover(
            points=tuple((point.time_s, point.energy_j) for point in points),
            epsilon_frac=epsilon,
            slack_j=epsilon * reference_j,
            most_s=longest_s,
            most_j=self._most_j * (1.0 + ROUNDING_FRAC),
        )
        found = uncovered_ways(self._space, self._places[0], self._places[1], cover)
        if found is None:
            return False
        self._stats.append(SearchStats(found.labels_made, found.labels_settled, found.seconds, "pareto"))
        for path in found.paths:
            spans = self._search.spans(path)
            self._driven(spans, (0, len(spans)), None)
        least = [Trade(path.time_s, path.energy_j) for path in found.paths]
        self._bounds.add_cover([*points, *least], epsilon, epsilon * reference_j)
        return True

    def _driven(self, spans: tuple[LinkSpan, ...], first: tuple[int, ...], weights: Weights | None) -> ParetoWay:
        """A way with what it takes under the battery's limits, kept among those found."""
        known = self._ways.get(spans)
        if known is not None:
            return known
        query = self._query
        energy_j, time_s = self._search.link_energies(query, spans, query.soc_frac)
        soc, _ = soc_along(energy_j, query.soc_frac, query.vehicle.usable_capacity_wh)
        kept = bool(soc.min() >= query.reserve_soc_frac - CHARGE_SLACK_FRAC)
        trade = Trade(float(time_s.sum()), (query.soc_frac - float(soc[-1])) * self._capacity_j)
        self._ways[spans] = way = ParetoWay(spans, first, trade, kept, weights)
        return way

    def _count(self, counts: SearchCounts, method: str) -> None:
        self._crowded |= counts.crowded > 0
        self._unpaid_j = max(self._unpaid_j, counts.unpaid_j)
        self._stats.append(SearchStats(counts.labels_made, counts.labels_settled, counts.seconds, method))


def _undominated(ways: Sequence[ParetoWay]) -> list[ParetoWay]:
    """Ways that no other one is as good as in both time and energy, by time."""
    return [ways[k] for k in undominated([way.trade for way in ways])]


def names_of(ways: Sequence[ParetoWay]) -> list[str]:
    """A name for each way: eco for the last, fastest for the first if no limit forbids that, a number for others."""
    names = [f"pareto-{k + 1}" for k in range(len(ways))]
    if ways[0].weights == FASTEST:
        names[0] = "fastest"
    names[-1] = "eco"
    return names
