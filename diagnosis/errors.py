"""Errors that the diagnosis package raises, with their facts as attributes."""

from __future__ import annotations


class DiagnosisError(Exception):
    """Root of what the diagnosis package raises."""


class TripTableError(DiagnosisError):
    """A trip table that can't be read: names file, line (in JSON: entry), column, value and what is allowed."""

    def __init__(self, path: str, line: int, column: str, value: str, allowed: str, *, unit: str = "line") -> None:
        self.path = path
        self.line = line
        self.column = column
        self.value = value
        self.allowed = allowed
        super().__init__(f"{path}, {unit} {line}: {column} is {value}, allowed: {allowed}")


class ComparisonError(DiagnosisError):
    """Trips that can't be compared: names the field, its value and what is allowed."""

    def __init__(self, field: str, value: str, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field} is {value}, allowed: {allowed}")


class DiagnosisCancelled(DiagnosisError):  # noqa: N818 - it is no fault of the input
    """A diagnosis that was stopped before its end because its caller asked for it."""
