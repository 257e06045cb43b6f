"""Errors that the diagnosis package raises, with their facts as attributes."""

from __future__ import annotations

from energy.errors import Refusal


class DiagnosisError(Exception):
    """Root of what the diagnosis package raises."""


class TripTableError(DiagnosisError, Refusal):
    """A trip table that can't be read: names file, line (in JSON: entry), column, value and what is allowed."""

    def __init__(self, path: str, line: int, column: str, value: str, allowed: str, *, unit: str = "line") -> None:
        self.path = path
        self.line = line
        self.column = column
        super().__init__(column, value, allowed, subject=f"{path}, {unit} {line}: {column}")


class ComparisonError(DiagnosisError, Refusal):
    """Trips that can't be compared: names the field, its value and what is allowed."""


class DiagnosisCancelled(DiagnosisError):  # noqa: N818 - it is no fault of the input
    """A diagnosis that was stopped before its end because its caller asked for it."""
