"""Vehicles as they are sent inline and as they are listed, in human units."""

from __future__ import annotations

from typing import Annotated

from pydantic import Discriminator, Field, Tag

from app.schemas.base import Answered, Fraction, Number, Sent
from energy.vehicle import Powertrain


class RoadLoadMetric(Sent):
    """Coast-down coefficients: F = a + b·v + c·v² [N], v in km/h."""

    a_n: Number = Field(ge=-1e6, le=1e6, description="constant part [N]")
    b_n_per_kmh: Number = Field(ge=-1e5, le=1e5, description="part that grows with speed [N/(km/h)]")
    c_n_per_kmh2: Number = Field(ge=-1e4, le=1e4, description="part that grows with speed squared [N/(km/h)²]")


class RoadLoadEpa(Sent):
    """EPA target coefficients as the agency lists them: F = a + b·v + c·v² [lbf], v in mph."""

    a_lbf: Number = Field(ge=-2e5, le=2e5, description="target coefficient A [lbf]")
    b_lbf_per_mph: Number = Field(ge=-2e4, le=2e4, description="target coefficient B [lbf/mph]")
    c_lbf_per_mph2: Number = Field(ge=-2e3, le=2e3, description="target coefficient C [lbf/mph²]")


def _form_of_road_load(value: object) -> str | None:
    if isinstance(value, dict):
        return "epa" if any("lbf" in str(key) for key in value) else "metric"
    if isinstance(value, RoadLoadEpa):
        return "epa"
    return "metric" if isinstance(value, RoadLoadMetric) else None


RoadLoad = Annotated[
    Annotated[RoadLoadMetric, Tag("metric")] | Annotated[RoadLoadEpa, Tag("epa")],
    Discriminator(
        _form_of_road_load,
        custom_error_type="road_load",
        custom_error_message="an object with a_n, b_n_per_kmh, c_n_per_kmh2 or a_lbf, b_lbf_per_mph, c_lbf_per_mph2",
    ),
]

Bound = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=1000)]
Gain = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.1, le=15)]
Loss = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-15, le=-0.1)]


class Acceleration(Sent):
    """How fast the driver gains and loses speed, by speed interval (table I of the source)."""

    speed_kmh: list[Bound] = Field(
        min_length=2, max_length=401, description="boundaries of the n intervals [km/h], n+1 values rising from 0"
    )
    accel_mps2: list[Gain] = Field(
        min_length=1, max_length=400, description="mean acceleration in each interval [m/s²]"
    )
    decel_mps2: list[Loss] = Field(
        min_length=1, max_length=400, description="mean braking in each interval [m/s²], < 0"
    )


class InlineVehicle(Sent):
    """A vehicle given with the request instead of by its id."""

    name: str = Field(default="inline vehicle", max_length=200)
    powertrain: Powertrain = Field(
        default=Powertrain.BEV, description="what the stored energy is: a battery's or a tank's"
    )
    mass_kg: Number = Field(ge=1, le=100_000, description="total mass with occupants and load [kg]")
    road_load: RoadLoad = Field(description="resistance against speed; nowhere negative in 0..200 km/h")
    rotating_mass_coef: Number = Field(default=1.1, ge=1, le=2, description="mass factor of the rotating parts")
    drive_eff: Number = Field(ge=0.01, le=1, description="efficiency from battery to wheel; times recuperation_eff ≤ 1")
    recuperation_eff: Number = Field(ge=0, le=1, description="efficiency from wheel to battery; 0 for none")
    aux_power_w: Number = Field(ge=0, le=100_000, description="power of the auxiliaries [W]")
    aux_move_eff: Number = Field(
        default=0.9, ge=0.01, le=1, description="efficiency of the auxiliaries' supply when moving"
    )
    aux_idle_eff: Number = Field(
        default=0.9, ge=0.01, le=1, description="efficiency of the auxiliaries' supply when standing"
    )
    usable_capacity_kwh: Number = Field(ge=0.001, le=10_000, description="usable energy of the battery (or tank) [kWh]")
    acceleration: Acceleration | None = Field(
        None, description="without it, the default vehicle's tables apply (GET /vehicles names it)"
    )


def _form_of_vehicle(value: object) -> str | None:
    if isinstance(value, str):
        return "id"
    return "inline" if isinstance(value, (dict, InlineVehicle)) else None


VehicleChoice = Annotated[
    Annotated[str, Field(max_length=200, description="id of a known vehicle"), Tag("id")]
    | Annotated[InlineVehicle, Tag("inline")],
    Discriminator(
        _form_of_vehicle,
        custom_error_type="vehicle",
        custom_error_message="the id of a vehicle, or an object that describes one",
    ),
]


class VehicleSummary(Answered):
    """One line of the list of vehicles."""

    id: str
    name: str
    powertrain: Powertrain
    usable_capacity_kwh: float
    mass_kg: float
    default: bool = Field(description="whether requests that name no vehicle get this one")


class VehicleList(Answered):
    """All vehicles that can be asked for by id."""

    vehicles: list[VehicleSummary]
    default: str


class VehicleDetail(Answered):
    """One vehicle with every number that the model uses; without id and sources it can be sent inline."""

    id: str
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
    sources: dict[str, str] = Field(description="where each number is from, by field; 'assumed …' where unpublished")
