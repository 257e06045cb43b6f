"""Regulatory cycles over hills with noise, and power in them that the model does not know of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.causes.driven import driven
from diagnosis.recordings.reading import Recording
from energy.replay.replay import replay
from energy.vehicle.self_check import bundled_cycle


def drive(car, number, more_w=None, ambient_c=None, stands_s=0):
    """A regulatory cycle at a pace of its own over hills, with noise, and power that the model does not know of.

    stands_s: before it begins to move.
    """
    rng = np.random.default_rng(number)
    speed = bundled_cycle("udds" if number % 2 else "hwfet").speed_mps * rng.uniform(0.8, 1.1)
    speed = np.concatenate((np.zeros(stands_s), speed))
    time = np.arange(speed.size, dtype=float)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
    height = 500.0 + 40.0 * np.sin(way / rng.uniform(400.0, 1500.0))
    ambient_c = float(rng.uniform(-8.0, 30.0)) if ambient_c is None else ambient_c
    plain = Recording(
        f"T{number}",
        time,
        speed,
        np.zeros_like(time),
        elevation_m=height,
        ambient_k=np.full(time.size, 273.15 + ambient_c),
    )
    power = replay(car, plain.profile()).power_w
    at = np.concatenate(([power[0]], 0.5 * (power[1:] + power[:-1]), [power[-1]]))
    at = at * rng.normal(1.0, 0.02, at.size) + rng.normal(40.0 * rng.normal(), 60.0, at.size)
    if more_w is not None:
        at = at + more_w(time, ambient_c, plain, driven(plain, car))
    return replace(plain, power_w=at)


def heater(time, ambient_c, plain, steps):
    del plain, steps
    return 130.0 * max(20.0 - ambient_c, 0.0) * (0.4 + 0.6 * np.exp(-time / 400.0)) + 0.0 * time
