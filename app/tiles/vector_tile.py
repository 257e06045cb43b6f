"""Points, lines and areas with attributes in the wire format of Mapbox Vector Tile 2.1.

Source: Mapbox Vector Tile specification 2.1, sections 4.1 to 4.4, and the encoding of Protocol Buffers: a message is a
row of fields, each a key (number << 3 | wire type) with a varint or with a length and bytes.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

EXTENT: Final = 4096  # units along a tile's side
VERSION: Final = 2
POINT: Final = 1  # section 4.3.4.2
LINESTRING: Final = 2  # section 4.3.4.3
POLYGON: Final = 3  # section 4.3.4.4
MOVE_TO_ONE: Final = 1 << 3 | 1  # command 1, once (section 4.3.1)
LINE_TO: Final = 2
CLOSE_PATH: Final = 1 << 3 | 7
SEVEN_BIT_STEPS: Final = np.array([1 << 7, 1 << 14, 1 << 21, 1 << 28], np.uint32)  # a varint grows by a byte at each

AttributeValue = str | int | bool


@dataclass(frozen=True, slots=True)
class TileLines:
    """Lines in the units of a tile, x to the east and y to the south.

    points: int64 (P, 2); part_first: int64 (K+1,) rows of points at which parts begin, each of two points or more;
    part_line: int64 (K,) the line that a part belongs to, never falling; attributes: one mapping a line.
    """

    points: NDArray[np.int64]
    part_first: NDArray[np.int64]
    part_line: NDArray[np.int64]
    attributes: Sequence[Mapping[str, AttributeValue]]


def encode_tile(layer_name: str, lines: TileLines) -> bytes:
    """A tile of one layer, or no bytes where it has no lines."""
    if not lines.attributes:
        return b""
    return _layer(layer_name, LINESTRING, lines.attributes, _geometries(lines, closed=False))


def encode_areas(layer_name: str, rings: TileLines) -> bytes:
    """A tile of one layer of areas, or no bytes where there are none.

    Parts are rings without their last point, three points or more each, the outer ones turning from x to y and followed
    by their holes, which turn the other way (section 4.3.3.3).
    """
    if not rings.attributes:
        return b""
    return _layer(layer_name, POLYGON, rings.attributes, _geometries(rings, closed=True))


def encode_points(
    layer_name: str, points: NDArray[np.int64], attributes: Sequence[Mapping[str, AttributeValue]]
) -> bytes:
    """A tile of one layer of points, int64 (n, 2) in its units, or no bytes where there are none.

    Tiles of several layers are their bytes on end.
    """
    if not attributes:
        return b""
    zigzag = ((points << 1) ^ (points >> 63)).tolist()
    geometries = [_varint(MOVE_TO_ONE) + _varint(x) + _varint(y) for x, y in zigzag]
    return _layer(layer_name, POINT, attributes, geometries)


def _layer(
    layer_name: str, kind: int, every: Sequence[Mapping[str, AttributeValue]], geometries: Sequence[bytes]
) -> bytes:
    keys: dict[str, int] = {}
    values: dict[tuple[type, AttributeValue], int] = {}
    layer = [_bytes_field(1, layer_name.encode())]
    for attributes, geometry in zip(every, geometries, strict=True):
        tags = bytearray()
        for key, value in attributes.items():
            tags += _varint(keys.setdefault(key, len(keys)))
            tags += _varint(values.setdefault((type(value), value), len(values)))
        feature = _bytes_field(2, tags) + _varint_field(3, kind) + _bytes_field(4, geometry)
        layer.append(_bytes_field(2, feature))
    layer += [_bytes_field(3, key.encode()) for key in keys]
    layer += [_bytes_field(4, _value(value)) for _, value in values]
    layer += [_varint_field(5, EXTENT), _varint_field(15, VERSION)]
    return _bytes_field(3, b"".join(layer))


def _geometries(lines: TileLines, *, closed: bool) -> list[bytes]:
    """Commands of each line or area (section 4.3): the cursor starts at 0, 0 and goes on from part to part."""
    count = np.diff(lines.part_first)
    begins_line = np.diff(lines.part_line, prepend=-1) > 0
    steps = np.diff(lines.points, axis=0, prepend=0)
    at_begin = lines.part_first[:-1][begins_line]
    steps[at_begin] = lines.points[at_begin]
    # a part of n points takes 2n + 2 numbers: MoveTo, one step, LineTo, n - 1 steps; ClosePath is one more
    part_at = np.concatenate(([0], np.cumsum(2 * count + 2 + closed)))
    numbers = np.empty(int(part_at[-1]), np.uint32)
    numbers[part_at[:-1]] = MOVE_TO_ONE
    numbers[part_at[:-1] + 3] = (count - 1) << 3 | LINE_TO
    if closed:
        numbers[part_at[1:] - 1] = CLOSE_PATH
    rank = np.arange(lines.points.shape[0]) - np.repeat(lines.part_first[:-1], count)
    step_at = np.repeat(part_at[:-1] + 1, count) + 2 * rank + (rank > 0)
    zigzag = (steps << 1) ^ (steps >> 63)
    numbers[step_at], numbers[step_at + 1] = zigzag[:, 0], zigzag[:, 1]
    packed, byte_at = _varints(numbers)
    whole = packed.tobytes()
    ends = byte_at[np.append(part_at[:-1][begins_line], part_at[-1])].tolist()
    return [whole[begin:end] for begin, end in pairwise(ends)]


def _varints(numbers: NDArray[np.uint32]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Varints of all numbers on end, and the byte at which each begins with the end of the last, int64 (N+1,)."""
    lengths = 1 + np.searchsorted(SEVEN_BIT_STEPS, numbers, side="right")
    byte_at = np.concatenate(([0], np.cumsum(lengths)))
    packed = np.empty(int(byte_at[-1]), np.uint8)
    for k in range(5):
        longer = np.flatnonzero(lengths > k)
        more = (lengths[longer] > k + 1).astype(np.uint8) << 7
        packed[byte_at[longer] + k] = (numbers[longer] >> 7 * k & 0x7F).astype(np.uint8) | more
    return packed, byte_at


def _value(value: AttributeValue) -> bytes:
    """One attribute value (section 4.4): string_value, uint_value, sint_value or bool_value."""
    if isinstance(value, bool):
        return _varint_field(7, int(value))
    if isinstance(value, int):
        return _varint_field(5, value) if value >= 0 else _varint_field(6, -2 * value - 1)
    return _bytes_field(1, value.encode())


def _varint(number: int) -> bytes:
    if number < 0x80:
        return struct.pack("B", number)
    packed = bytearray()
    while number >= 0x80:
        packed.append(number & 0x7F | 0x80)
        number >>= 7
    packed.append(number)
    return bytes(packed)


def _varint_field(field: int, number: int) -> bytes:
    return _varint(field << 3) + _varint(number)


def _bytes_field(field: int, content: bytes | bytearray) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content
