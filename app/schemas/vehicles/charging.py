"""How a vehicle charges, in human units."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field

from app.schemas.base import Number, Sent
from energy.charging.charging import (
    BATTERY_CELSIUS,
    LEAST_COLD_FACTOR,
    LEAST_EFF,
    MOST_AC_POWER_W,
    MOST_POWER_W,
    Connector,
)
from energy.charging.figures import LEAST_CURVE_KW, MOST_CURVE_POINTS, W_PER_KW

_MOST_KW: Final = MOST_POWER_W / W_PER_KW
_MOST_AC_KW: Final = MOST_AC_POWER_W / W_PER_KW

Percent = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=100)]
CurvePower = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=LEAST_CURVE_KW, le=_MOST_KW)]
BatteryTemperature = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=BATTERY_CELSIUS[0], le=BATTERY_CELSIUS[1])
]
Factor = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=LEAST_COLD_FACTOR, le=1)]


class ChargingSent(Sent):
    """Which plugs fit a vehicle, and what power its battery takes."""

    connectors: list[Connector] = Field(min_length=1, max_length=len(Connector), description="plugs that fit it")
    curve_soc_percent: list[Percent] | None = Field(
        default=None,
        min_length=2,
        max_length=MOST_CURVE_POINTS,
        description="charges of the curve, rising from 0 to 100; with curve_kw",
    )
    curve_kw: list[CurvePower] | None = Field(
        default=None,
        min_length=2,
        max_length=MOST_CURVE_POINTS,
        description="power into the battery at each of these charges, direct current, linear in between [kW]",
    )
    ac_kw: Number | None = Field(
        default=None, ge=0, le=_MOST_AC_KW, description="most that the charger on board takes from the wall [kW]"
    )
    ac_phases: Literal[1, 2, 3] | None = Field(default=None, description="phases that it can use; without it, 1")
    ac_one_phase_kw: Number | None = Field(
        default=None,
        ge=0,
        le=_MOST_AC_KW,
        description="most that it takes from one phase [kW]; without it, its share ac_kw / ac_phases",
    )
    ac_eff: Number | None = Field(
        default=None, ge=LEAST_EFF, le=1, description="alternating current: battery over wall; without it, 0.9"
    )
    dc_eff: Number | None = Field(
        default=None, ge=LEAST_EFF, le=1, description="direct current: battery over station; without it, 0.95"
    )
    cold_c: list[BatteryTemperature] | None = Field(
        default=None,
        min_length=1,
        max_length=MOST_CURVE_POINTS,
        description="temperatures of the battery, rising [°C]; with cold_factor",
    )
    cold_factor: list[Factor] | None = Field(
        default=None,
        min_length=1,
        max_length=MOST_CURVE_POINTS,
        description="factor on the curve at each of these, linear in between, constant beyond",
    )
