"""Steps in English."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from routing.guidance.step import Modifier, StepType, TravelMode
from routing.route.route import LegEnd

if TYPE_CHECKING:
    from routing.guidance.step import Step

KMH_PER_MPS: Final = 3.6
_COMPASS: Final = ("north", "northeast", "east", "southeast", "south", "southwest", "west", "northwest")
_TURNS: Final = {
    Modifier.STRAIGHT: "Go straight",
    Modifier.UTURN: "Make a U-turn",
    **{m: f"Turn {m}" for m in (Modifier.LEFT, Modifier.RIGHT)},
    Modifier.SHARP_LEFT: "Make a sharp left",
    Modifier.SHARP_RIGHT: "Make a sharp right",
    Modifier.SLIGHT_LEFT: "Make a slight left",
    Modifier.SLIGHT_RIGHT: "Make a slight right",
}
_SIDES: Final = {
    Modifier.SLIGHT_LEFT: "left",
    Modifier.LEFT: "left",
    Modifier.SHARP_LEFT: "left",
    Modifier.SLIGHT_RIGHT: "right",
    Modifier.RIGHT: "right",
    Modifier.SHARP_RIGHT: "right",
}


def instruction_of(step: Step) -> str:
    """A sentence for a driver."""
    text = _WORDS[step.type](step)
    if step.speed_cap_mps is not None:
        text += f". Plan: drive at no more than {round(step.speed_cap_mps * KMH_PER_MPS)} km/h"
    return text


def ordinal(number: int) -> str:
    """1st, 2nd, 3rd, 4th, 11th."""
    last = {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{'th' if 10 <= number % 100 <= 20 else last}"


def road_text(step: Step) -> str:
    """The road that is taken, its number in brackets, empty where it has neither."""
    if step.name and step.ref:
        return f"{step.name} ({step.ref})"
    return step.name or step.ref


def _onto(step: Step) -> str:
    road = road_text(step)
    return f" onto {road}" if road else ""


def _towards(step: Step) -> str:
    return f" towards {step.destinations}" if step.destinations else ""


def _depart(step: Step) -> str:
    heading = _COMPASS[round(step.bearing_after_deg / 45.0) % 8]
    road = road_text(step)
    if step.mode is TravelMode.FERRY:
        return "Depart by ferry"
    return f"Head {heading} on {road}" if road else f"Head {heading}"


def _arrive(step: Step) -> str:
    text = {LegEnd.VIA: "You have reached a place on your way", LegEnd.STOP: "Stop here to charge"}.get(
        step.ends_at or LegEnd.GOAL, "You have arrived"
    )
    if step.modifier is None:
        return text
    return f"{text}, {'straight ahead' if step.modifier is Modifier.STRAIGHT else 'on the ' + step.modifier}"


def _turn(step: Step) -> str:
    return _TURNS[step.modifier or Modifier.STRAIGHT] + _onto(step) + _towards(step)


def _continue(step: Step) -> str:
    if step.modifier is Modifier.UTURN:
        return f"Make a U-turn{' to stay on ' + road_text(step) if road_text(step) else ''}"
    if step.modifier in (None, Modifier.STRAIGHT):
        return f"Go straight{_stay(step)}{_towards(step)}"
    return f"{_TURNS[step.modifier]}{_stay(step)}{_towards(step)}"


def _stay(step: Step) -> str:
    road = road_text(step)
    return f" to stay on {road}" if road else ""


def _new_name(step: Step) -> str:
    return f"Continue{_onto(step)}{_towards(step)}"


def _merge(step: Step) -> str:
    side = _SIDES.get(step.modifier) if step.modifier else None
    return f"Merge{' ' + side if side else ''}{_onto(step)}{_towards(step)}"


def _on_ramp(step: Step) -> str:
    side = _SIDES.get(step.modifier) if step.modifier else None
    return f"Take the ramp{' on the ' + side if side else ''}{_towards(step) or _onto(step)}"


def _off_ramp(step: Step) -> str:
    side = _SIDES.get(step.modifier) if step.modifier else None
    number = f"exit {step.exits}" if step.exits else "the exit"
    return f"Take {number}{' on the ' + side if side else ''}{_towards(step) or _onto(step)}"


def _fork(step: Step) -> str:
    side = _SIDES.get(step.modifier) if step.modifier else None
    keep = f"Keep {side}" if side else "Keep to the middle"
    number = f" at exit {step.exits}" if step.exits else ""
    return f"{keep} at the fork{number}{_onto(step)}{_towards(step)}"


def _end_of_road(step: Step) -> str:
    turn = _TURNS[step.modifier or Modifier.STRAIGHT]
    return f"At the end of the road {turn[0].lower()}{turn[1:]}{_onto(step)}{_towards(step)}"


def _roundabout(step: Step) -> str:
    place = f"Enter {step.rotary_name}" if step.rotary_name else "Enter the roundabout"
    if step.exit is None:
        return place
    return f"{place} and take the {ordinal(step.exit)} exit{_onto(step)}{_towards(step)}"


def _roundabout_turn(step: Step) -> str:
    turn = _TURNS[step.modifier or Modifier.STRAIGHT]
    return f"At the roundabout {turn[0].lower()}{turn[1:]}{_onto(step)}{_towards(step)}"


def _exit(step: Step) -> str:
    place = step.rotary_name or "the roundabout"
    return f"Leave {place}{_onto(step)}{_towards(step)}"


def _notification(step: Step) -> str:
    road = road_text(step)
    if step.mode is TravelMode.FERRY:
        return f"Take the ferry{' ' + road if road else ''}"
    return f"Leave the ferry{_onto(step)}"


_WORDS: Final = {
    StepType.DEPART: _depart,
    StepType.ARRIVE: _arrive,
    StepType.TURN: _turn,
    StepType.CONTINUE: _continue,
    StepType.NEW_NAME: _new_name,
    StepType.MERGE: _merge,
    StepType.ON_RAMP: _on_ramp,
    StepType.OFF_RAMP: _off_ramp,
    StepType.FORK: _fork,
    StepType.END_OF_ROAD: _end_of_road,
    StepType.ROUNDABOUT: _roundabout,
    StepType.ROTARY: _roundabout,
    StepType.ROUNDABOUT_TURN: _roundabout_turn,
    StepType.EXIT_ROUNDABOUT: _exit,
    StepType.EXIT_ROTARY: _exit,
    StepType.NOTIFICATION: _notification,
}
