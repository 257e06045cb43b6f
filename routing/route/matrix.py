"""Least-cost drives from many places to many: one search a source, each entry what its route alone would answer."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from energy.battery import soc_along
from energy.chain import kernels_chain
from energy.chain.chain import RULE_CODE, StopRule, filling_energy_j
from energy.units import JOULE_PER_WH
from routing.links.kernels_tables import CRUISE_S
from routing.queries import MatrixQuery, RouteQuery
from routing.route.best_path import Leg
from routing.route.limits import charge_limits, is_best_within
from routing.route.via import CHARGE_SLACK_FRAC, same_place
from routing.search.found import Limits, PathOptions
from routing.search.search import find_path, find_paths
from routing.weights import ECO, Weights

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import LinkPosition, SnappedPoint
    from routing.route.best_path import RouteSearch
    from routing.search.found import FoundPath, SearchCounts
    from routing.search.space import SearchSpace

    SnappedPlace: TypeAlias = tuple[SnappedPoint, tuple[LinkPosition, ...]]  # where it met the road, and there

FEW_TARGETS: Final = 2  # up to which searches directed to each of them take less than one to all of them


class NotDriven(StrEnum):
    """Why a pair of places has no drive: no permitted way leads there, or none that keeps the reserve."""

    NO_PATH = "no_path"
    CHARGE = "charge"


@dataclass(frozen=True, slots=True)
class MatrixEntry:
    """One drive, with the figures of its route; not feasible: that of least energy, with what it lacks [J].

    reason: why it can't be driven. battery_j: that the battery gave, as of Route. Without any way all figures are 0.
    """

    energy_j: float = 0.0
    duration_s: float = 0.0
    distance_m: float = 0.0
    soc_end_frac: float = 0.0
    soc_min_frac: float = 0.0
    deficit_j: float = 0.0
    reason: NotDriven | None = None
    battery_j: float = 0.0


NO_PATH = MatrixEntry(reason=NotDriven.NO_PATH)


@dataclass(frozen=True, slots=True)
class MatrixRow:
    """All drives from one source, and the work that they took.

    alone: entries searched one by one. unproven: those of them that may not be the best, short_by: by how much at most
    one of them costs more than the least. unpaid_j: as of SearchCounts, the most of all searches.
    """

    entries: tuple[MatrixEntry, ...]
    labels_made: int
    labels_settled: int
    seconds: float
    crowded: bool
    alone: int
    unproven: int
    short_by: float
    unpaid_j: float = 0.0


@dataclass(frozen=True, slots=True)
class MatrixAnswer:
    """Rows in the order of the sources, entries in that of the targets."""

    rows: tuple[MatrixRow, ...]
    sources: tuple[SnappedPoint, ...]
    targets: tuple[SnappedPoint, ...]
    warnings: tuple[str, ...]


def route_query(query: MatrixQuery) -> RouteQuery:
    """What every entry's route has in common; its places are those of the first entry."""
    return RouteQuery(
        start=query.sources[0],
        goal=query.targets[0],
        soc_frac=query.soc_frac,
        vehicle=query.vehicle,
        reserve_soc_frac=query.reserve_soc_frac,
        weightings=(("matrix", query.weights),),
        link_model=query.link_model,
        stop_rule=query.stop_rule,
        stop_settings=query.stop_settings,
        conditions=query.conditions,
    )


class MatrixSearch:
    """One matrix, searched row by row; safe to share between threads.

    sources, targets: where each met the roads, and its positions on both directions of its road. warnings: of the
    query, given whether a search was crowded, and the most that is unpaid in one. moved: warnings of places that are
    far off their roads.
    """

    def __init__(
        self,
        search: RouteSearch,
        query: MatrixQuery,
        sources: Sequence[SnappedPlace],
        targets: Sequence[SnappedPlace],
        warnings: Callable[[RouteQuery, bool, float], tuple[str, ...]],
        moved: tuple[str, ...] = (),
    ) -> None:
        self._search, self._weights = search, query.weights
        self._sources, self._targets = sources, [positions for _, positions in targets]
        self._snapped_targets = tuple(point for point, _ in targets)
        self._query, self._warnings, self._moved = route_query(query), warnings, moved
        self._space = search.space_of(self._query, query.vehicle)
        capacity_j = query.vehicle.usable_capacity_wh * JOULE_PER_WH
        self._limits = charge_limits(query.soc_frac, query.reserve_soc_frac, capacity_j)
        self._drives = PathDrives(search.graph, self._space, self._query)

    @property
    def row_count(self) -> int:
        """Rows, one a source."""
        return len(self._sources)

    def row(self, source_idx: int) -> MatrixRow:
        """All drives from one source; raises NegativeCycleError, SearchLimitError."""
        source = self._sources[source_idx][1]
        row = _Row([_stay(self._query)] * len(self._targets))
        there = [k for k, target in enumerate(self._targets) if not same_place(source, target)]
        if self._weights.time == 0.0 and self._weights.distance == 0.0:
            found = self._find(row, source, there, self._weights, self._limits)
            beyond = [k for k in there if found[k] is None]
            self._enter(row, {k: path for k, path in found.items() if path is not None})
        else:
            beyond = self._weighted(row, source, there)
        # beyond the charge, or without any way: that of least energy tells which, and what is missing
        self._enter(row, self._find(row, source, beyond, ECO, Limits()))
        return row.made()

    def answer(self, rows: Sequence[MatrixRow]) -> MatrixAnswer:
        """The answer of all rows, in the order of the sources."""
        crowded, unpaid_j = any(row.crowded for row in rows), max((row.unpaid_j for row in rows), default=0.0)
        warnings = self._warnings(self._query, crowded, unpaid_j) + self._moved
        unproven = sum(row.unproven for row in rows)
        if unproven > 0:
            short_by = max(row.short_by for row in rows)
            warnings += (
                f"{unproven} of {len(rows) * len(self._targets)} entries are good but not proven best: near the "
                f"battery's limits too many ways compare; better ones would cost at most {short_by:.3g} less",
            )
        return MatrixAnswer(tuple(rows), tuple(point for point, _ in self._sources), self._snapped_targets, warnings)

    def _weighted(self, row: _Row, source: tuple[LinkPosition, ...], there: list[int]) -> list[int]:
        """Enter the drives of a weighting of time or distance; the places that no way within the charge leads to."""
        # without limits costs add up, so that one search does; most often its paths keep the limits anyway
        free = self._find(row, source, there, self._weights, Limits())
        kept = {k: path for k, path in free.items() if path is None or self._drives.is_best_within(path, self._limits)}
        self._enter(row, kept)
        tight = [k for k in there if k not in kept]
        thrifty = self._find(row, source, tight, ECO, self._limits)
        for k in tight:
            if thrifty[k] is not None:
                self._enter_alone(row, source, k)
        return [k for k in tight if thrifty[k] is None]

    def _find(
        self, row: _Row, source: tuple[LinkPosition, ...], wanted: list[int], weights: Weights, limits: Limits
    ) -> dict[int, FoundPath | None]:
        """The path to each of the wanted targets, by one search unless they are few."""
        if not wanted:
            return {}
        goals = [self._targets[k] for k in wanted]
        pool, most = self._search.pool, self._search.label_limit
        if len(goals) > FEW_TARGETS:
            paths, counts = find_paths(self._space, pool, weights, limits, source, goals, label_limit=most)
            row.count(counts)
        else:
            options = PathOptions(label_limit=most)
            single = [find_path(self._space, pool, weights, limits, source, goal, options) for goal in goals]
            paths = [path for path, _ in single]
            for _, counts in single:
                row.count(counts)
        return dict(zip(wanted, paths, strict=True))

    def _enter(self, row: _Row, paths: Mapping[int, FoundPath | None]) -> None:
        for k, path in paths.items():
            row.entries[k] = NO_PATH if path is None else self._drives.entry(path)

    def _enter_alone(self, row: _Row, source: tuple[LinkPosition, ...], k: int) -> None:
        """The drive to one target where the battery's limits may bind, by the searches of its route."""
        query = self._query
        leg = Leg(source, self._targets[k], query.soc_frac, query.reserve_soc_frac)
        best = self._search.best_path(query, self._weights, leg)
        row.count(best.counts)
        row.alone += 1
        row.unproven += best.short_by > 0.0
        row.short_by = max(row.short_by, best.short_by)
        row.entries[k] = self._drives.entry(best.path)


class PathDrives:
    """What driving a path takes from departure on: the figures of its route, without its links and parts."""

    def __init__(self, graph: RoadGraph, space: SearchSpace, query: RouteQuery) -> None:
        self._space, self._query = space, query
        self._stop_class = 4 * graph.urban.astype(np.int8) + graph.cross.astype(np.int8)
        self._length_m = graph.length_m
        # as the search sees `counted`
        self._search_rule = StopRule.EXPECTED if query.stop_rule is StopRule.COUNTED else query.stop_rule

    def entry(self, path: FoundPath) -> MatrixEntry:
        """The entry of a path; one that falls below the reserve lacks charge."""
        query = self._query
        energy_j, time_s, distance_m = self._driven(path, query.stop_rule)
        soc, braked_j = soc_along(energy_j, query.soc_frac, query.vehicle.usable_capacity_wh)
        soc_min = float(min(soc.min(), query.soc_frac))
        feasible = soc_min >= query.reserve_soc_frac - CHARGE_SLACK_FRAC
        missing = 0.0 if feasible else query.reserve_soc_frac - soc_min
        return MatrixEntry(
            energy_j=float(energy_j.sum()),
            duration_s=time_s,
            distance_m=distance_m,
            soc_end_frac=float(soc[-1]),
            soc_min_frac=soc_min,
            deficit_j=missing * query.vehicle.usable_capacity_wh * JOULE_PER_WH,
            reason=None if feasible else NotDriven.CHARGE,
            battery_j=float(energy_j.sum() + braked_j.sum()),
        )

    def is_best_within(self, path: FoundPath, limits: Limits) -> bool:
        """Whether a path found without limits surely is the best with them."""
        query = self._query
        energy_j, _, _ = self._driven(path, self._search_rule)
        fades = self._space.physics.fade_width_j > 0.0
        return is_best_within(
            limits,
            energy_j,
            query.soc_frac,
            query.vehicle.usable_capacity_wh,
            energy_weighted=query.weightings[0][1].energy != 0.0,
            accepted_whole_j=(lambda: self._driven(path, self._search_rule, charged=False)[0]) if fades else None,
        )

    def uncharged(self, path: FoundPath) -> tuple[NDArray[np.float64], float, float]:
        """What each link of a path takes as the search sees it whatever the charge, float64 (n,) [J], time, length."""
        return self._driven(path, self._search_rule, charged=False)

    def _driven(
        self, path: FoundPath, rule: StopRule, *, charged: bool = True
    ) -> tuple[NDArray[np.float64], float, float]:
        """Battery energy of each link, float64 (n,) [J], time [s] and length [m] of a path.

        charged: with what a nearly full battery refuses.
        """
        query, arrays = self._query, self._space.arrays
        idx = np.array(path.links, np.int64)
        length_m = self._length_m[idx]
        length_m[-1] = path.goal.offset_m
        length_m[0] -= path.start.offset_m
        links = kernels_chain.ChainLinks(
            arrays.roads[idx],
            length_m,
            arrays.speed_limit_mps[idx],
            arrays.stop_probability_frac[idx],
            self._stop_class[idx],
            arrays.row[idx, CRUISE_S] if arrays.carries else np.empty(0),
        )
        full_j = filling_energy_j(query.soc_frac if charged else None, query.vehicle.usable_capacity_wh)
        driven = kernels_chain.undriven(idx.size, with_parts=False)
        kernels_chain.drive_chain(
            self._space.physics, links, kernels_chain.ChainDrive(RULE_CODE[rule], 0.0, True, full_j), driven
        )
        return driven.energy_j, float(driven.duration_s.sum()), float(length_m.sum())


@dataclass(slots=True)
class _Row:
    """A row while it is searched."""

    entries: list[MatrixEntry]
    labels_made: int = 0
    labels_settled: int = 0
    seconds: float = 0.0
    crowded: bool = False
    alone: int = 0
    unproven: int = 0
    short_by: float = 0.0
    unpaid_j: float = 0.0

    def count(self, counts: SearchCounts) -> None:
        self.labels_made += counts.labels_made
        self.labels_settled += counts.labels_settled
        self.seconds += counts.seconds
        self.crowded |= counts.crowded > 0
        self.unpaid_j = max(self.unpaid_j, counts.unpaid_j)

    def made(self) -> MatrixRow:
        work = (self.labels_made, self.labels_settled, self.seconds)
        return MatrixRow(
            tuple(self.entries), *work, self.crowded, self.alone, self.unproven, self.short_by, self.unpaid_j
        )


def _stay(query: RouteQuery) -> MatrixEntry:
    """The drive from a place to itself."""
    return MatrixEntry(soc_end_frac=query.soc_frac, soc_min_frac=query.soc_frac)
