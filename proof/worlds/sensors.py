"""What a logger in the car makes of a drive: rounded, noisy, late, once a second."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from proof.worlds.dynamics import AIR_C, AMPERE, BATTERY_C, CHARGE, HEADING_RAD, HEIGHT, PLACE, VOLT
from proof.worlds.loop import EARTH_M_PER_DEG
from proof.worlds.traffic import STEPS_PER_S, wander

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from proof.worlds.dynamics import WorldDrive
    from proof.worlds.loop import Loop
    from proof.worlds.trips import WorldTrip

Channels = dict[str, "NDArray[np.float64]"]
KMH_PER_MPS: Final = 3.6
ALWAYS: Final = ("time_s", "speed_kmh", "power_w", "elevation_m", "ambient_c", "soc_frac")
HEIGHT_NODE_M: Final = 90.0  # three arc seconds, the mesh of widely used terrain models
HEIGHT_MEMORY_M: Final = 700.0
PLACE_NOISE_M: Final = 3.0  # of a satellite fix in the open
VOLT_STEP: Final = 0.5
AMPERE_STEP: Final = 0.1
WET_FROM: Final = 0.3  # water at which a rain sensor calls the road wet


@dataclass(frozen=True, slots=True)
class Sensors:
    """How good a world's logger is; lag_s: power behind speed; gain: of the current sensor; *_step: rounding."""

    speed_sd_kmh: float
    speed_step_kmh: float
    lag_s: float
    gain: float
    height_sd_m: float
    height_step_m: float
    height_lag_s: int
    air_step_c: float


def draw_sensors(rng: np.random.Generator) -> Sensors:
    """A logger within what is usual; ranges assumed."""
    return Sensors(
        speed_sd_kmh=float(rng.uniform(0.1, 0.3)),
        speed_step_kmh=float(rng.choice([0.01, 0.1, 0.25])),
        lag_s=float(rng.integers(0, 6)) / STEPS_PER_S,
        gain=1.0 + float(rng.uniform(-0.01, 0.01)),
        height_sd_m=float(rng.uniform(0.2, 0.8)),
        height_step_m=float(rng.choice([0.1, 0.5, 1.0])),
        height_lag_s=int(rng.integers(0, 3)),
        air_step_c=float(rng.choice([0.1, 0.5, 1.0])),
    )


def recorded(
    rng: np.random.Generator, sensors: Sensors, loop: Loop, trip: WorldTrip, driven: WorldDrive, names: Collection[str]
) -> Channels:
    """The channels of these names, float64 (n,), one value a second; wind, load and water as they truly were."""
    seconds = driven.states.shape[0]
    states = driven.states
    day = trip.day
    node = states[:, PLACE]
    speed_kmh = speed_reading_kmh(rng, sensors, driven.speed_mps[::STEPS_PER_S])
    made: Channels = {
        "time_s": np.arange(seconds, dtype=np.float64),
        "speed_kmh": speed_kmh,
        "power_w": power_reading_w(rng, sensors, driven.power_w),
        "elevation_m": _height_reading_m(rng, sensors, states[:, HEIGHT], driven.speed_mps),
        "ambient_c": _rounded(states[:, AIR_C] + 0.3 * wander(rng, seconds, 400.0), sensors.air_step_c),
        "soc_frac": np.clip(_rounded(states[:, CHARGE], 0.005), 0.0, 1.0),
        "voltage_v": _rounded(states[:, VOLT] + rng.normal(0.0, 0.3, seconds), VOLT_STEP),
        "current_a": _rounded(sensors.gain * states[:, AMPERE] + rng.normal(0.0, 0.3, seconds), AMPERE_STEP),
        "battery_c": _rounded(states[:, BATTERY_C], 0.5),
        "heading_deg": (np.degrees(states[:, HEADING_RAD]) + rng.normal(0.0, 1.5, seconds)) % 360.0,
        "wind_speed_mps": np.full(seconds, day.wind_mps if trip.winds else day.breeze_mps),
        "wind_from_deg": np.degrees(np.full(seconds, day.wind_from_rad if trip.winds else day.breeze_from_rad)) % 360.0,
        "wet": (trip.chance.water[:seconds] > WET_FROM).astype(np.float64),
        "payload_kg": np.full(seconds, day.payload_kg),
    }
    at = np.arange(loop.latitude_deg.size + 1)
    north_deg = np.interp(node, at, np.append(loop.latitude_deg, loop.latitude_deg[0]))
    east_deg = np.interp(node, at, np.append(loop.longitude_deg, loop.longitude_deg[0]))
    east_scale = EARTH_M_PER_DEG * np.cos(np.radians(north_deg))
    made["lat"] = north_deg + PLACE_NOISE_M * wander(rng, seconds, 20.0) / EARTH_M_PER_DEG
    made["lon"] = east_deg + PLACE_NOISE_M * wander(rng, seconds, 20.0) / east_scale
    return {name: values for name, values in made.items() if name in names}


def speed_reading_kmh(
    rng: np.random.Generator, sensors: Sensors, speed_mps: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Noisy and rounded, but exactly 0 at standstill, where wheels give no pulses."""
    noisy = KMH_PER_MPS * speed_mps + rng.normal(0.0, sensors.speed_sd_kmh, speed_mps.size)
    return np.where(speed_mps > 0.0, np.maximum(_rounded(noisy, sensors.speed_step_kmh), 0.0), 0.0)


def power_reading_w(rng: np.random.Generator, sensors: Sensors, power_w: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over the second around each sample, late by the lag, with the current sensor's gain and noise."""
    late = round(sensors.lag_s * STEPS_PER_S)
    half = STEPS_PER_S // 2
    way = np.concatenate(([0.0], np.cumsum(power_w)))
    middle = np.arange(0, power_w.size, STEPS_PER_S) - late
    begin = np.clip(middle - half, 0, power_w.size - 1)
    end = np.clip(middle + half, begin + 1, power_w.size)
    mean_w = (way[end] - way[begin]) / (end - begin)
    return np.asarray(sensors.gain * mean_w + rng.normal(0.0, 25.0, mean_w.size), np.float64)


def _height_reading_m(
    rng: np.random.Generator, sensors: Sensors, height_m: NDArray[np.float64], speed_mps: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Height of a terrain model at the car's place: errs by the way driven, and stands still with the car."""
    way_m = np.cumsum(speed_mps)[::STEPS_PER_S] / STEPS_PER_S
    error = wander(rng, int(way_m[-1] / HEIGHT_NODE_M) + 2, HEIGHT_MEMORY_M / HEIGHT_NODE_M)
    late = np.maximum(np.arange(height_m.size) - sensors.height_lag_s, 0)
    noise = np.interp(way_m / HEIGHT_NODE_M, np.arange(error.size), error) + rng.normal()
    return _rounded((height_m + sensors.height_sd_m * noise)[late], sensors.height_step_m)


def _rounded(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    return np.asarray(np.rint(values / step) * step, np.float64)
