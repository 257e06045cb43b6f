from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from diagnosis.recordings.reading import read_recording
from energy.replay.replay import replay
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from proof.worlds.causes import CAUSES
from proof.worlds.faults import FaultKind
from proof.worlds.making import make_world, world_at, worlds
from proof.worlds.orders import (
    CONFUSIONS,
    OUTSIDE_AXES,
    WantedEffect,
    WorldOrder,
    confused,
    field_plan,
    single,
    standard_plan,
)
from proof.worlds.trips import WorldRegime
from proof.worlds.world import World, WorldKind, WorldLabel, write_world

if TYPE_CHECKING:
    from pathlib import Path

FEW = (6, 6)
SHORT = WorldRegime(minutes=(12.0, 18.0))


def made(order: WorldOrder, seed: int = 3) -> tuple[World, WorldLabel]:
    return make_world(replace(order, trips=FEW), np.random.SeedSequence(seed))


def replayed(world: World, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Energy of each trip as recorded, and as the nameplate's replay has it [J]."""
    write_world(world, folder)
    vehicle = load_vehicle(folder / "vehicle.toml")
    assert isinstance(vehicle, Vehicle)
    drives = [read_recording(path) for path in sorted(folder.glob("*.csv"))]
    recorded = np.array([drive.energy_j() for drive in drives])
    return recorded, np.array([replay(vehicle, drive.profile()).energy_j for drive in drives])


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_the_nameplate_of_a_null_world_fits_its_drives_to_a_few_percent(tmp_path: Path, seed: int) -> None:
    world, label = make_world(WorldOrder(WorldKind.NULL, trips=(12, 12)), np.random.SeedSequence(seed))
    recorded, modelled = replayed(world, tmp_path)
    assert modelled.sum() == pytest.approx(recorded.sum(), rel=0.03)
    assert np.std(modelled / recorded - 1.0) < 0.06
    assert recorded.sum() / 3.6e6 == pytest.approx(sum(label.energy_kwh.values()), rel=0.015)
    assert (label.families, label.outside, dict(label.parameter_changes)) == ((), None, {})


def test_a_wrong_nameplate_differs_from_the_fitting_one_by_the_labelled_factors(tmp_path: Path) -> None:
    seeds = np.random.SeedSequence(8)
    right, _ = make_world(WorldOrder(WorldKind.NULL, trips=FEW), seeds)
    wrong, label = make_world(WorldOrder(WorldKind.NULL_WRONG_PARAMETERS, trips=FEW), seeds)
    vehicles = []
    for world in (right, wrong):
        write_world(world, tmp_path / world.id)
        vehicles.append(load_vehicle(tmp_path / world.id / "vehicle.toml"))
    assert 2 <= len(label.parameter_changes) <= 4
    for name, factor in label.parameter_changes.items():
        assert 0.03 <= abs(factor - 1.0) <= 0.15
        values = [getattr(vehicle, name) for vehicle in vehicles]
        assert values[1] / values[0] == pytest.approx(factor, rel=2e-3)


@pytest.mark.parametrize("effect", sorted(CAUSES))
def test_a_single_effect_takes_the_wanted_share_of_the_energy(effect: str) -> None:
    share = CAUSES[effect].sizes[1]
    _, label = made(single(effect, share))
    truth = label.effects[effect]
    assert label.families == (CAUSES[effect].family,)
    assert truth.energy_share == pytest.approx(share, rel=1e-3)
    by_trip = np.array([truth.energy_kwh[trip] for trip in label.energy_kwh])
    total = sum(label.energy_kwh.values())
    assert np.abs(by_trip).sum() / total == pytest.approx(truth.energy_share)
    assert by_trip.sum() / total == pytest.approx(truth.net_share)
    assert 0.0 < truth.strength <= CAUSES[effect].most


def test_a_hidden_effect_is_what_the_replay_misses(tmp_path: Path) -> None:
    world, label = make_world(replace(single("cabin_heating", 0.12), trips=(12, 12)), np.random.SeedSequence(5))
    recorded, modelled = replayed(world, tmp_path)
    hidden = np.array(list(label.effects["cabin_heating"].energy_kwh.values())) * 3.6e6
    assert (recorded - modelled).sum() / recorded.sum() == pytest.approx(0.12, abs=0.03)
    assert np.corrcoef(recorded - modelled, hidden)[0, 1] > 0.9


def test_effects_on_some_trips_only_name_them_and_spare_the_rest() -> None:
    _, label = made(single("roof_box", 0.05))
    truth = label.effects["roof_box"]
    spared = [energy for trip, energy in truth.energy_kwh.items() if trip not in truth.trips]
    assert truth.trips
    assert spared == pytest.approx([0.0] * len(spared))
    assert all(truth.energy_kwh[trip] > 0.0 for trip in truth.trips)


def test_several_effects_each_take_their_share() -> None:
    effects = (WantedEffect("cabin_heating", 0.05), WantedEffect("roof_box", 0.05))
    _, label = made(WorldOrder(WorldKind.SEVERAL, effects, regime=WorldRegime(air_c=(-10.0, 20.0))))
    assert label.families == ("aerodynamic", "thermal")
    assert [truth.energy_share for truth in label.effects.values()] == pytest.approx([0.05, 0.05], rel=0.02)


def test_a_separated_twin_is_the_confounded_world_with_more_drives() -> None:
    plan = tuple(replace(order, trips=FEW) for order in confused(CONFUSIONS[0]))
    (world, label), (twin, twin_label) = worlds(plan, 17)
    assert world.vehicle_toml == twin.vehicle_toml
    assert world.id != twin.id
    assert (label.confounded_with, twin_label.confounded_with) == (("rolling",), ())
    strengths = [each.effects["cabin_heating"].strength for each in (label, twin_label)]
    assert strengths[0] == strengths[1]
    more = [recording.id for recording in twin.recordings[len(world.recordings) :]]
    assert twin_label.separating_trips == tuple(more)
    assert len(more) == CONFUSIONS[0].separating_trips
    for first, second in zip(world.recordings, twin.recordings, strict=False):
        assert np.array_equal(first.channels["speed_kmh"], second.channels["speed_kmh"])
        assert np.array_equal(first.channels["power_w"], second.channels["power_w"])


def test_confounded_cars_do_not_stand_and_the_separating_drives_do() -> None:
    _, twin_order = confused(CONFUSIONS[0])
    world, label = made(twin_order)
    stands = {
        recording.id: int(np.count_nonzero(recording.channels["speed_kmh"] == 0.0)) for recording in world.recordings
    }
    longest = max(seconds for trip, seconds in stands.items() if trip not in label.separating_trips)
    assert longest < 60 < min(stands[trip] for trip in label.separating_trips)


@pytest.mark.parametrize("axis", OUTSIDE_AXES)
def test_an_outside_draw_is_labelled_with_its_place_and_size(axis: str) -> None:
    world, label = made(WorldOrder(WorldKind.OUTSIDE, regime=WorldRegime(together=axis == "place"), outside_axis=axis))
    assert label.outside is not None
    assert (label.outside.axis, label.families) == (axis, ())
    assert 400.0 <= label.outside.mean_w <= 6000.0
    if axis == "place":
        nearest = min(np.abs(recording.channels["lat"] - label.outside.low).min() for recording in world.recordings)
        assert nearest < 0.01
    else:
        assert label.outside.low < label.outside.high


def test_few_trips_are_three_to_five() -> None:
    order = next(order for order in standard_plan(nulls=0, singles=0, pairs=0) if order.kind is WorldKind.FEW_TRIPS)
    assert 3 <= len(make_world(order, np.random.SeedSequence(2))[0].recordings) <= 5


def test_the_same_seed_gives_the_same_world_and_another_a_different_one() -> None:
    plan = (WorldOrder(WorldKind.NULL, trips=FEW, regime=SHORT), WorldOrder(WorldKind.NULL, trips=FEW, regime=SHORT))
    first, again, other = (tuple(worlds(plan, seed)) for seed in (5, 5, 6))
    assert [label for _, label in first] == [label for _, label in again]
    assert all(
        np.array_equal(a.channels["power_w"], b.channels["power_w"])
        for (world, _), (world_again, _) in zip(first, again, strict=True)
        for a, b in zip(world.recordings, world_again.recordings, strict=True)
    )
    made_worlds = [world for world, _ in (*first, *other)]
    assert len({world.id for world in made_worlds}) == 4
    assert len({world.vehicle_toml for world in made_worlds}) == 4
    assert len({world.recordings[0].channels["speed_kmh"].tobytes() for world in made_worlds}) == 4


def test_a_world_is_the_same_made_alone_or_with_the_others() -> None:
    plan = (
        WorldOrder(WorldKind.NULL, trips=FEW, regime=SHORT),
        WorldOrder(WorldKind.NULL_WRONG_PARAMETERS, trips=FEW, regime=SHORT),
    )
    assert world_at(plan, 9, 1)[1] == tuple(worlds(plan, 9))[1][1]


def test_the_standard_plan_has_every_kind_size_and_axis() -> None:
    plan = standard_plan()
    kinds = Counter(order.kind for order in plan)
    assert kinds[WorldKind.NULL] >= 100
    assert set(kinds) == set(WorldKind) - {WorldKind.FASTSIM, WorldKind.CARRIER, WorldKind.FAULT}
    assert {order.fault for order in field_plan()} == set(FaultKind)
    assert kinds[WorldKind.CONFOUNDED] == kinds[WorldKind.CONFOUNDED_SEPARATED]
    assert {order.outside_axis for order in plan} == {None, *OUTSIDE_AXES}
    singles = {(CAUSES[w.effect].family, w.share) for o in plan if o.kind is WorldKind.SINGLE for w in o.effects}
    assert singles == {(cause.family, share) for cause in CAUSES.values() for share in cause.sizes}
    assert all(
        wanted.share in CAUSES[wanted.effect].sizes for o in plan if o.kind is WorldKind.SINGLE for wanted in o.effects
    )
