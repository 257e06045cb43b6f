"""Drives: what every request for some shares, whether to a goal, within a charge, among many places or along links."""

from __future__ import annotations

from typing import Any, ClassVar, Final

from pydantic import Field

from app.schemas.base import Fraction, Sent, refusal
from app.schemas.conditions import ConditionsSent
from app.schemas.learned_effects import EffectsChoice
from app.schemas.vehicles.vehicle import VehicleChoice
from energy.chain.chain import LinkModel, StopRule

GRAPH_MEANS: Final = "without it, the smallest that holds all places"


class DriveRequest(Sent):
    """What is driven, where, and under which conditions.

    order: all fields of a request as its schema and its answers list them, which would else begin with these.
    """

    order: ClassVar[tuple[str, ...]] = ("vehicle", "graph", "link_model", "conditions", "effects")

    vehicle: VehicleChoice | None = Field(default=None, description="without it, the default vehicle")
    graph: str | None = Field(default=None, max_length=200, description=GRAPH_MEANS)
    link_model: LinkModel = Field(
        default=LinkModel.INTEGRATED, description="exact integral, or the equations as printed"
    )
    conditions: ConditionsSent | None = Field(
        default=None, description="weather, load and habits; without it, none of their effects"
    )
    effects: EffectsChoice | None = Field(
        default=None, description="how strong effects are, instead of the vehicle's own; learned ones also by their id"
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Put the fields in their order."""
        super().__pydantic_init_subclass__(**kwargs)
        fields = cls.__pydantic_fields__
        assert sorted(cls.order) == sorted(fields), f"{cls.__name__}.order has each of its fields once"
        cls.__pydantic_fields__ = {name: fields[name] for name in cls.order}
        cls.model_rebuild(force=True)


class SearchRequest(DriveRequest):
    """A drive whose way is searched for, with a charge at departure and one to keep."""

    order: ClassVar[tuple[str, ...]] = (*DriveRequest.order, "soc", "reserve_soc", "stops")

    soc: Fraction = Field(description="state of charge at departure, 0..1")
    reserve_soc: Fraction = Field(default=0.0, description="state of charge that must be kept everywhere, at most soc")
    stops: StopRule = Field(
        default=StopRule.EXPECTED, description="stops by expectation, by the source's counters, or none"
    )

    def check_reserve(self) -> None:
        """Refuse a reserve above the charge at departure."""
        if self.reserve_soc > self.soc:
            raise refusal("reserve_soc", self.reserve_soc, f"at most soc, {self.soc}")
