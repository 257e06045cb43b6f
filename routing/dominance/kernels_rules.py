"""Compiled: the rules of one search, and the bounds that its dominance rests on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from energy.compiled.kernels_borrow import borrowed

# advantages this small are rounding: without them a loss-free vehicle's labels, equal but for the last digits, would
# pile up
NOISE_J = 1e-6
NOISE_S = 1e-9
NOISE_COST = 1e-12
# columns of SearchRules.descent
DESCENT_J, DESCENT_MPS = range(2)
# rows of SlackRules.bounds, on what a difference of entry states can be worth while two drives have not met again;
# one column a speed interval of the vehicle, for drives that stay below its upper end (docs/search.md, lemma 6):
# least mean acceleration [m/s²]; distance until they meet, weighted and doubled [m]; what differing mean accelerations
# can add [J] and [s]; most that can be recuperated until they meet [J]
# DRIFT_S: time by which differing mean accelerations shift the same phase [s]
# The rest is the same in every column. NO_REGEN_MPS: speed below which braking gives nothing back, NO_REGEN_J: most
# that it costs to be slower than that. WARM_UP_W: most that cold tyres take at departure, WARM_LATE_W: most that
# warmer ones can cost instead, where losses grow with the square of the force, of which braking has then more;
# TYRE_TIME_S: they warm up in
LEAST_ACCEL, MEETING_DISTANCE, UNEVEN_J, UNEVEN_S, GAIN_J, DRIFT_S = range(6)
NO_REGEN_MPS, NO_REGEN_J, WARM_UP_W, WARM_LATE_W, TYRE_TIME_S = range(6, 11)
BOUNDS = 11


class SearchRules(NamedTuple):
    """Weights, limits and potential of one search.

    least_energy_j: −(1 − soc)·capacity, a full battery; most_energy_j: (soc − reserve)·capacity; ±inf when not held.
    cost = energy_weight·E + time_weight·t + distance_weight·s. alpha: of the potential, in [η_chg, 1/η_dis].
    half_inertia_kg: ½·m·d. limited: any battery limit is held. pareto: dominance needs cost and energy.
    correcting: reduced costs may be negative (printed model). descent: (M, 2), by link the most that ways on from its
    tail give back to an entry without speed [J], and the speed below which that isn't known [m/s]. Where cabin or tyres
    are to be paid from more charge, that counts only as far as that can't fill the battery. (0, 2): it
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


@njit(nogil=True, cache=True, inline="always")
def borrowed_search_rules(r: SearchRules) -> SearchRules:
    """The same rules with borrowed arrays."""
    return SearchRules(
        r.least_energy_j,
        r.most_energy_j,
        r.energy_weight,
        r.time_weight,
        r.distance_weight,
        r.alpha,
        r.half_inertia_kg,
        r.limited,
        r.pareto,
        r.correcting,
        r.label_limit,
        borrowed(r.descent),
    )


class SlackRules(NamedTuple):
    """The vehicle and its conditions as dominance sees them: bounds that hold on every link.

    drive_factor, recuperation_factor: greatest and least battery energy for a unit of work at the wheels.
    linear_n_per_mps, aero_n_per_mps2: greatest of all links, ≥ 0; sag_n: most that the road load falls with speed.
    power_w: most that standing about costs: auxiliaries and climate. cap_w: of recuperation, 0 for none. loss_w: most
    that losses growing with the square of force or power take. fade_width_j: charge over which the cap falls.
    cabin_start_w, cabin_time_s: the decaying part of the climate. printed, table: as in LinkPhysics. bounds: (11, K), a
    column a speed interval, rows as named above.
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
    bounds: NDArray[np.float64]


@njit(nogil=True, cache=True, inline="always")
def borrowed_slack_rules(q: SlackRules) -> SlackRules:
    """The same rules with borrowed arrays."""
    return SlackRules(
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
        borrowed(q.bounds),
    )
