"""Energy, time and speed over a chain of links: the fast model of the source (equations 1-41)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from energy import kernels
from energy.errors import LinkError
from energy.kernels import PART_COUNT, LinkPhysics
from energy.vehicle import CHECKED_SPEED_MPS, GRAVITY_MPS2

if TYPE_CHECKING:
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
    _check_chain(chain)
    if not 0.0 <= start_speed_mps <= CHECKED_SPEED_MPS:
        raise LinkError("start_speed_mps", 0, start_speed_mps, f"0..{CHECKED_SPEED_MPS:.2f} (200 km/h)")
    n = chain.length_m.size
    energy, time, standstill, v_end, p_end = (np.empty(n) for _ in range(5))
    parts = np.zeros((n, PART_COUNT))
    kernels.drive_chain(
        link_physics(vehicle, link_model),
        chain.length_m,
        chain.grade_frac,
        chain.speed_limit_mps,
        chain.stop_probability_frac,
        chain.stop_time_s,
        chain.stop_class,
        RULE_CODE[stop_rule],
        start_speed_mps,
        arrive_stopped,
        energy,
        time,
        standstill,
        v_end,
        p_end,
        parts,
    )
    links = tuple(
        LinkResult(float(energy[k]), float(time[k]), float(standstill[k]), float(v_end[k]), float(p_end[k]), parts[k])
        for k in range(n)
    )
    stops = float(p_end[:-1].sum()) if arrive_stopped else float(p_end.sum())
    return ChainResult(
        links=links,
        distance_m=float(chain.length_m.sum()),
        duration_s=float(time.sum()),
        standstill_s=float(standstill.sum()),
        stop_count=stops,
        energy_j=float(energy.sum()),
        parts=EnergyParts(*(float(x) for x in parts.sum(axis=0))),
    )


RULE_CODE: Final = {
    StopRule.EXPECTED: kernels.EXPECTED,
    StopRule.COUNTED: kernels.COUNTED,
    StopRule.NONE: kernels.NO_STOPS,
}


def link_physics(vehicle: Vehicle, link_model: LinkModel = LinkModel.INTEGRATED) -> LinkPhysics:
    """The vehicle's parameters in the form that the kernels take."""
    return LinkPhysics(
        rolling_n=float(vehicle.road_load_a_n),
        linear_n_per_mps=float(vehicle.road_load_b_n_per_mps),
        aero_n_per_mps2=float(vehicle.road_load_c_n_per_mps2),
        weight_n=float(vehicle.mass_kg * GRAVITY_MPS2),
        inertia_kg=float(vehicle.mass_kg * vehicle.rotating_mass_coef),
        drive_factor=1.0 / float(vehicle.drive_eff),
        recuperation_factor=float(vehicle.recuperation_eff),
        aux_move_w=float(vehicle.aux_power_w / vehicle.aux_move_eff),
        aux_idle_w=float(vehicle.aux_power_w / vehicle.aux_idle_eff),
        speed_bound_mps=np.array(vehicle.accel_speed_mps, np.float64),
        accel_sum=np.concatenate(([0.0], np.cumsum(vehicle.accel_mps2))),
        decel_sum=np.concatenate(([0.0], np.cumsum(-vehicle.decel_mps2))),
        printed=link_model is LinkModel.PRINTED,
    )


def _check_chain(chain: Chain) -> None:
    """Raise LinkError for the first value out of range; comparisons are written so that NaN fails them."""
    n = chain.length_m.size
    if n == 0:
        raise LinkError("length_m", 0, "absent", "at least one link")
    checks = (
        ("length_m", chain.length_m, chain.length_m > 0.0, "a positive finite number"),
        ("grade_frac", chain.grade_frac, np.abs(chain.grade_frac) <= 1.0, "-1..1 (rise over length)"),
        (
            "speed_limit_mps",
            chain.speed_limit_mps,
            (chain.speed_limit_mps > 0.0) & (chain.speed_limit_mps <= CHECKED_SPEED_MPS),
            f"above 0, at most {CHECKED_SPEED_MPS:.2f} (200 km/h)",
        ),
        (
            "stop_probability_frac",
            chain.stop_probability_frac,
            (chain.stop_probability_frac >= 0.0) & (chain.stop_probability_frac <= 1.0),
            "0..1",
        ),
        ("stop_time_s", chain.stop_time_s, chain.stop_time_s >= 0.0, "a non-negative finite number"),
        ("stop_class", chain.stop_class, (chain.stop_class >= 0) & (chain.stop_class < 8), "0..7"),
    )
    for name, values, good, allowed in checks:
        if values.shape != (n,):
            raise LinkError(name, 0, f"{values.size} values", f"{n}, one a link")
        good = good & np.isfinite(values)
        if not bool(good.all()):
            position = int(np.argmin(good))
            raise LinkError(name, position, values[position].item(), allowed)
