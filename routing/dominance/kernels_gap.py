"""Compiled: what one label's state can be worth more than another's, on any way on; the rules of dominance.

The theorem that these bounds rest on is in docs/search.md; lemma numbers are its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.chain.kernels_link import link_energy, mean_over_intervals, speed_change_j
from energy.compiled.kernels_borrow import borrowed
from energy.force.kernels_physics import LinkPhysics, road_in_time

# columns of the label table
KEY, COST, ENERGY, TIME, DISTANCE, SPEED, STOPPED, OFFSET = range(8)
# columns of the table of links
LENGTH, LIMIT, HEIGHT, STOP, CRUISE_J, CRUISE_S, REST_J, REST_S = range(8)

# leads this small are rounding: without them a loss-free vehicle's labels, equal but for the last digits, would pile up
NOISE_J = 1e-6
NOISE_S = 1e-9
NOISE_COST = 1e-12

# (1 + r)(ln(2/(1 + r)) + 1/2) for r in 0..1 is at most this: time lost by starting slower, docs/search.md lemma 4
LOST_TIME_COEF = 1.2131


# columns of SearchRules.descent
DESCENT_J, DESCENT_MPS = range(2)

# rows of the table of bounds on what a difference of entry states can be worth while two drives have not met again;
# one column a speed interval of the vehicle, for drives that stay below its upper end (docs/search.md, lemma 6):
# least mean acceleration [m/s²]; distance until they meet, weighted and doubled [m]; what differing mean accelerations
# can add [J] and [s]; most that can be recuperated until they meet [J]
# DRIFT_S: time by which differing mean accelerations shift the same phase [s]
# The rest is the same in every column. CUT_MPS: speed below which braking gives nothing back, CUT_J: most that it costs
# to be slower than that. WARM_UP_W: most that cold tyres take at departure, WARM_LATE_W: most that warmer ones can cost
# instead, where losses grow with the square of the force, of which braking has then more; TYRE_TIME_S: they warm up in
LEAST_ACCEL, MEETING_DISTANCE, SLACK_J, SLACK_S, GAIN_J, DRIFT_S = range(6)
CUT_MPS, CUT_J, WARM_UP_W, WARM_LATE_W, TYRE_TIME_S = range(6, 11)


class SearchRules(NamedTuple):
    """Weights, limits and potential of one search.

    least_energy_j: −(1 − soc)·capacity, a full battery; most_energy_j: (soc − reserve)·capacity; ±inf when not held.
    cost = energy_weight·E + time_weight·t + distance_weight·s. alpha: of the potential, in [η_chg, 1/η_dis].
    half_inertia_kg: ½·m·d. limited: any battery limit is held. pareto: dominance needs cost and energy.
    correcting: reduced costs may be negative (printed model). descent: (M, 2), by link the most that ways on from its
    tail give back to an entry without speed [J], and the speed below which that isn't known [m/s]. Where cabin or tyres
    are to be paid from a lead in charge, it counts only as far as that can't fill the battery. (0, 2): it
    counts in full.
    """

    least_energy_j: float
    most_energy_j: float
    energy_weight: float
    time_weight: float
    distance_weight: float
    alpha: float
    half_inertia_kg: float
    limited: bool
    pareto: bool
    correcting: bool
    label_limit: int
    descent: NDArray[np.float64]


class GapRules(NamedTuple):
    """The vehicle and its conditions as dominance sees them: bounds that hold on every link.

    drive_factor, recuperation_factor: greatest and least battery energy for a unit of work at the wheels.
    linear_n_per_mps, aero_n_per_mps2: greatest of all links, ≥ 0; sag_n: most that the road load falls with speed.
    power_w: most that standing about costs: auxiliaries and climate. cap_w: of recuperation, 0 for none. loss_w: most
    that losses growing with the square of force or power take. fade_width_j: charge over which the cap falls.
    cabin_start_w, cabin_time_s: the decaying part of the climate. printed, table: as in LinkPhysics.
    """

    drive_factor: float
    recuperation_factor: float
    linear_n_per_mps: float
    aero_n_per_mps2: float
    sag_n: float
    power_w: float
    cap_w: float
    loss_w: float
    fade_width_j: float
    cabin_start_w: float
    cabin_time_s: float
    speed_bound_mps: NDArray[np.float64]
    accel_sum: NDArray[np.float64]
    printed: bool
    table: bool


@njit(nogil=True, cache=True)
def borrowed_rules(q: GapRules) -> GapRules:
    """The same rules with borrowed arrays."""
    return GapRules(
        q.drive_factor,
        q.recuperation_factor,
        q.linear_n_per_mps,
        q.aero_n_per_mps2,
        q.sag_n,
        q.power_w,
        q.cap_w,
        q.loss_w,
        q.fade_width_j,
        q.cabin_start_w,
        q.cabin_time_s,
        borrowed(q.speed_bound_mps),
        borrowed(q.accel_sum),
        q.printed,
        q.table,
    )


@njit(nogil=True, cache=True)
def pair_gap(
    q: GapRules, half_inertia: float, v_a: float, v_b: float, v_max: float, warm_up_w: float
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


@njit(nogil=True, cache=True)
def reaches(q: GapRules, v: float, v_max: float, length: float) -> bool:
    """Whether an entry at v reaches v_max within a length."""
    if v >= v_max:
        return True
    accel = mean_over_intervals(q.speed_bound_mps, q.accel_sum, v, v_max)
    return bool(v_max * v_max - v * v <= 2.0 * accel * length)


@njit(nogil=True, cache=True)
def state_gap(
    p: LinkPhysics,
    q: GapRules,
    bounds: NDArray[np.float64],
    half_inertia: float,
    length: float,
    v_max: float,
    k: int,
    v_a: float,
    p_a: float,
    v_b: float,
    p_b: float,
) -> tuple[float, float, bool, float]:
    """Most energy [J] and time [s] that state A can cost over state B on any way on; whether they meet in this link.

    If not, the last value is the most that A can recuperate until they meet [J]; k is the link's top class.
    The two drives are coupled: both have stopped, or only one has, or none.
    """
    if q.table:
        energy = (1.0 - p_a) * speed_change_j(p, v_a, v_max) + p_a * speed_change_j(p, 0.0, v_max)
        energy -= (1.0 - p_b) * speed_change_j(p, v_b, v_max) + p_b * speed_change_j(p, 0.0, v_max)
        return energy, 0.0, True, 0.0
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
        energy = bounds[CUT_J, k] if slowest < bounds[CUT_MPS, k] else 0.0
        lost = 0.0
        warm_up_w = bounds[WARM_UP_W, k]
        if none > 0.0 and v_a != v_b:
            e, t = pair_gap(q, half_inertia, v_a, v_b, v_max, warm_up_w)
            energy += none * e
            lost += none * t
        if only_one > 0.0:
            if p_a > p_b:
                e, t = pair_gap(q, half_inertia, 0.0, v_b, v_max, warm_up_w)
            else:
                e, t = pair_gap(q, half_inertia, v_a, 0.0, v_max, warm_up_w)
            energy += only_one * e
            lost += only_one * t
        return energy, lost, True, 0.0
    deficit = none * max(0.0, v_b * v_b - v_a * v_a)
    excess = none * max(0.0, v_a * v_a - v_b * v_b)
    slower = math.sqrt(none) * max(0.0, v_b - v_a)
    if p_a > p_b:
        deficit += only_one * v_b * v_b
        slower += math.sqrt(only_one) * v_b
    else:
        excess += only_one * v_a * v_a
    lost = 2.0 * LOST_TIME_COEF * slower / bounds[LEAST_ACCEL, k] + bounds[SLACK_S, k]
    drag = q.drive_factor * bounds[MEETING_DISTANCE, k]
    drag *= q.aero_n_per_mps2 * excess + q.linear_n_per_mps * math.sqrt(excess)
    energy = q.drive_factor * half_inertia * deficit + q.power_w * lost + bounds[SLACK_J, k]
    # the drag comes first: kinetic energy that pays for it only later could miss the reserve meanwhile
    energy += drag
    if slowest < bounds[CUT_MPS, k]:
        energy += 2.0 * bounds[CUT_J, k]
    if q.loss_w > 0.0 or q.cap_w > 0.0 or bounds[WARM_UP_W, k] > 0.0:
        faster = math.sqrt(none) * max(0.0, v_a - v_b) + (math.sqrt(only_one) * v_a if p_a <= p_b else 0.0)
        apart = 2.0 * LOST_TIME_COEF * max(slower, faster) / bounds[LEAST_ACCEL, k]
        energy += q.loss_w * (apart + bounds[DRIFT_S, k]) + q.cap_w * apart
        energy += bounds[WARM_UP_W, k] * (apart + bounds[SLACK_S, k])
    return energy, lost, False, bounds[GAIN_J, k]


@njit(nogil=True, cache=True)
def phase_gap(
    p: LinkPhysics,
    roads: NDArray[np.float64],
    link: int,
    length: float,
    v_max: float,
    v_a: float,
    p_a: float,
    v_b: float,
    p_b: float,
    begin_s: float,
) -> tuple[float, float]:
    """The exact difference of energy and time of two entries of a link in which all phases fit whatever follows.

    begin_s: when both enter it; what it costs that they do not is climate_due_j and warm_up_due_j.
    """
    r = road_in_time(p, roads, link, begin_s, length / v_max)
    e_a, t_a, _ = link_energy(p, r, length, v_a, p_a, v_max, v_max, 0.0, 0.0)
    e_b, t_b, _ = link_energy(p, r, length, v_b, p_b, v_max, v_max, 0.0, 0.0)
    return e_a - e_b, t_a - t_b


@njit(nogil=True, cache=True)
def climate_due_j(q: GapRules, t_a: float, t_b: float) -> float:
    """Most that a drive that is earlier still has to spend on the climate's start and the later one has behind it."""
    if q.cabin_start_w == 0.0 or t_a >= t_b:
        return 0.0
    tau = q.cabin_time_s
    return q.cabin_start_w * tau * (math.exp(-t_a / tau) - math.exp(-t_b / tau))


@njit(nogil=True, cache=True)
def warm_up_due_j(bounds: NDArray[np.float64], k: int, t_a: float, t_b: float) -> float:
    """Most that tyres colder or warmer by the time between two drives can still cost the first one (lemma 8)."""
    tau = bounds[TYRE_TIME_S, k]
    colder = tau * (math.exp(-t_a / tau) - math.exp(-t_b / tau))
    due: float = bounds[WARM_UP_W, k] * colder if colder > 0.0 else -bounds[WARM_LATE_W, k] * colder
    return due


@njit(nogil=True, cache=True)
def gap_of(
    p: LinkPhysics,
    q: GapRules,
    bounds: NDArray[np.float64],
    r: SearchRules,
    roads: NDArray[np.float64],
    link: int,
    length: float,
    v_max: float,
    settling: float,
    k: int,
    v_a: float,
    p_a: float,
    v_b: float,
    p_b: float,
    begin_s: float,
) -> tuple[float, float, float]:
    """Most energy [J] and time [s] that state A can cost over state B on any way on, and what else `leads` asks for.

    The third value is the most that A can recuperate until they meet [J], −inf where they meet in this link. The first
    is inf where nothing is known, which is links too short for the printed model. begin_s: when B enters the link.
    """
    if q.printed:
        if length < settling:
            return math.inf, 0.0, 0.0
        energy, lost = phase_gap(p, roads, link, length, v_max, v_a, p_a, v_b, p_b, begin_s)
        return energy + bounds[WARM_UP_W, k] * abs(lost), lost, -math.inf
    energy, lost, meets, gain = state_gap(p, q, bounds, r.half_inertia_kg, length, v_max, k, v_a, p_a, v_b, p_b)
    return energy, lost, -math.inf if meets else gain


@njit(nogil=True, cache=True)
def leads(
    r: SearchRules,
    cost_a: float,
    energy_a: float,
    cost_b: float,
    energy_b: float,
    energy: float,
    lost: float,
    gain: float,
    due: float,
    fade_frac: float,
) -> bool:
    """Whether label a makes label b in another state of the same link superfluous, whatever follows.

    energy, lost, gain: what gap_of says of their states. due: what a may still spend because it is earlier or later
    [J]. fade_frac: share of a lead that a battery may lose until they meet whose acceptance falls with charge.
    """
    if energy == math.inf or fade_frac >= 1.0:
        return False
    energy += due
    if energy > 0.0:
        energy /= 1.0 - fade_frac
    lost -= NOISE_S
    if cost_a + r.energy_weight * (energy - NOISE_J) + r.time_weight * lost > cost_b:
        return False
    if not r.limited:
        return True
    if r.pareto and r.least_energy_j != -math.inf:
        # a full battery would take the lead in energy and leave the debt in time
        rest_a, rest_b = cost_a - r.energy_weight * energy_a, cost_b - r.energy_weight * energy_b
        if rest_a + max(0.0, r.time_weight * lost) > rest_b + NOISE_COST:
            return False
    # a full battery could take away the lead: count a's charge only as far as it can't be clamped until they meet
    return bool(max(energy_a, r.least_energy_j + gain) + energy - NOISE_J <= energy_b)


@njit(nogil=True, cache=True)
def least_worth_j(
    kinetic_j: float,
    most_accel: float,
    slack_j: float,
    length: float,
    v_max: float,
    v_a: float,
    p_a: float,
    v_b: float,
    p_b: float,
) -> float:
    """Lead in energy without which state A leads no label in another state B [J], never more than state_gap asks for.

    It spares most comparisons of labels on short links. kinetic_j: drive_factor · half_inertia_kg, 0 for a model whose
    gaps are exact; slack_j: row SLACK_J of the bounds; most_accel: no mean acceleration is greater [m/s²].
    """
    none = 1.0 - max(p_a, p_b)
    worth = none * max(0.0, v_b * v_b - v_a * v_a)
    slowest = min(v_a, v_b)
    if p_a != p_b:
        slowest = 0.0
        if p_a > p_b:
            worth += (p_a - p_b) * v_b * v_b
    worth_j = kinetic_j * worth * (1.0 - 1e-9) - 2.0 * NOISE_J
    if v_max * v_max - slowest * slowest > 2.0 * (1.0 + 1e-9) * most_accel * length:
        worth_j += slack_j  # they do not meet in this link
    return worth_j


@njit(nogil=True, cache=True)
def greatest_of_sums(running_sum: NDArray[np.float64]) -> float:
    """The greatest value of a table that is given by its running sums."""
    most = 0.0
    for k in range(running_sum.size - 1):
        most = max(most, running_sum[k + 1] - running_sum[k])
    return most
