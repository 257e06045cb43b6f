"""Simulations: a chain of links, from a graph or by numbers, and what driving it takes."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, ClassVar, Final

from pydantic import Field, model_validator

from app.schemas.base import Answered, Count, Flag, Fraction, Number, Sent, refusal
from app.schemas.conditions import ConditionsSent
from app.schemas.drive import DriveRequest
from app.schemas.graph import TerrainNote
from app.schemas.learned_effects import EffectsChoice
from app.schemas.route import EnergyPartsKwh, EnergyPartsWh
from app.schemas.vehicles.vehicle import VehicleChoice
from energy.chain.chain import LinkModel, StopRule

MAX_LINKS = 50_000


class SimulationModel(StrEnum):
    """The link-energy model of the search, or the equation of motion in steps of 0.1 s over the whole chain."""

    FAST = "fast"
    TIMESTEP = "timestep"


DEFAULT_STOPS: Final = {SimulationModel.FAST: StopRule.EXPECTED, SimulationModel.TIMESTEP: StopRule.CROSSINGS}


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
    rest: Flag = Field(
        default=False,
        description="whether the vehicle comes to rest at to_m, for no time, as at a via point of a route; the next"
        " link may then go on from there, or be the other direction of this one",
    )


class ChainLinkSent(Sent):
    """A link by its numbers."""

    length_m: Number = Field(ge=0.001, le=1e6, description="[m]")
    grade: Number = Field(default=0.0, ge=-1, le=1, description="rise over length, negative downhill")
    speed_limit_kmh: Number = Field(ge=1, le=200, description="[km/h]")
    cross: CrossName = Field(default=CrossName.NONE, description="how probable a stop at its end is")
    urban: Flag = Field(default=False, description="inside a built-up area")
    functional_class: FunctionalClassName = FunctionalClassName.UNCLASSIFIED
    stop_probability: Fraction | None = Field(default=None, description="without it, by urban, cross and class")
    stop_time_s: Number | None = Field(default=None, ge=0, le=86_400, description="without it, by urban and cross [s]")
    altitude_m: Number | None = Field(
        default=None, ge=-500, le=9000, description="mean height, for the density of the air; on all links or none [m]"
    )
    heading_deg: Number | None = Field(
        default=None, ge=0, le=360, description="clockwise from north, for wind; on all links or none [°]"
    )


class SimulateRequest(DriveRequest):
    """Links of a graph, or a chain by its numbers; unknown fields are errors."""

    order: ClassVar[tuple[str, ...]] = (
        "graph",
        "links",
        "chain",
        "vehicle",
        "soc",
        "model",
        "link_model",
        "stops",
        "arrive_stopped",
        "conditions",
        "effects",
        "profile",
    )

    graph: str | None = Field(
        default=None, max_length=200, description="graph of the links; without it, the default graph"
    )
    links: Annotated[list[GraphLinkSent], Field(min_length=1, max_length=MAX_LINKS, fail_fast=True)] | None = Field(
        None, description="consecutive links of the graph; excludes chain"
    )
    chain: Annotated[list[ChainLinkSent], Field(min_length=1, max_length=MAX_LINKS, fail_fast=True)] | None = Field(
        None, description="links by their numbers; excludes links and graph"
    )
    soc: Fraction | None = Field(
        default=None, description="state of charge at departure; with it, that at each link's end"
    )
    model: SimulationModel = Field(
        default=SimulationModel.FAST, description="the model of the search, or time steps that look far ahead"
    )
    link_model: LinkModel = Field(
        default=LinkModel.INTEGRATED, description="exact integral, or the equations as printed (model 'fast' only)"
    )
    stops: StopRule | None = Field(
        default=None,
        description="stops by expectation (model 'fast' only), by the source's counters, none, or at every crossing"
        " from a minor to a major road and entry to a roundabout; without it, 'expected' for 'fast' and 'crossings'"
        " for 'timestep'",
    )
    arrive_stopped: Flag = Field(
        default=True, description="whether the vehicle comes to rest at the end of the last link"
    )
    conditions: ConditionsSent | None = Field(
        default=None, description="weather, load and habits; without it, those of the source"
    )
    profile: Flag = Field(default=False, description="whether the answer has the speed along the way")

    @model_validator(mode="after")
    def _one_form(self) -> SimulateRequest:
        if (self.links is None) == (self.chain is None):
            sent = "neither" if self.links is None else "both"
            raise refusal("links", sent, "either links (of a graph) or chain, exactly one of them")
        if self.chain is not None and self.graph is not None:
            raise refusal("graph", self.graph, "only together with links")
        return self

    @model_validator(mode="after")
    def _model_can_do_it(self) -> SimulateRequest:
        if self.model is SimulationModel.TIMESTEP:
            if self.link_model is LinkModel.PRINTED:
                raise refusal("link_model", self.link_model.value, "integrated with model 'timestep'")
            if self.stops is StopRule.EXPECTED:
                raise refusal("stops", self.stops.value, "crossings, counted or none with model 'timestep'")
        return self

    @model_validator(mode="after")
    def _all_links_or_none(self) -> SimulateRequest:
        for name in ("altitude_m", "heading_deg"):
            missing = [getattr(link, name) is None for link in self.chain or ()]
            if any(missing) and not all(missing):
                raise refusal(f"chain[{missing.index(True)}].{name}", None, "on all links of the chain, or on none")
        return self


class SimulatedLink(Answered):
    """One link as driven, in the units and names of a route's links."""

    position: int = Field(description="in the chain, from 0")
    id: int | None = Field(description="directed link of the graph; null for a chain by numbers")
    from_m: float
    to_m: float
    rest: bool = Field(description="whether the vehicle was asked to come to rest at its end")
    length_m: float
    duration_s: float
    standstill_s: float = Field(description="part of duration_s spent standing [s]")
    energy_wh: float
    energy_parts_wh: EnergyPartsWh
    soc_end: float | None = Field(description="null without soc; below 0 is missing energy")
    grade: float
    speed_limit_kmh: float
    speed_end_kmh: float = Field(
        description="speed carried into the next link [km/h]: 'fast' given no stop; 0 where it stops for certain"
    )
    stop_probability: float


class SpeedProfileAnswer(Answered):
    """Speed along the way: points to be joined by straight lines, lists of the same length that never fall."""

    distance_m: list[float]
    time_s: list[float]
    speed_kmh: list[float]
    stops: StopRule = Field(description="of the drawn drive: 'counted' where 'expected' was asked for")


class SimulateResponse(Answered):
    """What driving the links takes: sums, then link by link."""

    distance_m: float
    duration_s: float
    standstill_s: float
    stop_count: float = Field(description="expected number under 'expected', else whole")
    energy_kwh: float
    battery_kwh: float | None = Field(description="what the charge fell by, as of a route; null without soc")
    energy_parts_kwh: EnergyPartsKwh
    braked_away_kwh: float | None = Field(description="null without soc")
    soc_start: float | None
    soc_end: float | None
    soc_min: float | None
    links: list[SimulatedLink]
    profile: SpeedProfileAnswer | None = Field(description="null if not asked for")
    request: SimulateEcho = Field(description="the settings as understood, with defaults")
    warnings: list[str]
    terrain: TerrainNote | None = Field(description="null for a chain by numbers")


class SimulateEcho(Answered):
    """A simulation as understood; its links are those of the answer."""

    graph: str | None
    vehicle: VehicleChoice
    soc: float | None
    model: SimulationModel
    link_model: LinkModel
    stops: StopRule
    arrive_stopped: bool
    conditions: ConditionsSent | None
    effects: EffectsChoice | None
    profile: bool


SimulateResponse.model_rebuild()
