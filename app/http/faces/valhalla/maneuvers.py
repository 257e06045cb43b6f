"""Steps as Valhalla's manoeuvres: types by number, signs, lanes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from app.http.faces.figures import electric_step
from routing.guidance.instructions import instruction_of, road_text
from routing.guidance.step import Modifier, StepType, TravelMode

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from routing.guidance.step import Lane, Step

START: Final = 1
DESTINATION: Final = 4
BECOMES: Final = 7
CONTINUE: Final = 8
UTURN_RIGHT: Final = 12
ROUNDABOUT_ENTER: Final = 26
ROUNDABOUT_EXIT: Final = 27
FERRY_ENTER: Final = 28
FERRY_EXIT: Final = 29
TURNS: Final[Mapping[Modifier, int]] = {
    Modifier.STRAIGHT: CONTINUE,
    Modifier.SLIGHT_RIGHT: 9,
    Modifier.RIGHT: 10,
    Modifier.SHARP_RIGHT: 11,
    Modifier.UTURN: 13,
    Modifier.SHARP_LEFT: 14,
    Modifier.LEFT: 15,
    Modifier.SLIGHT_LEFT: 16,
}
# straight on, to the right, to the left
SIDED: Final[Mapping[StepType, tuple[int, int, int]]] = {
    StepType.ON_RAMP: (17, 18, 19),
    StepType.OFF_RAMP: (17, 20, 21),
    StepType.FORK: (22, 23, 24),
    StepType.MERGE: (25, 37, 38),
}
WHOLE: Final[Mapping[StepType, int]] = {
    StepType.DEPART: START,
    StepType.ARRIVE: DESTINATION,
    StepType.NEW_NAME: BECOMES,
    StepType.ROUNDABOUT: ROUNDABOUT_ENTER,
    StepType.ROTARY: ROUNDABOUT_ENTER,
    StepType.EXIT_ROUNDABOUT: ROUNDABOUT_EXIT,
    StepType.EXIT_ROTARY: ROUNDABOUT_EXIT,
}
LANES: Final[Mapping[str, int]] = {
    "none": 1,
    "straight": 2,
    "sharp left": 4,
    "left": 8,
    "slight left": 16,
    "slight right": 32,
    "right": 64,
    "sharp right": 128,
    "uturn": 256,
}


def maneuver_type(step: Step) -> int:
    """Valhalla's number of a step's type."""
    if step.type in WHOLE:
        return WHOLE[step.type]
    if step.type is StepType.NOTIFICATION:
        return FERRY_ENTER if step.mode is TravelMode.FERRY else FERRY_EXIT
    modifier = step.modifier or Modifier.STRAIGHT
    if step.type in SIDED:
        side = 1 if modifier.value.endswith("right") else 2 if modifier.value.endswith("left") else 0
        return SIDED[step.type][side]
    if modifier is Modifier.UTURN and step.drives_left:
        return UTURN_RIGHT
    return TURNS[modifier]


def maneuver(step: Step, begin: int, km_a_unit: float, *, spoken: bool, lanes: bool, passing: bool) -> dict[str, Any]:
    """A step as a manoeuvre.

    begin: row of the geometry at which the leg's shape begins. spoken: with instructions. passing: whether it departs
    from a place that is only driven over.
    """
    kind = CONTINUE if passing else maneuver_type(step)
    written: dict[str, Any] = {"type": kind}
    if spoken:
        text = instruction_of(step) if not passing else f"Continue{f' on {road_text(step)}' if road_text(step) else ''}"
        written |= {"instruction": f"{text}.", "verbal_pre_transition_instruction": f"{text}."}
    if names := [name for name in (step.name, step.ref) if name]:
        written["street_names"] = names
    written |= {
        "time": round(step.duration_s, 3),
        "length": round(step.distance_m / 1000.0 / km_a_unit, 3),
        "cost": round(step.duration_s, 3),
        "begin_shape_index": step.geometry_first - begin,
        "end_shape_index": step.geometry_last - begin,
        "travel_mode": "drive",
        "travel_type": "car",
        "ev": electric_step(step),
    }
    if step.type is not StepType.DEPART:
        written["bearing_before"] = round(step.bearing_before_deg) % 360
    if step.type is not StepType.ARRIVE:
        written["bearing_after"] = round(step.bearing_after_deg) % 360
    if step.exit is not None:
        written["roundabout_exit_count"] = step.exit
    if step.mode is TravelMode.FERRY:
        written["ferry"] = True
    if sign := _sign(step):
        written["sign"] = sign
    if lanes and step.lanes:
        written["lanes"] = _lanes(step.lanes, step.modifier)
    return written


def _sign(step: Step) -> dict[str, Any]:
    """What is written on the signs at an exit."""
    sign: dict[str, Any] = {}
    if step.exits:
        sign["exit_number_elements"] = [{"text": step.exits}]
    if step.destinations:
        branch, found, towards = step.destinations.partition(": ")
        if not found:
            branch, towards = "", branch
        if branch:
            sign["exit_branch_elements"] = _elements(branch)
        sign["exit_toward_elements"] = _elements(towards)
    return sign


def _elements(text: str) -> list[dict[str, str]]:
    return [{"text": part.strip()} for part in text.split(",") if part.strip()]


def _lanes(lanes: Sequence[Lane], modifier: Modifier | None) -> list[dict[str, int]]:
    """Lanes as sums of their arrows; those that lead on are active for the turn that is taken."""
    turn = LANES.get((modifier or Modifier.STRAIGHT).value, 0)
    written = []
    for lane in lanes:
        arrows = sum({LANES.get(arrow, 0) for arrow in lane.indications})
        fields = {"directions": arrows}
        if lane.valid:
            fields["active"] = arrows & turn or arrows
        written.append(fields)
    return written
