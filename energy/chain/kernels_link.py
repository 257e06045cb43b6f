"""The scalar link-energy model, compiled: the one implementation that search and simulation share.

Units: m, s, m/s, kg, N, W, J; grade is sin θ. Equation numbers are the source's; cases are MODEL.md section 3.
The phases of a link are (1) a ramp from the entry speed to the peak, (2) a cruise at the peak, (3) a ramp from
the peak to the end speed, (4) standing still. What a phase takes is in energy.force.kernels_phase.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.force.kernels_force import idle_energy
from energy.force.kernels_parts import AUXILIARY, BATTERY_RESISTANCE, CONSUMPTION_TABLE, GRADE, INERTIA
from energy.force.kernels_phase import cruise_energy, ramp_energy
from energy.force.kernels_physics import LinkPhysics, Road
from energy.force.kernels_terms import cruise_terms, ramp_terms

CARRIED_MPS = -2.0  # as the limit of a link over which the vehicle is carried; -1 is no limit yet in many a loop
TOUCH_MPS = 1e-9  # a speed this near to an interval boundary touches only the interval on its own side


@njit(nogil=True, cache=True)
def mean_over_intervals(bound: NDArray[np.float64], running_sum: NDArray[np.float64], low: float, high: float) -> float:
    """Unweighted mean of the table values of the intervals touched between two speeds (equations 11 and 21)."""
    last = bound.size - 2
    first_touched = 0
    while first_touched < last and bound[first_touched + 1] <= low + TOUCH_MPS:
        first_touched += 1
    last_touched = first_touched
    while last_touched < last and bound[last_touched + 1] < high - TOUCH_MPS:
        last_touched += 1
    mean: float = (running_sum[last_touched + 1] - running_sum[first_touched]) / (last_touched + 1 - first_touched)
    return mean


@njit(nogil=True, cache=True)
def plan_link(
    p: LinkPhysics, length: float, v_start: float, v_max: float, target: float
) -> tuple[float, float, float, float, float]:
    """Phases of one link: distances s1, s2, s3, peak speed and end speed (MODEL.md section 3, cases 1-6).

    target ≤ v_max is the wanted end speed. The mean accelerations are those of equations (11) and (21), taken
    up to v_max, also where the peak stays below it.
    """
    if v_start > v_max:
        s1 = (v_start * v_start - v_max * v_max) / (
            2.0 * mean_over_intervals(p.speed_bound_mps, p.decel_sum, v_max, v_start)
        )
        s3 = 0.0
        if target < v_max:
            s3 = (v_max * v_max - target * target) / (
                2.0 * mean_over_intervals(p.speed_bound_mps, p.decel_sum, target, v_max)
            )
        if s1 + s3 <= length:
            return s1, length - s1 - s3, s3, v_max, target
        return length, 0.0, 0.0, target, target  # case 5
    accel = 0.0
    s1 = 0.0
    if v_start < v_max:
        accel = mean_over_intervals(p.speed_bound_mps, p.accel_sum, v_start, v_max)
        s1 = (v_max * v_max - v_start * v_start) / (2.0 * accel)  # (12)
    decel = 0.0
    s3 = 0.0
    if target < v_max:
        decel = mean_over_intervals(p.speed_bound_mps, p.decel_sum, target, v_max)
        s3 = (v_max * v_max - target * target) / (2.0 * decel)  # (22)
    if s1 + s3 <= length:
        return s1, length - s1 - s3, s3, v_max, target  # case 2, (17)
    reached = v_start * v_start + 2.0 * accel * length
    if v_start < target and reached < target * target:
        end = math.sqrt(reached)
        return length, 0.0, 0.0, end, end  # case 4
    if v_start > target and v_start * v_start - target * target >= 2.0 * decel * length:
        return length, 0.0, 0.0, target, target  # case 5
    # case 3: s1 + s3 = length with s1 = (peak² - v_start²)/2a and s3 = (peak² - target²)/2b
    if decel == 0.0:
        return length, 0.0, 0.0, target, target  # reached the limit at the very end, to rounding
    peak_squared = (2.0 * accel * decel * length + decel * v_start * v_start + accel * target * target) / (
        accel + decel
    )
    peak = math.sqrt(peak_squared)
    if peak <= target:
        return length, 0.0, 0.0, target, target  # reached the target at the very end, to rounding
    s1 = 0.0
    if accel > 0.0:
        s1 = min(max((peak_squared - v_start * v_start) / (2.0 * accel), 0.0), length)
    return s1, 0.0, length - s1, peak, target


@njit(nogil=True, cache=True)
def drive_energy(
    p: LinkPhysics, r: Road, length: float, v_start: float, v_max: float, target: float
) -> tuple[float, float, float]:
    """Battery energy, time and end speed of phases 1 to 3 of a link."""
    s1, s2, s3, peak, end = plan_link(p, length, v_start, v_max, target)
    energy_j = 0.0
    time_s = 0.0
    if s1 > 0.0:
        if peak != v_start:
            energy_j, time_s = ramp_energy(p, r, s1, v_start, peak)
        else:
            energy_j, time_s = cruise_energy(p, r, s1, peak)
    if s2 > 0.0:
        e, t = cruise_energy(p, r, s2, peak)
        energy_j += e
        time_s += t
    if s3 > 0.0:
        e, t = ramp_energy(p, r, s3, peak, end)
        energy_j += e
        time_s += t
    return energy_j, time_s, end


@njit(nogil=True, cache=True)
def speed_change_j(p: LinkPhysics, v_a: float, v_b: float) -> float:
    """What a consumption-table vehicle takes for a change of speed, or gives back."""
    gain = 0.5 * (v_b - v_a) * (v_b + v_a)
    return gain * (p.kinetic_up_kg if gain > 0.0 else p.kinetic_down_kg)


@njit(nogil=True, cache=True)
def table_energy(
    p: LinkPhysics,
    r: Road,
    length: float,
    v_start: float,
    p_start: float,
    v_max: float,
    target: float,
    p_stop: float,
    stop_time: float,
) -> tuple[float, float, float]:
    """link_energy of a consumption-table vehicle: rolling_n is the consumption at v_max; speeds change at once."""
    time_s = length / v_max
    climb = r.grade * length
    energy_j = r.rolling_n * length + climb * (p.climb_up_j_per_m if climb > 0.0 else p.climb_down_j_per_m)
    energy_j += (1.0 - p_start) * speed_change_j(p, v_start, v_max) + p_start * speed_change_j(p, 0.0, v_max)
    energy_j += (1.0 - p_stop) * speed_change_j(p, v_max, target) + p_stop * speed_change_j(p, v_max, 0.0)
    energy_j += p.aux_move_w * time_s + p.aux_idle_w * p_stop * stop_time
    return energy_j, time_s + p_stop * stop_time, target


@njit(nogil=True, cache=True)
def link_energy(
    p: LinkPhysics,
    r: Road,
    length: float,
    v_start: float,
    p_start: float,
    v_max: float,
    v_next: float,
    p_stop: float,
    stop_time: float,
) -> tuple[float, float, float]:
    """Expected battery energy [J] without climate, time [s] and go-speed at the end [m/s] of one link.

    The vehicle enters with v_start, or with probability p_start from rest; at the end it stops with probability
    p_stop for stop_time, else goes on at min(v_max, v_next) where it can. Certain stops are p_stop = 1. Where the
    entries end at different go-speeds the root mean square, which keeps the kinetic energy, is carried on.
    A limit below 0 is that of a link over which the vehicle is carried: it comes to rest before, takes nothing there,
    and no time that climate and tyres would feel.
    """
    if v_max < 0.0:
        return 0.0, 0.0, 0.0
    target = max(v_next if v_next < v_max else v_max, 0.0)
    if p.table:
        return table_energy(p, r, length, v_start, p_start, v_max, target, p_stop, stop_time)
    time_s = p_stop * stop_time
    energy_j = idle_energy(p, time_s)
    end = 0.0
    if p_start < 1.0:
        enters = 1.0 - p_start
        e, t, end = drive_energy(p, r, length, v_start, v_max, target)
        energy_j += enters * (1.0 - p_stop) * e
        time_s += enters * (1.0 - p_stop) * t
        if p_stop > 0.0:
            e, t, _ = drive_energy(p, r, length, v_start, v_max, 0.0)
            energy_j += enters * p_stop * e
            time_s += enters * p_stop * t
    if p_start > 0.0:
        e, t, end_from_rest = drive_energy(p, r, length, 0.0, v_max, target)
        energy_j += p_start * (1.0 - p_stop) * e
        time_s += p_start * (1.0 - p_stop) * t
        if p_stop > 0.0:
            e, t, _ = drive_energy(p, r, length, 0.0, v_max, 0.0)
            energy_j += p_start * p_stop * e
            time_s += p_start * p_stop * t
        if p_start >= 1.0:
            end = end_from_rest
        elif end != end_from_rest:
            end = math.sqrt((1.0 - p_start) * end * end + p_start * end_from_rest * end_from_rest)
    return energy_j, time_s, end


@njit(nogil=True, cache=True)
def add_drive_parts(
    p: LinkPhysics,
    r: Road,
    length: float,
    v_start: float,
    v_max: float,
    target: float,
    weight: float,
    parts: NDArray[np.float64],
) -> None:
    """Parts of drive_energy, added to parts with a weight."""
    s1, s2, s3, peak, end = plan_link(p, length, v_start, v_max, target)
    if s1 > 0.0 and peak != v_start:
        terms, _ = ramp_terms(p, r, s1, v_start, peak)
        for k in range(len(terms)):
            parts[k] += weight * terms[k]
    elif s1 > 0.0:
        s2 += s1
    if s2 > 0.0:
        terms = cruise_terms(p, r, s2, peak)
        for k in range(len(terms)):
            parts[k] += weight * terms[k]
    if s3 > 0.0:
        terms, _ = ramp_terms(p, r, s3, peak, end)
        for k in range(len(terms)):
            parts[k] += weight * terms[k]


class LinkPassage(NamedTuple):
    """How one link is passed: the arguments of link_energy after vehicle and road."""

    length: float
    v_start: float
    p_start: float
    v_max: float
    v_next: float
    p_stop: float
    stop_time: float


@njit(nogil=True, cache=True)
def add_link_parts(p: LinkPhysics, r: Road, passage: LinkPassage, parts: NDArray[np.float64]) -> None:
    """Parts of link_energy, added to parts (15,); they add up to its energy."""
    length, v_start, p_start, v_max, v_next, p_stop, stop_time = passage
    if v_max < 0.0:
        return
    target = max(v_next if v_next < v_max else v_max, 0.0)
    wait = p_stop * stop_time
    parts[AUXILIARY] += p.aux_idle_w * wait
    if p.table:
        climb = r.grade * length
        parts[AUXILIARY] += p.aux_move_w * length / v_max
        parts[CONSUMPTION_TABLE] += r.rolling_n * length
        parts[GRADE] += climb * (p.climb_up_j_per_m if climb > 0.0 else p.climb_down_j_per_m)
        parts[INERTIA] += (1.0 - p_start) * speed_change_j(p, v_start, v_max) + p_start * speed_change_j(p, 0.0, v_max)
        parts[INERTIA] += (1.0 - p_stop) * speed_change_j(p, v_max, target) + p_stop * speed_change_j(p, v_max, 0.0)
        return
    parts[BATTERY_RESISTANCE] += p.loss_per_w * p.aux_idle_w * p.aux_idle_w * wait
    for branch in range(4):
        weight = (p_start if branch & 1 else 1.0 - p_start) * (p_stop if branch & 2 else 1.0 - p_stop)
        if weight > 0.0:
            begin = 0.0 if branch & 1 else v_start
            add_drive_parts(p, r, length, begin, v_max, 0.0 if branch & 2 else target, weight, parts)
