"""A way over places in a given order, put together leg by leg with the charge and the clock carried on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

from energy.battery import soc_along
from energy.units import JOULE_PER_KWH, JOULE_PER_WH
from routing.route.best_path import Leg
from routing.weights import ECO, cost_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from routing.places import LinkPosition, LinkSpan
    from routing.queries import RouteQuery
    from routing.route.best_path import BestPath, RouteSearch
    from routing.weights import Weights

SAME_PLACE_M: Final = 0.5
CHARGE_SLACK_FRAC: Final = 1e-9
ROUNDING_FRAC: Final = 1e-6  # searches and simulation add up in another order


@dataclass(frozen=True, slots=True)
class Way:
    """A way over places in order.

    spans: all stretches; the one that ends at a via point rests there. first: for each leg, the position of its first
    stretch, and their number at the end; a leg between places that are the same has none. found: the searches done.
    soc_frac, clock_s: at each place, as the search saw them, kept: whether never below the reserve; without via points
    they are not asked for. notes: what is not proven.
    """

    spans: tuple[LinkSpan, ...]
    first: tuple[int, ...]
    found: tuple[BestPath, ...]
    soc_frac: tuple[float, ...] = ()
    clock_s: tuple[float, ...] = ()
    kept: bool = True
    notes: tuple[str, ...] = ()

    @property
    def free_cost(self) -> float:
        """What the legs cost without charge limits: no way costs less."""
        return sum(found.free_cost for found in self.found)


class WayFinder:
    """Ways over the places of one query; keeps the one of least energy, which several weightings may need.

    places: each by its positions on both directions of its road.
    """

    def __init__(self, search: RouteSearch, query: RouteQuery, places: Sequence[tuple[LinkPosition, ...]]) -> None:
        self._search, self._query, self._places = search, query, places

    @cached_property
    def _least_energy(self) -> Way:
        return self._leg_by_leg(ECO)

    def best(self, weights: Weights) -> Way:
        """The best way over the places for a weighting.

        Of legs that are each the best for the state in which they begin. Where that runs the charge out on the way and
        the least energy would not, legs leave what the least energy needs for the rest; where nothing keeps the charge
        limits, all legs are those of least energy. docs/search.md says when this is the best way as a whole.
        Raises NoPathError, NegativeCycleError, SearchLimitError.
        """
        if len(self._places) == 2:
            return self._single_leg(weights)
        energy_only = weights.time == 0.0 and weights.distance == 0.0
        way = self._least_energy if energy_only else self._leg_by_leg(weights, to_the_end=False)
        notes: tuple[str, ...] = ()
        if not energy_only:
            free_cost = way.free_cost
            if not way.kept:
                way = self._least_energy
                if way.kept:
                    thrifty = self._leg_by_leg(weights, spare=way)
                    free_cost = thrifty.free_cost
                    way = thrifty if thrifty.kept else way
            if way.kept:
                notes = _not_the_least(self._query, weights, way, free_cost)
        return replace(way, notes=notes + self._still_warming(weights, way))

    def _single_leg(self, weights: Weights) -> Way:
        here, there = self._places
        if same_place(here, there):
            return Way((), (0, 0), ())
        leg = Leg(here, there, self._query.soc_frac, self._query.reserve_soc_frac)
        best = self._search.best_path(self._query, weights, leg)
        spans = self._search.spans(best.path)
        return Way(spans, (0, len(spans)), (best,), notes=_bounded(best))

    def _leg_by_leg(self, weights: Weights, spare: Way | None = None, *, to_the_end: bool = True) -> Way:
        """Legs that are each the best for the state in which they begin.

        spare: a way that keeps the limits; each leg leaves what the rest of it needs, or is that of spare.
        to_the_end: otherwise it ends with the first leg that does not keep the limits.
        """
        places = self._places
        needed = [self._query.reserve_soc_frac] * len(places) if spare is None else self._charge_needed(spare)
        spans: tuple[LinkSpan, ...] = ()
        first: list[int] = [0]
        found: list[BestPath] = []
        soc, clock, kept = [self._query.soc_frac], [0.0], True
        here = places[0]
        for k, there in enumerate(places[1:]):
            if not same_place(here, there) and (kept or to_the_end):
                name = _leg_name(k, len(places))
                driving_s = clock[-1] - self._carried_s(spans)
                leg = Leg(here, there, soc[-1], needed[k + 1], spans, driving_s, name, len(places) - 1)
                best = self._search.best_path(self._query, weights, leg)
                stretches = _ending_at(self._search.spans(best.path), rest=k + 2 < len(places))
                if spare is not None and not self._leaves((*spans, *stretches), needed[k + 1]):
                    stretches = spare.spans[spare.first[k] : spare.first[k + 1]]
                spans += stretches
                found.append(best)
                charge, time_s = self._driven(spans)
                soc.append(float(charge[-1]))
                clock.append(float(time_s.sum()))
                kept = kept and float(charge.min()) >= self._query.reserve_soc_frac - CHARGE_SLACK_FRAC
                here = there
            else:
                soc.append(soc[-1])
                clock.append(clock[-1])
            first.append(len(spans))
        return Way(spans, tuple(first), tuple(found), tuple(soc), tuple(clock), kept)

    def _carried_s(self, spans: tuple[LinkSpan, ...]) -> float:
        """Time on board of ferries, which the clock of climate and tyres does not count [s]."""
        return self._search.space_of(self._query, self._query.vehicle).carried_s([span.link_idx for span in spans])

    def _driven(self, spans: tuple[LinkSpan, ...]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Charge at the end of each stretch and the time that it takes [s], float64 (n,)."""
        energy_j, time_s = self._search.link_energies(self._query, spans, self._query.soc_frac)
        return soc_along(energy_j, self._query.soc_frac, self._query.vehicle.usable_capacity_wh)[0], time_s

    def _leaves(self, spans: tuple[LinkSpan, ...], needed_frac: float) -> bool:
        """Whether stretches keep the reserve and leave a charge at their end."""
        charge, _ = self._driven(spans)
        return bool(charge.min() >= self._query.reserve_soc_frac) and float(charge[-1]) >= needed_frac

    def _charge_needed(self, way: Way) -> list[float]:
        """Charge at each place with which the rest of a way keeps the reserve."""
        reserve_frac = self._query.reserve_soc_frac
        energy_j, _ = self._search.link_energies(self._query, way.spans, self._query.soc_frac)
        used_frac = energy_j / (self._query.vehicle.usable_capacity_wh * JOULE_PER_WH)
        needed = [reserve_frac] * (used_frac.size + 1)
        for k in range(used_frac.size - 1, -1, -1):
            needed[k] = max(reserve_frac, needed[k + 1] + float(used_frac[k]))
        return [needed[k] for k in way.first]

    def _still_warming(self, weights: Weights, way: Way) -> tuple[str, ...]:
        """Most that a better way could take less because cabin and tyres warm up (docs/search.md, lemma 9)."""
        space = self._search.space_of(self._query, self._query.vehicle)
        bound_j = sum(
            space.still_owed_j(way.clock_s[k] - self._carried_s(way.spans[: way.first[k]]))
            for k in range(1, len(way.first) - 1)
            if way.first[k + 1] > way.first[k] > 0
        )
        if bound_j * weights.energy == 0.0:
            return ()
        return (
            "is put together leg by leg while cabin or tyres still warm up: "
            f"a better one could take at most {bound_j / JOULE_PER_KWH:.2g} kWh less",
        )


def same_place(here: tuple[LinkPosition, ...], there: tuple[LinkPosition, ...]) -> bool:
    """Whether two places on roads are less than half a metre apart on the same road."""
    return here[0].link_idx == there[0].link_idx and abs(here[0].offset_m - there[0].offset_m) < SAME_PLACE_M


def _leg_name(leg: int, places: int) -> str:
    names = ["start", *(f"via[{k}]" for k in range(places - 2)), "goal"]
    return f"{names[leg]} to {names[leg + 1]}"


def _ending_at(spans: tuple[LinkSpan, ...], *, rest: bool) -> tuple[LinkSpan, ...]:
    return (*spans[:-1], replace(spans[-1], rest=rest))


def _bounded(best: BestPath) -> tuple[str, ...]:
    """What a leg's own search says of a better one."""
    if best.short_by <= 0.0:
        return ()
    return (
        "is good but not proven best: near the battery's limits too many ways compare; "
        f"a better one would cost at most {best.short_by:.3g} less (of {best.short_by + best.bound:.3g})",
    )


def _not_the_least(query: RouteQuery, weights: Weights, way: Way, free_cost: float) -> tuple[str, ...]:
    """By how much a better way could cost less where the battery's limits bind: none costs less than without them."""
    if len(way.found) <= 1:  # all other legs are of nothing
        return tuple(note for best in way.found for note in _bounded(best))
    used_kwh = (query.soc_frac - way.soc_frac[-1]) * query.vehicle.usable_capacity_wh / 1000.0
    distance_m = sum(span.to_m - span.from_m for span in way.spans)
    cost = cost_of(weights, used_kwh, way.clock_s[-1], distance_m)
    short_by = cost - free_cost
    if short_by <= ROUNDING_FRAC * abs(cost):
        return ()
    return (
        "is good but not proven best: near the battery's limits its legs are each the best for itself only; "
        f"a better one would cost at most {short_by:.3g} less (of {cost:.3g})",
    )
