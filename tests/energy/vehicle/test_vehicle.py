"""Vehicle: what is refused, and that the refusal names field, value and range."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from energy.errors import EnergyError, VehicleError
from energy.vehicle.vehicle import Powertrain, Vehicle


def vehicle(**changes: object) -> Vehicle:
    """A plain valid vehicle with some fields changed."""
    plain = Vehicle(
        id="plain",
        name="Plain",
        mass_kg=1500.0,
        road_load_a_n=100.0,
        road_load_b_n_per_mps=0.0,
        road_load_c_n_per_mps2=0.4,
        drive_eff=0.9,
        recuperation_eff=0.6,
        aux_power_w=300.0,
        usable_capacity_wh=50_000.0,
        accel_speed_mps=np.array([0.0, 10.0, 20.0, 40.0]),
        accel_mps2=np.array([1.2, 1.0, 0.5]),
        decel_mps2=np.array([-1.2, -1.1, -0.9]),
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


def refusal(**changes: object) -> VehicleError:
    with pytest.raises(VehicleError) as caught:
        vehicle(**changes)
    return caught.value


def test_plain_vehicle_takes_the_sources_defaults() -> None:
    plain = vehicle()
    assert plain.powertrain is Powertrain.BEV
    assert plain.rotating_mass_coef == 1.1
    assert plain.aux_move_eff == plain.aux_idle_eff == 0.9
    assert dict(plain.sources) == {}


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("mass_kg", 0.0, "(0, 100000]"),
        ("mass_kg", -1.0, "(0, 100000]"),
        ("mass_kg", 100_001.0, "(0, 100000]"),
        ("mass_kg", math.inf, "(0, 100000]"),
        ("rotating_mass_coef", 0.999, "[1, 2]"),
        ("rotating_mass_coef", 2.001, "[1, 2]"),
        ("drive_eff", 0.0, "(0, 1]"),
        ("drive_eff", 1.001, "(0, 1]"),
        ("recuperation_eff", -0.001, "[0, 1]"),
        ("recuperation_eff", 1.001, "[0, 1]"),
        ("aux_power_w", -1.0, "[0, 100000]"),
        ("aux_power_w", 100_001.0, "[0, 100000]"),
        ("aux_move_eff", 0.0, "(0, 1]"),
        ("aux_move_eff", 1.001, "(0, 1]"),
        ("aux_idle_eff", 0.0, "(0, 1]"),
        ("aux_idle_eff", 1.001, "(0, 1]"),
        ("usable_capacity_wh", 0.0, "(0, 1e+07]"),
        ("usable_capacity_wh", 1.1e7, "(0, 1e+07]"),
    ],
)
def test_number_out_of_range_is_refused_with_field_value_and_range(field: str, value: float, allowed: str) -> None:
    error = refusal(**{field: value})
    assert (error.field, error.value, error.allowed, error.vehicle_id) == (field, value, allowed, "plain")
    assert str(error) == f"{field} of vehicle 'plain' is {value}, allowed: {allowed}"
    assert isinstance(error, EnergyError)


@pytest.mark.parametrize("field", [f.name for f in fields(Vehicle) if f.type == "float"])
def test_nan_is_refused_in_every_number(field: str) -> None:
    assert refusal(**{field: math.nan}).field == field


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("mass_kg", 100_000.0),
        ("rotating_mass_coef", 1.0),
        ("rotating_mass_coef", 2.0),
        ("drive_eff", 1.0),
        ("recuperation_eff", 0.0),
        ("recuperation_eff", 1.0),
        ("aux_power_w", 0.0),
        ("aux_move_eff", 1.0),
        ("aux_idle_eff", 1.0),
        ("usable_capacity_wh", 1e7),
    ],
)
def test_number_at_a_closed_bound_is_taken(field: str, value: float) -> None:
    assert getattr(vehicle(**{field: value}), field) == value


def test_efficiencies_at_one_make_a_lossless_round_trip_and_are_taken() -> None:
    lossless = vehicle(drive_eff=1.0, recuperation_eff=1.0)
    assert lossless.drive_eff * lossless.recuperation_eff == 1.0


@pytest.mark.parametrize(("drive_eff", "recuperation_eff"), [(1.05, 0.96), (0.9, 1.2)])
def test_round_trip_that_gains_energy_is_refused(drive_eff: float, recuperation_eff: float) -> None:
    assert drive_eff * recuperation_eff > 1.0
    # A product above 1 needs one factor above 1, which is refused by its own name already.
    assert refusal(drive_eff=drive_eff, recuperation_eff=recuperation_eff).field == "drive_eff*recuperation_eff"


@pytest.mark.parametrize("field", ["road_load_a_n", "road_load_b_n_per_mps", "road_load_c_n_per_mps2"])
@pytest.mark.parametrize("value", [math.inf, -math.inf, 1.1e6])
def test_road_load_coefficient_that_is_not_finite_or_huge_is_refused(field: str, value: float) -> None:
    error = refusal(**{field: value})
    assert (error.field, error.value) == (field, value)


def test_road_load_negative_at_standstill_is_refused() -> None:
    error = refusal(road_load_a_n=-1.0)
    assert error.field == "road_load"
    assert error.value == "-1.0 N at 0.0 km/h"
    assert error.allowed == "at least 0 N everywhere in 0..200 km/h"


def test_road_load_negative_at_200_kmh_is_refused() -> None:
    # 100 N - 2 N/(m/s) · 55.56 m/s = -11.1 N, while it is positive up to 50 m/s = 180 km/h
    error = refusal(road_load_b_n_per_mps=-2.0, road_load_c_n_per_mps2=0.0)
    assert error.value == "-11.1 N at 200.0 km/h"


def test_road_load_negative_between_positive_ends_is_refused() -> None:
    # F = 10 - 2v + 0.05 v²: minimum at v = 2/(2·0.05) = 20 m/s = 72 km/h, 10 - 40 + 20 = -10 N;
    # 10 N at rest and 10 - 111.1 + 154.3 = 53.2 N at 200 km/h.
    error = refusal(road_load_a_n=10.0, road_load_b_n_per_mps=-2.0, road_load_c_n_per_mps2=0.05)
    assert error.value == "-10.0 N at 72.0 km/h"


def test_road_load_touching_zero_is_taken() -> None:
    # on a 31 % grade F = 0.95·20 - 2v + v²/19 = (v - 19)²/19
    vehicle(road_load_a_n=20.0, road_load_b_n_per_mps=-2.0, road_load_c_n_per_mps2=1.0000001 / 19.0)


def test_road_load_negative_on_a_steep_road_only_is_refused() -> None:
    # F = 20 - 2v + 0.05 v² = 0.05 (v - 20)² touches zero on the flat; with 0.95 of A it is -1 N at 20 m/s
    error = refusal(road_load_a_n=20.0, road_load_b_n_per_mps=-2.0, road_load_c_n_per_mps2=0.05)
    assert error.field == "road_load"
    assert str(error.value) == "-1.0 N at 72.0 km/h on a 31 % grade"


def test_road_load_negative_beyond_200_kmh_only_is_taken() -> None:
    # 100 N - 1.7 N/(m/s)·v is zero at 58.8 m/s = 211.8 km/h
    vehicle(road_load_b_n_per_mps=-1.7, road_load_c_n_per_mps2=0.0)


def test_kona_coefficients_with_negative_b_are_taken() -> None:
    vehicle(road_load_a_n=110.578, road_load_b_n_per_mps=-1.99366, road_load_c_n_per_mps2=0.526544)


@pytest.mark.parametrize(
    ("bounds", "allowed"),
    [
        (np.array([0.0]), "at least two boundaries"),
        (np.array([]), "at least two boundaries"),
        (np.zeros((2, 2)), "at least two boundaries"),
        (np.array([1.0, 10.0, 20.0, 40.0]), "rising from 0"),
        (np.array([0.0, 20.0, 10.0, 40.0]), "rising from 0"),
        (np.array([0.0, 10.0, 10.0, 40.0]), "rising from 0"),
        (np.array([0.0, 10.0, 20.0, math.inf]), "rising from 0"),
        (np.array([0.0, math.nan, 20.0, 40.0]), "rising from 0"),
    ],
)
def test_speed_boundaries_that_do_not_rise_from_zero_are_refused(bounds: np.ndarray, allowed: str) -> None:
    error = refusal(accel_speed_mps=bounds)
    assert (error.field, error.allowed) == ("accel_speed_mps", allowed)


@pytest.mark.parametrize("field", ["accel_mps2", "decel_mps2"])
def test_table_of_another_length_than_the_intervals_is_refused(field: str) -> None:
    error = refusal(**{field: getattr(vehicle(), field)[:2]})
    assert (error.field, error.value, error.allowed) == (field, "2 values", "3, one a speed interval")


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("accel_mps2", 0.0, "each 0.01..15"),
        ("accel_mps2", -1.0, "each 0.01..15"),
        ("accel_mps2", 15.1, "each 0.01..15"),
        ("accel_mps2", math.nan, "each 0.01..15"),
        ("decel_mps2", 0.0, "each -15..-0.01"),
        ("decel_mps2", 1.0, "each -15..-0.01"),
        ("decel_mps2", -15.1, "each -15..-0.01"),
        ("decel_mps2", math.nan, "each -15..-0.01"),
    ],
)
def test_table_value_of_wrong_sign_or_size_is_refused(field: str, value: float, allowed: str) -> None:
    table = getattr(vehicle(), field).copy()
    table[1] = value
    error = refusal(**{field: table})
    assert (error.field, error.allowed) == (field, allowed)
    assert error.value == pytest.approx(table.tolist(), nan_ok=True)
