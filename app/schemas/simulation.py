"""Simulations: a chain of links, from a graph or by numbers, and what driving it takes."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field, model_validator

from app.schemas.base import Answered, Count, Flag, Fraction, Number, Sent, refusal
from app.schemas.graph import TerrainNote
from app.schemas.route import EnergyPartsKwh, EnergyPartsWh
from app.schemas.vehicle import VehicleChoice
from energy.chain import LinkModel, StopRule

MAX_LINKS = 50_000


class CrossName(StrEnum):
    """How probable a stop at the end of a link is, in words (table II of the source)."""

    NONE = "none"
    SMALL = "small"
    MEDIUM = "medium"
    LARGE = "large"


class FunctionalClassName(StrEnum):
    """Functional road class; there are no stops on motorways."""

    MOTORWAY = "motorway"
    TRUNK = "trunk"
    PRIMARY = "primary"
    SECONDARY = "secondary"
    TERTIARY = "tertiary"
    UNCLASSIFIED = "unclassified"
    RESIDENTIAL = "residential"
    SERVICE = "service"


class GraphLinkSent(Sent):
    """A directed link of a graph, whole or from from_m to to_m of its length."""

    id: Count = Field(ge=0, le=2**31 - 1, description="directed link of the graph, as in a route's links")
    from_m: Number | None = Field(default=None, ge=0, le=1e7, description="without it, from the link's start [m]")
    to_m: Number | None = Field(default=None, ge=0, le=1e7, description="without it, to the link's end [m]")


class ChainLinkSent(Sent):
    """A link by its numbers."""

    length_m: Number = Field(ge=0.001, le=1e6, description="[m]")
    grade: Number = Field(default=0.0, ge=-1, le=1, description="rise over length, negative downhill")
    speed_limit_kmh: Number = Field(ge=1, le=400, description="[km/h]")
    cross: CrossName = Field(default=CrossName.NONE, description="how probable a stop at its end is")
    urban: Flag = Field(default=False, description="inside a built-up area")
    functional_class: FunctionalClassName = FunctionalClassName.UNCLASSIFIED
    stop_probability: Fraction | None = Field(default=None, description="without it, by urban, cross and class")
    stop_time_s: Number | None = Field(default=None, ge=0, le=86_400, description="without it, by urban and cross [s]")


class SimulateRequest(Sent):
    """Links of a graph, or a chain by its numbers; unknown fields are errors."""

    graph: str | None = Field(
        default=None, max_length=200, description="graph of the links; without it, the default graph"
    )
    links: Annotated[list[GraphLinkSent], Field(min_length=1, max_length=MAX_LINKS)] | None = Field(
        None, description="consecutive links of the graph; excludes chain"
    )
    chain: Annotated[list[ChainLinkSent], Field(min_length=1, max_length=MAX_LINKS)] | None = Field(
        None, description="links by their numbers; excludes links and graph"
    )
    vehicle: VehicleChoice | None = Field(default=None, description="without it, the default vehicle")
    soc: Fraction | None = Field(
        default=None, description="state of charge at departure; with it, that at each link's end"
    )
    link_model: LinkModel = Field(
        default=LinkModel.INTEGRATED, description="exact integral, or the equations as printed"
    )
    stops: StopRule = Field(
        default=StopRule.EXPECTED, description="stops by expectation, by the source's counters, or none"
    )
    arrive_stopped: Flag = Field(
        default=True, description="whether the vehicle comes to rest at the end of the last link"
    )

    @model_validator(mode="after")
    def _one_form(self) -> SimulateRequest:
        if (self.links is None) == (self.chain is None):
            sent = "neither" if self.links is None else "both"
            raise refusal("links", sent, "either links (of a graph) or chain, exactly one of them")
        if self.chain is not None and self.graph is not None:
            raise refusal("graph", self.graph, "only together with links")
        return self


class SimulatedLink(Answered):
    """One link as driven, in the units and names of a route's links."""

    position: int = Field(description="in the chain, from 0")
    id: int | None = Field(description="directed link of the graph; null for a chain by numbers")
    from_m: float
    to_m: float
    length_m: float
    duration_s: float
    standstill_s: float = Field(description="part of duration_s spent standing [s]")
    energy_wh: float
    energy_parts_wh: EnergyPartsWh
    soc_end: float | None = Field(description="null without soc; below 0 is missing energy")
    grade: float
    speed_limit_kmh: float
    speed_end_kmh: float
    stop_probability: float


class SimulateResponse(Answered):
    """What driving the links takes: sums, then link by link."""

    distance_m: float
    duration_s: float
    standstill_s: float
    stop_count: float = Field(description="expected number under 'expected', whole under 'counted'")
    energy_kwh: float
    energy_parts_kwh: EnergyPartsKwh
    braked_away_kwh: float | None = Field(description="null without soc")
    soc_start: float | None
    soc_end: float | None
    soc_min: float | None
    links: list[SimulatedLink]
    request: SimulateEcho = Field(description="the settings as understood, with defaults")
    warnings: list[str]
    terrain: TerrainNote | None = Field(description="null for a chain by numbers")


class SimulateEcho(Answered):
    """A simulation as understood; its links are those of the answer."""

    graph: str | None
    vehicle: VehicleChoice
    soc: float | None
    link_model: LinkModel
    stops: StopRule
    arrive_stopped: bool


SimulateResponse.model_rebuild()
