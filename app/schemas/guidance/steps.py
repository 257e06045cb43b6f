"""Steps of a route as they are answered."""

from __future__ import annotations

from pydantic import Field

from app.schemas.base import Answered
from app.schemas.place import LatLon
from routing.guidance.step import Modifier, StepType, TravelMode
from routing.route.route import LegEnd


class LaneAnswer(Answered):
    """A lane before a junction."""

    indications: list[str] = Field(description="arrows on it: left, slight left, straight, uturn, none, …")
    valid: bool = Field(description="whether it leads on along the route")


class IntersectionAnswer(Answered):
    """A junction that is turned at or passed: the roads that meet there, clockwise from north."""

    at: LatLon
    bearings: list[int] = Field(description="of the roads, away from it, clockwise from north [deg]")
    entry: list[bool] = Field(description="whether each may be driven into from where the route comes")
    in_idx: int | None = Field(description="position in bearings of the road that the route comes by; null at a start")
    out_idx: int | None = Field(description="position in bearings of the road that the route takes; null at an end")
    lanes: list[LaneAnswer] = Field(description="from left to right; empty where none are tagged")


class StepAnswer(Answered):
    """What to do at a place, and the way from there to the next step."""

    type: StepType = Field(description="what to do, in the words of OSRM")
    modifier: Modifier | None = Field(
        description="which way; of arrivals the side of the road, null on it; null of departures"
    )
    instruction: str = Field(description="the same in English")
    at: LatLon
    bearing_before: float = Field(description="direction of travel clockwise from north [deg]; 0 before a departure")
    bearing_after: float = Field(description="direction of travel clockwise from north [deg]; 0 after an arrival")
    name: str = Field(description="of the road that is taken; empty where it has none")
    ref: str = Field(description="number of the road that is taken; empty where it has none")
    destinations: str = Field(description="on its signs: `A 1: Lisboa, Porto`; empty where none are tagged")
    exits: str = Field(description="number of the exit on its sign; empty where it has none")
    exit: int | None = Field(description="which exit of a roundabout; null where the route ends in it, and elsewhere")
    rotary_name: str = Field(description="of the roundabout itself; empty where it has none")
    mode: TravelMode
    lanes: list[LaneAnswer] = Field(description="before the place, from left to right; empty where none are tagged")
    intersections: list[IntersectionAnswer] = Field(description="that of the step, then those passed before the next")
    distance_m: float = Field(description="to the next step [m]")
    duration_s: float = Field(description="to the next step [s]")
    energy_kwh: float = Field(description="to the next step [kWh]")
    soc_start: float = Field(description="state of charge at the place; after charging where it is left")
    soc_end: float = Field(description="state of charge at the next step; below 0 is missing energy")
    ends_at: LegEnd | None = Field(description="what is arrived at; null of other steps")
    speed_cap_kmh: float | None = Field(description="highest speed by plan on the leg that begins here; null: none")
    first_link: int = Field(description="position of its first link in links")
    last_link: int = Field(description="position of its last link in links; less than first_link where it has none")
    geometry_first: int = Field(description="position in geometry.coordinates of the place")
    geometry_last: int = Field(description="position in geometry.coordinates of the next step")
