"""Bounds on what a difference of entry states can be worth, for a vehicle under given conditions (docs/search.md)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.force import kernels_physics
from routing.dominance import kernels_rules, kernels_slack
from routing.dominance.kernels_rules import SlackRules

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from energy.force.kernels_physics import LinkPhysics

SLOW_MPS: Final = 3.0  # below it a difference of drag is too small to matter to losses


def slack_rules(physics: LinkPhysics, roads: NDArray[np.float64], driven_mps: NDArray[np.float64]) -> SlackRules:
    """The vehicle as dominance sees it: bounds on what a difference of states can cost that hold on every link.

    Those for each speed interval are slack_bounds, which start from these; here the table is empty.
    """
    linear, aero = roads[:, kernels_physics.ROAD_LINEAR], roads[:, kernels_physics.ROAD_AERO]
    wind = roads[:, kernels_physics.ROAD_WIND]
    sag = _sag_n(linear, aero, wind, driven_mps)
    cold = roads[:, kernels_physics.ROAD_WARM_UP]
    drive, loss_w = physics.drive_factor, 0.0
    if physics.loss_per_n2 > 0.0 or physics.loss_per_w > 0.0:
        accel = np.diff(physics.accel_sum)
        load = np.maximum(roads[:, kernels_physics.ROAD_ROLLING] + cold + linear * driven_mps, 0.0)
        load += aero * (driven_mps + np.abs(wind)) ** 2 + physics.weight_n * np.abs(
            roads[:, kernels_physics.ROAD_GRADE]
        )
        gaining = (accel * np.minimum(physics.speed_bound_mps[1:], driven_mps[:, None])).max(axis=1)
        power_w = float((load * driven_mps + physics.inertia_kg * gaining).max()) * drive + physics.aux_move_w
        force_n = float(load.max()) + physics.inertia_kg * float(accel.max())
        loss_w = physics.loss_per_n2 * force_n**2 + physics.loss_per_w * power_w**2
        drive = drive * (1.0 + 2.0 * physics.loss_per_w * power_w) + 2.0 * physics.loss_per_n2 * force_n / SLOW_MPS
    capped = math.isfinite(physics.regen_cap_w)
    return SlackRules(
        drive_factor=drive,
        recuperation_factor=0.0 if capped or physics.regen_min_mps > 0.0 else physics.recuperation_factor,
        linear_n_per_mps=max(float((linear + 2.0 * aero * np.abs(wind)).max()), 0.0),
        aero_n_per_mps2=max(float(aero.max()), 0.0),
        sag_n=float(sag.max()),
        power_w=physics.aux_move_w + physics.cabin_w + physics.cabin_start_w,
        cap_w=physics.regen_cap_w if capped else 0.0,
        loss_w=loss_w,
        fade_width_j=physics.fade_width_j,
        cabin_start_w=physics.cabin_start_w,
        cabin_time_s=physics.cabin_time_s,
        speed_bound_mps=physics.speed_bound_mps,
        accel_sum=physics.accel_sum,
        printed=physics.printed,
        table=physics.table,
        bounds=np.empty((kernels_rules.BOUNDS, 0)),
    )


def least_load_n(physics: LinkPhysics, roads: NDArray[np.float64], driven_mps: NDArray[np.float64]) -> float:
    """Least road load of all links at the speeds driven on them [N]; below 0 lemma 1 does not hold.

    Vehicles are checked for it, but for no wind, for speeds up to 200 km/h and grades up to 31 %. Wind from behind
    takes the load no further than to 0, and cold tyres only add to it.
    """
    if physics.table:
        return 0.0
    aero, wind = roads[:, kernels_physics.ROAD_AERO], roads[:, kernels_physics.ROAD_WIND]
    ahead = np.maximum(wind, 0.0)
    b = roads[:, kernels_physics.ROAD_LINEAR] + 2.0 * aero * ahead
    vertex = np.divide(-b, 2.0 * aero, out=np.zeros_like(aero), where=aero > 0.0)
    at_mps = np.stack((np.zeros_like(aero), driven_mps, np.clip(vertex, 0.0, driven_mps)))
    load = roads[:, kernels_physics.ROAD_ROLLING] + aero * ahead**2 + (b + aero * at_mps) * at_mps
    return float(np.where(wind < 0.0, 0.0, load).min())


def _sag_n(
    linear: NDArray[np.float64], aero: NDArray[np.float64], wind: NDArray[np.float64], driven_mps: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Most that the road load of each link falls from one speed to a higher one, float64 (n,) [N]."""
    ahead, behind = np.maximum(wind, 0.0), np.maximum(-wind, 0.0)
    b = linear + 2.0 * np.minimum(aero, 0.0) * ahead
    # it falls from 0 to the vertex, or where drag falls with speed from the vertex to the driven speed
    vertex = np.clip(np.divide(-b, 2.0 * aero, out=np.zeros_like(aero), where=aero != 0.0), 0.0, driven_mps)
    high = np.where(aero > 0.0, 0.0, vertex)
    low = np.where(aero > 0.0, vertex, driven_mps)
    sag = np.maximum((b + aero * high) * high - (b + aero * low) * low, 0.0)
    if bool((behind > 0.0).any()):
        sag = 2.0 * sag  # where the air comes from behind the drag falls as fast again
        sag += np.maximum(-aero, 0.0) * (behind**2 + (driven_mps + behind) ** 2)
    return sag


def warm_up_w(
    physics: LinkPhysics, slack: SlackRules, roads: NDArray[np.float64], driven_mps: NDArray[np.float64]
) -> tuple[float, float]:
    """Most that tyres cold as at departure take, and most that warm ones can cost instead [W] (lemma 8)."""
    cold_w = float(roads[:, kernels_physics.ROAD_WARM_UP].max()) * float(driven_mps.max())
    return slack.drive_factor * cold_w, (slack.drive_factor - physics.drive_factor) * cold_w


def _no_regen_j(physics: LinkPhysics, roads: NDArray[np.float64]) -> float:
    """Most that braking could give back at speeds at which it doesn't: downhill while gaining the speed, and of it."""
    v2 = physics.regen_min_mps**2
    steepest_n = physics.weight_n * float(np.abs(roads[:, kernels_physics.ROAD_GRADE]).max())
    gaining_m = v2 / (2.0 * float(np.diff(physics.accel_sum).min()))
    return physics.recuperation_factor * (steepest_n * gaining_m + 0.5 * physics.inertia_kg * v2)


def slack_bounds(
    physics: LinkPhysics,
    slack: SlackRules,
    half_inertia_kg: float,
    roads: NDArray[np.float64],
    driven_mps: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Bounds on differences between drives that have not met yet, for each speed interval (docs/search.md, lemma 6)."""
    fastest_mps = float(driven_mps.max())
    steepest_frac = float(np.abs(roads[:, kernels_physics.ROAD_GRADE]).max())
    bound, running = physics.speed_bound_mps, physics.accel_sum
    n = bound.size - 1
    mean = np.array(
        [[(running[k + 1] - running[i]) / (k + 1 - i) if i <= k else np.inf for k in range(n)] for i in range(n)]
    )
    c, b = slack.aero_n_per_mps2, slack.linear_n_per_mps
    least, distance, uneven_j, uneven_s, gain, drift = (np.empty(n) for _ in range(6))
    for k in range(n):
        top = fastest_mps if k == n - 1 else float(bound[k + 1])
        least[k] = mean[: k + 1, : k + 1].min()
        distance[k] = 2.0 * top**2 / (2.0 * least[k])
        ratio, overshoot = _swing(mean, bound, k, top)
        swing = 2.0 * ratio * top**2
        uneven_s[k] = 2.0 * kernels_slack.LOST_TIME_COEF * math.sqrt(overshoot) / least[k]
        uneven_j[k] = (slack.drive_factor - slack.recuperation_factor) * half_inertia_kg * swing
        # on the way they may be as far apart as one link can drive them, before that is made good again
        uneven_j[k] += slack.recuperation_factor * half_inertia_kg * overshoot
        uneven_j[k] += slack.drive_factor * distance[k] * (c * overshoot + b * math.sqrt(overshoot) + slack.sag_n)
        gain[k] = physics.recuperation_factor * (
            physics.weight_n * steepest_frac * distance[k] + half_inertia_kg * top**2
        )
        drift[k] = 2.0 * ratio * top / least[k]
    same = (physics.regen_min_mps, _no_regen_j(physics, roads), *warm_up_w(physics, slack, roads, driven_mps))
    rest = np.repeat([[*same, physics.tyre_time_s]], n, axis=0).T
    return np.ascontiguousarray(np.vstack((least, distance, uneven_j, uneven_s, gain, drift, rest)))


def _swing(mean: NDArray[np.float64], bound: NDArray[np.float64], k: int, top: float) -> tuple[float, float]:
    """How differing mean accelerations can push two drives past each other or apart, up to speed interval k.

    Returns the largest relative difference of accelerations that does, and the largest difference of v² [m²/s²] that
    one link can build up.
    """
    ratio, apart2 = 0.0, 0.0
    for limit in range(k + 1):
        limit2 = min(float(bound[limit + 1]), top) ** 2 if limit < k else top**2
        for slow in range(limit + 1):
            for fast in range(slow + 1, limit + 1):
                a_slow, a_fast = mean[slow, limit], mean[fast, limit]
                slow2, fast2 = float(bound[slow + 1]) ** 2, float(bound[fast]) ** 2
                if a_slow < a_fast:  # the faster one accelerates harder: they drift apart, and back again
                    ratio = max(ratio, 2.0 * (a_fast - a_slow) / a_slow)
                    apart2 = top**2
                    continue
                overshoot = limit2 * (1.0 - a_fast / a_slow) - fast2 + slow2 * a_fast / a_slow
                if overshoot > 0.0:
                    ratio = max(ratio, (a_slow - a_fast) / a_fast)
                    apart2 = max(apart2, overshoot)
    return ratio, apart2
