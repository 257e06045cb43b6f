"""Speed over way and time of a drive, for drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain import kernels_chain, kernels_link
from energy.chain.chain import RULE_CODE, LinkModel, StopRule, check_chain
from energy.conditions import STILL, Conditions
from energy.force.effects import LinkSetting, drive_of
from energy.force.kernels_phase import ramp_energy
from energy.force.kernels_physics import ROAD_WAIT, road_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from energy.chain.chain import Chain
    from energy.force.kernels_physics import LinkPhysics, Road
    from energy.vehicle.consumption_table import ConsumptionTableVehicle
    from energy.vehicle.vehicle import Vehicle

RAMP_STEP_MPS: Final = 0.5  # a ramp has a point at least every so much
SAME_ACCEL_MPS2: Final = 1e-3  # steps whose accelerations differ by less are one ramp


@dataclass(frozen=True, slots=True)
class SpeedProfile:
    """Points of a drive, to be joined by straight lines.

    distance_m, time_s: float64 (n,), from 0 and never falling; both stay the same where speed changes at once.
    speed_mps: float64 (n,). stop_rule: of the drawn drive, `counted` where `expected` was asked for: one drive either
    stops or does not.
    """

    distance_m: NDArray[np.float64]
    time_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    stop_rule: StopRule


def chain_profile(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    *,
    conditions: Conditions = STILL,
    link_model: LinkModel = LinkModel.INTEGRATED,
    stop_rule: StopRule = StopRule.EXPECTED,
    start_speed_mps: float = 0.0,
    arrive_stopped: bool = True,
) -> SpeedProfile:
    """Speed along a chain as energy.chain.chain.simulate_chain drives it: phase boundaries, and points on ramps.

    Under a rule whose stops are certain the profile ends at the distance and duration of simulate_chain.
    Raises as simulate_chain does.
    """
    check_chain(chain, start_speed_mps)
    drive = drive_of(vehicle, conditions, printed=link_model is LinkModel.PRINTED)
    driven_mps = drive.driven_mps(chain.speed_limit_mps)
    setting = LinkSetting(chain.grade_frac, driven_mps, chain.altitude_m, chain.heading)
    roads = drive.roads(setting, chain.stop_time_s)
    carried = chain.carried
    driven_mps = np.where(carried, 0.0, driven_mps)
    rule = StopRule.COUNTED if stop_rule is StopRule.EXPECTED else stop_rule
    requests, stops = np.zeros(8), np.zeros(8)
    pen = _Pen(start_speed_mps)
    n = chain.length_m.size
    v = start_speed_mps
    for k in range(n):
        p_stop = kernels_chain.stop_at(
            RULE_CODE[rule], chain.stop_probability_frac[k], chain.stop_class[k], requests, stops
        )
        last = k + 1 == n
        if chain.carried_s is not None and carried[k]:
            pen.carry(float(chain.length_m[k]), float(chain.carried_s[k]))
            v = 0.0
            continue
        stopping = p_stop > 0.0 or (last and arrive_stopped)
        limit = float(driven_mps[k])
        target = limit if last else min(limit, float(driven_mps[k + 1]))
        if drive.physics.table:
            pen.jump(limit)
            pen.cruise(float(chain.length_m[k]), limit)
            v = target
            pen.jump(0.0 if stopping else v)
        else:
            wanted = 0.0 if stopping else target
            v = _draw_link(pen, drive.physics, road_at(roads, k), float(chain.length_m[k]), v, limit, wanted)
        if stopping:
            v = 0.0
            if not (last and arrive_stopped):
                pen.wait(float(roads[k, ROAD_WAIT]))
    distance_m, time_s, speed_mps = (np.array(column, np.float64) for column in (pen.distance_m, pen.time_s, pen.speed))
    return SpeedProfile(distance_m, time_s, speed_mps, rule)


def thinned(track: NDArray[np.float64], stop_rule: StopRule) -> SpeedProfile:
    """The profile of a track of equal steps, float64 (n, 3) of way, time and speed.

    Kept are both ends, every change of acceleration and, on ramps, a point every half metre a second.
    """
    way, time, speed = track.T
    dt = np.diff(time)
    accel = np.divide(np.diff(speed), dt, out=np.zeros_like(dt), where=dt > 0.0)
    gained = np.floor(np.concatenate(([0.0], np.cumsum(np.abs(np.diff(speed))))) / RAMP_STEP_MPS)
    keep = np.ones(way.size, bool)
    keep[1:-1] = (np.abs(np.diff(accel)) > SAME_ACCEL_MPS2) | (np.diff(gained)[:-1] > 0.0)
    return SpeedProfile(way[keep].copy(), time[keep].copy(), speed[keep].copy(), stop_rule)


class _Pen:
    """Where a drawing has got to; its points so far start at rest or at the start speed."""

    def __init__(self, speed_mps: float) -> None:
        self.distance_m = [0.0]
        self.time_s = [0.0]
        self.speed = [speed_mps]

    def cruise(self, ds: float, v: float) -> None:
        self._point(ds, ds / v, v)

    def ramp(self, ds: float, dt: float, v_a: float, v_b: float) -> None:
        """At constant acceleration v² is linear in the way, and v in time."""
        pieces = max(math.ceil(abs(v_b - v_a) / RAMP_STEP_MPS), 1)
        before = v_a
        for i in range(pieces):
            v = v_b if i + 1 == pieces else v_a + (v_b - v_a) * ((i + 1) / pieces)
            share = (v - before) * (v + before) / ((v_b - v_a) * (v_b + v_a))
            self._point(ds * share, dt / pieces, v)
            before = v

    def jump(self, v: float) -> None:
        if v != self.speed[-1]:
            self._point(0.0, 0.0, v)

    def wait(self, dt: float) -> None:
        if dt > 0.0:
            self._point(0.0, dt, self.speed[-1])

    def carry(self, ds: float, dt: float) -> None:
        """On board of a ferry: the vehicle stands."""
        self.jump(0.0)
        self._point(ds, dt, 0.0)

    def _point(self, ds: float, dt: float, v: float) -> None:
        self.distance_m.append(self.distance_m[-1] + ds)
        self.time_s.append(self.time_s[-1] + dt)
        self.speed.append(v)


def _draw_link(
    pen: _Pen, p: LinkPhysics, r: Road, length_m: float, v_start: float, v_max: float, target: float
) -> float:
    """Draw the phases of one link and return the speed at its end."""
    s1, s2, s3, peak, end = kernels_link.plan_link(p, length_m, v_start, v_max, target)
    if s1 > 0.0 and peak != v_start:
        pen.ramp(s1, ramp_energy(p, r, s1, v_start, peak)[1], v_start, peak)
    elif s1 > 0.0:
        s2 += s1
    if s2 > 0.0:
        pen.cruise(s2, peak)
    if s3 > 0.0:
        pen.ramp(s3, ramp_energy(p, r, s3, peak, end)[1], peak, end)
    return float(end)
