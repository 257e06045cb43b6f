"""Vehicles as they are sent in the parameters of the routing services of TomTom, HERE and Mapbox."""

# ruff: noqa: N815 - fields are named as the services name them

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from app.schemas.base import Number, Sent
from app.schemas.vehicles.vehicle import (
    PHYSICAL_BRANCH,
    TABLE_BRANCH,
    InlineTableVehicle,
    InlineVehicle,
    Label,
    SentVehicle,
    Source,
    form_of_object,
)
from energy.vehicle.service_charging import MOST_POINTS, MOST_TOMTOM_CONNECTORS

FORMAT_NAMES: Final = "'tomtom', 'here' or 'mapbox'"
MAX_CURVE_CHARS: Final = 10_000
SourceOfAll = Annotated[Source, Field(description="where the numbers are from, kept for each of them")]
OwnName = Annotated[Label | None, Field(description="without it, the id")]


def _known_format(value: object) -> object:
    if value not in ("tomtom", "here", "mapbox"):
        raise PydanticCustomError("format", FORMAT_NAMES)
    return value


class TomTomBatteryPoint(Sent):
    """One point of TomTom's battery curve."""

    stateOfChargeInkWh: Number = Field(ge=0, le=10_000, description="charge, rising from point to point [kWh]")
    maxPowerInkW: Number = Field(ge=0.001, le=4000, description="most power into the battery at it [kW]")


class TomTomVoltageRange(Sent):
    """Voltages of a connector; without effect here."""

    minVoltageInV: Number = Field(default=0, ge=0, le=10_000, description="[V]")
    maxVoltageInV: Number = Field(default=10_000, ge=0, le=10_000, description="[V]")


class TomTomChargingConnector(Sent):
    """One of the ways in which a vehicle charges, in TomTom's terms."""

    currentType: str = Field(max_length=100, description="AC1, AC3 or DC")
    plugTypes: list[Annotated[str, Field(max_length=100)]] = Field(
        min_length=1, max_length=50, description="plugs by TomTom's names, such as Combo_to_IEC_62196_Type_2_Base"
    )
    maxPowerInkW: Number | None = Field(
        default=None, ge=0.001, le=4000, description="most power; required with AC [kW]"
    )
    efficiency: Number | None = Field(
        default=None, ge=0.01, le=1, description="battery over wall; without it, 0.9 of AC and 0.95 of DC"
    )
    baseLoadInkW: Number = Field(default=0.0, ge=0, le=100, description="what the vehicle itself takes meanwhile [kW]")
    voltageRange: TomTomVoltageRange | None = Field(default=None, description="without effect")


class TomTomChargingParameters(Sent):
    """How a vehicle charges, in TomTom's terms."""

    batteryCurve: list[TomTomBatteryPoint] = Field(
        min_length=1, max_length=MOST_POINTS, description="linear between its points, constant beyond them"
    )
    chargingConnectors: list[TomTomChargingConnector] = Field(
        min_length=1, max_length=MOST_TOMTOM_CONNECTORS, description="the ways in which it charges"
    )


class TomTomVehicle(Sent):
    """A vehicle in the parameters of TomTom's (and Azure Maps') electric consumption model."""

    format: Annotated[Literal["tomtom"], BeforeValidator(_known_format)] = Field(
        description="the fields are the parameters of TomTom's Routing API and Azure Maps"
    )
    name: OwnName = None
    source: SourceOfAll = ""
    constantSpeedConsumptionInkWhPerHundredkm: str = Field(
        max_length=MAX_CURVE_CHARS,
        description="1 to 25 pairs of speed [km/h] and consumption [kWh/100 km], such as '50,8.2:130,21.3'; beyond"
        " them it goes on with the slope of the two nearest",
    )
    maxChargeInkWh: Number = Field(ge=0.001, le=10_000, description="usable energy of the battery [kWh]")
    vehicleWeight: Number = Field(default=0.0, ge=0, le=100_000, description="[kg]; needed with efficiencies")
    accelerationEfficiency: Number | None = Field(
        default=None, ge=0.1, le=10, description="kinetic energy gained over energy taken; with decelerationEfficiency"
    )
    decelerationEfficiency: Number | None = Field(
        default=None, ge=0, le=10, description="energy given back over kinetic energy lost; a product of at most 1"
    )
    uphillEfficiency: Number | None = Field(
        default=None, ge=0.1, le=10, description="potential energy gained over energy taken; with downhillEfficiency"
    )
    downhillEfficiency: Number | None = Field(
        default=None, ge=0, le=10, description="energy given back over potential energy lost; a product of at most 1"
    )
    auxiliaryPowerInkW: Number = Field(default=0.0, ge=0, le=100, description="power of the auxiliaries [kW]")
    chargingParameters: TomTomChargingParameters | None = Field(default=None, description="how it charges")


class HereVehicle(Sent):
    """A vehicle in the parameters of HERE Routing's empirical consumption model, without their `ev[…]`."""

    format: Annotated[Literal["here"], BeforeValidator(_known_format)] = Field(
        description="the fields are the ev parameters of HERE Routing v8"
    )
    name: OwnName = None
    source: SourceOfAll = ""
    freeFlowSpeedTable: str = Field(
        max_length=MAX_CURVE_CHARS,
        description="speeds [km/h] and consumptions [Wh/m] in turn, such as '0,0.239,27,0.239'; constant beyond them",
    )
    maxCharge: Number = Field(ge=0.001, le=10_000, description="usable energy of the battery [kWh]")
    ascent: Number = Field(default=0.0, ge=0, le=2777, description="energy that each metre of height takes [Wh/m]")
    descent: Number = Field(
        default=0.0, ge=0, le=2777, description="energy that each metre down gives back [Wh/m], at most ascent"
    )
    auxiliaryConsumption: Number = Field(
        default=0.0, ge=0, le=27.7, description="energy of the auxiliaries for each second of travel [Wh/s]"
    )
    chargingCurve: str | None = Field(
        default=None,
        max_length=MAX_CURVE_CHARS,
        description="charges [kWh] and powers [kW] in turn, such as '0,239,32,199,56,167'; with connectorTypes",
    )
    connectorTypes: str | None = Field(
        default=None, max_length=1000, description="such as 'iec62196Type2Combo,chademo'; with chargingCurve"
    )


class MapboxVehicle(Sent):
    """A vehicle in the electric parameters of Mapbox Directions."""

    format: Annotated[Literal["mapbox"], BeforeValidator(_known_format)] = Field(
        description="the fields are the electric parameters of Mapbox Directions"
    )
    name: OwnName = None
    source: SourceOfAll = ""
    energy_consumption_curve: str = Field(
        max_length=MAX_CURVE_CHARS,
        description="pairs of speed [km/h] and consumption [Wh/km], such as '0,300;20,160'; constant beyond them",
    )
    ev_max_charge: Number = Field(ge=1, le=1e7, description="usable energy of the battery [Wh]")
    ev_ascent: Number | None = Field(
        default=None, ge=0, le=1000, description="energy that each metre of height takes [Wh/m]; with ev_descent"
    )
    ev_descent: Number | None = Field(
        default=None, ge=0, le=1000, description="energy that each metre down gives back [Wh/m], at most ev_ascent"
    )
    auxiliary_consumption: Number = Field(
        default=0.0, ge=0, le=100_000, description="power of the auxiliaries at the battery [W]"
    )
    ev_charging_curve: str | None = Field(
        default=None,
        max_length=MAX_CURVE_CHARS,
        description="pairs of charge [Wh] and power [W], such as '0,100000;40000,70000'; with ev_connector_types",
    )
    ev_connector_types: str | None = Field(
        default=None, max_length=1000, description="such as 'ccs_combo_type2,chademo'; with ev_charging_curve"
    )
    ev_max_ac_charging_power: Number | None = Field(
        default=None, ge=0, le=100_000, description="most of the charger on board [W]; without it, 14400"
    )


ServiceVehicle = TomTomVehicle | HereVehicle | MapboxVehicle
NewVehicle = SentVehicle | ServiceVehicle

# names of branches hold a space, so that no field can be of the same name
TOMTOM_BRANCH: Final = "TomTom vehicle"
HERE_BRANCH: Final = "HERE vehicle"
MAPBOX_BRANCH: Final = "Mapbox vehicle"
SERVICE_BRANCHES: Final = {"tomtom": TOMTOM_BRANCH, "here": HERE_BRANCH, "mapbox": MAPBOX_BRANCH}


def _form_of_new(value: object) -> str | None:
    if isinstance(value, ServiceVehicle):
        return SERVICE_BRANCHES[value.format]
    if isinstance(value, dict) and "format" in value:
        # an object of unknown format goes to the first branch, which names the formats
        return SERVICE_BRANCHES.get(str(value["format"]), TOMTOM_BRANCH)
    return form_of_object(value)


NewVehicleBody = Annotated[
    Annotated[InlineVehicle, Tag(PHYSICAL_BRANCH)]
    | Annotated[InlineTableVehicle, Tag(TABLE_BRANCH)]
    | Annotated[TomTomVehicle, Tag(TOMTOM_BRANCH)]
    | Annotated[HereVehicle, Tag(HERE_BRANCH)]
    | Annotated[MapboxVehicle, Tag(MAPBOX_BRANCH)],
    Discriminator(
        _form_of_new,
        custom_error_type="vehicle",
        custom_error_message="an object that describes a vehicle, sent with Content-Type: application/json",
    ),
]
