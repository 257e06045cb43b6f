"""What a route is the best by: weights of energy, time and distance."""

from __future__ import annotations

from dataclasses import dataclass

from energy.units import METRE_PER_KM, SECOND_PER_HOUR


@dataclass(frozen=True, slots=True)
class Weights:
    """What a search minimises: energy·[kWh] + time·[h] + distance·[km]; each ≥ 0, not all 0."""

    energy: float = 1.0
    time: float = 0.0
    distance: float = 0.0


ECO = Weights(1.0, 0.0, 0.0)
FASTEST = Weights(0.0, 1.0, 0.0)
SHORTEST = Weights(0.0, 0.0, 1.0)
# one kWh for six minutes: about what a compact car uses in that time in town
BALANCED = Weights(1.0, 10.0, 0.0)
NAMED_WEIGHTS = {"eco": ECO, "fastest": FASTEST, "balanced": BALANCED}


def cost_of(weights: Weights, energy_kwh: float, time_s: float, distance_m: float) -> float:
    """What a weighting minimises."""
    rest = weights.time * time_s / SECOND_PER_HOUR + weights.distance * distance_m / METRE_PER_KM
    return weights.energy * energy_kwh + rest
