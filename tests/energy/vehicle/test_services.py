"""Vehicles in the terms of TomTom, HERE and Mapbox: their documented examples, by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from energy.errors import VehicleError
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import load_vehicle
from energy.vehicle.services import (
    HereParameters,
    MapboxParameters,
    TomTomParameters,
    vehicle_from_here,
    vehicle_from_mapbox,
    vehicle_from_tomtom,
)

BUNDLED = Path(__file__).resolve().parents[3] / "data" / "vehicles"
# Azure Maps, Route - Get Route Range: sensible values for electric cars; the weight is assumed
AZURE: dict[str, Any] = {
    "constant_speed_consumption_kwh_per_100km": "50,8.2:130,21.3",
    "vehicle_weight_kg": 1900.0,
    "acceleration_eff": 0.66,
    "deceleration_eff": 0.91,
    "uphill_eff": 0.74,
    "downhill_eff": 0.73,
    "auxiliary_power_kw": 1.7,
    "max_charge_kwh": 85.0,
}
# HERE, "Calculate consumption per section"
HERE: dict[str, Any] = {
    "free_flow_speed_table_wh_per_m": "10,0.130,20,0.132,30,0.136,40,0.142,50,0.151,60,0.161,70,0.176,80,0.194,"
    "90,0.214,100,0.237,110,0.264,120,0.290,130,0.321,140,0.354,150,0.389,160,0.426,170,0.466,180,0.509,190,0.554,"
    "200,0.601",
    "ascent_wh_per_m": 9.0,
    "descent_wh_per_m": 4.3,
    "auxiliary_consumption_wh_per_s": 1.8,
    "max_charge_kwh": 80.0,
}
# Mapbox, EvDataProvider
MAPBOX: dict[str, Any] = {
    "energy_consumption_curve_wh_per_km": "0,300;20,160;80,140;120,180",
    "ev_max_charge_wh": 50_000.0,
}


def tomtom(**changed: object) -> ConsumptionTableVehicle:
    return vehicle_from_tomtom("car", "Car", TomTomParameters(**(AZURE | changed)))


def here(source: str = "", **changed: object) -> ConsumptionTableVehicle:
    return vehicle_from_here("car", "Car", HereParameters(**(HERE | changed)), source)


def mapbox(**changed: object) -> ConsumptionTableVehicle:
    return vehicle_from_mapbox("car", "Car", MapboxParameters(**(MAPBOX | changed)))


def wh_per_km(vehicle: ConsumptionTableVehicle, *speeds_kmh: float) -> list[float]:
    return [float(c) / 3.6 for c in vehicle.consumption_at(np.array(speeds_kmh) / 3.6)]


def test_tomtoms_example_is_linear_between_its_speeds_and_goes_on_with_their_slope() -> None:
    # (21.3 − 8.2)/(130 − 50) = 0.16375 kWh/100 km a km/h: 8.2 − 50·0.16375 = 0.0125; 21.3 + 30·0.16375 = 26.2125
    assert wh_per_km(tomtom(), 0, 50, 90, 130, 160) == pytest.approx([0.125, 82.0, 147.5, 213.0, 262.125])


def test_tomtoms_efficiencies_give_mass_over_and_times_them() -> None:
    car = tomtom()
    # 1900 kg · 9.81 m/s² = 18 639 N
    assert car.ascent_j_per_m == pytest.approx(18_639.0 / 0.74)
    assert car.descent_j_per_m == pytest.approx(18_639.0 * 0.73)
    assert car.kinetic_up_kg == pytest.approx(1900.0 / 0.66)
    assert car.kinetic_down_kg == pytest.approx(1900.0 * 0.91)
    assert (car.aux_power_w, car.usable_capacity_wh) == (1700.0, 85_000.0)


def test_tomtoms_points_may_come_in_any_order() -> None:
    turned = tomtom(constant_speed_consumption_kwh_per_100km="130,21.3:50,8.2")
    np.testing.assert_array_equal(turned.speed_mps, tomtom().speed_mps)
    np.testing.assert_array_equal(turned.consumption_j_per_m, tomtom().consumption_j_per_m)


def test_tomtoms_single_point_holds_at_every_speed() -> None:
    assert wh_per_km(tomtom(constant_speed_consumption_kwh_per_100km="50,8.2"), 0, 50, 200) == pytest.approx([82.0] * 3)


def test_tomtom_without_efficiencies_takes_nothing_for_height_and_speed() -> None:
    bare = TomTomParameters(constant_speed_consumption_kwh_per_100km="50,8.2:130,21.3", max_charge_kwh=85.0)
    car = vehicle_from_tomtom("car", "Car", bare)
    assert (car.ascent_j_per_m, car.descent_j_per_m, car.kinetic_up_kg, car.kinetic_down_kg) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("gain", [0.1, 0.49, 0.66, 0.7])
def test_tomtoms_efficiencies_whose_product_is_one_give_back_all_of_it(gain: float) -> None:
    car = tomtom(acceleration_eff=gain, deceleration_eff=1.0 / gain)
    assert car.kinetic_down_kg == pytest.approx(car.kinetic_up_kg)


def test_bundled_tomtom_example_is_the_documented_one() -> None:
    bundled = load_vehicle(BUNDLED / "example-tomtom-table.toml")
    assert isinstance(bundled, ConsumptionTableVehicle)
    example = tomtom()
    np.testing.assert_allclose(bundled.speed_mps, example.speed_mps)
    np.testing.assert_allclose(bundled.consumption_j_per_m, example.consumption_j_per_m)
    for field in ("ascent_j_per_m", "descent_j_per_m", "kinetic_up_kg", "kinetic_down_kg"):
        assert getattr(bundled, field) == pytest.approx(getattr(example, field), rel=1e-5)
    assert (bundled.aux_power_w, bundled.usable_capacity_wh) == (example.aux_power_w, example.usable_capacity_wh)


def test_heres_example_is_linear_between_its_speeds_and_constant_beyond() -> None:
    assert wh_per_km(here(), 0, 10, 95, 200, 250) == pytest.approx([130.0, 130.0, 225.5, 601.0, 601.0])


def test_heres_climbs_and_auxiliaries_are_in_watt_hours() -> None:
    car = here()
    assert (car.ascent_j_per_m, car.descent_j_per_m) == pytest.approx((32_400.0, 15_480.0))
    assert car.aux_power_w == pytest.approx(6480.0)  # 1.8 Wh/s


def test_heres_units_explain_the_answer_that_its_page_shows() -> None:
    # 3.856 kWh for 8191 m in 1284 s; less 1.8 Wh/s of auxiliaries the rest must lie between the page's two tables,
    # free flow 0.130 and heavy traffic 0.349 Wh/m
    rest_wh_per_m = (3856.0 - here().aux_power_w / 3600.0 * 1284.0) / 8191.0
    assert 0.130 < rest_wh_per_m < 0.349


def test_bundled_here_example_is_the_documented_one() -> None:
    bundled = load_vehicle(BUNDLED / "example-here-table.toml")
    assert isinstance(bundled, ConsumptionTableVehicle)
    np.testing.assert_allclose(bundled.speed_mps, here().speed_mps)
    np.testing.assert_allclose(bundled.consumption_j_per_m, here().consumption_j_per_m)
    for field in ("ascent_j_per_m", "descent_j_per_m", "aux_power_w", "usable_capacity_wh"):
        assert getattr(bundled, field) == pytest.approx(getattr(here(), field))


def test_mapboxs_example_is_160_wh_per_km_at_20_kmh() -> None:
    car = mapbox(ev_ascent_wh_per_m=8.0, ev_descent_wh_per_m=5.0, auxiliary_consumption_w=300.0)
    assert wh_per_km(car, 0, 20, 50, 120, 150) == pytest.approx([300.0, 160.0, 150.0, 180.0, 180.0])
    assert (car.ascent_j_per_m, car.descent_j_per_m) == (28_800.0, 18_000.0)
    assert (car.aux_power_w, car.usable_capacity_wh) == (300.0, 50_000.0)


def test_same_car_in_three_terms_takes_the_same_energy() -> None:
    vehicles = (
        tomtom(constant_speed_consumption_kwh_per_100km="0,12:255,24"),
        here(free_flow_speed_table_wh_per_m="0,0.12,255,0.24"),
        mapbox(energy_consumption_curve_wh_per_km="0,120;255,240"),
    )
    for vehicle in vehicles:
        assert wh_per_km(vehicle, 0, 85, 255) == pytest.approx([120.0, 160.0, 240.0])


def test_source_is_kept_for_every_number() -> None:
    car = here(source="HERE's page")
    assert set(car.sources.values()) == {"HERE's page"}
    assert "consumption_j_per_m" in car.sources
    assert dict(here().sources) == {}


@pytest.mark.parametrize(
    ("changed", "field", "allowed"),
    [
        ({"constant_speed_consumption_kwh_per_100km": "50;8.2"}, "constantSpeedConsumption", "speed,consumption"),
        ({"constant_speed_consumption_kwh_per_100km": "50,x"}, "constantSpeedConsumption", "a number"),
        (
            {"constant_speed_consumption_kwh_per_100km": "50,8:50,9"},
            "constantSpeedConsumption",
            "rising speeds, each once",
        ),
        ({"constant_speed_consumption_kwh_per_100km": "50,8:300,9"}, "constantSpeedConsumption", "within 0..255"),
        ({"constant_speed_consumption_kwh_per_100km": "50,9:90,8"}, "constantSpeedConsumption", "not falling"),
        (
            {"constant_speed_consumption_kwh_per_100km": "50,-1:90,8"},
            "constantSpeedConsumption",
            "each 0..1000 kWh/100 km",
        ),
        (
            {"constant_speed_consumption_kwh_per_100km": "0,1:1,90"},
            "constantSpeedConsumption",
            "each 0..1000 kWh/100 km",
        ),
        ({"constant_speed_consumption_kwh_per_100km": "50,8:60,18"}, "constantSpeedConsumption", "stays above 0"),
        (
            {"constant_speed_consumption_kwh_per_100km": ":".join(f"{10 * k},9" for k in range(26))},
            "constantSpeedConsumption",
            "1..25",
        ),
        ({"uphill_eff": None}, "uphillEfficiency and downhillEfficiency", "both or none"),
        ({"deceleration_eff": 1.6}, "accelerationEfficiency and decelerationEfficiency", "a product of at most 1"),
        ({"vehicle_weight_kg": 0.0}, "vehicleWeight", "above 0"),
        ({"max_charge_kwh": 0.0}, "usable_capacity_wh", "0.001..1e+07"),
    ],
)
def test_tomtom_values_that_the_service_refuses_are_refused(
    changed: dict[str, object], field: str, allowed: str
) -> None:
    with pytest.raises(VehicleError) as caught:
        tomtom(**changed)
    assert caught.value.field.startswith(field)
    assert allowed in caught.value.allowed
    assert caught.value.vehicle_id == "car"


@pytest.mark.parametrize(
    ("changed", "field", "allowed"),
    [
        ({"free_flow_speed_table_wh_per_m": "0,0.2,30"}, "freeFlowSpeedTable", "a consumption for each speed"),
        ({"free_flow_speed_table_wh_per_m": "0,fast"}, "freeFlowSpeedTable", "a number"),
        ({"free_flow_speed_table_wh_per_m": "0,nan"}, "freeFlowSpeedTable", "a number"),
        ({"free_flow_speed_table_wh_per_m": "30,0.2,0,0.2"}, "freeFlowSpeedTable", "rising"),
        ({"free_flow_speed_table_wh_per_m": "0,0.2,401,0.2"}, "freeFlowSpeedTable", "within 0..400 km/h"),
        ({"free_flow_speed_table_wh_per_m": "0,10.5"}, "freeFlowSpeedTable", "each 0..10 Wh/m"),
        ({"descent_wh_per_m": 10.0}, "descent", "0..9, at most ascent"),
    ],
)
def test_here_values_that_no_vehicle_can_have_are_refused(changed: dict[str, object], field: str, allowed: str) -> None:
    with pytest.raises(VehicleError) as caught:
        here(**changed)
    assert caught.value.field == field
    assert allowed in caught.value.allowed


@pytest.mark.parametrize(
    ("changed", "field", "allowed"),
    [
        ({"ev_ascent_wh_per_m": 8.0}, "ev_ascent and ev_descent", "both or none"),
        ({"ev_ascent_wh_per_m": 2000.0, "ev_descent_wh_per_m": 1.0}, "ev_ascent", "0..1000"),
        ({"energy_consumption_curve_wh_per_km": "0,300,20,160"}, "energy_consumption_curve", "speed,consumption"),
        ({"energy_consumption_curve_wh_per_km": "20,160;0,300"}, "energy_consumption_curve", "rising"),
        ({"ev_ascent_wh_per_m": 8.0, "ev_descent_wh_per_m": 9.0}, "ev_descent", "0..8, at most ev_ascent"),
    ],
)
def test_mapbox_values_that_the_service_refuses_are_refused(
    changed: dict[str, object], field: str, allowed: str
) -> None:
    with pytest.raises(VehicleError) as caught:
        mapbox(**changed)
    assert caught.value.field == field
    assert allowed in caught.value.allowed
