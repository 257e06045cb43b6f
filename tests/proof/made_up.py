"""Labels and answers by hand, as short as a rule needs them."""

from __future__ import annotations

from proof.answers import Answer, Claim, ClaimedParameter, Spot, TripEnergy
from proof.worlds.world import EffectTruth, OutsideTruth, WorldKind, WorldLabel

FITTED = ("T1", "T2")
HELD_OUT = ("T3", "T4")


def claim(
    family: str, *rivals: str, energy_kwh: float = 1.0, half_kwh: float | None = 0.1, share_frac: float = 0.05
) -> Claim:
    low, high = (None, None) if half_kwh is None else (energy_kwh - half_kwh, energy_kwh + half_kwh)
    return Claim(f"some_{family}", family, rivals, energy_kwh, low, high, share_frac, 5.0)


def trip(
    name: str, *, measured: float = 2.0, before: float = 2.0, after: float = 2.0, nameplate: float = 2.0
) -> TripEnergy:
    return TripEnergy(name, name in HELD_OUT, 1800.0, measured, nameplate, before, after, 0.5)


def answer(
    *claims: Claim,
    spots: tuple[Spot, ...] = (),
    parameters: tuple[str, ...] = (),
    trips: tuple[TripEnergy, ...] | None = None,
    verdict: str = "left_out_physics",
    error: str | None = None,
) -> Answer:
    return Answer(
        world_id="w1",
        tool="t",
        verdict=verdict,
        claims=claims,
        spots=spots,
        parameters=tuple(ClaimedParameter(name, 1.0, 1.1) for name in parameters),
        trips=tuple(trip(name) for name in (*FITTED, *HELD_OUT)) if trips is None else trips,
        error=error,
    )


def effect(family: str, share: float = 0.05, kwh: float = 0.5) -> EffectTruth:
    """An effect that takes so much on each of the four trips."""
    return EffectTruth(family, dict.fromkeys((*FITTED, *HELD_OUT), kwh), share, share, 1.0)


def label(
    kind: WorldKind = WorldKind.SINGLE,
    *families: str,
    share: float = 0.05,
    confounded_with: tuple[str, ...] = (),
    outside: OutsideTruth | None = None,
    changes: dict[str, float] | None = None,
) -> WorldLabel:
    return WorldLabel(
        world_id="w1",
        kind=kind,
        families=tuple(sorted(families)),
        effects={f"true_{family}": effect(family, share) for family in families},
        outside=outside,
        confounded_with=confounded_with,
        parameter_changes=changes or {},
        energy_kwh=dict.fromkeys((*FITTED, *HELD_OUT), 2.0),
    )
