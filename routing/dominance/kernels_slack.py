"""Compiled: what one label's state can be worth more than another's, on any way on.

The theorem that these bounds rest on is in docs/search-proof.md; lemma numbers are its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy, mean_over_intervals, speed_change_j
from energy.force.kernels_physics import LinkPhysics, road_in_time
from routing.dominance.kernels_rules import (
    DRIFT_S,
    GAIN_J,
    LEAST_ACCEL,
    MEETING_DISTANCE,
    NO_REGEN_J,
    NO_REGEN_MPS,
    UNEVEN_J,
    UNEVEN_S,
    WARM_UP_W,
    SlackRules,
)
from routing.links.kernels_tables import BorrowedLinks

# (1 + r)(ln(2/(1 + r)) + 1/2) for r in 0..1 is at most this: time lost by starting slower, docs/search.md lemma 4
LOST_TIME_COEF = 1.2131


class Entry(NamedTuple):
    """How a label enters a link: go-speed [m/s], probability of having stopped before it, time since departure [s]."""

    speed_mps: float
    stopped_frac: float
    time_s: float


class LinkAhead(NamedTuple):
    """The link that two labels are about to drive: length [m], limit [m/s], and LinkArrays.top_class."""

    link: int
    length_m: float
    limit_mps: float
    top_class: int


class Slack(NamedTuple):
    """Most energy [J] and time [s] that state A can cost over state B on any way on, and what dominance asks besides.

    gain_j: most that A can recuperate until they meet [J], −inf where they meet in this link. energy_j is inf where
    nothing is known, which is links too short for the printed model.
    """

    energy_j: float
    time_s: float
    gain_j: float


@njit(nogil=True, cache=True, inline="always")
def meeting_slack(
    q: SlackRules, half_inertia: float, v_a: float, v_b: float, v_max: float, warm_up_w: float
) -> tuple[float, float]:
    """Most energy [J] and time [s] that entering at v_a instead of v_b can cost where both reach v_max in the link.

    Lemma 5 of docs/search.md: kinetic energy at 1/η_dis, overshoot where the slower one accelerates harder,
    drag of whoever is faster, auxiliaries for the time lost, what losses and the cap can differ by (lemma 7), and what
    tyres take that are colder by the time by which the drives differ (lemma 8).
    """
    low, high = (v_a, v_b) if v_a < v_b else (v_b, v_a)
    accel_low = mean_over_intervals(q.speed_bound_mps, q.accel_sum, low, v_max)
    accel_high = accel_low
    if high < v_max:
        accel_high = mean_over_intervals(q.speed_bound_mps, q.accel_sum, high, v_max)
    least = min(accel_low, accel_high)
    top2 = v_max * v_max
    z = high * high - low * low
    run = (top2 - low * low) / (2.0 * least)
    overshoot = max(0.0, (top2 - high * high) - accel_high / accel_low * (top2 - low * low))
    diverge = max(0.0, accel_high - accel_low) / least * (top2 - low * low)
    linear = q.linear_n_per_mps
    swing = overshoot + diverge
    energy = (q.drive_factor - q.recuperation_factor) * half_inertia * swing
    energy += q.drive_factor * run * (q.aero_n_per_mps2 * swing + linear * math.sqrt(swing) + q.sag_n)
    if v_a < v_b:
        lost = LOST_TIME_COEF * (high - low) / least
        if diverge > 0.0:
            lost += LOST_TIME_COEF * math.sqrt(diverge) / least
        energy += q.drive_factor * half_inertia * z
    else:
        lost = LOST_TIME_COEF * math.sqrt(swing) / least if swing > 0.0 else 0.0
        drag = q.drive_factor * run * (q.aero_n_per_mps2 * z + linear * (high - low))
        energy += max(0.0, drag - q.recuperation_factor * half_inertia * z)
    if q.loss_w > 0.0 or q.cap_w > 0.0:
        apart = LOST_TIME_COEF * (high - low) / least
        drift = 2.0 * (v_max - low) / least * abs(accel_high - accel_low) / least
        energy += q.loss_w * (apart + drift) + q.cap_w * apart
    if warm_up_w > 0.0:
        energy += warm_up_w * LOST_TIME_COEF * (high - low + math.sqrt(swing)) / least
    return energy + q.power_w * lost, lost


@njit(nogil=True, cache=True, inline="always")
def reaches(q: SlackRules, v: float, v_max: float, length: float) -> bool:
    """Whether an entry at v reaches v_max within a length."""
    if v >= v_max:
        return True
    accel = mean_over_intervals(q.speed_bound_mps, q.accel_sum, v, v_max)
    return bool(v_max * v_max - v * v <= 2.0 * accel * length)


@njit(nogil=True, cache=True, inline="always")
def table_slack(p: LinkPhysics, v_max: float, a: Entry, b: Entry) -> float:
    """What a vehicle that is given by its consumption spends more on reaching v_max from state A than from B [J]."""
    energy = (1.0 - a.stopped_frac) * speed_change_j(p, a.speed_mps, v_max)
    energy += a.stopped_frac * speed_change_j(p, 0.0, v_max)
    energy -= (1.0 - b.stopped_frac) * speed_change_j(p, b.speed_mps, v_max)
    return energy - b.stopped_frac * speed_change_j(p, 0.0, v_max)


@njit(nogil=True, cache=True)
def state_slack(
    q: SlackRules, half_inertia: float, ahead: LinkAhead, a: Entry, b: Entry
) -> tuple[float, float, bool, float]:
    """Most energy [J] and time [s] that state A can cost over state B on any way on; whether they meet in this link.

    If not, the last value is the most that A can recuperate until they meet [J].
    The two drives are coupled: both have stopped, or only one has, or none.
    """
    length, v_max, k, bounds = ahead.length_m, ahead.limit_mps, ahead.top_class, q.bounds
    v_a, p_a, v_b, p_b = a.speed_mps, a.stopped_frac, b.speed_mps, b.stopped_frac
    only_one = abs(p_a - p_b)
    none = 1.0 - max(p_a, p_b)
    slowest = min(v_a, v_b) if only_one == 0.0 else 0.0
    # the faster one may accelerate so much less that it is the last to reach the limit
    meets = reaches(q, slowest, v_max, length)
    if meets and (none > 0.0 or p_a <= p_b):
        meets = reaches(q, v_a, v_max, length)
    if meets and (none > 0.0 or p_a >= p_b):
        meets = reaches(q, v_b, v_max, length)
    if meets:
        energy = bounds[NO_REGEN_J, k] if slowest < bounds[NO_REGEN_MPS, k] else 0.0
        lost = 0.0
        warm_up_w = bounds[WARM_UP_W, k]
        for one_stops in range(2):  # none has stopped, or only one has
            share, begin_a, begin_b = none, v_a, v_b
            if one_stops == 1:
                share = only_one
                begin_a, begin_b = (0.0, v_b) if p_a > p_b else (v_a, 0.0)
            elif v_a == v_b:
                continue
            if share > 0.0:
                e, t = meeting_slack(q, half_inertia, begin_a, begin_b, v_max, warm_up_w)
                energy += share * e
                lost += share * t
        return energy, lost, True, 0.0
    deficit = none * max(0.0, v_b * v_b - v_a * v_a)
    excess = none * max(0.0, v_a * v_a - v_b * v_b)
    slower = math.sqrt(none) * max(0.0, v_b - v_a)
    if p_a > p_b:
        deficit += only_one * v_b * v_b
        slower += math.sqrt(only_one) * v_b
    else:
        excess += only_one * v_a * v_a
    lost = 2.0 * LOST_TIME_COEF * slower / bounds[LEAST_ACCEL, k] + bounds[UNEVEN_S, k]
    drag = q.drive_factor * bounds[MEETING_DISTANCE, k]
    drag *= q.aero_n_per_mps2 * excess + q.linear_n_per_mps * math.sqrt(excess)
    energy = q.drive_factor * half_inertia * deficit + q.power_w * lost + bounds[UNEVEN_J, k]
    # the drag comes first: kinetic energy that pays for it only later could miss the reserve meanwhile
    energy += drag
    if slowest < bounds[NO_REGEN_MPS, k]:
        energy += 2.0 * bounds[NO_REGEN_J, k]
    if q.loss_w > 0.0 or q.cap_w > 0.0 or bounds[WARM_UP_W, k] > 0.0:
        faster = math.sqrt(none) * max(0.0, v_a - v_b) + (math.sqrt(only_one) * v_a if p_a <= p_b else 0.0)
        apart = 2.0 * LOST_TIME_COEF * max(slower, faster) / bounds[LEAST_ACCEL, k]
        energy += q.loss_w * (apart + bounds[DRIFT_S, k]) + q.cap_w * apart
        energy += bounds[WARM_UP_W, k] * (apart + bounds[UNEVEN_S, k])
    return energy, lost, False, bounds[GAIN_J, k]


@njit(nogil=True, cache=True)
def phase_slack(
    p: LinkPhysics, roads: NDArray[np.float64], ahead: LinkAhead, a: Entry, b: Entry
) -> tuple[float, float]:
    """The exact difference of energy and time of two entries of a link in which all phases fit whatever follows.

    Both enter when B does; what it costs that they do not is climate_debt_j and warm_up_debt_j.
    """
    length, v_max = ahead.length_m, ahead.limit_mps
    road = road_in_time(p, roads, ahead.link, b.time_s, length / v_max)
    e_a, t_a, _ = link_energy(p, road, length, a.speed_mps, a.stopped_frac, v_max, v_max, 0.0, 0.0)
    e_b, t_b, _ = link_energy(p, road, length, b.speed_mps, b.stopped_frac, v_max, v_max, 0.0, 0.0)
    return e_a - e_b, t_a - t_b


@njit(nogil=True, cache=True, inline="always")
def slack_of(
    p: LinkPhysics, q: SlackRules, half_inertia: float, g: BorrowedLinks, ahead: LinkAhead, a: Entry, b: Entry
) -> Slack:
    """The slack of state A over state B."""
    if q.printed:
        if ahead.length_m < g.settling_m[ahead.link]:
            return Slack(math.inf, 0.0, 0.0)
        energy, lost = phase_slack(p, g.roads, ahead, a, b)
        return Slack(energy + q.bounds[WARM_UP_W, ahead.top_class] * abs(lost), lost, -math.inf)
    if q.table:
        return Slack(table_slack(p, ahead.limit_mps, a, b), 0.0, -math.inf)
    energy, lost, meets, gain = state_slack(q, half_inertia, ahead, a, b)
    return Slack(energy, lost, -math.inf if meets else gain)


@njit(nogil=True, cache=True)
def greatest_of_sums(running_sum: NDArray[np.float64]) -> float:
    """The greatest value of a table that is given by its running sums."""
    most = 0.0
    for k in range(running_sum.size - 1):
        most = max(most, running_sum[k + 1] - running_sum[k])
    return most
