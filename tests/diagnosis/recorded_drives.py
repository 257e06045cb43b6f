"""A drive with known physics, to be written in each format of recordings and spoilt in each way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MASS_KG = 1500.0
LAT_DEG, LON_DEG = 48.0, 11.0
M_PER_DEG = 111_194.93  # on a sphere of 6371.0088 km


@dataclass(frozen=True)
class RecordedDrive:
    """Channels of a car that gains 20 m/s in 20 s, holds it for 30 s, brakes in 10 s and stands for 20 s, and again."""

    time_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    power_w: NDArray[np.float64]
    lat_deg: NDArray[np.float64]
    lon_deg: NDArray[np.float64]


def drive(duration_s: float = 800.0, step_s: float = 1.0) -> RecordedDrive:
    """Ten rounds in 800 s, eastward: 1500 kg, 600 N of drag while driving, 400 W always, nothing lost."""
    time_s = np.arange(0.0, duration_s, step_s)
    phase = time_s % 80.0
    speed = np.interp(phase, [0.0, 20.0, 50.0, 60.0, 80.0], [0.0, 20.0, 20.0, 0.0, 0.0])
    power = speed * (MASS_KG * np.gradient(speed, step_s) + 600.0) + 400.0
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step_s)))
    lon = LON_DEG + way / (M_PER_DEG * np.cos(np.radians(LAT_DEG)))
    return RecordedDrive(time_s, speed, power, np.full(time_s.size, LAT_DEG), lon)


def plain_csv(driven: RecordedDrive, **columns: NDArray[np.float64] | list[str]) -> str:
    """joulepath's own columns of a drive; each further column is added, or takes the place of one of the same name."""
    own: dict[str, NDArray[np.float64] | list[str]] = {
        "time_s": driven.time_s,
        "speed_kmh": driven.speed_mps * 3.6,
        "power_w": driven.power_w,
    }
    table = own | columns
    rows = zip(*table.values(), strict=True)
    lines = [
        ",".join(table),
        *(",".join(cell if isinstance(cell, str) else f"{cell:.9g}" for cell in row) for row in rows),
    ]
    return "\n".join(lines) + "\n"
