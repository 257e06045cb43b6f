"""How sure a plan is: charge on arrival and the probability of keeping what was asked, at each stop and in all.

Drawn vehicles drive the whole plan, each with residuals of the model (energy.chain.scatter). Vehicle and residual
are the same on all legs of a journey. Charge at departure is metered: a stop is left with what the plan says, or with
what was left on arrival where that is more. docs/charging.md has what a promise does not know of.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.special import ndtri

from energy.chain.chain import DriveSettings, StopRule
from energy.chain.sampling import SEED, STANDARD_SAMPLING, sampling_of
from energy.chain.scatter import ChainScatter, chain_scatter, drawn_shifts
from energy.units import JOULE_PER_WH
from routing.charging.promise import kernels_promise as kernels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.chain.scatter import DrawnShifts
    from energy.vehicle.files import AnyVehicle
    from routing.charging.plan import ChargeStop, ChargingQuery, Plan, PlanLeg
    from routing.links.spans import ChainMaker
    from routing.queries import RouteQuery

VEHICLES: Final = 1024  # drawn, evenly: another seed moves shares by 0.1 to 0.2 points (standard deviation)
RESIDUALS: Final = 8  # of each of them, evenly spread over their distribution
CHUNK: Final = 128  # vehicles at a time, which bounds memory
KEPT_VEHICLES: Final = 16  # whose draws are kept
QUANTILES: Final = (0.1, 0.5, 0.9)
LEVEL_FRAC: Final = 5e-4  # of the capacity, by which charge may turn back on the way without being looked at
ROUNDING: Final = 1e-9  # of a charge
GOLDEN_FRAC: Final = 0.6180339887498949


@dataclass(frozen=True, slots=True)
class LegPromise:
    """How sure a leg is.

    arrive_quantiles_frac: charge on arrival that is not exceeded with 10, 50 and 90 %. soc_min_p10_frac: likewise with
    10 %, the least on the way. kept_frac: probability of arriving with what was asked and of never being below the
    reserve. needed_frac: least charge at its beginning with which it, and all legs after it up to the next stop that is
    charged as planned, are kept with the confidence asked for; above 1 for none, NaN where no confidence is asked for.
    most_kept_frac: probability of keeping these where as much is charged before as may be.
    """

    arrive_quantiles_frac: tuple[float, float, float]
    soc_min_p10_frac: float
    kept_frac: float
    needed_frac: float
    most_kept_frac: float


@dataclass(frozen=True, slots=True)
class Promise:
    """How sure a plan is: each leg, and all of them together (kept_frac).

    spread_frac: standard deviation of the dissipated energy of all legs, over its mean.
    """

    legs: tuple[LegPromise, ...]
    kept_frac: float
    spread_frac: float

    @property
    def least_kept_frac(self) -> float:
        """Probability of the leg that is least sure."""
        return min(leg.kept_frac for leg in self.legs)


class DrawStore:
    """Draws by vehicle, safe between threads."""

    def __init__(self) -> None:
        self._shifts: OrderedDict[tuple[object, ...], DrawnShifts] = OrderedDict()
        self._lock = threading.Lock()

    def shifts(self, key: tuple[object, ...], vehicle: AnyVehicle) -> DrawnShifts:
        """Drawn vehicles; key: all that a search reads of the vehicle."""
        key = (*key, *sorted(vehicle.sd.items()))
        with self._lock:
            known = self._shifts.get(key)
            if known is not None:
                self._shifts.move_to_end(key)
                return known
        made = drawn_shifts(vehicle, VEHICLES, SEED)
        with self._lock:
            self._shifts[key] = made
            while len(self._shifts) > KEPT_VEHICLES:
                self._shifts.popitem(last=False)
        return made


class PromiseMaker:
    """Promises of one query's plans.

    queries: the query, and again for each cap on its speed. goal_least_frac: charge asked for at the goal. shifts:
    drawn vehicles.
    """

    def __init__(
        self,
        chains: ChainMaker,
        queries: Sequence[RouteQuery],
        charging: ChargingQuery,
        goal_least_frac: float,
        shifts: DrawnShifts,
    ) -> None:
        self._chains, self._queries, self._charging = chains, queries, charging
        self._goal_least_frac, self._shifts = goal_least_frac, shifts
        self._vehicle, self._reserve_frac = queries[0].vehicle, queries[0].reserve_soc_frac
        residual_sd = sampling_of(self._vehicle, STANDARD_SAMPLING).residual_sd_frac
        self._residual = np.maximum(residual_sd * _normals(shifts.capacity_wh.size), -1.0)

    def of(self, plan: Plan) -> Promise:
        """The promise of a plan whose stops are charged as it says."""
        legs, outcomes, lost = self._driven(self._legs(plan), plan.legs)
        kept = outcomes.needed <= outcomes.start + ROUNDING
        most_frac = np.maximum(legs.depart_frac, self._charging.max_soc_frac)
        most_frac[0] = legs.depart_frac[0]
        most_kept = (outcomes.chained <= most_frac[:, None] + ROUNDING).mean(axis=1).tolist()
        confidence = self._charging.confidence
        needed = np.full(len(plan.legs), np.nan) if confidence is None else _quantiles(outcomes.chained, confidence)
        low, middle, high = np.quantile(outcomes.arrive, QUANTILES, axis=1).tolist()
        lowest = np.quantile(outcomes.lowest, QUANTILES[0], axis=1).tolist()
        mean = float(lost.mean())
        return Promise(
            legs=tuple(
                LegPromise(
                    (low[k], middle[k], high[k]), lowest[k], float(kept[k].mean()), float(needed[k]), most_kept[k]
                )
                for k in range(len(plan.legs))
            ),
            kept_frac=float(kept.all(axis=0).mean()),
            spread_frac=float(lost.std()) / mean if mean > 0.0 else 0.0,
        )

    def needed_frac(self, leg: PlanLeg, least_frac: float, confidence: float) -> float:
        """Least charge at the beginning of a leg alone with which it ends with a charge with a confidence.

        Above 1 for none. Climate and tyres begin it as at a departure.
        """
        asked = kernels.Legs(
            first=np.array([0, len(leg.spans)]),
            depart_frac=np.ones(1),
            gain_j=np.full(1, np.nan),
            least_frac=np.full(1, max(least_frac, self._reserve_frac)),
            reserve_frac=self._reserve_frac,
        )
        _, outcomes, _ = self._driven(asked, [leg])
        return float(_quantiles(outcomes.needed, confidence)[0])

    def _driven(
        self, legs: kernels.Legs, driven: Sequence[PlanLeg]
    ) -> tuple[kernels.Legs, kernels.Outcomes, NDArray[np.float64]]:
        """Legs over blocks of links, what became of all drives on them, and what each drive dissipated [J]."""
        legs, scatter = self._in_blocks(legs, self._scatter(driven))
        outcomes = kernels.Outcomes(*(np.empty((len(driven), self._residual.size)) for _ in range(5)))
        lost = np.empty(self._residual.shape)
        capacity_j = self._shifts.capacity_wh * JOULE_PER_WH
        for begin in range(0, capacity_j.size, CHUNK):
            at = slice(begin, begin + CHUNK)
            energy_j, dissipated_j = scatter.drawn(self._shifts.shifts_sd[at])
            residual = self._residual[at]
            lost[at] = dissipated_j.sum(axis=1)[:, None] * (1.0 + residual)
            first = begin * residual.shape[1]
            kernels.drive_legs(energy_j, dissipated_j, capacity_j[at], residual, legs, outcomes, first)
        return legs, outcomes, lost

    def _legs(self, plan: Plan) -> kernels.Legs:
        sizes = [len(leg.spans) for leg in plan.legs]
        least = [max(self._least_frac(stop), self._reserve_frac) for stop in plan.stops]
        gains = [math.nan, *(_gain_j(stop) for stop in plan.stops)]
        return kernels.Legs(
            first=np.concatenate(([0], np.cumsum(sizes))).astype(np.int64),
            depart_frac=np.array([leg.soc_start_frac for leg in plan.legs]),
            gain_j=np.array(gains),
            least_frac=np.array([*least, self._goal_least_frac]),
            reserve_frac=self._reserve_frac,
        )

    def _least_frac(self, stop: ChargeStop) -> float:
        """What is asked for on arrival; at a fixed stay that charges nothing only the reserve."""
        charges = stop.station is not None or stop.mean_power_w > 0.0
        return self._charging.arrive_soc_frac if charges else 0.0

    def _scatter(self, legs: Sequence[PlanLeg]) -> ChainScatter:
        """Energy of each stretch of all legs, each driven under its own cap."""
        sizes, names = [len(leg.spans) for leg in legs], self._shifts.names
        spans = tuple(span for leg in legs for span in leg.spans)
        if not spans:
            none, terms = np.empty(0), np.empty((2 * len(names), 0))
            return ChainScatter(none, none, terms, terms)
        spans = (*spans[:-1], replace(spans[-1], rest=False))
        cap_mps = [leg.speed_cap_mps for leg in legs]
        of_link = np.repeat([-1.0 if cap is None else cap for cap in cap_mps], sizes)
        made: ChainScatter | None = None
        for cap in dict.fromkeys(cap_mps):
            query = self._query_of(cap)
            chain = self._chains.chain(spans, query.stop_settings, query.conditions)
            drive = DriveSettings(query.conditions, query.link_model, self._rule)
            scatter = chain_scatter(self._vehicle, chain, drive, names)
            at = of_link == (-1.0 if cap is None else cap)
            made = scatter if made is None else made.with_links(at, scatter)
        assert made is not None
        return made

    def _in_blocks(self, legs: kernels.Legs, scatter: ChainScatter) -> tuple[kernels.Legs, ChainScatter]:
        """Legs over few blocks of links: between places where charge turns from falling to rising or back."""
        level_j = LEVEL_FRAC * self._vehicle.usable_capacity_wh * JOULE_PER_WH
        bounds: list[int] = []
        first = [0]
        for begin, end in pairwise(legs.first.tolist()):
            used = np.cumsum(scatter.energy_j[begin:end]).tolist()
            if end > begin:
                bounds += [begin, *(begin + turn + 1 for turn in turning_points(used, level_j))]
            first.append(len(bounds))
        blocks = scatter.in_blocks(np.array(bounds, np.int64)) if bounds else scatter
        return legs._replace(first=np.array(first, np.int64)), blocks

    def _query_of(self, cap_mps: float | None) -> RouteQuery:
        if cap_mps is None:
            return self._queries[0]
        return next(query for query in self._queries if query.conditions.top_speed_mps == cap_mps)

    @property
    def _rule(self) -> StopRule:
        rule = self._queries[0].stop_rule
        return StopRule.EXPECTED if rule is StopRule.COUNTED else rule


def _gain_j(stop: ChargeStop) -> float:
    """What a fixed stay charges if the battery has room [J]; NaN of stops that charge up to what the plan says."""
    return math.nan if stop.station is not None else stop.mean_power_w * (stop.depart_s - stop.arrive_s)


def turning_points(used: Sequence[float], level: float) -> list[int]:
    """Where a course turns, as places in it but the last: between two of them it turns back by less than a level."""
    turns: list[int] = []
    low = high = 0.0
    low_at = high_at = -1
    rising = falling = True  # both until the first turn
    for k, value in enumerate(used):
        if value > high:
            high, high_at = value, k
        if value < low:
            low, low_at = value, k
        if rising and value < high - level:
            turns.append(high_at)
            rising, falling = False, True
            low, low_at = value, k
        elif falling and value > low + level:
            turns.append(low_at)
            rising, falling = True, False
            high, high_at = value, k
    last = high_at if rising else low_at
    return [turn for turn in (*turns, last) if 0 <= turn < len(used) - 1]


def with_promise(plan: Plan, promise: Promise) -> Plan:
    """A plan that says how sure it is."""
    goal = promise.legs[-1]
    return replace(
        plan,
        legs=tuple(
            replace(leg, soc_min_p10_frac=of.soc_min_p10_frac) for leg, of in zip(plan.legs, promise.legs, strict=True)
        ),
        stops=tuple(
            replace(stop, arrive_quantiles_frac=of.arrive_quantiles_frac, kept_probability_frac=of.kept_frac)
            for stop, of in zip(plan.stops, promise.legs, strict=False)
        ),
        goal_quantiles_frac=goal.arrive_quantiles_frac,
        goal_kept_probability_frac=goal.kept_frac,
        kept_probability_frac=promise.kept_frac,
    )


def _quantiles(outcome: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """What a share of all drives does not exceed on each leg, float64 (L,)."""
    found: NDArray[np.float64] = np.quantile(outcome, share, axis=1, method="inverted_cdf")
    return found


@cache
def _normals(vehicles: int) -> NDArray[np.float64]:
    """Standard normal numbers, float64 (vehicles, RESIDUALS): evenly spread in all, and nearly so of each vehicle."""
    within = (0.5 + GOLDEN_FRAC * np.arange(vehicles)) % 1.0
    order = np.argsort(np.argsort(within))
    shares = (np.arange(RESIDUALS) + ((order + 0.5) / vehicles)[:, None]) / RESIDUALS
    normals: NDArray[np.float64] = ndtri(shares)
    normals.flags.writeable = False
    return normals
