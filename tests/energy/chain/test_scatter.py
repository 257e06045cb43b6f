"""Energies by shifts of parameters against drives with each drawn vehicle."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from energy.chain.chain import DriveSettings, simulate_chain
from energy.chain.sampling import sampled_vehicles, shifted_vehicle
from energy.chain.scatter import chain_scatter, drawn_shifts
from energy.chain.uncertainty import Driven, driven_by
from energy.conditions import Conditions
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle

VEHICLES = Path(__file__).resolve().parents[3] / "data" / "vehicles"
COLD = Conditions(ambient_k=268.15)
CARS = ("bmw-i3-60ah", "hyundai-kona-64", "tesla-model-3", "example-here-table")


@pytest.fixture(scope="module")
def hills(make_chain):
    """200 links of 60 km, up a hill and down again."""
    n = 200
    random = np.random.default_rng(11)
    chain = make_chain(
        random.uniform(100.0, 500.0, n),
        random.choice([50.0, 80.0, 110.0], n) / 3.6,
        0.04 * np.sin(np.linspace(0.0, 2.0 * np.pi, n)),
        np.where(random.random(n) < 0.2, 0.4, 0.0),
        np.full(n, 8.0),
    )
    return dataclasses.replace(chain, altitude_m=np.full(n, 900.0))


def car(name: str) -> Vehicle | ConsumptionTableVehicle:
    vehicle = load_vehicle(VEHICLES / f"{name}.toml")
    if isinstance(vehicle, ConsumptionTableVehicle):
        vehicle = dataclasses.replace(vehicle, sd=MappingProxyType({"consumption_j_per_m": 30.0, "aux_power_w": 150.0}))
    return vehicle


def driven(vehicles, chain, drive) -> tuple[np.ndarray, np.ndarray]:
    rows: list[Driven] = list(driven_by(vehicles, chain, drive))
    return np.concatenate([row[1] for row in rows]), np.concatenate([row[2] for row in rows])


@pytest.mark.parametrize("name", CARS)
@pytest.mark.parametrize("conditions", [Conditions(), COLD], ids=["usual", "cold"])
def test_energies_by_shifts_are_those_of_drawn_vehicles_but_for_what_two_parameters_do_together(
    name, conditions, hills
):
    vehicle, drive = car(name), DriveSettings(conditions)
    shifts = drawn_shifts(vehicle, 300)
    moved = [
        shifted_vehicle(vehicle, {name: x * vehicle.sd[name] for name, x in zip(shifts.names, row, strict=True)})
        for row in shifts.shifts_sd.tolist()
    ]
    energy, lost = driven(moved, hills, drive)
    by_shifts, lost_by_shifts = chain_scatter(vehicle, hills, drive).drawn(shifts.shifts_sd)
    for exact, quick in ((energy, by_shifts), (lost, lost_by_shifts)):
        total, off = exact.sum(axis=1), quick.sum(axis=1) - exact.sum(axis=1)
        assert abs(off.mean()) < 5e-4 * total.mean()
        assert (total + off).std() == pytest.approx(total.std(), rel=0.01)
        assert off.std() < 0.07 * total.std()  # half a per cent of the variance


def test_a_vehicle_that_is_certain_takes_what_its_chain_takes(hills):
    vehicle = dataclasses.replace(car("bmw-i3-60ah"), sd=MappingProxyType({}))
    scatter = chain_scatter(vehicle, hills)
    np.testing.assert_array_equal(scatter.energy_j, simulate_chain(vehicle, hills).links.energy_j)
    assert scatter.energy_terms_j.shape == (0, 200)
    energy, _ = scatter.drawn(drawn_shifts(vehicle, 3).shifts_sd)
    np.testing.assert_array_equal(energy, np.tile(scatter.energy_j, (3, 1)))


def test_a_shift_of_one_parameter_alone_is_met_exactly_where_it_was_driven(hills):
    vehicle = car("bmw-i3-60ah")
    scatter = chain_scatter(vehicle, hills)
    names = drawn_shifts(vehicle, 1).names
    for k, name in enumerate(names):
        moved = dataclasses.replace(vehicle, **{name: getattr(vehicle, name) - vehicle.sd[name]})
        shift = np.zeros((1, len(names)))
        shift[0, k] = -1.0
        energy, _ = scatter.drawn(shift)
        np.testing.assert_allclose(energy[0], simulate_chain(moved, hills).links.energy_j, rtol=1e-9, atol=1e-6)


def test_an_efficiency_near_one_is_driven_on_its_possible_side(hills):
    vehicle = car("bmw-i3-60ah")
    near = dataclasses.replace(vehicle, drive_eff=0.999, recuperation_eff=0.6, sd=MappingProxyType({"drive_eff": 0.02}))
    scatter = chain_scatter(near, hills)
    energy, _ = scatter.drawn(np.array([[-1.0]]))
    worse = dataclasses.replace(near, drive_eff=0.979)
    np.testing.assert_allclose(energy[0], simulate_chain(worse, hills).links.energy_j, rtol=1e-9, atol=1e-6)


def test_draws_are_even_in_each_number_and_spread_as_those_of_many_vehicles(hills):
    vehicle = car("bmw-i3-60ah")
    shifts = drawn_shifts(vehicle, 1024)
    assert shifts.shifts_sd.shape[0] > 0.95 * 1024
    mass = shifts.shifts_sd[:, shifts.names.index("mass_kg")]
    assert abs(mass.mean()) < 0.01
    assert mass.std() == pytest.approx(1.0, abs=0.01)
    assert shifts.capacity_wh.mean() == pytest.approx(vehicle.usable_capacity_wh, rel=1e-3)
    many = np.array([v.usable_capacity_wh for v in sampled_vehicles(vehicle, 5000)])
    assert shifts.capacity_wh.std() == pytest.approx(many.std(), rel=0.03)
    energy, _ = driven(sampled_vehicles(vehicle, 5000), hills, DriveSettings())
    drawn, _ = chain_scatter(vehicle, hills).drawn(shifts.shifts_sd)
    quantiles = (0.02, 0.1, 0.5, 0.9, 0.98)
    spread = energy.sum(axis=1).std()
    off = np.quantile(drawn.sum(axis=1), quantiles) - np.quantile(energy.sum(axis=1), quantiles)
    assert np.abs(off).max() < 0.1 * spread


def test_draws_that_can_be_no_vehicle_are_left_out():
    near = dataclasses.replace(
        car("bmw-i3-60ah"), drive_eff=0.99, recuperation_eff=0.6, sd=MappingProxyType({"drive_eff": 0.02})
    )
    shifts = drawn_shifts(near, 500).shifts_sd[:, 0]
    assert shifts.size == pytest.approx(0.69 * 500, abs=3)  # Φ(0.5)
    assert shifts.max() <= 0.5


def test_blocks_take_what_their_links_take(hills):
    scatter = chain_scatter(car("bmw-i3-60ah"), hills)
    first = np.array([0, 3, 50, 199])
    blocks = scatter.in_blocks(first)
    for b, (begin, end) in enumerate(zip(first, [*first[1:], 200], strict=True)):
        assert blocks.energy_j[b] == pytest.approx(scatter.energy_j[begin:end].sum())
        np.testing.assert_allclose(blocks.energy_terms_j[:, b], scatter.energy_terms_j[:, begin:end].sum(axis=1))
