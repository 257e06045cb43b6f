"""What vehicles consume on driving cycles, beside what is published."""

from __future__ import annotations

from pydantic import Field

from app.schemas.base import Answered


class CycleFigure(Answered):
    """One published figure beside the model's."""

    figure: str = Field(description="the published figure, as a vehicle file names it")
    cycle: str = Field(description="the driving cycle, mixed for the mean of all")
    model_kwh_per_100km: float
    published_kwh_per_100km: float
    ratio: float = Field(description="model over published")
    allowed_ratio: tuple[float, float] = Field(description="lowest and highest that agree")
    met: bool = Field(description="whether the ratio is allowed")


class VehicleCheck(Answered):
    """One vehicle on the driving cycles."""

    id: str
    battery_kwh_per_100km: dict[str, float] = Field(description="from the battery (or tank), by driving cycle")
    figures: list[CycleFigure] = Field(description="empty where nothing is published that can be compared")
    met: bool | None = Field(description="whether all figures agree; null where there is none")


class VehicleChecks(Answered):
    """Vehicles on the driving cycles."""

    vehicles: list[VehicleCheck]
