"""Charging in the terms of TomTom, HERE and Mapbox: their documented examples, by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from energy.charging.charging import Charging, Connector
from energy.errors import VehicleError
from energy.vehicle.service_charging import (
    TomTomCharging,
    TomTomConnector,
    charging_from_tomtom,
)
from energy.vehicle.services import HereParameters, MapboxParameters, vehicle_from_here, vehicle_from_mapbox

TYPE2_PLUGS = (
    "IEC_62196_Type_2_Outlet",
    "IEC_62196_Type_2_Connector_Cable_Attached",
    "Combo_to_IEC_62196_Type_2_Base",
)
# TomTom, Maps SDK for JavaScript, ElectricVehicleParams; its maxChargeKWH of 75 is below its last point of 80
AC = TomTomConnector("AC3", TYPE2_PLUGS, max_power_kw=11.0, efficiency=0.9, base_load_kw=0.2)
DC = TomTomConnector("DC", TYPE2_PLUGS, max_power_kw=150.0, efficiency=0.9, base_load_kw=0.2)
TOMTOM = TomTomCharging(((50.0, 200.0), (70.0, 100.0), (80.0, 40.0)), (AC, DC))
# HERE, Routing API v8, EV routing
HERE_CURVE = "0,239,32,199,56,167,60,130,64,111,68,83,72,55,76,33,78,17,80,1"
# Mapbox, Directions API
MAPBOX_CURVE = "0,100000; 40000,70000; 60000,30000; 80000,10000"


def tomtom(given: TomTomCharging = TOMTOM, max_charge_kwh: float = 80.0, source: str = "") -> Charging:
    return charging_from_tomtom(given, max_charge_kwh, "car", source)


def here(**changed: Any) -> Charging:
    given: dict[str, Any] = {"charging_curve_kwh_kw": HERE_CURVE, "connector_types": "iec62196Type2Combo"}
    parameters = HereParameters("0,0.2", max_charge_kwh=80.0, **(given | changed))
    charging = vehicle_from_here("car", "Car", parameters).charging
    assert charging is not None
    return charging


def mapbox(**changed: Any) -> Charging:
    given: dict[str, Any] = {"ev_charging_curve_wh_w": MAPBOX_CURVE, "ev_connector_types": "ccs_combo_type2"}
    parameters = MapboxParameters("0,300", ev_max_charge_wh=80_000.0, **(given | changed))
    charging = vehicle_from_mapbox("car", "Car", parameters).charging
    assert charging is not None
    return charging


def points(charging: Charging) -> list[tuple[float, float]]:
    """Charge [-] and power [kW] of a curve."""
    assert charging.dc is not None
    return list(zip(charging.dc.soc_frac.tolist(), (charging.dc.power_w / 1000.0).tolist(), strict=True))


def test_tomtoms_example_is_its_curve_limited_to_what_arrives_of_its_connector() -> None:
    charging = tomtom()
    assert charging.connectors == (Connector.TYPE2, Connector.CCS2)
    # 150 kW · 0.9 − 0.2 kW = 134.8 kW, crossed between 200 kW at 50 and 100 kW at 70 kWh: 50 + 20 · 65.2/100 = 63.04
    expected = [(0.0, 134.8), (63.04 / 80, 134.8), (70 / 80, 100.0), (1.0, 40.0)]
    assert [pair[0] for pair in points(charging)] == pytest.approx([pair[0] for pair in expected])
    assert [pair[1] for pair in points(charging)] == pytest.approx([pair[1] for pair in expected])
    assert (charging.ac_power_w, charging.ac_phases, charging.ac_one_phase_w) == (11_000.0, 3, None)
    assert charging.ac_eff == pytest.approx(0.9 - 0.2 / 11)
    assert charging.dc_eff == pytest.approx(0.9 - 0.2 / 150)


def test_tomtoms_power_of_one_phase_is_that_of_ac1_within_what_three_allow() -> None:
    for one_kw, expected_kw in ((7.4, 7.4), (2.3, 11 / 3), (22.0, 11.0)):
        one = TomTomConnector("AC1", TYPE2_PLUGS, max_power_kw=one_kw)
        charging = tomtom(replace(TOMTOM, charging_connectors=(one, AC, DC)))
        assert (charging.ac_power_w, charging.ac_phases) == (11_000.0, 3)
        assert charging.ac_one_phase_w == pytest.approx(1000.0 * expected_kw)


def test_tomtoms_car_of_one_current_has_that_current_only() -> None:
    only_ac = tomtom(replace(TOMTOM, charging_connectors=(TomTomConnector("AC1", ("SAE_J1772",), 7.2),)))
    assert (only_ac.connectors, only_ac.dc, only_ac.ac_power_w) == ((Connector.TYPE1,), None, 7_200.0)
    only_dc = tomtom(replace(TOMTOM, charging_connectors=(TomTomConnector("DC", ("CHAdeMO",)),)))
    assert (only_dc.connectors, only_dc.ac_power_w) == ((Connector.CHADEMO,), 0.0)
    assert points(only_dc) == [(0.0, 200.0), (50 / 80, 200.0), (70 / 80, 100.0), (1.0, 40.0)]


def test_tomtoms_strongest_connector_of_a_current_counts() -> None:
    weak = TomTomConnector("DC", ("CHAdeMO",), 50.0)
    charging = tomtom(replace(TOMTOM, charging_connectors=(weak, DC, AC)))
    assert charging.connectors == (Connector.CHADEMO, Connector.CCS2, Connector.TYPE2)
    assert points(charging)[0] == (0.0, pytest.approx(134.8))


def test_heres_example_goes_through_its_points() -> None:
    charging = here()
    assert charging.connectors == (Connector.CCS2,)
    assert points(charging)[:3] == [(0.0, 239.0), (0.4, 199.0), (0.7, 167.0)]
    assert points(charging)[-1] == (1.0, 1.0)
    assert charging.ac_power_w == 0.0


def test_heres_names_of_plugs_are_known() -> None:
    names = "iec62196Type1Combo, iec62196Type2Combo,chademo,tesla,saeJ3400,gbtDc"
    found = here(connector_types=names).connectors
    assert found == (Connector.CCS1, Connector.CCS2, Connector.CHADEMO, Connector.NACS, Connector.GBT_DC)


def test_curve_is_constant_before_its_first_and_after_its_last_point() -> None:
    assert points(here(charging_curve_kwh_kw="20,100,60,50")) == [(0, 100), (0.25, 100), (0.75, 50), (1, 50)]
    assert points(here(charging_curve_kwh_kw="40,90")) == [(0, 90), (0.5, 90), (1, 90)]
    assert points(here(charging_curve_kwh_kw="80,90")) == [(0, 90), (1, 90)]
    assert points(here(charging_curve_kwh_kw="0,90")) == [(0, 90), (1, 90)]


def test_mapboxs_example_is_70_kw_at_40_kwh() -> None:
    charging = mapbox()
    assert charging.connectors == (Connector.CCS2,)
    assert points(charging) == [(0.0, 100.0), (0.5, 70.0), (0.75, 30.0), (1.0, 10.0)]
    assert (charging.ac_power_w, charging.ac_phases, charging.ac_one_phase_w) == (14_400.0, 3, 14_400.0)


def test_mapboxs_alternating_power_is_as_given_and_needs_a_plug_for_it() -> None:
    assert mapbox(ev_max_ac_charging_power_w=7_400.0).ac_power_w == 7_400.0
    assert mapbox(ev_max_ac_charging_power_w=0.0).ac_power_w == 0.0
    assert mapbox(ev_connector_types="chademo", ev_max_ac_charging_power_w=6_600.0).ac_power_w == 0.0
    assert mapbox(ev_connector_types="tesla,ccs_combo_type1").connectors == (Connector.NACS, Connector.CCS1)


def test_source_is_kept_for_what_was_given_and_the_rest_is_assumed() -> None:
    sources = tomtom(source="TomTom's page").sources
    assert {name for name, text in sources.items() if text == "TomTom's page"} == set(sources)
    without = tomtom(replace(TOMTOM, charging_connectors=(TomTomConnector("DC", ("CHAdeMO",)),)), source="page").sources
    assert without["dc"] == "page"
    assert without["dc_eff"].startswith("assumed: ")
    assert without["ac_eff"].startswith("assumed: ")


@pytest.mark.parametrize(
    ("changed", "field", "allowed"),
    [
        ({"battery_curve_kwh_kw": ()}, "batteryCurve", "1..200"),
        ({"battery_curve_kwh_kw": tuple((k / 10, 9.0) for k in range(201))}, "batteryCurve", "1..200"),
        ({"battery_curve_kwh_kw": ((50.0, 9.0), (40.0, 8.0))}, "batteryCurve", "rising charges, each once"),
        ({"battery_curve_kwh_kw": ((50.0, 9.0), (50.0, 8.0))}, "batteryCurve", "rising charges, each once"),
        ({"battery_curve_kwh_kw": ((-1.0, 9.0),)}, "batteryCurve", "charges within 0..80 kWh"),
        ({"battery_curve_kwh_kw": ((81.0, 9.0),)}, "batteryCurve", "charges within 0..80 kWh"),
        ({"battery_curve_kwh_kw": ((float("nan"), 9.0),)}, "batteryCurve", "charges within 0..80 kWh"),
        ({"battery_curve_kwh_kw": ((0.0, 9.0), (80.0, 0.0))}, "batteryCurve", "each power 0.001..4000 kW"),
        ({"charging_connectors": ()}, "chargingConnectors", "1..20"),
        ({"charging_connectors": (replace(DC, current_type="dc"),)}, "chargingConnectors[0].currentType", "AC1 or AC3"),
        ({"charging_connectors": (AC, replace(DC, plug_types=("CCS",)))}, "chargingConnectors[1].plugTypes", "of IEC"),
        ({"charging_connectors": (replace(DC, plug_types=TYPE2_PLUGS[:1]),)}, "chargingConnectors[0].plugTypes", "at "),
        ({"charging_connectors": (replace(AC, max_power_kw=None),)}, "chargingConnectors[0].maxPowerInkW", "with AC1"),
        (
            {"charging_connectors": (replace(AC, max_power_kw=0.0),)},
            "chargingConnectors[0].maxPowerInkW",
            "at least 0.001",
        ),
        ({"charging_connectors": (replace(AC, base_load_kw=10.0),)}, "chargingConnectors[0].efficiency", "0.01..1"),
        ({"charging_connectors": (replace(AC, efficiency=1.1),)}, "chargingConnectors[0].efficiency", "0.01..1"),
        ({"charging_connectors": (replace(AC, max_power_kw=150.0),)}, "chargingConnectors", "0..100 kW"),
    ],
)
def test_tomtom_values_that_no_vehicle_can_have_are_refused(changed: dict[str, Any], field: str, allowed: str) -> None:
    with pytest.raises(VehicleError) as caught:
        tomtom(replace(TOMTOM, **changed))
    assert caught.value.field == f"chargingParameters.{field}"
    assert allowed in caught.value.allowed
    assert caught.value.vehicle_id == "car"


@pytest.mark.parametrize(
    ("changed", "field", "allowed"),
    [
        ({"connector_types": None}, "chargingCurve and connectorTypes", "both or none"),
        ({"charging_curve_kwh_kw": None}, "chargingCurve and connectorTypes", "both or none"),
        ({"charging_curve_kwh_kw": "0,239,32"}, "chargingCurve", "a power for each charge"),
        ({"charging_curve_kwh_kw": "0;239"}, "chargingCurve", "a number"),
        ({"charging_curve_kwh_kw": ""}, "chargingCurve", "a number"),
        ({"charging_curve_kwh_kw": "0,239,90,100"}, "chargingCurve", "charges within 0..80 kWh"),
        ({"charging_curve_kwh_kw": "0,5000"}, "chargingCurve", "each power 0.001..4000 kW"),
        ({"connector_types": "ccs2"}, "connectorTypes", "of iec62196Type1Combo, iec62196Type2Combo"),
        ({"connector_types": ""}, "connectorTypes", "of iec62196Type1Combo, iec62196Type2Combo"),
    ],
)
def test_here_values_that_no_vehicle_can_have_are_refused(changed: dict[str, Any], field: str, allowed: str) -> None:
    with pytest.raises(VehicleError) as caught:
        here(**changed)
    assert caught.value.field == field
    assert allowed in caught.value.allowed


@pytest.mark.parametrize(
    ("changed", "field", "allowed"),
    [
        ({"ev_connector_types": None}, "ev_charging_curve and ev_connector_types", "both or none"),
        ({"ev_charging_curve_wh_w": None}, "ev_charging_curve and ev_connector_types", "both or none"),
        (
            {"ev_charging_curve_wh_w": None, "ev_connector_types": None, "ev_max_ac_charging_power_w": 7e3},
            "ev_max_ac_charging_power",
            "only with ev_charging_curve and ev_connector_types",
        ),
        ({"ev_charging_curve_wh_w": "0,100000,40000"}, "ev_charging_curve", "charge,power"),
        ({"ev_charging_curve_wh_w": "0,1e5;80001,1e5"}, "ev_charging_curve", "charges within 0..80000 Wh"),
        ({"ev_charging_curve_wh_w": "0,1e5;800,0"}, "ev_charging_curve", "each power 1..4000000 W"),
        ({"ev_connector_types": "ccs_combo_type2;chademo"}, "ev_connector_types", "of ccs_combo_type1"),
        ({"ev_max_ac_charging_power_w": 2e5}, "ev_max_ac_charging_power", "0..100000 W"),
    ],
)
def test_mapbox_values_that_no_vehicle_can_have_are_refused(changed: dict[str, Any], field: str, allowed: str) -> None:
    with pytest.raises(VehicleError) as caught:
        mapbox(**changed)
    assert caught.value.field == field
    assert allowed in caught.value.allowed
