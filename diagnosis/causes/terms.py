"""What a candidate effect is: terms of power, each with shapes that are tried."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from diagnosis.causes.families import Family

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from diagnosis.causes.driven import ReplayedDrive


@dataclass(frozen=True, slots=True)
class TermShape:
    """What bends a term: its name, unit, the values that are tried, and the range it is refined in."""

    name: str
    unit: str
    grid: tuple[float, ...]
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Term:
    """One coefficient of an effect.

    energy_j: of one unit of it on a drive, for a value of the shape (NaN without one), float64 (n,). positive: whether
    it can only be ≥ 0; most: what no such thing exceeds. channels: what must have been recorded. oscillates: whether it
    adds and gives back in turn, so that its size is not its sum. by_voltage: True where the battery's resistance must
    be known by its voltage, False where the term is not needed then. alternative:
    whether other terms of its effect are other forms of it.
    """

    effect: str
    name: str
    unit: str
    family: Family
    energy_j: Callable[[ReplayedDrive, float], NDArray[np.float64]]
    shape: TermShape | None = None
    positive: bool = True
    channels: tuple[str, ...] = ()
    needs_ambient: bool = False
    oscillates: bool = False
    most: float = float("inf")
    by_voltage: bool | None = None
    alternative: bool = False

    def excludes(self, other: Term) -> bool:
        """Whether another term cannot stand beside it: itself, and another form of the same effect."""
        return other is self or (self.alternative and other.alternative and other.effect == self.effect)

    def known_on(self, drive: ReplayedDrive) -> bool:
        """Whether a drive has recorded what the term needs."""
        if self.needs_ambient and drive.ambient_k is None:
            return False
        if self.by_voltage and drive.battery is None:
            return False
        return all(name in drive.channels for name in self.channels)

    def column_j(self, drive: ReplayedDrive, shape: float) -> NDArray[np.float64]:
        """Energy of one unit on a drive, float64 (n,) [J]; 0 where the drive does not know what it needs."""
        return self.energy_j(drive, shape) if self.known_on(drive) else np.zeros_like(drive.duration_s)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A term at one value of its shape, NaN where it has none."""

    term: Term
    shape: float

    @property
    def label(self) -> str:
        """Name of the term, with its shape where it has one."""
        if self.term.shape is None:
            return self.term.name
        return f"{self.term.name}@{self.shape:g}"
