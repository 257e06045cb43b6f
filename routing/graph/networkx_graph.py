"""A RoadGraph as a networkx MultiDiGraph that OSMnx understands, and back without loss."""

from __future__ import annotations

import gzip
import json
import os
import tempfile
import zlib
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree

import networkx as nx
import numpy as np
import shapely

from energy.stops import FunctionalClass
from routing.errors import GraphFormatError
from routing.graph.conditional_limits import conditional_limits_from
from routing.graph.earth import E7
from routing.graph.ferries import Ferries, ferries_from
from routing.graph.link_copies import LinkCopies, link_copies_from
from routing.graph.road_graph import (
    FORMAT_VERSION,
    GraphMeta,
    RoadGraph,
    Terrain,
    cut_off_parts,
    left_out_ferries,
    meta_fields,
)
from routing.graph.signs import RoadSigns, signs_from

if TYPE_CHECKING:
    from numpy.typing import NDArray

    NetworkxGraph = nx.MultiDiGraph[Any]

_CONDITIONAL_KEY: Final = "joulepath_conditional_limits"
_CUT_KEY: Final = "joulepath_cut_node"
_FERRIES_KEY: Final = "joulepath_ferries"
_NAMESPACE: Final = "http://graphml.graphdrawing.org/xmlns"
_NAMESPACE_WITHIN: Final = 4096  # bytes from the beginning, in which the root names it
_GZIP_MARK: Final = b"\x1f\x8b"
_MOST_UNPACKED_BYTES: Final = 512 << 20  # what lies behind is missing, so that the file is refused
_COPIES_KEY: Final = "joulepath_link_copies"
_SIGNS_KEY: Final = "joulepath_signs"
_SIGN_IDX: Final = "sign_idx"
_VERSION_KEY: Final = "joulepath_format_version"
_HIGHWAY: Final = {c: c.name.lower() for c in FunctionalClass}


def to_networkx(graph: RoadGraph) -> NetworkxGraph:
    """The graph as OSMnx lays it out, with what it takes to rebuild the RoadGraph exactly.

    Graph: crs, simplified; the version, meta and names as JSON. Nodes, by node_id (by index where ids are not unique):
    x, y [deg], elevation [m], street_count. Edges: osmid, highway, name, maxspeed (text, km/h), length [m],
    speed_kph, grade (rise over length), oneway, reversed, geometry (LineString), and with the RoadGraph's names
    functional_class, cross, urban, structure, speed_limit_mps, idx, reverse_idx, successors (indices, as text). Ferries
    have no highway but route and duration_s [s]; copies of links name theirs as copy_of.
    """
    meta = graph.meta
    result: NetworkxGraph = nx.MultiDiGraph(
        crs="epsg:4326",
        simplified=True,
        created_with="joulepath",
        joulepath_format_version=FORMAT_VERSION,
        joulepath_meta=json.dumps(meta_fields(meta), ensure_ascii=False),
        joulepath_names=json.dumps(graph.names, ensure_ascii=False),
    )
    if graph.conditional is not None:
        result.graph[_CONDITIONAL_KEY] = json.dumps(graph.conditional.columns())
    if graph.cut_node is not None:
        result.graph[_CUT_KEY] = json.dumps(graph.cut_node.tolist())
    if graph.copies is not None:
        result.graph[_COPIES_KEY] = json.dumps(graph.copies.columns())
    if graph.signs is not None:
        columns = graph.signs.columns() | {_SIGN_IDX: graph.signs.sign_idx.tolist()}
        result.graph[_SIGNS_KEY] = json.dumps(columns, ensure_ascii=False)
    carried_s: dict[int, float] = {}
    if graph.ferries is not None:
        result.graph[_FERRIES_KEY] = json.dumps(graph.ferries.columns())
        carried_s = dict(zip(graph.ferries.link.tolist(), graph.ferries.duration_s.tolist(), strict=True))
    unique = np.unique(graph.node_id).size == graph.node_count
    key = graph.node_id.tolist() if unique else list(range(graph.node_count))
    streets = _street_counts(graph)
    for idx, (node, x, y, height, count, node_id) in enumerate(
        zip(
            key,
            graph.node_lon_deg.tolist(),
            graph.node_lat_deg.tolist(),
            graph.node_height_m.tolist(),
            streets.tolist(),
            graph.node_id.tolist(),
            strict=True,
        )
    ):
        result.add_node(node, x=x, y=y, elevation=height, street_count=count, idx=idx, node_id=node_id)
    lines: Any = shapely.linestrings(
        np.column_stack((graph.geometry_lon_e7 / E7, graph.geometry_lat_e7 / E7)),
        indices=np.repeat(np.arange(graph.link_count), np.diff(graph.geometry_first)),
    )
    climb_m = graph.climb_m()
    seen: dict[tuple[int, int], int] = {}
    for idx in range(graph.link_count):
        ends = key[graph.tail[idx]], key[graph.head[idx]]
        parallel = seen[ends] = seen.get(ends, -1) + 1
        reverse_idx = int(graph.reverse_idx[idx])
        speed_mps = float(graph.speed_limit_mps[idx])
        data: dict[str, Any] = {
            "osmid": int(graph.way_id[idx]),
            "highway": _HIGHWAY[FunctionalClass(int(graph.functional_class[idx]))],
            "maxspeed": f"{speed_mps * 3.6:.4g}",
            "oneway": reverse_idx < 0,
            "reversed": 0 <= reverse_idx < idx,
            "length": float(graph.length_m[idx]),
            "speed_kph": speed_mps * 3.6,
            "grade": float(climb_m[idx] / graph.length_m[idx]),
            "geometry": lines[idx],
            "functional_class": int(graph.functional_class[idx]),
            "cross": int(graph.cross[idx]),
            "urban": bool(graph.urban[idx]),
            "structure": bool(graph.structure[idx]),
            "speed_limit_mps": speed_mps,
            "name_idx": int(graph.name_idx[idx]),
            "idx": idx,
            "reverse_idx": reverse_idx,
            "successors": " ".join(map(str, graph.successors(idx).tolist())),
        }
        name = graph.names[data["name_idx"]] if graph.names else ""
        if name:
            data["name"] = name
        if data["structure"]:
            data["bridge"] = "yes"
        if idx >= graph.road_link_count:
            (data["copy_of"],) = graph.originals((idx,))
        if idx in carried_s:
            data.pop("highway")
            data.pop("bridge", None)
            data["route"], data["duration_s"] = "ferry", carried_s[idx]
        result.add_edge(*ends, key=parallel, **data)
    return result


def _street_counts(graph: RoadGraph) -> NDArray[np.int64]:
    """Number of streets at each node, a two-way one counted once, int64 (N,)."""
    once = ((graph.reverse_idx < 0) | (graph.reverse_idx > np.arange(graph.link_count))) & ~graph.is_copy()
    ends = np.concatenate((graph.tail[once], graph.head[once]))
    return np.bincount(ends, minlength=graph.node_count)


def is_export(graph: NetworkxGraph) -> bool:
    """Whether to_networkx made the graph (of whatever version)."""
    return _VERSION_KEY in graph.graph


def from_networkx(graph: NetworkxGraph, source: str = "networkx graph") -> RoadGraph:
    """The RoadGraph that to_networkx was given, equal in every array; values may be native or text, as in GraphML.

    source: named in errors. Raises GraphFormatError when the graph is no export, is one of another version, or lost
    nodes, edges or attributes; such graphs go through routing.importers.graphml.roads_from_networkx.
    """
    if not is_export(graph):
        raise GraphFormatError(source, _VERSION_KEY, "missing", "a graph that joulepath exported")
    version = str(graph.graph[_VERSION_KEY])
    if version != str(FORMAT_VERSION):
        raise GraphFormatError(source, _VERSION_KEY, version, f"{FORMAT_VERSION}; export the graph again")
    try:
        return _rebuilt(graph)
    except (LookupError, ValueError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        allowed = "all nodes, edges and attributes of the export"
        raise GraphFormatError(source, "content", f"damaged ({error!r})", allowed) from error


def _rebuilt(graph: NetworkxGraph) -> RoadGraph:
    nodes = sorted(((int(d["idx"]), node, d) for node, d in graph.nodes(data=True)), key=lambda row: row[0])
    edges = sorted(((int(d["idx"]), u, v, d) for u, v, d in graph.edges(data=True)), key=lambda row: row[0])
    if [row[0] for row in nodes] != list(range(len(nodes))) or [row[0] for row in edges] != list(range(len(edges))):
        raise ValueError("indices have gaps")
    idx_of = {node: idx for idx, node, _ in nodes}
    data = [row[3] for row in edges]
    lines = [_line(d["geometry"]) for d in data]
    points = np.rint(np.concatenate(lines) * E7).astype(np.int32)
    successors = [[int(s) for s in str(d["successors"]).split()] for d in data]
    successor = np.array([s for row in successors for s in row], np.int32)
    if successor.size and not 0 <= int(successor.min()) <= int(successor.max()) < len(edges):
        raise ValueError("successors name unknown edges")
    raw = json.loads(graph.graph["joulepath_meta"])
    conditional = graph.graph.get(_CONDITIONAL_KEY)
    cut = graph.graph.get(_CUT_KEY)
    cut_node = None if cut is None else np.unique(np.array(json.loads(cut), np.int32))
    if cut_node is not None and cut_node.size and not 0 <= int(cut_node[0]) <= int(cut_node[-1]) < len(nodes):
        raise ValueError("roads are cut at unknown nodes")
    west, south, east, north = (float(x) for x in raw["bbox"])
    meta = GraphMeta(
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
    node_data = [row[2] for row in nodes]
    rebuilt = RoadGraph(
        meta=meta,
        names=tuple(json.loads(graph.graph["joulepath_names"])),
        node_lat_deg=np.array([float(d["y"]) for d in node_data]),
        node_lon_deg=np.array([float(d["x"]) for d in node_data]),
        node_height_m=np.array([float(d["elevation"]) for d in node_data]),
        node_id=np.array([int(d["node_id"]) for d in node_data], np.int64),
        tail=np.array([idx_of[row[1]] for row in edges], np.int32),
        head=np.array([idx_of[row[2]] for row in edges], np.int32),
        length_m=np.array([float(d["length"]) for d in data]),
        speed_limit_mps=np.array([float(d["speed_limit_mps"]) for d in data]),
        functional_class=np.array([int(d["functional_class"]) for d in data], np.int8),
        cross=np.array([int(d["cross"]) for d in data], np.int8),
        urban=np.array([_truth(d["urban"]) for d in data], np.bool_),
        structure=np.array([_truth(d["structure"]) for d in data], np.bool_),
        way_id=np.array([int(d["osmid"]) for d in data], np.int64),
        name_idx=np.array([int(d["name_idx"]) for d in data], np.int32),
        reverse_idx=np.array([int(d["reverse_idx"]) for d in data], np.int32),
        geometry_first=np.concatenate(([0], np.cumsum([len(line) for line in lines]))).astype(np.int64),
        geometry_lon_e7=np.ascontiguousarray(points[:, 0]),
        geometry_lat_e7=np.ascontiguousarray(points[:, 1]),
        successor_first=np.concatenate(([0], np.cumsum([len(row) for row in successors]))).astype(np.int64),
        successor=successor,
        conditional=conditional_limits_from(json.loads(conditional), len(edges)) if conditional else None,
        cut_node=cut_node,
    )
    return replace(
        rebuilt, ferries=_ferries(graph, rebuilt), copies=_copies(graph, rebuilt), signs=_signs(graph, rebuilt)
    )


def _copies(graph: NetworkxGraph, rebuilt: RoadGraph) -> LinkCopies | None:
    columns = graph.graph.get(_COPIES_KEY)
    return link_copies_from(json.loads(columns), rebuilt.tail, rebuilt.head) if columns else None


def _signs(graph: NetworkxGraph, rebuilt: RoadGraph) -> RoadSigns | None:
    text = graph.graph.get(_SIGNS_KEY)
    if not text:
        return None
    columns = json.loads(text)
    return signs_from(columns, np.array(columns[_SIGN_IDX], np.int32), rebuilt.link_count, rebuilt.node_count)


def _ferries(graph: NetworkxGraph, rebuilt: RoadGraph) -> Ferries | None:
    columns = graph.graph.get(_FERRIES_KEY)
    return ferries_from(json.loads(columns), rebuilt.climb_m()) if columns else None


def _line(geometry: Any) -> NDArray[np.float64]:
    if isinstance(geometry, str) and not geometry.lstrip().upper().startswith("LINESTRING"):
        raise ValueError(f"geometry {geometry[:60]!r} is no LINESTRING")  # GEOS dies of collections within collections
    try:
        line = shapely.from_wkt(geometry) if isinstance(geometry, str) else geometry
    except shapely.errors.GEOSException as error:
        raise ValueError(f"geometry {geometry[:60]!r}: {error}") from error
    return np.asarray(shapely.get_coordinates(line), np.float64)


def _truth(value: Any) -> bool:
    if isinstance(value, str):
        if value.lower() not in ("true", "false"):
            raise ValueError(f"{value!r} is neither True nor False")
        return value.lower() == "true"
    return bool(value)


def write_graphml(graph: RoadGraph, path: Path) -> None:
    """Write to_networkx(graph) as GraphML as OSMnx does, all values as text, geometry as WKT; whole or not at all."""
    exported = to_networkx(graph)
    exported.graph = {k: str(v) for k, v in exported.graph.items()}
    for _, data in exported.nodes(data=True):
        for name, value in data.items():
            data[name] = str(value)
    for _, _, data in exported.edges(data=True):
        data["geometry"] = shapely.to_wkt(data["geometry"], rounding_precision=7)
        for name, value in data.items():
            data[name] = str(value)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, scratch = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    os.close(handle)
    try:
        nx.write_graphml_xml(exported, scratch, encoding="utf-8")
        Path(scratch).chmod(0o644)
        os.replace(scratch, path)
    except BaseException:
        Path(scratch).unlink(missing_ok=True)
        raise


def read_graphml(path: Path) -> RoadGraph:
    """The RoadGraph that write_graphml wrote; raises GraphFormatError as from_networkx does."""
    return from_networkx(load_networkx(path), str(path))


def _graphml_text(path: Path) -> bytes:
    """The content of a GraphML file, unpacked, in the namespace in which networkx looks for it."""
    text = path.read_bytes()
    if text.startswith(_GZIP_MARK):
        with gzip.open(BytesIO(text)) as packed:
            text = packed.read(_MOST_UNPACKED_BYTES)
    begin = text[:_NAMESPACE_WITHIN].replace(b"\0", b"")
    if b"<graphml" not in begin or _NAMESPACE.encode() + b'"' in begin or _NAMESPACE.encode() + b"'" in begin:
        return text
    root = ElementTree.fromstring(text)
    for element in root.iter():
        element.tag = f"{{{_NAMESPACE}}}{element.tag.rpartition('}')[2]}"
    return bytes(ElementTree.tostring(root))


def load_networkx(path: Path) -> NetworkxGraph:
    """A GraphML file as a multigraph, directed or not; raises GraphFormatError when it is none.

    Node ids are whole numbers, or text where one of them is none. The file may be packed by gzip, and its namespace
    another than GraphML's or none. An undirected export is refused.
    """
    try:
        text = _graphml_text(path)
        try:
            graph: Any = nx.read_graphml(BytesIO(text), node_type=int, edge_key_type=int, force_multigraph=True)
        except ValueError:
            graph = nx.read_graphml(BytesIO(text), node_type=str, edge_key_type=str, force_multigraph=True)
    except (OSError, EOFError, zlib.error, ValueError, LookupError, TypeError, SyntaxError, nx.NetworkXError) as error:
        raise GraphFormatError(str(path), "file", f"unreadable ({error})", "GraphML") from error
    if is_export(graph) and not graph.is_directed():
        raise GraphFormatError(str(path), "edgedefault", "undirected", "directed")
    result: NetworkxGraph = graph
    return result
