"""Why a diagnosis can't be begun, carried out or shown, with the facts as attributes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from energy.errors import Refusal

if TYPE_CHECKING:
    from collections.abc import Sequence


def storable(text: str) -> str:
    """A text that any file and database takes: recordings may hold lone surrogates and null characters."""
    return text.encode("utf-8", "replace").decode("utf-8").replace("\0", "\ufffd")


@dataclass(frozen=True, slots=True)
class RefusedFile:
    """A file that could not be used, and why."""

    file: str
    error: str


class DiagnosingError(Exception):
    """Root of what this package raises."""


class UnusableRecordingsError(DiagnosingError):
    """None of the files is a recording that can be used."""

    def __init__(self, refused: Sequence[RefusedFile]) -> None:
        self.refused = tuple(refused)
        listed = "; ".join(file.error for file in self.refused)
        super().__init__(f"no recording can be used: {listed}")


class SourceError(Refusal, DiagnosingError):
    """Files, folders or patterns of recordings that can't be taken: names the field, its value and what is allowed."""

    code = "invalid_request"

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(field, value, allowed, message=f"{field} is {value!r}, allowed: {allowed}")


class TooManyDiagnosesError(DiagnosingError):
    """So many diagnoses are queued or running that no further one is taken."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        super().__init__(f"{limit} diagnoses are queued or running already, allowed: at most {limit}; try again later")


class TooManyUploadsError(TooManyDiagnosesError):
    """So many uploads are arriving that no further one is read; whose: those that are counted."""

    def __init__(self, limit: int, whose: str) -> None:
        self.limit = limit
        Exception.__init__(
            self, f"{limit} uploads {whose} are arriving already, allowed: at most {limit} at a time; try again later"
        )


class DiagnosisNotDoneError(Refusal, DiagnosingError):
    """Something that only a finished diagnosis has."""

    code = "diagnosis_not_done"

    def __init__(self, diagnosis_id: str, state: str) -> None:
        self.diagnosis_id = diagnosis_id
        self.state = state
        super().__init__(
            "id",
            diagnosis_id,
            f"a diagnosis that is done, this is {state}",
            message=f"diagnosis {diagnosis_id!r} is {state}, allowed: done",
        )


class DiagnosisInterruptedError(DiagnosingError):
    """A diagnosis whose worker stopped before the end."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"interrupted: {reason}; send the recordings again")


class DiagnosisLimitError(DiagnosingError):
    """A diagnosis that takes more than one may: memory or time."""

    def __init__(self, what: str, limit: str, setting: str) -> None:
        self.limit = limit
        super().__init__(
            f"the diagnosis takes more {what} than {limit}, allowed: at most that ({setting}); send fewer drives,"
            " shorter ones, or without columns that are not needed"
        )


class UploadsFullError(DiagnosingError):
    """Uploaded files that can't be stored, most often since the disk is full."""

    def __init__(self, error: OSError) -> None:
        self.reason = error.strerror or str(error)
        super().__init__(f"the uploaded files can't be stored ({self.reason}); try again later, or send fewer drives")


class MalformedFormError(DiagnosingError):
    """A multipart body that can't be read."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"the multipart body can't be read: {reason}")


class UnsupportedMediaTypeError(Refusal, DiagnosingError):
    """A body of a kind that is not read."""

    code = "unsupported_media_type"

    def __init__(self, media_type: str) -> None:
        self.media_type = media_type
        allowed = "multipart/form-data, application/json"
        message = f"Content-Type is {media_type!r}, allowed: {allowed}"
        super().__init__("Content-Type", media_type, allowed, message=message)
