"""The section `[charging]` of vehicle files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Final

from energy.charging.charging import PHASES, Connector
from energy.charging.figures import FIGURE_OF_FIELD, ChargingFigures, charging_of
from energy.errors import VehicleError
from energy.vehicle.sections import number_of, text_in

if TYPE_CHECKING:
    from energy.charging.charging import Charging

_FIGURES: Final = tuple(figure.name for figure in fields(ChargingFigures))
_OWN_SOURCES: Final = {"dc": "curve_source", "cold_curve": "cold_source"}
_KEYS: Final = (*_FIGURES, *_OWN_SOURCES.values(), "source")


def charging_from_section(section: object, vehicle_id: str) -> Charging:
    """How a vehicle charges, of a vehicle file's section `[charging]`: any of ChargingFigures, and sources.

    Sources are kept by field of Charging: `curve_source` as that of dc, `cold_source` as that of cold_curve, `source`
    as that of all others; an efficiency that is not given is assumed, and says so.

    Raises VehicleError, naming the key, on an unknown or missing one, a wrong type, or a value out of range.
    """
    known = f"{', '.join(_KEYS[:-1])} and source"
    if not isinstance(section, Mapping):
        raise VehicleError("charging", section, f"a section with {known}", vehicle_id)
    for key in section:
        if key not in _KEYS:
            raise VehicleError(f"charging.{key}", "unknown", known, vehicle_id)
    sources = {
        field: text_in(section, _OWN_SOURCES.get(field, "source"), vehicle_id, "charging.")
        for field, figure in FIGURE_OF_FIELD.items()
        if figure in section or figure == "connectors"
    }
    figures = ChargingFigures(
        connectors=_connectors(section.get("connectors"), vehicle_id),
        curve_soc_percent=_list(section, "curve_soc_percent", vehicle_id),
        curve_kw=_list(section, "curve_kw", vehicle_id),
        ac_kw=_number(section, "ac_kw", vehicle_id),
        ac_phases=_phases(section, vehicle_id),
        ac_one_phase_kw=_number(section, "ac_one_phase_kw", vehicle_id),
        ac_eff=_number(section, "ac_eff", vehicle_id),
        dc_eff=_number(section, "dc_eff", vehicle_id),
        cold_c=_list(section, "cold_c", vehicle_id),
        cold_factor=_list(section, "cold_factor", vehicle_id),
    )
    try:
        return charging_of(figures, sources)
    except VehicleError as error:
        raise VehicleError(error.field, error.value, error.allowed, vehicle_id) from None


def _connectors(value: object, vehicle_id: str) -> tuple[Connector, ...]:
    allowed = f"a list of {', '.join(Connector)}"
    if not isinstance(value, list):
        raise VehicleError("charging.connectors", "missing" if value is None else repr(value), allowed, vehicle_id)
    for item in value:
        if not isinstance(item, str) or item not in set(Connector):
            raise VehicleError("charging.connectors", repr(item), allowed, vehicle_id)
    return tuple(Connector(item) for item in value)


def _phases(section: Mapping[str, object], vehicle_id: str) -> int | None:
    value = section.get("ac_phases")
    if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value not in PHASES):
        raise VehicleError("charging.ac_phases", repr(value), "1, 2 or 3", vehicle_id)
    return value


def _number(section: Mapping[str, object], key: str, vehicle_id: str) -> float | None:
    return number_of(section[key], f"charging.{key}", vehicle_id) if key in section else None


def _list(section: Mapping[str, object], key: str, vehicle_id: str) -> list[float] | None:
    if key not in section:
        return None
    value = section[key]
    if not isinstance(value, list):
        raise VehicleError(f"charging.{key}", repr(value), "a list of numbers", vehicle_id)
    return [number_of(item, f"charging.{key}[{k}]", vehicle_id) for k, item in enumerate(value)]
