"""Values of trips as a mixture of two groups: days that differ a little, and the same with one size on top."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

ROUNDS: Final = 12
SEED: Final = 20180307
SPREADS: Final = (1.0, 1.5, 2.2, 3.3, 5.0, 8.0, 12.0)  # of days, in units of what they differ by anyway
LEAST_SIDE: Final = 3  # trips before and after a step
MOST_TRIED: Final = 48  # sizes of groups, or places of steps; expectation maximisation finds what lies between
MOST_CELLS: Final = 4_000_000  # of arrays that are settled at once
STEP_PLACES: Final = 1.5  # of log likelihood: a step is the best of many places, a drift is one
RIDGE: Final = 1e-9
UNKNOWN_SD: Final = 1e6  # in units of the days' spread, of a trip that does not tell its value


@dataclass(frozen=True, slots=True)
class Groups:
    """Trips in two groups: belongs: chance of each to carry the level (K,); usual: its value without the level (K,).

    shift: size of the level; apart: by how many spreads it lies from the others; gain: of log likelihood over days that
    differ alone; null_spread: of these [in the unit of the values]. step: all trips up to some date, or from it on;
    drift: a level that grows or fades with each trip, of which belongs is the share that it has.
    """

    belongs: NDArray[np.float64]
    usual: NDArray[np.float64]
    shift: float
    apart: float
    gain: float
    null_spread: float
    step: bool = False
    drift: bool = False

    @property
    def on(self) -> NDArray[np.bool_]:
        """Which trips rather carry the level than not, bool (K,)."""
        return np.asarray(self.belongs > 0.5, np.bool_)


@dataclass(frozen=True, slots=True)
class _Days:
    """What is the same for all values of K trips: design (K, m), variances (K,), and the least spread of days."""

    design: NDArray[np.float64]
    variance: NDArray[np.float64]
    days: float

    def fitted(
        self,
        values: NDArray[np.float64],
        spread: NDArray[np.float64],
        belongs: NDArray[np.float64] | None = None,
        *,
        shares: bool = False,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Weighted least squares of B rows of values, (B, K): values without the level (B, K), and its size (B,).

        belongs: (B, K), chances to carry it, whose square counts as themselves, since each trip carries the level or
        not; or, where shares, what each trip has of it.
        """
        weight = 1.0 / (self.variance + np.square(spread)[:, None])
        rows, m = values.shape[0], self.design.shape[1]
        size = m if belongs is None else m + 1
        gram, right = np.zeros((rows, size, size)), np.zeros((rows, size))
        gram[:, :m, :m] = np.einsum("km,bk,kn->bmn", self.design, weight, self.design, optimize=True)
        right[:, :m] = (weight * values) @ self.design
        if belongs is not None:
            carried = weight * belongs
            gram[:, m, :m] = gram[:, :m, m] = carried @ self.design
            gram[:, m, m] = (carried * belongs if shares else carried).sum(axis=1)
            right[:, m] = (carried * values).sum(axis=1)
        scale = 1.0 / np.sqrt(np.maximum(np.einsum("bii->bi", gram), 1e-300))
        turned = gram * scale[:, :, None] * scale[:, None, :] + RIDGE * np.eye(size)
        beta = np.linalg.solve(turned, (scale * right)[..., None])[..., 0] * scale
        return beta[:, :m] @ self.design.T, beta[:, m] if belongs is not None else np.zeros(rows)

    def density(
        self, values: NDArray[np.float64], mean: NDArray[np.float64], spread: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Log of the normal density of each value about its mean, but for a constant, float64 (B, K)."""
        variance = self.variance + np.square(spread)[:, None]
        return np.asarray(-0.5 * (np.square(values - mean) / variance + np.log(variance)), np.float64)

    def null(self, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Log likelihood of days that differ alone, and their spread, (B,) each."""
        best, best_spread = np.full(values.shape[0], -np.inf), np.zeros(values.shape[0])
        for factor in SPREADS:
            spread = np.full(values.shape[0], factor * self.days)
            mean, _ = self.fitted(values, spread)
            likelihood = self.density(values, mean, spread).sum(axis=1)
            better = likelihood > best
            best, best_spread = np.where(better, likelihood, best), np.where(better, spread, best_spread)
        return best, best_spread

    def starts(
        self, values: NDArray[np.float64], null_spread: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Rows to be settled: of which values each is, its spread, and the chances that it begins with."""
        mean, _ = self.fitted(values, null_spread)
        rank = np.argsort(np.argsort(mean - values, axis=1), axis=1)  # 0 for the highest
        sizes = _spread_out(1, values.shape[1] - 2)
        spreads = self.days * np.array(SPREADS)
        rows = np.arange(values.shape[0])
        row, size = (np.repeat(part.ravel(), spreads.size) for part in np.meshgrid(rows, sizes, indexing="ij"))
        spread = np.tile(spreads, rows.size * sizes.size)
        kept = spread <= null_spread[row] * (1.0 + 1e-9)
        row, size, spread = row[kept], size[kept], spread[kept]
        return row, spread, (rank[row] < size[:, None]).astype(np.float64)

    def steps(
        self, values: NDArray[np.float64], order: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Each step and a drift, at each spread: log likelihoods (B, S), what trips have of it, usual, sizes, spreads.

        What trips have: (S, K); the last of S at each spread are a drift, which grows by the same from trip to trip.
        """
        count = values.shape[1]
        firsts = _spread_out(LEAST_SIDE, count - LEAST_SIDE)
        place = np.argsort(order)
        each = [(place >= first).astype(np.float64) for first in firsts]
        each.append(place / max(count - 1, 1))
        belongs = np.repeat(np.array(each), len(SPREADS), axis=0)
        spread = np.tile(self.days * np.array(SPREADS), len(each))
        likelihood = np.empty((values.shape[0], spread.size))
        usual, shift = np.empty((values.shape[0], spread.size, count)), np.empty_like(likelihood)
        for row in range(values.shape[0]):
            same = np.repeat(values[row : row + 1], spread.size, axis=0)
            usual[row], shift[row] = self.fitted(same, spread, belongs, shares=True)
            mean = usual[row] + shift[row][:, None] * belongs
            likelihood[row] = self.density(same, mean, spread).sum(axis=1)
        return likelihood, belongs, usual, shift, spread

    def settled(
        self, values: NDArray[np.float64], spread: NDArray[np.float64], belongs: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Expectation maximisation of B rows: log likelihood (−∞ without a level), chances, usual values, sizes."""
        usual, shift = np.zeros_like(values), np.zeros(values.shape[0])
        total = np.zeros_like(values)
        for _ in range(ROUNDS):
            usual, shift = self.fitted(values, spread, belongs)
            share = np.clip(belongs.mean(axis=1), 0.5 / values.shape[1], 1.0 - 0.5 / values.shape[1])[:, None]
            without = np.log(1.0 - share) + self.density(values, usual, spread)
            with_it = np.log(share) + self.density(values, usual + shift[:, None], spread)
            total = np.logaddexp(without, with_it)
            belongs = np.exp(with_it - total)
        return np.where(shift > 0.0, total.sum(axis=1), -np.inf), belongs, usual, shift


def groups_of(
    values: NDArray[np.float64], sd: NDArray[np.float64], covariates: NDArray[np.float64], days: float
) -> Groups | None:
    """The likeliest two groups of values, (K,) with standard deviations sd, inf where a trip does not tell.

    days: spread of days at least. In both groups a value follows the covariates, (K, m), linearly. None where no group
    of higher values is likelier than none. The spread is taken from SPREADS, the rest by expectation maximisation from
    each split of the order.
    """
    trips = _days(sd, covariates, days)
    one = values[None, :]
    null, null_spread = trips.null(one)
    row, spread, belongs = trips.starts(one, null_spread)
    likelihood, belongs, usual, shift = trips.settled(one[row], spread, belongs)
    best = int(np.argmax(likelihood))
    gain = float(likelihood[best] - null[0])
    if not gain > 0.0:
        return None
    told = sd[np.isfinite(sd)]
    apart = float(shift[best] / np.hypot(spread[best], np.median(told)))
    return Groups(belongs[best], usual[best], float(shift[best]), apart, gain, float(null_spread[0]))


def step_of(
    values: NDArray[np.float64],
    sd: NDArray[np.float64],
    covariates: NDArray[np.float64],
    days: float,
    order: NDArray[np.int64],
) -> Groups | None:
    """The likeliest step or drift of values that come in an order, (K,) indices; as groups_of. None for none."""
    trips = _days(sd, covariates, days)
    one = values[None, :]
    null, null_spread = trips.null(one)
    likelihood, belongs, usual, shift, spread = trips.steps(one, order)
    drifts = np.arange(likelihood.shape[1]) >= likelihood.shape[1] - len(SPREADS)
    best = int(np.argmax(likelihood[0] + np.where(drifts, STEP_PLACES, 0.0)))
    gain = float(likelihood[0, best] - null[0])
    if not gain > 0.0:
        return None
    carried, plain, size = belongs[best], usual[0, best], float(shift[0, best])
    if size < 0.0:  # what came before had more
        carried, plain, size = 1.0 - carried, plain + size, -size
    apart = size / float(np.hypot(spread[best], np.median(sd[np.isfinite(sd)])))
    return Groups(carried, plain, size, apart, gain, float(null_spread[0]), step=True, drift=bool(drifts[best]))


def spread_of(
    values: NDArray[np.float64], sd: NDArray[np.float64], covariates: NDArray[np.float64], days: float
) -> tuple[float, float]:
    """How much values differ, of SPREADS times days, and what that gains in log likelihood over days; as groups_of."""
    trips = _days(sd, covariates, days)
    one, least = values[None, :], np.array([days])
    best, spread = trips.null(one)
    mean, _ = trips.fitted(one, least)
    return float(spread[0]), float(best[0] - trips.density(one, mean, least).sum())


def drawn_gains(
    sd: NDArray[np.float64],
    covariates: NDArray[np.float64],
    days: float,
    spread: float,
    draws: int,
    order: NDArray[np.int64] | None = None,
) -> NDArray[np.float64]:
    """Gains of drawn values of days that differ by a spread and carry no level, float64 (draws,).

    order: of the trips, where steps are looked for, none where any groups are.
    """
    trips = _days(sd, covariates, days)
    scatter = np.hypot(np.where(np.isfinite(sd), sd, 0.0), spread)
    values = scatter * np.random.default_rng(SEED).standard_normal((draws, sd.size))
    null, null_spread = trips.null(values)
    if order is not None:
        return np.asarray(trips.steps(values, order)[0].max(axis=1) - null, np.float64)
    gains = np.zeros(draws)
    rows_a_draw = MOST_TRIED * len(SPREADS)
    step = max(MOST_CELLS // (rows_a_draw * sd.size), 1)
    for begin in range(0, draws, step):
        part = slice(begin, min(begin + step, draws))
        row, spreads, belongs = trips.starts(values[part], null_spread[part])
        likelihood, _, _, _ = trips.settled(values[part][row], spreads, belongs)
        np.maximum.at(gains[part], row, likelihood - null[part][row])
    return gains


def _spread_out(first: int, last: int) -> NDArray[np.int64]:
    """Whole numbers from first to last, MOST_TRIED of them at most."""
    return np.unique(np.rint(np.linspace(first, last, min(last - first + 1, MOST_TRIED))).astype(np.int64))


def _days(sd: NDArray[np.float64], covariates: NDArray[np.float64], days: float) -> _Days:
    design = np.column_stack((np.ones(sd.size), covariates))
    return _Days(design, np.square(np.where(np.isfinite(sd), sd, UNKNOWN_SD * days)), days)
