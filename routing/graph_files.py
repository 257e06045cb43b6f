"""Graphs on disk: one folder a graph, a .npy file an array (loaded memory-mapped), names.json and meta.json."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from pathlib import Path

import numpy as np

from routing.errors import GraphFormatError
from routing.graph import ARRAY_NAMES, FORMAT_VERSION, GraphMeta, RoadGraph, Terrain


def save_graph(graph: RoadGraph, folder: Path) -> None:
    """Write a graph to a folder, whole or not at all: it is written beside its place and moved there.

    An existing graph in that place is replaced. Raises FileExistsError when the folder holds something else.
    """
    if folder.exists() and not (folder / "meta.json").is_file() and any(folder.iterdir()):
        raise FileExistsError(f"{folder} is not empty and holds no graph")
    folder.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    try:
        for name in ARRAY_NAMES:
            np.save(scratch / f"{name}.npy", getattr(graph, name), allow_pickle=False)
        (scratch / "names.json").write_text(json.dumps(graph.names, ensure_ascii=False), encoding="utf-8")
        (scratch / "meta.json").write_text(_meta_json(graph), encoding="utf-8")
        scratch.chmod(0o755)
        if folder.exists():
            shutil.rmtree(folder)
        os.replace(scratch, folder)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise


def _meta_json(graph: RoadGraph) -> str:
    meta = graph.meta
    return (
        json.dumps(
            {
                "format_version": FORMAT_VERSION,
                "name": meta.name,
                "source": meta.source,
                "licence": meta.licence,
                "attribution": meta.attribution,
                "terrain": meta.terrain.value,
                "elevation_method": meta.elevation_method,
                "smoothing_m": meta.smoothing_m,
                "bbox": list(meta.bbox),
                "node_count": graph.node_count,
                "link_count": graph.link_count,
                "dropped": dict(meta.dropped),
            },
            indent=2,
            ensure_ascii=False,
        )
        + "\n"
    )


def load_meta(folder: Path) -> GraphMeta:
    """What meta.json says; raises GraphFormatError where it is missing, damaged or of another version."""
    path = str(folder)
    try:
        raw = json.loads((folder / "meta.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise GraphFormatError(path, "meta.json", f"unreadable ({error})", "a graph written by `joulepath import`") from error
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
        )
    except (KeyError, TypeError, ValueError) as error:
        raise GraphFormatError(path, "meta.json", f"damaged ({error})", "a graph written by `joulepath import`") from error


def load_graph(folder: Path) -> RoadGraph:
    """A stored graph, its arrays memory-mapped read-only; raises GraphFormatError as load_meta does."""
    meta = load_meta(folder)
    arrays = {}
    for name in ARRAY_NAMES:
        try:
            # np.asarray: numba compiles a plain read-only array, not the memmap subclass
            arrays[name] = np.asarray(np.load(folder / f"{name}.npy", mmap_mode="r", allow_pickle=False))
        except (OSError, ValueError) as error:
            raise GraphFormatError(str(folder), f"{name}.npy", f"unreadable ({error})", "an array file") from error
    try:
        names = tuple(str(x) for x in json.loads((folder / "names.json").read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise GraphFormatError(str(folder), "names.json", f"unreadable ({error})", "a list of names") from error
    links, nodes = arrays["tail"].size, arrays["node_lat_deg"].size
    for name, array in arrays.items():
        expected = {"geometry_first": links + 1, "successor_first": links + 1}.get(name, links)
        if name.startswith("node_"):
            expected = nodes
        if name in ("geometry_lon_e7", "geometry_lat_e7"):
            expected = int(arrays["geometry_first"][-1])
        if name == "successor":
            expected = int(arrays["successor_first"][-1])
        if array.shape != (expected,):
            raise GraphFormatError(str(folder), f"{name}.npy", f"of shape {array.shape}", f"({expected},)")
    return RoadGraph(meta=meta, names=names, **arrays)
