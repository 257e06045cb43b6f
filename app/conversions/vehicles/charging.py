"""How a vehicle charges, between human units and the energy package."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final

from app.schemas.vehicles.charging import ChargingSent
from energy.charging.figures import FIGURE_OF_FIELD, ChargingFigures, charging_of, figures_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from energy.charging.charging import Charging

_PREFIX: Final = "charging."
_BESIDE: Final = {"curve_kw": "curve_soc_percent", "cold_factor": "cold_c"}  # figures that are of the same source
_FIELD_OF_FIGURE: Final = {figure: field for field, figure in FIGURE_OF_FIELD.items()}


def charging_from_sent(sent: ChargingSent | None, sources: Mapping[str, str]) -> Charging | None:
    """The record in SI units, with those of a vehicle's sources that are of `charging.…`.

    Raises VehicleError with the names of the schema.
    """
    if sent is None:
        return None
    own = {name.removeprefix(_PREFIX): text for name, text in sources.items() if name.startswith(_PREFIX)}
    given: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in sent}
    return charging_of(
        ChargingFigures(**given),
        {_FIELD_OF_FIGURE[figure]: text for figure, text in own.items() if figure in _FIELD_OF_FIGURE},
    )


def charging_answer(charging: Charging | None, sent: ChargingSent | None = None) -> ChargingSent | None:
    """All figures in human units, to the digit as they were sent where they were."""
    if charging is None:
        return None
    figures = figures_of(charging)
    shown: dict[str, Any] = {field.name: getattr(figures, field.name) for field in fields(ChargingFigures)}
    given = {} if sent is None else {name: value for name, value in sent if value is not None}
    return ChargingSent(**(shown | {"connectors": list(figures.connectors)} | given))


def charging_sources(charging: Charging | None) -> dict[str, str]:
    """Where each figure is from, by its name below `charging.`."""
    if charging is None:
        return {}
    figures = {FIGURE_OF_FIELD[field]: text for field, text in charging.sources.items()}
    figures |= {other: figures[figure] for figure, other in _BESIDE.items() if figure in figures}
    return {f"{_PREFIX}{figure}": text for figure, text in figures.items()}
