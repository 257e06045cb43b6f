"""A manoeuvre before it is made a step, and what the rules see of a junction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from routing.guidance.labels import Label
    from routing.guidance.step import Modifier, StepType


class Arm(NamedTuple):
    """A road at a junction as seen by who comes to it.

    turn_deg: change of direction onto it, to the right positive. entry: whether it may be driven into. rank: functional
    class, 0 for motorways. bits: what its sign says (surroundings). label: name and number. leads_in: whether traffic
    comes from it. same: whether it is the road that the driver comes by.
    """

    turn_deg: float
    entry: bool
    rank: int
    bits: int
    label: Label
    leads_in: bool
    same: bool


@dataclass(frozen=True, slots=True)
class Crossing:
    """A junction on a route: the road that it comes by, the one that it takes, all others."""

    came: Arm
    taken: Arm
    others: tuple[Arm, ...]


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """What is done where one link of a route ends; at: that link's position among the route's links.

    before_deg, after_deg: directions of travel. named: position of the link whose name and destination are told. exit:
    of a roundabout, rotary: its name.
    """

    at: int
    type: StepType
    modifier: Modifier | None
    before_deg: float
    after_deg: float
    named: int
    exit: int | None = None
    rotary: str = ""
