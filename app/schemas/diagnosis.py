"""Diagnoses: what is asked, how far each is, and what it says."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any, Final

from pydantic import Field

from app.schemas.base import Answered, Count, Number, Sent
from app.schemas.problem import Problem
from app.schemas.vehicle import VehicleChoice
from app.store.diagnoses import DiagnosisState
from diagnosis.holdout import MOST_FRAC

MAX_PATTERNS: Final = 1000
MAX_RECORDINGS: Final = 10_000
Pattern = Annotated[str, Field(min_length=1, max_length=200)]
RecordingPath = Annotated[str, Field(min_length=1, max_length=1000)]


class DiagnosisOptions(Sent):
    """How recordings are to be diagnosed; unknown fields are errors."""

    vehicle: VehicleChoice | None = Field(
        default=None, description="the vehicle that was driven, given by its physics; without it, the default vehicle"
    )
    hide: list[Pattern] = Field(
        default=[],
        max_length=MAX_PATTERNS,
        description="columns that are dropped while reading, by name or pattern such as `*Heat*`, letter case aside",
    )
    holdout: list[Pattern] = Field(
        default=[],
        max_length=MAX_PATTERNS,
        description="trips kept out of the fit, by id or pattern; a trip's id is its file's name without the ending",
    )
    holdout_fraction: Number = Field(
        default=0.0, ge=0, le=MOST_FRAC, description="share of all trips that is drawn to be kept out as well"
    )
    seed: Count = Field(default=1, ge=0, le=2**31 - 1, description="the same seed draws the same")


class DiagnosisRequest(DiagnosisOptions):
    """A diagnosis of recordings that lie on the server."""

    recordings: list[RecordingPath] = Field(
        min_length=1,
        max_length=MAX_RECORDINGS,
        description="files, folders or patterns below the configured folder of recordings",
    )


class RefusedRecording(Answered):
    """A file that could not be used."""

    file: str
    error: str = Field(description="what is wrong, where in the file, and what is allowed")


class DiagnosisLinks(Answered):
    """Paths of what belongs to a diagnosis."""

    self: str
    report: str | None = Field(description="HTML page; null until it is done")
    effects: str | None = Field(description="effects.json; null until it is done")


class DiagnosisSummary(Answered):
    """How far a diagnosis is."""

    id: str = Field(description="once it is done, also the id of its `effects` in requests")
    state: DiagnosisState
    stage: str = Field(description="what is being done; empty unless it runs")
    progress: float = Field(description="share of the work that is done, 0..1")
    vehicle: str = Field(description="id of the vehicle, `inline` for one that was sent")
    created: datetime
    links: DiagnosisLinks


class DiagnosisAnswer(DiagnosisSummary):
    """A diagnosis with what it says."""

    request: DiagnosisRequest = Field(description="as understood; of uploaded recordings, the names of the files")
    refused: list[RefusedRecording] = Field(description="files that could not be used and were left aside")
    problem: Problem | None = Field(description="why it failed; null unless it did")
    result: dict[str, Any] | None = Field(description="the object of diagnosis.json; null until it is done")


class DiagnosisList(Answered):
    """All diagnoses, the latest first."""

    diagnoses: list[DiagnosisSummary]
