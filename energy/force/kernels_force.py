"""Compiled: force at the wheels and battery energy at one speed, effects included.

Units: m, s, m/s, kg, N, W, J. Equation numbers are the source's; effects are those of docs/effects.md. What a phase of
motion takes is in energy.force.kernels_phase, by cause in energy.force.kernels_terms.
"""

from __future__ import annotations

import math

from numba import njit

import energy.compiled.cache  # noqa: F401  (sets the cache folder before anything is compiled)
from energy.force.kernels_physics import LinkPhysics, Road


@njit(nogil=True, cache=True)
def air_force(r: Road, ahead: bool) -> tuple[float, float, float]:
    """Coefficients of 1, v, v² of the drag while the air comes from ahead, or from behind."""
    c = r.aero_n_per_mps2 if ahead else -r.aero_n_per_mps2
    return c * r.wind_mps * r.wind_mps, 2.0 * c * r.wind_mps, c


@njit(nogil=True, cache=True)
def road_load_n(r: Road, v: float) -> float:
    """Rolling, linear and aerodynamic force at a speed; wind from behind pushes at most as much as the rest holds."""
    a, b, c = air_force(r, v >= -r.wind_mps)
    load = r.rolling_n + a + (r.linear_n_per_mps + b + c * v) * v
    return max(load, 0.0) if r.wind_mps < 0.0 else load


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
def stretch_work_j(f0: float, b: float, c: float, ds: float, v_a: float, v_b: float) -> float:
    """∫(f0 + b·v + c·v²) ds at constant acceleration: v² is linear in s, so the means over s are closed forms."""
    mean_v = (v_a * v_a + v_a * v_b + v_b * v_b) / (1.5 * (v_a + v_b))
    mean_v2 = 0.5 * (v_a * v_a + v_b * v_b)
    return ds * (f0 + b * mean_v + c * mean_v2)


@njit(nogil=True, cache=True)
def idle_energy(p: LinkPhysics, dt: float) -> float:
    """Battery energy of standing still, equation (3), without climate."""
    return (p.aux_idle_w + p.loss_per_w * p.aux_idle_w * p.aux_idle_w) * dt


@njit(nogil=True, cache=True)
def battery_power(p: LinkPhysics, r: Road, v: float, accel: float) -> float:
    """Battery power [W] at one moment, equations (1) to (5) with effects, without climate."""
    if v <= 0.0:
        return idle_energy(p, 1.0)
    force = road_load_n(r, v) + p.weight_n * r.grade + p.inertia_kg * accel
    traction = battery_work_j(p, force * v)
    if p.lossy:
        traction = max(traction, -p.regen_cap_w if v >= p.regen_min_mps else 0.0)
    power = traction + p.aux_move_w
    return power + p.loss_per_n2 * force * force + p.loss_per_w * power * power
