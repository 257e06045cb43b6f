"""What the field does to a world is what its label says, and nothing else differs from the world without it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from proof.worlds.faults import COARSE_S, FaultKind
from proof.worlds.making import make_world
from proof.worlds.orders import WorldOrder
from proof.worlds.trips import WorldRegime
from proof.worlds.world import World, WorldKind, WorldLabel

if TYPE_CHECKING:
    from numpy.typing import NDArray

SHORT = WorldRegime(minutes=(6.0, 8.0), air_c=(0.0, 15.0))


def made(fault: FaultKind | None, seed: int = 5) -> tuple[World, WorldLabel]:
    kind = WorldKind.NULL if fault is None else WorldKind.FAULT
    return make_world(WorldOrder(kind, (), (16, 16), SHORT, fault=fault), np.random.SeedSequence(seed))


def power_w(world: World, trip: str) -> NDArray[np.float64]:
    return next(recording.channels["power_w"] for recording in world.recordings if recording.id == trip)


def test_a_draw_that_is_left_on_is_on_its_trips_alone() -> None:
    plain, (world, label) = made(None)[0], made(FaultKind.SWITCH)
    assert label.fault is not None
    assert label.families == ()
    for recording in world.recordings:
        more_w = float(np.mean(recording.channels["power_w"] - power_w(plain, recording.id)))
        expected = label.fault.size if recording.id in label.fault.trips else 0.0
        assert more_w == pytest.approx(expected, abs=0.06 * label.fault.size)


def test_tyres_that_were_changed_are_on_all_later_trips() -> None:
    world, label = made(FaultKind.STEP)
    assert label.fault is not None
    ids = [recording.id for recording in world.recordings]
    assert label.fault.trips == tuple(ids[-len(label.fault.trips) :])
    assert 0.3 * len(ids) <= len(label.fault.trips) <= 0.7 * len(ids)
    before = made(None)[1].energy_kwh
    more = {trip: label.energy_kwh[trip] / before[trip] - 1.0 for trip in ids}
    assert all(0.01 < more[trip] < 0.6 for trip in label.fault.trips)
    assert all(more[trip] == pytest.approx(0.0, abs=1e-9) for trip in ids if trip not in label.fault.trips)


def test_one_trip_is_driven_by_another_car() -> None:
    world, label = made(FaultKind.FOREIGN)
    plain, before = made(None)
    assert label.fault is not None
    (foreign,) = label.fault.trips
    for recording in world.recordings:
        same = np.array_equal(recording.channels["power_w"], power_w(plain, recording.id))
        assert same is (recording.id != foreign)
    assert label.energy_kwh[foreign] != pytest.approx(before.energy_kwh[foreign], rel=0.01)


def test_heights_are_gone_and_samples_are_rare() -> None:
    assert all("elevation_m" not in recording.channels for recording in made(FaultKind.NO_HEIGHT)[0].recordings)
    world, label = made(FaultKind.COARSE)
    assert label.fault is not None
    assert label.fault.size in COARSE_S
    assert {float(np.diff(recording.channels["time_s"])[0]) for recording in world.recordings} == {label.fault.size}


def test_some_temperatures_are_in_fahrenheit_and_could_be_read() -> None:
    world, label = made(FaultKind.FAHRENHEIT)
    plain, _ = made(None)
    assert label.fault is not None
    assert len(label.fault.trips) >= 3
    for recording, other in zip(world.recordings, plain.recordings, strict=True):
        air, own = other.channels["ambient_c"], recording.channels["ambient_c"]
        assert "battery_c" in recording.channels
        if recording.id in label.fault.trips:
            np.testing.assert_allclose(own, 1.8 * air + 32.0, atol=0.51)
            assert own.max() < 56.0
        else:
            np.testing.assert_array_equal(own, air)


def test_a_wrong_file_is_off_by_a_tenth_to_a_quarter() -> None:
    _, label = made(FaultKind.WRONG_FILE)
    assert 2 <= len(label.parameter_changes) <= 4
    assert all(0.1 <= abs(factor - 1.0) <= 0.25 for factor in label.parameter_changes.values())


def test_an_aged_battery_holds_less_than_its_file_and_its_charge_falls_faster() -> None:
    world, label = made(FaultKind.AGED)
    plain, _ = made(None)
    assert label.fault is not None
    assert 0.75 <= label.fault.size <= 0.92
    assert world.vehicle_toml == plain.vehicle_toml
    fall, before = (
        sum(
            float(recording.channels["soc_frac"][0] - recording.channels["soc_frac"][-1])
            for recording in each.recordings
        )
        for each in (world, plain)
    )
    assert before / fall == pytest.approx(label.fault.size, rel=0.05)
    steps = {round(float(step), 9) for each in world.recordings for step in np.abs(np.diff(each.channels["soc_frac"]))}
    assert min(steps - {0.0}) in (0.005, 0.01)
