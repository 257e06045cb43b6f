"""The tables of the database."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import DateTime, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

MAX_ID_CHARS = 100
MAX_KIND_CHARS = 40


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
