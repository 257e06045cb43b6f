"""Errors of the store, with their facts as attributes."""

from __future__ import annotations

from typing import Final

from energy.errors import Refusal

READABLE_DIAGNOSIS: Final = "the id of a diagnosis that can be read"


class StoreError(Exception):
    """Root of what the store raises."""


class DatabaseUnavailableError(StoreError):
    """The database can't be created, reached, read or written; `database` is its URL without the password."""

    def __init__(self, database: str, reason: str) -> None:
        self.database = database
        self.reason = reason
        super().__init__(f"the vehicle database {database} is not available: {reason}")


class StorageFullError(DatabaseUnavailableError):
    """A change of the database for which its disk has no space."""


class ConflictError(DatabaseUnavailableError):
    """A change that contradicts what is stored, as when two store something under one id at the same time."""


class VehicleDamagedError(Refusal, StoreError):
    """A stored vehicle that can't be read."""

    code = "vehicle_damaged"

    def __init__(self, vehicle_id: str, reason: str) -> None:
        self.vehicle_id = vehicle_id
        self.reason = reason
        super().__init__(
            "vehicle",
            vehicle_id,
            "a stored vehicle that can be read",
            message=f"stored vehicle {vehicle_id!r} can't be read: {reason}; store it again or remove it",
        )


class VehicleIsBundledError(Refusal, StoreError):
    """A change of a vehicle that comes with joulepath."""

    code = "vehicle_is_bundled"

    def __init__(self, vehicle_id: str) -> None:
        self.vehicle_id = vehicle_id
        super().__init__(
            "id",
            vehicle_id,
            "the id of no bundled vehicle",
            message=f"vehicle {vehicle_id!r} is bundled and can't be changed; store a copy under another id",
        )


class DiagnosisNotFoundError(Refusal, StoreError):
    """No diagnosis of that id."""

    code = "unknown_diagnosis"

    def __init__(self, diagnosis_id: str) -> None:
        self.diagnosis_id = diagnosis_id
        super().__init__("id", diagnosis_id, READABLE_DIAGNOSIS, message=f"diagnosis {diagnosis_id!r} is unknown")


class TripNotFoundError(Refusal, StoreError):
    """No trip of that id in a diagnosis."""

    code = "unknown_trip"

    def __init__(self, diagnosis_id: str, trip: str) -> None:
        self.diagnosis_id = diagnosis_id
        self.trip = trip
        super().__init__(
            "trip",
            trip,
            f"an id of GET /diagnoses/{diagnosis_id}/trips",
            message=f"trip {trip!r} of diagnosis {diagnosis_id!r} is unknown",
        )


class DiagnosisDamagedError(Refusal, StoreError):
    """A stored diagnosis, or the effects that it has learned, that can't be read."""

    code = "diagnosis_damaged"

    def __init__(self, diagnosis_id: str, reason: str) -> None:
        self.diagnosis_id = diagnosis_id
        self.reason = reason
        super().__init__(
            "id",
            diagnosis_id,
            READABLE_DIAGNOSIS,
            message=f"stored diagnosis {diagnosis_id!r} can't be read: {reason}; remove it",
        )


class EffectsNotFoundError(Refusal, StoreError):
    """No learned effects of that id; `known` are the latest there are."""

    code = "unknown_effects"

    def __init__(self, effects_id: str, known: tuple[str, ...]) -> None:
        self.effects_id = effects_id
        self.known = known
        names = ", ".join(known) if known else "none, since no diagnosis is finished"
        super().__init__(
            "effects",
            effects_id,
            "the id of a finished diagnosis, or an object",
            message=f"effects {effects_id!r} are unknown, known: {names}",
        )
