"""How a vehicle charges, in the terms that TomTom, HERE and Mapbox take.

Curves of all three are linear between their points here, and constant before the first and after the last one. What a
vehicle says of voltages is left out: joulepath knows none of stations. Errors name the service's parameter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging.charging import LEAST_EFF, MOST_AC_POWER_W, MOST_POWER_W, Connector
from energy.charging.figures import (
    AC_EFF,
    DC_EFF,
    FIGURE_OF_FIELD,
    LEAST_CURVE_KW,
    PERCENT,
    W_PER_KW,
    ChargingFigures,
    charging_of,
)
from energy.charging.power import limited
from energy.errors import VehicleError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from energy.charging.charging import Charging

MOST_TOMTOM_CONNECTORS: Final = 20
MOST_POINTS: Final = 200
MAPBOX_AC_W: Final = 14_400.0  # the service's own where nothing is given
_LEAST_STEP: Final = 1e-9  # of the battery, between two points of a curve; closer ones are one point, given twice

_HOUSEHOLD: Final = (
    "Type_E_French_Standard_CEE_7_5",
    "Type_F_Schuko_CEE_7_4",
    "Type_G_British_Standard_BS_1363",
    "Type_J_Swiss_Standard_SEV_1011",
    "NEMA_5_20",
    "Standard_Household_Country_Specific",
)
# plugs by TomTom's plugTypes, of alternating and of direct current; others are of no car of today
TOMTOM_AC: Final = {
    "IEC_62196_Type_1_Outlet": Connector.TYPE1,
    "IEC_62196_Type_1_Connector_Cable_Attached": Connector.TYPE1,
    "SAE_J1772": Connector.TYPE1,
    "IEC_62196_Type_2_Outlet": Connector.TYPE2,
    "IEC_62196_Type_2_Connector_Cable_Attached": Connector.TYPE2,
    "IEC_62196_Type_3_Outlet": Connector.TYPE3,
    "IEC_62196_Type_3_Connector_Cable_Attached": Connector.TYPE3,
    "Combo_to_IEC_62196_Type_1_Base": Connector.TYPE1,
    "Combo_to_IEC_62196_Type_2_Base": Connector.TYPE2,
    "China_GB_Part_2": Connector.GBT_AC,
    "Tesla_Connector": Connector.NACS,
    "IEC_60309_1_Phase": Connector.CEE,
    "IEC_60309_3_Phase": Connector.CEE,
    **dict.fromkeys(_HOUSEHOLD, Connector.DOMESTIC),
}
TOMTOM_DC: Final = {
    "Combo_to_IEC_62196_Type_1_Base": Connector.CCS1,
    "Combo_to_IEC_62196_Type_2_Base": Connector.CCS2,
    "China_GB_Part_3": Connector.GBT_DC,
    "Tesla_Connector": Connector.NACS,
    "CHAdeMO": Connector.CHADEMO,
    "TEPCO": Connector.CHADEMO,
}
_TOMTOM_OTHERS: Final = (
    "Small_Paddle_Inductive",
    "Large_Paddle_Inductive",
    "IEC_309_DC_Plug",
    "AVCON_Connector",
    "Better_Place_Socket",
    "Marechal_Socket",
)
TOMTOM_PLUGS: Final = tuple(dict.fromkeys((*TOMTOM_AC, *TOMTOM_DC, *_TOMTOM_OTHERS)))
TOMTOM_PHASES: Final = {"AC1": 1, "AC3": 3}
HERE_PLUGS: Final = {
    "iec62196Type1Combo": Connector.CCS1,
    "iec62196Type2Combo": Connector.CCS2,
    "chademo": Connector.CHADEMO,
    "tesla": Connector.NACS,  # by the service an old name of saeJ3400
    "saeJ3400": Connector.NACS,
    "gbtDc": Connector.GBT_DC,
}
MAPBOX_PLUGS: Final = {
    "ccs_combo_type1": Connector.CCS1,
    "ccs_combo_type2": Connector.CCS2,
    "tesla": Connector.NACS,
    "chademo": Connector.CHADEMO,
}
_MAPBOX_AC: Final = frozenset({Connector.CCS1, Connector.CCS2, Connector.NACS})


@dataclass(frozen=True, slots=True)
class TomTomConnector:
    """One of TomTom's `chargingConnectors`.

    current_type: `currentType`, AC1, AC3 or DC. plug_types: `plugTypes`. max_power_kw: `maxPowerInkW`. efficiency:
    `efficiency`, what arrives of it. base_load_kw: `baseLoadInkW`, what the vehicle itself takes while it charges.
    """

    current_type: str
    plug_types: tuple[str, ...]
    max_power_kw: float | None = None
    efficiency: float | None = None
    base_load_kw: float = 0.0

    def says_no_eff(self) -> bool:
        """Whether it says nothing of what is lost."""
        return self.efficiency is None and self.base_load_kw == 0.0

    def eff(self, default: float) -> float:
        """Battery over wall at the connector's most power, with the base load taken off [-]."""
        given = default if self.efficiency is None else self.efficiency
        return given if not self.max_power_kw else given - self.base_load_kw / self.max_power_kw


@dataclass(frozen=True, slots=True)
class TomTomCharging:
    """TomTom's `chargingParameters`.

    battery_curve_kwh_kw: `batteryCurve`, `stateOfChargeInkWh` rising and `maxPowerInkW` of each.

    Source: developer.tomtom.com, Long Distance EV Routing, "POST data fields"; docs.tomtom.com, Maps SDK for
    JavaScript, ElectricVehicleParams.
    """

    battery_curve_kwh_kw: tuple[tuple[float, float], ...]
    charging_connectors: tuple[TomTomConnector, ...]


def charging_from_tomtom(given: TomTomCharging, max_charge_kwh: float, vehicle_id: str, source: str) -> Charging:
    """How a vehicle charges in TomTom's terms.

    Alternating current: the phases of AC3 where it is among the connectors, with the power of AC1 as that of one phase.
    The curve is limited to what arrives of the strongest connector for direct current, and left out without one. A
    combo's plug under AC1 or AC3 is its half for alternating current; of DC only plugs for direct current are taken.
    """
    field = "chargingParameters.chargingConnectors"
    if not 1 <= len(given.charging_connectors) <= MOST_TOMTOM_CONNECTORS:
        allowed = f"1..{MOST_TOMTOM_CONNECTORS}"
        raise VehicleError(field, f"{len(given.charging_connectors)} connectors", allowed, vehicle_id)
    plugs: list[Connector] = []
    by_current: dict[str, TomTomConnector] = {}
    for k, connector in enumerate(given.charging_connectors):
        plugs += _tomtom_plugs(connector, f"{field}[{k}]", vehicle_id)
        strongest = by_current.setdefault(connector.current_type, connector)
        if _most_kw(connector) > _most_kw(strongest):
            by_current[connector.current_type] = connector
    curve = "chargingParameters.batteryCurve"
    soc_percent, power_kw = _curve(given.battery_curve_kwh_kw, max_charge_kwh, curve, "kWh", vehicle_id)
    direct, three, one = by_current.get("DC"), by_current.get("AC3"), by_current.get("AC1")
    alternating = three or one
    one_phase_kw = None
    if three is not None and one is not None:
        three_kw, one_kw = _most_kw(three), _most_kw(one)
        one_phase_kw = min(max(one_kw, three_kw / TOMTOM_PHASES["AC3"]), three_kw)
    figures = ChargingFigures(
        connectors=tuple(dict.fromkeys(plugs)),
        curve_soc_percent=None if direct is None else soc_percent,
        curve_kw=None if direct is None else power_kw,
        ac_kw=None if alternating is None else alternating.max_power_kw,
        ac_phases=None if alternating is None else TOMTOM_PHASES[alternating.current_type],
        ac_one_phase_kw=one_phase_kw,
        ac_eff=None if alternating is None or alternating.says_no_eff() else alternating.eff(AC_EFF),
        dc_eff=None if direct is None or direct.says_no_eff() else direct.eff(DC_EFF),
    )
    charging = _charging(figures, field, vehicle_id, source)
    if charging.dc is None or direct is None or direct.max_power_kw is None:
        return charging
    return replace(charging, dc=limited(charging.dc, direct.max_power_kw * W_PER_KW * direct.eff(DC_EFF)))


def charging_from_here(
    curve_kwh_kw: Sequence[tuple[float, float]],
    connector_types: str,
    max_charge_kwh: float,
    vehicle_id: str,
    source: str,
) -> Charging:
    """How a vehicle charges in HERE's terms: pairs of `ev[chargingCurve]` [kWh, kW] and `ev[connectorTypes]`.

    Source: docs.here.com, Routing API v8, ev: chargingCurve, "maximum battery charging rate at a given charge level".
    """
    plugs = _plugs(connector_types, HERE_PLUGS, "connectorTypes", vehicle_id)
    soc_percent, power_kw = _curve(curve_kwh_kw, max_charge_kwh, "chargingCurve", "kWh", vehicle_id)
    figures = ChargingFigures(connectors=plugs, curve_soc_percent=soc_percent, curve_kw=power_kw)
    return _charging(figures, "connectorTypes", vehicle_id, source)


def charging_from_mapbox(
    curve_wh_w: Sequence[tuple[float, float]],
    connector_types: str,
    max_ac_w: float | None,
    max_charge_wh: float,
    vehicle_id: str,
    source: str,
) -> Charging:
    """How a vehicle charges in Mapbox' terms: pairs of `ev_charging_curve` [Wh, W], `ev_connector_types`, AC power.

    max_ac_w: `ev_max_ac_charging_power`, 14.4 kW where it is not given, on any number of phases. With `chademo` alone
    the plug for alternating current is not known, and it is left out.

    Source: docs.mapbox.com, Directions API, "Parameters for electric vehicle routing".
    """
    plugs = _plugs(connector_types, MAPBOX_PLUGS, "ev_connector_types", vehicle_id)
    kw = [(charge, power / W_PER_KW) for charge, power in curve_wh_w]
    soc_percent, power_kw = _curve(kw, max_charge_wh, "ev_charging_curve", "Wh", vehicle_id, W_PER_KW, "W")
    if max_ac_w is not None and not 0.0 <= max_ac_w <= MOST_AC_POWER_W:
        raise VehicleError("ev_max_ac_charging_power", max_ac_w, f"0..{MOST_AC_POWER_W:.0f} W", vehicle_id)
    ac_kw = (MAPBOX_AC_W if max_ac_w is None else max_ac_w) / W_PER_KW
    has_ac = ac_kw > 0.0 and not _MAPBOX_AC.isdisjoint(plugs)
    figures = ChargingFigures(
        connectors=plugs,
        curve_soc_percent=soc_percent,
        curve_kw=power_kw,
        ac_kw=ac_kw if has_ac else None,
        ac_phases=3 if has_ac else None,
        ac_one_phase_kw=ac_kw if has_ac else None,
    )
    return _charging(figures, "ev_connector_types", vehicle_id, source)


def _most_kw(connector: TomTomConnector) -> float:
    return np.inf if connector.max_power_kw is None else connector.max_power_kw


def _tomtom_plugs(connector: TomTomConnector, field: str, vehicle_id: str) -> list[Connector]:
    kinds = (*TOMTOM_PHASES, "DC")
    if connector.current_type not in kinds:
        raise VehicleError(f"{field}.currentType", repr(connector.current_type), " or ".join(kinds), vehicle_id)
    for plug in connector.plug_types:
        if plug not in TOMTOM_PLUGS:
            raise VehicleError(f"{field}.plugTypes", repr(plug), f"of {', '.join(TOMTOM_PLUGS)}", vehicle_id)
    direct = connector.current_type == "DC"
    table = TOMTOM_DC if direct else TOMTOM_AC
    found = [table[name] for name in connector.plug_types if name in table]
    if not found:
        given = ", ".join(connector.plug_types) or "none"
        raise VehicleError(f"{field}.plugTypes", given, f"at least one of {', '.join(table)}", vehicle_id)
    most_kw = connector.max_power_kw
    if most_kw is None and not direct:
        raise VehicleError(f"{field}.maxPowerInkW", "missing", "a number, with AC1 and AC3", vehicle_id)
    if most_kw is not None and not most_kw >= LEAST_CURVE_KW:
        raise VehicleError(f"{field}.maxPowerInkW", most_kw, f"at least {LEAST_CURVE_KW:g}", vehicle_id)
    eff = connector.eff(DC_EFF if direct else AC_EFF)
    if not LEAST_EFF <= eff <= 1.0:
        allowed = f"efficiency - baseLoadInkW/maxPowerInkW within {LEAST_EFF:g}..1"
        raise VehicleError(f"{field}.efficiency", eff, allowed, vehicle_id)
    return found


def _plugs(text: str, table: Mapping[str, Connector], field: str, vehicle_id: str) -> tuple[Connector, ...]:
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in table:
            raise VehicleError(field, repr(name), f"of {', '.join(table)}, separated by commas", vehicle_id)
    return tuple(dict.fromkeys(table[name] for name in names))


def _curve(
    points: Sequence[tuple[float, float]],
    most_charge: float,
    field: str,
    unit: str,
    vehicle_id: str,
    per_kw: float = 1.0,
    power_unit: str = "kW",
) -> tuple[list[float], list[float]]:
    """Charges [%] from 0 to 100 and powers [kW] of pairs of charge, in a unit, and power [kW]."""
    if not 1 <= len(points) <= MOST_POINTS:
        raise VehicleError(field, f"{len(points)} points", f"1..{MOST_POINTS}", vehicle_id)
    charges = np.array([charge for charge, _ in points], np.float64)
    power_kw = [power for _, power in points]
    share = charges / most_charge
    if not bool(np.all((share >= 0.0) & (share <= 1.0 + _LEAST_STEP))):
        raise VehicleError(field, charges.tolist(), f"charges within 0..{most_charge:g} {unit}", vehicle_id)
    if not bool(np.all(np.diff(share) >= _LEAST_STEP)):
        raise VehicleError(field, charges.tolist(), "rising charges, each once", vehicle_id)
    most_kw = MOST_POWER_W / W_PER_KW
    if not all(LEAST_CURVE_KW <= power <= most_kw for power in power_kw):
        allowed = f"each power {LEAST_CURVE_KW * per_kw:g}..{most_kw * per_kw:.0f} {power_unit}"
        raise VehicleError(field, [power * per_kw for power in power_kw], allowed, vehicle_id)
    soc = np.minimum(share, 1.0).tolist()
    if soc[0] < _LEAST_STEP:
        soc[0] = 0.0
    else:
        soc, power_kw = [0.0, *soc], [power_kw[0], *power_kw]
    if soc[-1] > 1.0 - _LEAST_STEP:
        soc[-1] = 1.0
    else:
        soc, power_kw = [*soc, 1.0], [*power_kw, power_kw[-1]]
    return [charge * PERCENT for charge in soc], power_kw


def _charging(figures: ChargingFigures, field: str, vehicle_id: str, source: str) -> Charging:
    """The record; what is still wrong with it is told by the plugs' parameter."""
    sources = {}
    if source:
        sources = {name: source for name, figure in FIGURE_OF_FIELD.items() if getattr(figures, figure) is not None}
    try:
        return charging_of(figures, sources)
    except VehicleError as error:
        raise VehicleError(field, error.value, error.allowed, vehicle_id) from error
