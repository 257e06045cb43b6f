"""Errors that the energy package raises, with their facts as attributes."""

from __future__ import annotations


class EnergyError(ValueError):
    """Root of what the energy package raises."""


class VehicleError(EnergyError):
    """A vehicle that cannot be: names the field, its value and the allowed range."""

    def __init__(self, field: str, value: object, allowed: str, vehicle_id: str = "") -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        self.vehicle_id = vehicle_id
        of = f" of vehicle {vehicle_id!r}" if vehicle_id else ""
        super().__init__(f"{field}{of} is {value}, allowed: {allowed}")


class VehicleNotFoundError(EnergyError):
    """No vehicle of that id is known."""

    def __init__(self, vehicle_id: str, known: tuple[str, ...]) -> None:
        self.vehicle_id = vehicle_id
        self.known = known
        super().__init__(f"vehicle {vehicle_id!r} is unknown, known: {', '.join(known)}")


class LinkError(EnergyError):
    """A link that cannot be driven: names the field, its position in the chain, its value and the range."""

    def __init__(self, field: str, position: int, value: object, allowed: str) -> None:
        self.field = field
        self.position = position
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} of link {position} is {value}, allowed: {allowed}")


class ConditionsError(EnergyError):
    """Conditions or effect coefficients out of range: names the field, its value and the allowed range."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} is {value}, allowed: {allowed}")
