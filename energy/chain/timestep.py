"""Energy, time and speed over a chain of links by the equation of motion in time steps (source, section IV)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import RULE_CODE, LinkResults, StopRule, chain_links, check_chain, filling_energy_j
from energy.chain.kernels_chain import ChainDrive, DrivenChain, undriven
from energy.chain.kernels_timestep import STEP_LIMIT_REACHED, drive_steps
from energy.chain.profile import SpeedProfile, thinned
from energy.conditions import STILL, Conditions
from energy.errors import ConditionsError, LinkError
from energy.force.effects import LinkSetting, drive_of
from energy.force.parts import energy_parts
from energy.vehicle.consumption_table import ConsumptionTableVehicle

if TYPE_CHECKING:
    from energy.chain.chain import Chain
    from energy.force.parts import EnergyParts
    from energy.vehicle.vehicle import Vehicle

STEP_S: Final = 0.1  # the source's
STEP_RANGE_S: Final = (0.001, 1.0)
STEP_LIMIT: Final = 10_000_000  # 277 h in steps of 0.1 s
PROFILE_STEP_LIMIT: Final = 2_000_000  # 55 h; every step of a profile is held in memory before it is thinned
CERTAIN_RULES: Final = (StopRule.CROSSINGS, StopRule.COUNTED, StopRule.NONE)


@dataclass(frozen=True, slots=True)
class DriveResult:
    """What one drive over a whole chain takes; links in order, sums over them.

    A link's speed_end_mps is 0 where the vehicle stops, its stop_probability_frac 0 or 1. stop_count leaves out the
    arrival. step_count: how many steps it took. profile: only where asked for.
    """

    links: LinkResults
    distance_m: float
    duration_s: float
    standstill_s: float
    stop_count: int
    energy_j: float
    parts: EnergyParts
    step_count: int
    profile: SpeedProfile | None = None


def simulate_timestep(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    *,
    conditions: Conditions = STILL,
    stop_rule: StopRule = StopRule.CROSSINGS,
    step_s: float = STEP_S,
    start_speed_mps: float = 0.0,
    arrive_stopped: bool = True,
    soc_start_frac: float | None = None,
    profile: bool = False,
) -> DriveResult:
    """Energy and time of driving a chain whose every link is known in advance, in steps of step_s [s], 0.001..1.

    The vehicle accelerates by its table at the speed that it has, up to the limit, and brakes by its table for limits
    and stops however many links ahead. Only a start too fast for what lies ahead makes it brake harder: all of its
    table times one factor, the least that will do, until it is back on the table's own braking curve.

    Raises ConditionsError for a consumption table, which knows no accelerations, for the rule `expected`, since one
    drive either stops or does not, and for a step out of range; LinkError as simulate_chain does, and where the drive
    would take more than STEP_LIMIT steps, or with a profile more than PROFILE_STEP_LIMIT.
    """
    if isinstance(vehicle, ConsumptionTableVehicle):
        raise ConditionsError("model", "timestep", f"fast for vehicle {vehicle.id!r}, a table without accelerations")
    if stop_rule not in CERTAIN_RULES:
        raise ConditionsError("stop_rule", stop_rule.value, "crossings, counted or none with the time-step model")
    low, high = STEP_RANGE_S
    if not low <= step_s <= high:
        raise ConditionsError("step_s", step_s, f"{low:g}..{high:g}")
    check_chain(chain, start_speed_mps)
    drive = drive_of(vehicle, conditions)
    driven_mps = drive.driven_mps(chain.speed_limit_mps)
    setting = LinkSetting(chain.grade_frac, driven_mps, chain.altitude_m, chain.heading)
    roads = drive.roads(setting, chain.stop_time_s)
    step_limit = PROFILE_STEP_LIMIT if profile else STEP_LIMIT
    slowest_s = np.where(chain.carried, 0.0, chain.length_m / driven_mps)
    too_long = LinkError(
        "speed_limit_mps",
        int(np.argmax(slowest_s)),
        float(chain.speed_limit_mps[np.argmax(slowest_s)]),
        f"at most {step_limit} steps of {step_s:g} s for the whole drive{' with a profile' if profile else ''}",
    )
    if not float(slowest_s.sum()) <= step_limit * step_s:
        raise too_long
    links = chain_links(chain, driven_mps, roads)
    full_j = filling_energy_j(soc_start_frac, vehicle.usable_capacity_wh)
    way = ChainDrive(RULE_CODE[stop_rule], float(start_speed_mps), arrive_stopped, full_j)

    def run(track_rows: int) -> tuple[int, DrivenChain, np.ndarray]:
        driven = undriven(chain.length_m.size, with_parts=True)
        track = np.empty((track_rows, 3))
        return drive_steps(drive.physics, links, way, step_s, step_limit, driven, track), driven, track

    steps, driven, track = run(0)
    if steps == STEP_LIMIT_REACHED:
        raise too_long
    if profile:
        rows = 1 + steps + int(np.count_nonzero(driven.standstill_s)) + int(np.count_nonzero(chain.carried))
        _, driven, track = run(rows)
    energy, time, standstill, v_end, stopped, terms = driven
    parts = drive.parts(setting, terms)
    return DriveResult(
        links=LinkResults(energy, time, standstill, v_end, stopped, parts),
        distance_m=float(chain.length_m.sum()),
        duration_s=float(time.sum()),
        standstill_s=float(standstill.sum()),
        stop_count=round(float(stopped.sum() - stopped[-1] if arrive_stopped else stopped.sum())),
        energy_j=float(energy.sum()),
        parts=energy_parts(parts.sum(axis=0)),
        step_count=steps,
        profile=thinned(track, stop_rule) if profile else None,
    )
