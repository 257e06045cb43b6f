"""Sampled vehicles and the distribution of a chain's energy: determinism, order, limits, and the exact plain case."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from energy.battery import soc_along
from energy.chain.chain import DriveSettings, LinkModel, StopRule, simulate_chain
from energy.chain.sampling import RESIDUAL_SD_FRAC, Sampling, residual_fracs, sampled_vehicles
from energy.chain.uncertainty import CHUNK, chain_distribution, dissipation_sd_frac
from energy.conditions import STILL, Conditions, RoadSurface
from energy.errors import ConditionsError, LinkError, VehicleError
from energy.vehicle.coefficients import COEFFICIENT_RANGES
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import load_vehicle
from energy.vehicle.pessimistic import pessimistic
from energy.vehicle.vehicle import Vehicle

VEHICLES = Path(__file__).resolve().parents[3] / "data" / "vehicles"
COLD = Conditions(ambient_k=268.15)
FREEZING_WET = Conditions(ambient_k=274.15, road=RoadSurface.WET, regen_limited=True)


@pytest.fixture(scope="module")
def i3() -> Vehicle:
    vehicle = load_vehicle(VEHICLES / "bmw-i3-60ah.toml")
    assert isinstance(vehicle, Vehicle)
    return vehicle


@pytest.fixture(scope="module")
def table() -> ConsumptionTableVehicle:
    vehicle = load_vehicle(VEHICLES / "example-here-table.toml")
    assert isinstance(vehicle, ConsumptionTableVehicle)
    return vehicle


@pytest.fixture(scope="module")
def hills(make_chain):
    """80 links of 12 km with stops, up a hill and down again."""
    n = 80
    random = np.random.default_rng(5)
    chain = make_chain(
        random.uniform(50.0, 250.0, n),
        random.choice([30.0, 50.0, 80.0], n) / 3.6,
        0.04 * np.sin(np.linspace(0.0, 2.0 * np.pi, n)),
        np.where(random.random(n) < 0.3, 0.4, 0.0),
        np.full(n, 8.0),
    )
    return dataclasses.replace(chain, altitude_m=np.full(n, 900.0))


@pytest.fixture(scope="module")
def descent(make_chain):
    """3 km down a 6 % grade."""
    return make_chain(np.full(30, 100.0), 50.0 / 3.6, -0.06)


def with_sd(vehicle, scale=1.0, **sd):
    given = sd or dict(vehicle.sd)
    return dataclasses.replace(vehicle, sd=MappingProxyType({name: scale * value for name, value in given.items()}))


def certain(vehicle):
    return dataclasses.replace(vehicle, sd=MappingProxyType({}))


def distribution(vehicle, chain, **changes):
    """chain_distribution with some of its arguments, fields of its records among them, changed."""
    of_drive, of_sampling = (
        record(**{field.name: changes.pop(field.name) for field in dataclasses.fields(record) if field.name in changes})
        for record in (DriveSettings, Sampling)
    )
    given = {"soc_start_frac": 0.8, "reserve_soc_frac": 0.1} | changes
    return chain_distribution(vehicle, chain, of_drive, sampling=of_sampling, **given)


def width_j(found):
    return found.energy_p90_j - found.energy_p10_j


# sampled vehicles


def test_draws_are_the_same_for_a_seed_and_others_for_another(i3):
    first, again, other = sampled_vehicles(i3, 5, 1), sampled_vehicles(i3, 5, 1), sampled_vehicles(i3, 5, 2)
    assert [car.mass_kg for car in first] == [car.mass_kg for car in again]
    assert all(a.mass_kg != b.mass_kg for a, b in zip(first, other, strict=True))


def test_a_larger_count_begins_with_the_vehicles_of_a_smaller_one(i3):
    few, many = sampled_vehicles(i3, 3, 7), sampled_vehicles(i3, 9, 7)
    assert [car.drive_eff for car in few] == [car.drive_eff for car in many[:3]]


def test_a_field_draws_the_same_whatever_else_is_uncertain(i3):
    alone = sampled_vehicles(with_sd(i3, mass_kg=75.0), 20)
    together = sampled_vehicles(with_sd(i3, mass_kg=75.0, road_load_a_n=1.0), 20)
    assert [car.mass_kg for car in alone] == [car.mass_kg for car in together]


def test_draws_have_the_mean_and_standard_deviation_of_the_vehicle(i3):
    # of 2000 draws the mean errs by sd/√2000, the standard deviation by sd/√4000: four times each
    mass_kg = np.array([car.mass_kg for car in sampled_vehicles(i3, 2000)])
    sd_kg = i3.sd["mass_kg"]
    assert abs(mass_kg.mean() - i3.mass_kg) < 4.0 * sd_kg / np.sqrt(2000)
    assert abs(mass_kg.std() - sd_kg) < 4.0 * sd_kg / np.sqrt(4000)


def test_efficiencies_far_too_uncertain_stay_within_what_a_vehicle_can_be(i3):
    vehicles = sampled_vehicles(with_sd(i3, drive_eff=0.5, recuperation_eff=0.5), 300)
    assert all(0.0 < car.drive_eff <= 1.0 and 0.0 <= car.recuperation_eff <= 1.0 for car in vehicles)
    assert all(car.drive_eff * car.recuperation_eff <= 1.0 for car in vehicles)
    assert len({car.drive_eff for car in vehicles}) == 300


def test_vehicle_without_standard_deviations_gives_itself(i3, table):
    for plain in (certain(i3), certain(table), with_sd(i3, mass_kg=0.0)):
        assert all(car is plain for car in sampled_vehicles(plain, 4))


def test_consumption_table_and_its_effects_are_sampled(table):
    vehicle = with_sd(table, aux_power_w=50.0, consumption_j_per_m=20.0)
    first, second = sampled_vehicles(vehicle, 2)
    assert first.aux_power_w != second.aux_power_w
    shift = first.consumption_j_per_m - table.consumption_j_per_m
    assert np.allclose(shift, shift[0])  # a table moves as a whole
    assert shift[0] != 0.0


def test_effect_coefficient_is_sampled_within_its_range(i3):
    low, high = COEFFICIENT_RANGES["cabin_ua_w_per_k"]
    vehicles = sampled_vehicles(with_sd(i3, **{"effects.cabin_ua_w_per_k": 100.0}), 100)
    values = [car.effects.cabin_ua_w_per_k for car in vehicles]
    assert all(low <= value <= high for value in values)
    assert np.std(values) > 50.0
    assert all(car.mass_kg == i3.mass_kg for car in vehicles)


@pytest.mark.parametrize("name", ["mass", "effects.cabin", "id", "effects"])
def test_standard_deviation_of_an_unknown_field_is_refused(i3, name):
    with pytest.raises(VehicleError, match=rf"sd\.{name} of vehicle 'bmw-i3-60ah' is 1.0, allowed: a field"):
        sampled_vehicles(with_sd(i3, **{name: 1.0}), 1)


def test_effect_of_a_consumption_table_is_refused(table):
    with pytest.raises(VehicleError, match=r"sd\.effects\.cabin_ua_w_per_k"):
        sampled_vehicles(with_sd(table, **{"effects.cabin_ua_w_per_k": 1.0}), 1)


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_impossible_standard_deviation_is_refused(i3, value):
    with pytest.raises(VehicleError, match="at least 0"):
        sampled_vehicles(with_sd(i3, mass_kg=value), 1)


def test_vehicle_that_no_draw_can_be_is_refused_after_bounded_tries(i3):
    with pytest.raises(VehicleError, match="one of 64 draws can be a vehicle; the last was refused: mass_kg"):
        sampled_vehicles(with_sd(i3, mass_kg=1e12), 1)


@pytest.mark.parametrize("count", [0, 10_001])
def test_count_out_of_range_is_refused(i3, count):
    with pytest.raises(ConditionsError, match="samples is"):
        sampled_vehicles(i3, count)


def test_residual_has_the_source_s_deviation_and_never_takes_more_than_all():
    assert RESIDUAL_SD_FRAC == 0.104  # table VII
    assert residual_fracs(5000).std() == pytest.approx(RESIDUAL_SD_FRAC, rel=0.05)
    assert residual_fracs(5000, sd_frac=0.5).min() == -1.0
    with pytest.raises(ConditionsError, match=r"residual_sd_frac is 0\.6"):
        residual_fracs(1, sd_frac=0.6)


# distribution of a chain


@pytest.mark.parametrize("conditions", [STILL, COLD, FREEZING_WET])
@pytest.mark.parametrize("link_model", LinkModel)
@pytest.mark.parametrize("stop_rule", [StopRule.EXPECTED, StopRule.COUNTED, StopRule.NONE])
def test_without_uncertainty_all_quantiles_are_the_plain_simulation_to_the_bit(
    i3, hills, conditions, link_model, stop_rule
):
    plain = simulate_chain(
        i3, hills, conditions=conditions, link_model=link_model, stop_rule=stop_rule, soc_start_frac=0.8
    )
    soc, _ = soc_along(np.array([link.energy_j for link in plain.links]), 0.8, i3.usable_capacity_wh)
    found = distribution(
        certain(i3),
        hills,
        conditions=conditions,
        link_model=link_model,
        stop_rule=stop_rule,
        residual_sd_frac=0.0,
        samples=7,
    )
    assert found.energy_p10_j == found.energy_p50_j == found.energy_p90_j == plain.energy_j
    assert found.arrival_soc_p10_frac == found.arrival_soc_p50_frac == found.arrival_soc_p90_frac == soc[-1]
    assert found.duration_s == pytest.approx(plain.duration_s, rel=1e-12)
    assert found.parameter_sd_frac == 0.0
    assert found.above_reserve_frac == float(soc.min() >= 0.1)


def test_without_uncertainty_a_consumption_table_gives_its_plain_simulation(table, hills):
    plain = simulate_chain(table, hills)
    found = distribution(certain(table), hills, residual_sd_frac=0.0, samples=3)
    assert found.energy_p10_j == found.energy_p90_j == plain.energy_j


def test_distribution_is_the_same_for_a_seed(i3, hills):
    assert distribution(i3, hills, seed=3) == distribution(i3, hills, seed=3)
    assert distribution(i3, hills, seed=3) != distribution(i3, hills, seed=4)


@pytest.mark.parametrize("conditions", [STILL, COLD, FREEZING_WET])
def test_quantiles_are_in_order_and_low_charge_goes_with_high_energy(i3, hills, conditions):
    found = distribution(i3, hills, conditions=conditions)
    assert found.energy_p10_j < found.energy_p50_j < found.energy_p90_j
    assert found.arrival_soc_p10_frac < found.arrival_soc_p50_frac < found.arrival_soc_p90_frac
    assert 0.0 <= found.above_reserve_frac <= 1.0


def test_median_is_near_the_plain_simulation(i3, hills):
    # half a standard error of the median of 2000 is 0.02 of the spread; non-linearity adds to it
    found = distribution(i3, hills, samples=2000)
    assert found.energy_p50_j == pytest.approx(simulate_chain(i3, hills).energy_j, abs=0.05 * width_j(found))


def test_width_grows_with_the_parameters_deviation(i3, hills):
    widths = [width_j(distribution(with_sd(i3, scale), hills, residual_sd_frac=0.0)) for scale in (0.25, 0.5, 1.0)]
    assert 0.0 < widths[0] < widths[1] < widths[2]


def test_width_grows_with_the_residual(i3, hills):
    widths = [width_j(distribution(i3, hills, residual_sd_frac=sd)) for sd in (0.0, 0.1, 0.2, 0.4)]
    assert widths == sorted(widths)


def test_residual_alone_scales_the_dissipated_energy_by_normal_quantiles(i3, hills):
    # E = E_sim + f·D: the width is (z90 − z10)·0.104·D of the sample of f itself
    plain = simulate_chain(i3, hills)
    dissipated_j = plain.energy_j - plain.parts.grade_j - plain.parts.inertia_j
    low, high = np.quantile(residual_fracs(200), (0.1, 0.9))
    found = distribution(certain(i3), hills)
    assert width_j(found) == pytest.approx((high - low) * dissipated_j, rel=1e-9)
    assert high - low == pytest.approx(2.0 * 1.2816 * RESIDUAL_SD_FRAC, rel=0.25)


def test_descent_stays_uncertain_although_its_energy_is_near_nothing(i3, descent):
    plain = simulate_chain(i3, descent)
    assert plain.energy_j < 0.0
    found = distribution(certain(i3), descent)
    assert width_j(found) > abs(plain.parts.grade_j) * 0.05


def test_probability_grows_with_the_charge_from_none_to_all(i3, hills):
    need = simulate_chain(i3, hills).energy_j / 3600.0 / i3.usable_capacity_wh
    charges = 0.1 + need * np.linspace(0.5, 1.6, 23)
    found = [distribution(i3, hills, soc_start_frac=float(charge)).above_reserve_frac for charge in charges]
    assert found == sorted(found)
    assert found[0] == 0.0
    assert found[-1] == 1.0
    assert 0.2 < found[10] < 0.9


def test_charge_below_the_reserve_on_the_way_counts_although_the_arrival_is_above(i3, make_chain):
    # 4 km up and 4 km down again: the charge is lowest on top
    chain = make_chain(np.full(80, 100.0), 50.0 / 3.6, np.repeat([0.08, -0.08], 40))
    found = distribution(certain(i3), chain, soc_start_frac=0.2, reserve_soc_frac=0.13, residual_sd_frac=0.0)
    soc, _ = soc_along(
        np.array([link.energy_j for link in simulate_chain(i3, chain).links]), 0.2, i3.usable_capacity_wh
    )
    assert soc.min() < 0.13 < soc[-1]
    assert found.above_reserve_frac == 0.0


def test_start_below_the_reserve_is_never_above_it(i3, descent):
    assert distribution(i3, descent, soc_start_frac=0.1, reserve_soc_frac=0.11).above_reserve_frac == 0.0


def test_full_battery_is_clamped_in_each_sample(i3, make_chain):
    # down, where a full battery takes no more, then up
    chain = make_chain(np.full(60, 100.0), 50.0 / 3.6, np.repeat([-0.06, 0.06], 30))
    charges = []
    for car in sampled_vehicles(i3, 50):
        energy_j = np.array([link.energy_j for link in simulate_chain(car, chain, soc_start_frac=1.0).links])
        soc, braked_away_j = soc_along(energy_j, 1.0, car.usable_capacity_wh)
        assert braked_away_j.sum() > 0.0
        charges.append(soc)
    found = distribution(i3, chain, soc_start_frac=1.0, samples=50, residual_sd_frac=0.0, along=True)
    expected = np.quantile(charges, (0.1, 0.5, 0.9), axis=0)
    arrival = [found.arrival_soc_p10_frac, found.arrival_soc_p50_frac, found.arrival_soc_p90_frac]
    assert arrival == expected[:, -1].tolist()
    assert found.soc_p10_frac.tolist() == expected[0].tolist()
    assert found.soc_p90_frac.tolist() == expected[2].tolist()


@pytest.mark.parametrize("samples", [1, 7, 600])  # fewer and more than are drawn at a time
def test_charge_along_the_way_ends_with_the_quantiles_of_the_arrival(i3, hills, samples):
    found = distribution(i3, hills, samples=samples, along=True)
    assert found.soc_p10_frac.shape == found.soc_p90_frac.shape == hills.length_m.shape
    assert found.soc_p10_frac[-1] == found.arrival_soc_p10_frac
    assert found.soc_p90_frac[-1] == found.arrival_soc_p90_frac
    spread = found.soc_p90_frac - found.soc_p10_frac
    assert np.all(spread > 0.0) if samples > 1 else np.all(spread == 0.0)


def test_charge_along_the_way_is_absent_unless_asked_for(i3, hills):
    plain, along = distribution(i3, hills), distribution(i3, hills, along=True)
    assert plain.soc_p10_frac is None
    assert plain.soc_p90_frac is None
    assert dataclasses.replace(along, soc_p10_frac=None, soc_p90_frac=None) == plain


def test_missing_energy_is_a_charge_below_nothing(i3, hills):
    assert distribution(i3, hills, soc_start_frac=0.01).arrival_soc_p50_frac < 0.0


def test_samples_beyond_a_chunk_are_those_of_one_chunk(i3, descent):
    vehicles = sampled_vehicles(i3, CHUNK + 5)
    found = distribution(i3, descent, samples=CHUNK + 5, residual_sd_frac=0.0)
    energies = [simulate_chain(car, descent).energy_j for car in vehicles]
    assert found.energy_p50_j == pytest.approx(np.quantile(energies, 0.5), rel=1e-12)
    assert found.energy_p90_j == pytest.approx(np.quantile(energies, 0.9), rel=1e-12)


@pytest.mark.parametrize(
    ("field", "value"), [("soc_start_frac", 1.1), ("reserve_soc_frac", -0.1), ("samples", 0), ("residual_sd_frac", 2.0)]
)
def test_number_out_of_range_is_refused_by_name(i3, descent, field, value):
    with pytest.raises(ConditionsError) as caught:
        distribution(i3, descent, **{field: value})
    assert (caught.value.field, caught.value.value) == (field, value)


def test_chain_that_cannot_be_driven_is_refused(i3, descent):
    with pytest.raises(LinkError, match="length_m"):
        distribution(i3, dataclasses.replace(descent, length_m=-descent.length_m))


# scaled dissipation


def test_factor_one_is_the_vehicle_itself(i3, table):
    assert pessimistic(i3, 1.0) is i3
    assert pessimistic(table, 1.0) is table


@pytest.mark.parametrize("conditions", [STILL, COLD, FREEZING_WET, Conditions(ambient_k=308.15, sun_w=500.0)])
def test_energy_of_every_link_grows_with_the_factor(i3, hills, conditions):
    factors = (0.5, 0.8, 1.0, 1.2, 1.5, 2.5, 6.0)
    energies = [
        [link.energy_j for link in simulate_chain(pessimistic(i3, factor), hills, conditions=conditions).links]
        for factor in factors
    ]
    assert bool((np.diff(np.array(energies), axis=0) > 0.0).all())


def test_energy_of_a_consumption_table_grows_with_the_factor(table, hills):
    energies = [
        [link.energy_j for link in simulate_chain(pessimistic(table, factor), hills).links]
        for factor in (0.5, 1.0, 1.5, 4.0)
    ]
    assert bool((np.diff(np.array(energies), axis=0) > 0.0).all())


@pytest.mark.parametrize("factor", [0.7, 1.3])
@pytest.mark.parametrize("conditions", [STILL, COLD])
def test_dissipated_energy_follows_the_factor_nearly(i3, hills, factor, conditions):
    def dissipated_j(vehicle):
        found = simulate_chain(vehicle, hills, conditions=conditions)
        return found.energy_j - found.parts.grade_j - found.parts.inertia_j

    share = dissipated_j(pessimistic(i3, factor)) / dissipated_j(i3)
    assert share - 1.0 == pytest.approx(factor - 1.0, rel=0.1)


def test_losses_are_scaled_as_said(round_vehicle):
    # η_dis 0.8: 1/η − 1 = 0.25, doubled 0.5, η = 1/1.5; η_chg 0.5: 1 − 0.5 doubled leaves 0; A 100 N, C 0.5
    worse = pessimistic(round_vehicle, 2.0)
    assert (worse.road_load_a_n, worse.road_load_c_n_per_mps2, worse.aux_power_w) == (200.0, 1.0, 900.0)
    assert worse.drive_eff == pytest.approx(1.0 / 1.5)
    assert worse.recuperation_eff == 0.0
    assert pessimistic(round_vehicle, 3.0).recuperation_eff == 0.0


@pytest.mark.parametrize("factor", [0.0, -1.0, 21.0, float("nan")])
def test_factor_out_of_range_is_refused(i3, factor):
    with pytest.raises(ConditionsError, match=r"factor is .*, allowed: 0.05..20"):
        pessimistic(i3, factor)


def test_deviation_of_dissipation_joins_parameters_and_residual(i3, hills):
    both, parameters = (
        dissipation_sd_frac(i3, hills),
        dissipation_sd_frac(i3, hills, sampling=Sampling(residual_sd_frac=0.0)),
    )
    expected = np.sqrt(parameters**2 + RESIDUAL_SD_FRAC**2 + (parameters * RESIDUAL_SD_FRAC) ** 2)
    assert both == pytest.approx(expected)
    assert parameters == distribution(i3, hills).parameter_sd_frac
    assert dissipation_sd_frac(certain(i3), hills) == pytest.approx(RESIDUAL_SD_FRAC)


def test_quantile_by_one_scaled_vehicle_agrees_with_the_samples(i3, hills):
    # one search for the 90 % quantile: 1.2816 standard deviations of the dissipation
    factor = 1.0 + 1.2816 * dissipation_sd_frac(i3, hills)
    found = distribution(i3, hills, samples=2000)
    scaled_j = simulate_chain(pessimistic(i3, factor), hills).energy_j
    assert scaled_j == pytest.approx(found.energy_p90_j, rel=0.03)


def test_a_residual_that_was_measured_on_the_vehicles_trips_takes_the_place_of_the_usual_one(i3, hills):
    own = dataclasses.replace(certain(i3), residual_sd_frac=0.05)
    usual, measured = (
        chain_distribution(vehicle, hills, soc_start_frac=0.9, reserve_soc_frac=0.1) for vehicle in (certain(i3), own)
    )
    assert (usual.residual_sd_frac, measured.residual_sd_frac) == (RESIDUAL_SD_FRAC, 0.05)
    widths = [found.energy_p90_j - found.energy_p10_j for found in (usual, measured)]
    assert widths[1] / widths[0] == pytest.approx(0.05 / RESIDUAL_SD_FRAC, rel=1e-6)
    assert dissipation_sd_frac(own, hills) == pytest.approx(0.05)


def test_a_measured_residual_holds_what_carried_numbers_scatter_by(i3):
    assert i3.with_residual({"mass_kg"}).sd == i3.sd
    own = dataclasses.replace(i3, residual_sd_frac=0.08).with_residual({"mass_kg", "road_load_a_n"})
    assert set(own.sd) == set(i3.sd) - {"mass_kg", "road_load_a_n"}


@pytest.mark.parametrize("value", [-0.01, 0.51, float("nan")])
def test_a_residual_out_of_range_is_refused(i3, value):
    with pytest.raises(VehicleError, match="residual_sd_frac"):
        dataclasses.replace(i3, residual_sd_frac=value)
