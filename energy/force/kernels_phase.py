"""Compiled: battery energy and time of one phase of motion, effects included.

Units: m, s, m/s, kg, N, W, J. Equation numbers are the source's. With every effect off, a phase is a closed form;
otherwise it is the sum of its terms.
"""

from __future__ import annotations

from numba import njit

from energy.force.kernels_force import air_force, battery_work_j, force_roots, road_load_n, stretch_work_j
from energy.force.kernels_physics import LinkPhysics, Road
from energy.force.kernels_terms import cruise_terms, ramp_terms, total_j


@njit(nogil=True, cache=True)
def ramp_energy(p: LinkPhysics, r: Road, ds: float, v_a: float, v_b: float) -> tuple[float, float]:
    """Battery energy and time of a phase of constant acceleration from v_a to v_b over ds."""
    low, high = (v_a, v_b) if v_a < v_b else (v_b, v_a)
    if p.lossy or r.wind_mps < 0.0:
        terms, dt = ramp_terms(p, r, ds, v_a, v_b)
        return total_j(terms), dt
    accel = (v_b - v_a) * (v_b + v_a) / (2.0 * ds)
    if p.printed:
        dt = abs(v_b - v_a) / (2.0 * abs(accel))  # (13), (23)
        v = 0.75 * high + 0.25 * low  # (15), (25)
        force = road_load_n(r, v) + p.inertia_kg * accel + p.weight_n * r.grade  # (34)
        return battery_work_j(p, force * v * dt) + p.aux_move_w * dt, dt  # (35), (36)
    dt = 2.0 * ds / (v_a + v_b)
    a, b, c = air_force(r, True)
    b += r.linear_n_per_mps
    f0 = r.rolling_n + a + p.weight_n * r.grade + p.inertia_kg * accel
    count, r1, r2 = force_roots(f0, b, c, low, high)
    energy_j = p.aux_move_w * dt
    if count == 0:
        return energy_j + battery_work_j(p, stretch_work_j(f0, b, c, ds, v_a, v_b)), dt
    per_v2 = ds / ((high - low) * (high + low))
    energy_j += battery_work_j(p, stretch_work_j(f0, b, c, per_v2 * (r1 * r1 - low * low), low, r1))
    if count == 2:
        energy_j += battery_work_j(p, stretch_work_j(f0, b, c, per_v2 * (r2 * r2 - r1 * r1), r1, r2))
        r1 = r2
    energy_j += battery_work_j(p, stretch_work_j(f0, b, c, per_v2 * (high * high - r1 * r1), r1, high))
    return energy_j, dt


@njit(nogil=True, cache=True)
def cruise_energy(p: LinkPhysics, r: Road, ds: float, v: float) -> tuple[float, float]:
    """Battery energy and time of a phase of constant speed (equations 18, 34-37)."""
    dt = ds / v
    if p.lossy:
        return total_j(cruise_terms(p, r, ds, v)), dt
    force = road_load_n(r, v) + p.weight_n * r.grade
    return battery_work_j(p, force * ds) + p.aux_move_w * dt, dt
