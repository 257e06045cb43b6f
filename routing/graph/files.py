"""Graphs on disk: one folder a graph, a .npy file an array, names.json, and meta.json with hashes of all of them."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
import tempfile
import tokenize
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from energy.stops import Cross, FunctionalClass
from routing.errors import GraphFormatError
from routing.graph.conditional_limits import ConditionalLimits, conditional_limits_from
from routing.graph.ferries import Ferries, ferries_from
from routing.graph.link_copies import LinkCopies, link_copies_from
from routing.graph.road_graph import (
    ARRAY_NAMES,
    FORMAT_VERSION,
    GraphMeta,
    RoadGraph,
    Terrain,
    cut_off_parts,
    left_out_ferries,
    meta_fields,
)
from routing.graph.sealed import META_FILE, SEAL, WRITTEN, GraphFiles, array_bytes, exchanged, seal_of
from routing.graph.signs import RoadSigns, signs_from
from routing.graph.structure import check_structure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

# as RoadGraph declares them; compiled kernels read what they are given
ARRAY_DTYPES: Final[Mapping[str, type[np.generic]]] = {
    "node_lat_deg": np.float64,
    "node_lon_deg": np.float64,
    "node_height_m": np.float64,
    "node_id": np.int64,
    "tail": np.int32,
    "head": np.int32,
    "length_m": np.float64,
    "speed_limit_mps": np.float64,
    "functional_class": np.int8,
    "cross": np.int8,
    "urban": np.bool_,
    "structure": np.bool_,
    "way_id": np.int64,
    "name_idx": np.int32,
    "reverse_idx": np.int32,
    "geometry_first": np.int64,
    "geometry_lon_e7": np.int32,
    "geometry_lat_e7": np.int32,
    "successor_first": np.int64,
    "successor": np.int32,
}

NAMES_FILE: Final = "names.json"
TRIES: Final = 5  # to read a graph that is replaced meanwhile
CONDITIONAL_FILE: Final = "conditional_limits.json"
CUT_NODE: Final = "cut_node"  # an array that not every graph has
FERRIES_FILE: Final = "ferries.json"
COPIES_FILE: Final = "link_copies.json"
SIGNS_FILE: Final = "signs.json"
SIGN_IDX: Final = "sign_idx"  # an array that not every graph has

# what numpy's reader lets out when a header is damaged: it is a Python literal, evaluated
_UNREADABLE: Final = (
    OSError,
    ValueError,
    TypeError,
    EOFError,
    SyntaxError,
    tokenize.TokenError,
    OverflowError,
    RecursionError,
    MemoryError,
)


def save_graph(graph: RoadGraph, folder: Path, beside: Mapping[str, bytes] | None = None) -> None:
    """Write a graph to a folder, whole or not at all: it is written beside its place and moved there.

    beside: further files of the folder, by name, of which meta.json has no hash. An existing graph in that place is
    replaced, and stays when that fails. Raises FileExistsError when the folder holds something else.
    """
    place = folder.resolve()  # a link to a folder stays a link
    if place.exists() and not _holds_graph(place) and any(place.iterdir()):
        raise FileExistsError(f"{folder} is not empty and holds no graph")
    place.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(prefix=f".{place.name}.", dir=place.parent))
    new, old = scratch / "new", scratch / "old"
    try:
        new.mkdir()
        files = _files(graph)
        for file, content in (files | dict(beside or {})).items():
            (new / file).write_bytes(content)
        (new / META_FILE).write_text(_meta_json(graph, seal_of(files)), encoding="utf-8")
        new.chmod(0o755)
        if not place.exists():
            os.replace(new, place)
        elif not exchanged(new, place):
            os.replace(place, old)
            os.replace(new, place)
    finally:
        if old.exists() and not place.exists():
            os.replace(old, place)  # where even this fails, the old graph is left in scratch
        shutil.rmtree(scratch, ignore_errors=True)


def _files(graph: RoadGraph) -> dict[str, bytes]:
    """Contents of all files of a graph but meta.json."""
    files = {f"{name}.npy": array_bytes(getattr(graph, name)) for name in ARRAY_NAMES}
    files[NAMES_FILE] = json.dumps(graph.names, ensure_ascii=False).encode()
    if graph.conditional is not None:
        files[CONDITIONAL_FILE] = json.dumps(graph.conditional.columns()).encode()
    if graph.cut_node is not None:
        files[f"{CUT_NODE}.npy"] = array_bytes(graph.cut_node)
    if graph.ferries is not None:
        files[FERRIES_FILE] = json.dumps(graph.ferries.columns()).encode()
    if graph.copies is not None:
        files[COPIES_FILE] = json.dumps(graph.copies.columns()).encode()
    if graph.signs is not None:
        files[SIGNS_FILE] = json.dumps(graph.signs.columns(), ensure_ascii=False).encode()
        files[f"{SIGN_IDX}.npy"] = array_bytes(graph.signs.sign_idx)
    return files


def _holds_graph(folder: Path) -> bool:
    """Whether joulepath wrote the folder, in whatever version."""
    try:
        raw = json.loads((folder / META_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(raw, dict) and "format_version" in raw and "link_count" in raw


def _meta_json(graph: RoadGraph, seal: Mapping[str, str]) -> str:
    return (
        json.dumps(
            {
                "format_version": FORMAT_VERSION,
                **meta_fields(graph.meta),
                "node_count": graph.node_count,
                "link_count": graph.link_count,
                SEAL: seal,
            },
            indent=2,
            ensure_ascii=False,
        )
        + "\n"
    )


def load_meta(folder: Path) -> GraphMeta:
    """What meta.json says; raises GraphFormatError where it is missing, damaged or of another version."""
    return _meta(GraphFiles(folder))


def _meta(files: GraphFiles) -> GraphMeta:
    path, raw = files.path, files.raw
    version = raw.get("format_version") if isinstance(raw, dict) else None
    if version != FORMAT_VERSION:
        raise GraphFormatError(path, "format_version", version, f"{FORMAT_VERSION}; import the map again")
    try:
        west, south, east, north = (float(x) for x in raw["bbox"])
        return GraphMeta(
            name=str(raw["name"]),
            source=str(raw["source"]),
            licence=str(raw["licence"]),
            attribution=str(raw["attribution"]),
            terrain=Terrain(raw["terrain"]),
            elevation_method=str(raw["elevation_method"]),
            smoothing_m=float(raw["smoothing_m"]),
            bbox=(west, south, east, north),
            dropped={str(k): int(v) for k, v in raw["dropped"].items()},
            cut_off=cut_off_parts(raw),
            ferries_left_out=left_out_ferries(raw),
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise GraphFormatError(path, META_FILE, f"damaged ({error})", WRITTEN) from error


def version_of(folder: Path) -> str:
    """A name for what is stored in a graph's folder now, of 16 letters; raises GraphFormatError as load_meta does."""
    return GraphFiles(folder).version


def load_graph(folder: Path) -> RoadGraph:
    """A stored graph, as load_version reads it."""
    return load_version(folder)[0]


def load_version(folder: Path) -> tuple[RoadGraph, str]:
    """A stored graph, read into memory, its arrays read-only, and its version.

    Raises GraphFormatError as load_meta does, and where a file is missing, damaged or not the one that meta.json has
    the hash of, or an array has another type, another shape, values that would lead a kernel out of its arrays, or does
    not fit the others. A graph that is replaced meanwhile is read again.
    """
    for _ in range(TRIES):
        files = GraphFiles(folder)
        try:
            return _read(files), files.version
        except GraphFormatError:
            if files.is_current():
                raise
    raise GraphFormatError(str(folder), META_FILE, "replaced again and again while it was read", WRITTEN)


def _read(files: GraphFiles) -> RoadGraph:
    meta = _meta(files)
    arrays = {name: _array(files, name) for name in ARRAY_NAMES}
    _check_shapes(files.path, arrays)
    _check_values(files.path, arrays)
    copies = _copies(files, arrays)
    check_structure(files.path, arrays, copies)
    return RoadGraph(
        meta=meta,
        names=_names(files, count=int(arrays["name_idx"].max(initial=-1)) + 1),
        conditional=_conditional(files, arrays["tail"].size),
        cut_node=_cut_node(files, arrays["node_lat_deg"].size),
        ferries=_ferries(files, arrays),
        copies=copies,
        signs=_signs(files, arrays["tail"].size, arrays["node_lat_deg"].size),
        **arrays,
    )


def _cut_node(files: GraphFiles, node_count: int) -> NDArray[np.int32] | None:
    """Nodes at which roads are cut, None where the graph has no record of them."""
    if not files.has(f"{CUT_NODE}.npy"):
        return None
    array = _array(files, CUT_NODE)
    path, file, allowed = files.path, f"{CUT_NODE}.npy", f"ascending, 0..{node_count - 1}"
    for value in (array.min(initial=0).item(), array.max(initial=0).item()):
        if not 0 <= value < node_count:
            raise GraphFormatError(path, file, value, allowed)
    falls = array[1:] <= array[:-1]
    if falls.any():
        k = int(falls.argmax())
        raise GraphFormatError(path, file, f"{array[k + 1]} after {array[k]}", allowed)
    return array


def _copies(files: GraphFiles, arrays: Mapping[str, NDArray[Any]]) -> LinkCopies | None:
    """Copies of links, None where the graph has none."""
    if not files.has(COPIES_FILE):
        return None
    content = files.read(COPIES_FILE)
    try:
        return link_copies_from(json.loads(content), arrays["tail"], arrays["head"])
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        allowed = "links of the graph that its last links lie on, as `joulepath import` writes them"
        raise GraphFormatError(files.path, COPIES_FILE, f"damaged ({error})", allowed) from error


def _ferries(files: GraphFiles, arrays: Mapping[str, NDArray[Any]]) -> Ferries | None:
    """Ferries, None where the graph has none."""
    if not files.has(FERRIES_FILE):
        return None
    content = files.read(FERRIES_FILE)
    height_m = arrays["node_height_m"]
    try:
        return ferries_from(json.loads(content), height_m[arrays["head"]] - height_m[arrays["tail"]])
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        allowed = "links of the graph with both ends at one height, as `joulepath import` writes them"
        raise GraphFormatError(files.path, FERRIES_FILE, f"damaged ({error})", allowed) from error


def _signs(files: GraphFiles, link_count: int, node_count: int) -> RoadSigns | None:
    """What drivers read along links, None where the graph has no record of it."""
    if not files.has(SIGNS_FILE):
        return None
    content, sign_idx = files.read(SIGNS_FILE), _array(files, SIGN_IDX)
    try:
        return signs_from(json.loads(content), sign_idx, link_count, node_count)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        allowed = "signs of links of the graph, as `joulepath import` writes them"
        raise GraphFormatError(files.path, SIGNS_FILE, f"damaged ({error})", allowed) from error


def _conditional(files: GraphFiles, link_count: int) -> ConditionalLimits | None:
    """Limits under a condition, None where the graph has none."""
    if not files.has(CONDITIONAL_FILE):
        return None
    content = files.read(CONDITIONAL_FILE)
    try:
        return conditional_limits_from(json.loads(content), link_count)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        allowed = "limits of links of the graph, as `joulepath import` writes them"
        raise GraphFormatError(files.path, CONDITIONAL_FILE, f"damaged ({error})", allowed) from error


def _array(files: GraphFiles, name: str) -> NDArray[Any]:
    """A one-dimensional array of the declared type."""
    file, dtype = f"{name}.npy", np.dtype(ARRAY_DTYPES.get(name, np.int32))
    content = files.read(file)
    try:
        array: NDArray[Any] = np.lib.format.read_array(BytesIO(content), allow_pickle=False)
    except _UNREADABLE as error:
        raise GraphFormatError(files.path, file, f"unreadable ({error})", "an array file") from error
    if array.dtype != dtype:
        raise GraphFormatError(files.path, file, f"of type {array.dtype}", str(dtype))
    if array.ndim != 1:
        raise GraphFormatError(files.path, file, f"of shape {array.shape}", "one dimension")
    return array


def _names(files: GraphFiles, count: int) -> tuple[str, ...]:
    """The names, at least count."""
    path, file = files.path, NAMES_FILE
    content = files.read(file)
    try:
        names = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise GraphFormatError(path, file, f"unreadable ({error})", "a list of names") from error
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise GraphFormatError(path, file, "something else", "a list of strings")
    if len(names) < count:
        raise GraphFormatError(path, file, f"a list of {len(names)} names", f"at least {count}, as name_idx.npy needs")
    return tuple(names)


def _check_shapes(path: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    links, nodes = arrays["tail"].size, arrays["node_lat_deg"].size
    firsts = ("geometry_first", "successor_first")
    for name in firsts:
        _check_size(path, name, arrays[name], links + 1)
        _check_first(path, name, arrays[name])
    sizes = {"successor": int(arrays["successor_first"][-1])}
    sizes["geometry_lon_e7"] = sizes["geometry_lat_e7"] = int(arrays["geometry_first"][-1])
    for name, array in arrays.items():
        if name not in firsts:
            _check_size(path, name, array, sizes.get(name, nodes if name.startswith("node_") else links))


def _check_size(path: str, name: str, array: NDArray[Any], size: int) -> None:
    if array.size != size:
        raise GraphFormatError(path, f"{name}.npy", f"of shape {array.shape}", f"({size},)")


def _check_first(path: str, name: str, first: NDArray[np.int64]) -> None:
    """Refuse row starts that do not begin at 0 or that fall."""
    if first[0] != 0:
        raise GraphFormatError(path, f"{name}.npy", f"{first[0]} at its begin", "0")
    falls = first[1:] < first[:-1]
    if falls.any():
        k = int(falls.argmax())
        raise GraphFormatError(path, f"{name}.npy", f"{first[k + 1]} after {first[k]}", "values that never fall")


def _check_values(path: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Refuse values outside their range; reads each of these arrays once or twice, and NaN is outside."""
    links, nodes = arrays["tail"].size, arrays["node_lat_deg"].size
    whole = {
        "tail": (0, nodes - 1),
        "head": (0, nodes - 1),
        "successor": (0, links - 1),
        "reverse_idx": (-1, links - 1),
        "functional_class": (0, len(FunctionalClass) - 1),
        "cross": (0, len(Cross) - 1),
        "name_idx": (0, np.iinfo(np.int32).max),
    }
    least, most = math.ulp(0.0), sys.float_info.max
    ranges: dict[str, tuple[float, float, str]] = {k: (low, high, f"{low}..{high}") for k, (low, high) in whole.items()}
    ranges["length_m"] = ranges["speed_limit_mps"] = (least, most, "finite values above 0")
    ranges["node_height_m"] = (-most, most, "finite values")
    for name, (low, high, allowed) in ranges.items():
        array = arrays[name]
        if array.size == 0:
            continue
        for value in (array.min().item(), array.max().item()):
            if not low <= value <= high:
                raise GraphFormatError(path, f"{name}.npy", value, allowed)
