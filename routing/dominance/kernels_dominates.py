"""Compiled: whether one label makes another of the same link superfluous, whatever follows.

The theorem and its lemmas are in docs/search-proof.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.force.kernels_physics import LinkPhysics
from routing.dominance.kernels_rules import (
    DESCENT_J,
    DESCENT_MPS,
    GAIN_J,
    NOISE_COST,
    NOISE_J,
    NOISE_S,
    TYRE_TIME_S,
    UNEVEN_J,
    WARM_LATE_W,
    WARM_UP_W,
    SearchRules,
    SlackRules,
)
from routing.dominance.kernels_slack import Entry, LinkAhead, Slack, greatest_of_sums, slack_of
from routing.links.kernels_drives import MOST_STATES, PAIR, PAIR_GAIN_J, PAIR_J, PAIR_S, DriveTable, pair_slot
from routing.links.kernels_tables import LENGTH, LIMIT, BorrowedLinks


class Rivalry(NamedTuple):
    """All that comparing two labels of one search reads, arrays borrowed.

    pair: slacks that are known, of drives.pair; keeps: whether new ones are written there. timeless: neither cabin nor
    tyres warm up. fades: the battery accepts less as it fills. strict: SearchRules.descent is given. uneven: two drives
    may differ until they meet, and how far is bounded by the rows of SlackRules.bounds. kinetic_j: drive_factor times
    half_inertia_kg, 0 where slacks are exact. most_accel_mps2: no mean acceleration is greater.
    """

    physics: LinkPhysics
    slack: SlackRules
    rules: SearchRules
    descent: NDArray[np.float64]
    links: BorrowedLinks
    pair: NDArray[np.float64]
    keeps: bool
    timeless: bool
    warms: bool
    fades: bool
    strict: bool
    uneven: bool
    kinetic_j: float
    most_accel_mps2: float


class Label(NamedTuple):
    """A label as dominance sees it: cost, energy used [J], how it enters the link; state: of the table of drives."""

    cost: float
    energy_j: float
    entry: Entry
    state: int


@njit(nogil=True, cache=True, inline="always")
def rivalry_of(p: LinkPhysics, q: SlackRules, r: SearchRules, g: BorrowedLinks, d: DriveTable) -> Rivalry:
    """What compares the labels of a search; p, q, g, d: borrowed."""
    warms = p.tyre_time_s > 0.0
    uneven = not q.printed and not q.table
    return Rivalry(
        physics=p,
        slack=q,
        rules=r,
        descent=r.descent,
        links=g,
        pair=d.pair,
        keeps=d.fills,
        timeless=q.cabin_start_w == 0.0 and not warms,
        warms=warms,
        fades=p.fade_width_j > 0.0,
        strict=r.descent.shape[0] > 0,
        uneven=uneven,
        kinetic_j=q.drive_factor * r.half_inertia_kg if uneven else 0.0,
        most_accel_mps2=greatest_of_sums(q.accel_sum),
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
    debt: float = bounds[WARM_UP_W, k] * colder if colder > 0.0 else -bounds[WARM_LATE_W, k] * colder
    return debt


@njit(nogil=True, cache=True, inline="always")
def debt_j(m: Rivalry, k: int, a: Label, b: Label) -> float:
    """Most that a may still spend on cabin and tyres because it is earlier or later than b [J]; k: the top class."""
    if m.timeless:
        return 0.0
    debt = climate_debt_j(m.slack, a.entry.time_s, b.entry.time_s)
    if m.warms:
        debt += warm_up_debt_j(m.slack.bounds, k, a.entry.time_s, b.entry.time_s)
    return debt


@njit(nogil=True, cache=True, inline="always")
def safe_charge_j(m: Rivalry, link: int, a: Label) -> float:
    """Energy used [J] from which on no way on fills the battery, for a strict search; −inf for any other (lemma 10)."""
    if not m.strict:
        return -math.inf
    descent, speed, stopped = m.descent, a.entry.speed_mps, a.entry.stopped_frac
    if speed < descent[link, DESCENT_MPS]:
        return math.inf
    held_j = m.rules.alpha * m.rules.half_inertia_kg * (1.0 - stopped) * speed * speed
    safe_j: float = m.rules.least_energy_j + m.slack.fade_width_j + descent[link, DESCENT_J] + held_j
    return safe_j


@njit(nogil=True, cache=True, inline="always")
def pays_rest(r: SearchRules, cost_a: float, energy_a: float, cost_b: float, energy_b: float, lost_s: float) -> bool:
    """Whether a has paid no more than b of what is not energy, with what it may yet lose in time: the Pareto rule.

    A battery that is full on the way would take a's advantage in energy and leave the debt in time.
    """
    rest_a, rest_b = cost_a - r.energy_weight * energy_a, cost_b - r.energy_weight * energy_b
    return rest_a + max(0.0, r.time_weight * lost_s) <= rest_b + NOISE_COST


@njit(nogil=True, cache=True, inline="always")
def dominates_by(
    r: SearchRules,
    cost_a: float,
    energy_a: float,
    cost_b: float,
    energy_b: float,
    slack: Slack,
    debt: float,
    fade_frac: float,
) -> bool:
    """Whether label a dominates label b in another state of the same link, given the slack of their states.

    debt: as of debt_j. fade_frac: share of an advantage that a battery may lose until they meet whose acceptance falls
    with charge.
    """
    energy, lost = slack.energy_j, slack.time_s
    if energy == math.inf or fade_frac >= 1.0:
        return False
    energy += debt
    if energy > 0.0:
        energy /= 1.0 - fade_frac
    lost -= NOISE_S
    if cost_a + r.energy_weight * (energy - NOISE_J) + r.time_weight * lost > cost_b:
        return False
    if not r.limited:
        return True
    if r.pareto and r.least_energy_j != -math.inf and not pays_rest(r, cost_a, energy_a, cost_b, energy_b, lost):
        return False
    # a full battery could take the advantage away: count a's charge only as far as it can't be clamped until they meet
    return bool(max(energy_a, r.least_energy_j + slack.gain_j) + energy - NOISE_J <= energy_b)


@njit(nogil=True, cache=True, inline="always")
def least_slack_j(
    kinetic_j: float, most_accel: float, uneven_j: float, length: float, v_max: float, a: Entry, b: Entry
) -> float:
    """Slack that state A has at least over another state B [J], never more than that of state_slack.

    It spares most comparisons of labels on short links. kinetic_j, most_accel [m/s²]: as in Rivalry; uneven_j: row
    UNEVEN_J of the bounds.
    """
    v_a, p_a, v_b, p_b = a.speed_mps, a.stopped_frac, b.speed_mps, b.stopped_frac
    none = 1.0 - max(p_a, p_b)
    worth = none * max(0.0, v_b * v_b - v_a * v_a)
    slowest = min(v_a, v_b)
    if p_a != p_b:
        slowest = 0.0
        if p_a > p_b:
            worth += (p_a - p_b) * v_b * v_b
    worth_j = kinetic_j * worth * (1.0 - 1e-9) - 2.0 * NOISE_J
    if v_max * v_max - slowest * slowest > 2.0 * (1.0 + 1e-9) * most_accel * length:
        worth_j += uneven_j  # they do not meet in this link
    return worth_j


@njit(nogil=True, cache=True, inline="always")
def known_slack(m: Rivalry, ahead: LinkAhead, a: Label, b: Label) -> Slack:
    """The slack of a over b, from the table of pairs of states or computed, and kept there if this search may."""
    slot = -1
    if a.state > 0 and b.state > 0:
        slot = pair_slot(m.pair, a.state, b.state)
        if slot >= 0 and not math.isnan(m.pair[slot, PAIR]):
            known = Slack(m.pair[slot, PAIR_J], m.pair[slot, PAIR_S], m.pair[slot, PAIR_GAIN_J])
            if not math.isnan(known.energy_j + known.time_s + known.gain_j):
                return known
    slack = slack_of(m.physics, m.slack, m.rules.half_inertia_kg, m.links, ahead, a.entry, b.entry)
    if slot >= 0 and m.keeps:
        m.pair[slot, PAIR_J], m.pair[slot, PAIR_S], m.pair[slot, PAIR_GAIN_J] = slack
        m.pair[slot, PAIR] = float(int(a.state) * MOST_STATES + int(b.state))
    return slack


@njit(nogil=True, cache=True, inline="always")
def dominates_alike(m: Rivalry, a: Label, b: Label, equal: bool, debt: float, safe_j: float) -> bool:
    """Whether a dominates b in an equal state; in a crowd in any, with kinetic energy as if the battery gave it."""
    r = m.rules
    worth_j = debt
    if not equal:
        v_a, v_b = a.entry.speed_mps, b.entry.speed_mps
        gained = (1.0 - b.entry.stopped_frac) * v_b * v_b - (1.0 - a.entry.stopped_frac) * v_a * v_a
        worth_j += m.slack.drive_factor * r.half_inertia_kg * max(0.0, gained)
    if a.cost + r.energy_weight * worth_j > b.cost:
        return False
    if r.pareto or (r.limited and equal):
        charged_j = max(a.energy_j, safe_j) if worth_j > 0.0 else a.energy_j
        return charged_j + worth_j <= b.energy_j
    return True


@njit(nogil=True, cache=True, inline="always")
def dominates(m: Rivalry, link: int, a: Label, b: Label, crowded: bool) -> bool:
    """Whether label a makes label b of the same link superfluous, whatever follows.

    crowded: there are so many labels on the link that states count as alike, which the search reports.
    """
    r = m.rules
    if a.cost > b.cost:
        return False
    if r.pareto:
        if a.energy_j > b.energy_j:
            return False
        if r.least_energy_j != -math.inf and not pays_rest(r, a.cost, a.energy_j, b.cost, b.energy_j, 0.0):
            return False
    top_class = m.links.top_class[link]
    debt = debt_j(m, top_class, a, b)
    safe_j = safe_charge_j(m, link, a)
    equal = a.entry.speed_mps == b.entry.speed_mps and a.entry.stopped_frac == b.entry.stopped_frac
    if equal or crowded:
        return dominates_alike(m, a, b, equal, debt, safe_j)
    ahead = LinkAhead(link, m.links.row[link, LENGTH], m.links.row[link, LIMIT], top_class)
    bounds = m.slack.bounds
    least_j = least_slack_j(
        m.kinetic_j,
        m.most_accel_mps2,
        bounds[UNEVEN_J, top_class] if m.uneven else 0.0,
        ahead.length_m,
        ahead.limit_mps,
        a.entry,
        b.entry,
    )
    if a.cost + r.energy_weight * least_j > b.cost or (r.limited and a.energy_j + least_j > b.energy_j):
        return False
    slack = known_slack(m, ahead, a, b)
    fade_frac = bounds[GAIN_J, top_class] / m.slack.fade_width_j if m.fades else 0.0
    if m.strict:
        owes = debt > 0.0
        if not owes:  # but once they meet it may be the earlier one
            back = slack_of(m.physics, m.slack, r.half_inertia_kg, m.links, ahead, b.entry, a.entry)
            owes = back.time_s > a.entry.time_s - b.entry.time_s
        if owes:
            slack = Slack(slack.energy_j, slack.time_s, max(slack.gain_j, safe_j - r.least_energy_j))
    return dominates_by(r, a.cost, a.energy_j, b.cost, b.energy_j, slack, debt, fade_frac)
