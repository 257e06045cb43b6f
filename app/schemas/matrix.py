"""Drives from many places to many: what is asked, and what is answered."""

from __future__ import annotations

from typing import Annotated, TypeVar

from pydantic import Field, model_validator

from app.schemas.base import Answered, Fraction, Sent, refusal
from app.schemas.conditions import ConditionsSent
from app.schemas.graph import TerrainNote
from app.schemas.learned_effects import EffectsChoice
from app.schemas.place import MAX_PLACES, Place, Snapped
from app.schemas.route import WeightsSent
from app.schemas.vehicle import VehicleChoice
from energy.chain.chain import LinkModel, StopRule
from routing.route.matrix import NotDriven

Figure = TypeVar("Figure")
Rows = Annotated[list[list[Figure]], Field(description="one row a source, in it one value a target")]


class MatrixRequest(Sent):
    """One request for all drives from sources to targets; unknown fields are errors."""

    sources: list[Place] = Field(min_length=1, max_length=MAX_PLACES, description="places of departure")
    targets: list[Place] | None = Field(
        default=None, min_length=1, max_length=MAX_PLACES, description="places to reach; without them, the sources"
    )
    soc: Fraction = Field(description="state of charge at departure of each drive, 0..1")
    vehicle: VehicleChoice | None = Field(default=None, description="without it, the default vehicle")
    graph: str | None = Field(default=None, max_length=200, description="without it, the default graph")
    weights: WeightsSent | None = Field(default=None, description="own weighting; default energy only")
    reserve_soc: Fraction = Field(default=0.0, description="state of charge that must be kept everywhere, at most soc")
    link_model: LinkModel = Field(
        default=LinkModel.INTEGRATED, description="exact integral, or the equations as printed"
    )
    stops: StopRule = Field(
        default=StopRule.EXPECTED, description="stops by expectation, by the source's counters, or none"
    )
    conditions: ConditionsSent | None = Field(
        default=None, description="weather, load and habits; without it, none of their effects"
    )
    effects: EffectsChoice | None = Field(
        default=None, description="how strong effects are, instead of the vehicle's own; learned ones also by their id"
    )

    @model_validator(mode="after")
    def _reserve_within_charge(self) -> MatrixRequest:
        if self.reserve_soc > self.soc:
            raise refusal("reserve_soc", self.reserve_soc, f"at most soc, {self.soc}")
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
