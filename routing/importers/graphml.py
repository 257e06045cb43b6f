"""Reads the roads of a GraphML file or networkx graph laid out as OSMnx does."""

from __future__ import annotations

import ast
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from routing.errors import ImportFailedError
from routing.graph.earth import E7
from routing.importers.elevation_cells import HIGHEST_M, LOWEST_M
from routing.importers.graphml_lines import lines_of, lonlat_deg, projection_of, refuse_swapped_axes
from routing.importers.roads import Roads, Ways, short_distance_m
from routing.importers.speeds import HIGHEST_KMH, KMH, LOWEST_KMH, limit_mps_from_value, may_be_unlimited
from routing.importers.tags import (
    Control,
    Dropped,
    RoadClass,
    car_may_pass,
    control,
    is_roundabout,
    is_structure,
    road_class,
)

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator

    import networkx as nx
    from numpy.typing import NDArray
    from rasterio.crs import CRS

_PLAIN_STRETCH: Final = (0.5, 20.0)  # of an edge's stated length over that of its line; outside, the line is right
_ABSENT: Final = frozenset(("", "nan", "NaN", "None", "<NA>", "NaT"))
_ID_LIMIT: Final = 1 << 62


def roads_from_networkx(graph: nx.MultiDiGraph[Any] | nx.MultiGraph[Any], source: str) -> Roads:
    """The roads of an OSMnx graph; two edges over the same line in opposite directions become one two-way road.

    Read are, of nodes, x, y [deg, or in the graph's crs], elevation [m] and highway; of edges, length [m], geometry
    (LineString or WKT), highway, maxspeed, speed_kph, name, ref, bridge, tunnel, junction and the access tags; values
    may be lists, and texts that stand for a missing value count as none. The stated length holds. Of an undirected
    graph each edge is driven both ways, or as its `oneway`, `from` and `to` say.
    Raises ImportFailedError naming what is missing or out of range.
    """
    if graph.number_of_edges() == 0:
        raise ImportFailedError("map", source, "the graph has no edges")
    crs = projection_of(str(graph.graph.get("crs", "epsg:4326")))
    nodes = list(graph.nodes(data=True))
    node_idx: dict[Hashable, int] = {node: number for number, (node, _) in enumerate(nodes)}
    ids = [node for node in node_idx if isinstance(node, int) and abs(node) < _ID_LIMIT]
    if len(ids) < len(node_idx):
        ids = list(node_idx.values())
    given = [(_coordinate(data, "x", node, crs), _coordinate(data, "y", node, crs)) for node, data in nodes]
    place_deg = lonlat_deg(crs, np.array(given, np.float64), "node x, y")
    height = [_elevation_m(data, node) for node, data in nodes]
    controls: dict[int, Control] = {}
    for number, (_, data) in enumerate(nodes):
        tags = {k: _first(v) for k, v in data.items() if isinstance(v, str)}
        found = control({**tags, "highway": ";".join(_values(data.get("highway")))})
        if found is not None:
            controls[number] = found
    place_e7 = np.rint(place_deg * E7).astype(np.int64)
    lon_e7, lat_e7 = place_e7[:, 0].tolist(), place_e7[:, 1].tolist()

    dropped: Counter[str] = Counter()
    edges: list[tuple[int, int, dict[str, Any], RoadClass]] = []
    for u, v, data in _directed_edges(graph, source):
        tags = _tags(data)
        kind = next((c for value in _values(data.get("highway")) if (c := road_class(value))), None)
        if kind is None or not car_may_pass(tags):
            dropped[Dropped.ACCESS] += 1
        else:
            edges.append((node_idx[u], node_idx[v], data, kind))
    if not edges:
        raise ImportFailedError("map", source, "no edge in it may be driven by car")
    ends = np.array([(u, v) for u, v, _, _ in edges])
    node_names = list(node_idx)
    lines = lines_of(
        [None if _absent(data.get("geometry")) else data["geometry"] for _, _, data, _ in edges],
        [f"{node_names[u]} -> {node_names[v]}" for u, v, _, _ in edges],
        place_deg[ends[:, 0]],
        place_deg[ends[:, 1]],
        crs,
    )
    names: dict[str, int] = {"": 0}
    rows: list[_Road] = []
    waiting: dict[tuple[Any, ...], list[_Road]] = {}  # roads that lack their other direction, by what it has to be
    for (u, v, data, kind), line in zip(edges, lines, strict=True):
        osmids = tuple(sorted(set(_values(data.get("osmid")))))  # lists are in driving order, or in none
        limit = _limit_mps(data, source, dropped)
        mates = waiting.get((u, v, osmids, tuple(line)))
        if mates:
            mate = mates.pop()
            mate.backward, mate.backward_mps = True, limit
            continue
        tags = _tags(data)
        label = tags.get("name") or tags.get("ref") or ""
        road = _Road(
            tail=u,
            head=v,
            line=line,
            way_id=_whole(_first(data.get("osmid"))),
            kind=kind,
            roundabout=is_roundabout(tags),
            structure=any(
                is_structure({k: x}) for k in ("bridge", "tunnel") for x in _values(data.get(k)) if x != "False"
            ),
            name_idx=names.setdefault(label, len(names)),
            length_m=_length_m(data, source),
            forward_mps=limit,
        )
        rows.append(road)
        waiting.setdefault((v, u, osmids, tuple(reversed(line))), []).append(road)

    first = [0]
    point: list[int] = []
    lowest_id = min(0, min(ids))
    added = 0
    for road in rows:
        point.append(road.tail)
        for x, y in road.line:
            added += 1
            point.append(len(ids))
            ids.append(lowest_id - added)
            lon_e7.append(x)
            lat_e7.append(y)
        point.append(road.head)
        first.append(len(point))
    lon_array, lat_array = np.array(lon_e7, np.int32), np.array(lat_e7, np.int32)
    first_array, point_array = np.array(first, np.int64), np.array(point, np.int32)
    stated_m = np.array([road.length_m for road in rows], np.float64)
    return Roads(
        point_id=np.array(ids, np.int64),
        lon_e7=lon_array,
        lat_e7=lat_array,
        ways=Ways(
            way_first=first_array,
            point=point_array,
            id=np.array([road.way_id for road in rows], np.int64),
            functional_class=np.array([road.kind.functional_class for road in rows], np.int8),
            ramp=np.array([road.kind.ramp for road in rows], np.bool_),
            living_street=np.array([road.kind.living_street for road in rows], np.bool_),
            roundabout=np.array([road.roundabout for road in rows], np.bool_),
            structure=np.array([road.structure for road in rows], np.bool_),
            forward=np.ones(len(rows), np.bool_),
            backward=np.array([road.backward for road in rows], np.bool_),
            forward_mps=np.array([road.forward_mps for road in rows], np.float64),
            backward_mps=np.array([road.backward_mps for road in rows], np.float64),
            urban=np.full(len(rows), -1, np.int8),
            name_idx=np.array([road.name_idx for road in rows], np.int32),
            stretch=_stretch(lon_array, lat_array, point_array, first_array, stated_m, axes=crs is None),
        ),
        names=tuple(names),
        controls=controls,
        restrictions=(),
        built_up=(),
        country=None,
        source=source,
        licence="ODbL-1.0",
        attribution="© OpenStreetMap contributors",
        dropped=dict(dropped),
        height_m=_heights(height, added, source),
    )


@dataclass(slots=True)
class _Road:
    """An edge and, where there is one, the edge that runs against it over the same line."""

    tail: int
    head: int
    line: list[tuple[int, int]]
    way_id: int
    kind: RoadClass
    roundabout: bool
    structure: bool
    name_idx: int
    length_m: float
    forward_mps: float
    backward: bool = False
    backward_mps: float = np.nan


def _directed_edges(
    graph: nx.MultiDiGraph[Any] | nx.MultiGraph[Any], source: str
) -> Iterator[tuple[Hashable, Hashable, dict[str, Any]]]:
    """Edges by driving direction; of an undirected graph both, but for oneways, whose `from` and `to` tell theirs."""
    if graph.is_directed():
        yield from graph.edges(data=True)
        return
    named = {str(node): node for node in graph.nodes}
    unsure = 0
    for u, v, data in graph.edges(data=True):
        tail, head = (named.get(_first(data.get(key))) for key in ("from", "to"))
        ways = {(u, v), (v, u)}
        if (tail, head) in ways:
            ways = {(u, v)} if (tail, head) == (u, v) else {(v, u)}
        oneway = _first(data.get("oneway")).lower()
        if oneway not in ("true", "yes", "1", "-1", "reverse"):
            yield u, v, data
            yield v, u, data
        elif len(ways) == 1 or u == v:
            a, b = next(iter(ways))
            yield (b, a, data) if oneway in ("-1", "reverse") else (a, b, data)
        else:
            unsure += 1
    if unsure:
        reason = (
            f"{unsure} oneway edges of {source} lack `from` and `to`, allowed: a directed graph, or both on all edges"
        )
        raise ImportFailedError("edgedefault", "undirected", reason)


def _stretch(
    lon_e7: NDArray[np.int32],
    lat_e7: NDArray[np.int32],
    point: NDArray[np.int32],
    first: NDArray[np.int64],
    stated_m: NDArray[np.float64],
    *,
    axes: bool,
) -> NDArray[np.float64]:
    """Stated length over that of the line, float64 (W,), 1 where none is stated or the two don't belong together.

    axes: whether to refuse lines whose lengths fit better with latitude and longitude swapped.
    """

    def drawn(x_e7: NDArray[np.int32], y_e7: NDArray[np.int32]) -> NDArray[np.float64]:
        a, b = point[:-1], point[1:]
        step_m = short_distance_m(x_e7[a], y_e7[a], x_e7[b], y_e7[b])
        step_m[first[1:-1] - 1] = 0.0
        total: NDArray[np.float64] = np.add.reduceat(step_m, first[:-1])
        return total

    drawn_m = drawn(lon_e7, lat_e7)
    if axes:
        refuse_swapped_axes(stated_m, drawn_m, drawn(lat_e7, lon_e7))
    with np.errstate(divide="ignore", invalid="ignore"):
        stretch = stated_m / drawn_m
    plain = (stretch > _PLAIN_STRETCH[0]) & (stretch < _PLAIN_STRETCH[1])
    return np.where(plain, stretch, 1.0)


def _heights(height: list[float], added: int, source: str) -> NDArray[np.float64] | None:
    missing = sum(h != h for h in height)
    if missing == len(height):
        return None
    if missing:
        raise ImportFailedError(
            "elevation", source, f"{missing} of {len(height)} nodes have none, allowed: on all nodes or on no node"
        )
    return np.array(height + [np.nan] * added, np.float64)


def _coordinate(data: dict[str, Any], name: str, node: Hashable, crs: CRS | None) -> float:
    limit = 180.0 if name == "x" else 90.0
    allowed = f"allowed: -{limit:g}..{limit:g} deg" if crs is None else f"allowed: a number in {crs.to_string()}"
    try:
        value = float(data[name])
    except (KeyError, TypeError, ValueError) as error:
        raise ImportFailedError(f"node {node} {name}", data.get(name), allowed) from error
    if not np.isfinite(value):
        raise ImportFailedError(f"node {node} {name}", value, allowed)
    if crs is None and not -limit <= value <= limit:
        hint = "are latitude and longitude swapped?" if abs(value) <= 180.0 else "a graph in metres needs its crs"
        raise ImportFailedError(f"node {node} {name}", value, f"{allowed}; {hint}")
    return value


def _elevation_m(data: dict[str, Any], node: Hashable) -> float:
    """Height of a node [m], the mean of several as merged junctions have them, NaN where none is given."""
    allowed = f"allowed: {LOWEST_M:g}..{HIGHEST_M:g} m, or none on any node"
    values = _values(data.get("elevation"))
    try:
        height_m = [float(value) for value in values]
    except ValueError as error:
        raise ImportFailedError(f"node {node} elevation", data["elevation"], f"no number, {allowed}") from error
    if not all(LOWEST_M <= h <= HIGHEST_M for h in height_m):
        raise ImportFailedError(f"node {node} elevation", data["elevation"], allowed)
    return sum(height_m) / len(height_m) if height_m else np.nan


def _length_m(data: dict[str, Any], source: str) -> float:
    stated = _first(data.get("length"))
    try:
        return float(stated) if stated else np.nan
    except ValueError as error:
        raise ImportFailedError("length", data["length"], f"no number, in an edge of {source}") from error


def _limit_mps(data: dict[str, Any], source: str, dropped: Counter[str]) -> float:
    """Limit of an edge [m/s], NaN where none is stated; the lowest of several."""
    unlimited = may_be_unlimited({"highway": ";".join(_values(data.get("highway")))})
    limit = limit_mps_from_value(";".join(_values(data.get("maxspeed"))), unlimited=unlimited)
    if limit is not None:
        return limit
    values = _values(data.get("speed_kph"))
    try:
        kmh = min((float(value) for value in values), default=np.nan)
    except ValueError as error:
        reason = f"no number, allowed: {LOWEST_KMH:g}..{HIGHEST_KMH:g} km/h, in an edge of {source}"
        raise ImportFailedError("speed_kph", data["speed_kph"], reason) from error
    if LOWEST_KMH <= kmh <= HIGHEST_KMH:
        return kmh * KMH
    dropped[Dropped.SPEED] += bool(values)
    return np.nan


def _tags(data: dict[str, Any]) -> dict[str, str]:
    """The first value of each attribute that has one, as text."""
    found = {k: _first(x) for k, x in data.items() if k not in ("geometry", "length")}
    return {k: value for k, value in found.items() if value}


def _absent(value: Any) -> bool:
    """Whether an attribute stands for a missing value, as pandas and GraphML writers leave it."""
    return value is None or str(value).strip() in _ABSENT


def _values(value: Any) -> list[str]:
    """The values of an attribute as text, missing ones left out; OSMnx writes several as a Python list in text."""
    if isinstance(value, str) and value.startswith(("[", "{", "(")):
        try:
            value = ast.literal_eval(value.replace("nan", "None") if "'" not in value else value)
        except (ValueError, SyntaxError, TypeError, RecursionError, MemoryError):
            return [value]
    if isinstance(value, (list, tuple, set)):
        return [str(v) for v in value if not _absent(v)]
    return [] if _absent(value) else [str(value)]


def _first(value: Any) -> str:
    values = _values(value)
    return values[0] if values else ""


def _whole(value: str) -> int:
    try:
        number = int(float(value)) if "." in value else int(value)
    except (ValueError, OverflowError):
        return 0
    return number if abs(number) < _ID_LIMIT else 0
