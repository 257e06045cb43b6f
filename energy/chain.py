"""Energy, time and speed over a chain of links: the fast model of the source (equations 1-41)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from energy.vehicle import Vehicle


class LinkModel(StrEnum):
    """Evaluation of a dynamic phase: exact integral, or equations (11)-(41) as printed."""

    INTEGRATED = "integrated"
    PRINTED = "printed"


class StopRule(StrEnum):
    """How stops at link ends are treated: by expectation, by the source's counters, or not at all."""

    EXPECTED = "expected"
    COUNTED = "counted"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Chain:
    """Links to be driven one after the other, each array with one value a link.

    length_m: float64 (n,) > 0. grade_frac: float64 (n,) sin θ, -1..1. speed_limit_mps: float64 (n,) > 0.
    stop_probability_frac: float64 (n,) 0..1, stop_time_s: float64 (n,) ≥ 0, at the end of the link.
    stop_class: int8 (n,) counter that the link's end belongs to, for the rule `counted`: 4·urban + cross.
    """

    length_m: NDArray[np.float64]
    grade_frac: NDArray[np.float64]
    speed_limit_mps: NDArray[np.float64]
    stop_probability_frac: NDArray[np.float64]
    stop_time_s: NDArray[np.float64]
    stop_class: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class LinkResult:
    """What driving one link takes.

    energy_j: from the battery [J], negative where more is recuperated. duration_s includes standing still.
    speed_end_mps: speed carried into the next link, given no stop. stop_probability_frac: of having stopped at its end.
    parts_j: float64 (8,), in the order rolling, linear, aero, grade, inertia, drivetrain loss, recuperation
    loss, auxiliary; they add up to energy_j.
    """

    energy_j: float
    duration_s: float
    standstill_s: float
    speed_end_mps: float
    stop_probability_frac: float
    parts_j: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class EnergyParts:
    """Battery energy by cause [J]; the parts add up to the whole."""

    rolling_j: float
    linear_j: float
    aero_j: float
    grade_j: float
    inertia_j: float
    drivetrain_loss_j: float
    recuperation_loss_j: float
    auxiliary_j: float

    def total_j(self) -> float:
        """Sum of all parts [J]."""
        return (
            self.rolling_j
            + self.linear_j
            + self.aero_j
            + self.grade_j
            + self.inertia_j
            + self.drivetrain_loss_j
            + self.recuperation_loss_j
            + self.auxiliary_j
        )


@dataclass(frozen=True, slots=True)
class ChainResult:
    """What driving a whole chain takes; links in order, sums over them."""

    links: tuple[LinkResult, ...]
    distance_m: float
    duration_s: float
    standstill_s: float
    stop_count: float  # expected number under `expected`, whole under `counted`
    energy_j: float
    parts: EnergyParts


def simulate_chain(
    vehicle: Vehicle,
    chain: Chain,
    *,
    link_model: LinkModel = LinkModel.INTEGRATED,
    stop_rule: StopRule = StopRule.EXPECTED,
    start_speed_mps: float = 0.0,
    arrive_stopped: bool = True,
) -> ChainResult:
    """Energy and time of driving a chain; arrive_stopped: the vehicle stops at the end of the last link.

    Without arrive_stopped the last link ends by equation (9), its successor being unknown.
    Raises LinkError on a length or limit that is not positive, NaN, or a grade or probability out of range.
    """
    raise NotImplementedError
