"""Driving cycles and the self-check: energies by hand, what is compared with what, and the bundled vehicles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from energy.errors import EnergyError, VehicleError
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.files import AnyVehicle, load_published, load_vehicle, load_vehicles
from energy.vehicle.published import Published
from energy.vehicle.self_check import (
    BAND,
    LABEL_FACTOR,
    LISTED_BAND,
    WALL_EFF,
    CycleError,
    DrivingCycle,
    bundled_cycle,
    cycle_consumption,
    load_cycle,
    self_check,
)
from energy.vehicle.services import HereParameters, vehicle_from_here
from energy.vehicle.vehicle import Powertrain, Vehicle

BUNDLED = Path(__file__).resolve().parents[3] / "data" / "vehicles"
KONA = load_vehicle(BUNDLED / "hyundai-kona-64.toml")
assert isinstance(KONA, Vehicle)
SIMPLE = replace(
    KONA,
    mass_kg=1000.0,
    rotating_mass_coef=1.0,
    road_load_a_n=200.0,
    road_load_b_n_per_mps=0.0,
    road_load_c_n_per_mps2=0.5,
    drive_eff=0.8,
    recuperation_eff=0.5,
    aux_power_w=450.0,
    aux_move_eff=0.9,
    aux_idle_eff=0.75,
)


def cycle(*speeds_mps: float) -> DrivingCycle:
    return DrivingCycle("by hand", np.array(speeds_mps))


def per_metre(vehicle: AnyVehicle, driven: DrivingCycle) -> float:
    """Energy over a cycle [J]."""
    return cycle_consumption(vehicle, driven) * 36.0 * driven.distance_m


def test_constant_speed_takes_road_load_over_drive_efficiency_and_auxiliaries() -> None:
    # 200 N + 0.5·20² = 400 N · 20 m/s / 0.8 = 10 000 W, and 450/0.9 = 500 W: 10 500 W / 20 m/s = 525 J/m
    assert cycle_consumption(SIMPLE, cycle(20.0, 20.0, 20.0)) == pytest.approx(525.0 / 36.0)


def test_acceleration_and_braking_use_their_own_efficiencies() -> None:
    # 0 to 2 m/s in a second: 200 + 0.5·1 + 1000·2 = 2200.5 N at 1 m/s, over 0.8; back: −1799.5 N, times 0.5
    assert per_metre(SIMPLE, cycle(0.0, 2.0, 0.0)) == pytest.approx(2200.5 / 0.8 - 1799.5 * 0.5 + 2 * 500.0)


def test_standstill_takes_auxiliaries_at_their_idle_efficiency() -> None:
    assert per_metre(SIMPLE, cycle(0.0, 0.0, 2.0)) == pytest.approx(600.0 + 2200.5 / 0.8 + 500.0)


def test_loss_that_grows_with_force_is_part_of_the_consumption() -> None:
    lossy = replace(SIMPLE, effects=EffectCoefficients(drive_loss_w_per_n2=0.001))
    driven = cycle(20.0, 20.0)
    assert per_metre(lossy, driven) - per_metre(SIMPLE, driven) == pytest.approx(0.001 * 400.0**2)


def test_consumption_table_takes_its_curve_speed_changes_and_auxiliaries() -> None:
    table = vehicle_from_here("t", "T", HereParameters("0,0.1,36,0.2", 50.0, auxiliary_consumption_wh_per_s=0.1))
    moving = replace(table, kinetic_up_kg=2000.0, kinetic_down_kg=800.0)
    # 0 to 4 m/s at 2 m/s: 0.12 Wh/m · 2 m = 864 J, ½·16·2000 J, 360 J; then back with ½·16·800 J
    assert per_metre(moving, cycle(0.0, 4.0, 0.0)) == pytest.approx(2 * 864.0 + 16_000.0 - 6400.0 + 2 * 360.0)


def test_cycle_length_is_that_of_speed_linear_in_each_second() -> None:
    assert cycle(0.0, 2.0, 4.0).distance_m == 4.0


@pytest.mark.parametrize(("name", "seconds", "miles"), [("udds", 1369, 7.45), ("hwfet", 765, 10.26)])
def test_bundled_cycles_have_epas_duration_and_length(name: str, seconds: int, miles: float) -> None:
    # EPA, dynamometer drive schedules: UDDS 1369 s and 7.45 miles, HWFET 765 s and 10.26 miles
    driven = bundled_cycle("udds" if name == "udds" else "hwfet")
    assert driven.name == name
    assert driven.speed_mps.size - 1 == seconds
    assert driven.distance_m / 1609.344 == pytest.approx(miles, abs=0.01)
    with pytest.raises(ValueError, match="read-only"):
        driven.speed_mps[0] = 1.0


@pytest.mark.parametrize(
    ("text", "field", "value"),
    [
        ("time_s,speed_mph\n0,0\n", "rows", 1),
        ("time_s,speed_mph\n0,0\n2,1\n", "time_s of row 1", "2"),
        ("time_s,speed_mph\n0,0\n1,fast\n", "speed_mph of row 1", "fast"),
        ("time_s,speed_mph\n0,0\n1,-3\n", "speed_mph of row 1", "-3"),
        ("time_s,speed_kmh\n0,0\n1,3\n", "speed_mph of row 0", None),
        ("time_s,speed_mph\n0,0\n1,0\n", "speed_mph", "0 everywhere"),
    ],
)
def test_broken_cycle_names_file_field_and_value(tmp_path: Path, text: str, field: str, value: object) -> None:
    path = tmp_path / "broken.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CycleError) as caught:
        load_cycle(path)
    assert (caught.value.path, caught.value.field, caught.value.value) == (str(path), field, value)
    assert isinstance(caught.value, EnergyError)


def test_absent_cycle_says_so(tmp_path: Path) -> None:
    with pytest.raises(CycleError, match="No such file"):
        load_cycle(tmp_path / "none.csv")


def test_electric_car_is_compared_at_the_wall() -> None:
    (check,) = self_check(SIMPLE, Published("p", epa_udds_kwh_per_100km=15.0)).checks
    battery = cycle_consumption(SIMPLE, bundled_cycle("udds"))
    assert (check.figure, check.cycle) == ("epa_udds_kwh_per_100km", "udds")
    assert check.model_kwh_per_100km == pytest.approx(battery / WALL_EFF)
    assert check.ratio == pytest.approx(battery / WALL_EFF / 15.0)
    assert check.band == BAND


def test_petrol_car_is_compared_at_its_tank() -> None:
    petrol = replace(SIMPLE, powertrain=Powertrain.ICE)
    (check,) = self_check(petrol, Published("p", epa_hwfet_kwh_per_100km=15.0)).checks
    assert check.model_kwh_per_100km == cycle_consumption(petrol, bundled_cycle("hwfet"))


def test_label_is_compared_without_its_adjustment() -> None:
    label = self_check(SIMPLE, Published("p", epa_city_kwh_per_100km=20.0, epa_highway_kwh_per_100km=22.0)).checks
    assert [check.cycle for check in label] == ["udds", "hwfet"]
    assert [check.published_kwh_per_100km for check in label] == [20.0 * LABEL_FACTOR, 22.0 * LABEL_FACTOR]


@pytest.mark.parametrize(("ratio", "met"), [(0.84, False), (0.86, True), (1.14, True), (1.16, False)])
def test_band_decides_whether_a_figure_is_met(ratio: float, met: bool) -> None:
    model = cycle_consumption(SIMPLE, bundled_cycle("udds")) / WALL_EFF
    checked = self_check(SIMPLE, Published("p", epa_udds_kwh_per_100km=model / ratio))
    assert checked.checks[0].ratio == pytest.approx(ratio)
    assert checked.checks[0].met is checked.met is met


def test_one_figure_outside_the_band_fails_the_vehicle() -> None:
    model = [cycle_consumption(SIMPLE, bundled_cycle(name)) / WALL_EFF for name in ("udds", "hwfet")]
    checked = self_check(
        SIMPLE, Published("p", epa_udds_kwh_per_100km=model[0], epa_hwfet_kwh_per_100km=2.0 * model[1])
    )
    assert [check.met for check in checked.checks] == [True, False]
    assert checked.met is False


@pytest.mark.parametrize("published", [None, Published("p", wltp_kwh_per_100km=16.0, epa_range_km=400.0)])
def test_vehicle_without_a_comparable_figure_is_neither_met_nor_missed(published: Published | None) -> None:
    checked = self_check(SIMPLE, published)
    assert (checked.vehicle_id, checked.checks, checked.met) == ("hyundai-kona-64", (), None)


def test_published_figure_out_of_range_is_refused() -> None:
    with pytest.raises(VehicleError, match=r"published\.epa_range_km is 0\.0, allowed: \(0, 10000\]"):
        Published("p", epa_range_km=0.0)


def test_bundled_petrol_car_burns_what_was_measured() -> None:
    # two of its parameters are derived from these two tests
    petrol = load_vehicle(BUNDLED / "toyota-corolla-petrol.toml")
    checked = self_check(petrol, load_published(BUNDLED / "toyota-corolla-petrol.toml"))
    assert [check.ratio for check in checked.checks] == pytest.approx([1.0, 1.0], abs=1e-3)


def test_bundled_electric_cars_agree_with_epa_in_the_middle_and_mostly_within_the_band() -> None:
    ratios: dict[str, list[float]] = {"udds": [], "hwfet": []}
    met = []
    for vehicle_id, vehicle in load_vehicles(BUNDLED).items():
        published = load_published(BUNDLED / f"{vehicle_id}.toml")
        if published is not None and vehicle.powertrain is Powertrain.BEV:
            tested = [check for check in self_check(vehicle, published).checks if check.cycle != "mixed"]
            met += [all(check.met for check in tested)] if tested else []
            for check in tested:
                ratios[check.cycle].append(check.ratio)
    assert len(met) >= 40
    assert sum(met) >= 0.7 * len(met)
    assert float(np.median(ratios["udds"])) == pytest.approx(1.0, abs=0.05)
    assert float(np.median(ratios["hwfet"])) == pytest.approx(1.0, abs=0.05)
    assert all(0.7 < ratio < 1.25 for of_cycle in ratios.values() for ratio in of_cycle)


def test_listed_consumption_is_held_beside_the_mean_of_both_cycles_from_the_battery() -> None:
    mean = 0.5 * (cycle_consumption(SIMPLE, bundled_cycle("udds")) + cycle_consumption(SIMPLE, bundled_cycle("hwfet")))
    for share, met in ((1.0, True), (0.75, False), (1.5, False)):
        (check,) = self_check(SIMPLE, Published("a list", listed_kwh_per_100km=share * mean / LABEL_FACTOR)).checks
        assert (check.figure, check.cycle, check.band) == ("listed_kwh_per_100km", "mixed", LISTED_BAND)
        assert check.model_kwh_per_100km == pytest.approx(mean)
        assert check.ratio == pytest.approx(1.0 / share)
        assert check.met is met
