"""Worlds and their labels made to order."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from proof.worlds.causes import CAUSES
from proof.worlds.dynamics import Strengths
from proof.worlds.faults import FILE_OFF, FaultKind, driven_by_another, planted, spoiled
from proof.worlds.nameplate import changed, draw_changes, nameplate_of, vehicle_toml
from proof.worlds.outside import OutsideSpot, draw_spot, with_spot
from proof.worlds.scene import draw_scene
from proof.worlds.sensors import ALWAYS, recorded
from proof.worlds.share import SHARE_TOLERANCE, ShareError, energy_share, scaled
from proof.worlds.trips import acted_on, loaded
from proof.worlds.world import (
    EffectTruth,
    World,
    WorldKind,
    WorldLabel,
    WorldRecording,
    by_trip_kwh,
    seed_numbers,
    world_name,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from proof.worlds.dynamics import WorldDrive
    from proof.worlds.orders import WantedEffect, WorldOrder
    from proof.worlds.scene import Scene

ATTEMPTS: Final = 12
# Channels that a logger may have or not, whatever the world hides, so that their being there gives nothing away.
OPTIONAL: Final = (
    ("heading_deg", "lat", "lon"),
    ("battery_c",),
    ("voltage_v", "current_a"),
    ("wet",),
    ("payload_kg",),
    ("wind_speed_mps", "wind_from_deg"),
)
OPTIONAL_CHANCE: Final = 0.4


def worlds(plan: Sequence[WorldOrder], seed: int) -> Iterator[tuple[World, WorldLabel]]:
    """The worlds of a plan in its order, each from a seed of its own but for twins, which share one."""
    for at in range(len(plan)):
        yield world_at(plan, seed, at)


def world_at(plan: Sequence[WorldOrder], seed: int, at: int) -> tuple[World, WorldLabel]:
    """The world at one place of a plan, the same whether or not the others are made."""
    shared = at
    while plan[shared].twin:
        shared -= 1
    return make_world(plan[at], np.random.SeedSequence(entropy=seed, spawn_key=(shared,)))


def make_world(order: WorldOrder, seeds: np.random.SeedSequence) -> tuple[World, WorldLabel]:
    """A world and its label, the same for the same order and seed.

    Where drives turn out not to carry the wanted share of an effect, the next of a few draws is taken; raises
    ShareError after the last.
    """
    key = seed_numbers(seeds)
    for attempt in range(ATTEMPTS):
        own = np.random.SeedSequence(entropy=seeds.entropy, spawn_key=(*seeds.spawn_key, attempt))
        try:
            return _made(order, own, key)
        except ShareError:
            if attempt + 1 == ATTEMPTS:
                raise
    raise AssertionError("unreachable")


def _made(order: WorldOrder, seeds: np.random.SeedSequence, key: tuple[int, ...]) -> tuple[World, WorldLabel]:
    for_scene, for_order, for_sensors = seeds.spawn(3)
    rng = np.random.default_rng(for_order)
    count = int(rng.integers(order.trips[0], order.trips[1] + 1))
    scene = draw_scene(for_scene, order.regime, count, order.extra)
    calm = scene.drive(Strengths())
    spot = None
    if order.outside_axis is not None:
        spot = draw_spot(rng, order.outside_axis, scene, calm)
        scene = with_spot(scene, spot)
    truth, foreign, maker = None, None, scene.car
    if order.fault is not None:
        fault = planted(rng, scene, order.fault)
        scene, truth, foreign = fault.scene, fault.truth, fault.foreign
    strengths = Strengths() if spot is None else Strengths(draw_w=spot.draw_w)
    strengths = _strong_enough(scene.base(), order.effects, strengths)
    nameplate = nameplate_of(maker, calm[: scene.base_trips])
    driven = scene.drive(strengths) if strengths != Strengths() or truth is not None else calm
    if foreign is not None:
        driven = (*driven[:foreign], driven_by_another(rng, scene, foreign), *driven[foreign + 1 :])
    changes = draw_changes(rng) if order.kind is WorldKind.NULL_WRONG_PARAMETERS else {}
    if order.fault is FaultKind.WRONG_FILE:
        changes = draw_changes(rng, FILE_OFF)
    names = _channel_names(rng, order.effects, spot)
    if order.fault is FaultKind.FAHRENHEIT:
        names.add("battery_c")  # without which nobody could doubt the unit
    world_id = world_name(key, order.kind.value, order.twin)
    recordings = _recordings(for_sensors, scene, driven, strengths, names)
    if truth is not None:
        recordings, truth = spoiled(rng, recordings, truth)
    toml = vehicle_toml(changed(nameplate, changes))
    world = World(world_id, order.kind, key, toml, recordings)
    label = _label(world_id, order, scene, strengths, driven, spot, changes)
    return world, replace(label, fault=truth)


def _strong_enough(scene: Scene, effects: Sequence[WantedEffect], others: Strengths) -> Strengths:
    """Strengths at which each effect takes its share, the others being on; a second round settles how they interact."""
    strengths = others
    rounds = (SHARE_TOLERANCE,) if len(effects) < 2 else (0.02, 0.002)
    for tolerance in rounds:
        for wanted in effects:
            cause = CAUSES[wanted.effect]
            without_j = scene.energies_j(_set(strengths, cause.strength, 0.0))

            def share_of(
                strength: float,
                name: str = cause.strength,
                base: Strengths = strengths,
                without: NDArray[np.float64] = without_j,
            ) -> float:
                return energy_share(scene.energies_j(_set(base, name, strength)), without)

            guess = getattr(strengths, cause.strength) or 1.0
            strength = scaled(share_of, wanted.share, cause.most, wanted.effect, guess, tolerance)
            strengths = _set(strengths, cause.strength, strength)
    return strengths


def _set(strengths: Strengths, name: str, value: float) -> Strengths:
    only: dict[str, Any] = {name: value}
    return strengths._replace(**only)


def _channel_names(rng: np.random.Generator, effects: Sequence[WantedEffect], spot: OutsideSpot | None) -> set[str]:
    names = set(ALWAYS)
    for group in OPTIONAL:
        if rng.random() < OPTIONAL_CHANCE:
            names.update(group)
    for wanted in effects:
        names.update(CAUSES[wanted.effect].channels)
        if wanted.effect == "payload_unknown":
            names.discard("payload_kg")
        if wanted.effect == "resistance_unknown":
            names -= {"voltage_v", "current_a"}
        if wanted.effect == "wind_unknown":
            names -= {"wind_speed_mps", "wind_from_deg"}
    if spot is not None:
        names.update(spot.channels)
    return names


def _recordings(
    seeds: np.random.SeedSequence, scene: Scene, driven: Sequence[WorldDrive], strengths: Strengths, names: set[str]
) -> tuple[WorldRecording, ...]:
    seen = loaded(scene.trips, strengths.payload, strengths.wind, strengths.wet_road)
    own = seeds.spawn(len(seen))
    return tuple(
        WorldRecording(trip.id, recorded(np.random.default_rng(seed), scene.sensors, scene.loop, trip, drive, names))
        for seed, trip, drive in zip(own, seen, driven, strict=True)
    )


def _label(
    world_id: str,
    order: WorldOrder,
    scene: Scene,
    strengths: Strengths,
    driven: Sequence[WorldDrive],
    spot: OutsideSpot | None,
    changes: Mapping[str, float],
) -> WorldLabel:
    with_j = np.array([drive.energy_j[0] for drive in driven])
    ids = [trip.id for trip in scene.trips]
    effects = {wanted.effect: _truth(wanted.effect, scene, strengths, with_j) for wanted in order.effects}
    return WorldLabel(
        world_id=world_id,
        kind=order.kind,
        families=tuple(sorted({truth.family for truth in effects.values()})),
        effects=effects,
        outside=None if spot is None else spot.truth(),
        confounded_with=order.confounded_with,
        parameter_changes=dict(changes),
        energy_kwh=by_trip_kwh(ids, with_j),
        separating_trips=tuple(ids[scene.base_trips :]),
    )


def _truth(effect: str, scene: Scene, strengths: Strengths, with_j: NDArray[np.float64]) -> EffectTruth:
    """What an effect did, by driving the same trips once more without it."""
    cause = CAUSES[effect]
    without_j = scene.energies_j(_set(strengths, cause.strength, 0.0))
    ids = [trip.id for trip in scene.trips]
    return EffectTruth(
        family=cause.family,
        energy_kwh=by_trip_kwh(ids, with_j - without_j),
        energy_share=energy_share(with_j, without_j),
        net_share=float(np.sum(with_j - without_j) / np.sum(with_j)),
        strength=getattr(strengths, cause.strength),
        trips=acted_on(effect, scene.trips),
    )
