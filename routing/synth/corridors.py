"""Which way roads take through the terrain: least-cost corridors between settlements on a grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from energy.stops import FunctionalClass
from routing.synth.settlements import Rank
from routing.synth.terrain import NEIGHBOURS, fractal_field

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.synth.settlements import Settlements
    from routing.synth.terrain import Landscape

GRID_CELLS: Final = 2_400_000
GRID_CELL_M: Final = (200.0, 500.0)
REUSE_COST: Final = 0.33  # cost on an existing road, relative to open land (assumed)
BESIDE_COST: Final = 1.7  # cost right beside an existing road, so that new roads join it
SHORTCUT: Final = 0.82  # a direct corridor is built unless a detour's longer half costs less than this share of it
# grade that a road of the class follows without winding (assumed)
EASY_GRADE: Final = {
    FunctionalClass.MOTORWAY: 0.045,
    FunctionalClass.TRUNK: 0.06,
    FunctionalClass.PRIMARY: 0.07,
    FunctionalClass.SECONDARY: 0.08,
    FunctionalClass.TERTIARY: 0.09,
    FunctionalClass.UNCLASSIFIED: 0.10,
}
STEEPNESS_POWER: Final = 2.0  # above 1 a road rather traverses a slope than climbs straight up in serpentines (assumed)
MOTORWAY_CAP: Final = 7.0  # a tunnel costs at most that many times the open road (assumed)


@dataclass(frozen=True, slots=True)
class Corridors:
    """Steps between neighbouring grid cells that carry a road.

    cell_a, cell_b: int64 (k,) flat cell indices, a < b; functional_class: int8 (k,); cols, cell_m: the grid's layout.
    """

    cell_a: NDArray[np.int64]
    cell_b: NDArray[np.int64]
    functional_class: NDArray[np.int8]
    cols: int
    cell_m: float


class _Grid:
    """Eight-neighbour grid whose step costs change from one road class to the next."""

    def __init__(self, land: Landscape, rng: np.random.Generator) -> None:
        cell_m = float(np.clip(np.sqrt(land.extent_x_m * land.extent_y_m / GRID_CELLS), *GRID_CELL_M))
        self.rows, self.cols = round(land.extent_y_m / cell_m), round(land.extent_x_m / cell_m)
        self.cell_m = land.extent_x_m / self.cols
        rows, cols = self.rows, self.cols
        y, x = np.divmod(np.arange(rows * cols), cols)
        height = land.sample_m((x + 0.5) * self.cell_m, (y + 0.5) * (land.extent_y_m / rows)).reshape(rows, cols)
        height = ndimage.gaussian_filter(height, 0.6)
        noise = np.exp(0.38 * fractal_field((rows, cols), self.cell_m, 1_800.0, rng, decay=1.6))
        count = rows * cols
        own = np.arange(count, dtype=np.int32).reshape(rows, cols)
        self.target = np.zeros((count, 8), np.int32)
        self.valid = np.zeros((count, 8), bool)
        self.grade = np.zeros((count, 8), np.float32)
        self.length = np.zeros((count, 8), np.float32)
        for k, (dy, dx) in enumerate(NEIGHBOURS):
            a = (slice(max(0, -dy), rows - max(0, dy)), slice(max(0, -dx), cols - max(0, dx)))
            b = (slice(max(0, dy), rows - max(0, -dy)), slice(max(0, dx), cols - max(0, -dx)))
            from_cell = own[a].ravel()
            step_m = self.cell_m * float(np.hypot(dy, dx))
            self.target[from_cell, k] = own[b].ravel()
            self.valid[from_cell, k] = True
            self.grade[from_cell, k] = np.abs(height[b] - height[a]).ravel() / step_m
            self.length[from_cell, k] = step_m * np.sqrt(noise[a] * noise[b]).ravel()
        self.indptr = np.concatenate(([0], np.cumsum(self.valid.sum(axis=1)))).astype(np.int32)
        self.indices = self.target[self.valid]
        self.reuse = np.zeros((count, 8), bool)
        self.road = np.zeros(count, bool)
        self.avoid = np.zeros(count, bool)

    def cell_at(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.int64]:
        col = np.clip((x_m / self.cell_m).astype(np.int64), 0, self.cols - 1)
        row = np.clip((y_m / self.cell_m).astype(np.int64), 0, self.rows - 1)
        cell: NDArray[np.int64] = row * self.cols + col
        return cell

    def costs(self, road_class: FunctionalClass) -> csr_array:
        ratio = self.grade / np.float32(EASY_GRADE[road_class])
        factor = np.maximum(ratio, 1.0) ** STEEPNESS_POWER + 0.25 * np.minimum(ratio, 1.0) ** 2
        if road_class == FunctionalClass.MOTORWAY:
            factor = np.minimum(1.0 + 0.8 * ratio**2, MOTORWAY_CAP) * np.where(
                self.avoid[:, None] | self.avoid[self.target], 8.0, 1.0
            )
        else:
            near = ndimage.binary_dilation(self.road.reshape(self.rows, self.cols), np.ones((3, 3), bool)).ravel()
            beside = near[:, None] & near[self.target] & ~self.reuse
            factor = factor * np.where(self.reuse, REUSE_COST, np.where(beside, BESIDE_COST, 1.0))
        data = (self.length * factor)[self.valid].astype(np.float64)
        count = self.rows * self.cols
        return csr_array((data, self.indices, self.indptr), shape=(count, count))

    def mark(self, cell_a: NDArray[np.int64], cell_b: NDArray[np.int64]) -> None:
        for near, far in ((cell_a, cell_b), (cell_b, cell_a)):
            k = np.argmax(self.target[near] == far[:, None], axis=1)
            self.reuse[near, k] = True
            self.road[near] = True


def find_corridors(land: Landscape, places: Settlements, rng: np.random.Generator) -> tuple[Corridors, Corridors]:
    """Motorway corridors and those of all other roads, from the most important class to the least.

    Each class links its settlements to the neighbours whose territories (by travel cost) touch theirs; existing roads
    are cheap to reuse, so that new ones branch off them. O(classes · cells · log cells).
    """
    grid = _Grid(land, rng)
    cell = grid.cell_at(places.x_m, places.y_m)
    radius_m = 60.0 * np.sqrt(places.streets + 4.0)
    grid.avoid = _near_cells(grid, places.x_m, places.y_m, radius_m + 250.0)
    city = cell[places.rank == Rank.CITY]
    gateway = _gateways(grid, land, places, radius_m, rng)
    motorway = _territory_links(grid, FunctionalClass.MOTORWAY, gateway, 0.97, keep_share=0.75)
    a, b = motorway
    motorways = _as_corridors(grid, [(a, b, FunctionalClass.MOTORWAY)])

    built: list[tuple[NDArray[np.int64], NDArray[np.int64], FunctionalClass]] = []
    village = np.flatnonzero(places.rank == Rank.VILLAGE)
    market = village[: village.size // 3]
    plans = (
        (FunctionalClass.TRUNK, city, 0.9),
        (FunctionalClass.PRIMARY, cell[places.rank <= Rank.TOWN], SHORTCUT),
        (FunctionalClass.SECONDARY, np.concatenate((cell[places.rank <= Rank.TOWN], cell[market])), SHORTCUT),
        (FunctionalClass.TERTIARY, cell[places.rank <= Rank.VILLAGE], SHORTCUT),
    )
    for road_class, sites, shortcut in plans:
        a, b = _territory_links(grid, road_class, np.unique(sites), shortcut)
        grid.mark(a, b)
        built.append((a, b, road_class))
    matrix = grid.costs(FunctionalClass.UNCLASSIFIED)
    _, before, _ = dijkstra(matrix, indices=np.flatnonzero(grid.road), return_predecessors=True, min_only=True)
    a, b = _walk_back(before, cell[places.rank == Rank.HAMLET])
    built.append((a, b, FunctionalClass.UNCLASSIFIED))
    return motorways, _as_corridors(grid, built)


def _near_cells(
    grid: _Grid, x_m: NDArray[np.float64], y_m: NDArray[np.float64], radius_m: NDArray[np.float64]
) -> NDArray[np.bool_]:
    near = np.zeros((grid.rows, grid.cols), bool)
    for x, y, radius in zip(x_m.tolist(), y_m.tolist(), radius_m.tolist(), strict=True):
        r0, r1 = int(max(0, (y - radius) // grid.cell_m)), int((y + radius) // grid.cell_m) + 1
        c0, c1 = int(max(0, (x - radius) // grid.cell_m)), int((x + radius) // grid.cell_m) + 1
        near[r0:r1, c0:c1] = True
    return near.ravel()


def _gateways(
    grid: _Grid, land: Landscape, places: Settlements, radius_m: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.int64]:
    """One cell outside each city where the motorway passes: the lowest ground on a ring around it."""
    cities = np.flatnonzero(places.rank == Rank.CITY)
    angle = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)[None, :] + rng.uniform(0.0, 1.0, (cities.size, 1))
    ring_m = (radius_m[cities] + 1_800.0)[:, None]
    x = np.clip(places.x_m[cities][:, None] + ring_m * np.cos(angle), 2_000.0, land.extent_x_m - 2_000.0)
    y = np.clip(places.y_m[cities][:, None] + ring_m * np.sin(angle), 2_000.0, land.extent_y_m - 2_000.0)
    height = land.sample_m(x.ravel(), y.ravel()).reshape(x.shape)
    pick = np.argmin(height, axis=1)
    rows = np.arange(cities.size)
    return np.unique(grid.cell_at(x[rows, pick], y[rows, pick]))


def _territory_links(
    grid: _Grid, road_class: FunctionalClass, sites: NDArray[np.int64], shortcut: float, keep_share: float = 1.0
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Steps of the least-cost corridors between sites whose territories touch, without needless parallels."""
    matrix = grid.costs(road_class)
    dist, before, site_cell = dijkstra(matrix, indices=sites, return_predecessors=True, min_only=True)
    site = np.searchsorted(sites, site_cell)
    row = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    border = (row < matrix.indices) & (site[row] != site[matrix.indices])
    cell_a, cell_b = row[border], matrix.indices[border].astype(np.int64)
    cost = dist[cell_a] + matrix.data[border] + dist[cell_b]
    low, high = np.minimum(site[cell_a], site[cell_b]), np.maximum(site[cell_a], site[cell_b])
    key = low * sites.size + high
    by_cost = np.lexsort((cell_a, cost))
    _, cheapest = np.unique(key[by_cost], return_index=True)
    pick = by_cost[cheapest]
    kept = pick[_without_detours(low[pick], high[pick], cost[pick], shortcut)]
    kept = kept[np.argsort(cost[kept], kind="stable")][: max(1, round(keep_share * kept.size))]
    a, b = _walk_back(before, np.concatenate((cell_a[kept], cell_b[kept])))
    return np.concatenate((a, cell_a[kept])), np.concatenate((b, cell_b[kept]))


def _without_detours(
    low: NDArray[np.int64], high: NDArray[np.int64], cost: NDArray[np.float64], shortcut: float
) -> NDArray[np.int64]:
    """Positions of the pairs for which no third site lies much closer to both (relative neighbourhood rule)."""
    beside: dict[int, dict[int, float]] = {}
    for i, j, c in zip(low.tolist(), high.tolist(), cost.tolist(), strict=True):
        beside.setdefault(i, {})[j] = c
        beside.setdefault(j, {})[i] = c
    kept = []
    for k, (i, j, c) in enumerate(zip(low.tolist(), high.tolist(), cost.tolist(), strict=True)):
        other = beside[j]
        if not any(third in other and max(leg, other[third]) < shortcut * c for third, leg in beside[i].items()):
            kept.append(k)
    return np.array(kept, np.int64)


def _walk_back(before: NDArray[np.int32], cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Steps on the shortest-path tree from cells back to its roots, each once."""
    seen = np.zeros(before.size, bool)
    current = np.unique(cells)
    a, b = [], []
    while current.size:
        current = current[~seen[current]]
        seen[current] = True
        current = current[before[current] >= 0]
        a.append(current)
        current = np.unique(before[current].astype(np.int64))
        b.append(before[a[-1]].astype(np.int64))
    return np.concatenate(a), np.concatenate(b)


def _as_corridors(grid: _Grid, built: list[tuple[NDArray[np.int64], NDArray[np.int64], FunctionalClass]]) -> Corridors:
    """All steps once, each with its most important class."""
    a = np.concatenate([np.minimum(x, y) for x, y, _ in built])
    b = np.concatenate([np.maximum(x, y) for x, y, _ in built])
    road_class = np.concatenate([np.full(x.size, c, np.int8) for x, _, c in built])
    order = np.lexsort((road_class, b, a))
    a, b, road_class = a[order], b[order], road_class[order]
    new = np.ones(a.size, bool)
    new[1:] = (np.diff(a) != 0) | (np.diff(b) != 0)
    return Corridors(a[new], b[new], road_class[new], grid.cols, grid.cell_m)
