"""What worlds a proof is made of: kinds, effects, sizes, regimes, and which worlds are twins."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from proof.worlds.causes import CAUSES
from proof.worlds.faults import FaultKind
from proof.worlds.loop import LoopTerrain
from proof.worlds.trips import WorldRegime
from proof.worlds.world import WorldKind

if TYPE_CHECKING:
    from collections.abc import Iterator

SIZES: Final = (0.02, 0.05, 0.12)
OUTSIDE_AXES: Final = ("altitude", "place", "speed", "time_of_trip", "soc", "heading")
FAMILIES: Final = ("thermal", "rolling", "aerodynamic", "wind", "mass", "drivetrain", "recuperation", "battery")
SEVERAL: Final = (
    ("cabin_heating", "roof_box"),
    ("tyre_temperature", "regen_cap"),
    ("cabin_heating", "payload_known"),
    ("wet_road", "wind_known"),
    ("air_conditioning", "copper_loss"),
    ("cabin_heating", "wet_road", "wind_known"),
    ("tyre_temperature", "cabin_heating", "regen_cold"),
    ("battery_conditioning", "roof_box", "payload_known"),
)


@dataclass(frozen=True, slots=True)
class WantedEffect:
    """An effect that a world is to hide, and the share of the energy that it is to take."""

    effect: str
    share: float


@dataclass(frozen=True, slots=True)
class WorldOrder:
    """One world to be made. twin: made from the seed of the world before it, so that only what is ordered differs."""

    kind: WorldKind
    effects: tuple[WantedEffect, ...] = ()
    trips: tuple[int, int] = (24, 40)
    regime: WorldRegime = field(default_factory=WorldRegime)
    extra: tuple[WorldRegime, int] | None = None
    confounded_with: tuple[str, ...] = ()
    outside_axis: str | None = None
    twin: bool = False
    fault: FaultKind | None = None


@dataclass(frozen=True, slots=True)
class Confusion:
    """Two causes that the base regime cannot distinguish, and the regime of the drives that can."""

    effect: str
    share: float
    rival_families: tuple[str, ...]
    regime: WorldRegime
    separating: WorldRegime
    separating_trips: int = 10


# Nobody stands, nobody restarts, one speed: heat and stiff tyres are both a draw that falls with warmth and time.
_ROLLING_ON: Final = WorldRegime(
    mix=(0.0, 1.0, 0.0),
    steady_kmh=80.0,
    air_c=(-10.0, 15.0),
    start_wait_s=(1.0, 2.0),
    long_wait_chance=0.0,
    restart_chance=0.0,
    terrain=LoopTerrain(grade_sd=0.006),
)
_STANDING: Final = replace(
    _ROLLING_ON, mix=(0.6, 0.4, 0.0), steady_kmh=None, start_wait_s=(60.0, 300.0), long_wait_chance=1.0,
    long_wait_s=(240.0, 600.0), restart_chance=0.5,
)  # fmt: skip
_MOTORWAY_ON: Final = replace(_ROLLING_ON, mix=(0.0, 0.0, 1.0), steady_kmh=110.0, air_c=(-10.0, 35.0))
_ALL_SPEEDS: Final = replace(_MOTORWAY_ON, mix=(0.6, 0.2, 0.2), steady_kmh=None, start_wait_s=(5.0, 45.0))
_RESTARTS: Final = replace(
    _ROLLING_ON, restart_chance=1.0, start_wait_s=(30.0, 200.0), long_wait_chance=0.7, long_wait_s=(120.0, 400.0)
)

CONFUSIONS: Final = (
    Confusion("cabin_heating", 0.12, ("rolling",), _ROLLING_ON, _STANDING),
    Confusion("tyre_temperature", 0.1, ("thermal",), _ROLLING_ON, _STANDING),
    Confusion("air_density", 0.03, ("rolling",), _MOTORWAY_ON, _ALL_SPEEDS, 14),
    Confusion("tyre_temperature", 0.04, ("aerodynamic",), _MOTORWAY_ON, _ALL_SPEEDS, 14),
    Confusion("cabin_heating", 0.06, ("rolling",), _ROLLING_ON, _RESTARTS),
)


def single(effect: str, share: float, **regime: Any) -> WorldOrder:
    """An order for one effect of one size in the regime that shows it."""
    cause = CAUSES[effect]
    return WorldOrder(
        WorldKind.SINGLE,
        (WantedEffect(effect, share),),
        regime=replace(WorldRegime(), **{**cause.regime_for(share), **regime}),
    )


def confused(confusion: Confusion) -> tuple[WorldOrder, WorldOrder]:
    """Orders for a confounded world and for its twin with the separating drives."""
    effects = (WantedEffect(confusion.effect, confusion.share),)
    families = tuple(sorted({CAUSES[confusion.effect].family, *confusion.rival_families}))
    rivals = tuple(family for family in families if family != CAUSES[confusion.effect].family)
    plain = WorldOrder(WorldKind.CONFOUNDED, effects, regime=confusion.regime, confounded_with=rivals)
    separated = replace(
        plain,
        kind=WorldKind.CONFOUNDED_SEPARATED,
        confounded_with=(),
        extra=(confusion.separating, confusion.separating_trips),
        twin=True,
    )
    return plain, separated


def standard_plan(
    *,
    nulls: int = 170,
    wrong: int = 60,
    singles: int = 6,
    several: int = 3,
    pairs: int = 6,
    outside: int = 7,
    few: int = 20,
) -> tuple[WorldOrder, ...]:
    """The whole proof: so many worlds of each kind; singles: a family and size; several: a combination.

    pairs: a confusion; outside: an axis.
    """
    orders = [WorldOrder(WorldKind.NULL) for _ in range(nulls)]
    orders += [WorldOrder(WorldKind.NULL_WRONG_PARAMETERS) for _ in range(wrong)]
    orders += list(_singles(singles))
    for names in SEVERAL:
        orders += [_several(names) for _ in range(several)]
    for confusion in CONFUSIONS:
        for _ in range(pairs):
            orders += confused(confusion)
    for axis in OUTSIDE_AXES:
        orders += [_outside(axis) for _ in range(outside)]
    orders += [_few(k) for k in range(few)]
    return tuple(orders)


def small_plan() -> tuple[WorldOrder, ...]:
    """A proof in small: a world or two of each kind, for a machine that checks every change."""
    return (
        *standard_plan(nulls=3, wrong=1, singles=0, several=0, pairs=0, outside=0, few=1),
        single("cabin_heating", 0.12),
        single("roof_box", 0.12),
        _several(SEVERAL[2]),
        *confused(CONFUSIONS[0]),
        _outside("speed"),
        WorldOrder(WorldKind.FAULT, fault=FaultKind.SWITCH),
        WorldOrder(WorldKind.FAULT, fault=FaultKind.NO_HEIGHT),
    )


def field_plan(each: int = 15) -> tuple[WorldOrder, ...]:
    """What the field has: so many worlds of each fault, and drives without height whose cabin is heated."""
    orders = [WorldOrder(WorldKind.FAULT, fault=kind) for kind in FaultKind for _ in range(each)]
    heated = (WantedEffect("cabin_heating", 0.12),)
    cold = replace(WorldRegime(), air_c=(-12.0, 24.0))
    return (
        *orders,
        *(WorldOrder(WorldKind.FAULT, heated, regime=cold, fault=FaultKind.NO_HEIGHT) for _ in range(each // 2)),
    )


def _singles(each: int) -> Iterator[WorldOrder]:
    for family in FAMILIES:
        for size in SIZES:
            able = [cause.name for cause in CAUSES.values() if cause.family == family and size in cause.sizes]
            for k in range(each if able else 0):
                yield single(able[k % len(able)], size)


def _several(names: tuple[str, ...]) -> WorldOrder:
    air_c = (5.0, 38.0) if "air_conditioning" in names else (-12.0, 24.0)
    regime = replace(WorldRegime(), air_c=air_c, payload_share=0.6)
    return WorldOrder(WorldKind.SEVERAL, tuple(WantedEffect(name, 0.05) for name in names), regime=regime)


def _outside(axis: str) -> WorldOrder:
    regime = WorldRegime(together=axis == "place")
    if axis == "altitude":
        regime = replace(regime, terrain=LoopTerrain(400.0, 500.0, 0.018))
    return WorldOrder(WorldKind.OUTSIDE, regime=regime, outside_axis=axis)


def _few(k: int) -> WorldOrder:
    effects = (WantedEffect("cabin_heating", 0.05),) if k % 2 else ()
    regime = WorldRegime(air_c=(-10.0, 20.0)) if effects else WorldRegime()
    return WorldOrder(WorldKind.FEW_TRIPS, effects, (3, 5), regime)
