"""The vehicles of data/vehicles: sources, standard deviations, and the pages and files that scripts write."""

from __future__ import annotations

import importlib.util
from dataclasses import fields
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from energy.charging.charging import Charging
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import load_vehicle, load_vehicles
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


def test_bundled_vehicles_hold_those_by_hand_the_examples_and_at_least_forty_electric_cars() -> None:
    vehicles = load_vehicles(BUNDLED)
    assert list(vehicles) == BUNDLED_IDS
    assert set(BY_HAND + TABLE_IDS) <= set(vehicles)
    assert [i for i, v in vehicles.items() if isinstance(v, ConsumptionTableVehicle)] == TABLE_IDS
    electric = [v for v in vehicles.values() if isinstance(v, Vehicle) and v.powertrain is Powertrain.BEV]
    assert len(electric) >= 40
    assert len({v.name for v in vehicles.values()}) == len(vehicles)


@pytest.mark.parametrize("vehicle_id", [i for i in BUNDLED_IDS if i not in TABLE_IDS])
def test_bundled_vehicle_has_a_source_for_each_number(vehicle_id: str) -> None:
    vehicle = bundled(vehicle_id)
    own = {field for field in vehicle.sources if not field.startswith("effects.")}
    assert own == set(NUMBERS)
    for field in set(vehicle.sources) - own:
        assert hasattr(vehicle.effects, field.removeprefix("effects."))
    assert all(len(source) > 10 for source in vehicle.sources.values())
    assert vehicle.sources["accel_mps2"].startswith("assumed: ")
    assert vehicle.sources["decel_mps2"].startswith("assumed: ")


@pytest.mark.parametrize("vehicle_id", [i for i, v in load_vehicles(BUNDLED).items() if v.charging is not None])
def test_bundled_vehicle_that_charges_has_a_source_for_each_number(vehicle_id: str) -> None:
    charging = load_vehicle(BUNDLED / f"{vehicle_id}.toml").charging
    assert charging is not None
    named = {"connectors", "ac_eff", "dc_eff"} | ({"dc"} if charging.dc is not None else set())
    named |= {"ac_power_w", "ac_phases"} if charging.ac_power_w > 0.0 else set()
    assert named <= set(charging.sources)
    assert set(charging.sources) <= {f.name for f in fields(Charging)}
    assert all(len(source) > 10 for source in charging.sources.values())


@pytest.mark.parametrize("vehicle_id", [i for i in BUNDLED_IDS if i not in TABLE_IDS])
def test_bundled_vehicle_gives_a_reason_for_each_standard_deviation(vehicle_id: str) -> None:
    vehicle = bundled(vehicle_id)
    uncertain = {"mass_kg", "road_load_a_n", "road_load_c_n_per_mps2"}
    if vehicle.powertrain is Powertrain.BEV:
        uncertain |= {"drive_eff", "recuperation_eff", "aux_power_w", "usable_capacity_wh"}
    assert set(vehicle.sd) == uncertain
    for field, sd in vehicle.sd.items():
        assert 0.0 < sd < abs(getattr(vehicle, field))
        assert "sd assumed: " in vehicle.sources[field]


@pytest.mark.parametrize("vehicle_id", TABLE_IDS)
def test_bundled_consumption_table_has_a_source_for_each_number(vehicle_id: str) -> None:
    vehicle = load_vehicle(BUNDLED / f"{vehicle_id}.toml")
    absent = set() if vehicle_id == "example-tomtom-table" else {"kinetic_up_kg", "kinetic_down_kg"}
    assert set(vehicle.sources) == TABLE_NUMBERS - absent


@pytest.mark.parametrize("vehicle_id", [i for i in BUNDLED_IDS if i not in TABLE_IDS])
def test_bundled_acceleration_never_rises_with_speed(vehicle_id: str) -> None:
    vehicle = bundled(vehicle_id)
    np.testing.assert_allclose(vehicle.accel_speed_mps * 3.6, np.arange(0.0, 131.0, 10.0))
    assert np.all(np.diff(vehicle.accel_mps2) <= 0.0)
    assert np.all(np.diff(vehicle.decel_mps2) >= 0.0)


def test_joined_files_are_those_that_the_script_writes() -> None:
    script = docs_module("vehicle_files")
    rows = script.joined_rows()
    for row in rows:
        text = (BUNDLED / f"{row['id']}.toml").read_text(encoding="utf-8")
        assert text == script.vehicle_file(row), "run `python docs/vehicle_files.py`"
    assert sorted([row["id"] for row in rows] + BY_HAND + TABLE_IDS) == BUNDLED_IDS


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
