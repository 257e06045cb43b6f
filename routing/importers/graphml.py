"""Reads the roads of a GraphML file or networkx graph laid out as OSMnx does."""

from __future__ import annotations

import ast
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from routing.errors import ImportFailedError
from routing.graph.earth import E7
from routing.importers.graphml_lines import lines_of, lonlat_deg, projection_of, refuse_swapped_axes
from routing.importers.heights.cells import HIGHEST_M, LOWEST_M
from routing.importers.roads import Roads, Ways, short_distance_m
from routing.importers.signs import DIRECTIONS, drives_left, exit_ref_of, is_mini_roundabout, sign_of
from routing.importers.speeds import HIGHEST_KMH, KMH, LOWEST_KMH, limit_mps_from_value, may_be_unlimited
from routing.importers.tags import (
    Control,
    Dropped,
    RoadClass,
    admitted_class,
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

    from routing.graph.signs import RoadSign

_PLAIN_STRETCH: Final = (0.5, 20.0)  # of an edge's stated length over that of its line; outside, the line is right
_ABSENT: Final = frozenset(("", "nan", "NaN", "None", "<NA>", "NaT", "NULL", "null", "<null>", "N/A", "#N/A"))
_ID_LIMIT: Final = 1 << 62
_SAME_PLACE_E7: Final = 100  # about 1 m: lines of both directions of a street differ by rounding alone (assumed)
_SAME_LENGTH: Final = 0.01
_UNIT_OFF: Final = 0.02  # stated lengths that are all off by more, and by the same factor, are in another unit
_UNIT_SPREAD: Final = 0.01
_FEWEST_OF_UNIT: Final = 10  # roads, from which on that is no chance (assumed)
_LITERAL: Final = re.compile(
    r"""('(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*")|\b(?:np\.)?(?:nan|NaN)\b|<NA>|\bnp\.\w+\(|(\))"""
)
_OTHER_NAMES: Final = {"x": ("lon", "longitude", "lng"), "y": ("lat", "latitude")}


def roads_from_networkx(graph: nx.MultiDiGraph[Any] | nx.MultiGraph[Any], source: str) -> Roads:
    """The roads of an OSMnx graph; two edges over the same line in opposite directions become one two-way road.

    Read are, of nodes, x, y [deg, or in the graph's crs] (else lon, lat), elevation [m] and highway; of edges,
    length [m], geometry (LineString or WKT), highway, maxspeed, speed_kph, name, ref, bridge, tunnel, junction and the
    access tags; values may be lists, and texts that stand for a missing value count as none. The stated length holds.
    Of an undirected graph each edge is driven both ways, or as its `oneway`, `from` and `to` say.
    Raises ImportFailedError naming what is missing or out of range.
    """
    if graph.number_of_edges() == 0:
        raise ImportFailedError("map", source, "the graph has no edges")
    named_crs = graph.graph.get("crs")
    crs = projection_of("epsg:4326" if _absent(named_crs) else str(named_crs))
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
    unclassed = 0
    for u, v, data in _directed_edges(graph, source):
        tags = _tags(data)
        highways = _values(data.get("highway"))
        unclassed += not highways
        kind = next((c for value in highways if (c := road_class(value) or admitted_class(value, tags))), None)
        if kind is None or not car_may_pass(tags):
            dropped[Dropped.ACCESS] += 1
        else:
            edges.append((node_idx[u], node_idx[v], data, kind))
    if not edges:
        hint = f"; {unclassed} of them have no `highway`, allowed: as OSMnx writes it" if unclassed else ""
        raise ImportFailedError("map", source, f"no edge in it may be driven by car{hint}")
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
        length_m = _length_m(data, source)
        mates = waiting.get((u, v, osmids), [])
        mate = next((road for road in reversed(mates) if road.runs_against(line, length_m)), None)
        if mate is not None:
            mates.remove(mate)
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
            tags=tags | {"highway": next((v for v in _values(data.get("highway")) if road_class(v)), tags["highway"])},
            length_m=length_m,
            forward_mps=limit,
        )
        rows.append(road)
        waiting.setdefault((v, u, osmids), []).append(road)

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
    signs: dict[RoadSign, int] = {}
    ahead, back = (
        [signs.setdefault(sign_of(r.tags, direction, oneway=not r.backward), len(signs)) for r in rows]
        for direction in DIRECTIONS
    )
    ways = Ways(
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
        stretch=_stretch(lon_array, lat_array, point_array, first_array, stated_m, dropped, axes=crs is None),
        sign_forward=np.array(ahead, np.int32),
        sign_backward=np.array(back, np.int32),
    )
    return Roads(
        point_id=np.array(ids, np.int64),
        lon_e7=lon_array,
        lat_e7=lat_array,
        ways=ways,
        names=tuple(names),
        controls=controls,
        restrictions=(),
        built_up=(),
        country=None,
        source=source,
        licence="ODbL-1.0",
        attribution="© OpenStreetMap contributors",
        dropped={reason: count for reason, count in dropped.items() if count},
        height_m=_heights(height, added, source),
        signs=tuple(signs),
        exits={k: ref for k, (_, data) in enumerate(nodes) if (ref := exit_ref_of(_tags(data)))},
        drives_left=drives_left({}, None, ways, lon_array, lat_array),
        mini=frozenset(k for k, (_, data) in enumerate(nodes) if is_mini_roundabout(_tags(data))),
    )


@dataclass(slots=True, eq=False)
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
    tags: dict[str, str]
    length_m: float
    forward_mps: float
    backward: bool = False
    backward_mps: float = np.nan

    def runs_against(self, line: list[tuple[int, int]], length_m: float) -> bool:
        """Whether an edge from its head to its tail is its other direction, by its line, or one of them by its length.

        One of both may lack its line: then they are one street where the lengths agree.
        """
        if bool(self.line) != bool(line):
            return self.way_id != 0 and abs(length_m - self.length_m) <= _SAME_LENGTH * self.length_m
        pairs = zip(self.line, reversed(line), strict=False)
        return len(line) == len(self.line) and all(
            abs(x - a) <= _SAME_PLACE_E7 and abs(y - b) <= _SAME_PLACE_E7 for (x, y), (a, b) in pairs
        )


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
    dropped: Counter[str],
    *,
    axes: bool,
) -> NDArray[np.float64]:
    """Stated length over that of the line, float64 (W,), 1 where none is stated or the two don't belong together.

    All are 1 where nearly all are off by one factor: then they are in feet, or in metres of a map projection.
    Those passed over are counted in dropped.
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
    if int(plain.sum()) >= _FEWEST_OF_UNIT:
        factor = float(np.median(stretch[plain]))
        near = np.abs(stretch[plain] / factor - 1.0) <= _UNIT_SPREAD
        if abs(factor - 1.0) > _UNIT_OFF and bool(near.mean() > 0.9):
            plain[:] = False
    dropped[Dropped.LENGTH] += int((~plain & ~np.isnan(stated_m)).sum())
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
    other = next((key for key in _OTHER_NAMES[name] if crs is None and not _absent(data.get(key))), name)
    name = other if _absent(data.get(name)) else name
    if _absent(data.get(name)):
        raise ImportFailedError(f"node {node} {name}", data.get(name), f"is missing, {allowed}")
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
    stated = _values(data.get("length"))
    try:
        return sum(float(part) for part in stated) if stated else np.nan  # of a list: of the parts that were joined
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
    """The first value of each attribute that has one, as text; of access the first that denies.

    A list has the values of the parts that were joined to an edge: each of them has to be passed.
    """
    found = {k: values for k, x in data.items() if k not in ("geometry", "length") and (values := _values(x))}
    return {k: next((v for v in values if not car_may_pass({k: v})), values[0]) for k, values in found.items()}


def _absent(value: Any) -> bool:
    """Whether an attribute stands for a missing value, as pandas and GraphML writers leave it."""
    return value is None or str(value).strip() in _ABSENT


def _values(value: Any) -> list[str]:
    """The values of an attribute as text, missing ones left out; OSMnx writes several as a Python list in text."""
    if isinstance(value, str) and value.startswith(("[", "{", "(", "np.")):
        try:
            value = ast.literal_eval(_literal(value))
        except (ValueError, SyntaxError, TypeError, RecursionError, MemoryError):
            return [value]
    if isinstance(value, (list, tuple, set)):
        return [str(v) for v in value if not _absent(v)]
    return [] if _absent(value) else [str(value)]


def _literal(text: str) -> str:
    """A list in text as Python reads it: without numpy's names of types, missing values as None."""
    if "nan" not in text and "np." not in text and "NA" not in text:
        return text
    numpy = "np." in text

    def plain(match: re.Match[str]) -> str:
        if match[1]:
            return match[1]
        if match[2]:
            return "" if numpy else ")"
        return "" if match[0].endswith("(") else "None"

    return _LITERAL.sub(plain, text)


def _first(value: Any) -> str:
    values = _values(value)
    return values[0] if values else ""


def _whole(value: str) -> int:
    try:
        number = int(float(value)) if "." in value else int(value)
    except (ValueError, OverflowError):
        return 0
    return number if abs(number) < _ID_LIMIT else 0
