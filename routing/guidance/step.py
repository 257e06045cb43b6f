"""One step of a route: what to do at a place, and the way from there to the next step."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from routing.route.route import LegEnd


class StepType(StrEnum):
    """What a driver does, in the words of OSRM's public documentation of its HTTP interface."""

    DEPART = "depart"
    ARRIVE = "arrive"
    TURN = "turn"
    NEW_NAME = "new name"
    CONTINUE = "continue"
    MERGE = "merge"
    ON_RAMP = "on ramp"
    OFF_RAMP = "off ramp"
    FORK = "fork"
    END_OF_ROAD = "end of road"
    ROUNDABOUT = "roundabout"
    ROTARY = "rotary"
    ROUNDABOUT_TURN = "roundabout turn"
    EXIT_ROUNDABOUT = "exit roundabout"
    EXIT_ROTARY = "exit rotary"
    NOTIFICATION = "notification"


class Modifier(StrEnum):
    """Which way."""

    UTURN = "uturn"
    SHARP_RIGHT = "sharp right"
    RIGHT = "right"
    SLIGHT_RIGHT = "slight right"
    STRAIGHT = "straight"
    SLIGHT_LEFT = "slight left"
    LEFT = "left"
    SHARP_LEFT = "sharp left"


class TravelMode(StrEnum):
    """How the vehicle goes on."""

    DRIVING = "driving"
    FERRY = "ferry"


@dataclass(frozen=True, slots=True)
class Lane:
    """A lane before a junction: the arrows on it, and whether it leads on along the route."""

    indications: tuple[str, ...]
    valid: bool


@dataclass(frozen=True, slots=True)
class Intersection:
    """A junction that is passed or turned at: the roads that meet there, clockwise from north.

    location: lat, lon [deg]. bearings: of the roads away from it [deg], whole, 0..359. entry: whether each may be
    driven into from where the route comes. in_idx, out_idx: the roads that the route comes and goes by; None where it
    begins or ends. lanes: from left to right, empty where none are tagged.
    """

    location: tuple[float, float]
    bearings: tuple[int, ...]
    entry: tuple[bool, ...]
    in_idx: int | None
    out_idx: int | None
    lanes: tuple[Lane, ...] = ()


@dataclass(frozen=True, slots=True)
class Step:
    """What to do at a place, and the way from there to the next step.

    at: lat, lon [deg]. bearing_before_deg, bearing_after_deg: directions of travel clockwise from north, 0 ≤ … < 360; 0
    before a departure and after an arrival. first_link, last_link: positions in the route's links, none where last_link
    is less than first_link. geometry_first, geometry_last: positions in the route's geometry, both included.
    distance_m, duration_s, energy_j: of this step's way; an arrival has none. soc_start_frac, soc_end_frac: charge at
    its beginning and end, also below 0; energy_j of recuperation is negative.
    name, ref, destinations: of the road that is taken, empty where it has none. exits: number of the exit as text.
    exit: which exit of the roundabout, None where the route ends in it, and elsewhere. lanes: before the place.
    modifier: which way; of an arrival the side of the road that the place is on, None where it is on the road.
    rotary_name: of the roundabout itself. speed_cap_mps: highest speed by plan on the leg that begins here. ends_at:
    what is arrived at, None of other steps.
    """

    type: StepType
    modifier: Modifier | None
    at: tuple[float, float]
    bearing_before_deg: float
    bearing_after_deg: float
    first_link: int
    last_link: int
    geometry_first: int
    geometry_last: int
    distance_m: float
    duration_s: float
    energy_j: float
    soc_start_frac: float
    soc_end_frac: float
    name: str
    ref: str
    destinations: str
    exits: str
    exit: int | None
    lanes: tuple[Lane, ...]
    intersections: tuple[Intersection, ...]
    rotary_name: str = ""
    mode: TravelMode = TravelMode.DRIVING
    drives_left: bool = False
    speed_cap_mps: float | None = None
    ends_at: LegEnd | None = None
