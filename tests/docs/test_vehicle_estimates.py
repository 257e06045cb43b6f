"""Estimated road loads, masses and charging curves: by hand, and that fits find a law that is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from docs.vehicle_estimates import (
    BODY_KINDS,
    SOC_PERCENT,
    Body,
    MassFit,
    Measured,
    RoadLoad,
    RoadLoadFit,
    Weighed,
    fit_mass,
    fit_road_load,
    measured_vehicles,
    middle_shape,
    minutes_10_to_80,
    road_load_fit,
    sister_road_load,
)

pytestmark = pytest.mark.nojit

LAW = RoadLoadFit(0.007, 0.0002, 0.9, dict.fromkeys(BODY_KINDS, 0.3))
CAR = Body("small", 4.0, 1.8, 1.5, None, 1500.0)


def measured(family: str, body: Body) -> Measured:
    return Measured("a car", family, body, LAW.road_load(body), None, None)


def test_road_load_by_kind_of_body_and_by_published_drag() -> None:
    # 1500 kg · 9.80665 = 14 710 N; 0.85 · 1.8 m · 1.5 m = 2.295 m²; ½ · 1.2 · 0.3 · 2.295 = 0.4131
    by_kind = LAW.road_load(CAR)
    assert by_kind.a_n == pytest.approx(102.970, abs=1e-3)
    assert by_kind.b_n_per_mps == pytest.approx(2.94200, abs=1e-5)
    assert by_kind.c_n_per_mps2 == pytest.approx(0.4131)
    # ½ · 1.2 · 0.9 · 0.25 · 2.295 = 0.309825
    assert LAW.road_load(replace(CAR, cd=0.25)).c_n_per_mps2 == pytest.approx(0.309825)


def test_fit_finds_the_law_that_road_loads_follow() -> None:
    bodies = [
        replace(CAR, kind=kind, mass_kg=mass_kg, height_m=height_m)
        for kind in BODY_KINDS
        for mass_kg, height_m in ((1200.0, 1.4), (2400.0, 1.9))
    ]
    # 0.9 · 1/3 is the same 0.3 as by kind, so that both laws hold
    vehicles = [measured(str(k), replace(body, cd=1.0 / 3.0 if k % 2 else None)) for k, body in enumerate(bodies)]
    fit = fit_road_load(vehicles)
    assert fit.rolling_coef == pytest.approx(LAW.rolling_coef)
    assert fit.rolling_s_per_m == pytest.approx(LAW.rolling_s_per_m)
    assert fit.cd_coef == pytest.approx(LAW.cd_coef)
    assert fit.kind_cd == pytest.approx(dict(LAW.kind_cd))


def test_families_count_the_same_however_many_cars_they_have() -> None:
    usual = measured("usual", replace(CAR, cd=0.3))
    odd = Measured("odd", "odd", CAR, RoadLoad(200.0, 0.0, 0.5), None, None)
    few = fit_road_load([usual, odd])
    many = fit_road_load([usual] * 9 + [odd])
    assert many.kind_cd["small"] == pytest.approx(few.kind_cd["small"])


def test_sister_is_scaled_by_mass_and_area() -> None:
    sister = Measured("sister", "f", CAR, RoadLoad(100.0, 2.0, 0.4), None, None)
    road_load = sister_road_load(sister, replace(CAR, mass_kg=1650.0, height_m=1.8))
    assert road_load == RoadLoad(pytest.approx(110.0), pytest.approx(2.2), pytest.approx(0.48))


def test_bundled_fit_is_near_physics() -> None:
    fit = road_load_fit()
    assert 0.004 < fit.rolling_coef < 0.012
    assert 0.8 < fit.cd_coef < 1.2
    assert fit.kind_cd["low"] < fit.kind_cd["crossover"] < fit.kind_cd["van"]
    assert {vehicle.body.kind for vehicle in measured_vehicles()} == set(BODY_KINDS)


def test_mass_fit_finds_the_law_that_masses_follow() -> None:
    law = MassFit(300.0, 80.0, 6.0, 90.0)
    cars = [
        Weighed(str(k), body, capacity_kwh, both_axles, law.kerb_kg(body, capacity_kwh, both_axles=both_axles))
        for k, (body, capacity_kwh, both_axles) in enumerate(
            (replace(CAR, length_m=length_m), capacity_kwh, both_axles)
            for length_m in (3.5, 5.0)
            for capacity_kwh, both_axles in ((30.0, False), (80.0, False), (90.0, True))
        )
    ]
    fit = fit_mass(cars)
    assert fit.kerb_kg(CAR, 50.0, both_axles=True) == pytest.approx(300.0 + 80.0 * 10.8 + 6.0 * 50.0 + 90.0)


def test_time_of_a_constant_power_is_energy_over_power() -> None:
    # 0.7 kWh at 0.5 kW: 84 min
    assert minutes_10_to_80(np.full(SOC_PERCENT.size, 0.5)) == pytest.approx(84.0)


def test_middle_shape_is_the_median_at_each_charge() -> None:
    curves = [np.full(SOC_PERCENT.size, power) for power in (0.2, 0.5, 1.0)]
    np.testing.assert_array_equal(middle_shape(curves), np.full(SOC_PERCENT.size, 0.5))
