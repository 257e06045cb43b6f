"""Graphs that are changed on disk: what hashes find, and what is found without them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from routing.errors import GraphFormatError
from routing.graph.files import load_graph, save_graph
from routing.graph.road_graph import ARRAY_NAMES, Terrain
from tests.app.conftest import street_grid

# each holds a figure of a node or link that fits any other one; only a hash tells that it is another's
FOUND_BY_HASHES_ALONE = frozenset(
    {
        *("node_height_m", "node_id", "length_m", "speed_limit_mps"),
        *("functional_class", "cross", "urban", "structure", "way_id", "name_idx"),
    }
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A stored graph."""
    path = tmp_path_factory.mktemp("graphs") / "grid"
    save_graph(street_grid("grid", Terrain.SYNTHETIC), path)
    return path


def refusal_of(folder: Path, files: dict[str, bytes]) -> GraphFormatError | None:
    """Why a graph is refused of which some files have other contents, None where it is read; they are put back."""
    before = {file: (folder / file).read_bytes() for file in files}
    try:
        for file, content in files.items():
            (folder / file).write_bytes(content)
        load_graph(folder)
        return None
    except GraphFormatError as error:
        return error
    finally:
        for file, content in before.items():
            (folder / file).write_bytes(content)


def without_hashes(folder: Path) -> bytes:
    """meta.json as it was before graphs were sealed."""
    meta = json.loads((folder / "meta.json").read_text())
    del meta["sha256"]
    return json.dumps(meta).encode()


def shuffled(file: bytes, array: NDArray[np.generic], order: list[int]) -> bytes:
    """The file of an array with its values in another order."""
    return file[: len(file) - array.nbytes] + array[order].tobytes()


@pytest.mark.fault("graph-changed", now="refused at load, by the name of the file")
@pytest.mark.parametrize("name", [*(f"{array}.npy" for array in ARRAY_NAMES), "names.json"])
@given(bit=st.integers(0), at=st.integers(0, 7))
@hypothesis_settings(max_examples=12)
def test_one_bit_of_any_file_of_a_sealed_graph_is_refused_by_its_name(
    folder: Path, name: str, bit: int, at: int
) -> None:
    content = bytearray((folder / name).read_bytes())
    content[bit % len(content)] ^= 1 << at
    error = refusal_of(folder, {name: bytes(content)})
    assert error is not None
    assert error.field == name


@pytest.mark.fault("graph-changed")
@pytest.mark.parametrize("name", ARRAY_NAMES)
@given(data=st.data())
@hypothesis_settings(max_examples=8)
def test_any_shuffled_array_of_a_sealed_graph_is_refused_by_its_name(
    folder: Path, name: str, data: st.DataObject
) -> None:
    array = np.load(folder / f"{name}.npy")
    order = data.draw(st.permutations(range(array.size)))
    content = shuffled((folder / f"{name}.npy").read_bytes(), array, order)
    error = refusal_of(folder, {f"{name}.npy": content})
    if (array[order] == array).all():
        assert error is None
    else:
        assert error is not None
        assert error.field == f"{name}.npy"


@pytest.mark.fault("graph-changed", now="without hashes: what says what meets where is refused, the rest not")
@pytest.mark.parametrize("name", [name for name in ARRAY_NAMES if name not in FOUND_BY_HASHES_ALONE])
@given(data=st.data())
@hypothesis_settings(max_examples=12)
def test_shuffled_array_that_says_what_meets_where_is_refused_without_hashes(
    folder: Path, name: str, data: st.DataObject
) -> None:
    array = np.load(folder / f"{name}.npy")
    order = data.draw(st.permutations(range(array.size)))
    content = shuffled((folder / f"{name}.npy").read_bytes(), array, order)
    error = refusal_of(folder, {f"{name}.npy": content, "meta.json": without_hashes(folder)})
    same = (array[order] == array).all()
    if name == "successor":  # which of the links that end at one node goes on to which may be a ban on a turn
        after = np.repeat(np.load(folder / "head.npy"), np.diff(np.load(folder / "successor_first.npy")))
        same = sorted(zip(after, array[order], strict=True)) == sorted(zip(after, array, strict=True))
    assert (error is None) == same


@pytest.mark.parametrize("name", sorted(FOUND_BY_HASHES_ALONE))
def test_other_shuffled_arrays_are_read_without_hashes(folder: Path, name: str) -> None:
    array = np.load(folder / f"{name}.npy")
    content = shuffled((folder / f"{name}.npy").read_bytes(), array, [*range(1, array.size), 0])
    assert refusal_of(folder, {f"{name}.npy": content, "meta.json": without_hashes(folder)}) is None
