"""What a route query must satisfy before it is searched."""

from __future__ import annotations

from typing import TYPE_CHECKING

from routing.errors import QueryError
from routing.queries import EPSILON_RANGE, MOST_RANGE

if TYPE_CHECKING:
    from routing.queries import ParetoSettings
    from routing.weights import Weights


def check_charge(soc_frac: float, reserve_frac: float) -> None:
    """Raise QueryError unless 0 ≤ reserve ≤ charge ≤ 1."""
    if not 0.0 <= soc_frac <= 1.0:
        raise QueryError("soc_frac", soc_frac, "0..1")
    if not 0.0 <= reserve_frac <= soc_frac:
        raise QueryError("reserve_soc_frac", reserve_frac, f"0..{soc_frac} (soc_frac)")


def check_pareto(settings: ParetoSettings) -> None:
    """Raise QueryError where ε or the number of routes is out of range."""
    if not EPSILON_RANGE[0] <= settings.epsilon_frac <= EPSILON_RANGE[1]:
        low, high = EPSILON_RANGE
        raise QueryError("pareto.epsilon_frac", settings.epsilon_frac, f"{low:g}..{high:g}")
    if not MOST_RANGE[0] <= settings.most <= MOST_RANGE[1]:
        low, high = MOST_RANGE
        raise QueryError("pareto.most", settings.most, f"{low}..{high}")


def check_weights(name: str, weights: Weights) -> None:
    """Raise QueryError unless each weight is in 0..1e6 and one is above 0."""
    values = (weights.energy, weights.time, weights.distance)
    for field, value in zip(("energy", "time", "distance"), values, strict=True):
        if not 0.0 <= value <= 1e6:
            raise QueryError(f"weights.{field} ({name})", value, "0..1e6")
    if max(values) == 0.0:
        raise QueryError(f"weights ({name})", values, "at least one above 0")
