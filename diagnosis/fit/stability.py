"""What of a selection lasts when other drives had been recorded, and when the vehicle's file had other numbers.

The selection is repeated on parts of the drives, each time about a file whose numbers are shaken. A cause that is named
only on some of these draws depends on which drives happened to be there: what was named in its place is its rival, and
where nothing was, it does not stand (stability selection, Meinshausen and Bühlmann 2010, with parts of PART_FRAC).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.causes.families import Family
from diagnosis.causes.nuisance import PARAMETERS
from diagnosis.fit.selection import LEAST_TRIPS, chosen

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.terms import Candidate
    from diagnosis.fit.jackknife import Equations
    from diagnosis.fit.windows import Windows
    from energy.vehicle.vehicle import Vehicle

DRAWS: Final = 24
PART_FRAC: Final = 0.75  # of the drives, that each draw keeps
FILE_SD_FRAC: Final = 0.1  # of the file's numbers, by which each draw has others
CLEAR_FRAC: Final = 0.8  # of the draws, in which a cause must be named to be called clear
# families that are named as rightly from a smaller share on (as selection.Z_FACTORS)
CLEAR_FRACS: Final = {Family.ROLLING: 0.65, Family.AERODYNAMIC: 0.65, Family.WIND: 0.65}
INSTEAD_FRAC: Final = 0.1  # of the draws, from which on something in its place counts
MORE_FRAC: Final = 0.25  # by which it must be named more often without the cause than beside it
EASIER: Final = 0.8  # of the threshold, since fewer drives make everything stand out less


@dataclass(frozen=True, slots=True)
class Stability:
    """How often each family and effect was named over draws of drives and of the file's numbers.

    named: of each draw, the effects that were named, by family.
    """

    named: tuple[Mapping[Family, frozenset[str]], ...]

    def held_frac(self, family: Family) -> float:
        """Share of the draws in which a family was named [-]."""
        return sum(family in draw for draw in self.named) / max(len(self.named), 1)

    def instead(self, family: Family) -> dict[str, Family]:
        """Effects of other families that are named where this one is not, and rarely beside it, the likeliest first.

        Nothing where the family holds in CLEAR_FRAC of the draws.
        """
        if self.held_frac(family) >= CLEAR_FRAC:
            return {}
        with_it = [draw for draw in self.named if family in draw]
        without = [draw for draw in self.named if family not in draw]
        found: dict[str, tuple[float, Family]] = {}
        pairs = {(effect, other) for draw in without for other, effects in draw.items() for effect in effects}
        for effect, other in sorted(pairs):
            absent = sum(effect in draw.get(other, ()) for draw in without)
            beside = sum(other in draw for draw in with_it) / max(len(with_it), 1)
            if absent >= INSTEAD_FRAC * len(self.named) and absent / len(without) - beside >= MORE_FRAC:
                found[effect] = (absent, other)
        return {effect: found[effect][1] for effect in sorted(found, key=lambda name: (-found[name][0], name))}

    def stands(self, family: Family) -> bool:
        """Whether a family is named on its share of the draws, or on the others something in its place."""
        instead = self.instead(family)
        held = sum(family in draw or any(other in draw for other in instead.values()) for draw in self.named)
        return held >= CLEAR_FRACS.get(family, CLEAR_FRAC) * len(self.named)


def stability(
    system: Equations,
    free: Sequence[str],
    candidates: Sequence[Candidate],
    trips: Sequence[Windows],
    nameplate: Vehicle,
    least_z: float,
    seed: int,
) -> Stability:
    """The families that are named on parts of the drives, about files that differ from the vehicle's own."""
    rng = np.random.default_rng(seed)
    count = max(round(PART_FRAC * len(trips)), min(LEAST_TRIPS, len(trips)))
    named = []
    for _ in range(DRAWS):
        kept = np.sort(rng.permutation(len(trips))[:count])
        part = shaken(drives_of(system, kept), nameplate, rng)
        found = chosen(part, free, candidates, [trips[k] for k in kept], EASIER * least_z)
        families: dict[Family, frozenset[str]] = {}
        for candidate in found:
            before = families.get(candidate.term.family, frozenset())
            families[candidate.term.family] = before | {candidate.term.effect}
        named.append(families)
    return Stability(tuple(named))


def drives_of(system: Equations, kept: NDArray[np.int64]) -> Equations:
    """The equations of some of the trips."""
    return replace(
        system,
        gram=system.gram[kept],
        vector=system.vector[kept],
        square=system.square[kept],
        count=system.count[kept],
    )


def shaken(system: Equations, nameplate: Vehicle, rng: np.random.Generator) -> Equations:
    """The equations as they are about a file whose numbers are drawn about the vehicle's by FILE_SD_FRAC."""
    mean, low, high = system.prior.mean.copy(), system.prior.low.copy(), system.prior.high.copy()
    for parameter in PARAMETERS:
        k = system.names.index(parameter.name)
        shift = FILE_SD_FRAC * abs(float(getattr(nameplate, parameter.name))) * float(rng.standard_normal())
        own_low, own_high = low[k] - mean[k], high[k] - mean[k]
        mean[k] += shift
        low[k], high[k] = max(low[k], mean[k] + own_low), min(high[k], mean[k] + own_high)
        low[k], high[k] = min(low[k], mean[k]), max(high[k], mean[k])
    return replace(system, prior=replace(system.prior, mean=mean, low=low, high=high))
