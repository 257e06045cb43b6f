"""What is kept beyond the energy of ways so that a plan is as sure as it was asked to be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.charging.network import Arc, Part

SAME_FRAC: Final = 1e-7  # of the capacity, by which margins may differ
MORE_FRAC: Final = 0.002  # of the capacity
OPTIMISM: Final = 0.98  # of the least of the margins that were needed, compared with least ones; assumed


class Margins:
    """Margins of arcs: of those that a plan has taken, what its promise needed; of others, factor times the least.

    The factor is 1, with which no way's margin is too large, or below what the plans so far have needed, so that ways
    that may be better are tried and a plan is found soon.

    An arc needs more where the station before it is passed without a charge, since what was not certain until there
    adds to it. Searches don't tell which they do, so that it keeps the more of both once it was driven so, unless
    is_relaxed: then no margin is too large.
    """

    def __init__(self) -> None:
        self.factor = 1.0
        self.is_relaxed = False
        self._passed: dict[tuple[tuple[int, int, int, float, float], ...], float] = {}
        self._known: dict[tuple[tuple[int, int, int, float, float], ...], float] = {}

    def of(self, arc: Arc) -> float:
        """Margin of an arc [J]."""
        if not self._known and not self._passed:
            return self.factor * arc.margin_j
        key = _key(arc.parts)
        known = self._known.get(key)
        margin_j = self.factor * arc.margin_j if known is None else known
        return margin_j if self.is_relaxed else max(margin_j, self._passed.get(key, 0.0))

    @property
    def may_be_too_large(self) -> bool:
        """Whether an arc keeps what it needs after a station that is passed, also where that one is charged at."""
        return bool(self._passed)

    def is_known(self, arc: Arc) -> bool:
        """Whether it is known what an arc needs."""
        return _key(arc.parts) in self._known

    def places(self) -> set[int]:
        """Places from which arcs of known margins lead."""
        return {here for here, *_ in (key[0] for key in (*self._known, *self._passed))}

    def learn(self, taken: Sequence[Taken], confidence: float, capacity_j: float) -> bool:
        """Take what each arc of a plan needs from its promise; whether all that was known before."""
        settled = True
        for drive in taken:
            used, margin_j = self.of(drive.arc), max(drive.needed_j - drive.nominal_j, 0.0)
            if drive.kept_frac < confidence:
                # where the drives before have changed what it needs, a little more each round
                margin_j = margin_j if margin_j > used else used + MORE_FRAC * capacity_j
                settled = False
            key = _key(drive.arc.parts)
            if drive.passes:
                settled &= margin_j <= used + SAME_FRAC * capacity_j
                self._passed[key] = max(margin_j, self._passed.get(key, 0.0))
            else:
                settled &= abs(max(margin_j, self._passed.get(key, 0.0)) - used) <= SAME_FRAC * capacity_j
                self._known[key] = margin_j
        return settled

    def expect(self, taken: Sequence[Taken]) -> None:
        """Expect of all ways what those taken have needed, a little less."""
        factors = [OPTIMISM * self.of(drive.arc) / least for drive in taken if (least := drive.arc.margin_j) > 0.0]
        self.factor = max(min(factors, default=1.0), 1.0)


@dataclass(frozen=True, slots=True)
class Taken:
    """An arc that a plan takes: the charge that it begins with at least by the mean and by the promise [J].

    kept_frac: probability of its leg that is least sure; most_kept_frac: with as much charge as there may be before it.
    passes: whether it begins at a station that is passed without a charge.
    """

    arc: Arc
    nominal_j: float
    needed_j: float
    kept_frac: float
    most_kept_frac: float
    passes: bool = False


def _key(parts: Sequence[Part]) -> tuple[tuple[int, int, int, float, float], ...]:
    """What tells an arc, whichever search found its ways."""
    return tuple((part.here, part.there, part.cap, part.way.time_s, part.way.energy_j) for part in parts)
