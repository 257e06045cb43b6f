"""Drives along the southern street of the hand-made grid, with a consumer on its eastern half that no model knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from energy.replay.replay import DrivenProfile, replay
from energy.units import KMH_PER_MPS
from routing.graph.earth import METRE_PER_DEGREE
from tests.app.conftest import SOUTH, SPACING_DEG, WEST

if TYPE_CHECKING:
    from pathlib import Path

    from energy.vehicle.vehicle import Vehicle

CONSUMER_W: Final = 2000.0
MIDDLE_DEG: Final = WEST + SPACING_DEG  # longitude of the crossing at half way
FIRST_DEG: Final = WEST + 0.1 * SPACING_DEG
COLUMNS: Final = "time_s,speed_kmh,power_w"


def write_street_drive(
    path: Path, car: Vehicle, *, top_kmh: float = 36.0, begin_s: float = 0.0, positions: bool = True
) -> None:
    """Write a drive of 1.4 km from west to east, a row a second, whose clock begins at begin_s."""
    top_mps = top_kmh / KMH_PER_MPS
    speed = np.concatenate(
        (np.arange(0.0, top_mps, 1.0), np.full(int(1300.0 / top_mps), top_mps), np.arange(top_mps, 0.0, -1.0), [0.0])
    )
    time_s = np.arange(float(speed.size))
    way_m = np.concatenate(([0.0], np.cumsum(0.5 * (speed[:-1] + speed[1:]))))
    lon = FIRST_DEG + way_m / (METRE_PER_DEGREE * np.cos(np.radians(SOUTH)))
    steps_w = replay(car, DrivenProfile(time_s, speed)).power_w
    around_w = np.concatenate((steps_w[:1], steps_w, steps_w[-1:]))
    power = 0.5 * (around_w[1:] + around_w[:-1]) + CONSUMER_W * (lon > MIDDLE_DEG)
    rows = [
        f"{begin_s + t:.0f},{v * KMH_PER_MPS:.3f},{p:.1f}" + (f",{SOUTH},{x:.7f}" if positions else "")
        for t, v, p, x in zip(time_s, speed, power, lon, strict=True)
    ]
    header = COLUMNS + (",lat,lon" if positions else "")
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
