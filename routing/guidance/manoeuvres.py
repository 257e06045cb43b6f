"""The manoeuvres of a leg of a route, junction by junction, before neighbours are joined."""

from __future__ import annotations

from typing import TYPE_CHECKING

from routing.guidance.bearings import modifier_of, turned_deg
from routing.guidance.labels import same_road
from routing.guidance.manoeuvre import Manoeuvre
from routing.guidance.roundabouts import (
    Ring,
    entering,
    exit_number,
    kind_of,
    mini_exit_number,
    name_of,
    ring_of,
    small_turn,
)
from routing.guidance.rules import manoeuvre_at
from routing.guidance.step import Modifier, StepType
from routing.guidance.surroundings import RING

if TYPE_CHECKING:
    from routing.guidance.course import Course


def manoeuvres_of(course: Course, first: int, last: int) -> list[Manoeuvre]:
    """Those between two links of a route, by their positions, at the ends of all but the last."""
    found: list[Manoeuvre] = []
    current = course.label_from(first, last)
    entry: int | None = None
    ring: Ring | None = None
    passed: list[int] = []
    for at in course.met(first, last):
        here, there = course.bits[at] & RING, course.bits[at + 1] & RING
        if there:
            if not here:
                entry, passed, ring = at, [], ring_of(course.graph, course.links[at + 1])
            elif ring is not None and course.links[at + 1] not in ring.links:  # another one that touches it
                found += _roundabout(course, entry, passed, at)[:1]
                entry, passed, ring = at, [], ring_of(course.graph, course.links[at + 1])
            else:
                passed.append(at)
            continue
        if here:
            found += _roundabout(course, entry, passed, at)
            entry = None
            current = course.label_from(at + 1, last)
            continue
        manoeuvre = _plain(course, at)
        following = course.label(at + 1)
        if manoeuvre is None and following.known and not same_road(current, following):
            manoeuvre = _made(course, at, StepType.NEW_NAME, None)
        if manoeuvre is not None:
            found.append(manoeuvre)
            current = course.label_from(at + 1, last)
        elif not current.known:
            current = following
    if entry is not None:
        found += _roundabout(course, entry, passed, None)
    return found


def _made(course: Course, at: int, kind: StepType, modifier: Modifier | None) -> Manoeuvre:
    before, after = course.before_deg(at), course.after_deg(at)
    return Manoeuvre(at, kind, modifier or modifier_of(turned_deg(before, after)), before, after, at + 1)


def _plain(course: Course, at: int) -> Manoeuvre | None:
    """The manoeuvre at a junction of roads that are no rings, None where the way is obvious."""
    if course.ferry[at] != course.ferry[at + 1]:
        return _made(course, at, StepType.NOTIFICATION, None)
    if at in course.mini and course.roads[at] > 2:
        return _mini(course, at)
    if course.links[at + 1] == course.graph.reverse_idx[course.links[at]]:
        kind = StepType.CONTINUE if course.label(at).known else StepType.TURN
        return _made(course, at, kind, Modifier.UTURN)
    if at in course.clear or course.roads[at] < 2:
        return None
    crossing = course.crossing(at)
    found = None if crossing is None else manoeuvre_at(crossing)
    return None if found is None else _made(course, at, *found)


def _mini(course: Course, at: int) -> Manoeuvre:
    """A mini roundabout, which is a node of the map, told as a turn with the number of its exit."""
    arms, following = course.arms(at), course.links[at + 1]
    clockwise = course.graph.signs is not None and course.graph.signs.drives_left
    before, after = course.before_deg(at), course.after_deg(at)
    if following == course.graph.reverse_idx[course.links[at]]:
        exit_idx, modifier = sum(arm.entry for _, arm in arms) + 1, Modifier.UTURN
    else:
        exit_idx = mini_exit_number(arms, following, clockwise=clockwise)
        modifier = modifier_of(turned_deg(before, after))
    return Manoeuvre(at, StepType.ROUNDABOUT_TURN, modifier, before, after, at + 1, exit_idx)


def _roundabout(course: Course, entry: int | None, passed: list[int], leave: int | None) -> list[Manoeuvre]:
    """Entering a roundabout and leaving it; entry, leave: where, None where the leg begins or ends on it."""
    graph = course.graph
    ring = ring_of(graph, course.links[leave if entry is None else entry + 1])
    clockwise = graph.signs is not None and graph.signs.drives_left if ring is None else ring.clockwise
    rotary = "" if ring is None else name_of(graph, course.labels, ring)
    exit_idx: int | None = None
    small: Modifier | None = None
    if leave is not None and entry is not None:
        before = [course.arms(k) for k in passed]
        exit_idx = exit_number(before, course.arms(leave), course.links[leave + 1], ring, clockwise=clockwise)
        exit_idx += course.left_out_exits(entry + 1, leave)
        if ring is not None and not rotary:
            entry_node, exit_node = (int(graph.head[course.links[k]]) for k in (entry, leave))
            small = small_turn(graph, ring, entry_node, exit_node, course.links[leave + 1])
    kind = kind_of(rotary, small)
    found = []
    if entry is not None:
        before_deg, after_deg = course.before_deg(entry), course.after_deg(entry)
        turn = 0.0 if course.bits[entry] & RING else turned_deg(before_deg, after_deg)  # one ring runs against another
        modifier = small or entering(turn, clockwise=clockwise)
        named = entry + 1 if leave is None else leave + 1
        found.append(Manoeuvre(entry, kind, modifier, before_deg, after_deg, named, exit_idx, rotary))
    if leave is not None and kind is not StepType.ROUNDABOUT_TURN:
        leaving = StepType.EXIT_ROTARY if kind is StepType.ROTARY else StepType.EXIT_ROUNDABOUT
        made = _made(course, leave, leaving, None)
        found.append(
            Manoeuvre(made.at, leaving, made.modifier, made.before_deg, made.after_deg, made.named, exit_idx, rotary)
        )
    return found
