"""Which manoeuvre a junction is, after the rules of OSRM's public documentation; nothing where the way is obvious."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from routing.guidance.bearings import PLAIN_DEG, SLIGHT_DEG, STRAIGHT_DEG, modifier_of
from routing.guidance.step import Modifier, StepType
from routing.guidance.surroundings import LINK, MOTORWAY, RAMP

if TYPE_CHECKING:
    from routing.guidance.manoeuvre import Arm, Crossing

# Assumed, as are the numbers of the documentation's own rules: what people take as the same road, by eye.
APART_DEG: Final = 30.0  # by how much a road must be straighter than others for nobody to ask
TIMES_STRAIGHTER: Final = 2.0
BEND_DEG: Final = 45.0  # a road that bends more is not obvious where another could be taken
FORK_DEG: Final = 45.0  # how far both branches of a fork may lead to the side
FORK_SPREAD_DEG: Final = 60.0  # between them
END_DEG: Final = 40.0  # the least turn to either side where a road ends
BACK_DEG: Final = 150.0
WIDE_BEND_DEG: Final = 75.0  # a road that keeps its name may bend so far where the only other road leads back
HAIRPIN_DEG: Final = 110.0
MERGE_DEG: Final = 60.0
DEAD_AHEAD_DEG: Final = 10.0  # by which a road that keeps its name has to be straighter than others, at least
SERVICE: Final = 7  # rank of service roads
SMALLER: Final = 2  # in ranks
MUCH_SMALLER: Final = 3
ANGLE_SLACK_DEG: Final = 60.0  # up to which a road stays the obvious one where others are much smaller

Found = tuple[StepType, Modifier]


def manoeuvre_at(crossing: Crossing) -> Found | None:
    """What is done at a junction of roads that are no rings, None where the way on is obvious."""
    came, taken = crossing.came, crossing.taken
    found = _ramp(crossing)
    if found is not None:
        return found
    if _merges(crossing):
        return StepType.MERGE, _merge_side(crossing)
    if is_obvious(crossing, taken):
        return None
    rivals = [arm for arm in crossing.others if arm.entry and _is_fork(taken, arm, crossing)]
    if rivals:
        return StepType.FORK, _fork_side(taken, rivals)
    if came.bits & MOTORWAY and taken.bits & LINK:
        return StepType.OFF_RAMP, _side(crossing)
    if taken.same:
        back = abs(taken.turn_deg) >= BACK_DEG  # onto the other carriageway
        return StepType.CONTINUE, Modifier.UTURN if back else modifier_of(taken.turn_deg)
    if _road_ends(crossing):
        return StepType.END_OF_ROAD, modifier_of(taken.turn_deg)
    return StepType.TURN, modifier_of(taken.turn_deg)


def is_obvious(crossing: Crossing, taken: Arm) -> bool:
    """Whether a driver who is told nothing takes this road."""
    size = abs(taken.turn_deg)
    others = [arm for arm in (crossing.taken, *crossing.others) if arm is not taken]
    open_ = [arm for arm in others if arm.entry]
    if not others:
        return True
    if not open_:
        return size <= BEND_DEG or _bends_along(crossing, taken, others)
    return all(_loses(arm, taken, crossing) for arm in open_)


def _bends_along(crossing: Crossing, taken: Arm, closed: list[Arm]) -> bool:
    """Whether a road bends where no other may be driven into: it stays one road, and all others are smaller."""
    if any(abs(arm.turn_deg) <= SLIGHT_DEG for arm in closed):
        return False  # traffic comes from ahead: it looks as if the road went on there
    same = taken.same or (not taken.label.known and not crossing.came.label.known)
    return same and all(arm.rank > taken.rank for arm in closed)


def _loses(arm: Arm, taken: Arm, crossing: Crossing) -> bool:
    """Whether nobody would take a road for the way on who could take the other."""
    size, other = abs(taken.turn_deg), abs(arm.turn_deg)
    slip = bool(arm.bits & LINK) and not taken.bits & LINK
    smaller = arm.rank - taken.rank
    if slip and size <= SLIGHT_DEG:
        return True
    if arm.rank >= SERVICE and taken.rank < SERVICE and size <= ANGLE_SLACK_DEG:
        return size <= BEND_DEG or taken.same
    if smaller >= MUCH_SMALLER and size <= BEND_DEG:
        return True
    if arm.same and not taken.same and other <= BEND_DEG and smaller <= 0:
        return False  # the road itself goes on there
    clear = (taken.same and not arm.same and smaller >= 0) or (smaller >= SMALLER and taken.same >= arm.same)
    if clear and size <= STRAIGHT_DEG and other - size >= max(DEAD_AHEAD_DEG, size):
        return True
    if taken.same and not arm.same and smaller >= 0 and size <= WIDE_BEND_DEG and other >= HAIRPIN_DEG:
        return True
    if size > BEND_DEG:
        return False
    if other - size >= APART_DEG and other >= TIMES_STRAIGHTER * size:
        return True
    return taken.same and not arm.same and smaller > 0 and size <= SLIGHT_DEG and size <= other + STRAIGHT_DEG


def _ramp(crossing: Crossing) -> Found | None:
    came, taken = crossing.came, crossing.taken
    if not taken.bits & RAMP or came.bits & RAMP:
        return None
    open_ = any(arm.entry for arm in crossing.others)
    if came.bits & MOTORWAY:
        return (StepType.OFF_RAMP, _side(crossing)) if open_ else None
    return StepType.ON_RAMP, _side(crossing) if open_ else modifier_of(taken.turn_deg)


def _side(crossing: Crossing) -> Modifier:
    """The turn onto a road; nearly straight ones to the side on which it lies of the straightest other road."""
    taken = crossing.taken
    if abs(taken.turn_deg) > SLIGHT_DEG:
        return modifier_of(taken.turn_deg)
    open_ = [arm for arm in crossing.others if arm.entry and abs(arm.turn_deg) <= PLAIN_DEG]
    if not open_:
        return modifier_of(taken.turn_deg)
    rival = min(open_, key=lambda arm: abs(arm.turn_deg))
    return Modifier.SLIGHT_RIGHT if taken.turn_deg > rival.turn_deg else Modifier.SLIGHT_LEFT


def _merges(crossing: Crossing) -> bool:
    """Whether a slip road or ramp joins the traffic of a road."""
    came, taken = crossing.came, crossing.taken
    if not came.bits & LINK or taken.bits & LINK or abs(taken.turn_deg) > MERGE_DEG:
        return False
    return _main(crossing) is not None and not any(arm.entry for arm in crossing.others)


def _main(crossing: Crossing) -> Arm | None:
    """The road that comes from beside and goes on as the taken one."""
    taken = crossing.taken
    for arm in crossing.others:
        straight = abs((arm.turn_deg - taken.turn_deg) % 360.0 - 180.0)
        if arm.leads_in and not arm.entry and not arm.bits & LINK and straight <= SLIGHT_DEG:
            return arm
    return None


def _merge_side(crossing: Crossing) -> Modifier:
    main = _main(crossing)
    assert main is not None
    return Modifier.SLIGHT_LEFT if main.turn_deg < 0.0 else Modifier.SLIGHT_RIGHT


def _is_fork(taken: Arm, arm: Arm, crossing: Crossing) -> bool:
    """Whether a road and the taken one are the branches of a fork: both ahead, near each other, of like importance."""
    if abs(taken.turn_deg) > FORK_DEG or abs(arm.turn_deg) > FORK_DEG:
        return False
    if abs(taken.turn_deg - arm.turn_deg) > FORK_SPREAD_DEG or is_obvious(crossing, arm):
        return False
    return abs(arm.rank - taken.rank) < MUCH_SMALLER and bool(arm.bits & LINK) == bool(taken.bits & LINK)


def _fork_side(taken: Arm, rivals: list[Arm]) -> Modifier:
    to_the_left = sum(arm.turn_deg < taken.turn_deg for arm in rivals)
    if 0 < to_the_left < len(rivals):
        return Modifier.STRAIGHT
    return Modifier.SLIGHT_RIGHT if to_the_left else Modifier.SLIGHT_LEFT


def _road_ends(crossing: Crossing) -> bool:
    """Whether a road ends at another that runs across: nothing ahead, one way to either side."""
    turn = crossing.taken.turn_deg
    sides = [arm.turn_deg for arm in crossing.others if not arm.same]  # to which the road itself does not bend
    if not END_DEG <= abs(turn) <= 180.0 - END_DEG or len(sides) != 1 or len(crossing.others) != 1:
        return False
    return turn * sides[0] < 0.0 and END_DEG <= abs(sides[0]) <= 180.0 - END_DEG
