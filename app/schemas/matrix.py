"""Drives from many places to many: what is asked, and what is answered."""

from __future__ import annotations

from typing import Annotated, ClassVar, TypeVar

from pydantic import Field, model_validator

from app.schemas.base import Answered, Flag, Fraction
from app.schemas.drive import SearchRequest
from app.schemas.graph import TerrainNote
from app.schemas.lean.form import COMPACT_MEANS
from app.schemas.lean.names import Picked, check_names
from app.schemas.place import MAX_PLACES, Place, Snapped
from app.schemas.route import WeightsSent
from routing.route.matrix import NotDriven

Figure = TypeVar("Figure")
Rows = Annotated[list[list[Figure]], Field(description="one row a source, in it one value a target")]


class MatrixRequest(SearchRequest):
    """One request for all drives from sources to targets; unknown fields are errors."""

    order: ClassVar[tuple[str, ...]] = (
        "sources",
        "targets",
        "soc",
        "vehicle",
        "graph",
        "weights",
        "reserve_soc",
        "link_model",
        "stops",
        "conditions",
        "effects",
        "fields",
        "compact",
    )

    sources: list[Place] = Field(min_length=1, max_length=MAX_PLACES, description="places of departure")
    targets: list[Place] | None = Field(
        default=None, min_length=1, max_length=MAX_PLACES, description="places to reach; without them, the sources"
    )
    soc: Fraction = Field(description="state of charge at departure of each drive, 0..1")
    weights: WeightsSent | None = Field(default=None, description="own weighting; default energy only")
    fields: Picked = None
    compact: Flag | None = Field(default=None, description=COMPACT_MEANS)

    @model_validator(mode="after")
    def _reserve_within_charge(self) -> MatrixRequest:
        self.check_reserve()
        check_names(self.fields, MatrixResponse)
        return self


class MatrixStats(Answered):
    """What the searches of a matrix did."""

    labels_made: int
    labels_settled: int
    seconds: float = Field(description="sum over all searches, which run side by side [s]")
    entries_alone: int = Field(description="entries near the battery's limits, which were searched one by one")


class MatrixResponse(Answered):
    """All drives from sources to targets; figures of a pair that can't be driven are null."""

    feasible: Rows[bool]
    energy_kwh: Rows[float | None]
    battery_kwh: Rows[float | None] = Field(description="what the charge fell by, as of a route")
    duration_s: Rows[float | None]
    distance_m: Rows[float | None]
    soc_end: Rows[float | None]
    soc_min: Rows[float | None]
    reason: Rows[NotDriven | None] = Field(
        description="why a pair can't be driven: no_path, or charge where even the least energy is too much; else null"
    )
    deficit_kwh: Rows[float | None] = Field(
        description="energy missing to keep reserve_soc on the way of least energy, 0 if feasible, null without a path"
    )
    sources: list[Snapped]
    targets: list[Snapped]
    request: MatrixRequest = Field(description="the request as understood, with defaults; can be sent again")
    warnings: list[str]
    stats: MatrixStats
    terrain: TerrainNote
