from __future__ import annotations

import numpy as np
import pytest

from proof.worlds.carriers import Carrier, CarrierVehicle, carrier_world
from proof.worlds.making import make_world
from proof.worlds.orders import WantedEffect, WorldOrder
from proof.worlds.share import ShareError
from proof.worlds.trips import WorldRegime
from proof.worlds.world import WorldKind

VEHICLE = CarrierVehicle(mass_kg=1300.0, drag_area_m2=0.7, capacity_kwh=30.0, vehicle_toml="id = 'vehicle'\n")
CHANNELS = ("time_s", "speed_kmh", "power_w", "elevation_m", "ambient_c")


@pytest.fixture(scope="module")
def carriers() -> tuple[Carrier, ...]:
    """Recordings of another world, standing in for real ones."""
    regime = WorldRegime(minutes=(10.0, 14.0), air_c=(-5.0, 10.0))
    world, _ = make_world(WorldOrder(WorldKind.NULL, trips=(4, 4), regime=regime), np.random.SeedSequence(31))
    return tuple(
        Carrier(recording.id, {name: recording.channels[name] for name in CHANNELS}) for recording in world.recordings
    )


def test_a_carried_effect_adds_the_wanted_share_to_the_recorded_power(carriers: tuple[Carrier, ...]) -> None:
    world, label = carrier_world(VEHICLE, carriers, WantedEffect("cabin_heating", 0.08), np.random.SeedSequence(1))
    truth = label.effects["cabin_heating"]
    assert truth.energy_share == pytest.approx(0.08, rel=1e-3)
    for before, after in zip(carriers, world.recordings, strict=True):
        added_w = after.channels["power_w"] - before.channels["power_w"]
        assert np.trapezoid(added_w, before.channels["time_s"]) / 3.6e6 == pytest.approx(truth.energy_kwh[before.id])
        assert added_w[1:20].min() > 0.0  # while still standing
        assert set(after.channels) == set(CHANNELS)


def test_a_carried_effect_on_forces_leaves_standstill_as_it_was(carriers: tuple[Carrier, ...]) -> None:
    world, _ = carrier_world(VEHICLE, carriers, WantedEffect("tyre_temperature", 0.04), np.random.SeedSequence(2))
    added_w = world.recordings[0].channels["power_w"] - carriers[0].channels["power_w"]
    moving = carriers[0].channels["speed_kmh"] > 30.0
    first_move = int(np.argmax(carriers[0].channels["speed_kmh"] > 0.0))
    assert added_w[: first_move - 3] == pytest.approx(0.0, abs=1e-6)
    assert added_w[moving].mean() > 50.0


def test_a_carried_effect_brings_the_channels_that_show_it(carriers: tuple[Carrier, ...]) -> None:
    world, _ = carrier_world(VEHICLE, carriers, WantedEffect("wet_road", 0.02), np.random.SeedSequence(6))
    assert all("wet" in recording.channels for recording in world.recordings)


def test_carriers_without_an_effect_stay_as_recorded(carriers: tuple[Carrier, ...]) -> None:
    world, label = carrier_world(VEHICLE, carriers, None, np.random.SeedSequence(3))
    assert label.families == ()
    for before, after in zip(carriers, world.recordings, strict=True):
        assert np.array_equal(before.channels["power_w"], after.channels["power_w"])


def test_an_effect_that_these_drives_cannot_carry_is_refused(carriers: tuple[Carrier, ...]) -> None:
    with pytest.raises(ShareError, match="share of air_conditioning"):
        carrier_world(VEHICLE, carriers, WantedEffect("air_conditioning", 0.12), np.random.SeedSequence(4))


def test_no_carriers_are_refused() -> None:
    with pytest.raises(ValueError, match="carriers is empty"):
        carrier_world(VEHICLE, (), None, np.random.SeedSequence(5))
