"""The vehicles of data/vehicles: sources, standard deviations, and the pages and files that scripts write."""

from __future__ import annotations

import importlib.util
import re
from dataclasses import fields
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from energy.charging.charging import Charging
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import load_published, load_vehicle, load_vehicles
from energy.vehicle.self_check import LISTED_BAND, self_check
from energy.vehicle.vehicle import Powertrain, Vehicle

ROOT = Path(__file__).resolve().parents[3]
BUNDLED = ROOT / "data" / "vehicles"
BUNDLED_IDS = sorted(path.stem for path in BUNDLED.glob("*.toml"))
BY_HAND = [
    "bmw-i3-60ah",
    "chevrolet-bolt",
    "hyundai-kona-64",
    "nissan-leaf",
    "tesla-model-3",
    "toyota-corolla-petrol",
    "vw-id4",
]
TABLE_IDS = ["example-here-table", "example-tomtom-table"]
NOT_NUMBERS = {"id", "name", "powertrain", "sources", "sd", "effects", "residual_sd_frac", "charging"}
NUMBERS = [f.name for f in fields(Vehicle) if f.name not in NOT_NUMBERS]
TABLE_NUMBERS = {f.name for f in fields(ConsumptionTableVehicle) if f.name not in NOT_NUMBERS}
VEHICLES = load_vehicles(BUNDLED)
CARS = {vehicle_id: vehicle for vehicle_id, vehicle in VEHICLES.items() if isinstance(vehicle, Vehicle)}


def bundled(vehicle_id: str) -> Vehicle:
    vehicle = load_vehicle(BUNDLED / f"{vehicle_id}.toml")
    assert isinstance(vehicle, Vehicle)
    return vehicle


def docs_module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_bundled_vehicles_hold_those_by_hand_the_examples_and_at_least_250_electric_cars() -> None:
    assert list(VEHICLES) == BUNDLED_IDS
    assert set(BY_HAND + TABLE_IDS) <= set(VEHICLES)
    assert [i for i, v in VEHICLES.items() if isinstance(v, ConsumptionTableVehicle)] == TABLE_IDS
    electric = [v for v in CARS.values() if v.powertrain is Powertrain.BEV]
    assert len(electric) >= 250
    assert len({v.name for v in VEHICLES.values()}) == len(VEHICLES)


def test_each_bundled_vehicle_has_a_source_for_each_number() -> None:
    for vehicle_id, vehicle in CARS.items():
        own = {field for field in vehicle.sources if not field.startswith("effects.")}
        assert own == set(NUMBERS), vehicle_id
        for field in set(vehicle.sources) - own:
            assert hasattr(vehicle.effects, field.removeprefix("effects.")), vehicle_id
        assert all(len(source) > 10 for source in vehicle.sources.values()), vehicle_id
        assert vehicle.sources["accel_mps2"].startswith("assumed: "), vehicle_id
        assert vehicle.sources["decel_mps2"].startswith("assumed: "), vehicle_id


def test_each_electric_car_charges_and_has_a_source_for_each_number_of_it() -> None:
    for vehicle_id, vehicle in CARS.items():
        charging = vehicle.charging
        assert (charging is not None) == (vehicle.powertrain is Powertrain.BEV), vehicle_id
        if charging is None:
            continue
        named = {"connectors", "ac_eff", "dc_eff", "ac_power_w", "ac_phases"}
        named |= {"dc"} if charging.dc is not None else set()
        assert named <= set(charging.sources) <= {f.name for f in fields(Charging)}, vehicle_id
        assert all(len(source) > 10 for source in charging.sources.values()), vehicle_id
        assert 3000.0 <= charging.ac_power_w <= 43_000.0, vehicle_id
        assert charging.dc is None or 20_000.0 <= charging.dc.power_w.max() <= 400_000.0, vehicle_id


def test_each_curve_of_a_whole_series_of_cars_is_called_assumed() -> None:
    rows = docs_module("vehicle_files").charging_rows()
    for vehicle_id, row in rows.items():
        charging = CARS[vehicle_id].charging
        assert charging is not None
        source = charging.sources.get("dc", "")
        assert source.startswith("assumed: ") == (row["curve_kind"] in ("sister", "assumed")), vehicle_id


def test_each_bundled_vehicle_gives_a_reason_for_each_standard_deviation() -> None:
    for vehicle_id, vehicle in CARS.items():
        uncertain = {"mass_kg", "road_load_a_n", "road_load_c_n_per_mps2"}
        if vehicle.powertrain is Powertrain.BEV:
            uncertain |= {"drive_eff", "recuperation_eff", "aux_power_w", "usable_capacity_wh"}
        assert set(vehicle.sd) == uncertain, vehicle_id
        for field, sd in vehicle.sd.items():
            assert 0.0 < sd < abs(getattr(vehicle, field)), (vehicle_id, field)
            assert re.search(r"sd (assumed|measured): ", vehicle.sources[field]), (vehicle_id, field)


def test_cars_that_epa_has_not_tested_have_a_road_load_that_is_called_estimated_and_has_a_wide_deviation() -> None:
    for row in docs_module("vehicle_files").more_rows():
        car = CARS[row["id"]]
        for field in ("road_load_a_n", "road_load_b_n_per_mps", "road_load_c_n_per_mps2"):
            assert car.sources[field].startswith("estimated: "), row["id"]
        # EPA's have 5 and 4 %
        assert car.sd["road_load_a_n"] > 0.1 * car.road_load_a_n, row["id"]
        assert car.sd["road_load_c_n_per_mps2"] > 0.07 * car.road_load_c_n_per_mps2, row["id"]
        assert bool(row["sister"]) == (f"of the sister {row['sister']} " in car.sources["road_load_a_n"]), row["id"]


def test_listed_consumption_of_cars_that_epa_has_not_tested_is_met() -> None:
    held = 0
    for row in docs_module("vehicle_files").more_rows():
        published = load_published(BUNDLED / f"{row['id']}.toml")
        if published is not None:
            (check,) = self_check(CARS[row["id"]], published).checks
            assert (check.cycle, check.band) == ("mixed", LISTED_BAND)
            assert check.met, (row["id"], check.ratio)
            held += 1
    assert held > 300


def test_each_electric_car_has_a_battery_a_mass_and_a_range_that_cars_have() -> None:
    at_90_kmh = docs_module("vehicle_table").steady_kwh_per_100km
    for vehicle_id, car in CARS.items():
        if car.powertrain is Powertrain.BEV:
            capacity_kwh = car.usable_capacity_wh / 1000.0
            assert 14.0 <= capacity_kwh <= 215.0, vehicle_id
            assert 900.0 <= car.mass_kg <= 4300.0, vehicle_id
            assert 9.0 <= at_90_kmh(car, 90.0) <= 35.0, vehicle_id
            assert 90.0 <= 100.0 * capacity_kwh / at_90_kmh(car, 90.0) <= 1000.0, vehicle_id


def test_each_curve_falls_when_the_battery_fills_and_charges_within_an_hour_and_a_half() -> None:
    for vehicle_id, car in CARS.items():
        if car.charging is None or car.charging.dc is None:
            continue
        soc, power_w = car.charging.dc.soc_frac, car.charging.dc.power_w
        most_w = float(power_w.max())
        assert most_w <= 4.6 * car.usable_capacity_wh, vehicle_id
        assert power_w[-1] <= 0.55 * most_w, vehicle_id
        assert np.all(np.diff(power_w[soc >= 0.5]) <= 0.2 * most_w), vehicle_id
        charged = np.linspace(0.1, 0.8, 701)
        minutes = 60.0 * car.usable_capacity_wh * np.trapezoid(1.0 / np.interp(charged, soc, power_w), charged)
        assert 9.0 <= minutes <= 80.0, vehicle_id


def test_plugs_go_together_as_markets_have_them() -> None:
    for vehicle_id, car in CARS.items():
        plugs = set() if car.charging is None else {plug.value for plug in car.charging.connectors}
        assert "ccs2" not in plugs or plugs & {"type2"}, vehicle_id
        assert "ccs1" not in plugs or plugs & {"type1"}, vehicle_id


@pytest.mark.parametrize("vehicle_id", TABLE_IDS)
def test_bundled_consumption_table_has_a_source_for_each_number(vehicle_id: str) -> None:
    vehicle = load_vehicle(BUNDLED / f"{vehicle_id}.toml")
    absent = set() if vehicle_id == "example-tomtom-table" else {"kinetic_up_kg", "kinetic_down_kg"}
    assert set(vehicle.sources) == TABLE_NUMBERS - absent


def test_bundled_acceleration_never_rises_with_speed() -> None:
    for vehicle_id, vehicle in CARS.items():
        np.testing.assert_allclose(vehicle.accel_speed_mps * 3.6, np.arange(0.0, 131.0, 10.0), err_msg=vehicle_id)
        assert np.all(np.diff(vehicle.accel_mps2) <= 0.0), vehicle_id
        assert np.all(np.diff(vehicle.decel_mps2) >= 0.0), vehicle_id


def test_joined_files_are_those_that_the_script_writes() -> None:
    script = docs_module("vehicle_files")
    written = {row["id"]: script.vehicle_file(row) for row in script.joined_rows()}
    written |= {row["id"]: script.more_vehicle_file(row) for row in script.more_rows()}
    for vehicle_id in script.BY_HAND:
        text = (BUNDLED / f"{vehicle_id}.toml").read_text(encoding="utf-8")
        written[vehicle_id] = script.with_charging(text, script.charging_rows()[vehicle_id])
    for vehicle_id, text in written.items():
        assert (BUNDLED / f"{vehicle_id}.toml").read_text(encoding="utf-8") == text, (
            "run `python docs/vehicle_files.py`"
        )
    assert sorted([*written, "hyundai-kona-64", "toyota-corolla-petrol", *TABLE_IDS]) == BUNDLED_IDS


def test_listed_consumption_is_converted_from_either_unit() -> None:
    script = docs_module("vehicle_files")
    # 33.7 kWh a gallon over 100 mi/gal = 33.7 kWh a 100 miles = 20.94 kWh/100 km
    assert script.kwh_per_100km("100", "mpge") == pytest.approx(20.9402, abs=1e-4)
    assert script.kwh_per_100km("33+34.4", "kwh_per_100mi") == pytest.approx(20.9402, abs=1e-4)


def test_kona_has_the_sources_parameters() -> None:
    kona = bundled("hyundai-kona-64")
    assert (kona.mass_kg, kona.rotating_mass_coef) == (1810.0, 1.1)
    assert (kona.drive_eff, kona.recuperation_eff) == (0.92, 0.63)
    assert (kona.aux_power_w, kona.aux_move_eff, kona.aux_idle_eff) == (520.0, 0.9, 0.9)
    assert kona.usable_capacity_wh == 64_000.0
    assert kona.accel_mps2.size == 13


def test_petrol_car_recuperates_nothing() -> None:
    petrol = bundled("toyota-corolla-petrol")
    assert petrol.powertrain is Powertrain.ICE
    assert petrol.recuperation_eff == 0.0


def test_tables_of_the_docs_are_those_of_the_files() -> None:
    page = (ROOT / "docs" / "vehicles.md").read_text(encoding="utf-8")
    assert page == docs_module("vehicle_table").with_tables(page), "run `python docs/vehicle_table.py`"
