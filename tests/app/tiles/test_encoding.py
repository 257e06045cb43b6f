"""Vector tiles in their wire format."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.tiles.vector_tile import TileLines, encode_tile
from tests.app.tiles.tile_reader import Point, read_tile


def tile_lines(lines: list[list[list[Point]]], attributes: list[dict[str, str | int | bool]]) -> TileLines:
    """Lines, each a list of parts, as the encoder takes them."""
    parts = [part for line in lines for part in line]
    return TileLines(
        points=np.array([point for part in parts for point in part], np.int64).reshape(-1, 2),
        part_first=np.cumsum([0, *(len(part) for part in parts)]).astype(np.int64),
        part_line=np.repeat(np.arange(len(lines)), [len(line) for line in lines]).astype(np.int64),
        attributes=attributes,
    )


def test_lines_of_the_specification_are_encoded_as_it_prints_them() -> None:
    # sections 4.3.5.3 and 4.3.5.4 of the specification
    first = [[(2, 2), (2, 10), (10, 10)]]
    second = [*first, [(1, 1), (3, 5)]]
    (layer,) = read_tile(encode_tile("roads", tile_lines([first, second], [{}, {}])))
    assert layer.features[0].commands == [9, 4, 4, 18, 0, 16, 16, 0]
    assert layer.features[1].commands == [9, 4, 4, 18, 0, 16, 16, 0, 9, 17, 17, 10, 4, 8]


def test_tile_of_one_line_is_encoded_byte_by_byte_as_worked_out_by_hand() -> None:
    lines = tile_lines([[[(1, 0), (1, 100)]]], [{"oneway": True}])
    assert encode_tile("r", lines).hex(" ") == " ".join(
        (
            "1a 25",  # layer of 37 bytes
            "0a 01 72",  # name r
            "12 0f",  # feature of 15 bytes
            "12 02 00 00",  # tags: key 0, value 0
            "18 02",  # LINESTRING
            "22 07 09 02 00 0a 00 c8 01",  # MoveTo(+1, 0), LineTo(0, +100): zigzag 200 takes two bytes
            "1a 06 6f 6e 65 77 61 79",  # key oneway
            "22 02 38 01",  # bool_value true
            "28 80 20",  # extent 4096
            "78 02",  # version 2
        )
    )


def test_tile_without_lines_has_no_bytes() -> None:
    assert encode_tile("roads", tile_lines([], [])) == b""


def test_values_that_are_equal_in_python_but_not_in_kind_stay_apart() -> None:
    line = [[(0, 0), (1, 1)]]
    (layer,) = read_tile(encode_tile("roads", tile_lines([line, line], [{"a": 1}, {"a": True}])))
    assert [feature.attributes["a"] is True for feature in layer.features] == [False, True]


@pytest.mark.parametrize("step", [63, 64, 8191, 8192, 1_048_575, 1_048_576, 134_217_727, 134_217_728, -(2**30)])
def test_steps_at_the_borders_of_varint_lengths_come_back(step: int) -> None:
    parts = [[(0, 0), (step, -step)]]
    (layer,) = read_tile(encode_tile("roads", tile_lines([parts], [{}])))
    assert layer.features[0].parts == parts


COORDINATES = st.integers(-64, 4160)
PARTS = st.lists(st.tuples(COORDINATES, COORDINATES), min_size=2, max_size=6).filter(
    lambda part: all(a != b for a, b in pairwise(part))
)
VALUES = st.one_of(st.text(max_size=8), st.integers(-(2**31), 2**31), st.booleans())
LINES = st.lists(
    st.tuples(
        st.lists(PARTS, min_size=1, max_size=3), st.dictionaries(st.sampled_from(["class", "name", "ä"]), VALUES)
    ),
    min_size=1,
    max_size=5,
)


@settings(max_examples=50)
@given(LINES)
def test_any_lines_come_back_as_they_were(lines: list[tuple[list[list[Point]], dict[str, str | int | bool]]]) -> None:
    parts, attributes = [line[0] for line in lines], [line[1] for line in lines]
    (layer,) = read_tile(encode_tile("roads", tile_lines(parts, attributes)))
    assert (layer.name, layer.version, layer.extent) == ("roads", 2, 4096)
    assert [feature.parts for feature in layer.features] == parts
    assert [feature.attributes for feature in layer.features] == attributes
