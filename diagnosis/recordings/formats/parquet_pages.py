"""What the pages of a Parquet file say that they unpack to, by their own headers, before any is unpacked.

A file's footer may say less. Headers are in Thrift's compact protocol (apache/parquet-format, parquet.thrift:
PageHeader; apache/thrift, thrift-compact-protocol.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

STOP, TRUE, FALSE, BYTE, I16, I32, I64, DOUBLE, BINARY, LIST, SET, MAP, STRUCT = range(13)
UNPACKED, PACKED = 2, 3  # fields of a page's header
DEEPEST: Final = 8
MOST_VARINT_BYTES: Final = 10


def pages_bytes(content: bytes, begin: int, packed_bytes: int) -> Iterator[int]:
    """Unpacked bytes of each page of a column's chunk, which begins at `begin` and has so many bytes.

    Raises ValueError for a header that can't be read, or that leads outside.
    """
    at, end = begin, begin + packed_bytes
    if not 0 <= begin <= end <= len(content):
        raise ValueError("a column outside of the file")
    while at < end:
        sizes, at = _numbers_of_struct(content, at, 0)
        unpacked, packed = sizes.get(UNPACKED, -1), sizes.get(PACKED, -1)
        if unpacked < 0 or packed < 0:
            raise ValueError("a page without its size")
        yield unpacked
        at += packed


def _numbers_of_struct(content: bytes, at: int, depth: int) -> tuple[dict[int, int], int]:
    """Whole numbers of a struct by their fields' numbers, and where it ends; other fields are passed over."""
    if depth > DEEPEST:
        raise ValueError("a page's header that is too deep")
    found: dict[int, int] = {}
    number = 0
    while (head := _byte(content, at)) != STOP:
        at += 1
        kind, step = head & 0x0F, head >> 4
        if step:
            number += step
        else:
            number, at = _zigzag(content, at)
        if kind in (I16, I32, I64):
            found[number], at = _zigzag(content, at)
        elif kind not in (TRUE, FALSE):  # which have no bytes of their own
            at = _after(content, at, kind, depth)
    return found, at + 1


def _after(content: bytes, at: int, kind: int, depth: int) -> int:
    """Where a value of some kind ends."""
    if kind in (TRUE, FALSE, BYTE):
        return at + 1
    if kind in (I16, I32, I64):
        return _varint(content, at)[1]
    if kind == DOUBLE:
        return at + 8
    if kind == BINARY:
        size, at = _varint(content, at)
        return at + size
    if kind == STRUCT:
        return _numbers_of_struct(content, at, depth + 1)[1]
    raise ValueError("a page's header with lists, which it does not have")


def _byte(content: bytes, at: int) -> int:
    if not 0 <= at < len(content):
        raise ValueError("a page that is cut off")
    return content[at]


def _zigzag(content: bytes, at: int) -> tuple[int, int]:
    value, at = _varint(content, at)
    return (value >> 1) ^ -(value & 1), at


def _varint(content: bytes, at: int) -> tuple[int, int]:
    value = 0
    for k in range(MOST_VARINT_BYTES):
        byte = _byte(content, at + k)
        value |= (byte & 0x7F) << (7 * k)
        if byte < 0x80:
            return value, at + k + 1
    raise ValueError("a number that does not end")
