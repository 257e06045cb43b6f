"""Where people live in a synthetic landscape: cities, towns, villages, hamlets."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from routing.synth.terrain import fractal_field

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.synth.terrain import Landscape


class Rank(IntEnum):
    """Size of a settlement."""

    CITY = 0
    TOWN = 1
    VILLAGE = 2
    HAMLET = 3


# Assumed, thinly peopled highlands. Columns: area per settlement [km²], least distance between equals [km],
# least distance to a larger one [km], share of the streets' budget per settlement before scatter.
_LAYOUT: Final = {
    Rank.CITY: (3_600.0, 30.0, 30.0, 640.0),
    Rank.TOWN: (620.0, 9.5, 8.0, 120.0),
    Rank.VILLAGE: (80.0, 3.8, 3.0, 13.0),
    Rank.HAMLET: (24.0, 2.0, 1.9, 1.6),
}
MARGIN_M: Final = 1_500.0

_ONSETS: Final = [
    "Al",
    "Ar",
    "Bel",
    "Bran",
    "Cal",
    "Cor",
    "Dal",
    "Der",
    "El",
    "Fen",
    "Gal",
    "Glen",
    "Har",
    "Hol",
    "Il",
    "Kel",
    "Kor",
    "Lan",
    "Lor",
    "Mar",
    "Mor",
    "Nor",
    "Or",
    "Pel",
    "Ran",
    "Ros",
    "Sel",
    "Stor",
    "Tal",
    "Tor",
    "Ul",
    "Val",
    "Ver",
    "Wen",
]
_MIDDLES: Final = [
    "",
    "a",
    "be",
    "den",
    "dra",
    "er",
    "fi",
    "ga",
    "i",
    "le",
    "ma",
    "ne",
    "o",
    "ra",
    "ri",
    "sen",
    "ta",
    "ve",
]
_CODAS: Final = [
    "by",
    "dal",
    "don",
    "fell",
    "ford",
    "gard",
    "ham",
    "holm",
    "kirk",
    "lund",
    "mere",
    "mont",
    "mouth",
    "nes",
    "ola",
    "rick",
    "stad",
    "stead",
    "ton",
    "vale",
    "vik",
    "wick",
    "worth",
]


@dataclass(frozen=True, slots=True)
class Settlements:
    """Rows sorted by rank, largest first; x_m, y_m: float64 (n,); rank: int8 (n,); streets: int64 (n,) links wanted."""

    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    rank: NDArray[np.int8]
    streets: NDArray[np.int64]
    names: tuple[str, ...]


def place_settlements(land: Landscape, streets_total: int, rng: np.random.Generator) -> Settlements:
    """Settlements on flat, low, watered ground, kept apart by rank, with about streets_total street links in all."""
    step = max(1, round(250.0 / land.cell_m))
    cell_m = land.cell_m * step
    ground = ndimage.uniform_filter(land.ground_m, step)[::step, ::step].astype(np.float64)
    flow = ndimage.maximum_filter(land.flow_km2, step)[::step, ::step]
    slope = ndimage.gaussian_filter(np.hypot(*np.gradient(ground, cell_m)), 1.0)
    appeal = -9.0 * slope - ground / 900.0 + 0.22 * np.log1p(ndimage.maximum_filter(flow, 5))
    appeal = appeal + 0.45 * fractal_field((ground.shape[0], ground.shape[1]), cell_m, 6_000.0, rng, decay=1.5)
    margin = round(MARGIN_M / cell_m)
    appeal[:margin] = appeal[-margin:] = -np.inf
    appeal[:, :margin] = appeal[:, -margin:] = -np.inf
    area_km2 = land.extent_x_m * land.extent_y_m / 1e6
    xs, ys, ranks = [np.empty(0)], [np.empty(0)], [np.empty(0, np.int8)]
    for rank, (per_km2, apart_km, below_km, _) in _LAYOUT.items():
        wanted = max(2, round(area_km2 / per_km2))
        apart_m = min(apart_km * 1e3, 0.35 * min(land.extent_x_m, land.extent_y_m))
        x, y, value = _block_best(appeal, cell_m, apart_m / 1.7)
        if rank >= Rank.VILLAGE:  # villages are everywhere that one can live, not only on the best ground
            value = np.minimum(value, np.quantile(value, 0.35)) + 0.2 * rng.standard_normal(value.size)
        kept = _spread(
            x, y, value, apart_m, wanted, np.concatenate(xs), np.concatenate(ys), min(below_km * 1e3, apart_m)
        )
        xs.append(x[kept])
        ys.append(y[kept])
        ranks.append(np.full(kept.size, rank, np.int8))
    x, y, rank_of = np.concatenate(xs), np.concatenate(ys), np.concatenate(ranks)
    share = np.array([_LAYOUT[Rank(r)][3] for r in range(len(Rank))])[rank_of] * rng.lognormal(0.0, 0.35, x.size)
    streets = np.round(share * streets_total / share.sum()).astype(np.int64)
    return Settlements(x, y, rank_of, streets, _invented_names(x.size, rng))


def _block_best(
    appeal: NDArray[np.float64], cell_m: float, block_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The most appealing cell of every square block: x [m], y [m], appeal."""
    side = max(1, round(block_m / cell_m))
    rows, cols = -(-appeal.shape[0] // side), -(-appeal.shape[1] // side)
    padded = np.full((rows * side, cols * side), -np.inf)
    padded[: appeal.shape[0], : appeal.shape[1]] = appeal
    blocks = padded.reshape(rows, side, cols, side).transpose(0, 2, 1, 3).reshape(rows * cols, side * side)
    best = np.argmax(blocks, axis=1)
    value = blocks[np.arange(best.size), best]
    row = np.repeat(np.arange(rows), cols) * side + best // side
    col = np.tile(np.arange(cols), rows) * side + best % side
    there = np.isfinite(value)
    return (col[there] + 0.5) * cell_m, (row[there] + 0.5) * cell_m, value[there]


def _spread(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    value: NDArray[np.float64],
    apart_m: float,
    wanted: int,
    taken_x: NDArray[np.float64],
    taken_y: NDArray[np.float64],
    from_taken_m: float,
) -> NDArray[np.int64]:
    """Best candidates first, each at least apart_m from those chosen before and from_taken_m from those taken."""
    blocked = np.zeros(x.size, bool)
    tree = cKDTree(np.column_stack((x, y)))
    if taken_x.size:
        nearest, _ = cKDTree(np.column_stack((taken_x, taken_y))).query(np.column_stack((x, y)))
        blocked |= np.asarray(nearest) < from_taken_m
    chosen: list[int] = []
    for k in np.argsort(-value, kind="stable").tolist():
        if blocked[k]:
            continue
        chosen.append(k)
        if len(chosen) == wanted:
            break
        blocked[tree.query_ball_point((x[k], y[k]), apart_m)] = True
    return np.array(chosen, np.int64)


def _invented_names(count: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Distinct made-up place names."""
    every = [a + b + c for a in _ONSETS for b in _MIDDLES for c in _CODAS]
    order = rng.permutation(len(every)).tolist()
    names = [every[order[k % len(every)]] for k in range(count)]
    return tuple(name if k < len(every) else f"{name} {k // len(every) + 1}" for k, name in enumerate(names))
