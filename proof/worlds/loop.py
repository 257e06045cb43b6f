"""The road that all drives of a world share: a closed loop with heights, directions, limits and crossings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

STEP_M: Final = 10.0
EARTH_M_PER_DEG: Final = 111_195.0  # mean length of a degree of latitude, radius 6371 km
HILL_M: Final = (700.0, 12_000.0)  # wavelengths: roads are built smooth over hundreds of metres


@dataclass(frozen=True, slots=True)
class LoopTerrain:
    """How high and how hilly: mean height, difference of height around the loop, grade of its hills (sd)."""

    height_m: float = 150.0
    rise_m: float = 80.0
    grade_sd: float = 0.014


@dataclass(frozen=True, slots=True)
class Zone:
    """A stretch of one character: limit, mean distance of crossings, chance to stop at one."""

    limit_kmh: tuple[float, ...]
    crossing_m: float
    stop_chance: float


ZONES: Final = {
    "urban": Zone((30.0, 50.0, 50.0), 280.0, 0.4),
    "rural": Zone((70.0, 80.0, 100.0), 1800.0, 0.4),
    "motorway": Zone((110.0, 120.0, 130.0), 1e9, 0.0),
}


@dataclass(frozen=True, slots=True)
class Loop:
    """Float64 (n,) along the loop every STEP_M: height, limit, chance to stop there, place and direction.

    grade: sin θ at each node in the sense of the loop. east, north: direction in that sense. The node after the last
    is the first again, which a drive along an open road never reaches.
    """

    height_m: NDArray[np.float64]
    grade: NDArray[np.float64]
    limit_mps: NDArray[np.float64]
    stop_chance: NDArray[np.float64]
    latitude_deg: NDArray[np.float64]
    longitude_deg: NDArray[np.float64]
    east: NDArray[np.float64]
    north: NDArray[np.float64]

    @property
    def length_m(self) -> float:
        """Once around [m]."""
        return STEP_M * self.height_m.size


def draw_loop(
    rng: np.random.Generator, mix: tuple[float, float, float], terrain: LoopTerrain, steady_kmh: float | None = None
) -> Loop:
    """A loop of 70 to 110 km with shares of urban, rural and motorway; steady_kmh: one limit, no crossing at all."""
    n = int(rng.uniform(7000, 11000))
    limit, chance = _zones(rng, n, mix)
    if steady_kmh is not None:
        limit[:], chance[:] = steady_kmh / 3.6, 0.0
    height, grade = _heights(rng, n, terrain)
    latitude, longitude, east, north = _course(rng, n)
    return Loop(height, grade, limit, chance, latitude, longitude, east, north)


def _zones(
    rng: np.random.Generator, n: int, mix: tuple[float, float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    limit, chance = np.zeros(n), np.zeros(n)
    names = tuple(ZONES)
    lengths_m = {"urban": (2000.0, 6000.0), "rural": (3000.0, 10_000.0), "motorway": (8000.0, 20_000.0)}
    covered = dict.fromkeys(names, 0.0)
    begin = 0
    while begin < n:
        # the zone that lags most behind its share comes next, so that the mix holds on every loop
        wanted = {name: share * (begin + 1.0) - covered[name] for name, share in zip(names, mix, strict=True)}
        name = max(
            (zone_name for zone_name, share in zip(names, mix, strict=True) if share > 0.0), key=wanted.__getitem__
        )
        end = min(n, begin + int(rng.uniform(*lengths_m[name]) / STEP_M))
        covered[name] += end - begin
        zone = ZONES[name]
        limit[begin:end] = rng.choice(zone.limit_kmh) / 3.6
        at = begin + 3
        while zone.stop_chance > 0.0 and at < end:
            chance[at] = zone.stop_chance
            at += max(6, int(rng.gamma(4.0, zone.crossing_m / 4.0) / STEP_M))
        begin = end
    return limit, chance


def _heights(rng: np.random.Generator, n: int, terrain: LoopTerrain) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Hills as a random sum of waves that close around the loop, on one long rise and fall."""
    length_m = n * STEP_M
    at = np.arange(n) * STEP_M
    waves = np.unique(np.rint(length_m / np.geomspace(*HILL_M, 40)).astype(np.int64))
    steepness = rng.normal(size=waves.size) * np.sqrt(np.minimum(length_m / waves / 3000.0, 1.0))
    phase = rng.uniform(0.0, 2.0 * np.pi, waves.size)
    angle = 2.0 * np.pi * np.outer(at, waves) / length_m + phase
    slope = np.cos(angle) @ steepness
    scale = terrain.grade_sd / float(slope.std())
    height = scale * (np.sin(angle) @ (steepness * length_m / (2.0 * np.pi * waves)))
    height += 0.5 * terrain.rise_m * np.sin(2.0 * np.pi * at / length_m + rng.uniform(0.0, 2.0 * np.pi))
    height += terrain.height_m - height.mean()
    slope = (np.roll(height, -1) - np.roll(height, 1)) / (2.0 * STEP_M)
    return height, slope / np.sqrt(1.0 + slope * slope)


def _course(
    rng: np.random.Generator, n: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """A dented circle, walked at equal steps: latitude, longitude, and the direction's east and north part."""
    angle = np.linspace(0.0, 2.0 * np.pi, 20 * n, endpoint=False)
    radius = np.ones_like(angle)
    for wave in range(2, 15):
        radius += rng.normal() * 0.5 / wave**1.5 * 0.35 * np.cos(wave * angle + rng.uniform(0.0, 2.0 * np.pi))
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    way = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x, append=x[0]), np.diff(y, append=y[0])))))
    at = np.arange(n) * way[-1] / n
    scale = n * STEP_M / way[-1]
    x = scale * np.interp(at, way, np.append(x, x[0]))
    y = scale * np.interp(at, way, np.append(y, y[0]))
    east, north = np.roll(x, -1) - np.roll(x, 1), np.roll(y, -1) - np.roll(y, 1)
    norm = np.hypot(east, north)
    middle_deg = float(rng.uniform(44.0, 54.0))
    latitude = middle_deg + y / EARTH_M_PER_DEG
    longitude = float(rng.uniform(2.0, 20.0)) + x / (EARTH_M_PER_DEG * np.cos(np.radians(middle_deg)))
    return latitude, longitude, east / norm, north / norm
