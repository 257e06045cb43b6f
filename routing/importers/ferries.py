"""What the tags of ferry ways mean for a private car, and how fast they carry it."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from energy.units import SECOND_PER_HOUR
from routing.importers.roads import short_distance_m
from routing.importers.tags import car_may_pass, tag_values

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from routing.importers.chains import Chains, Pieces

ASSUMED_MPS: Final = 5.0  # of a ferry whose duration is not known, about that of car ferries over sounds; assumed
SPEEDS_MPS: Final = (0.05, 30.0)  # a cable ferry that waits at its quay longer than it sails .. faster than catamarans
SECOND_PER_MIN: Final = 60.0
_CAR_KEYS: Final = ("motorcar", "motor_vehicle", "vehicle")
_CLOCK: Final = re.compile(r"(\d{1,3}):([0-5]\d)(?::([0-5]\d))?")
_MINUTES: Final = re.compile(r"\d{1,5}(?:\.\d+)?")
_ISO: Final = re.compile(
    r"p(?:(?P<days>\d+(?:\.\d+)?)d)?"
    r"(?:t(?:(?P<hours>\d+(?:\.\d+)?)h)?(?:(?P<minutes>\d+(?:\.\d+)?)m)?(?:(?P<seconds>\d+(?:\.\d+)?)s)?)?"
)
_ISO_CLOCK: Final = re.compile(r"pt(\d\d)(\d\d)(\d\d)")


def is_ferry(tags: Mapping[str, str]) -> bool:
    """Whether a way is a ferry, whatever road it is drawn as besides."""
    return "ferry" in tag_values(tags, "route")


def takes_cars(tags: Mapping[str, str]) -> bool:
    """Whether a ferry takes a private car in either direction.

    By its access tags as on roads. A ferry that names foot or bicycle and no vehicle with an engine is for those.
    """
    if any(key in tags for base in _CAR_KEYS for key in (base, f"{base}:forward", f"{base}:backward")):
        return car_may_pass(tags)
    return "foot" not in tags and "bicycle" not in tags and car_may_pass(tags)


def duration_s(value: str) -> float | None:
    """Seconds of a `duration` tag, None where it is not understood; of several the longest.

    `HH:MM`, `HH:MM:SS`, a plain number of minutes, and ISO 8601 as `PT1H30M` (the wiki's page Key:duration).
    """
    words = [word.strip().lower() for word in value.split(";") if word.strip()]
    found = [_seconds(word) for word in words]
    known = [seconds for seconds in found if seconds is not None and seconds > 0.0]
    return max(known) if known and len(known) == len(found) else None


def _seconds(word: str) -> float | None:
    if clock := _CLOCK.fullmatch(word) or _ISO_CLOCK.fullmatch(word):
        hours, minutes, seconds = (int(part or 0) for part in clock.groups())
        return hours * SECOND_PER_HOUR + minutes * SECOND_PER_MIN + seconds
    if _MINUTES.fullmatch(word):
        return float(word) * SECOND_PER_MIN
    iso = _ISO.fullmatch(word)
    if iso is None or not any(iso.groups()):
        return None
    days, hours_h, minutes_min, seconds_s = (
        float(part or 0.0) for part in iso.group("days", "hours", "minutes", "seconds")
    )
    return (24.0 * days + hours_h) * SECOND_PER_HOUR + minutes_min * SECOND_PER_MIN + seconds_s


def line_length_m(places_e7: list[tuple[int, int]]) -> float:
    """Length of a line over places, each lon and lat [1e-7 deg]."""
    if len(places_e7) < 2:
        return 0.0
    lon, lat = np.array(places_e7, np.int32).T
    return float(short_distance_m(lon[:-1], lat[:-1], lon[1:], lat[1:]).sum())


@dataclass(frozen=True, slots=True)
class FerrySpeed:
    """How fast a ferry is, and why not as its tag says, if it has one.

    assumed: the speed is not from a duration. not_used: there is a duration that is not understood, or that would make
    the ferry slower or faster than any.
    """

    mps: float
    assumed: bool
    not_used: bool


def ferry_speed(duration: str | None, length_m: float) -> FerrySpeed:
    """The speed of a ferry of a length with a `duration` tag or without one."""
    seconds = None if duration is None else duration_s(duration)
    if seconds is None:
        return FerrySpeed(ASSUMED_MPS, True, duration is not None)
    speed_mps = length_m / seconds
    if not SPEEDS_MPS[0] <= speed_mps <= SPEEDS_MPS[1]:
        return FerrySpeed(ASSUMED_MPS, True, True)
    return FerrySpeed(speed_mps, False, False)


def without_spurs(chains: Chains, pieces: Pieces, ferry_way: NDArray[np.bool_]) -> Pieces:
    """The pieces without those of ferries from whose end nothing leads on, neither a road nor another ferry.

    ferry_way: bool (W,) by way.
    """
    ferry = ferry_way[chains.way[pieces.begin]]
    kept = np.ones(ferry.size, np.bool_)
    while True:
        ends = np.concatenate((pieces.tail[kept], pieces.head[kept]))
        degree = np.bincount(ends, minlength=chains.point_count)
        spur = kept & ferry & ((degree[pieces.tail] < 2) | (degree[pieces.head] < 2))
        if not spur.any():
            break
        kept &= ~spur
    names = ("begin", "end", "tail", "head", "length_m")
    columns: dict[str, Any] = {name: getattr(pieces, name)[kept] for name in names}
    return replace(pieces, **columns)


def levelled(
    height_m: NDArray[np.float64], tail: NDArray[np.int32], head: NDArray[np.int32], ferry: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Heights of nodes, float64 (N,) [m], those that ferries join made equal: water is level.

    tail, head: int32 (M,) nodes of links, ferry: bool (M,).
    """
    size = height_m.size
    joined = coo_array((np.ones(int(ferry.sum())), (tail[ferry], head[ferry])), shape=(size, size))
    part = connected_components(joined, directed=False)[1]
    mean_m = np.bincount(part, height_m) / np.bincount(part)
    on_water = np.zeros(size, np.bool_)
    on_water[tail[ferry]] = on_water[head[ferry]] = True
    return np.where(on_water, mean_m[part], height_m)
