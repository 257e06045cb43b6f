"""The scalar link-energy model, compiled: the one implementation that search and simulation share.

Units: m, s, m/s, kg, N, W, J; grade is sin θ. Equation numbers are the source's; cases are MODEL.md section 3.
The phases of a link are (1) a ramp from the entry speed to the peak, (2) a cruise at the peak, (3) a ramp from
the peak to the end speed, (4) standing still.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import energy.compilation  # noqa: F401  (sets the cache folder before anything is compiled)

TOUCH_MPS = 1e-9  # a speed this near to an interval boundary touches only the interval on its own side

ROLLING, LINEAR, AERO, GRADE, INERTIA, DRIVE_LOSS, RECUPERATION_LOSS, AUXILIARY = range(8)
PART_COUNT = 8


class LinkPhysics(NamedTuple):
    """Vehicle parameters as the kernels want them.

    rolling_n, linear_n_per_mps, aero_n_per_mps2: A, B, C of equation (4). weight_n: m·g. inertia_kg: m·d.
    drive_factor: 1/η_dis. recuperation_factor: η_chg. aux_move_w, aux_idle_w: P_aux/η_aux.
    speed_bound_mps: (n+1,) interval boundaries. accel_sum, decel_sum: (n+1,) running sums of |a| over intervals.
    printed: evaluate dynamic phases as equations (13), (15), (36) are printed instead of integrating exactly.
    """

    rolling_n: float
    linear_n_per_mps: float
    aero_n_per_mps2: float
    weight_n: float
    inertia_kg: float
    drive_factor: float
    recuperation_factor: float
    aux_move_w: float
    aux_idle_w: float
    speed_bound_mps: NDArray[np.float64]
    accel_sum: NDArray[np.float64]
    decel_sum: NDArray[np.float64]
    printed: bool


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
def force_roots(f0: float, b: float, c: float, low: float, high: float) -> tuple[int, float, float]:
    """Speeds strictly between low and high where f0 + b·v + c·v² changes sign: count, first, second."""
    f_low = f0 + (b + c * low) * low
    f_high = f0 + (b + c * high) * high
    if f_low >= 0.0 and f_high >= 0.0:
        if c <= 0.0 or b >= 0.0:
            return 0, 0.0, 0.0
        vertex = -b / (2.0 * c)
        if vertex <= low or vertex >= high or f0 + 0.5 * b * vertex >= 0.0:
            return 0, 0.0, 0.0
    elif f_low <= 0.0 and f_high <= 0.0:
        if c >= 0.0:
            return 0, 0.0, 0.0
        vertex = -b / (2.0 * c)
        if vertex <= low or vertex >= high or f0 + 0.5 * b * vertex <= 0.0:
            return 0, 0.0, 0.0
    if c == 0.0:
        return 1, min(max(-f0 / b, low), high), 0.0
    discriminant = b * b - 4.0 * c * f0
    if discriminant <= 0.0:
        return 0, 0.0, 0.0
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    r1 = q / c
    r2 = f0 / q if q != 0.0 else r1
    if r1 > r2:
        r1, r2 = r2, r1
    inside1 = low < r1 < high
    inside2 = low < r2 < high
    if inside1 and inside2:
        return 2, r1, r2
    if inside1:
        return 1, r1, 0.0
    if inside2:
        return 1, r2, 0.0
    return 0, 0.0, 0.0


@njit(nogil=True, cache=True)
def battery_work_j(p: LinkPhysics, wheel_work_j: float) -> float:
    """Battery energy for work at the wheel, equations (1), (2), (37), (38) without auxiliaries."""
    if wheel_work_j >= 0.0:
        return wheel_work_j * p.drive_factor
    return wheel_work_j * p.recuperation_factor


@njit(nogil=True, cache=True)
def stretch_work_j(p: LinkPhysics, f0: float, ds: float, v_a: float, v_b: float) -> float:
    """∫F ds over a stretch of constant acceleration: v² is linear in s, so the means over s are closed forms."""
    mean_v = (v_a * v_a + v_a * v_b + v_b * v_b) / (1.5 * (v_a + v_b))
    mean_v2 = 0.5 * (v_a * v_a + v_b * v_b)
    return ds * (f0 + p.linear_n_per_mps * mean_v + p.aero_n_per_mps2 * mean_v2)


@njit(nogil=True, cache=True)
def ramp_energy(p: LinkPhysics, ds: float, v_a: float, v_b: float, grade: float, flat: float) -> tuple[float, float]:
    """Battery energy and time of a phase of constant acceleration from v_a to v_b over ds; flat is cos θ."""
    accel = (v_b - v_a) * (v_b + v_a) / (2.0 * ds)
    if p.printed:
        dt = abs(v_b - v_a) / (2.0 * abs(accel))  # (13), (23)
        v = 0.75 * max(v_a, v_b) + 0.25 * min(v_a, v_b)  # (15), (25)
        force = (
            p.rolling_n * flat
            + (p.linear_n_per_mps + p.aero_n_per_mps2 * v) * v
            + p.inertia_kg * accel
            + p.weight_n * grade
        )  # (34)
        return battery_work_j(p, force * v * dt) + p.aux_move_w * dt, dt  # (35), (36)
    dt = 2.0 * ds / (v_a + v_b)
    f0 = p.rolling_n * flat + p.weight_n * grade + p.inertia_kg * accel
    low, high = (v_a, v_b) if v_a < v_b else (v_b, v_a)
    count, r1, r2 = force_roots(f0, p.linear_n_per_mps, p.aero_n_per_mps2, low, high)
    energy_j = p.aux_move_w * dt
    if count == 0:
        return energy_j + battery_work_j(p, stretch_work_j(p, f0, ds, v_a, v_b)), dt
    per_v2 = ds / ((high - low) * (high + low))
    energy_j += battery_work_j(p, stretch_work_j(p, f0, per_v2 * (r1 * r1 - low * low), low, r1))
    if count == 2:
        energy_j += battery_work_j(p, stretch_work_j(p, f0, per_v2 * (r2 * r2 - r1 * r1), r1, r2))
        r1 = r2
    energy_j += battery_work_j(p, stretch_work_j(p, f0, per_v2 * (high * high - r1 * r1), r1, high))
    return energy_j, dt


@njit(nogil=True, cache=True)
def cruise_energy(p: LinkPhysics, ds: float, v: float, grade: float, flat: float) -> tuple[float, float]:
    """Battery energy and time of a phase of constant speed (equations 18, 34-37)."""
    dt = ds / v
    force = p.rolling_n * flat + (p.linear_n_per_mps + p.aero_n_per_mps2 * v) * v + p.weight_n * grade
    return battery_work_j(p, force * ds) + p.aux_move_w * dt, dt


@njit(nogil=True, cache=True)
def drive_energy(
    p: LinkPhysics, length: float, grade: float, flat: float, v_start: float, v_max: float, target: float
) -> tuple[float, float, float]:
    """Battery energy, time and end speed of phases 1 to 3 of a link."""
    s1, s2, s3, peak, end = plan_link(p, length, v_start, v_max, target)
    energy_j = 0.0
    time_s = 0.0
    if s1 > 0.0:
        if peak != v_start:
            energy_j, time_s = ramp_energy(p, s1, v_start, peak, grade, flat)
        else:
            energy_j, time_s = cruise_energy(p, s1, peak, grade, flat)
    if s2 > 0.0:
        e, t = cruise_energy(p, s2, peak, grade, flat)
        energy_j += e
        time_s += t
    if s3 > 0.0:
        e, t = ramp_energy(p, s3, peak, end, grade, flat)
        energy_j += e
        time_s += t
    return energy_j, time_s, end


@njit(nogil=True, cache=True)
def link_energy(
    p: LinkPhysics,
    length: float,
    grade: float,
    v_start: float,
    p_start: float,
    v_max: float,
    v_next: float,
    p_stop: float,
    stop_time: float,
) -> tuple[float, float, float]:
    """Expected battery energy [J], time [s] and go-speed at the end [m/s] of one link.

    The vehicle enters with v_start, or with probability p_start from rest; at the end it stops with probability
    p_stop for stop_time, else goes on at min(v_max, v_next) where it can. Certain stops are p_stop = 1. Where the
    entries end at different go-speeds the root mean square, which keeps the kinetic energy, is carried on.
    """
    flat = math.sqrt(max(1.0 - grade * grade, 0.0))
    target = v_next if v_next < v_max else v_max
    energy_j = 0.0
    time_s = p_stop * stop_time
    energy_j = p.aux_idle_w * time_s
    end = 0.0
    if p_start < 1.0:
        enters = 1.0 - p_start
        e, t, end = drive_energy(p, length, grade, flat, v_start, v_max, target)
        energy_j += enters * (1.0 - p_stop) * e
        time_s += enters * (1.0 - p_stop) * t
        if p_stop > 0.0:
            e, t, _ = drive_energy(p, length, grade, flat, v_start, v_max, 0.0)
            energy_j += enters * p_stop * e
            time_s += enters * p_stop * t
    if p_start > 0.0:
        e, t, end_from_rest = drive_energy(p, length, grade, flat, 0.0, v_max, target)
        energy_j += p_start * (1.0 - p_stop) * e
        time_s += p_start * (1.0 - p_stop) * t
        if p_stop > 0.0:
            e, t, _ = drive_energy(p, length, grade, flat, 0.0, v_max, 0.0)
            energy_j += p_start * p_stop * e
            time_s += p_start * p_stop * t
        if p_start >= 1.0:
            end = end_from_rest
        elif end != end_from_rest:
            end = math.sqrt((1.0 - p_start) * end * end + p_start * end_from_rest * end_from_rest)
    return energy_j, time_s, end


@njit(nogil=True, cache=True)
def add_stretch_parts(
    p: LinkPhysics,
    flat: float,
    grade: float,
    accel: float,
    ds: float,
    mean_v: float,
    mean_v2: float,
    weight: float,
    parts: NDArray[np.float64],
) -> None:
    """Split battery energy for one stretch without change of sign of the force into its parts."""
    rolling = p.rolling_n * flat * ds
    linear = p.linear_n_per_mps * mean_v * ds
    aero = p.aero_n_per_mps2 * mean_v2 * ds
    climb = p.weight_n * grade * ds
    inertia = p.inertia_kg * accel * ds
    work = rolling + linear + aero + climb + inertia
    parts[ROLLING] += weight * rolling
    parts[LINEAR] += weight * linear
    parts[AERO] += weight * aero
    parts[GRADE] += weight * climb
    parts[INERTIA] += weight * inertia
    if work >= 0.0:
        parts[DRIVE_LOSS] += weight * work * (p.drive_factor - 1.0)
    else:
        parts[RECUPERATION_LOSS] += weight * work * (p.recuperation_factor - 1.0)


@njit(nogil=True, cache=True)
def add_ramp_parts(
    p: LinkPhysics,
    ds: float,
    v_a: float,
    v_b: float,
    grade: float,
    flat: float,
    weight: float,
    parts: NDArray[np.float64],
) -> None:
    """Parts of ramp_energy, added to parts."""
    accel = (v_b - v_a) * (v_b + v_a) / (2.0 * ds)
    if p.printed:
        dt = abs(v_b - v_a) / (2.0 * abs(accel))
        v = 0.75 * max(v_a, v_b) + 0.25 * min(v_a, v_b)
        add_stretch_parts(p, flat, grade, accel, v * dt, v, v * v, weight, parts)
        parts[AUXILIARY] += weight * p.aux_move_w * dt
        return
    parts[AUXILIARY] += weight * p.aux_move_w * 2.0 * ds / (v_a + v_b)
    f0 = p.rolling_n * flat + p.weight_n * grade + p.inertia_kg * accel
    low, high = (v_a, v_b) if v_a < v_b else (v_b, v_a)
    count, r1, r2 = force_roots(f0, p.linear_n_per_mps, p.aero_n_per_mps2, low, high)
    per_v2 = ds / ((high - low) * (high + low))
    begin = low
    for k in range(count + 1):
        end = high
        if k < count:
            end = r1 if k == 0 else r2
        mean_v = (begin * begin + begin * end + end * end) / (1.5 * (begin + end))
        piece = per_v2 * (end * end - begin * begin)
        add_stretch_parts(p, flat, grade, accel, piece, mean_v, 0.5 * (begin * begin + end * end), weight, parts)
        begin = end


@njit(nogil=True, cache=True)
def add_drive_parts(
    p: LinkPhysics,
    length: float,
    grade: float,
    v_start: float,
    v_max: float,
    target: float,
    weight: float,
    parts: NDArray[np.float64],
) -> None:
    """Parts of drive_energy, added to parts with a weight."""
    flat = math.sqrt(max(1.0 - grade * grade, 0.0))
    s1, s2, s3, peak, end = plan_link(p, length, v_start, v_max, target)
    if s1 > 0.0 and peak != v_start:
        add_ramp_parts(p, s1, v_start, peak, grade, flat, weight, parts)
    elif s1 > 0.0:
        s2 += s1
    if s2 > 0.0:
        add_stretch_parts(p, flat, grade, 0.0, s2, peak, peak * peak, weight, parts)
        parts[AUXILIARY] += weight * p.aux_move_w * s2 / peak
    if s3 > 0.0:
        add_ramp_parts(p, s3, peak, end, grade, flat, weight, parts)


@njit(nogil=True, cache=True)
def add_link_parts(
    p: LinkPhysics,
    length: float,
    grade: float,
    v_start: float,
    p_start: float,
    v_max: float,
    v_next: float,
    p_stop: float,
    stop_time: float,
    parts: NDArray[np.float64],
) -> None:
    """Parts of link_energy, added to parts (8,); they add up to its energy."""
    target = v_next if v_next < v_max else v_max
    parts[AUXILIARY] += p.aux_idle_w * p_stop * stop_time
    for branch in range(4):
        weight = (p_start if branch & 1 else 1.0 - p_start) * (p_stop if branch & 2 else 1.0 - p_stop)
        if weight > 0.0:
            begin = 0.0 if branch & 1 else v_start
            add_drive_parts(p, length, grade, begin, v_max, 0.0 if branch & 2 else target, weight, parts)


EXPECTED, COUNTED, NO_STOPS = range(3)


@njit(nogil=True, cache=True)
def drive_chain(
    p: LinkPhysics,
    length: NDArray[np.float64],
    grade: NDArray[np.float64],
    v_max: NDArray[np.float64],
    stop_probability: NDArray[np.float64],
    stop_time: NDArray[np.float64],
    stop_class: NDArray[np.int8],
    rule: int,
    v_start: float,
    arrive_stopped: bool,
    energy: NDArray[np.float64],
    time: NDArray[np.float64],
    standstill: NDArray[np.float64],
    v_end: NDArray[np.float64],
    p_end: NDArray[np.float64],
    parts: NDArray[np.float64],
) -> None:
    """Drive a chain of links and fill energy, time, standstill, v_end, p_end (n,) and parts (n, 8)."""
    requests = np.zeros(8)
    stops = np.zeros(8)
    v = v_start
    p_entry = 0.0
    n = length.size
    for k in range(n):
        p_stop = stop_probability[k]
        wait = stop_time[k]
        if rule == NO_STOPS:
            p_stop = 0.0
        elif rule == COUNTED and p_stop > 0.0:
            counter = stop_class[k]
            requests[counter] += 1.0  # counted before the comparison, so that there is no 0/0
            if stops[counter] / requests[counter] < p_stop:  # (29)-(31)
                stops[counter] += 1.0
                p_stop = 1.0
            else:
                p_stop = 0.0
        v_next = v_max[k + 1] if k + 1 < n else v_max[k]  # (10), or (9) where the next link is unknown
        if k + 1 == n and arrive_stopped:
            p_stop = 1.0
            wait = 0.0
        energy[k], time[k], v_end[k] = link_energy(p, length[k], grade[k], v, p_entry, v_max[k], v_next, p_stop, wait)
        add_link_parts(p, length[k], grade[k], v, p_entry, v_max[k], v_next, p_stop, wait, parts[k])
        standstill[k] = p_stop * wait
        p_end[k] = p_stop
        v = v_end[k]
        p_entry = p_stop
