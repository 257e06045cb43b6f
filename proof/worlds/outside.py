"""A draw that no library of effects knows: a constant power in one band of speed, height, time, charge or direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from proof.worlds import dynamics
from proof.worlds.dynamics import CHARGE, HEADING_RAD, HEIGHT, PLACE, TERMINAL, Strengths
from proof.worlds.traffic import STEPS_PER_S
from proof.worlds.world import OutsideTruth

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from proof.worlds.dynamics import WorldDrive
    from proof.worlds.scene import Scene

SHARE: Final = 0.05
LEAST_W, MOST_W = 400.0, 6000.0
SECONDS_SHARE: Final = (0.12, 0.25)  # of all driving, that a band is to cover
PLACE_RADIUS_M: Final = (900.0, 1600.0)


@dataclass(frozen=True, slots=True)
class _Axis:
    code: int
    unit: str
    step: float  # to which bounds are rounded
    channels: tuple[str, ...]


AXES: Final = {
    "altitude": _Axis(dynamics.ALTITUDE, "m", 1.0, ()),
    "place": _Axis(dynamics.PLACE_AXIS, "deg", 1e-5, ("lat", "lon", "heading_deg")),
    "speed": _Axis(dynamics.SPEED, "km/h", 1.0, ()),
    "time_of_trip": _Axis(dynamics.TRIP_TIME, "min", 0.5, ()),
    "soc": _Axis(dynamics.STATE_OF_CHARGE, "", 0.01, ()),
    "heading": _Axis(dynamics.DIRECTION, "deg", 1.0, ("heading_deg",)),
}


@dataclass(frozen=True, slots=True)
class OutsideSpot:
    """Where an outside draw acts and how much it is; for a place low and high are latitude and longitude."""

    axis: str
    low: float
    high: float
    draw_w: float
    radius_m: float | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels without which nobody could locate it."""
        return AXES[self.axis].channels

    def truth(self) -> OutsideTruth:
        """As the label has it."""
        return OutsideTruth(self.axis, self.low, self.high, self.draw_w, AXES[self.axis].unit, self.radius_m)


def draw_spot(rng: np.random.Generator, axis: str, scene: Scene, calm: Sequence[WorldDrive]) -> OutsideSpot:
    """A band that enough of the driving falls into, and the draw that takes about SHARE of all energy there."""
    if axis == "place":
        spot = _place(rng, scene, calm)
    else:
        low, high = _band(rng, axis, _along(axis, calm))
        spot = OutsideSpot(axis, low, high, 1.0)
    probe = with_spot(scene, spot)
    drawn = probe.drive(Strengths(draw_w=1.0))
    seconds = sum(float(drive.energy_j[dynamics.DRAW]) for drive in drawn)
    energy_j = sum(float(drive.energy_j[TERMINAL]) for drive in calm)
    watts = SHARE / (1.0 - SHARE) * energy_j / max(seconds, 1.0)
    return replace(spot, draw_w=float(np.clip(np.rint(watts), LEAST_W, MOST_W)))


def with_spot(scene: Scene, spot: OutsideSpot) -> Scene:
    """The scene with the place of the draw set in each of its trips."""
    trips = tuple(
        replace(
            trip,
            day=trip.day._replace(
                draw_axis=float(AXES[spot.axis].code),
                draw_low=spot.low,
                draw_high=spot.high,
                draw_radius_m=spot.radius_m or 0.0,
            ),
        )
        for trip in scene.trips
    )
    return replace(scene, trips=trips)


def _along(axis: str, calm: Sequence[WorldDrive]) -> NDArray[np.float64]:
    """Where on the axis each second of moving was."""
    seen = []
    for drive in calm:
        moving = drive.speed_mps[::STEPS_PER_S] > 0.0
        values = {
            "altitude": drive.states[:, HEIGHT],
            "speed": 3.6 * drive.speed_mps[::STEPS_PER_S],
            "time_of_trip": np.arange(moving.size) / 60.0,
            "soc": drive.states[:, CHARGE],
            "heading": np.degrees(drive.states[:, HEADING_RAD]) % 360.0,
        }[axis]
        seen.append(values[moving])
    return np.concatenate(seen)


def _band(rng: np.random.Generator, axis: str, along: NDArray[np.float64]) -> tuple[float, float]:
    """An interval away from both ends, that SECONDS_SHARE of the driving falls into."""
    share = float(rng.uniform(*SECONDS_SHARE))
    begin = float(rng.uniform(0.25, 0.9 - share))
    step = AXES[axis].step
    low, high = (float(np.rint(value / step) * step) for value in np.quantile(along, [begin, begin + share]))
    if axis == "speed":  # a band much wider than this is a matter of driving as a whole
        high = low + float(np.rint(rng.uniform(8.0, 14.0)))
    return low, max(high, low + 4.0 * step)


def _place(rng: np.random.Generator, scene: Scene, calm: Sequence[WorldDrive]) -> OutsideSpot:
    """The spot on the road that most trips come by, of twenty taken at random."""
    loop = scene.loop
    passed = [set((drive.states[:, PLACE].astype(np.int64) // 50).tolist()) for drive in calm]
    nodes = rng.integers(0, loop.height_m.size, 20)
    starts = np.array([drive.states[0, PLACE] for drive in calm])
    near = (starts[rng.integers(0, starts.size, 20)] + rng.integers(-700, 700, 20)) % loop.height_m.size
    candidates = np.concatenate([nodes, near.astype(np.int64)])
    best = max(candidates.tolist(), key=lambda node: sum(node // 50 in cells for cells in passed))
    step = AXES["place"].step
    north, east = (float(np.rint(line[best] / step) * step) for line in (loop.latitude_deg, loop.longitude_deg))
    return OutsideSpot("place", north, east, 1.0, float(np.rint(rng.uniform(*PLACE_RADIUS_M))))
