"""Recorded drives made by replaying a bundled car along drawn speeds, with a heater that the model knows nothing of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from energy.replay.replay import DrivenProfile, replay
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from energy.vehicle.vehicle import Vehicle

HEATER_W_PER_K: Final = 150.0
CABIN_C: Final = 21.0
NOISE_W: Final = 100.0


def drawn_speed_mps(random: np.random.Generator, duration_s: int) -> NDArray[np.float64]:
    """Speed at each second, float64 (duration_s,): from stop to stop, each stretch with its own top speed."""
    parts: list[NDArray[np.float64]] = []
    while sum(part.size for part in parts) < duration_s:
        top = float(random.uniform(6.0, 33.0))
        rise, fall = float(random.uniform(0.6, 1.4)), float(random.uniform(0.7, 1.6))
        parts += [
            np.arange(0.0, top, rise),
            top + 0.4 * np.sin(0.2 * np.arange(int(random.integers(20, 90)))),
            np.arange(top, 0.0, -fall),
            np.zeros(int(random.integers(5, 40))),
        ]
    return np.clip(np.concatenate(parts)[:duration_s], 0.0, None)


def write_recording(
    path: Path, vehicle: Vehicle, *, ambient_c: float, seed: int, duration_s: int = 600, heater: bool = True
) -> Path:
    """Write one drive as joulepath's own CSV, and return its path.

    heater: 150 W for each kelvin below 21 °C, standing still too, that the vehicle's model does not have.
    """
    random = np.random.default_rng(seed)
    speed_mps = drawn_speed_mps(random, duration_s)
    time_s = np.arange(float(speed_mps.size))
    driven = replay(vehicle, DrivenProfile(time_s, speed_mps))
    power_w = np.append(driven.power_w, driven.power_w[-1]) + random.normal(0.0, NOISE_W, time_s.size)
    if heater:
        power_w += HEATER_W_PER_K * max(CABIN_C - ambient_c, 0.0)
    lines = [
        f"{time:.0f},{speed * KMH_PER_MPS:.3f},{power:.1f},{ambient_c:.1f}"
        for time, speed, power in zip(time_s, speed_mps, power_w, strict=True)
    ]
    path.write_text("\n".join(["time_s,speed_kmh,power_w,ambient_c", *lines]) + "\n", encoding="utf-8")
    return path


def write_winter(folder: Path, vehicle: Vehicle, trips: int = 10, duration_s: int = 600) -> list[Path]:
    """Write drives between −12 and +18 °C into a folder: winter-00.csv and so on."""
    folder.mkdir(parents=True, exist_ok=True)
    warmth_c = np.linspace(-12.0, 18.0, trips)
    return [
        write_recording(
            folder / f"winter-{k:02d}.csv", vehicle, ambient_c=float(warmth_c[k]), seed=k, duration_s=duration_s
        )
        for k in range(trips)
    ]
