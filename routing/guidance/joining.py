"""Manoeuvres that a driver sees as one: slip roads, islands, two carriageways, names that change beside a turn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from routing.guidance.bearings import STRAIGHT_DEG, modifier_of, turned_deg
from routing.guidance.labels import same_road
from routing.guidance.step import Modifier, StepType
from routing.guidance.surroundings import LINK, RING

if TYPE_CHECKING:
    from routing.guidance.course import Course
    from routing.guidance.manoeuvre import Manoeuvre

# Lengths up to which two places are one junction to a driver (assumed; OSRM's rules have 30 m).
SLIP_M: Final = 120.0
ISLAND_M: Final = 35.0
BOULEVARD_M: Final = 60.0  # between two carriageways
ASIDE_M: Final = 15.0  # over to a road beside
NAME_M: Final = 30.0
SHORT_NAME_M: Final = 120.0  # of a bridge, after which the road has its name back
BACK_DEG: Final = 150.0
ONE_TURN_DEG: Final = 135.0

# Not forks: the left branch of one that bends right afterwards is no turn to the right.
TURNS: Final = frozenset((StepType.TURN, StepType.CONTINUE, StepType.END_OF_ROAD))
_NEVER_SLIPS: Final = frozenset((StepType.NOTIFICATION, StepType.FORK, StepType.ROUNDABOUT_TURN))
_KEPT: Final = frozenset((StepType.NOTIFICATION, StepType.MERGE))


def joined(course: Course, found: list[Manoeuvre], first: int, last: int) -> list[Manoeuvre]:
    """The manoeuvres between two links of a route, by their positions, as a driver is told them."""
    return _names(course, _pairs(course, _slips(course, found, first, last)))


def _slips(course: Course, found: list[Manoeuvre], first: int, last: int) -> list[Manoeuvre]:
    """Turns over a short slip road as one turn, told where it leaves."""
    k = first
    while k <= last:
        if not course.bits[k] & LINK or course.bits[k] & RING:
            k += 1
            continue
        begin = k
        while k <= last and course.bits[k] & LINK and not course.bits[k] & RING:
            k += 1
        found = _slip(course, found, begin, k - 1) if first < begin and k <= last else found
    return found


def _slip(course: Course, found: list[Manoeuvre], begin: int, end: int) -> list[Manoeuvre]:
    """begin, end: positions of the first and last link of a slip road between others."""
    graph, links = course.graph, course.links
    sides = (begin - 1, end + 1)
    length_m = course.at_m[end + 1] - course.at_m[begin]
    on_motorway = any(graph.functional_class[links[k]] == 0 for k in sides)
    if length_m > SLIP_M or on_motorway or any(course.bits[k] & RING for k in sides):
        return found
    within = [m for m in found if begin - 1 <= m.at <= end]
    turns = [m for m in within if m.type is not StepType.NEW_NAME]
    if not turns or any(m.type in _NEVER_SLIPS for m in turns):
        return found
    before, after = course.before_deg(begin - 1), course.after_deg(end)
    angle = turned_deg(before, after)
    same = same_road(course.label(begin - 1), course.label(end + 1))
    rest = [m for m in found if not begin - 1 <= m.at <= end]
    if abs(angle) <= STRAIGHT_DEG and same:
        return rest
    place, lead = (begin - 1 if turns[0].at == begin - 1 else turns[0].at), turns[0]
    if abs(angle) <= STRAIGHT_DEG:
        modifier = lead.modifier
    else:
        modifier = Modifier.UTURN if same and abs(angle) >= BACK_DEG else modifier_of(angle)
    kind = lead.type if lead.type is StepType.END_OF_ROAD else StepType.CONTINUE if same else StepType.TURN
    turn = replace(lead, at=place, type=kind, modifier=modifier, after_deg=after, named=end + 1)
    return sorted([*rest, turn], key=lambda m: m.at)


def _pairs(course: Course, found: list[Manoeuvre]) -> list[Manoeuvre]:
    """Two turns over an island or between carriageways as one, or as none."""
    result: list[Manoeuvre] = []
    for manoeuvre in found:
        if result and result[-1].type in TURNS and manoeuvre.type in TURNS:
            pair = _pair(course, result[-1], manoeuvre)
            if pair is not None:
                result[-1:] = pair
                continue
        result.append(manoeuvre)
    return result


def _pair(course: Course, former: Manoeuvre, latter: Manoeuvre) -> list[Manoeuvre] | None:
    """What two turns are together, None where they stay two."""
    between_m = course.at_m[latter.at + 1] - course.at_m[former.at + 1]
    if between_m > BOULEVARD_M or Modifier.UTURN in (former.modifier, latter.modifier):
        return None
    came, taken = course.label(former.at), course.label(latter.named)
    same = same_road(came, taken) or (not came.known and not taken.known)
    turns = turned_deg(former.before_deg, former.after_deg), turned_deg(latter.before_deg, latter.after_deg)
    angle, same_side = turned_deg(former.before_deg, latter.after_deg), turns[0] * turns[1] > 0.0
    if same_side and same and abs(angle) >= BACK_DEG:
        back = replace(former, type=StepType.CONTINUE if came.known else StepType.TURN, modifier=Modifier.UTURN)
        return [replace(back, after_deg=latter.after_deg, named=latter.named)]
    if between_m > ISLAND_M or not _is_inner(course, former, latter):
        return None
    if abs(angle) <= STRAIGHT_DEG:
        if same and came.known:
            return []
        if between_m > ASIDE_M or same_side:
            return None
        side = Modifier.SLIGHT_RIGHT if turns[0] > 0.0 else Modifier.SLIGHT_LEFT
        return [replace(former, type=StepType.TURN, modifier=side, after_deg=latter.after_deg, named=latter.named)]
    if same_side and abs(turns[0] + turns[1]) > ONE_TURN_DEG:
        return None
    kind = StepType.CONTINUE if same and came.known else StepType.TURN
    return [replace(former, type=kind, modifier=modifier_of(angle), after_deg=latter.after_deg, named=latter.named)]


def _is_inner(course: Course, former: Manoeuvre, latter: Manoeuvre) -> bool:
    """Whether the links between two manoeuvres belong to the junction: no road of a name of its own."""
    came, taken = course.label(former.at), course.label(latter.named)
    for k in range(former.at + 1, latter.at + 1):
        label = course.label(k)
        if label.known and not same_road(label, came) and not same_road(label, taken):
            return False
    return True


def _names(course: Course, found: list[Manoeuvre]) -> list[Manoeuvre]:
    """Without names that change beside a manoeuvre, or for a moment only."""
    result: list[Manoeuvre] = []
    for manoeuvre in found:
        if not result:
            result.append(manoeuvre)
            continue
        before = result[-1]
        between_m = course.at_m[manoeuvre.at + 1] - course.at_m[before.at + 1]
        if manoeuvre.type is StepType.NEW_NAME:
            if before.type is StepType.NEW_NAME and between_m <= SHORT_NAME_M:
                was = course.label(before.at)
                if same_road(was, course.label(manoeuvre.named)):
                    result.pop()
                    continue
            if between_m <= NAME_M and before.type not in _KEPT:
                result[-1] = _named(course, before, manoeuvre.named)
                continue
        elif before.type is StepType.NEW_NAME and between_m <= NAME_M:
            result.pop()
        result.append(manoeuvre)
    return result


def _named(course: Course, manoeuvre: Manoeuvre, named: int) -> Manoeuvre:
    """A manoeuvre that tells the name of a link further on."""
    if manoeuvre.type is StepType.CONTINUE and not same_road(course.label(manoeuvre.at), course.label(named)):
        return replace(manoeuvre, type=StepType.TURN, named=named)
    return replace(manoeuvre, named=named)
