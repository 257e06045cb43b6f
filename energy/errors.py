"""Errors that the energy package raises, with their facts as attributes, and what all refusals of input share."""

from __future__ import annotations

from difflib import get_close_matches
from typing import ClassVar, Final

MOST_NAMED: Final = 10  # ids that the error of an unknown vehicle names
INLINE_ID: Final = "inline"  # of a vehicle that a request describes
LEAST_LIKE: Final = 0.3  # difflib's ratio of an id that is like another


class Refusal(Exception):  # noqa: N818 - it says what is refused, and errors of every package are refusals
    """A value that is not taken: names the field, the value and what is allowed.

    Input errors of every package derive from it. code: stable name of its kind in answers, empty for a value that no
    request can hold. subject: what the message says of the field beyond its name. message: in place of the usual form.
    """

    code: ClassVar[str] = ""

    def __init__(self, field: str, value: object, allowed: str, *, subject: str = "", message: str = "") -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(message or f"{subject or field} is {value}, allowed: {allowed}")

    @property
    def request_field(self) -> str:
        """Path of the field in a request."""
        return self.field


class EnergyError(ValueError):
    """Root of what the energy package raises."""


class VehicleError(Refusal, EnergyError):
    """A vehicle that cannot be; one of id `INLINE_ID` is a part of a request, and named by its path there."""

    code = "invalid_vehicle"

    def __init__(self, field: str, value: object, allowed: str, vehicle_id: str = "") -> None:
        self.vehicle_id = vehicle_id
        subject = f"{field} of vehicle {vehicle_id!r}" if vehicle_id else field
        super().__init__(field, value, allowed, subject=f"vehicle.{field}" if vehicle_id == INLINE_ID else subject)

    @property
    def request_field(self) -> str:
        """The field itself of a vehicle that is the whole body, else below `vehicle`."""
        return self.field if self.vehicle_id not in ("", INLINE_ID) else f"vehicle.{self.field}"


class VehicleNotFoundError(Refusal, EnergyError):
    """No vehicle of that id is known. known: all ids; where they are many, the message names those most like it."""

    code = "unknown_vehicle"

    def __init__(self, vehicle_id: str, known: tuple[str, ...]) -> None:
        self.vehicle_id = vehicle_id
        self.known = known
        named = known
        if len(known) > MOST_NAMED:
            named = tuple(get_close_matches(vehicle_id, known, n=MOST_NAMED, cutoff=LEAST_LIKE)) or known[:MOST_NAMED]
        names = ", ".join(named)
        if len(named) < len(known):
            names = f"{names} and {len(known) - len(named)} more"
        super().__init__(
            "vehicle", vehicle_id, f"one of {names}", message=f"vehicle {vehicle_id!r} is unknown, known: {names}"
        )


class LinkError(Refusal, EnergyError):
    """A link that cannot be driven, with its position in the chain."""

    code = "invalid_link"

    def __init__(self, field: str, position: int, value: object, allowed: str) -> None:
        self.position = position
        super().__init__(field, value, allowed, subject=f"{field} of link {position}")

    @property
    def request_field(self) -> str:
        """The field of the link at its position."""
        return f"links[{self.position}].{self.field}"


class ChargeError(Refusal, EnergyError):
    """A charge, time or capacity that no charging has; requests are refused before they come so far."""


class ConditionsError(Refusal, EnergyError):
    """Conditions or effect coefficients out of range."""

    code = "invalid_conditions"
