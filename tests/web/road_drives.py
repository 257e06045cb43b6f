"""Recorded drives along the line of a route, with a heater that the model knows nothing of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from energy.replay.replay import DrivenProfile, replay
from energy.units import KMH_PER_MPS
from routing.graph.earth import great_circle_m
from tests.app.recorded import CABIN_C, HEATER_W_PER_K, NOISE_W, drawn_speed_mps

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from energy.vehicle.vehicle import Vehicle


def write_road_drives(folder: Path, car: Vehicle, line: Sequence[Sequence[float]], drives: int = 10) -> None:
    """Write drives of at most ten minutes from the begin of a line [lon, lat] on, from −12 to +18 °C: road-00.csv …"""
    folder.mkdir(parents=True, exist_ok=True)
    lon, lat = np.asarray(line, np.float64).T
    ends_m = np.concatenate(([0.0], np.cumsum(great_circle_m(lat[:-1], lon[:-1], lat[1:], lon[1:]))))
    for k, ambient_c in enumerate(np.linspace(-12.0, 18.0, drives)):
        random = np.random.default_rng(k)
        speed_mps = 0.4 * drawn_speed_mps(random, 600)
        way_m = np.concatenate(([0.0], np.cumsum(0.5 * (speed_mps[:-1] + speed_mps[1:]))))
        kept = way_m < ends_m[-1]
        speed_mps, way_m = speed_mps[kept], way_m[kept]
        time_s = np.arange(float(speed_mps.size))
        power_w = replay(car, DrivenProfile(time_s, speed_mps)).power_w
        power_w = np.append(power_w, power_w[-1]) + random.normal(0.0, NOISE_W, time_s.size)
        power_w += HEATER_W_PER_K * max(CABIN_C - float(ambient_c), 0.0)
        at_lat, at_lon = (np.interp(way_m, ends_m, degrees) for degrees in (lat, lon))
        rows = [
            f"{t:.0f},{v * KMH_PER_MPS:.3f},{p:.1f},{ambient_c:.1f},{y:.7f},{x:.7f}"
            for t, v, p, y, x in zip(time_s, speed_mps, power_w, at_lat, at_lon, strict=True)
        ]
        text = "\n".join(["time_s,speed_kmh,power_w,ambient_c,lat,lon", *rows])
        (folder / f"road-{k:02d}.csv").write_text(text + "\n", encoding="utf-8")
