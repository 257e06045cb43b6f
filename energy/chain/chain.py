"""Energy, time and speed over a chain of links: the fast model of the source (equations 1-41)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final, overload

import numpy as np

from energy.chain import kernels_chain
from energy.chain.kernels_link import CARRIED_MPS
from energy.conditions import STILL, Conditions
from energy.errors import LinkError
from energy.force.effects import LinkSetting, drive_of
from energy.force.parts import EnergyParts, energy_parts
from energy.units import JOULE_PER_WH
from energy.vehicle.vehicle import CHECKED_SPEED_MPS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from energy.vehicle.consumption_table import ConsumptionTableVehicle
    from energy.vehicle.vehicle import Vehicle


class LinkModel(StrEnum):
    """Evaluation of a dynamic phase: exact integral, or equations (11)-(41) as printed."""

    INTEGRATED = "integrated"
    PRINTED = "printed"


class StopRule(StrEnum):
    """How stops at link ends are treated.

    By expectation, by the source's counters, not at all, or for certain wherever a minor road meets a major one or a
    roundabout is entered (cross medium or large), which is the rule of the source's time-step model.
    """

    EXPECTED = "expected"
    COUNTED = "counted"
    NONE = "none"
    CROSSINGS = "crossings"


@dataclass(frozen=True, slots=True)
class Chain:
    """Links to be driven one after the other, each array with one value a link.

    length_m: float64 (n,) > 0. grade_frac: float64 (n,) sin θ, -1..1. speed_limit_mps: float64 (n,) > 0.
    stop_probability_frac: float64 (n,) 0..1, stop_time_s: float64 (n,) ≥ 0, at the end of the link.
    stop_class: int8 (n,) counter that the link's end belongs to, for the rule `counted`: 4·urban + cross; or
    energy.chain.kernels_chain.REST where the vehicle comes to rest at the link's end for stop_time_s, whatever the
    rule.
    altitude_m: float64 (n,) mean height, for the density of the air. heading: float64 (n, 2) east and north part of the
    way over its length, for wind. Both may be absent; conditions that need them then raise ConditionsError.
    carried_s: float64 (n,) time for which a ferry carries the vehicle over the link, 0 where it drives [s]; None where
    it drives everywhere. It comes to rest before, and takes nothing on board.
    """

    length_m: NDArray[np.float64]
    grade_frac: NDArray[np.float64]
    speed_limit_mps: NDArray[np.float64]
    stop_probability_frac: NDArray[np.float64]
    stop_time_s: NDArray[np.float64]
    stop_class: NDArray[np.int8]
    altitude_m: NDArray[np.float64] | None = None
    heading: NDArray[np.float64] | None = None
    carried_s: NDArray[np.float64] | None = None

    @property
    def carried(self) -> NDArray[np.bool_]:
        """Whether the vehicle is carried over a link, bool (n,)."""
        return np.zeros(self.length_m.size, np.bool_) if self.carried_s is None else self.carried_s > 0.0


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """How a chain is driven; arrive_stopped: the vehicle stops at the end of the last link."""

    conditions: Conditions = STILL
    link_model: LinkModel = LinkModel.INTEGRATED
    stop_rule: StopRule = StopRule.EXPECTED
    start_speed_mps: float = 0.0
    arrive_stopped: bool = True


@dataclass(frozen=True, slots=True)
class LinkResult:
    """What driving one link takes.

    energy_j: from the battery [J], negative where more is recuperated. duration_s includes standing still.
    speed_end_mps: speed carried into the next link, given no stop. stop_probability_frac: of having stopped at its end.
    parts_j: float64 (20,), in the order of `energy.force.parts.Part`; they add up to energy_j.
    """

    energy_j: float
    duration_s: float
    standstill_s: float
    speed_end_mps: float
    stop_probability_frac: float
    parts_j: NDArray[np.float64]

    @property
    def carried_mps(self) -> float:
        """Speed carried into the next link, given no stop; 0 where the vehicle comes to rest for certain."""
        return 0.0 if self.stop_probability_frac >= 1.0 else self.speed_end_mps


@dataclass(frozen=True, slots=True, eq=False)
class LinkResults(Sequence[LinkResult]):
    """What driving each link of a chain takes, in order: the rows are LinkResult, the columns arrays of its fields.

    Each float64 (n,), parts_j float64 (n, 20).
    """

    energy_j: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    standstill_s: NDArray[np.float64]
    speed_end_mps: NDArray[np.float64]
    stop_probability_frac: NDArray[np.float64]
    parts_j: NDArray[np.float64]

    @property
    def carried_mps(self) -> NDArray[np.float64]:
        """Speeds carried into the next links, given no stop; 0 where the vehicle comes to rest for certain."""
        return np.where(self.stop_probability_frac >= 1.0, 0.0, self.speed_end_mps)

    def __len__(self) -> int:
        return self.energy_j.size

    @overload
    def __getitem__(self, at: int) -> LinkResult: ...

    @overload
    def __getitem__(self, at: slice) -> tuple[LinkResult, ...]: ...

    def __getitem__(self, at: int | slice) -> LinkResult | tuple[LinkResult, ...]:
        if isinstance(at, slice):
            return tuple(self[k] for k in range(*at.indices(len(self))))
        return LinkResult(
            energy_j=float(self.energy_j[at]),
            duration_s=float(self.duration_s[at]),
            standstill_s=float(self.standstill_s[at]),
            speed_end_mps=float(self.speed_end_mps[at]),
            stop_probability_frac=float(self.stop_probability_frac[at]),
            parts_j=self.parts_j[at],
        )


@dataclass(frozen=True, slots=True)
class ChainResult:
    """What driving a whole chain takes; links in order, sums over them."""

    links: LinkResults
    distance_m: float
    duration_s: float
    standstill_s: float
    stop_count: float  # expected number under `expected`, whole under `counted`
    energy_j: float
    parts: EnergyParts


def simulate_chain(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    *,
    conditions: Conditions = STILL,
    link_model: LinkModel = LinkModel.INTEGRATED,
    stop_rule: StopRule = StopRule.EXPECTED,
    start_speed_mps: float = 0.0,
    arrive_stopped: bool = True,
    soc_start_frac: float | None = None,
) -> ChainResult:
    """Energy and time of driving a chain; arrive_stopped: the vehicle stops at the end of the last link.

    Without arrive_stopped the last link ends by equation (9), its successor being unknown. soc_start_frac matters only
    where recuperation is limited: near a full battery its cap falls.
    Raises LinkError on a length or limit that is not positive, NaN, or a grade or probability out of range, and
    ConditionsError where conditions need what the chain or vehicle does not have.
    """
    check_chain(chain, start_speed_mps)
    drive = drive_of(vehicle, conditions, printed=link_model is LinkModel.PRINTED)
    driven_mps = drive.driven_mps(chain.speed_limit_mps)
    setting = LinkSetting(chain.grade_frac, driven_mps, chain.altitude_m, chain.heading)
    links = chain_links(chain, driven_mps, drive.roads(setting, chain.stop_time_s))
    full_j = filling_energy_j(soc_start_frac, vehicle.usable_capacity_wh)
    driven = kernels_chain.undriven(chain.length_m.size, with_parts=True)
    kernels_chain.drive_chain(
        drive.physics,
        links,
        kernels_chain.ChainDrive(RULE_CODE[stop_rule], float(start_speed_mps), arrive_stopped, full_j),
        driven,
    )
    energy, time, standstill, v_end, p_end, terms = driven
    parts = drive.parts(setting, terms)
    stops = float(p_end[:-1].sum()) if arrive_stopped else float(p_end.sum())
    return ChainResult(
        links=LinkResults(energy, time, standstill, v_end, p_end, parts),
        distance_m=float(chain.length_m.sum()),
        duration_s=float(time.sum()),
        standstill_s=float(standstill.sum()),
        stop_count=stops,
        energy_j=float(energy.sum()),
        parts=energy_parts(parts.sum(axis=0)),
    )


RULE_CODE: Final = {
    StopRule.EXPECTED: kernels_chain.EXPECTED,
    StopRule.COUNTED: kernels_chain.COUNTED,
    StopRule.NONE: kernels_chain.NO_STOPS,
    StopRule.CROSSINGS: kernels_chain.CROSSINGS,
}


def chain_links(chain: Chain, driven_mps: NDArray[np.float64], roads: NDArray[np.float64]) -> kernels_chain.ChainLinks:
    """A chain as kernels read it, driven at these speeds over these roads."""
    carried_s = np.empty(0) if chain.carried_s is None else chain.carried_s
    if chain.carried_s is not None:
        driven_mps = np.where(chain.carried, CARRIED_MPS, driven_mps)
    return kernels_chain.ChainLinks(
        roads, chain.length_m, driven_mps, chain.stop_probability_frac, chain.stop_class, carried_s
    )


def filling_energy_j(soc_frac: float | None, capacity_wh: float) -> float:
    """Battery energy, negative, that would fill the battery [J]; −inf where the charge is not known."""
    return -math.inf if soc_frac is None else -(1.0 - soc_frac) * capacity_wh * JOULE_PER_WH


def check_chain(chain: Chain, start_speed_mps: float = 0.0) -> None:
    """Raise LinkError for the first value of a chain that is out of range, or for the start speed."""
    _check_chain(chain)
    if not 0.0 <= start_speed_mps <= CHECKED_SPEED_MPS:
        raise LinkError("start_speed_mps", 0, start_speed_mps, f"0..{CHECKED_SPEED_MPS:.2f} (200 km/h)")


ABOVE_ZERO: Final = float(np.nextafter(0.0, 1.0))
FINITE: Final = float(np.finfo(np.float64).max)
# least and most of each number of a link, and how an error says so
LINK_RANGES: Final = {
    "length_m": (ABOVE_ZERO, FINITE, "a positive finite number"),
    "grade_frac": (-1.0, 1.0, "-1..1 (rise over length)"),
    "speed_limit_mps": (ABOVE_ZERO, CHECKED_SPEED_MPS, f"above 0, at most {CHECKED_SPEED_MPS:.2f} (200 km/h)"),
    "stop_probability_frac": (0.0, 1.0, "0..1"),
    "stop_time_s": (0.0, FINITE, "a non-negative finite number"),
    "stop_class": (0.0, float(kernels_chain.REST), "0..8"),
}
LEAST_OF_LINKS: Final = np.array([[least] for least, _, _ in LINK_RANGES.values()])
MOST_OF_LINKS: Final = np.array([[most] for _, most, _ in LINK_RANGES.values()])


def _check_chain(chain: Chain) -> None:
    """Raise LinkError for the first value out of range; comparisons are written so that NaN fails them."""
    n = chain.length_m.size
    if n == 0:
        raise LinkError("length_m", 0, "absent", "at least one link")
    columns = [getattr(chain, name) for name in LINK_RANGES]
    for name, values in zip(LINK_RANGES, columns, strict=True):
        if values.shape != (n,):
            raise LinkError(name, 0, f"{values.size} values", f"{n}, one a link")
    table = np.array(columns, np.float64)
    good = (table >= LEAST_OF_LINKS) & (table <= MOST_OF_LINKS)
    if not bool(good.all()):
        field, position = divmod(int(np.argmin(good)), n)
        name = list(LINK_RANGES)[field]
        raise LinkError(name, position, columns[field][position].item(), LINK_RANGES[name][2])
    for name, extra, shape in (
        ("altitude_m", chain.altitude_m, (n,)),
        ("heading", chain.heading, (n, 2)),
        ("carried_s", chain.carried_s, (n,)),
    ):
        if extra is not None and (extra.shape != shape or not bool(np.isfinite(extra).all())):
            raise LinkError(name, 0, f"shape {extra.shape}", f"finite numbers of shape {shape}")
