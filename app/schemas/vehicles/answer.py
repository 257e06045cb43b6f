"""Vehicles as they are listed and shown."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

from pydantic import Field

from app.schemas.base import Answered, Fraction
from app.schemas.effects import EffectsSent
from app.schemas.vehicles.charging import ChargingSent
from app.schemas.vehicles.vehicle import Acceleration, Consumption, Kinetic, RoadLoadMetric
from energy.charging.charging import Connector
from energy.vehicle.vehicle import Powertrain


class VehicleKind(StrEnum):
    """How a vehicle is described."""

    PHYSICAL = "physical"
    CONSUMPTION_TABLE = "consumption_table"


class VehicleSummary(Answered):
    """One line of the list of vehicles."""

    id: str
    name: str
    kind: VehicleKind = Field(description="by its physics, or by a table of consumption")
    bundled: bool = Field(description="whether it comes with joulepath and can't be changed")
    powertrain: Powertrain
    usable_capacity_kwh: float
    mass_kg: float | None = Field(description="null for a table of consumption")
    connectors: list[Connector] = Field(description="plugs that it charges by; none where they are not known")
    default: bool = Field(description="whether requests that name no vehicle get this one")


class VehicleList(Answered):
    """All vehicles that can be asked for by id."""

    vehicles: list[VehicleSummary]
    default: str
    warnings: list[str] = Field(description="stored vehicles that are left out, and why")


class VehicleDetail(Answered):
    """One vehicle with every number that the model uses; without id, and with or without sources, it can be sent."""

    id: str
    kind: Literal["physical"]
    name: str
    powertrain: Powertrain
    mass_kg: float = Field(description="total mass with occupants and load [kg]")
    road_load: RoadLoadMetric
    rotating_mass_coef: float
    drive_eff: Fraction
    recuperation_eff: Fraction
    aux_power_w: float
    aux_move_eff: Fraction
    aux_idle_eff: Fraction
    usable_capacity_kwh: float
    acceleration: Acceleration
    effects: EffectsSent = Field(description="how strong the effects are that conditions switch on")
    charging: ChargingSent | None = Field(description="plugs and power of charging; null where they are not known")
    sources: dict[str, str] = Field(description="where each number is from, by field; 'assumed …' where unpublished")
    sd: dict[str, float] = Field(description="standard deviation of a number by field, in that field's unit")


class TableVehicleDetail(Answered):
    """One vehicle by its consumption; without id, and with or without sources, it can be sent."""

    id: str
    kind: Literal["consumption_table"]
    name: str
    powertrain: Powertrain
    consumption: Consumption
    ascent_wh_per_m: float
    descent_wh_per_m: float
    kinetic: Kinetic | None
    aux_power_w: float
    usable_capacity_kwh: float
    charging: ChargingSent | None = Field(description="plugs and power of charging; null where they are not known")
    sources: dict[str, str] = Field(description="where each number is from, by field; 'assumed …' where unpublished")
    sd: dict[str, float] = Field(description="standard deviation of a number by field, in that field's unit")


AnyVehicleDetail = Annotated[VehicleDetail | TableVehicleDetail, Field(discriminator="kind")]
