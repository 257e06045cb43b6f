"""Vehicles as they are sent, in human units: their physics, or a table of consumption."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from app.schemas.base import Number, Sent, refusal
from app.schemas.effects import EffectsSent
from app.schemas.vehicles.charging import ChargingSent
from energy.vehicle.vehicle import Powertrain

VEHICLE_ID_PATTERN: Final = r"^[a-z0-9]+(-[a-z0-9]+)*$"
MAX_ID_CHARS: Final = 100
MAX_TABLE_POINTS: Final = 400
KIND_NAMES: Final = "'physical' or 'consumption_table'"
NUMBER_SD: Final = ("aux_power_w", "usable_capacity_kwh")
METRIC_SD: Final = ("road_load.a_n", "road_load.b_n_per_kmh", "road_load.c_n_per_kmh2")
EPA_SD: Final = ("road_load.a_lbf", "road_load.b_lbf_per_mph", "road_load.c_lbf_per_mph2")
PHYSICAL_SD: Final = (
    "mass_kg",
    "rotating_mass_coef",
    "drive_eff",
    "recuperation_eff",
    "aux_move_eff",
    "aux_idle_eff",
    *NUMBER_SD,
    *(f"effects.{name}" for name in EffectsSent.model_fields),
)
TABLE_SD: Final = ("ascent_wh_per_m", "descent_wh_per_m", *NUMBER_SD)


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
Gain = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.01, le=15)]
Loss = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-15, le=-0.01)]


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


TableSpeed = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=400)]
TableConsumption = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=1000)]


class Consumption(Sent):
    """Consumption at constant speed on the flat, without auxiliaries; linear in between, constant beyond the ends."""

    speed_kmh: list[TableSpeed] = Field(min_length=1, max_length=MAX_TABLE_POINTS, description="rising [km/h]")
    kwh_per_100km: list[TableConsumption] = Field(
        min_length=1, max_length=MAX_TABLE_POINTS, description="from the battery at each of these speeds [kWh/100 km]"
    )


class Kinetic(Sent):
    """What changes of speed take: ½·m·v²/acceleration_eff when gaining, ½·m·v²·deceleration_eff back when losing."""

    mass_kg: Number = Field(ge=0, le=1e6, description="total mass with occupants and load [kg]")
    acceleration_eff: Number = Field(ge=0.1, le=1, description="efficiency of gaining speed, from the battery")
    deceleration_eff: Number = Field(ge=0, le=1, description="efficiency of losing speed, into the battery; 0 for none")


def _without_controls(value: str) -> str:
    if any(ord(character) < 32 or ord(character) == 127 for character in value):
        raise PydanticCustomError("control_character", "a text of one line, without control characters")
    return value


def _known_kind(value: object) -> object:
    if value not in ("physical", "consumption_table"):
        raise PydanticCustomError("kind", KIND_NAMES)
    return value


Label = Annotated[str, Field(max_length=200), AfterValidator(_without_controls)]
Source = Annotated[str, Field(max_length=2000)]
SourceName = Annotated[str, Field(max_length=100)]
Deviation = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=1e9)]


def _sd_field(*names: str) -> Any:
    return Field(
        default={},
        description="standard deviation of a number by its field, in that field's unit; without one it is certain",
        json_schema_extra={"propertyNames": {"enum": list(names)}},
    )


def _check_sd(sd: dict[str, float], names: tuple[str, ...]) -> None:
    for name, value in sd.items():
        if name not in names:
            raise refusal(f"sd.{name}", value, f"no field of this name, but {', '.join(names)}")


class InlineVehicle(Sent):
    """A vehicle by its physics."""

    kind: Annotated[Literal["physical"], BeforeValidator(_known_kind)] = Field(
        default="physical", description="the vehicle is given by its physics"
    )
    name: Label = "inline vehicle"
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
    effects: EffectsSent | None = Field(
        default=None, description="how strong the effects are that conditions switch on; without it, the defaults"
    )
    charging: ChargingSent | None = Field(
        default=None, description="plugs and power of charging; without it, no charging stops can be planned"
    )
    sources: dict[SourceName, Source] = Field(
        default={}, max_length=100, description="where each number is from, by field"
    )
    sd: dict[str, Deviation] = _sd_field(*PHYSICAL_SD, *METRIC_SD, *EPA_SD)

    @model_validator(mode="after")
    def _known_sd(self) -> InlineVehicle:
        _check_sd(self.sd, PHYSICAL_SD + (EPA_SD if isinstance(self.road_load, RoadLoadEpa) else METRIC_SD))
        return self


class InlineTableVehicle(Sent):
    """A vehicle by its consumption against speed, with figures for climbs and changes of speed."""

    kind: Annotated[Literal["consumption_table"], BeforeValidator(_known_kind)] = Field(
        description="the vehicle is given by a table of consumption"
    )
    name: Label = "inline vehicle"
    powertrain: Powertrain = Field(
        default=Powertrain.BEV, description="what the stored energy is: a battery's or a tank's"
    )
    consumption: Consumption
    ascent_wh_per_m: Number = Field(ge=0, le=2777, description="energy that each metre of height takes [Wh/m]")
    descent_wh_per_m: Number = Field(
        ge=0, le=2777, description="energy that each metre down gives back [Wh/m], at most ascent_wh_per_m"
    )
    kinetic: Kinetic | None = Field(None, description="without it, changes of speed take and give nothing")
    aux_power_w: Number = Field(ge=0, le=100_000, description="power of the auxiliaries at the battery [W]")
    usable_capacity_kwh: Number = Field(ge=0.001, le=10_000, description="usable energy of the battery (or tank) [kWh]")
    charging: ChargingSent | None = Field(
        default=None, description="plugs and power of charging; without it, no charging stops can be planned"
    )
    sources: dict[SourceName, Source] = Field(
        default={}, max_length=100, description="where each number is from, by field"
    )
    sd: dict[str, Deviation] = _sd_field(*TABLE_SD)

    @model_validator(mode="after")
    def _known_sd(self) -> InlineTableVehicle:
        _check_sd(self.sd, TABLE_SD)
        return self


# names of branches hold a space, so that no field can be of the same name
ID_BRANCH: Final = "vehicle id"
PHYSICAL_BRANCH: Final = "physical vehicle"
TABLE_BRANCH: Final = "consumption table vehicle"


def form_of_object(value: object) -> str | None:
    """The branch of an object that describes a vehicle by its physics or by a table; None for what is no object."""
    if isinstance(value, dict):
        # an object of unknown kind goes to the physical branch, which names the kinds
        table = value["kind"] == "consumption_table" if "kind" in value else "consumption" in value
        return TABLE_BRANCH if table else PHYSICAL_BRANCH
    if isinstance(value, InlineTableVehicle):
        return TABLE_BRANCH
    return PHYSICAL_BRANCH if isinstance(value, InlineVehicle) else None


def _form_of_choice(value: object) -> str | None:
    return ID_BRANCH if isinstance(value, str) else form_of_object(value)


SentVehicle = InlineVehicle | InlineTableVehicle
VehicleBody = Annotated[
    Annotated[InlineVehicle, Tag(PHYSICAL_BRANCH)] | Annotated[InlineTableVehicle, Tag(TABLE_BRANCH)],
    Discriminator(
        form_of_object,
        custom_error_type="vehicle",
        custom_error_message="an object that describes a vehicle, sent with Content-Type: application/json",
    ),
]
VehicleChoice = Annotated[
    Annotated[str, Field(max_length=200, description="id of a known vehicle"), Tag(ID_BRANCH)]
    | Annotated[InlineVehicle, Tag(PHYSICAL_BRANCH)]
    | Annotated[InlineTableVehicle, Tag(TABLE_BRANCH)],
    Discriminator(
        _form_of_choice,
        custom_error_type="vehicle",
        custom_error_message="the id of a vehicle, or an object that describes one",
    ),
]
