"""Vehicle files: units by hand, sources, standard deviations, consumption tables, and what a broken file says."""

from __future__ import annotations

import re
import tomllib
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from energy.errors import VehicleError
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import (
    AnyVehicle,
    VehicleFileError,
    load_published,
    load_vehicle,
    load_vehicles,
    vehicle_from_mapping,
)
from energy.vehicle.vehicle import Powertrain, Vehicle

ROOT = Path(__file__).resolve().parents[3]
BUNDLED = ROOT / "data" / "vehicles"
NOT_NUMBERS = {"id", "name", "powertrain", "sources", "sd", "effects", "residual_sd_frac", "charging"}
NUMBERS = [f.name for f in fields(Vehicle) if f.name not in NOT_NUMBERS]
SMALL = """
id = "small"
name = "Small car"
powertrain = "bev"
mass = { value_kg = 1000, source = "a" }
rotating_mass = { value_coef = 1.05, source = "b" }
road_load_a = { value_n = 100, source = "c" }
road_load_b = { value_n_per_kmh = 0.5, source = "d" }
road_load_c = { value_n_per_kmh2 = 0.03, source = "e" }
drive_efficiency = { value_eff = 0.9, source = "f" }
recuperation_efficiency = { value_eff = 0.6, source = "g" }
aux_power = { value_w = 300, source = "h" }
aux_efficiency_moving = { value_eff = 0.8, source = "i" }
aux_efficiency_idle = { value_eff = 0.7, source = "j" }
usable_capacity = { value_kwh = 20.5, source = "k" }
accel_speed = { value_kmh = [0, 36, 72], source = "l" }
acceleration = { value_mps2 = [1, 0.5], source = "assumed: m" }
deceleration = { value_mps2 = [-1.5, -1], source = "assumed: n" }
"""


TABLE = """
id = "table"
name = "Table car"
powertrain = "bev"
kind = "consumption-table"
consumption = { speed_kmh = [36, 72], value_kwh_per_100km = [10, 20], source = "a" }
ascent = { value_wh_per_m = 8, sd_wh_per_m = 0.5, source = "b" }
descent = { value_wh_per_m = 4, source = "c" }
aux_power = { value_w = 300, sd_w = 100, source = "d" }
usable_capacity = { value_kwh = 50, source = "e" }
"""
EFFECTS = """
cabin_ua = { value_w_per_k = 95, sd_w_per_k = 10, source = "u" }
cabin_target = { value_c = 20, sd_c = 1.5, source = "t" }
climate_limit = { value_kw = 5.5, sd_kw = 0.5, source = "l" }
regen_cold_full = { value_k = 280, source = "r" }
"""


def read(text: str) -> AnyVehicle:
    return vehicle_from_mapping(tomllib.loads(text))


def small(old: str = "", new: str = "") -> Vehicle:
    assert old in SMALL
    vehicle = read(SMALL.replace(old, new, 1))
    assert isinstance(vehicle, Vehicle)
    return vehicle


def table_car(old: str = "", new: str = "") -> ConsumptionTableVehicle:
    assert old in TABLE
    vehicle = read(TABLE.replace(old, new, 1))
    assert isinstance(vehicle, ConsumptionTableVehicle)
    return vehicle


def bundled(vehicle_id: str) -> Vehicle:
    vehicle = load_vehicle(BUNDLED / f"{vehicle_id}.toml")
    assert isinstance(vehicle, Vehicle)
    return vehicle


def test_mapping_is_converted_to_si() -> None:
    car = small()
    assert (car.id, car.name, car.powertrain) == ("small", "Small car", Powertrain.BEV)
    assert (car.mass_kg, car.rotating_mass_coef) == (1000.0, 1.05)
    assert car.road_load_a_n == 100.0
    assert car.road_load_b_n_per_mps == pytest.approx(1.8)  # 0.5 N/(km/h) · 3.6 (km/h)/(m/s)
    assert car.road_load_c_n_per_mps2 == pytest.approx(0.3888)  # 0.03 N/(km/h)² · 3.6²
    assert (car.drive_eff, car.recuperation_eff) == (0.9, 0.6)
    assert (car.aux_power_w, car.aux_move_eff, car.aux_idle_eff) == (300.0, 0.8, 0.7)
    assert car.usable_capacity_wh == 20_500.0
    np.testing.assert_allclose(car.accel_speed_mps, [0.0, 10.0, 20.0])
    np.testing.assert_array_equal(car.accel_mps2, [1.0, 0.5])
    np.testing.assert_array_equal(car.decel_mps2, [-1.5, -1.0])


def test_sources_are_kept_by_field_name() -> None:
    car = small()
    assert list(car.sources) == sorted(car.sources, key=lambda field: car.sources[field].removeprefix("assumed: "))
    assert car.sources["mass_kg"] == "a"
    assert car.sources["road_load_c_n_per_mps2"] == "e"
    assert car.sources["decel_mps2"] == "assumed: n"
    assert set(car.sources) == set(NUMBERS)


def test_standard_deviations_are_kept_in_si_by_field_name() -> None:
    car = small('value_kg = 1000, source = "a"', 'value_kg = 1000, sd_kg = 75, source = "a"')
    assert dict(car.sd) == {"mass_kg": 75.0}
    car = small("value_n_per_kmh2 = 0.03", "value_n_per_kmh2 = 0.03, sd_n_per_kmh2 = 0.001")
    assert dict(car.sd) == {"road_load_c_n_per_mps2": pytest.approx(0.01296)}  # 0.001 N/(km/h)² · 3.6²
    assert dict(small("value_w = 300", "value_w = 300, sd_w = 0").sd) == {"aux_power_w": 0.0}
    assert dict(small().sd) == {}


def test_effect_sections_fill_the_vehicles_coefficients() -> None:
    car = read(SMALL + EFFECTS)
    assert isinstance(car, Vehicle)
    assert car.effects == EffectCoefficients(
        cabin_ua_w_per_k=95.0, cabin_target_k=293.15, climate_limit_w=5500.0, regen_cold_full_k=280.0
    )
    assert {field: source for field, source in car.sources.items() if field.startswith("effects.")} == {
        "effects.cabin_ua_w_per_k": "u",
        "effects.cabin_target_k": "t",
        "effects.climate_limit_w": "l",
        "effects.regen_cold_full_k": "r",
    }
    # a standard deviation in °C is one in K: no offset
    assert dict(car.sd) == {
        "effects.cabin_ua_w_per_k": 10.0,
        "effects.cabin_target_k": 1.5,
        "effects.climate_limit_w": 500.0,
    }


def test_file_without_effect_sections_has_the_default_coefficients() -> None:
    assert small().effects == EffectCoefficients()


def test_published_figures_change_nothing_of_the_vehicle() -> None:
    car = read(SMALL + 'published = { epa_udds_kwh_per_100km = 12.5, epa_range_km = 400, source = "p" }')
    assert isinstance(car, Vehicle)
    assert dict(car.sources) == dict(small().sources)
    assert car.mass_kg == small().mass_kg


def test_published_figures_are_read_from_the_file(tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_text(SMALL, encoding="utf-8")
    assert load_published(path) is None
    path.write_text(SMALL + 'published = { epa_udds_kwh_per_100km = 12.5, source = "p" }', encoding="utf-8")
    published = load_published(path)
    assert published is not None
    assert (published.epa_udds_kwh_per_100km, published.epa_hwfet_kwh_per_100km) == (12.5, None)
    assert published.source == "p"


def test_consumption_table_is_converted_to_si() -> None:
    car = table_car()
    np.testing.assert_allclose(car.speed_mps, [10.0, 20.0])
    np.testing.assert_allclose(car.consumption_j_per_m, [360.0, 720.0])  # 10 kWh/100 km = 36 MJ over 100 km
    assert (car.ascent_j_per_m, car.descent_j_per_m) == (28_800.0, 14_400.0)
    assert (car.aux_power_w, car.usable_capacity_wh) == (300.0, 50_000.0)
    assert (car.kinetic_up_kg, car.kinetic_down_kg) == (0.0, 0.0)
    assert car.powertrain is Powertrain.BEV
    assert dict(car.sd) == {"ascent_j_per_m": 1800.0, "aux_power_w": 100.0}
    assert car.sources["speed_mps"] == car.sources["consumption_j_per_m"] == "a"
    assert car.sources["descent_j_per_m"] == "c"


@pytest.mark.parametrize(
    ("written", "factor"), [("value_wh_per_km = [100, 200]", 3.6), ("value_wh_per_m = [100, 200]", 3600.0)]
)
def test_consumption_table_takes_other_units(written: str, factor: float) -> None:
    scale = 0.001 if factor > 10.0 else 1.0
    written = written.replace("100, 200", f"{100 * scale}, {200 * scale}")
    car = table_car("value_kwh_per_100km = [10, 20]", written)
    np.testing.assert_allclose(car.consumption_j_per_m, [100 * scale * factor, 200 * scale * factor])


def test_kinetic_section_gives_mass_over_and_times_its_efficiencies() -> None:
    kinetic = 'kinetic = { mass_kg = 1600, acceleration_eff = 0.8, deceleration_eff = 0.5, source = "k" }'
    car = read(TABLE + kinetic)
    assert isinstance(car, ConsumptionTableVehicle)
    assert (car.kinetic_up_kg, car.kinetic_down_kg) == (2000.0, 800.0)
    assert car.sources["kinetic_up_kg"] == car.sources["kinetic_down_kg"] == "k"


@pytest.mark.parametrize(
    ("old", "new", "field", "value", "allowed"),
    [
        ('"consumption-table"', '"graph"', "kind", "'graph'", "one of road-load, consumption-table"),
        ("speed_kmh = [36, 72], ", "", "consumption.speed_kmh", "missing", "a list of numbers"),
        ("[36, 72]", '[36, "x"]', "consumption.speed_kmh[1]", "'x'", "a number"),
        ("[36, 72]", "[72, 36]", "speed_mps", "[20.0, 10.0]", "rising"),
        ("[10, 20]", "[10]", "speed_mps", "2 and 1 values", "as many speeds as values"),
        ("[10, 20]", "[10, 2000]", "consumption_j_per_m", "[360.0, 72000.0]", "each 0..36000"),
        ("[10, 20], source", "[10, 20], sd_kwh_per_100km = 1, source", "consumption.sd", "1.0", "none for a list"),
        ("value_wh_per_m = 4", "value_wh_per_m = 9", "descent_j_per_m", "32400.0", "0..28800"),
        ("value_wh_per_m = 4", "value_j_per_m = 9", "descent.value_j_per_m", "unknown", "value_wh_per_m, and source"),
        (
            'source = "e" }',
            'source = "e" }\nmass = { value_kg = 1, source = "m" }',
            "mass",
            "unknown",
            "consumption, ascent",
        ),
        (
            'source = "e" }',
            'source = "e" }\nkinetic = { mass_kg = 1, acceleration_eff = 2, deceleration_eff = 1, source = "k" }',
            "kinetic.acceleration_eff",
            "2.0",
            "(0, 1]",
        ),
        (
            'source = "e" }',
            'source = "e" }\nkinetic = { mass_kg = 1, acceleration_eff = 1, source = "k" }',
            "kinetic.deceleration_eff",
            "missing",
            "a number",
        ),
        (
            'source = "e" }',
            'source = "e" }\nkinetic = { mass = 1 }',
            "kinetic.mass",
            "unknown",
            "mass_kg, acceleration_eff, deceleration_eff, and source",
        ),
    ],
)
def test_broken_consumption_table_names_file_field_value_and_range(
    tmp_path: Path, old: str, new: str, field: str, value: str, allowed: str
) -> None:
    assert old in TABLE
    path = tmp_path / "table.toml"
    path.write_text(TABLE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(VehicleFileError) as caught:
        load_vehicle(path)
    error = caught.value
    assert (error.path, error.field, str(error.value)) == (str(path), field, value)
    assert allowed in error.allowed


@pytest.mark.parametrize(
    ("section", "field", "value", "allowed"),
    [
        (
            'cabin_ua = { value_w_per_k = -1, source = "u" }',
            "effects.cabin_ua_w_per_k",
            "-1.0",
            "0..5000",
        ),
        (
            'cabin_target = { value_c = 90, source = "u" }',
            "effects.cabin_target_k",
            "363.15",
            "273.15..313.15",
        ),
        (
            'regen_cold_none = { value_c = 15, source = "u" }',
            "effects.regen_cold_none_k",
            "288.15",
            "below regen_cold_full_k, 283.15",
        ),
        ('heating_cop = { value_w = 2, source = "u" }', "heating_cop.value_w", "unknown", "value_coef, and source"),
        ('wet_rolling = { value_coef = 2, source = "u" }', "wet_rolling", "unknown", "one of id, name"),
        ('published = { epa_udds = 2, source = "u" }', "published.epa_udds", "unknown", "epa_udds_kwh_per_100km"),
        ('published = { source = "u" }', "published", "without a figure", "at least one of"),
        ("published = { epa_range_km = 400 }", "published.source", "None", "a text that is not empty"),
        (
            'published = { epa_udds_kwh_per_100km = -1, source = "u" }',
            "published.epa_udds_kwh_per_100km",
            "-1.0",
            "(0, 1000]",
        ),
        ('published = { epa_range_km = "far", source = "u" }', "published.epa_range_km", "'far'", "a number"),
        ("published = 4", "published", "4", "a section with"),
    ],
)
def test_broken_optional_section_names_file_field_value_and_range(
    tmp_path: Path, section: str, field: str, value: str, allowed: str
) -> None:
    path = tmp_path / "small.toml"
    path.write_text(SMALL + section, encoding="utf-8")
    with pytest.raises(VehicleFileError) as caught:
        load_vehicle(path)
    error = caught.value
    assert (error.path, error.field, str(error.value)) == (str(path), field, value)
    assert allowed in error.allowed
    if section.startswith("published"):
        with pytest.raises(VehicleFileError, match=re.escape(field)):
            load_published(path)


def test_loaded_tables_are_read_only() -> None:
    with pytest.raises(ValueError, match="read-only"):
        small().accel_mps2[0] = 9.0


def test_epa_units_are_converted_with_the_exact_factors() -> None:
    # The Kona in EPA's units: A = 24.859 lbf · 4.4482216152605 N/lbf, B and C over 0.44704 m/s a mph.
    kona = bundled("hyundai-kona-64")
    assert kona.road_load_a_n == pytest.approx(110.57834113376, rel=1e-13)
    assert kona.road_load_b_n_per_mps == pytest.approx(-1.99365981306727, rel=1e-13)
    assert kona.road_load_c_n_per_mps2 == pytest.approx(0.526544352166809, rel=1e-13)


def test_epa_entry_equals_the_same_road_load_in_the_sources_units() -> None:
    # 1 lbf = 4.4482216152605 N, 1 mph = 1.609344 km/h
    epa = read(
        SMALL.replace("value_n = 100", "value_lbf = 22.5")
        .replace("value_n_per_kmh = 0.5", "value_lbf_per_mph = 0.2")
        .replace("value_n_per_kmh2 = 0.03", "value_lbf_per_mph2 = 0.018")
    )
    printed = read(
        SMALL.replace("value_n = 100", f"value_n = {22.5 * 4.4482216152605!r}")
        .replace("value_n_per_kmh = 0.5", f"value_n_per_kmh = {0.2 * 4.4482216152605 / 1.609344!r}")
        .replace("value_n_per_kmh2 = 0.03", f"value_n_per_kmh2 = {0.018 * 4.4482216152605 / 1.609344**2!r}")
    )
    assert isinstance(epa, Vehicle)
    assert isinstance(printed, Vehicle)
    assert epa.road_load_a_n == pytest.approx(printed.road_load_a_n, rel=1e-14)
    assert epa.road_load_b_n_per_mps == pytest.approx(printed.road_load_b_n_per_mps, rel=1e-14)
    assert epa.road_load_c_n_per_mps2 == pytest.approx(printed.road_load_c_n_per_mps2, rel=1e-14)


def test_si_road_load_is_taken_as_it_is() -> None:
    assert small("value_n_per_kmh = 0.5", "value_n_per_mps = 0.5").road_load_b_n_per_mps == 0.5
    assert small("value_n_per_kmh2 = 0.03", "value_n_per_mps2 = 0.41412").road_load_c_n_per_mps2 == 0.41412


def test_mass_in_pounds_is_converted_exactly() -> None:
    assert small("value_kg = 1000", "value_lb = 4000").mass_kg == pytest.approx(1814.36948, rel=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "field", "value", "allowed"),
    [
        ('id = "small"', "", "id", "missing", "a text"),
        ('id = "small"', "id = 3", "id", "3", "a text that is not empty"),
        ('id = "small"', 'id = "Small Car"', "id", "'Small Car'", "lower-case letters and digits"),
        ('id = "small"', 'id = "../x"', "id", "'../x'", "lower-case letters and digits"),
        ('name = "Small car"', 'name = " "', "name", "' '", "a text that is not empty"),
        ('"bev"', '"steam"', "powertrain", "'steam'", "one of bev, ice"),
        ('id = "small"', 'id = "small"\nwheels = 4', "wheels", "unknown", "one of id, name, powertrain, kind, mass, "),
        ('mass = { value_kg = 1000, source = "a" }', "", "mass", "missing", "value_kg or value_lb, and source"),
        ('mass = { value_kg = 1000, source = "a" }', "mass = 1000", "mass", "1000", "value_kg or value_lb, and source"),
        ("value_kg = 1000", "value_t = 1", "mass.value_t", "unknown", "value_kg or value_lb, and source"),
        ("value_kg = 1000, ", "", "mass.value", "missing", "exactly one of value_kg or value_lb"),
        (
            "value_kg = 1000",
            "value_kg = 1000, value_lb = 2200",
            "mass.value",
            "value_kg and value_lb",
            "exactly one of value_kg or value_lb",
        ),
        ('value_kg = 1000, source = "a"', "value_kg = 1000", "mass.source", "missing", "a text"),
        ('source = "a"', 'source = ""', "mass.source", "''", "a text that is not empty"),
        ("value_kg = 1000", 'value_kg = "1000"', "mass.value_kg", "'1000'", "a number"),
        ("value_kg = 1000", "value_kg = true", "mass.value_kg", "True", "a number"),
        ("value_kg = 1000", "value_kg = 1000, sd_kg = -1", "mass.sd_kg", "-1.0", "a finite number, at least 0"),
        ("value_kg = 1000", "value_kg = 1000, sd_kg = inf", "mass.sd_kg", "inf", "a finite number, at least 0"),
        ("value_kg = 1000", "value_kg = 1000, sd_kg = 'x'", "mass.sd_kg", "'x'", "a number"),
        ("value_kg = 1000", "value_kg = 1000, sd_lb = 1", "mass.sd_lb", "unknown", "sd_kg, in the value's unit"),
        ("[1, 0.5]", "[1, 0.5], sd_mps2 = 1", "acceleration.sd", "1.0", "none for a list"),
        ("[0, 36, 72]", "36", "accel_speed.value_kmh", "36", "a list of numbers"),
        ("[1, 0.5]", '[1, "x"]', "acceleration.value_mps2[1]", "'x'", "a number"),
        ("value_kg = 1000", "value_kg = 0", "mass_kg", "0.0", "(0, 100000]"),
        ("value_kg = 1000", "value_kg = nan", "mass_kg", "nan", "(0, 100000]"),
        ("[-1.5, -1]", "[1.5, 1]", "decel_mps2", "[1.5, 1.0]", "each -15..-0.01"),
        ("value_n = 100", "value_n = -5", "road_load", "-5.0 N at 0.0 km/h", "at least 0 N everywhere in 0..200 km/h"),
    ],
)
def test_broken_file_names_file_field_value_and_range(
    tmp_path: Path, old: str, new: str, field: str, value: str, allowed: str
) -> None:
    assert old in SMALL
    path = tmp_path / "small.toml"
    path.write_text(SMALL.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(VehicleFileError) as caught:
        load_vehicle(path)
    error = caught.value
    assert (error.path, error.field, str(error.value)) == (str(path), field, value)
    assert allowed in error.allowed
    assert str(error).startswith(f"{path}: {field} ")
    assert f"is {value}, allowed: " in str(error)
    assert isinstance(error, VehicleError)


@pytest.mark.parametrize(
    ("content", "value"),
    [
        (b"mass = [", "not TOML"),
        (b"id = 'a'\nid = 'b'", "not TOML"),
        (b"name = '\xff'", "not UTF-8 at byte 8"),
        (b"", "missing"),
    ],
)
def test_file_that_is_no_vehicle_file_says_so(tmp_path: Path, content: bytes, value: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(VehicleFileError, match=re.escape(value)) as caught:
        load_vehicle(path)
    assert str(path) in str(caught.value)


def test_absent_file_says_so(tmp_path: Path) -> None:
    with pytest.raises(VehicleFileError, match="No such file"):
        load_vehicle(tmp_path / "none.toml")


def test_file_under_another_name_than_its_id_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "large.toml"
    path.write_text(SMALL, encoding="utf-8")
    with pytest.raises(VehicleFileError, match="id is 'small', allowed: the file's own name, 'large'"):
        load_vehicle(path)


def test_folder_gives_its_vehicles_in_the_order_of_their_ids(tmp_path: Path) -> None:
    for vehicle_id in ("b", "a", "c-1"):
        (tmp_path / f"{vehicle_id}.toml").write_text(SMALL.replace('"small"', f'"{vehicle_id}"'), encoding="utf-8")
    (tmp_path / "notes.txt").write_text("not a vehicle", encoding="utf-8")
    assert list(load_vehicles(tmp_path)) == ["a", "b", "c-1"]


@pytest.mark.parametrize(("folder", "value"), [("absent", "missing"), (".", "without a *.toml file")])
def test_folder_without_vehicles_is_refused(tmp_path: Path, folder: str, value: str) -> None:
    with pytest.raises(VehicleFileError, match=re.escape(value)):
        load_vehicles(tmp_path / folder)
