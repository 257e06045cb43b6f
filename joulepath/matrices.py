"""All drives from many places to many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import LinkModel, StopRule
from energy.units import JOULE_PER_KWH
from joulepath.conditions import conditions_in_si
from joulepath.figures import (
    Feature,
    MapFeatures,
    Snapped,
    feature,
    frozen,
    line,
    number_of,
    one_of,
    point_of,
    snapped_of,
)
from routing.queries import MatrixQuery
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from joulepath.conditions import Conditions
    from joulepath.graph import Graph
    from joulepath.vehicle import Vehicle
    from routing.route.matrix import MatrixEntry
    from routing.weights import Weights

FIGURES: Final = (
    "energy_kwh",
    "battery_kwh",
    "duration_s",
    "distance_m",
    "soc_end_frac",
    "soc_min_frac",
    "deficit_kwh",
)


@dataclass(frozen=True, slots=True, eq=False)
class Matrix(MapFeatures):
    """Figures of all drives, each float64 (sources, targets) and nan where a pair can't be driven.

    reason: "charge" or "no_path" there, None elsewhere. deficit_kwh: what the charge lacks, 0 where it suffices.
    battery_kwh: what the charge fell by, as of a Route. On the map each pair is a straight line from source to target.
    """

    feasible: NDArray[np.bool_]
    energy_kwh: NDArray[np.float64]
    battery_kwh: NDArray[np.float64]
    duration_s: NDArray[np.float64]
    distance_m: NDArray[np.float64]
    soc_end_frac: NDArray[np.float64]
    soc_min_frac: NDArray[np.float64]
    deficit_kwh: NDArray[np.float64]
    reason: tuple[tuple[str | None, ...], ...]
    sources: tuple[Snapped, ...]
    targets: tuple[Snapped, ...]
    warnings: tuple[str, ...]

    def _features(self) -> list[Feature]:
        found = []
        for (s, t), feasible in np.ndenumerate(self.feasible):
            figures = {name: float(getattr(self, name)[s, t]) for name in FIGURES}
            shown = {name: None if np.isnan(value) else value for name, value in figures.items()}
            ends = np.array([place.on_road[::-1] for place in (self.sources[s], self.targets[t])])
            pair = {"source": s, "target": t, "feasible": bool(feasible), "reason": self.reason[s][t]}
            found.append(feature(line(ends), pair | shown))
        return found


def matrix(
    graph: Graph,
    vehicle: Vehicle,
    *,
    sources: Sequence[tuple[float, float]],
    targets: Sequence[tuple[float, float]] | None = None,
    soc_frac: float,
    reserve_soc_frac: float = 0.0,
    weights: Weights = ECO,
    conditions: Conditions | None = None,
    link_model: str = "integrated",
    stops: str = "expected",
) -> Matrix:
    """The drives from each source to each target, places as (lat, lon) [deg]; without targets, among the sources.

    Each drive departs with soc_frac by itself. Rows are searched one after the other.

    Raises QueryError for a value out of range, PointOutsideMapError and PointFarFromRoadError that name the place,
    NegativeCycleError, SearchLimitError.
    """
    query = MatrixQuery(
        sources=tuple(point_of(f"sources[{k}]", place) for k, place in enumerate(sources)),
        targets=tuple(
            point_of(f"targets[{k}]", place) for k, place in enumerate(sources if targets is None else targets)
        ),
        soc_frac=number_of("soc_frac", soc_frac),
        vehicle=vehicle.model,
        reserve_soc_frac=number_of("reserve_soc_frac", reserve_soc_frac),
        weights=weights,
        link_model=one_of("link_model", link_model, LinkModel),
        stop_rule=one_of("stops", stops, StopRule),
        conditions=conditions_in_si(conditions),
    )
    search = graph.planner.matrix(query)
    answer = search.answer([search.row(idx) for idx in np.arange(search.row_count).tolist()])

    def driven(figure: Callable[[MatrixEntry], float]) -> NDArray[np.float64]:
        return frozen(
            [[figure(entry) if entry.reason is None else np.nan for entry in row.entries] for row in answer.rows]
        )

    return Matrix(
        feasible=frozen([[entry.reason is None for entry in row.entries] for row in answer.rows], np.bool_),
        energy_kwh=driven(lambda entry: entry.energy_j / JOULE_PER_KWH),
        battery_kwh=driven(lambda entry: entry.battery_j / JOULE_PER_KWH),
        duration_s=driven(lambda entry: entry.duration_s),
        distance_m=driven(lambda entry: entry.distance_m),
        soc_end_frac=driven(lambda entry: entry.soc_end_frac),
        soc_min_frac=driven(lambda entry: entry.soc_min_frac),
        deficit_kwh=frozen([[_deficit_kwh(entry) for entry in row.entries] for row in answer.rows]),
        reason=tuple(
            tuple(None if entry.reason is None else entry.reason.value for entry in row.entries) for row in answer.rows
        ),
        sources=tuple(map(snapped_of, answer.sources)),
        targets=tuple(map(snapped_of, answer.targets)),
        warnings=answer.warnings,
    )


def _deficit_kwh(entry: MatrixEntry) -> float:
    return float("nan") if entry.reason == "no_path" else entry.deficit_j / JOULE_PER_KWH
