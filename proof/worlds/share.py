"""How strong an effect must be to take a wanted share of the energy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

SHARE_TOLERANCE: Final = 1e-4  # of the wanted share
MOST_TRIES: Final = 40


class ShareError(Exception):
    """A share that no believable strength of the effect reaches on these drives."""

    def __init__(self, effect: str, wanted: float, reached: float, most: float) -> None:
        self.effect = effect
        self.wanted = wanted
        self.reached = reached
        self.most = most
        super().__init__(f"share of {effect} is {wanted:.3f}, allowed: up to {reached:.3f}, at strength {most:g}")


def energy_share(with_j: NDArray[np.float64], without_j: NDArray[np.float64]) -> float:
    """Sum of the magnitudes of what an effect does to each trip, by the energy of all trips with it [-].

    with_j, without_j: float64 (trips,) energy of each trip with and without the effect [J].
    """
    return float(np.sum(np.abs(with_j - without_j)) / np.sum(with_j))


def scaled(
    share_of: Callable[[float], float],
    wanted: float,
    most: float,
    effect: str,
    guess: float = 1.0,
    tolerance: float = SHARE_TOLERANCE,
) -> float:
    """The strength in (0, most] whose share is the wanted one, but for the tolerance, a part of it.

    share_of: rising in strength and 0 at 0, nearly straight as a rule: the rule of false position with Illinois'
    halving. Raises ShareError where even the largest strength has a smaller share.
    """
    low, low_miss = 0.0, -wanted
    high, high_miss = most, np.inf  # not known until tried
    at = min(guess, most)
    for _ in range(MOST_TRIES):
        share = share_of(at)
        miss = share - wanted
        if abs(miss) <= tolerance * wanted:
            return at
        if miss < 0.0:
            if at >= most:
                break
            low, low_miss, high_miss = at, miss, 0.5 * high_miss
        else:
            high, high_miss, low_miss = at, miss, 0.5 * low_miss
        if np.isinf(high_miss):
            at = min(at * max(wanted / max(share, 1e-9), 1.01), most)
        else:
            at = low - low_miss * (high - low) / (high_miss - low_miss)
    raise ShareError(effect, wanted, share, at)
