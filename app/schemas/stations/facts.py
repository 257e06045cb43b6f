"""Facts of a charging station, wherever it is answered: sockets, price, source."""

from __future__ import annotations

from pydantic import Field

from app.schemas.base import Answered
from energy.charging.charging import Connector


class SocketAnswer(Answered):
    """Sockets of one kind at a station."""

    connector: Connector
    output_kw: float | None = Field(description="most of each [kW]; null where it is not known")
    count: int
    phases: int | None = Field(description="of alternating current; null of direct current and where not known")


class PriceAnswer(Answered):
    """What charging costs at a station."""

    text: str = Field(description="as the source says it")
    currency: str = Field(description="ISO 4217; empty where numbers were not understood")
    per_kwh: float | None
    per_min: float | None
    per_session: float | None


class StationSourceAnswer(Answered):
    """Where stations are from, and under which licence."""

    key: str
    name: str
    licence: str
    url: str
    retrieved: str = Field(description="date of the data, or empty")
