"""Graphs on disk: whole or not at all, sealed, and refused when they are not what they should be."""

from __future__ import annotations

import errno
import json
import os
import shutil
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from routing.errors import GraphFormatError
from routing.graph import files
from routing.graph.files import ARRAY_DTYPES, load_graph, load_meta, save_graph
from routing.graph.road_graph import (
    ARRAY_NAMES,
    FORMAT_VERSION,
    GraphMeta,
    LooseLinks,
    LooseNodes,
    RoadGraph,
    Terrain,
    assemble_graph,
)
from tests.app.conftest import street_grid

pytestmark = pytest.mark.nojit


def triangle(name: str = "triangle") -> RoadGraph:
    """Three streets, both ways, with names that are not ASCII."""
    tail = np.array([0, 1, 1, 2, 2, 0], np.int32)
    head = np.array([1, 0, 2, 1, 0, 2], np.int32)
    lon, lat = np.array([0, 10_000, 0]), np.array([0, 0, 10_000])
    corners = np.column_stack((tail, head)).ravel()
    meta = GraphMeta(
        name, "drawn – à la main", "CC0", "© nobody", Terrain.SYNTHETIC, "drawn", 12.5, (0.0,) * 4, {"paths": 3}
    )
    return assemble_graph(
        meta,
        ("", "Carrer Major", "Öl-Straße"),
        LooseNodes(lat / 1e7, lon / 1e7, np.array([10.0, 20.5, 30.25]), np.array([7, 8, 2**40])),
        LooseLinks(
            tail=tail,
            head=head,
            length_m=np.array([100.0, 100.0, 141.5, 141.5, 100.0, 100.0]),
            speed_limit_mps=np.full(6, 50.0 / 3.6),
            functional_class=np.full(6, 6, np.int8),
            cross=np.array([0, 1, 2, 3, 0, 1], np.int8),
            urban=np.array([True, False] * 3),
            structure=np.array([False, True] * 3),
            way_id=np.arange(6) + 2**33,
            name_idx=np.array([0, 0, 1, 1, 2, 2], np.int32),
            geometry_first=np.arange(7) * 2,
            geometry_lon_e7=lon[corners].astype(np.int32),
            geometry_lat_e7=lat[corners].astype(np.int32),
            forbidden_turns=np.empty((0, 2), np.int64),
        ),
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A stored graph."""
    path = tmp_path / "graphs" / "triangle"
    save_graph(triangle(), path)
    return path


def assert_same(got: RoadGraph, expected: RoadGraph) -> None:
    assert got.meta == expected.meta
    assert got.names == expected.names
    for name in ARRAY_NAMES:
        mine, other = getattr(got, name), getattr(expected, name)
        assert mine.dtype == other.dtype
        np.testing.assert_array_equal(mine, other)


def test_graph_saved_and_loaded_is_the_same(folder: Path) -> None:
    assert_same(load_graph(folder), triangle())
    assert load_meta(folder) == triangle().meta


def test_loaded_arrays_are_read_only_and_stay_when_their_files_are_cut(folder: Path) -> None:
    graph = load_graph(folder)
    for name in ARRAY_NAMES:
        (folder / f"{name}.npy").write_bytes(b"")
        array = getattr(graph, name)
        assert type(array) is np.ndarray
        assert not array.flags.writeable
    assert_same(graph, triangle())


@pytest.mark.parametrize("name", ARRAY_NAMES)
def test_array_with_one_bit_flipped_is_refused_by_its_name(folder: Path, name: str) -> None:
    path = folder / f"{name}.npy"
    content = bytearray(path.read_bytes())
    content[-5] ^= 1
    path.write_bytes(content)
    error = refused(folder)
    assert error.field == f"{name}.npy"
    assert "changed" in str(error.value)


@pytest.mark.parametrize("file", ["names.json", "cut_node.npy"])
def test_other_file_that_is_changed_is_refused_by_its_name(tmp_path: Path, file: str) -> None:
    save_graph(replace(triangle(), cut_node=np.array([1], np.int32)), tmp_path / "graph")
    (tmp_path / "graph" / file).write_bytes(b"[]")
    assert refused(tmp_path / "graph").field == file


def test_file_that_is_not_sealed_is_passed_over(folder: Path) -> None:
    np.save(folder / "cut_node.npy", np.array([1], np.int32))
    assert load_graph(folder).cut_node is None


def test_graph_of_before_without_hashes_is_read(folder: Path) -> None:
    unseal(folder)
    assert_same(load_graph(folder), triangle())


def test_graph_that_is_replaced_while_it_is_read_is_one_or_the_other(folder: Path) -> None:
    """Readers never see a folder that is missing, or files of both."""
    stop, seen = threading.Event(), set[str]()

    def read() -> None:
        while not stop.is_set():
            graph = load_graph(folder)
            seen.add(graph.meta.name)
            assert graph.names[1] == ("Carrer Major" if graph.meta.name == "triangle" else "Avinguda")

    other = replace(triangle("other"), names=("", "Avinguda", "Öl-Straße"))
    with ThreadPoolExecutor(2) as pool:
        reading = [pool.submit(read) for _ in range(2)]
        for k in range(60):
            save_graph(other if k % 2 == 0 else triangle(), folder)
        stop.set()
        for each in reading:
            each.result()
    assert seen <= {"triangle", "other"}


@pytest.mark.parametrize(
    ("name", "change", "field"),
    [
        ("reverse_idx", np.arange, "reverse_idx"),
        ("reverse_idx", lambda size: np.roll(np.arange(size), 1), "reverse_idx"),
        ("node_lat_deg", lambda size: np.full(size, np.nan), "node_lat_deg"),
        ("node_lon_deg", lambda size: np.full(size, 181.0), "node_lon_deg"),
        ("node_lat_deg", lambda size: np.linspace(46.0, 46.1, size), "geometry_lat_e7"),
        ("geometry_lat_e7", lambda size: np.full(size, 900_000_001), "geometry_lat_e7"),
        ("geometry_first", lambda size: np.append(np.arange(size - 1), 2 * (size - 1)), "geometry_first"),
        ("successor", lambda size: np.zeros(size), "successor"),
    ],
)
def test_arrays_that_do_not_fit_each_other_are_refused(
    tmp_path: Path, name: str, change: Callable[[int], NDArray[np.float64]], field: str
) -> None:
    grid = tmp_path / "grid"
    save_graph(street_grid("grid", Terrain.SYNTHETIC), grid)
    before = np.load(grid / f"{name}.npy")
    changed = change(before.size).astype(before.dtype)
    assert (changed != before).any()
    np.save(grid / f"{name}.npy", changed)
    unseal(grid)
    assert refused(grid).field == f"{field}.npy"


def unseal(folder: Path) -> None:
    """Take the hashes away, so that what follows them is tried."""
    meta = json.loads((folder / "meta.json").read_text())
    del meta["sha256"]
    (folder / "meta.json").write_text(json.dumps(meta))


def test_saved_folder_can_be_read_by_others_and_holds_nothing_else(folder: Path) -> None:
    assert folder.stat().st_mode & 0o777 == 0o755
    expected = {"meta.json", "names.json", *(f"{name}.npy" for name in ARRAY_NAMES)}
    assert {path.name for path in folder.iterdir()} == expected
    assert [path.name for path in folder.parent.iterdir()] == ["triangle"]


def test_graph_saved_over_a_graph_replaces_it(folder: Path) -> None:
    save_graph(triangle("newer"), folder)
    assert load_meta(folder).name == "newer"
    assert [path.name for path in folder.parent.iterdir()] == ["triangle"]


def test_graph_saved_into_an_empty_folder_is_stored(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    save_graph(triangle(), tmp_path / "empty")
    assert_same(load_graph(tmp_path / "empty"), triangle())


def test_folder_with_something_else_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "precious").mkdir()
    (tmp_path / "precious" / "thesis.txt").write_text("years of work")
    with pytest.raises(FileExistsError, match="holds no graph"):
        save_graph(triangle(), tmp_path / "precious")
    assert [path.name for path in tmp_path.rglob("*")] == ["precious", "thesis.txt"]


@pytest.mark.parametrize(
    "meta", ['{"title": "thesis"}', '{"format_version": 1}', '{"link_count": 6}', "[]", "", "{", "[" * 100_000]
)
def test_folder_with_a_foreign_meta_file_is_not_overwritten(tmp_path: Path, meta: str) -> None:
    (tmp_path / "precious").mkdir()
    (tmp_path / "precious" / "meta.json").write_text(meta)
    (tmp_path / "precious" / "thesis.txt").write_text("years of work")
    with pytest.raises(FileExistsError):
        save_graph(triangle(), tmp_path / "precious")
    assert (tmp_path / "precious" / "thesis.txt").is_file()


def test_graph_of_another_version_is_replaced(folder: Path) -> None:
    meta = json.loads((folder / "meta.json").read_text())
    (folder / "meta.json").write_text(json.dumps(meta | {"format_version": FORMAT_VERSION + 1}))
    save_graph(triangle(), folder)
    assert_same(load_graph(folder), triangle())


def test_graph_saved_over_a_link_to_a_graph_replaces_what_it_points_to(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(folder)
    save_graph(triangle("newer"), tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert load_meta(folder).name == "newer"
    assert {path.name for path in tmp_path.iterdir()} == {"graphs", "link"}


def test_file_in_the_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("here")
    with pytest.raises(OSError, match="file"):
        save_graph(triangle(), tmp_path / "file")
    assert (tmp_path / "file").read_text() == "here"


def full_disk(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("fault", ["array", "text", "move"])
def test_interrupted_save_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    fail_at(monkeypatch, fault)
    with pytest.raises(OSError, match="No space left"):
        save_graph(triangle(), tmp_path / "graph")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("fault", ["array", "text", "move", "second move"])
def test_interrupted_save_over_a_graph_keeps_the_old_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    fail_at(monkeypatch, fault)
    with pytest.raises(OSError, match="No space left"):
        save_graph(triangle("newer"), folder)
    monkeypatch.undo()
    assert_same(load_graph(folder), triangle())
    assert [path.name for path in folder.parent.iterdir()] == ["triangle"]


def test_old_graph_that_cannot_be_moved_back_is_left_beside_its_place(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fail_at(monkeypatch, "later moves")
    with pytest.raises(OSError, match="No space left"):
        save_graph(triangle("newer"), folder)
    monkeypatch.undo()
    (scratch,) = folder.parent.iterdir()
    assert_same(load_graph(scratch / "old"), triangle())


def fail_at(monkeypatch: pytest.MonkeyPatch, fault: str) -> None:
    """Let a disk run full at the fifth array, the meta file or some of the moves."""
    if fault == "array":
        whole, calls = np.save, iter(range(1000))

        def save(*arguments: object, **options: object) -> None:
            (full_disk if next(calls) == 4 else whole)(*arguments, **options)

        monkeypatch.setattr(files.np, "save", save)
    elif fault == "text":
        monkeypatch.setattr(files, "_meta_json", full_disk)
    else:
        failing = {"move": range(9), "second move": range(1, 2), "later moves": range(1, 9)}[fault]
        move, moves = os.replace, iter(range(1000))
        monkeypatch.setattr(files, "exchanged", lambda *_: False)  # as on systems that can't

        def replace(*arguments: Path) -> None:
            (full_disk if next(moves) in failing else move)(*arguments)

        monkeypatch.setattr(files.os, "replace", replace)


def test_interrupt_from_the_keyboard_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(files, "_meta_json", interrupt)
    with pytest.raises(KeyboardInterrupt):
        save_graph(triangle(), tmp_path / "graph")
    assert list(tmp_path.iterdir()) == []


def refused(folder: Path) -> GraphFormatError:
    with pytest.raises(GraphFormatError) as refusal:
        load_graph(folder)
    error = refusal.value
    assert error.path == str(folder)
    assert error.field in str(error)
    assert error.allowed in str(error)
    return error


@pytest.mark.parametrize("version", [0, FORMAT_VERSION + 1, "1.0", None])
def test_graph_of_another_version_is_refused_with_both_versions(folder: Path, version: object) -> None:
    meta = json.loads((folder / "meta.json").read_text())
    (folder / "meta.json").write_text(json.dumps(meta | {"format_version": version}))
    error = refused(folder)
    assert (error.field, error.value) == ("format_version", version)
    assert error.allowed.startswith(str(FORMAT_VERSION))


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"format_version": 1}', "\x00\xff", "[" * 100_000])
def test_damaged_meta_file_is_refused(folder: Path, text: str) -> None:
    (folder / "meta.json").write_text(text)
    assert refused(folder).field in ("meta.json", "format_version")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("terrain", "guessed"),
        ("bbox", [1.0, 2.0]),
        ("bbox", None),
        ("smoothing_m", "far"),
        ("dropped", {"a": "b"}),
        ("dropped", []),
        ("cut_off", 3),
        ("cut_off", [{"link_count": 2}]),
    ],
)
def test_meta_file_with_a_wrong_field_is_refused(folder: Path, field: str, value: object) -> None:
    meta = json.loads((folder / "meta.json").read_text())
    (folder / "meta.json").write_text(json.dumps(meta | {field: value}))
    assert refused(folder).field == "meta.json"


def test_folder_without_a_graph_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.txt").write_text("no graph")
    assert refused(tmp_path).field == "meta.json"
    assert refused(tmp_path / "absent").field == "meta.json"


@pytest.mark.parametrize("name", ARRAY_NAMES)
def test_missing_array_is_refused_by_its_name(folder: Path, name: str) -> None:
    (folder / f"{name}.npy").unlink()
    assert refused(folder).field == f"{name}.npy"


@pytest.mark.parametrize("name", ARRAY_NAMES)
def test_truncated_array_is_refused_by_its_name(folder: Path, name: str) -> None:
    path = folder / f"{name}.npy"
    path.write_bytes(path.read_bytes()[:-3])
    unseal(folder)
    assert refused(folder).field == f"{name}.npy"


@pytest.mark.parametrize("content", [b"\x93NUMPY", b"not an array"])
def test_damaged_array_is_refused_by_its_name(folder: Path, content: bytes) -> None:
    (folder / "length_m.npy").write_bytes(content)
    unseal(folder)
    assert refused(folder).field == "length_m.npy"


def npy(header: str) -> bytes:
    """An array file with a header of one's own and 48 bytes of content."""
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode("latin-1") + bytes(48)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"PK\x03\x04",
        b"\x93NUMPY\x01\x00\x10\x00{'descr': 'oops'}",
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (6,"),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (6,), }}"),
        npy("{'descr': 'nonsense', 'fortran_order': False, 'shape': (6,), }"),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-6,), }"),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (6, 1), }"),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (), }"),
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (10**40,), }"),
        npy(f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({10**40},), }}"),
        npy("{'descr': '|O', 'fortran_order': False, 'shape': (6,), }"),
        npy("-" * 9000 + "1"),
        npy("(" * 9000),
    ],
)
def test_array_file_without_content_or_header_is_refused_by_its_name(folder: Path, content: bytes) -> None:
    (folder / "length_m.npy").write_bytes(content)
    unseal(folder)
    assert refused(folder).field == "length_m.npy"


@pytest.mark.parametrize("name", ["length_m", "node_id", "geometry_first", "geometry_lon_e7", "successor"])
def test_array_of_another_length_is_refused(folder: Path, name: str) -> None:
    path = folder / f"{name}.npy"
    array = np.load(path)
    np.save(path, np.concatenate((array, array[-1:])))
    unseal(folder)
    assert isinstance(refused(folder), GraphFormatError)


@pytest.mark.parametrize(
    ("name", "dtype"),
    [("tail", np.float64), ("length_m", np.int32), ("successor", np.int64), ("head", ">i4"), ("urban", np.int8)],
)
def test_array_of_another_type_is_refused(folder: Path, name: str, dtype: str | type) -> None:
    path = folder / f"{name}.npy"
    np.save(path, np.load(path).astype(dtype))
    unseal(folder)
    assert refused(folder).field == f"{name}.npy"


def test_checked_types_are_the_declared_ones() -> None:
    declared = {field.name: field.type for field in fields(RoadGraph) if field.name in ARRAY_NAMES}
    kinds = {name: "bool_" if kind is np.bool_ else kind.__name__ for name, kind in ARRAY_DTYPES.items()}
    assert {name: f"NDArray[np.{kind}]" for name, kind in kinds.items()} == declared


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("tail", -1, "0..2"),
        ("tail", 3, "0..2"),
        ("head", -1, "0..2"),
        ("head", 3, "0..2"),
        ("successor", -1, "0..2"),
        ("successor", 3, "0..2"),
        ("reverse_idx", -2, "-1..2"),
        ("reverse_idx", 3, "-1..2"),
        ("functional_class", -1, "0..7"),
        ("functional_class", 8, "0..7"),
        ("cross", -1, "0..3"),
        ("cross", 4, "0..3"),
        ("name_idx", -1, "0..2147483647"),
        ("length_m", 0.0, "finite values above 0"),
        ("length_m", -1.5, "finite values above 0"),
        ("length_m", np.inf, "finite values above 0"),
        ("length_m", np.nan, "finite values above 0"),
        ("speed_limit_mps", 0.0, "finite values above 0"),
        ("speed_limit_mps", np.nan, "finite values above 0"),
        ("node_height_m", -np.inf, "finite values"),
        ("node_height_m", np.inf, "finite values"),
        ("node_height_m", np.nan, "finite values"),
    ],
)
def test_value_out_of_range_is_refused(folder: Path, name: str, value: float, allowed: str) -> None:
    change(folder, name, 1, value)
    error = refused(folder)
    assert (error.field, error.allowed) == (f"{name}.npy", allowed)
    assert error.value == pytest.approx(value, abs=0.0, nan_ok=True)


@pytest.mark.parametrize("name", ["successor_first", "geometry_first"])
@pytest.mark.parametrize(
    ("at", "value", "allowed"), [(0, 1, "0"), (0, -1, "0"), (2, 99, "never fall"), (3, -(2**62), "never fall")]
)
def test_row_starts_that_fall_or_do_not_begin_at_zero_are_refused(
    folder: Path, name: str, at: int, value: int, allowed: str
) -> None:
    change(folder, name, at, value)
    error = refused(folder)
    assert error.field == f"{name}.npy"
    assert str(value) in str(error.value)
    assert allowed in error.allowed


@pytest.mark.parametrize("name", ["successor_first", "geometry_first"])
def test_row_starts_without_content_are_refused(folder: Path, name: str) -> None:
    np.save(folder / f"{name}.npy", np.empty(0, np.int64))
    unseal(folder)
    assert refused(folder).field == f"{name}.npy"


def change(folder: Path, name: str, at: int, value: float) -> None:
    array = np.load(folder / f"{name}.npy")
    array[at] = value
    np.save(folder / f"{name}.npy", array)
    unseal(folder)


@pytest.mark.parametrize("text", ["", "[", "\x00", "[" * 100_000])
def test_damaged_names_file_is_refused(folder: Path, text: str) -> None:
    (folder / "names.json").write_text(text)
    unseal(folder)
    assert refused(folder).field == "names.json"


@pytest.mark.parametrize("text", ["5", "{}", "[]", '["", "Carrer Major"]', '["", "Carrer Major", 3]', '"abc"', "null"])
def test_names_file_without_the_names_is_refused(folder: Path, text: str) -> None:
    (folder / "names.json").write_text(text)
    unseal(folder)
    assert refused(folder).field == "names.json"


def test_copied_graph_loads_from_its_new_place(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "elsewhere")
    assert_same(load_graph(tmp_path / "elsewhere"), triangle())


@pytest.mark.parametrize(
    ("cut", "value"),
    [([0, 3], "3"), ([-1], "-1"), ([1, 1], "1 after 1"), ([2, 0], "0 after 2"), ([[0]], "of shape (1, 1)")],
)
def test_cut_nodes_that_are_none_of_the_graph_are_refused(folder: Path, cut: list[int], value: str) -> None:
    np.save(folder / "cut_node.npy", np.array(cut, np.int32))
    unseal(folder)
    with pytest.raises(GraphFormatError) as error:
        load_graph(folder)
    assert error.value.field == "cut_node.npy"
    assert value in str(error.value)


def test_graph_without_a_record_of_cut_roads_loads_as_before(folder: Path) -> None:
    assert not (folder / "cut_node.npy").exists()
    assert load_graph(folder).cut_node is None
    np.save(folder / "cut_node.npy", np.empty(0, np.int32))
    unseal(folder)
    cut = load_graph(folder).cut_node
    assert cut is not None
    assert cut.size == 0
