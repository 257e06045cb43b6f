"""How often and how long a vehicle stands still at the end of a link (source, section II.B, tables II and III)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray


class FunctionalClass(IntEnum):
    """Functional road class of a link, from motorway to service road (table II, parameter FC)."""

    MOTORWAY = 0
    TRUNK = 1
    PRIMARY = 2
    SECONDARY = 3
    TERTIARY = 4
    UNCLASSIFIED = 5
    RESIDENTIAL = 6
    SERVICE = 7


class Cross(IntEnum):
    """Verbal probability of stopping at the end of a link (table II, parameter Cross)."""

    NONE = 0
    SMALL = 1
    MEDIUM = 2
    LARGE = 3


def _default_probability() -> NDArray[np.float64]:
    return np.array([[0.0, 0.05, 0.20, 0.40], [0.0, 0.10, 0.30, 0.50]])


def _default_time_s() -> NDArray[np.float64]:
    return np.array([[0.0, 5.0, 10.0, 20.0], [0.0, 5.0, 15.0, 21.0]])


@dataclass(frozen=True, slots=True)
class StopSettings:
    """Target stop probability and stop time for each (urban, cross).

    probability_frac: float64 (2, 4), [0..1], row 0 outside and row 1 inside urban areas, column = Cross.
    time_s: float64 (2, 4), [s], same layout.

    The source prints only that its probabilities lie between 0.05 and 0.5 and that its stop times are
    averages of its own drives (section III.B); the values here span that range and are assumed. The
    urban "large" time of 21 s is table IV's standstill time over its number of stops, 3234 s / 154.
    """

    probability_frac: NDArray[np.float64] = field(default_factory=_default_probability)
    time_s: NDArray[np.float64] = field(default_factory=_default_time_s)

    def __post_init__(self) -> None:
        for name, table, upper in (
            ("probability_frac", self.probability_frac, 1.0),
            ("time_s", self.time_s, 86_400.0),
        ):
            if table.shape != (2, 4):
                raise ValueError(f"{name} has shape {table.shape}, expected (2, 4)")
            if not bool(np.all((table >= 0.0) & (table <= upper))):
                raise ValueError(f"{name} has a value outside 0..{upper:g}")
            if bool(np.any(table[:, Cross.NONE] != 0.0)):
                raise ValueError(f"{name}[:, none] must be 0: 'none' means that the vehicle never stops")


USUAL_STOPS: Final = StopSettings()
