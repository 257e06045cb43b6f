"""A reader of vector tiles, written from the specification alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

Point = tuple[int, int]


@dataclass(frozen=True)
class Feature:
    """A line, a point or an area: its geometry as numbers and as parts, and its attributes."""

    commands: list[int]
    attributes: dict[str, object]
    kind: int = 2  # LINESTRING

    @property
    def point(self) -> Point:
        """The place of a point."""
        assert self.kind == 1
        move, x, y = self.commands
        assert move == 9  # MoveTo, once
        return unzigzag(x), unzigzag(y)

    @property
    def parts(self) -> list[list[Point]]:
        """Points of each part, by the commands of section 4.3."""
        parts: list[list[Point]] = []
        x = y = 0
        numbers, closed = iter(self.commands), 0
        for command in numbers:
            kind, count = command & 7, command >> 3
            if kind == 7:  # ClosePath, of areas
                assert (self.kind, count) == (3, 1)
                assert len(parts[-1]) > 2
                closed += 1
                continue
            assert kind in (1, 2)
            assert count > 0
            assert kind == 2 or count == 1
            for _ in range(count):
                step_x, step_y = unzigzag(next(numbers)), unzigzag(next(numbers))
                assert kind == 1 or (step_x, step_y) != (0, 0)
                x, y = x + step_x, y + step_y
                if kind == 1:
                    parts.append([])
                parts[-1].append((x, y))
        assert all(len(part) > 1 for part in parts)
        assert closed == (len(parts) if self.kind == 3 else 0)
        return parts


@dataclass(frozen=True)
class Layer:
    """A layer of a tile."""

    name: str
    version: int
    extent: int
    features: list[Feature]


def read_tile(content: bytes) -> list[Layer]:
    """The layers of a tile."""
    return [read_layer(message) for number, message in fields(content) if number == 3 and isinstance(message, bytes)]


def read_layer(content: bytes) -> Layer:
    entries = list(fields(content))
    name, version, extent = (next(value for number, value in entries if number == wanted) for wanted in (1, 15, 5))
    keys = [value.decode() for number, value in entries if number == 3 and isinstance(value, bytes)]
    values = [read_value(value) for number, value in entries if number == 4 and isinstance(value, bytes)]
    assert isinstance(name, bytes)
    assert isinstance(version, int)
    assert isinstance(extent, int)
    assert len(set(keys)) == len(keys)
    features = []
    for number, value in entries:
        if number == 2 and isinstance(value, bytes):
            parts = dict(fields(value))
            kind = parts[3]
            assert kind in (1, 2, 3)  # POINT, LINESTRING, POLYGON
            assert isinstance(kind, int)
            tags = list(varints(parts.get(2, b"")))
            attributes = {keys[k]: values[v] for k, v in zip(tags[::2], tags[1::2], strict=True)}
            features.append(Feature(list(varints(parts[4])), attributes, kind))
    return Layer(name.decode(), version, extent, features)


def read_value(content: bytes) -> object:
    ((number, value),) = fields(content)
    if isinstance(value, bytes):
        assert number == 1
        return value.decode()
    return {5: value, 6: unzigzag(value), 7: bool(value)}[number]


def unzigzag(number: int) -> int:
    return (number >> 1) ^ -(number & 1)


def varint(content: bytes, at: int) -> tuple[int, int]:
    number = shift = 0
    while True:
        number |= (content[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if content[at - 1] < 0x80:
            return number, at


def varints(content: bytes | int) -> Iterator[int]:
    assert isinstance(content, bytes)
    at = 0
    while at < len(content):
        number, at = varint(content, at)
        yield number


def fields(content: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Number and value of each field of a message; fields of other wire types than 0 and 2 are none of ours."""
    at = 0
    while at < len(content):
        key, at = varint(content, at)
        number, at = varint(content, at)
        assert key & 7 in (0, 2)
        if key & 7 == 0:
            yield key >> 3, number
        else:
            yield key >> 3, content[at : at + number]
            at += number
    assert at == len(content)
