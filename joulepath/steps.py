"""What a driver is told along a route."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from energy.units import JOULE_PER_KWH
from joulepath.figures import Place
from routing.guidance.instructions import instruction_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from routing.guidance.step import Step as FoundStep


@dataclass(frozen=True, slots=True)
class Step:
    """What to do at a place, and the way from there to the next step; docs/guidance.md has the types and modifiers.

    type: as "turn", "roundabout". modifier: as "slight left", None where nothing is turned; of an arrival the side of
    the road. instruction: the same in English. exit: which one of a roundabout. exits: number of the exit on its sign.
    first_link, last_link: positions in the route's links, geometry_first, geometry_last: rows of its geometry.
    """

    type: str
    modifier: str | None
    instruction: str
    place: Place
    bearing_before_deg: float
    bearing_after_deg: float
    name: str
    ref: str
    destinations: str
    exits: str
    exit: int | None
    rotary_name: str
    distance_m: float
    duration_s: float
    energy_kwh: float
    soc_start_frac: float
    soc_end_frac: float
    first_link: int
    last_link: int
    geometry_first: int
    geometry_last: int


def steps_from(found: Iterable[FoundStep]) -> tuple[Step, ...]:
    """Steps in human units."""
    return tuple(
        Step(
            type=step.type.value,
            modifier=None if step.modifier is None else step.modifier.value,
            instruction=instruction_of(step),
            place=Place(*step.at),
            bearing_before_deg=step.bearing_before_deg,
            bearing_after_deg=step.bearing_after_deg,
            name=step.name,
            ref=step.ref,
            destinations=step.destinations,
            exits=step.exits,
            exit=step.exit,
            rotary_name=step.rotary_name,
            distance_m=step.distance_m,
            duration_s=step.duration_s,
            energy_kwh=step.energy_j / JOULE_PER_KWH,
            soc_start_frac=step.soc_start_frac,
            soc_end_frac=step.soc_end_frac,
            first_link=step.first_link,
            last_link=step.last_link,
            geometry_first=step.geometry_first,
            geometry_last=step.geometry_last,
        )
        for step in found
    )
