"""The drives of a world before they are driven: route, weather, load, and what the day brings by chance."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from proof.worlds.dynamics import Chance, Circumstances, WorldWay
from proof.worlds.loop import Loop, LoopTerrain
from proof.worlds.traffic import STEPS_PER_S, Manners, speed_demand_mps, wander

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

FOOT_SD_MPS2: Final = 0.05
CABIN_COOLS_MIN: Final = 25.0
TYRE_COOLS_MIN: Final = 30.0
PAUSE_MIN: Final = (10.0, 25.0)


@dataclass(frozen=True, slots=True)
class WorldRegime:
    """What the drives of a world have in common.

    mix: shares of urban, rural and motorway. steady_kmh: one speed throughout. minutes: of a drive. air_c: spread
    over the drives. waits_s: standstill at a stop. long_wait_chance, long_wait_s: of one long standstill.
    restart_chance: of a drive that follows another after a pause. roof_share, payload_share: of drives with such a
    load. together: all drives begin within some kilometres, so that they come by the same places.
    """

    mix: tuple[float, float, float] = (0.3, 0.4, 0.3)
    steady_kmh: float | None = None
    terrain: LoopTerrain = field(default_factory=LoopTerrain)
    minutes: tuple[float, float] = (12.0, 32.0)
    air_c: tuple[float, float] = (-10.0, 35.0)
    waits_s: tuple[float, float] = (3.0, 50.0)
    start_wait_s: tuple[float, float] = (5.0, 45.0)
    long_wait_chance: float = 0.25
    long_wait_s: tuple[float, float] = (60.0, 240.0)
    restart_chance: float = 0.3
    roof_share: float = 1.0 / 3.0
    payload_share: float = 0.5
    together: bool = False


@dataclass(frozen=True, slots=True)
class WorldTrip:
    """One drive to be driven; winds: whether the day's wind blew, else only its breeze did."""

    id: str
    day: Circumstances
    chance: Chance
    demand_mps: NDArray[np.float64]
    winds: bool = True


def way_of(loop: Loop) -> WorldWay:
    """The loop as the compiled drive reads it."""
    return WorldWay(loop.height_m, loop.grade, loop.latitude_deg, loop.longitude_deg, loop.east, loop.north)


def draw_trips(
    seeds: np.random.SeedSequence, loop: Loop, regime: WorldRegime, count: int, first: int = 1
) -> tuple[WorldTrip, ...]:
    """Drives numbered from `first` on, each from a seed of its own, with air temperatures spread evenly."""
    common, *own = seeds.spawn(count + 1)
    rng = np.random.default_rng(common)
    low, high = regime.air_c
    air_c = low + (high - low) * (rng.permutation(count) + rng.uniform(size=count)) / count
    home = int(rng.integers(loop.height_m.size))
    return tuple(
        _draw_trip(np.random.default_rng(seed), f"T{first + k:03d}", loop, regime, float(air_c[k]), home)
        for k, seed in enumerate(own)
    )


def _draw_trip(
    rng: np.random.Generator, name: str, loop: Loop, regime: WorldRegime, air_c: float, home: int
) -> WorldTrip:
    duration_s = 60.0 * float(rng.uniform(*regime.minutes))
    direction = 1 if rng.random() < 0.5 else -1
    begin_m = 10.0 * float(rng.integers(loop.height_m.size))
    if regime.together:
        begin_m = 10.0 * home + direction * float(rng.uniform(-6000.0, 500.0))
    long = rng.random() < regime.long_wait_chance
    manners = Manners(
        pace=float(rng.uniform(0.92, 1.04)),
        push_mps2=float(rng.uniform(1.1, 2.0)),
        brake_mps2=float(rng.uniform(1.0, 1.7)),
        pace_sd=float(rng.uniform(0.03, 0.08)),
        wait_s=regime.waits_s,
        start_wait_s=float(rng.uniform(*regime.start_wait_s)),
        long_wait_s=float(rng.uniform(*regime.long_wait_s)) if long else 0.0,
        long_wait_at_frac=float(rng.uniform(0.3, 0.75)),
    )
    demand = speed_demand_mps(rng, loop, manners, begin_m, direction, duration_s)
    day = draw_day(rng, regime, air_c, begin_m, direction)
    return WorldTrip(name, day, draw_chance(rng, demand.size), demand)


def draw_day(
    rng: np.random.Generator, regime: WorldRegime, air_c: float, begin_m: float, direction: int
) -> Circumstances:
    """Weather, load and states at departure; a drive that follows another begins warm."""
    sun = float(rng.uniform(0.0, 250.0 + 20.0 * max(air_c, 0.0)))
    cabin = air_c + 0.012 * sun * float(rng.uniform(0.3, 1.0))
    furnishing, tyre, battery = cabin, air_c, air_c + float(rng.uniform(0.0, 6.0))
    if rng.random() < regime.restart_chance:
        pause_min = float(rng.uniform(*PAUSE_MIN))
        kept = float(np.exp(-pause_min / CABIN_COOLS_MIN))
        cabin += kept * (21.0 - cabin)
        furnishing += kept * (19.5 - furnishing)
        tyre += float(rng.uniform(12.0, 26.0)) * float(np.exp(-pause_min / TYRE_COOLS_MIN))
        battery += float(rng.uniform(2.0, 5.0))
    return Circumstances(
        air_c=air_c,
        air_rise_c_per_h=float(rng.normal(0.0, 0.6)),
        sun_w_per_m2=sun,
        humidity=float(rng.uniform(0.3, 0.9)),
        wind_mps=float(rng.gamma(4.0, 0.25)) * 6.0,
        wind_from_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        breeze_mps=abs(float(rng.normal(0.0, 0.7))),
        breeze_from_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        payload_kg=float(rng.uniform(100.0, 400.0)) if rng.random() < regime.payload_share else 0.0,
        roof_box=float(rng.random() < regime.roof_share),
        road_load_factor=1.0 + float(np.clip(rng.normal(0.0, 0.015), -0.04, 0.04)),
        aux_offset_w=float(rng.normal(0.0, 50.0)),
        charge_start=float(rng.uniform(0.7, 0.97)),
        cabin_start_c=cabin,
        furnishing_start_c=furnishing,
        tyre_start_c=tyre,
        battery_start_c=battery,
        begin_m=begin_m,
        direction=float(direction),
    )


def draw_chance(rng: np.random.Generator, steps: int) -> Chance:
    """What wanders during a drive, a value a second and one beyond its end."""
    seconds = steps // STEPS_PER_S + 2
    foot = FOOT_SD_MPS2 * wander(rng, seconds, 3.0)
    gust = 0.2 * wander(rng, seconds, 8.0)
    aux_w = 35.0 * wander(rng, seconds, 180.0)
    return Chance(foot, gust, aux_w, _water(rng, seconds))


def _water(rng: np.random.Generator, seconds: int) -> NDArray[np.float64]:
    """Water on the road [0..1]: none on most days, else rain throughout, or a shower and its slow drying."""
    at = np.arange(seconds, dtype=np.float64)
    kind = rng.random()
    if kind < 0.55:
        return np.zeros(seconds)
    if kind < 0.75:
        return np.clip(0.75 + 0.15 * wander(rng, seconds, 300.0), 0.45, 1.0)
    begin_s = float(rng.uniform(-0.2, 0.6)) * seconds
    end_s = begin_s + float(rng.uniform(240.0, 700.0))
    rising = np.clip((at - begin_s) / 60.0, 0.0, 1.0)
    drying = np.exp(-np.maximum(at - end_s, 0.0) / 300.0)
    return np.asarray(rising * drying, np.float64)


def acted_on(effect: str, trips: Iterable[WorldTrip]) -> tuple[str, ...]:
    """The trips that an effect acts on where it is a load of single trips; none named for all others."""
    if effect == "roof_box":
        return tuple(trip.id for trip in trips if trip.day.roof_box > 0.0)
    if effect in ("payload_known", "payload_unknown"):
        return tuple(trip.id for trip in trips if trip.day.payload_kg > 0.0)
    return ()


def loaded(trips: tuple[WorldTrip, ...], payload: float, wind: float, wet: float) -> tuple[WorldTrip, ...]:
    """The trips with load and wind as strong as they were in truth, and dry where no water acted: what sensors see."""
    seen = []
    for trip in trips:
        day = trip.day._replace(payload_kg=payload * trip.day.payload_kg, wind_mps=wind * trip.day.wind_mps)
        chance = trip.chance if wet > 0.0 else trip.chance._replace(water=np.zeros_like(trip.chance.water))
        seen.append(replace(trip, day=day, chance=chance, winds=wind > 0.0))
    return tuple(seen)
