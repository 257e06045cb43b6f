"""How a vehicle charges in the units that people use, as files and requests have it."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging.charging import MOST_AC_POWER_W, MOST_POWER_W, Charging, Connector, PowerCurve
from energy.errors import VehicleError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

AC_EFF: Final = 0.9
DC_EFF: Final = 0.95
AC_EFF_SOURCE: Final = "assumed: 0.90, emobpy's figure of a charger; fastsim has 0.86"
DC_EFF_SOURCE: Final = (
    "assumed: 0.95, between the station's output and the battery: cable, cooling, heating of the pack"
)
MOST_CURVE_POINTS: Final = 500
LEAST_CURVE_KW: Final = 0.001
W_PER_KW: Final = 1000.0
PERCENT: Final = 100.0


@dataclass(frozen=True, slots=True)
class ChargingFigures:
    """How a vehicle charges, in kW, per cent and °C; what is left out is None.

    connectors: plugs that fit. curve_soc_percent, curve_kw: power at the battery by its charge, rising from 0 to 100.
    ac_kw, ac_phases, ac_one_phase_kw: most from the wall, phases that it can use, most from one of them.
    ac_eff, dc_eff: battery from wall. cold_c, cold_factor: factor on the curve by the battery's temperature.
    """

    connectors: tuple[Connector, ...]
    curve_soc_percent: Sequence[float] | None = None
    curve_kw: Sequence[float] | None = None
    ac_kw: float | None = None
    ac_phases: int | None = None
    ac_one_phase_kw: float | None = None
    ac_eff: float | None = None
    dc_eff: float | None = None
    cold_c: Sequence[float] | None = None
    cold_factor: Sequence[float] | None = None


# name of a figure by the field of Charging that it fills, for sources
FIGURE_OF_FIELD: Final = {
    "connectors": "connectors",
    "dc": "curve_kw",
    "ac_power_w": "ac_kw",
    "ac_phases": "ac_phases",
    "ac_one_phase_w": "ac_one_phase_kw",
    "ac_eff": "ac_eff",
    "dc_eff": "dc_eff",
    "cold_curve": "cold_factor",
}
_ALLOWED_KW: Final = f"each {LEAST_CURVE_KW:g}..{MOST_POWER_W / W_PER_KW:g} kW"
# by the field that an error of Charging names: the figure, and what is allowed in its unit where the unit differs
_REFUSED: Final = {
    "charging.curve": ("curve_kw", ""),
    "charging.curve.soc": ("curve_soc_percent", "rising from 0 to 100"),
    "charging.curve.power": ("curve_kw", _ALLOWED_KW),
    "charging.ac_power_w": ("ac_kw", f"0..{MOST_AC_POWER_W / W_PER_KW:g} kW, above 0 without a curve"),
    "charging.ac_one_phase_w": ("ac_one_phase_kw", "from ac_kw / ac_phases to ac_kw"),
    "charging.cold_curve.temperature": ("cold_c", ""),
    "charging.cold_curve.factor": ("cold_factor", ""),
}


def charging_of(figures: ChargingFigures, sources: Mapping[str, str]) -> Charging:
    """The record in SI units; efficiencies that are not given are assumed, and say so in its sources.

    sources: where each number is from, by field of Charging.
    Raises VehicleError that names `charging.<figure>`, with value and range in its unit.
    """
    curve = _pair(figures, "curve_soc_percent", "curve_kw")
    cold = _pair(figures, "cold_c", "cold_factor")
    assumed = {"ac_eff": AC_EFF_SOURCE} if figures.ac_eff is None else {}
    assumed |= {"dc_eff": DC_EFF_SOURCE} if figures.dc_eff is None else {}
    try:
        return Charging(
            connectors=figures.connectors,
            dc=None if curve is None else _power_curve(*curve),
            ac_power_w=(figures.ac_kw or 0.0) * W_PER_KW,
            ac_phases=1 if figures.ac_phases is None else figures.ac_phases,
            ac_eff=AC_EFF if figures.ac_eff is None else figures.ac_eff,
            dc_eff=DC_EFF if figures.dc_eff is None else figures.dc_eff,
            cold_curve=() if cold is None else tuple(zip(*cold, strict=True)),
            sources=MappingProxyType(assumed | dict(sources)),
            ac_one_phase_w=None if figures.ac_one_phase_kw is None else figures.ac_one_phase_kw * W_PER_KW,
        )
    except VehicleError as error:
        figure, allowed = _REFUSED.get(error.field, (error.field.removeprefix("charging."), ""))
        given = getattr(figures, figure)
        value = error.value if given is None or figure == "connectors" else given
        raise VehicleError(f"charging.{figure}", value, allowed or error.allowed) from None


def figures_of(charging: Charging) -> ChargingFigures:
    """The figures of a record, those of a curve as they are written: 0.07 of the charge is 7 per cent."""
    dc, one_phase_w = charging.dc, charging.ac_one_phase_w
    cold = charging.cold_curve
    return ChargingFigures(
        connectors=charging.connectors,
        curve_soc_percent=None if dc is None else _written(dc.soc_frac * PERCENT),
        curve_kw=None if dc is None else _written(dc.power_w / W_PER_KW),
        ac_kw=charging.ac_power_w / W_PER_KW,
        ac_phases=charging.ac_phases,
        ac_one_phase_kw=None if one_phase_w is None else one_phase_w / W_PER_KW,
        ac_eff=charging.ac_eff,
        dc_eff=charging.dc_eff,
        cold_c=[celsius for celsius, _ in cold] or None,
        cold_factor=[factor for _, factor in cold] or None,
    )


def _written(numbers: NDArray[np.float64]) -> list[float]:
    """Numbers to twelve digits, which conversions keep."""
    return [float(f"{number:.12g}") for number in numbers.tolist()]


def _pair(figures: ChargingFigures, abscissa: str, ordinate: str) -> tuple[Sequence[float], Sequence[float]] | None:
    """Two lists of as many numbers; None where neither is given."""
    first, second = getattr(figures, abscissa), getattr(figures, ordinate)
    if first is None and second is None:
        return None
    for name, other, value in ((abscissa, ordinate, first), (ordinate, abscissa, second)):
        if value is None:
            raise VehicleError(f"charging.{name}", "missing", f"a list of numbers, together with {other}")
    if len(first) != len(second):
        raise VehicleError(f"charging.{ordinate}", f"{len(second)} values", f"{len(first)}, as many as {abscissa}")
    if len(first) > MOST_CURVE_POINTS:
        raise VehicleError(f"charging.{abscissa}", f"{len(first)} values", f"at most {MOST_CURVE_POINTS}")
    return first, second


def _power_curve(soc_percent: Sequence[float], power_kw: Sequence[float]) -> PowerCurve:
    if any(power < LEAST_CURVE_KW for power in power_kw):
        raise VehicleError("charging.curve.power", power_kw, _ALLOWED_KW)
    soc_frac = np.array(soc_percent, np.float64) / PERCENT
    power_w = np.array(power_kw, np.float64) * W_PER_KW
    soc_frac.flags.writeable = False
    power_w.flags.writeable = False
    return PowerCurve(soc_frac, power_w)
