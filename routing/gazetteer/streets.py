"""Pieces of streets joined to streets: those of a name that touch or lie near each other."""

from __future__ import annotations

import math
from array import array
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
    count = np.array([len(piece.points) // 2 for piece in pieces])
    owner = np.repeat(np.arange(len(pieces)), count)
    points = np.concatenate([np.frombuffer(piece.points, np.int32) for piece in pieces]).reshape(-1, 2).astype(np.int64)
    cell = np.floor_divide(points, round(NEAR_DEG * E7))
    width = np.int64(1) << 20  # of cells in a row, which 360 degrees are fewer than
    code = (name[owner] * width + cell[:, 0] + (width >> 1)) * width + cell[:, 1] + (width >> 1)
    is_new = np.r_[True, (code[1:] != code[:-1]) | (owner[1:] != owner[:-1])]
    code, whose = code[is_new], owner[is_new]
    order = np.argsort(code, kind="stable")
    code, whose = code[order], whose[order]
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
    xs, ys = array("i"), array("i")
    for piece in pieces:
        xs += piece.points[::2]
        ys += piece.points[1::2]
    shrink = math.cos(math.radians(ys[0] / E7))
    middle_x, middle_y = sum(xs) / len(xs), sum(ys) / len(ys)
    away = [((x - middle_x) * shrink) ** 2 + (y - middle_y) ** 2 for x, y in zip(xs, ys, strict=True)]
    at = away.index(min(away))
    length_m: dict[str, float] = defaultdict(float)
    for piece in pieces:
        own_xs, own_ys = piece.points[::2], piece.points[1::2]
        steps = zip(own_xs, own_xs[1:], own_ys, own_ys[1:], strict=False)
        own = sum([math.hypot((x1 - x0) * shrink, y1 - y0) for x0, x1, y0, y1 in steps])
        length_m[piece.value] += own * _METRE + 1.0
    value = max(length_m, key=lambda value: length_m[value])
    longest = max(pieces, key=lambda piece: len(piece.points))
    names: dict[str, str] = {}
    for piece in pieces:
        names.update(piece.names)
    postcodes = Counter(code for piece in pieces if piece.postcode for code in piece.postcode.split(";") if code)
    spelled = Counter(piece.name for piece in pieces).most_common(1)[0][0] if len(pieces) > 1 else pieces[0].name
    importance = STREETS[value] + 0.05 * min(1.0, sum(length_m.values()) / LONG_M)
    return Entry(
        Kind.STREET,
        "w" if longest.way else "",
        longest.way,
        "highway",
        value,
        spelled,
        names,
        ys[at] / E7,
        xs[at] / E7,
        importance,
        (min(xs) / E7, min(ys) / E7, max(xs) / E7, max(ys) / E7),
        postcode=postcodes.most_common(1)[0][0] if postcodes else "",
        further=tuple(code for code, _ in postcodes.most_common(MOST_POSTCODES)),
        lines=tuple(piece.points for piece in pieces),
    )
