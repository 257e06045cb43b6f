"""What is published of a vehicle's consumption and range, to hold beside the model; it feeds no calculation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Final

from energy.errors import VehicleError

MOST_KWH_PER_100KM: Final = 1000.0
MOST_RANGE_KM: Final = 10_000.0


@dataclass(frozen=True, slots=True)
class Published:
    """Published figures of one vehicle, each None where none is known.

    epa_udds_kwh_per_100km, epa_hwfet_kwh_per_100km: EPA's dynamometer tests, unadjusted [kWh/100 km].
    epa_city_kwh_per_100km, epa_highway_kwh_per_100km: EPA's label, adjusted to driving on the road [kWh/100 km].
    wltp_kwh_per_100km: type approval in Europe, combined [kWh/100 km]. epa_range_km, wltp_range_km: rated range [km].
    Energies of tests of an electric car are taken from the wall, those of a petrol car are fuel.
    listed_kwh_per_100km: what a database says of mixed driving on the road, from the battery [kWh/100 km].
    source: where the figures are from.

    Raises VehicleError when a figure is not positive or absurdly large.
    """

    source: str
    epa_udds_kwh_per_100km: float | None = None
    epa_hwfet_kwh_per_100km: float | None = None
    epa_city_kwh_per_100km: float | None = None
    epa_highway_kwh_per_100km: float | None = None
    wltp_kwh_per_100km: float | None = None
    epa_range_km: float | None = None
    wltp_range_km: float | None = None
    listed_kwh_per_100km: float | None = None

    def __post_init__(self) -> None:
        for name in PUBLISHED_FIGURES:
            value = getattr(self, name)
            most = MOST_RANGE_KM if name.endswith("_range_km") else MOST_KWH_PER_100KM
            if value is not None and not 0.0 < value <= most:
                raise VehicleError(f"published.{name}", value, f"(0, {most:g}]")


PUBLISHED_FIGURES: Final = tuple(field.name for field in fields(Published) if field.name != "source")


def published_from_section(section: object, vehicle_id: str) -> Published:
    """The figures of a vehicle file's section `[published]`: any of Published's fields, and `source`.

    Raises VehicleError on an unknown key, a wrong type, no figure at all or one out of range.
    """
    known = f"{', '.join(PUBLISHED_FIGURES)}, and source"
    if not isinstance(section, Mapping):
        raise VehicleError("published", section, f"a section with {known}", vehicle_id)
    for key in section:
        if key not in PUBLISHED_FIGURES and key != "source":
            raise VehicleError(f"published.{key}", "unknown", known, vehicle_id)
    source = section.get("source")
    if not isinstance(source, str) or not source.strip():
        raise VehicleError("published.source", repr(source), "a text that is not empty", vehicle_id)
    figures: dict[str, float] = {}
    for key in PUBLISHED_FIGURES:
        if key in section:
            value = section[key]
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise VehicleError(f"published.{key}", repr(value), "a number", vehicle_id)
            figures[key] = float(value)
    if not figures:
        raise VehicleError(
            "published", "without a figure", f"at least one of {', '.join(PUBLISHED_FIGURES)}", vehicle_id
        )
    try:
        return Published(source=source.strip(), **figures)
    except VehicleError as error:
        raise VehicleError(error.field, error.value, error.allowed, vehicle_id) from None
