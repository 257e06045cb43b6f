"""The effects that diagnoses have learned, as requests choose them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from pydantic import ValidationError

from app.conversions.vehicle import INLINE_ID
from app.errors.validation import validation_detail
from app.schemas.learned_effects import LearnedEffects
from app.store.errors import DiagnosisDamagedError, EffectsNotFoundError

if TYPE_CHECKING:
    from app.schemas.learned_effects import EffectsChoice
    from app.store.diagnoses import LearnedEffectsStore

DIAGNOSIS_ID_PATTERN: Final = r"^[a-z0-9-]{1,100}$"
NEAR_K: Final = 3.0  # beyond the temperatures that were driven at, within which nothing is said
CANNOT_TELL: Final = "cannot_tell"  # diagnosis.answer.results.Verdict, which takes a while to import
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


def warnings_of(effects: LearnedEffects | None, vehicle_id: str, ambient_c: float | None = None) -> tuple[str, ...]:
    """What is to be said of learned effects: of another vehicle, at other temperatures, or of causes left open."""
    learned_from = None if effects is None else effects.learned_from
    if learned_from is None:
        return ()
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
        found.append("the effects were learned from drives that could not tell their causes apart")
    return tuple(found)
