"""The effects that diagnoses have learned, as requests choose them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from pydantic import ValidationError

from app.errors.validation import validation_detail
from app.schemas.learned_effects import LearnedEffects
from app.store.errors import DiagnosisDamagedError, EffectsNotFoundError
from energy.errors import INLINE_ID

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.conversions.way_limits import WayLimits
    from app.schemas.learned_effects import EffectsChoice, LearnedFrom, OpenCause
    from app.store.diagnoses import LearnedEffectsStore

DIAGNOSIS_ID_PATTERN: Final = r"^[a-z0-9-]{1,100}$"
NEAR_K: Final = 3.0  # beyond the temperatures that were driven at, within which nothing is said
NEAR_KMH: Final = 5.0  # beyond the speeds, likewise
NEAR_GRADE: Final = 0.01  # beyond the grades, likewise
CANNOT_TELL: Final = "cannot_tell"  # diagnosis.answer.results.Verdict, which takes a while to import
TOO_FEW: Final = "too_few_trips"
NOTHING: Final = "all"  # in `not_carried`: why nothing is carried
NAMED_IN_ERRORS: Final = 20  # ids of learned effects that the error of an unknown one names


class LearnedEffectsShelf:
    """Learned effects by the id of their diagnosis, read from the database at every use."""

    def __init__(self, store: LearnedEffectsStore) -> None:
        self.store = store

    def chosen(self, choice: EffectsChoice | None) -> LearnedEffects | None:
        """The effects of a choice: those sent, or the stored ones of an id.

        Raises EffectsNotFoundError, DiagnosisDamagedError or DatabaseUnavailableError.
        """
        return self.find(choice) if isinstance(choice, str) else choice

    def find(self, effects_id: str) -> LearnedEffects:
        """Stored effects; raises as `chosen` does."""
        document = self.store.find(effects_id) if re.fullmatch(DIAGNOSIS_ID_PATTERN, effects_id) else None
        if document is None:
            raise EffectsNotFoundError(effects_id, tuple(self.store.ids(NAMED_IN_ERRORS)))
        try:
            return LearnedEffects.model_validate_json(document)
        except ValidationError as error:
            raise DiagnosisDamagedError(effects_id, validation_detail(error)) from error


def carries(effects: LearnedEffects) -> bool:
    """Whether effects change anything of a vehicle."""
    named = effects.model_dump(exclude={"learned_from", "parameters"}, exclude_none=True)
    numbers = {} if effects.parameters is None else effects.parameters.model_dump(exclude_none=True)
    return bool(named or numbers)


def uncertain_text(effects: LearnedEffects | None) -> str | None:
    """Which causes the drives behind carried effects could not tell apart, and what would tell; None where they could.

    Only where that is what the diagnosis says as a whole, which is where the command line and the page do not apply
    them unless they are told to.
    """
    learned_from = None if effects is None else effects.learned_from
    if effects is None or learned_from is None or learned_from.verdict != CANNOT_TELL or not carries(effects):
        return None
    return _open_text("their causes", learned_from.open_causes)


def warnings_of(effects: LearnedEffects | None, vehicle_id: str, ambient_c: float | None = None) -> tuple[str, ...]:
    """What is to be said of learned effects before anything is driven.

    That nothing is carried; that they are of another vehicle, at other temperatures, or of causes left open.
    """
    learned_from = None if effects is None else effects.learned_from
    if effects is None or learned_from is None:
        return ()
    nothing = None if carries(effects) else nothing_text(learned_from)
    if nothing is not None:
        return (nothing,)
    found = []
    if learned_from.vehicle not in (None, vehicle_id):
        asked = "an inline vehicle" if vehicle_id == INLINE_ID else f"vehicle {vehicle_id!r}"
        learned = "an inline vehicle" if learned_from.vehicle == INLINE_ID else f"vehicle {learned_from.vehicle!r}"
        found.append(f"the effects were learned on {learned}, this is {asked}")
    if learned_from.ambient_c is not None and ambient_c is not None:
        low, high = learned_from.ambient_c
        if not low - NEAR_K <= ambient_c <= high + NEAR_K:
            found.append(f"the effects were learned at {low:g} to {high:g} °C, this is {ambient_c:g} °C")
    if learned_from.verdict == CANNOT_TELL:
        found.append(f"the effects were learned from {_open_text('their causes', learned_from.open_causes)}")
    elif learned_from.open_causes:
        found.append(f"the effects were learned from {_open_text('some of their causes', learned_from.open_causes)}")
    return tuple(found)


def warnings_of_way(effects: LearnedEffects | None, limits: WayLimits | None) -> tuple[str, ...]:
    """What is to be said where ways are faster or steeper than those that effects were learned on, once each."""
    learned_from = None if effects is None else effects.learned_from
    if effects is None or learned_from is None or limits is None or not carries(effects):
        return ()
    found = []
    fastest = learned_from.speed_kmh
    if fastest is not None and limits.speed_kmh > fastest + NEAR_KMH:
        found.append(
            f"the effects were learned at up to {fastest:.0f} km/h, here up to {limits.speed_kmh:.0f} km/h are driven"
        )
    if learned_from.grade is not None:
        known_low, known_high = learned_from.grade
        low, high = limits.grade
        beyond = max(low, high, key=lambda grade: max(grade - known_high, known_low - grade))
        if not known_low - NEAR_GRADE <= beyond <= known_high + NEAR_GRADE:
            found.append(
                f"the effects were learned on grades of {100.0 * known_low:.1f} to {100.0 * known_high:.1f} %,"
                f" here are grades of {100.0 * beyond:.1f} %"
            )
    return tuple(found)


def nothing_text(learned_from: LearnedFrom) -> str | None:
    """That a diagnosis carries nothing, and why; None of what is no diagnosis' answer, which says of how many trips."""
    if NOTHING in learned_from.not_carried:
        reason = learned_from.not_carried[NOTHING]
    elif learned_from.verdict == TOO_FEW:
        reason = "there were too few drives to learn from"
    elif learned_from.trips is not None:
        reason = "the drives named nothing that routes could use"
    else:
        return None
    return f"nothing is carried by the effects, the vehicle is as its file has it: {reason}"


def _open_text(which: str, causes: Sequence[OpenCause]) -> str:
    named = [
        f"{_uncapped(cause.cause)} could as well be {' or '.join(map(_uncapped, cause.rivals))}"
        + (f"; what would tell: {_uncapped(cause.recording.rstrip('.'))}" if cause.recording else "")
        for cause in causes
    ]
    return f"drives that could not tell {which} apart{': ' if named else ''}{'. '.join(named)}"


def _uncapped(text: str) -> str:
    return text[:1].lower() + text[1:]
