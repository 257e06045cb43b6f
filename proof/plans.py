"""Which worlds a proof is made of, and how each is made from a seed of its own."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from proof.carriers import carrier_vehicle, carriers_of
from proof.source import OF_THE_WORLDS, source_hash
from proof.worlds.carriers import carrier_world
from proof.worlds.fastsim_worlds import FastsimOrder, fastsim_world
from proof.worlds.making import make_world
from proof.worlds.orders import WantedEffect, WorldOrder, field_plan, small_plan, standard_plan
from proof.worlds.share import ShareError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from proof.carriers import Carried
    from proof.worlds.world import World, WorldLabel

ATTEMPTS: Final = 5
AGAIN: Final = 100_000
FASTSIM_EACH: Final = 5
CARRIED_SHARE: Final = 0.05
CARRIED_EFFECTS: Final = ("wet_road", "payload_known", "wind_known", "copper_loss", "roof_box")


@dataclass(frozen=True, slots=True)
class CarrierOrder:
    """Real drives with an effect added to their power, or as they are."""

    folder: Path
    vehicle: Path
    wanted: WantedEffect | None


AnyOrder = WorldOrder | FastsimOrder | CarrierOrder


@dataclass(frozen=True, slots=True)
class PlannedWorld:
    """One world of a plan: what is ordered, and the seed that it is made from."""

    order: AnyOrder
    entropy: int
    key: tuple[int, ...]

    def seeds(self, attempt: int = 0) -> np.random.SeedSequence:
        """What the world is drawn from."""
        more = (AGAIN + attempt,) if attempt else ()  # apart from the seeds that a maker spawns itself
        return np.random.SeedSequence(entropy=self.entropy, spawn_key=(*self.key, *more))

    def digest(self) -> str:
        """SHA-256 of what makes the world: order, seed and the source of the makers."""
        return hashlib.sha256(repr((self, source_hash(OF_THE_WORLDS))).encode()).hexdigest()


def full_plan(carriers: Path | None = None, vehicle: Path | None = None) -> tuple[AnyOrder, ...]:
    """The whole proof; with a folder of real drives and their vehicle's file also those as carriers."""
    plan: tuple[AnyOrder, ...] = (*standard_plan(pairs=5, few=12), *field_plan())
    plan += (FastsimOrder(climate=True),) * FASTSIM_EACH + (FastsimOrder(climate=False),) * FASTSIM_EACH
    if carriers is not None and vehicle is not None:
        wanted = (None, *(WantedEffect(name, CARRIED_SHARE) for name in CARRIED_EFFECTS))
        plan += tuple(CarrierOrder(carriers, vehicle, effect) for effect in wanted)
    return plan


def places(plan: Sequence[AnyOrder], seed: int) -> tuple[PlannedWorld, ...]:
    """Each world with its seed: its place in the plan, or for a twin that of the world before it."""
    found: list[PlannedWorld] = []
    for at, order in enumerate(plan):
        twin = isinstance(order, WorldOrder) and order.twin
        found.append(PlannedWorld(order, seed, found[-1].key if twin else (at,)))
    return tuple(found)


def made(place: PlannedWorld) -> tuple[World, WorldLabel]:
    """The world of a place and its label, the same whenever it is made; drives that can't carry it are drawn anew.

    Raises ModuleNotFoundError where fastsim is ordered and not installed, ShareError where no drives could carry what
    is ordered.
    """
    for attempt in range(ATTEMPTS):
        try:
            return _made(place.order, place.seeds(attempt))
        except ShareError:
            if attempt + 1 == ATTEMPTS:
                raise
    raise AssertionError("unreachable")


def _made(order: AnyOrder, seeds: np.random.SeedSequence) -> tuple[World, WorldLabel]:
    if isinstance(order, FastsimOrder):
        return fastsim_world(order, seeds)
    if isinstance(order, CarrierOrder):
        return carrier_world(carrier_vehicle(order.vehicle), _carried(order.folder), order.wanted, seeds)
    return make_world(order, seeds)


@lru_cache(maxsize=1)
def _carried(folder: Path) -> Carried:
    return carriers_of(folder)


__all__ = ["AnyOrder", "CarrierOrder", "PlannedWorld", "full_plan", "made", "places", "small_plan"]
