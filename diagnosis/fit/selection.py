"""Which left-out effects a set of drives speaks for, and which of them it cannot tell apart.

The vehicle's parameters and what sensors do are always free, so that what they can explain is never called physics.
A term is added while it stands out between trips by more than drives with nothing left out would make any term stand
out, while it helps to predict trips left out, and while it holds a share of the energy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.causes.families import Family
from diagnosis.fit.jackknife import additions, first_least, ranked, simulated_additions, solve
from diagnosis.fit.windows import measured_size_j

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.terms import Candidate
    from diagnosis.fit.jackknife import Additions, Equations, Solution
    from diagnosis.fit.windows import Windows

LEAST_TRIPS: Final = 6  # fewer say too little about how trips differ
NULL_DRAWS: Final = 400
FALSE_CLAIM_FRAC: Final = 0.01  # of drives with nothing left out in which the highest term would pass
LEAST_Z: Final = 3.3
LEAST_SHARE_FRAC: Final = 0.01
OSCILLATING_SHARE_FRAC: Final = 0.02  # of what goes to and fro, which adds up to less over a trip
LEAST_OF_LARGEST: Final = 0.1  # less than this share of the largest term may be an error of its form
MOST_TERMS: Final = 8
# what a family must exceed, over the threshold of all: the strictest that names no true effect less, of those at which
# false names stay below 2 % with 90 % confidence (Learn-then-Test over 643 made worlds of retired seeds, docs/proof.md)
Z_FACTORS: Final = {
    Family.ROLLING: 0.9,
    Family.RECUPERATION: 1.1,
}
RIVAL_Z: Final = 2.5  # a term that stands out by so much beside a finding is there as well
ALONE_FRAC: Final = 0.65  # of the threshold, that a rival must stand out by where the finding is not there
RIVAL_LOSS_FRAC: Final = 0.5  # of what a finding gains, that a rival in its place may lose


@dataclass(frozen=True, slots=True)
class Threshold:
    """What a term must exceed, and how it was found: z, draws, and the share of draws in which any term would."""

    z: float
    draws: int
    false_claims: float


@dataclass(frozen=True, slots=True)
class Selection:
    """Terms in the order in which they were found, those that cannot be told from each, and the fit with them."""

    found: tuple[Candidate, ...]
    rivals: Mapping[str, tuple[Candidate, ...]]
    z: Mapping[str, float]
    solution: Solution


def threshold(
    system: Equations,
    free: Sequence[str],
    candidates: Sequence[Candidate],
    seed: int,
    scatter: NDArray[np.float64],
    draws: int = NULL_DRAWS,
) -> Threshold:
    """The z that any term exceeds in a share of FALSE_CLAIM_FRAC of simulated drives with nothing left out."""
    z = simulated_additions(
        system, free, [candidate.label for candidate in candidates], draws, np.random.default_rng(seed), scatter
    )
    one_sided = np.array([candidate.term.positive for candidate in candidates])
    highest = np.where(one_sided, z, np.abs(z)).max(axis=1)
    found = max(float(np.quantile(highest, 1.0 - FALSE_CLAIM_FRAC)), LEAST_Z)
    return Threshold(found, draws, float((highest > found).mean()))


def scatter_of(system: Equations, solution: Solution) -> NDArray[np.float64]:
    """How much the windows of each trip scatter about a fit, over what the noise makes of them, float64 (K,)."""
    index = system.index(solution.names)
    beta = solution.coefficients
    loss = (
        system.square
        - 2.0 * system.vector[:, index] @ beta
        + np.einsum("q,kqr,r->k", beta, system.gram[:, index[:, None], index[None, :]], beta)
    )
    return np.asarray(np.sqrt(np.maximum(loss / system.count, 1e-6)), np.float64)


def select(
    system: Equations,
    free: Sequence[str],
    candidates: Sequence[Candidate],
    trips: Sequence[Windows],
    least_z: float,
) -> Selection:
    """The terms that a system speaks for, and the rivals of each."""
    found = chosen(system, free, candidates, trips, least_z)
    solution = solve(system, [*free, *(candidate.label for candidate in found)])
    return Selection(
        tuple(found),
        {candidate.label: rivals(system, free, candidates, found, candidate, least_z) for candidate in found},
        {candidate.label: alone_z(system, free, found, candidate) for candidate in found},
        solution,
    )


def chosen(
    system: Equations,
    free: Sequence[str],
    candidates: Sequence[Candidate],
    trips: Sequence[Windows],
    least_z: float,
) -> list[Candidate]:
    """Terms by forward selection and a backward check.

    One term is taken at one value of its shape only; of terms that help alike, the first candidate.
    """
    sizes = {candidate.label: _size_j(candidate, trips) for candidate in candidates}
    measured_j = measured_size_j(trips)
    found: list[Candidate] = []
    while len(found) < MOST_TERMS:
        open_ = [
            candidate for candidate in candidates if not any(other.term.excludes(candidate.term) for other in found)
        ]
        if not open_:
            break
        names = [*free, *(candidate.label for candidate in found)]
        added = additions(system, names, [candidate.label for candidate in open_])
        gain = float(solve(system, names).losses.sum()) - added.losses.sum(axis=0)
        known = [measured_loss(system, candidate.label) for candidate in open_]
        gain = gain + np.array(known)
        passes = np.array(
            [
                _stands_out(candidate, added, k, sizes[candidate.label] / measured_j, least_z, known[k])
                for k, candidate in enumerate(open_)
            ]
        ) & (gain > 0.0)
        if not passes.any():
            break
        found.append(open_[int(first_least(np.where(passes, -gain, np.inf)))])
    return still_standing(system, free, found, trips, least_z)


def alone_z(system: Equations, free: Sequence[str], found: Sequence[Candidate], candidate: Candidate) -> float:
    """z of a term beside all others that were found."""
    others = [*free, *(other.label for other in found if other is not candidate)]
    return float(additions(system, others, [candidate.label]).z[0])


def rivals(
    system: Equations,
    free: Sequence[str],
    candidates: Sequence[Candidate],
    found: Sequence[Candidate],
    candidate: Candidate,
    least_z: float,
) -> tuple[Candidate, ...]:
    """Terms of other families that do what a found one does: one shape of each effect, the best first.

    In its place they stand out themselves, and lose little of what it gains on trips left out: so little may be a
    matter of its form. Where both are needed beside each other, neither is the other's rival.
    """
    others = [*free, *(other.label for other in found if other is not candidate)]
    open_ = [
        other
        for other in candidates
        if other.term.family is not candidate.term.family and all(other.term is not known.term for known in found)
    ]
    if not open_:
        return ()
    labels = [other.label for other in open_]
    alone = additions(system, others, labels)
    own = additions(system, others, [candidate.label])
    by_effect: dict[str, list[tuple[float, Candidate]]] = {}
    known = measured_loss(system, candidate.label)
    gain = float((solve(system, others).losses - own.losses[:, 0]).sum()) + known
    for k, other in enumerate(open_):
        sign = 1.0 if other.term.positive else np.sign(alone.z[k])
        if sign * alone.z[k] < ALONE_FRAC * least_z or _beyond(other, alone, k):
            continue
        if float((alone.losses[:, k] - own.losses[:, 0]).sum()) + known > RIVAL_LOSS_FRAC * gain:
            continue
        beside = additions(system, [*others, other.label], [candidate.label]).z[0]
        reverse = additions(system, [*others, candidate.label], [other.label]).z[0]
        if abs(beside) >= least_z and sign * reverse >= RIVAL_Z:
            continue  # both are there
        by_effect.setdefault(other.term.effect, []).append((float(alone.losses[:, k].sum()), other))
    best = [shapes[int(first_least(np.array([loss for loss, _ in shapes])))] for shapes in by_effect.values()]
    return tuple(best[k][1] for k in ranked(np.array([loss for loss, _ in best])))


def measured_loss(system: Equations, label: str) -> float:
    """What was measured of a coefficient beside the energies, as the loss of leaving it out: (value / sd)²."""
    k = system.names.index(label)
    return float(system.prior.precision[k] * system.prior.mean[k] ** 2)


def still_standing(
    system: Equations, free: Sequence[str], found: Sequence[Candidate], trips: Sequence[Windows], least_z: float
) -> list[Candidate]:
    """Found terms without those that others, or free columns, have taken over; the weakest goes first."""
    measured_j = measured_size_j(trips)
    sizes = {candidate.label: _size_j(candidate, trips) for candidate in found}
    kept = list(found)
    while kept:
        z = {}
        tried = {
            candidate.label: additions(
                system, [*free, *(other.label for other in kept if other is not candidate)], [candidate.label]
            )
            for candidate in kept
        }
        largest = max(abs(float(tried[candidate.label].coefficients[0])) * sizes[candidate.label] for candidate in kept)
        for candidate in kept:
            added = tried[candidate.label]
            size = abs(float(added.coefficients[0])) * sizes[candidate.label]
            passes = size >= LEAST_OF_LARGEST * largest
            known = measured_loss(system, candidate.label)
            passes = passes and _stands_out(candidate, added, 0, sizes[candidate.label] / measured_j, least_z, known)
            z[candidate.label] = abs(float(added.z[0])) if passes else -1.0
        weakest = min(kept, key=lambda candidate: z[candidate.label])
        if z[weakest.label] >= 0.0:
            break
        kept.remove(weakest)
    return kept


def _stands_out(
    candidate: Candidate, added: Additions, k: int, unit_share: float, least_z: float, known: float
) -> bool:
    """Whether a term passes; known: what was measured of it beside the energies, as a loss of leaving it out."""
    coefficient = float(added.coefficients[k])
    z = max(abs(float(added.z[k])), known**0.5)
    if candidate.term.positive and coefficient <= 0.0:
        return False
    if _beyond(candidate, added, k):
        return False
    least = OSCILLATING_SHARE_FRAC if candidate.term.oscillates else LEAST_SHARE_FRAC
    return z >= least_z * Z_FACTORS.get(candidate.term.family, 1.0) and abs(coefficient) * unit_share >= least


def _beyond(candidate: Candidate, added: Additions, k: int) -> bool:
    """Whether a coefficient is larger than such a thing can be."""
    return float(added.coefficients[k]) - 2.0 * float(added.sd[k]) > candidate.term.most


def _size_j(candidate: Candidate, trips: Sequence[Windows]) -> float:
    """Energy that one unit of a term moves in all trips; of one that oscillates, half of what goes to and fro."""
    columns = [trip.column(candidate.label) for trip in trips]
    if candidate.term.oscillates:
        return 0.5 * sum(float(np.abs(column).sum()) for column in columns)
    return sum(abs(float(column.sum())) for column in columns)
