"""Compiled: whether one label makes another of the same link superfluous."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from routing.dominance.kernels_rules import (
    NOISE_COST,
    NOISE_J,
    NOISE_S,
    TYRE_TIME_S,
    WARM_LATE_W,
    WARM_UP_W,
    SearchRules,
    SlackRules,
)


@njit(nogil=True, cache=True)
def climate_debt_j(q: SlackRules, t_a: float, t_b: float) -> float:
    """Most that a drive that is earlier still has to spend on the climate's start and the later one has behind it."""
    if q.cabin_start_w == 0.0 or t_a >= t_b:
        return 0.0
    tau = q.cabin_time_s
    return q.cabin_start_w * tau * (math.exp(-t_a / tau) - math.exp(-t_b / tau))


@njit(nogil=True, cache=True)
def warm_up_debt_j(bounds: NDArray[np.float64], k: int, t_a: float, t_b: float) -> float:
    """Most that tyres colder or warmer by the time between two drives can still cost the first one (lemma 8)."""
    tau = bounds[TYRE_TIME_S, k]
    colder = tau * (math.exp(-t_a / tau) - math.exp(-t_b / tau))
    due: float = bounds[WARM_UP_W, k] * colder if colder > 0.0 else -bounds[WARM_LATE_W, k] * colder
    return due


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

    energy, lost, gain: what slack_of says of their states. due: what a may still spend because it is earlier or later
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
def least_slack_j(
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
    """Lead in energy without which state A leads no label in another state B [J], never more than state_slack asks for.

    It spares most comparisons of labels on short links. kinetic_j: drive_factor · half_inertia_kg, 0 for a model whose
    gaps are exact; slack_j: row UNEVEN_J of the bounds; most_accel: no mean acceleration is greater [m/s²].
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
