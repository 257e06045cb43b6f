"""Steps as openrouteservice has them: types by number, instructions in English."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from app.http.faces.figures import electric_step
from app.http.faces.lines import lonlat
from routing.guidance.instructions import instruction_of
from routing.guidance.step import Modifier, StepType

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from routing.guidance.step import Step

TURNS: Final[Mapping[Modifier, int]] = {
    Modifier.LEFT: 0,
    Modifier.RIGHT: 1,
    Modifier.SHARP_LEFT: 2,
    Modifier.SHARP_RIGHT: 3,
    Modifier.SLIGHT_LEFT: 4,
    Modifier.SLIGHT_RIGHT: 5,
    Modifier.STRAIGHT: 6,
    Modifier.UTURN: 9,
}
STRAIGHT: Final = 6
ENTER_ROUNDABOUT: Final = 7
EXIT_ROUNDABOUT: Final = 8
GOAL: Final = 10
DEPART: Final = 11
KEEP: Final[Mapping[Modifier, int]] = {
    **dict.fromkeys((Modifier.LEFT, Modifier.SHARP_LEFT, Modifier.SLIGHT_LEFT), 12),
    **dict.fromkeys((Modifier.RIGHT, Modifier.SHARP_RIGHT, Modifier.SLIGHT_RIGHT), 13),
}
FORKS: Final = frozenset({StepType.FORK, StepType.ON_RAMP, StepType.OFF_RAMP, StepType.MERGE})


def step_type(step: Step) -> int:
    """openrouteservice's number of a step's type."""
    modifier = step.modifier or Modifier.STRAIGHT
    if step.type is StepType.DEPART:
        return DEPART
    if step.type is StepType.ARRIVE:
        return GOAL
    if step.type in (StepType.ROUNDABOUT, StepType.ROTARY):
        return ENTER_ROUNDABOUT
    if step.type in (StepType.EXIT_ROUNDABOUT, StepType.EXIT_ROTARY):
        return EXIT_ROUNDABOUT
    if step.type in FORKS:
        return KEEP.get(modifier, STRAIGHT)
    return TURNS[modifier]


def step_fields(step: Step, rows: Sequence[int], metres: float, *, html: bool, manoeuvre: bool) -> dict[str, Any]:
    """A step; rows: those of the line that is sent for each row of the geometry. metres: of a unit."""
    instruction = instruction_of(step)
    name = step.name or step.ref
    if html and name:
        instruction = instruction.replace(name, f"<b>{name}</b>")
    written: dict[str, Any] = {
        "distance": round(step.distance_m / metres, 4 if metres > 1.0 else 1),
        "duration": round(step.duration_s, 1),
        "type": step_type(step),
        "instruction": instruction,
        "name": name or "-",
        "way_points": [rows[step.geometry_first], rows[step.geometry_last]],
        "ev": electric_step(step),
    }
    if step.exit is not None:
        written["exit_number"] = step.exit
    if manoeuvre:
        written["maneuver"] = {
            "location": lonlat(step.at),
            "bearing_before": round(step.bearing_before_deg) % 360,
            "bearing_after": round(step.bearing_after_deg) % 360,
        }
    return written
