"""The axes that mismatch is looked for along: what windows lie at on each, its unit and its names."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.units import KMH_PER_MPS, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from diagnosis.fit.windows import WindowedTrip, Windows


class Axis(StrEnum):
    """What windows are sorted by; the value is the name that regimes have in diagnosis.json."""

    STANDSTILL = "standstill"  # share of the window that the vehicle stands [-]
    SPEED = "speed_kmh"
    SINCE_START = "since_start_min"
    POWER = "simulated_power_kw"
    AMBIENT = "ambient_c"
    GRADE = "grade_percent"
    SOC = "soc_percent"
    DISTANCE = "distance_km"
    ALTITUDE = "altitude_m"
    BATTERY_TEMPERATURE = "battery_c"
    HEADING = "heading_deg"
    PLACE = "place"


@dataclass(frozen=True, slots=True)
class AxisFacts:
    """What is known of an axis.

    name: that structures without a cause have in diagnosis.json. label: for a reader. values: where a trip's windows
    lie, float64 (n,) in the unit, None where that was not recorded, and for places, which are map cells. steps: where
    the steps of the replay lie, float64 (steps,), None where all of a window lies where its mean does.
    """

    name: str
    unit: str
    label: str
    values: Callable[[Windows], NDArray[np.float64] | None]
    steps: Callable[[WindowedTrip], NDArray[np.float64] | None] = lambda _: None


def _ambient_c(trip: Windows) -> NDArray[np.float64] | None:
    return None if trip.ambient_k is None else np.full(trip.begin_s.size, trip.ambient_k - ZERO_CELSIUS_K)


def _recorded(name: str, factor: float = 1.0, offset: float = 0.0) -> Callable[[Windows], NDArray[np.float64] | None]:
    """Means of a channel in the axis's unit."""

    def values(trip: Windows) -> NDArray[np.float64] | None:
        known = trip.places.get(name)
        return None if known is None else factor * known + offset

    return values


def _at_steps(
    name: str, factor: float = 1.0, offset: float = 0.0
) -> Callable[[WindowedTrip], NDArray[np.float64] | None]:
    """A channel at steps in the axis's unit."""

    def values(trip: WindowedTrip) -> NDArray[np.float64] | None:
        known = trip.drive.channels.get(name)
        return None if known is None else factor * known + offset

    return values


def _heading_at_steps(trip: WindowedTrip) -> NDArray[np.float64] | None:
    known = trip.drive.channels.get("heading_rad")
    return None if known is None else np.degrees(known) % 360.0


AXES: Final[Mapping[Axis, AxisFacts]] = {
    Axis.STANDSTILL: AxisFacts("standstill", "", "Standing or driving", lambda trip: trip.standing_s / trip.duration_s),
    Axis.SPEED: AxisFacts(
        "speed",
        "km/h",
        "Speed",
        lambda trip: trip.distance_m / trip.duration_s * KMH_PER_MPS,
        lambda trip: trip.drive.speed_mps * KMH_PER_MPS,
    ),
    Axis.SINCE_START: AxisFacts(
        "since_start",
        "min",
        "Time since the start",
        lambda trip: trip.begin_s / 60.0,
        lambda trip: trip.drive.since_s / 60.0,
    ),
    Axis.POWER: AxisFacts(
        "simulated_power",
        "kW",
        "Power that the model expects",
        lambda trip: trip.simulated_j / trip.duration_s / 1000.0,
    ),
    Axis.AMBIENT: AxisFacts("ambient", "°C", "Temperature outside", _ambient_c),
    Axis.GRADE: AxisFacts("grade", "%", "Grade", _recorded("grade_frac", 100.0)),
    Axis.SOC: AxisFacts("soc", "%", "State of charge", _recorded("soc_frac", 100.0), _at_steps("soc_frac", 100.0)),
    Axis.DISTANCE: AxisFacts(
        "distance",
        "km",
        "Distance",
        lambda trip: np.cumsum(trip.distance_m) / 1000.0,
        lambda trip: np.cumsum(trip.drive.profile.step_m()) / 1000.0,
    ),
    Axis.ALTITUDE: AxisFacts("altitude", "m", "Altitude", _recorded("altitude_m"), _at_steps("altitude_m")),
    Axis.BATTERY_TEMPERATURE: AxisFacts(
        "battery_temperature",
        "°C",
        "Battery temperature",
        _recorded("battery_k", offset=-ZERO_CELSIUS_K),
        _at_steps("battery_k", offset=-ZERO_CELSIUS_K),
    ),
    Axis.HEADING: AxisFacts("heading", "°", "Heading", _recorded("heading_rad", 180.0 / np.pi), _heading_at_steps),
    Axis.PLACE: AxisFacts("place", "cell", "Place", lambda _: None),
}
