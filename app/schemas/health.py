"""Whether the service lives and can answer."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from app.schemas.base import Answered


class Alive(Answered):
    """The process answers."""

    status: Literal["ok"] = "ok"


class GraphReadiness(Answered):
    """One graph."""

    name: str
    loaded: bool
    version: str | None = Field(description="names the contents of the graph; null before it is loaded")


class DatabaseReadiness(Answered):
    """The database of vehicles and diagnoses."""

    reachable: bool
    reason: str | None = Field(description="why it can't be read; null where it can")


class Ready(Answered):
    """Graphs are loaded and kernels compiled; without its database the service answers on bundled vehicles."""

    status: Literal["ready"] = "ready"
    version: str
    graphs: list[GraphReadiness]
    database: DatabaseReadiness
    vehicle_count: int = Field(description="bundled vehicles; those of the database are not counted")
