"""Speeds that traffic asks for along a loop: limits, braking ahead of lower ones, stops, and a wandering pace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

from proof.worlds.loop import STEP_M

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from proof.worlds.loop import Loop

STEPS_PER_S: Final = 10
TIME_STEP_S: Final = 1.0 / STEPS_PER_S
PARKING_S: Final = 25.0
PACE_SMOOTH_S: Final = 15


@dataclass(frozen=True, slots=True)
class Manners:
    """How one drive is driven: pace over the limit, accelerations, spread of the pace, standstill at stops.

    start_wait_s: before it sets off. long_wait_s: one long standstill on the way, 0 for none, and when.
    """

    pace: float = 1.0
    push_mps2: float = 1.5
    brake_mps2: float = 1.4
    pace_sd: float = 0.06
    wait_s: tuple[float, float] = (3.0, 45.0)
    start_wait_s: float = 10.0
    long_wait_s: float = 0.0
    long_wait_at_frac: float = 0.5


def speed_demand_mps(
    rng: np.random.Generator, loop: Loop, manners: Manners, begin_m: float, direction: int, duration_s: float
) -> NDArray[np.float64]:
    """Speed that traffic asks for from setting off to standing parked, float64 (n,) at TIME_STEP_S [m/s]."""
    nodes = round(begin_m / STEP_M) + direction * np.arange(loop.limit_mps.size)
    order = nodes % loop.limit_mps.size
    stops = rng.random(order.size) < loop.stop_chance[order]
    wait_s = np.where(stops, rng.uniform(*manners.wait_s, order.size), 0.0)
    limit = np.minimum(loop.limit_mps[order] * manners.pace, 150.0 / 3.6)
    seconds = int(duration_s) + 2
    return _speed_demand(
        limit,
        braked_mps(limit, manners.brake_mps2),
        wait_s,
        pace_wander(rng, seconds) * manners.pace_sd,
        manners.push_mps2,
        manners.brake_mps2,
        manners.start_wait_s,
        manners.long_wait_at_frac * duration_s if manners.long_wait_s > 0.0 else np.inf,
        manners.long_wait_s,
        duration_s,
    )


def wander(rng: np.random.Generator, seconds: int, memory_s: float) -> NDArray[np.float64]:
    """A random value that wanders about 0 with standard deviation 1, float64 (seconds,), one a second."""
    keep = float(np.exp(-1.0 / memory_s))
    return _wander(rng.normal(size=seconds), keep)


def pace_wander(rng: np.random.Generator, seconds: int) -> NDArray[np.float64]:
    """A wandering pace without jerks, float64 (seconds,): as a driver among others changes it over many seconds."""
    window = np.hanning(PACE_SMOOTH_S + 2)[1:-1]
    rough = wander(rng, seconds + PACE_SMOOTH_S - 1, 30.0)
    return np.convolve(rough, window / window.sum(), mode="valid")


@njit(nogil=True, cache=True)
def _wander(shocks: NDArray[np.float64], keep: float) -> NDArray[np.float64]:
    values = np.empty(shocks.size)
    level = shocks[0]
    fresh = np.sqrt(1.0 - keep * keep)
    for k in range(shocks.size):
        if k > 0:
            level = keep * level + fresh * shocks[k]
        values[k] = level
    return values


@njit(nogil=True, cache=True)
def braked_mps(limit: NDArray[np.float64], brake_mps2: float) -> NDArray[np.float64]:
    """Speeds from which all lower limits ahead are still met by braking, in the order that the nodes are driven."""
    allowed = limit.copy()
    for k in range(limit.size - 2, -1, -1):
        allowed[k] = min(limit[k], np.sqrt(allowed[k + 1] ** 2 + 2.0 * brake_mps2 * STEP_M))
    return allowed


@njit(nogil=True, cache=True)
def _speed_demand(
    limit: NDArray[np.float64],
    allowed: NDArray[np.float64],
    wait_s: NDArray[np.float64],
    pace: NDArray[np.float64],
    push_mps2: float,
    brake_mps2: float,
    start_wait_s: float,
    long_at_s: float,
    long_wait_s: float,
    duration_s: float,
) -> NDArray[np.float64]:
    n = int(duration_s * STEPS_PER_S)
    demand = np.zeros(n)
    at_m, speed, gain, rest_s = 0.0, 0.0, 0.0, start_wait_s
    stop_node = _next_stop(wait_s, 1)
    waited_long = False
    for k in range(n):
        now_s = k * TIME_STEP_S
        if rest_s > 0.0:
            rest_s -= TIME_STEP_S
            continue
        node = int(at_m / STEP_M) % limit.size
        target = allowed[node] * (1.0 + pace[int(now_s)])
        parking = now_s > duration_s - PARKING_S
        pausing = not waited_long and now_s > long_at_s
        if parking or pausing:
            target = 0.0
        remaining_m = stop_node * STEP_M - at_m
        if remaining_m < 400.0:
            target = min(target, np.sqrt(max(2.0 * brake_mps2 * (remaining_m - 1.0), 0.0)))
        wish = (target - speed) / 0.8
        most = push_mps2 * (1.0 - 0.6 * min(speed / 40.0, 1.0))
        wish = min(max(wish, -1.25 * brake_mps2), most)
        gain += (wish - gain) * TIME_STEP_S / 0.35
        before = speed
        speed = max(speed + gain * TIME_STEP_S, 0.0)
        at_m += 0.5 * (before + speed) * TIME_STEP_S
        demand[k] = speed
        if speed < 0.15 and (remaining_m < 3.0 or pausing or parking):
            speed, gain = 0.0, 0.0
            if parking:
                break
            if pausing:
                waited_long, rest_s = True, long_wait_s
            else:
                rest_s = wait_s[stop_node % limit.size]
                stop_node = _next_stop(wait_s, stop_node + 1)
        elif remaining_m < -3.0:
            stop_node = _next_stop(wait_s, node + 1)
    return demand


@njit(nogil=True, cache=True)
def _next_stop(wait_s: NDArray[np.float64], node: int) -> int:
    for k in range(node, node + wait_s.size):
        if wait_s[k % wait_s.size] > 0.0:
            return k
    return node + 2 * wait_s.size
