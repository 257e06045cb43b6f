"""Compiled: battery energy of one phase of motion by cause, effects included.

Units: m, s, m/s, kg, N, W, J. Wind from behind, a cap on recuperation and losses that grow with the square of force or
power change the law within a phase: it is divided where they do.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from energy.force.kernels_force import air_force, force_roots, road_load_n, stretch_work_j
from energy.force.kernels_parts import (
    AERO,
    AUXILIARY,
    BATTERY_RESISTANCE,
    DRIVETRAIN_LOSS,
    GRADE,
    INERTIA,
    LINEAR,
    LOAD_LOSS,
    RECUPERATION_LOSS,
    REGEN_LIMIT,
    ROLLING,
    WIND,
)
from energy.force.kernels_physics import LinkPhysics, Road

# nodes and weights on [-1, 1]: four points are exact for polynomials up to degree 7
GAUSS_NODE = (0.8611363115940526, 0.3399810435848563)
GAUSS_WEIGHT = (0.34785484513745385, 0.6521451548625461)

Terms = tuple[float, float, float, float, float, float, float, float, float, float, float, float]


@njit(nogil=True, cache=True)
def total_j(terms: Terms) -> float:
    """Battery energy of the terms of a phase."""
    work = terms[ROLLING] + terms[LINEAR] + terms[AERO] + terms[WIND] + terms[GRADE] + terms[INERTIA]
    loss = terms[DRIVETRAIN_LOSS] + terms[RECUPERATION_LOSS] + terms[REGEN_LIMIT]
    return work + loss + terms[AUXILIARY] + terms[LOAD_LOSS] + terms[BATTERY_RESISTANCE]


@njit(nogil=True, cache=True)
def plus(x: Terms, y: Terms) -> Terms:
    """Sum of two sets of terms."""
    return (
        x[0] + y[0],
        x[1] + y[1],
        x[2] + y[2],
        x[3] + y[3],
        x[4] + y[4],
        x[5] + y[5],
        x[6] + y[6],
        x[7] + y[7],
        x[8] + y[8],
        x[9] + y[9],
        x[10] + y[10],
        x[11] + y[11],
    )


@njit(nogil=True, cache=True)
def cruise_terms(p: LinkPhysics, r: Road, ds: float, v: float) -> Terms:
    """Terms of a phase of constant speed, in the order of the parts."""
    dt = ds / v
    rolling = r.rolling_n * ds
    linear = r.linear_n_per_mps * v * ds
    still = r.aero_n_per_mps2 * v * v * ds
    climb = p.weight_n * r.grade * ds
    load = road_load_n(r, v)
    force = load + p.weight_n * r.grade
    wind = load * ds - rolling - linear - still if r.wind_mps != 0.0 else 0.0
    return closed_terms(p, r, (rolling, linear, still, climb, 0.0, wind), force * ds, force, v, dt)


@njit(nogil=True, cache=True)
def closed_terms(
    p: LinkPhysics,
    r: Road,
    works: tuple[float, float, float, float, float, float],
    work: float,
    force: float,
    v: float,
    dt: float,
) -> Terms:
    """Terms of a phase that is evaluated at one speed and force."""
    auxiliary = p.aux_move_w * dt
    drive = recuperation = limited = 0.0
    if work >= 0.0:
        drive = work * (p.drive_factor - 1.0)
        battery = work * p.drive_factor
    else:
        recuperation = work * (p.recuperation_factor - 1.0)
        battery = work * p.recuperation_factor
        cap_w = p.regen_cap_w if v >= p.regen_min_mps else 0.0
        if battery < -cap_w * dt:
            limited = -cap_w * dt - battery
            battery = -cap_w * dt
    power = battery / dt + p.aux_move_w
    return (
        works[0],
        works[1],
        works[2],
        works[3],
        works[4],
        drive,
        recuperation,
        auxiliary,
        works[5],
        limited,
        p.loss_per_n2 * force * force * dt,
        p.loss_per_w * power * power * dt,
    )


@njit(nogil=True, cache=True)
def ramp_terms(p: LinkPhysics, r: Road, ds: float, v_a: float, v_b: float) -> tuple[Terms, float]:
    """Terms and time of a phase of constant acceleration, divided wherever the law of force or battery changes."""
    accel = (v_b - v_a) * (v_b + v_a) / (2.0 * ds)
    low, high = (v_a, v_b) if v_a < v_b else (v_b, v_a)
    if p.printed:
        dt = abs(v_b - v_a) / (2.0 * abs(accel))
        v = 0.75 * high + 0.25 * low
        way = v * dt
        force = road_load_n(r, v) + p.inertia_kg * accel + p.weight_n * r.grade
        still = r.rolling_n + (r.linear_n_per_mps + r.aero_n_per_mps2 * v) * v
        works = (
            r.rolling_n * way,
            r.linear_n_per_mps * v * way,
            r.aero_n_per_mps2 * v * v * way,
            p.weight_n * r.grade * way,
            p.inertia_kg * accel * way,
            (road_load_n(r, v) - still) * way,
        )
        return closed_terms(p, r, works, force * way, force, v, dt), dt
    dt = 2.0 * ds / (v_a + v_b)
    per_v2 = ds / ((high - low) * (high + low))
    terms = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    begin = low
    while begin < high:
        ahead = begin >= -r.wind_mps
        a, b, c = air_force(r, ahead)
        a += r.rolling_n
        b += r.linear_n_per_mps
        end = high if ahead else min(high, -r.wind_mps)
        calms, c1, c2 = (0, 0.0, 0.0) if r.wind_mps >= 0.0 else force_roots(a, b, c, begin, end)
        for calm in range(calms + 1):
            upto = end
            if calm < calms:
                upto = c1 if calm == 0 else c2
            middle = 0.5 * (begin + upto)
            pushed = r.wind_mps < 0.0 and a + (b + c * middle) * middle < 0.0
            load = (0.0, 0.0, 0.0) if pushed else (a, b, c)
            f0 = load[0] + p.weight_n * r.grade + p.inertia_kg * accel
            count, r1, r2 = force_roots(f0, load[1], load[2], begin, upto)
            for k in range(count + 1):
                stop = upto
                if k < count:
                    stop = r1 if k == 0 else r2
                if stop > begin:
                    terms = plus(terms, signed_terms(p, r, Ramp(accel, per_v2, f0, load[1], load[2]), begin, stop))
                begin = stop
            begin = upto
        begin = end
    return terms, dt


class Ramp(NamedTuple):
    """A ramp under one law of force: acceleration [m/s²], way for each unit of v² and the force f0 + b·v + c·v²."""

    accel: float
    per_v2: float
    f0: float
    b: float
    c: float


@njit(nogil=True, cache=True)
def signed_terms(p: LinkPhysics, r: Road, ramp: Ramp, low: float, high: float) -> Terms:
    """Terms of a piece of a ramp in which the force keeps its sign; divided where a limit on recuperation acts."""
    f0, b, c = ramp.f0, ramp.b, ramp.c
    work = stretch_work_j(f0, b, c, ramp.per_v2 * (high * high - low * low), low, high)
    if work >= 0.0 or (math.isinf(p.regen_cap_w) and low >= p.regen_min_mps):
        return piece_terms(p, r, ramp, low, high, math.inf)
    if high <= p.regen_min_mps:
        return piece_terms(p, r, ramp, low, high, 0.0)
    terms = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if low < p.regen_min_mps:
        terms = piece_terms(p, r, ramp, low, p.regen_min_mps, 0.0)
        low = p.regen_min_mps
    if math.isinf(p.regen_cap_w):
        return plus(terms, piece_terms(p, r, ramp, low, high, math.inf))
    eta = p.recuperation_factor
    # power eta·v·(f0 + b·v + c·v²) is monotone between its turning points
    turns, t1, t2 = force_roots(f0, 2.0 * b, 3.0 * c, low, high)
    begin = low
    for k in range(turns + 1):
        end = high
        if k < turns:
            end = t1 if k == 0 else t2
        if end <= begin:
            continue
        cap_mps = cap_speed(p.regen_cap_w, eta * f0, eta * b, eta * c, begin, end)
        if begin < cap_mps < end:
            for part in range(2):
                v_low, v_high = (begin, cap_mps) if part == 0 else (cap_mps, end)
                middle = 0.5 * (v_low + v_high)
                capped = eta * middle * (f0 + (b + c * middle) * middle) < -p.regen_cap_w
                cap_w = p.regen_cap_w if capped else math.inf
                terms = plus(terms, piece_terms(p, r, ramp, v_low, v_high, cap_w))
        else:
            middle = 0.5 * (begin + end)
            capped = eta * middle * (f0 + (b + c * middle) * middle) < -p.regen_cap_w
            cap_w = p.regen_cap_w if capped else math.inf
            terms = plus(terms, piece_terms(p, r, ramp, begin, end, cap_w))
        begin = end
    return terms


@njit(nogil=True, cache=True)
def cap_speed(cap_w: float, f0: float, b: float, c: float, low: float, high: float) -> float:
    """Speed where v·(f0 + b·v + c·v²), monotone in low..high, is −cap_w, by bisection; low where there is none."""
    at_low = low * (f0 + (b + c * low) * low) + cap_w
    at_high = high * (f0 + (b + c * high) * high) + cap_w
    if (at_low < 0.0) == (at_high < 0.0):
        return low
    for _ in range(60):
        middle = 0.5 * (low + high)
        at = middle * (f0 + (b + c * middle) * middle) + cap_w
        if (at < 0.0) == (at_low < 0.0):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(nogil=True, cache=True)
def piece_terms(p: LinkPhysics, r: Road, ramp: Ramp, low: float, high: float, cap_w: float) -> Terms:
    """Terms of a piece of a ramp with one law of force and one of the battery: driving, recuperating or capped.

    cap_w: what recuperation charges with throughout the piece [W], inf where no limit acts.
    """
    accel, per_v2, f0, b, c = ramp
    capped = cap_w < math.inf
    ds = per_v2 * (high - low) * (high + low)
    dt = 2.0 * ds / (low + high)
    mean_v = (low * low + low * high + high * high) / (1.5 * (low + high))
    mean_v2 = 0.5 * (low * low + high * high)
    work = ds * (f0 + b * mean_v + c * mean_v2)
    rolling = r.rolling_n * ds
    linear = r.linear_n_per_mps * mean_v * ds
    still = r.aero_n_per_mps2 * mean_v2 * ds
    climb = p.weight_n * r.grade * ds
    inertia = p.inertia_kg * accel * ds
    drive = recuperation = limited = 0.0
    factor = p.drive_factor
    if work >= 0.0:
        drive = work * (p.drive_factor - 1.0)
    else:
        factor = p.recuperation_factor
        recuperation = work * (factor - 1.0)
        if capped:
            limited = -cap_w * dt - work * factor
    load = resistance = 0.0
    if p.loss_per_n2 > 0.0 or p.loss_per_w > 0.0:
        half, middle = 0.5 * (high - low), 0.5 * (high + low)
        for k in range(4):
            node = GAUSS_NODE[k >> 1]
            v = middle + half * (node if k & 1 else -node)
            force = f0 + (b + c * v) * v
            power = p.aux_move_w + (-cap_w if capped else factor * force * v)
            share = 0.5 * GAUSS_WEIGHT[k >> 1] * dt
            load += share * p.loss_per_n2 * force * force
            resistance += share * p.loss_per_w * power * power
    return (
        rolling,
        linear,
        still,
        climb,
        inertia,
        drive,
        recuperation,
        p.aux_move_w * dt,
        work - rolling - linear - still - climb - inertia if r.wind_mps != 0.0 else 0.0,
        limited,
        load,
        resistance,
    )
