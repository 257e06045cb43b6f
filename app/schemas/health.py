"""Whether the service lives and can answer."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from app.schemas.base import Answered


class Alive(Answered):
    """The process answers."""

    status: Literal["ok"] = "ok"


class Ready(Answered):
    """Graphs are loaded and kernels compiled."""

    status: Literal["ready"] = "ready"
    version: str
    graphs: list[str]
    vehicle_count: int = Field(description="bundled vehicles; those of the database are not counted")
