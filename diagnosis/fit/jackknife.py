"""Least squares over trips from their normal equations, and what leaving out one trip at a time says of it.

Windows of one trip share weather, load and sensors, so the trip is the unit: spreads come from the delete-one-trip
jackknife, and losses are those of trips by the fit of the others. Everything is solved for all trips left out at once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats
from scipy.optimize import lsq_linear

from diagnosis.fit.noise import climate_root, whitened

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.fit.windows import Windows

NOWHERE: Final = 1e60  # information on a column that is nothing in these trips, so that its coefficient is 0
ENOUGH_EFFECTIVE: Final = 8.0  # below, a few trips rule the jackknife, and trips are weighed more evenly
EVENING: Final = (0.95, 0.9, 0.8, 0.7, 0.6, 0.5)  # quantiles of the trips' information that cap their weights
TINY: Final = 1e-30
PINNED: Final = 1e8  # times all that is known of a column, so that it stays at its bound
RIDGE: Final = 1e-12  # on normal equations in units of 1, against columns that are the same
FORM_SD_FRAC: Final = 0.15  # assumed: an effect's real form differs from the library's, which no spread of trips shows
TIE_FRAC: Final = 1e-9  # losses and z that differ by less are the same; between processors they differ by up to 1e-12
AT_ONCE: Final = (
    16_000_000  # numbers of arrays by trip, column and draw, which are worked through in parts of that size
)
LEAST_EFFECTIVE: Final = 3.0  # fewer trips that carry a column say nothing of how trips differ


def first_least(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Index of the least value along the last axis; of those that exceed it by at most TIE_FRAC of it the first.

    Columns that are the same in these drives, such as two boxes that hold the same windows, have the same loss up to
    the order of a sum, which differs between processors.
    """
    least = values.min(axis=-1, keepdims=True)
    return np.asarray(np.argmax(values <= least + TIE_FRAC * np.abs(least), axis=-1), np.int64)


def ranked(values: NDArray[np.float64]) -> list[int]:
    """Indices of values, float64 (n,), from the least up, those that first_least takes for the same in their order."""
    open_, order = list(range(values.size)), []
    while open_:
        order.append(open_.pop(int(first_least(values[open_]))))
    return order


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known of each of p coefficients beforehand, float64 (p,) each.

    precision: of a normal prior about mean, 0 for none. low, high: what it cannot be beyond, ±∞ for none.
    """

    precision: NDArray[np.float64]
    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def with_free(self, count: int = 1) -> Prior:
        """The prior with so many columns more, of which nothing is known."""
        nothing, without = np.zeros(count), np.full(count, np.inf)
        return Prior(
            np.append(self.precision, nothing),
            np.append(self.mean, nothing),
            np.append(self.low, -without),
            np.append(self.high, without),
        )


def no_prior(count: int) -> Prior:
    """The prior of so many columns of which nothing is known."""
    return Prior(np.zeros(count), np.zeros(count), np.full(count, -np.inf), np.full(count, np.inf))


@dataclass(frozen=True, slots=True)
class Equations:
    """Whitened normal equations of K trips with p columns: XᵀX (K, p, p), Xᵀy (K, p), yᵀy (K,), and windows of each.

    names: of the columns; prior: of their coefficients.
    """

    names: tuple[str, ...]
    gram: NDArray[np.float64]
    vector: NDArray[np.float64]
    square: NDArray[np.float64]
    count: NDArray[np.float64]
    prior: Prior

    @property
    def trips(self) -> int:
        """How many trips."""
        return int(self.gram.shape[0])

    def index(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Where columns stand, int64."""
        return np.array([self.names.index(name) for name in names], np.int64)


@dataclass(frozen=True, slots=True)
class Solution:
    """Coefficients of some columns: of all trips (q,), without each trip (K, q), and the loss of each trip left out.

    losses: squared whitened residuals of a trip by the fit of the others, less those of no model at all, float64 (K,).
    effective: how many trips carry each coefficient (q,).
    """

    names: tuple[str, ...]
    coefficients: NDArray[np.float64]
    without: NDArray[np.float64]
    losses: NDArray[np.float64]
    effective: NDArray[np.float64]

    def sd(self) -> NDArray[np.float64]:
        """Jackknife standard deviations, float64 (q,)."""
        return jackknife_sd(self.without)

    def value(self, name: str) -> float:
        """One coefficient; 0 where the fit does not have it."""
        return float(self.coefficients[self.names.index(name)]) if name in self.names else 0.0

    def half_width(self, weights: NDArray[np.float64], form_sd_frac: float = FORM_SD_FRAC) -> float:
        """Half of the 95 % interval of a sum of coefficients, weights (q,): by trips and by form_sd_frac of the sum."""
        form = 1.96 * form_sd_frac * float(weights @ self.coefficients)
        return float(np.hypot(self.half_width_by_trips(weights), form))

    def half_width_within(self, system: Equations, weights: NDArray[np.float64]) -> float:
        """Half of the 95 % interval of a sum of coefficients by what single windows and priors leave open."""
        index = system.index(self.names)
        gram = system.gram[:, index[:, None], index[None, :]].sum(axis=0) + np.diag(system.prior.precision[index])
        scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), TINY))
        inverse = np.linalg.inv(gram * np.outer(scale, scale) + RIDGE * np.eye(index.size)) * np.outer(scale, scale)
        return float(1.96 * np.sqrt(max(float(weights @ inverse @ weights), 0.0)))

    def half_width_by_trips(self, weights: NDArray[np.float64]) -> float:
        """Half of the 95 % interval of a sum of coefficients by how trips differ: the jackknife and Student's t."""
        sums = self.without @ weights
        size = np.abs(weights * self.coefficients)
        carried = float(np.average(self.effective, weights=size)) if size.any() else float(sums.size)
        return float(stats.t.ppf(0.975, max(carried - 1.0, 1.0)) * jackknife_sd(sums))


@dataclass(frozen=True, slots=True)
class Additions:
    """What each of m columns would be if it alone were added: coefficient, its spread and significance (m,).

    z: t by the jackknife, as a normal variable would be as rare as t is with effective trips − 1 degrees of freedom;
    where fewer than ENOUGH_EFFECTIVE trips carry a column, t of a more even mean of the trips' own coefficients.
    effective: how many trips carry it, which one that outweighs the others lowers. losses: as in Solution, (K, m).
    """

    coefficients: NDArray[np.float64]
    sd: NDArray[np.float64]
    z: NDArray[np.float64]
    effective: NDArray[np.float64]
    losses: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Added:
    """Columns to be tried one at a time beside a base of b columns: their products with it and with themselves.

    gram_base (K, b, b), cross (K, b, m), own (K, m), base_vector (K, b), vector (K, m); precision_base (b,), precision
    (m,); base_prior (b,), the right side that the prior of the base adds.
    """

    gram_base: NDArray[np.float64]
    cross: NDArray[np.float64]
    own: NDArray[np.float64]
    base_vector: NDArray[np.float64]
    vector: NDArray[np.float64]
    precision_base: NDArray[np.float64]
    precision: NDArray[np.float64]
    base_prior: NDArray[np.float64]
    added_prior: NDArray[np.float64]


def jackknife_sd(without: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard deviation from estimates that leave out one trip each, (K, …) → (…)."""
    n = without.shape[0]
    return np.asarray(np.sqrt((n - 1) / n * np.square(without - without.mean(axis=0)).sum(axis=0)), np.float64)


def equations(
    trips: Sequence[Windows],
    roots: Sequence[NDArray[np.float64]],
    prior: Prior,
) -> Equations:
    """Normal equations of trips' residual powers on all their columns; roots: of each trip's covariance.

    Where the cabin's climate was recorded, it has equations of its own, and none in the residual power.
    """
    grams, vectors, squares, counts = [], [], [], []
    for trip, root in zip(trips, roots, strict=True):
        both = np.column_stack((trip.fitted_columns_j(), trip.residual_j())) / trip.duration_s[:, None]
        turned = whitened(root, both)
        if trip.climate_j is not None:
            climate = np.column_stack((trip.climate_columns_j(), trip.climate_j)) / trip.duration_s[:, None]
            turned = np.vstack((turned, whitened(climate_root(trip), climate)))
        columns, residual = turned[:, :-1], turned[:, -1]
        grams.append(columns.T @ columns)
        vectors.append(columns.T @ residual)
        squares.append(float(residual @ residual))
        counts.append(float(residual.size))
    return Equations(trips[0].names, np.array(grams), np.array(vectors), np.array(squares), np.array(counts), prior)


def pinned(system: Equations, names: Sequence[str]) -> Equations:
    """The equations with each of these columns that the fit of them would take beyond its bounds held at its bound."""
    index = system.index(names)
    prior = system.prior
    low, high = prior.low[index], prior.high[index]
    if not (np.isfinite(low).any() or np.isfinite(high).any()):
        return system
    own = system.gram[:, index, index].sum(axis=0) + prior.precision[index]
    scale = 1.0 / np.sqrt(np.maximum(own, TINY))
    gram = system.gram[:, index[:, None], index[None, :]].sum(axis=0) + np.diag(prior.precision[index])
    vector = system.vector[:, index].sum(axis=0) + prior.precision[index] * prior.mean[index]
    values, vectors = np.linalg.eigh(gram * np.outer(scale, scale))
    sizes = np.sqrt(np.maximum(values, RIDGE * values[-1]))
    target = (vectors.T @ (vector * scale)) / sizes
    free = vectors @ (target / sizes) * scale
    if bool(((free >= low) & (free <= high)).all()):
        return system
    bounds = (low / scale, high / scale)
    found = lsq_linear(sizes[:, None] * vectors.T, target, bounds, method="bvls").active_mask
    held = found != 0
    at = index[held]
    precision, mean = prior.precision.copy(), prior.mean.copy()
    precision[at] = PINNED * own[held]
    mean[at] = np.where(found[held] < 0, low[held], high[held])
    return replace(system, prior=replace(prior, precision=precision, mean=mean))


def solve(system: Equations, names: Sequence[str]) -> Solution:
    """Coefficients of some columns within their bounds, all others 0."""
    system = pinned(system, names)
    index = system.index(names)
    gram = system.gram[:, index[:, None], index[None, :]]
    vector = system.vector[:, index]
    prior = np.diag(system.prior.precision[index])
    pull = system.prior.precision[index] * system.prior.mean[index]
    whole_gram, whole_vector = gram.sum(axis=0), vector.sum(axis=0)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(whole_gram) + np.diag(prior), TINY))
    full = _scaled_solve(whole_gram + prior, whole_vector + pull, scale)
    without = _scaled_solve(whole_gram - gram + prior, whole_vector - vector + pull, scale)
    losses = np.einsum("kq,kqr,kr->k", without, gram, without) - 2.0 * np.einsum("kq,kq->k", without, vector)
    return Solution(tuple(names), full, without, losses, _carried(gram, prior, scale))


def additions(system: Equations, base: Sequence[str], added: Sequence[str]) -> Additions:
    """Each of the added columns beside the base, one at a time."""
    b, c = system.index(base), system.index(added)
    return tried(_added(pinned(system, base), b, c))


def tried(added: Added) -> Additions:
    """Each added column beside the base, one at a time."""
    inverse, turn, information = _pieces(added)
    out_b = added.base_vector.sum(axis=0) - added.base_vector + added.base_prior
    out_c = added.vector.sum(axis=0) - added.vector + added.added_prior
    base_beta = np.einsum("kbd,kd->kb", inverse[1:], out_b)
    beta = (out_c - np.einsum("kbm,kb->km", turn[1:], out_b)) / information[1:]
    whole_b = added.base_vector.sum(axis=0) + added.base_prior
    full = (added.vector.sum(axis=0) + added.added_prior - turn[0].T @ whole_b) / information[0]
    # coefficients of the base beside each added column: (K, b, m)
    beside = base_beta[:, :, None] - turn[1:] * beta[:, None, :]
    losses = (
        np.einsum("kbm,kbm->km", beside, np.matmul(added.gram_base, beside))
        + 2.0 * beta * np.einsum("kbm,kbm->km", beside, added.cross)
        + added.own * beta**2
        - 2.0 * np.einsum("kbm,kb->km", beside, added.base_vector)
        - 2.0 * beta * added.vector
    )
    sd = jackknife_sd(beta)
    effective = effective_trips(information)
    z = as_z(np.divide(full, sd, out=np.zeros_like(full), where=sd > 0.0), effective)
    info, part = _by_trip(added, turn[0])
    scores = added.vector - np.einsum("kbm,b->km", added.cross, inverse[0] @ whole_b)
    scores = scores - np.einsum("bm,kb->km", turn[0], added.base_vector - added.gram_base @ (inverse[0] @ whole_b))
    even = _evened_z(info, part, scores[:, :, None])[:, 0]
    return Additions(full, sd, np.where(effective < ENOUGH_EFFECTIVE, even, z), effective, losses)


def simulated_z(added: Added, right_base: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """z of every added column in drives in which nothing is left out, float64 (draws, m).

    right_base: (K, b, draws), right: (K, m, draws): right sides that noise alone makes (drawn_sides, or by windows).
    """
    inverse, turn, information = _pieces(added)
    out_b, out_c = right_base.sum(axis=0) - right_base, right.sum(axis=0) - right
    without = (out_c - np.matmul(np.swapaxes(turn[1:], 1, 2), out_b)) / information[1:, :, None]
    full = (right.sum(axis=0) - turn[0].T @ right_base.sum(axis=0)) / information[0][:, None]
    sd = jackknife_sd(without)
    effective = effective_trips(information)
    z = as_z(np.divide(full, sd, out=np.zeros_like(full), where=sd > 0.0).T, effective)
    few = np.flatnonzero(effective < ENOUGH_EFFECTIVE)
    if few.size:
        base_beta = inverse[0] @ right_base.sum(axis=0)
        info, part = _by_trip(added, turn[0])
        scores = right[:, few] - np.matmul(np.swapaxes(added.cross[:, :, few], 1, 2), base_beta)
        scores = scores - np.matmul(turn[0][:, few].T, right_base - np.matmul(added.gram_base, base_beta))
        z[:, few] = _evened_z(info[:, few], part[:, few], scores).T
    return np.asarray(z, np.float64)


def simulated_additions(
    system: Equations,
    base: Sequence[str],
    added: Sequence[str],
    draws: int,
    rng: np.random.Generator,
    scatter: NDArray[np.float64],
) -> NDArray[np.float64]:
    """simulated_z of columns of the system; scatter: how much more than the others each trip's windows scatter (K,)."""
    system = pinned(system, base)
    b, c = system.index(base), system.index(added)
    both = np.concatenate((b, c))
    right = np.empty((system.trips, both.size, draws))
    for k in range(system.trips):
        gram = system.gram[k][both[:, None], both[None, :]]
        scale = np.sqrt(np.maximum(np.diag(gram), TINY))
        values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        right[k] = scatter[k] * scale[:, None] * (root @ rng.standard_normal((both.size, draws)))
    step = max(AT_ONCE // (system.trips * draws), 1)
    right_base, right_added = right[:, : b.size], right[:, b.size :]
    found = []
    for first in range(0, c.size, step):
        part = slice(first, first + step)
        found.append(simulated_z(_added(system, b, c[part]), right_base, right_added[:, part]))
    return np.hstack(found) if found else np.empty((draws, 0))


def effective_trips(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """How many trips carry each column, from its information in all (first row) and without each trip (K + 1, m)."""
    info = np.maximum(information[:1] - information[1:], 0.0)
    total = info.sum(axis=0)
    squares = np.square(info).sum(axis=0)
    known = (squares > 0.0) & (information[0] < NOWHERE)
    return np.asarray(np.divide(total**2, squares, out=np.zeros_like(total), where=known), np.float64)


def as_z(t: NDArray[np.float64], effective: NDArray[np.float64]) -> NDArray[np.float64]:
    """The normal variable that is as rare as t with effective − 1 degrees of freedom; 0 below LEAST_EFFECTIVE trips."""
    freedom = np.maximum(effective - 1.0, 1.0)
    z = -stats.norm.ppf(np.maximum(stats.t.sf(np.abs(t), freedom), 1e-300))
    return np.asarray(np.where(effective >= LEAST_EFFECTIVE, np.sign(t) * z, 0.0), np.float64)


def _by_trip(added: Added, turn: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Information of each trip on each column beside the base (K, m), and the weight it gets in an even mean (K, m).

    Weights follow the information up to a cap, the highest of some that leaves ENOUGH_EFFECTIVE trips.
    """
    info = added.own - 2.0 * np.einsum("kbm,bm->km", added.cross, turn)
    info = np.maximum(info + np.einsum("bm,kbd,dm->km", turn, added.gram_base, turn, optimize=True), 0.0)
    weight = info.copy()
    settled = np.zeros(info.shape[1], bool)
    for share in EVENING:
        capped = np.minimum(info, np.quantile(info, share, axis=0))
        squares = np.square(capped).sum(axis=0)
        carried = np.divide(capped.sum(axis=0) ** 2, squares, out=np.zeros_like(squares), where=squares > 0.0)
        weight = np.where(settled, weight, capped)
        settled |= carried >= ENOUGH_EFFECTIVE
    return np.asarray(info, np.float64), np.asarray(weight, np.float64)


def _evened_z(
    info: NDArray[np.float64], weight: NDArray[np.float64], scores: NDArray[np.float64]
) -> NDArray[np.float64]:
    """z of the weighted mean of each trip's own coefficient, by how trips scatter about it, (m, draws).

    info, weight: (K, m); scores: (K, m, draws), information times the trip's own coefficient.
    """
    own = np.divide(scores, info[:, :, None], out=np.zeros_like(scores), where=info[:, :, None] > TINY)
    total = weight.sum(axis=0)
    squares = np.square(weight).sum(axis=0)
    known = total > TINY
    share = np.divide(weight, total, out=np.zeros_like(weight), where=known)[:, :, None]
    mean = (share * own).sum(axis=0)
    effective = np.divide(total**2, squares, out=np.zeros_like(total), where=known)
    more = effective / np.maximum(effective - 1.0, 1.0)
    sd = np.sqrt(more[:, None] * np.square(share * (own - mean)).sum(axis=0))
    t = np.divide(mean, sd, out=np.zeros_like(mean), where=sd > 0.0)
    return np.asarray(as_z(t.T, effective).T, np.float64)


def _added(system: Equations, b: NDArray[np.int64], c: NDArray[np.int64]) -> Added:
    return Added(
        gram_base=system.gram[:, b[:, None], b[None, :]],
        cross=system.gram[:, b[:, None], c[None, :]],
        own=system.gram[:, c, c],
        base_vector=system.vector[:, b],
        vector=system.vector[:, c],
        precision_base=system.prior.precision[b],
        precision=system.prior.precision[c],
        base_prior=system.prior.precision[b] * system.prior.mean[b],
        added_prior=system.prior.precision[c] * system.prior.mean[c],
    )


def _pieces(added: Added) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Inverses of the base, base on columns, and the columns' information beside it: of all trips, and without each."""
    prior_b = np.diag(added.precision_base)
    size = added.precision_base.size

    def all_and_without(part: NDArray[np.float64]) -> NDArray[np.float64]:
        whole = part.sum(axis=0)
        return np.concatenate((whole[None], whole - part))

    whole_b, whole_bc, whole_c = (all_and_without(part) for part in (added.gram_base, added.cross, added.own))
    scale = 1.0 / np.sqrt(np.maximum(np.diag(whole_b[0] + prior_b), TINY))
    turn_scale = np.outer(scale, scale)
    inverse = np.linalg.inv((whole_b + prior_b) * turn_scale + RIDGE * np.eye(size)) * turn_scale
    turn = np.matmul(inverse, whole_bc)
    information = whole_c + added.precision - np.einsum("kbm,kbm->km", whole_bc, turn)
    nothing = information <= 1e-9 * np.maximum(whole_c + added.precision, TINY)
    return inverse, turn, np.where(nothing, NOWHERE, information)


def _carried(gram: NDArray[np.float64], prior: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    """How many trips carry each coefficient beside all others, (q,)."""
    turned = np.outer(scale, scale)
    ridge = RIDGE * np.eye(scale.size)
    whole = gram.sum(axis=0) + prior
    information = np.array(
        [
            1.0 / np.maximum(np.diag(np.linalg.inv(part * turned + ridge)), TINY)
            for part in (whole, *(whole - trip_gram for trip_gram in gram))
        ]
    )
    return effective_trips(information)


def _scaled_solve(
    matrix: NDArray[np.float64], vector: NDArray[np.float64], scale: NDArray[np.float64]
) -> NDArray[np.float64]:
    scaled = matrix * np.outer(scale, scale) + RIDGE * np.eye(scale.size)
    return np.asarray(np.linalg.solve(scaled, (vector * scale)[..., None])[..., 0] * scale, np.float64)
