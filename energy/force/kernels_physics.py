"""Compiled: the vehicle and the road as kernels read them, and what the battery and the cabin do in time."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_parts import ROLLING, TYRE_WARM_UP

# columns of the table of roads, one row a link: what `Road` holds, the stop time at the link's end, and by how much
# tyres as they are at departure raise the rolling resistance
ROAD_GRADE, ROAD_ROLLING, ROAD_LINEAR, ROAD_AERO, ROAD_WIND, ROAD_WAIT, ROAD_WARM_UP = range(7)
ROAD_COLUMNS = 8  # one cache line


class LinkPhysics(NamedTuple):
    """Vehicle and conditions as the kernels want them.

    weight_n: m·g. inertia_kg: m·d. drive_factor: 1/η_dis. recuperation_factor: η_chg.
    aux_move_w, aux_idle_w: P_aux/η_aux.
    speed_bound_mps: (n+1,) interval boundaries. accel_sum, decel_sum: (n+1,) running sums of |a| over intervals.
    printed: evaluate dynamic phases as equations (13), (15), (36) are printed instead of integrating exactly.
    regen_cap_w: most battery power that recuperation charges with, inf for none. fade_width_j: charge below full over
    which the battery accepts less and less of it [J], 0 for no fading. loss_per_n2: loss for force squared [W/N²].
    loss_per_w: loss for battery power squared [1/W]. regen_min_mps: slower than this, braking gives nothing back.
    lossy: a cap, a least speed or one of these losses is on.
    cabin_w, cabin_start_w, cabin_time_s: climate power at t since departure is
    cabin_w + cabin_start_w·exp(−t/cabin_time_s). tyre_time_s: in which the tyres' warm-up decays, 0 for none.
    table: a consumption table instead of forces; climb_up_j_per_m, climb_down_j_per_m, kinetic_up_kg and
    kinetic_down_kg are then what height and speed take and give back.
    """

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
    regen_cap_w: float
    fade_width_j: float
    loss_per_n2: float
    loss_per_w: float
    regen_min_mps: float
    lossy: bool
    cabin_w: float
    cabin_start_w: float
    cabin_time_s: float
    tyre_time_s: float
    table: bool
    climb_up_j_per_m: float
    climb_down_j_per_m: float
    kinetic_up_kg: float
    kinetic_down_kg: float


class Road(NamedTuple):
    """What one link does to the vehicle: F = load + m·g·grade + m·d·a, the load being

        rolling_n + linear·v + aero·(v + wind)·|v + wind|, but at least 0 with wind from behind.

    grade: sin θ. rolling_n: A·cos θ, with what lies on the road. wind_mps: against the direction of travel, negative
    from behind.
    """

    grade: float
    rolling_n: float
    linear_n_per_mps: float
    aero_n_per_mps2: float
    wind_mps: float


@njit(nogil=True, cache=True)
def road_at(roads: NDArray[np.float64], link: int) -> Road:
    """The road of a link, from the table of roads (n, 8)."""
    return Road(
        roads[link, ROAD_GRADE],
        roads[link, ROAD_ROLLING],
        roads[link, ROAD_LINEAR],
        roads[link, ROAD_AERO],
        roads[link, ROAD_WIND],
    )


@njit(nogil=True, cache=True)
def road_in_time(p: LinkPhysics, roads: NDArray[np.float64], link: int, begin_s: float, duration_s: float) -> Road:
    """The road of a link with tyres as warm as they are on the mean of duration_s from begin_s since departure on.

    Of a link that is the time which it takes at its limit, so that dividing it changes nothing but rounding.
    """
    r = road_at(roads, link)
    if p.tyre_time_s == 0.0:
        return r
    span = duration_s / p.tyre_time_s
    mean = math.exp(-begin_s / p.tyre_time_s) * (-math.expm1(-span) / span if span > 0.0 else 1.0)
    rolling = r.rolling_n + roads[link, ROAD_WARM_UP] * mean
    return Road(r.grade, rolling, r.linear_n_per_mps, r.aero_n_per_mps2, r.wind_mps)


@njit(nogil=True, cache=True)
def book_warm_up(
    p: LinkPhysics, r: Road, roads: NDArray[np.float64], link: int, rolling_j: float, parts: NDArray[np.float64]
) -> None:
    """Move what cold tyres took of rolling_j, work that parts (15,) already holds as rolling, to its own part."""
    if p.tyre_time_s > 0.0 and r.rolling_n != 0.0:
        cold = rolling_j * ((r.rolling_n - roads[link, ROAD_ROLLING]) / r.rolling_n)
        parts[ROLLING] -= cold
        parts[TYRE_WARM_UP] += cold


@njit(nogil=True, cache=True)
def accepted_j(p: LinkPhysics, used_j: float, energy_j: float, full_j: float) -> float:
    """Energy that the battery accepts of what a link gives back (energy_j < 0), after used_j [J] since departure.

    full_j fills the battery. Over the last fade_width_j the share that is accepted falls linearly with the room that
    is left, d(room) = −room/width · d(offered): an exponential, so that more charge before stays more charge after.
    """
    if energy_j >= 0.0 or p.fade_width_j <= 0.0 or full_j == -math.inf:
        return energy_j
    room = max(used_j - full_j, 0.0)
    free = max(room - p.fade_width_j, 0.0)
    if -energy_j <= free:
        return energy_j
    fading = room - free
    return fading * math.expm1((energy_j + free) / p.fade_width_j) - free


@njit(nogil=True, cache=True)
def cabin_energy_j(p: LinkPhysics, begin_s: float, end_s: float) -> float:
    """Climate energy between two times since departure, H(end) − H(begin)."""
    if p.cabin_w == 0.0 and p.cabin_start_w == 0.0:
        return 0.0
    tau = p.cabin_time_s
    transient = math.exp(-begin_s / tau) * -math.expm1(-(end_s - begin_s) / tau)
    return p.cabin_w * (end_s - begin_s) + p.cabin_start_w * tau * transient


@njit(nogil=True, cache=True, inline="always")
def borrowed_physics(p: LinkPhysics) -> LinkPhysics:
    """The same vehicle and conditions with borrowed arrays."""
    return LinkPhysics(
        p.weight_n,
        p.inertia_kg,
        p.drive_factor,
        p.recuperation_factor,
        p.aux_move_w,
        p.aux_idle_w,
        borrowed(p.speed_bound_mps),
        borrowed(p.accel_sum),
        borrowed(p.decel_sum),
        p.printed,
        p.regen_cap_w,
        p.fade_width_j,
        p.loss_per_n2,
        p.loss_per_w,
        p.regen_min_mps,
        p.lossy,
        p.cabin_w,
        p.cabin_start_w,
        p.cabin_time_s,
        p.tyre_time_s,
        p.table,
        p.climb_up_j_per_m,
        p.climb_down_j_per_m,
        p.kinetic_up_kg,
        p.kinetic_down_kg,
    )
