"""Pieces of streets joined to streets: those of a name that touch or lie near each other."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from routing.gazetteer.entries import Entry, Kind
from routing.gazetteer.importance import STREETS
from routing.gazetteer.words import folded
from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.gazetteer.entries import Piece

NEAR_DEG: Final = 0.003  # about 300 m, within which pieces of a name are of a street; assumed
MOST_POSTCODES: Final = 8  # of a street
LONG_M: Final = 2000.0
_METRE: Final = 111_195.0 / E7


def joined_streets(pieces: Sequence[Piece]) -> list[Entry]:
    """A street for each group of pieces of one name of which each is near another, O(n log n).

    Its place is the point of its pieces nearest to their middle; its importance that of most of its length.
    """
    label = _groups(pieces)
    groups: dict[int, list[Piece]] = defaultdict(list)
    for piece, group in zip(pieces, label, strict=True):
        groups[group].append(piece)
    return [_street(group) for group in groups.values()]


def _groups(pieces: Sequence[Piece]) -> list[int]:
    """The group of each piece."""
    if not pieces:
        return []
    name_idx: dict[str, int] = {}
    name = np.array([name_idx.setdefault(folded(piece.name), len(name_idx)) for piece in pieces], np.int64)
    count = np.array([len(piece.points) for piece in pieces])
    owner = np.repeat(np.arange(len(pieces)), count)
    points = np.array([place for piece in pieces for place in piece.points], np.int64)
    cell = np.floor_divide(points, round(NEAR_DEG * E7))
    key = np.unique(np.column_stack((name[owner], cell, owner)), axis=0)
    width = np.int64(1) << 20  # of cells in a row, which 360 degrees are fewer than
    code = (key[:, 0] * width + key[:, 1] + (width >> 1)) * width + key[:, 2] + (width >> 1)
    order = np.argsort(code, kind="stable")
    code, whose = code[order], key[order, 3]
    first = np.r_[True, code[1:] != code[:-1]]
    cells, cell_of = code[first], np.cumsum(first) - 1
    pairs = [np.column_stack((cell_of, len(cells) + whose))]
    for east, north in ((1, 0), (0, 1), (1, 1), (1, -1)):
        beside = cells + east * width + north
        at = np.minimum(np.searchsorted(cells, beside), len(cells) - 1)
        meets = np.flatnonzero(cells[at] == beside)
        pairs.append(np.column_stack((meets, at[meets])))
    row, column = np.concatenate(pairs).T
    size = len(cells) + len(pieces)
    _, component = connected_components(coo_array((np.ones(row.size, np.int8), (row, column)), (size, size)), False)
    groups: list[int] = component[len(cells) :].tolist()
    return groups


def _street(pieces: Sequence[Piece]) -> Entry:
    places = np.array([place for piece in pieces for place in piece.points], np.int64)
    (west, south), (east, north) = places.min(0).tolist(), places.max(0).tolist()
    shrink = np.cos(np.radians(places[0, 1] / E7))
    middle = places.mean(0)
    away = (places - middle) * (shrink, 1.0)
    at = places[np.argmin((away**2).sum(1))]
    length_m: dict[str, float] = defaultdict(float)
    for piece in pieces:
        line = np.array(piece.points, np.float64)
        steps = np.diff(line, axis=0) * (shrink, 1.0)
        length_m[piece.value] += float(np.hypot(steps[:, 0], steps[:, 1]).sum() * _METRE) + 1.0
    value = max(length_m, key=lambda value: length_m[value])
    longest = max(pieces, key=lambda piece: len(piece.points))
    names: dict[str, str] = {}
    for piece in pieces:
        names.update(piece.names)
    postcodes = Counter(code for piece in pieces for code in piece.postcode.split(";") if code)
    spelled = Counter(piece.name for piece in pieces).most_common(1)[0][0]
    importance = STREETS[value] + 0.05 * min(1.0, sum(length_m.values()) / LONG_M)
    return Entry(
        Kind.STREET,
        "w" if longest.way else "",
        longest.way,
        "highway",
        value,
        spelled,
        names,
        float(at[1] / E7),
        float(at[0] / E7),
        importance,
        (west / E7, south / E7, east / E7, north / E7),
        postcode=postcodes.most_common(1)[0][0] if postcodes else "",
        further=tuple(code for code, _ in postcodes.most_common(MOST_POSTCODES)),
        lines=tuple(piece.points for piece in pieces),
    )
