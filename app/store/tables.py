"""The tables of the database."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import DateTime, Float, Integer, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

MAX_ID_CHARS = 100
MAX_KIND_CHARS = 40
MAX_STATE_CHARS = 20
MAX_STAGE_CHARS = 100
MAX_WORKER_CHARS = 300


class Base(DeclarativeBase):
    """Root of all tables."""


class VehicleRow(Base):
    """One stored vehicle: its document as JSON text, and what can be seen of it without reading that."""

    __tablename__ = "vehicles"

    id: Mapped[str] = mapped_column(String(MAX_ID_CHARS), primary_key=True)
    kind: Mapped[str] = mapped_column(String(MAX_KIND_CHARS))
    name: Mapped[str] = mapped_column(Text)
    document: Mapped[str] = mapped_column(Text)  # not a JSON column: a damaged one must not break reading the others
    created: Mapped[datetime] = mapped_column(DateTime(timezone=True))  # UTC
    updated: Mapped[datetime] = mapped_column(DateTime(timezone=True))  # UTC


class DiagnosisRow(Base):
    """One diagnosis: what was asked, how far it is, and what it says; documents are JSON text, the report is HTML."""

    __tablename__ = "diagnoses"

    id: Mapped[str] = mapped_column(String(MAX_ID_CHARS), primary_key=True)
    state: Mapped[str] = mapped_column(String(MAX_STATE_CHARS))
    stage: Mapped[str] = mapped_column(String(MAX_STAGE_CHARS))
    progress_frac: Mapped[float] = mapped_column(Float)
    worker: Mapped[str] = mapped_column(String(MAX_WORKER_CHARS))  # host and process that carries it out
    vehicle: Mapped[str] = mapped_column(String(MAX_ID_CHARS))
    request: Mapped[str] = mapped_column(Text)
    refused: Mapped[str | None] = mapped_column(Text)
    problem: Mapped[str | None] = mapped_column(Text)
    result: Mapped[str | None] = mapped_column(Text)
    report: Mapped[str | None] = mapped_column(Text)
    created: Mapped[datetime] = mapped_column(DateTime(timezone=True))  # UTC
    updated: Mapped[datetime] = mapped_column(DateTime(timezone=True))  # UTC; while it runs, its worker's sign of life
    recordings: Mapped[int | None] = mapped_column(Integer)  # None where it was queued before this was kept
    verdict: Mapped[str | None] = mapped_column(String(MAX_KIND_CHARS))
    text: Mapped[str | None] = mapped_column(Text)
    warnings: Mapped[str | None] = mapped_column(Text)
    residuals: Mapped[str | None] = mapped_column(Text)


class DiagnosisTripRow(Base):
    """One trip of a finished diagnosis along time; position: in the order of the answer, both documents are JSON text.

    The key is not the trip's id, of which two may look alike once they are text.
    """

    __tablename__ = "diagnosis_trips"

    diagnosis: Mapped[str] = mapped_column(String(MAX_ID_CHARS), primary_key=True)
    position: Mapped[int] = mapped_column(Integer, primary_key=True)
    trip: Mapped[str] = mapped_column(Text)
    outline: Mapped[str] = mapped_column(Text)
    timeline: Mapped[str] = mapped_column(Text)


class LearnedEffectsRow(Base):
    """Effects that a finished diagnosis has learned, under its id, as the document that requests take."""

    __tablename__ = "learned_effects"

    id: Mapped[str] = mapped_column(String(MAX_ID_CHARS), primary_key=True)
    vehicle: Mapped[str] = mapped_column(String(MAX_ID_CHARS))
    document: Mapped[str] = mapped_column(Text)
    created: Mapped[datetime] = mapped_column(DateTime(timezone=True))  # UTC
