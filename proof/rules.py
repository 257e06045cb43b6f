"""Simpler rules on the same drives, for comparison: ordinary least squares, BIC, and the Lasso.

All know the same library, the same free columns (parameters and sensors) and the same noise as the tool's first fit. A
family is claimed where the terms that a rule takes hold LEAST_SHARE_FRAC of the energy, as for the tool.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.fit.jackknife import solve
from diagnosis.fit.selection import LEAST_SHARE_FRAC, MOST_TERMS
from diagnosis.fit.windows import FREE
from proof.answers import Rule
from proof.prepared import predicted_kwh, prepared, without_noise
from proof.trip_sums import trip_sum_rules

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.terms import Candidate
    from diagnosis.fit.jackknife import Equations
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle
    from proof.prepared import Prepared

OLS_T: Final = 4.0
FOLDS: Final = 5
PENALTIES: Final = 30
LEAST_PENALTY_FRAC: Final = 1e-3  # of the one from which on nothing is taken
SWEEPS: Final = 200
CONVERGED: Final = 1e-6


def simpler_rules(recordings: Sequence[Recording], vehicle: Vehicle, held_out: Collection[str]) -> tuple[Rule, ...]:
    """What each of the simpler rules claims and predicts."""
    ready = prepared(recordings, vehicle, held_out)
    plain = without_noise(ready)
    return (
        _rule("OLS on windows, t > 4", ready, plain, ordinary(ready, plain)),
        _rule("forward by BIC, whitened", ready, ready.system, forward_bic(ready)),
        _rule("Lasso, trip cross-validation", ready, ready.system, lasso(ready)),
        *trip_sum_rules(recordings, vehicle, held_out),
    )


def ordinary(ready: Prepared, plain: Equations) -> tuple[Candidate, ...]:
    """Terms whose t exceeds OLS_T when all are fitted at once, each window as good as any; the middle of each grid."""
    middle = [
        candidate
        for candidate in ready.tried
        if candidate.term.shape is None or candidate.shape == _middle(candidate.term.shape.grid)
    ]
    names = [*FREE, *(candidate.label for candidate in middle)]
    index = plain.index(names)
    gram = plain.gram.sum(axis=0)[np.ix_(index, index)]
    vector = plain.vector.sum(axis=0)[index]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-30))
    inverse = np.linalg.pinv(gram * np.outer(scale, scale), rcond=1e-10, hermitian=True) * np.outer(scale, scale)
    beta = inverse @ vector
    freedom = max(float(plain.count.sum()) - len(names), 1.0)
    variance = max(float(plain.square.sum() - vector @ beta), 0.0) / freedom
    t = beta / np.sqrt(np.maximum(variance * np.diag(inverse), 1e-300))
    t_of = dict(zip(names, t.tolist(), strict=True))
    return tuple(
        candidate
        for candidate in middle
        if (t_of[candidate.label] if candidate.term.positive else abs(t_of[candidate.label])) > OLS_T
    )


def forward_bic(ready: Prepared) -> tuple[Candidate, ...]:
    """Terms added one at a time while n·ln(RSS/n) + k·ln n of the whitened windows falls."""
    system = ready.system
    n = float(system.count.sum())
    found: list[Candidate] = []
    best = _bic(system, list(FREE), n)
    while len(found) < MOST_TERMS:
        names = [*FREE, *(candidate.label for candidate in found)]
        tried = [candidate for candidate in ready.tried if all(candidate.term is not other.term for other in found)]
        scored = [(_bic(system, [*names, candidate.label], n), k) for k, candidate in enumerate(tried)]
        allowed = [(bic, k) for (bic, last), k in scored if last > 0.0 or not tried[k].term.positive]
        if not allowed or min(allowed)[0] >= best[0]:
            break
        best = (min(allowed)[0], 0.0)
        found.append(tried[min(allowed)[1]])
    return tuple(found)


def lasso(ready: Prepared) -> tuple[Candidate, ...]:
    """Terms with a coefficient at the largest penalty whose loss on left-out trips is within a standard error of the
    least; free columns are not penalised.
    """
    system = ready.system
    labels = [candidate.label for candidate in ready.tried]
    signed = np.array([not candidate.term.positive for candidate in ready.tried])
    folds = np.arange(system.trips) % FOLDS
    whole = np.ones(system.trips, np.bool_)
    gram, vector, _ = _projected(system, labels, whole)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-12))
    largest = float(np.max(np.where(signed, np.abs(vector * scale), vector * scale), initial=0.0))
    if largest <= 0.0:
        return ()
    path = largest * np.geomspace(1.0, LEAST_PENALTY_FRAC, PENALTIES)
    losses = np.zeros((FOLDS, PENALTIES))
    for fold in range(FOLDS):
        losses[fold] = _fold_losses(system, labels, signed, scale, path, folds == fold)
    total = losses.sum(axis=0)
    least = int(np.argmin(total))
    error = float((losses - losses[:, [0]])[:, least].std(ddof=1) * np.sqrt(FOLDS))
    chosen = int(np.argmax(total <= total[least] + error))
    turned = np.outer(scale, scale)
    beta = np.zeros(len(labels))
    for penalty in path[: chosen + 1]:
        beta = _descended(gram * turned, vector * scale, float(penalty), signed, beta)
    return tuple(candidate for candidate, value in zip(ready.tried, beta.tolist(), strict=True) if value != 0.0)


def _rule(name: str, ready: Prepared, system: Equations, chosen: Sequence[Candidate]) -> Rule:
    solution = solve(system, [*FREE, *(candidate.label for candidate in chosen)])
    measured_j = sum(float(trip.measured_j.sum()) for trip in ready.fitted)
    share: dict[str, float] = {}
    for candidate in chosen:
        size_j = sum(abs(float(trip.column(candidate.label).sum())) for trip in ready.fitted)
        family = candidate.term.family.value
        share[family] = share.get(family, 0.0) + abs(solution.value(candidate.label)) * size_j / measured_j
    claimed = sorted(family for family, frac in share.items() if frac >= LEAST_SHARE_FRAC)
    return Rule(name, tuple(claimed), predicted_kwh(ready.kept, solution))


def _middle(grid: tuple[float, ...]) -> float:
    return grid[len(grid) // 2]


def _bic(system: Equations, names: list[str], n: float) -> tuple[float, float]:
    """The criterion, and the last of the coefficients."""
    index = system.index(names)
    gram = system.gram.sum(axis=0)[np.ix_(index, index)]
    vector = system.vector.sum(axis=0)[index]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-30))
    beta = scale * np.linalg.lstsq(gram * np.outer(scale, scale), vector * scale, rcond=1e-10)[0]
    square = float(system.square.sum() - vector @ beta)
    return n * float(np.log(max(square, 1e-12) / n)) + len(names) * float(np.log(n)), float(beta[-1])


def _projected(
    system: Equations, labels: Sequence[str], used: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Gram and right side of the terms after the free columns, and how these answer: rows of [β_free, −turn]."""
    b, c = system.index(FREE), system.index(labels)
    gram, vector = system.gram[used].sum(axis=0), system.vector[used].sum(axis=0)
    base = gram[np.ix_(b, b)] + np.diag(system.prior.precision[b])
    right = vector[b] + system.prior.precision[b] * system.prior.mean[b]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(base), 1e-30))
    both = np.column_stack((right, gram[np.ix_(b, c)]))
    solved = scale[:, None] * np.linalg.lstsq(base * np.outer(scale, scale), both * scale[:, None], rcond=1e-12)[0]
    cross = gram[np.ix_(b, c)]
    return gram[np.ix_(c, c)] - cross.T @ solved[:, 1:], vector[c] - cross.T @ solved[:, 0], solved


def _fold_losses(
    system: Equations,
    labels: Sequence[str],
    signed: NDArray[np.bool_],
    scale: NDArray[np.float64],
    path: NDArray[np.float64],
    left_out: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Squared whitened residuals of the trips left out, at each penalty, less those of no model at all."""
    gram, vector, solved = _projected(system, labels, ~left_out)
    index = np.concatenate((system.index(FREE), system.index(labels)))
    test_gram = system.gram[left_out].sum(axis=0)[np.ix_(index, index)]
    test_vector = system.vector[left_out].sum(axis=0)[index]
    share = 1.0 - float(left_out.mean())
    beta = np.zeros(len(labels))
    losses = np.empty(path.size)
    for k, penalty in enumerate(path.tolist()):
        beta = _descended(gram * np.outer(scale, scale), vector * scale, share * penalty, signed, beta)
        terms = scale * beta
        every = np.concatenate((solved[:, 0] - solved[:, 1:] @ terms, terms))
        losses[k] = every @ test_gram @ every - 2.0 * every @ test_vector
    return losses


def _descended(
    gram: NDArray[np.float64],
    vector: NDArray[np.float64],
    penalty: float,
    signed: NDArray[np.bool_],
    start: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Coordinate descent of ½·βᵀGβ − βᵀv + penalty·Σ|β|, β ≥ 0 but where signed (Friedman et al. 2010, §2)."""
    beta = start.copy()
    own = np.diag(gram)
    remainder = vector - gram @ beta
    for _ in range(SWEEPS):
        largest = 0.0
        for j in np.flatnonzero(own > 1e-9).tolist():
            free = remainder[j] + own[j] * beta[j]
            value = max(free - penalty, 0.0) / own[j]
            if signed[j] and free < -penalty:
                value = (free + penalty) / own[j]
            step = value - beta[j]
            if step != 0.0:
                remainder -= step * gram[:, j]
                beta[j] = value
                largest = max(largest, abs(step))
        if largest <= CONVERGED * max(float(np.abs(beta).max()), 1.0):
            break
    return beta
