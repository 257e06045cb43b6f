"""Reads the roads of a GraphML file or networkx graph laid out as OSMnx does."""

from __future__ import annotations

import ast
from collections import Counter
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from routing.errors import ImportFailedError
from routing.graph.earth import E7
from routing.importers.roads import Roads, Ways, short_distance_m
from routing.importers.speeds import HIGHEST_KMH, KMH, LOWEST_KMH, limit_mps_from_value, may_be_unlimited
from routing.importers.tags import Control, Dropped, car_may_pass, control, is_roundabout, is_structure, road_class

if TYPE_CHECKING:
    from collections.abc import Hashable

    import networkx as nx
    from numpy.typing import NDArray

_PLAIN_STRETCH: Final = (0.5, 20.0)  # of an edge's stated length over that of its line; outside, the line is right


def roads_from_networkx(graph: nx.MultiDiGraph[Any], source: str) -> Roads:
    """The roads of an OSMnx graph; two edges over the same line in opposite directions become one two-way road.

    Read are, of nodes, x, y [deg], elevation [m] and highway; of edges, length [m], geometry (LineString or WKT),
    highway, maxspeed, speed_kph, name, ref, bridge, tunnel, junction and the access tags; values may be lists. The
    stated length holds. Raises ImportFailedError naming what is missing or out of range.
    """
    if graph.number_of_edges() == 0:
        raise ImportFailedError("map", source, "the graph has no edges")
    crs = str(graph.graph.get("crs", "epsg:4326"))
    if crs.lower() not in ("epsg:4326", "wgs84", "{'init': 'epsg:4326'}"):
        raise ImportFailedError("crs", crs, "allowed: epsg:4326; project the graph back to longitude and latitude")
    node_idx: dict[Hashable, int] = {}
    ids: list[int] = []
    lon: list[float] = []
    lat: list[float] = []
    height: list[float] = []
    controls: dict[int, Control] = {}
    for number, (node, data) in enumerate(graph.nodes(data=True)):
        node_idx[node] = number
        ids.append(node if isinstance(node, int) else number)
        lon.append(_coordinate(data, "x", 180.0, node))
        lat.append(_coordinate(data, "y", 90.0, node))
        height.append(float(data.get("elevation", "nan")))
        found = control({k: _first(v) for k, v in data.items() if isinstance(v, str)})
        if found is not None:
            controls[number] = found
    lon_e7 = np.rint(np.array(lon) * E7).astype(np.int64).tolist()
    lat_e7 = np.rint(np.array(lat) * E7).astype(np.int64).tolist()

    dropped: Counter[str] = Counter()
    names: dict[str, int] = {"": 0}
    rows: dict[tuple[Any, ...], list[Any]] = {}
    for u, v, data in graph.edges(data=True):
        tags = {k: _first(x) for k, x in data.items() if k not in ("geometry", "length")}
        kind = next((c for value in _values(data.get("highway", "")) if (c := road_class(value))), None)
        if kind is None or not car_may_pass(tags):
            dropped[Dropped.ACCESS] += 1
            continue
        line = _line_e7(data.get("geometry"))[1:-1]
        way_id = _whole(_first(data.get("osmid", 0)))
        back_key = (node_idx[v], node_idx[u], way_id, tuple(reversed(line)))
        limit = _limit_mps(data)
        if back_key in rows and not rows[back_key][1]:
            rows[back_key][1] = True
            rows[back_key][3] = limit
            continue
        key: tuple[Any, ...] = (node_idx[u], node_idx[v], way_id, tuple(line))
        while key in rows:  # parallel edges over the same line
            key = (*key, len(rows))
        label = tags.get("name") or tags.get("ref") or ""
        rows[key] = [
            True,
            False,
            limit,
            np.nan,
            kind,
            is_roundabout(tags),
            any(is_structure({k: value}) for k in ("bridge", "tunnel") for value in _values(data.get(k, "no"))),
            names.setdefault(label, len(names)),
            _length_m(data, source),
        ]
    if not rows:
        raise ImportFailedError("map", source, "no edge in it may be driven by car")

    first = [0]
    point: list[int] = []
    added = 0
    for key in rows:
        point.append(key[0])
        for x, y in key[3]:
            added += 1
            point.append(len(ids))
            ids.append(-added)
            lon_e7.append(x)
            lat_e7.append(y)
        point.append(key[1])
        first.append(len(point))
    lon_array, lat_array = np.array(lon_e7, np.int32), np.array(lat_e7, np.int32)
    column = list(zip(*rows.values(), strict=True))
    first_array, point_array = np.array(first, np.int64), np.array(point, np.int32)
    return Roads(
        point_id=np.array(ids, np.int64),
        lon_e7=lon_array,
        lat_e7=lat_array,
        ways=Ways(
            way_first=first_array,
            point=point_array,
            id=np.array([key[2] for key in rows], np.int64),
            functional_class=np.array([k.functional_class for k in column[4]], np.int8),
            ramp=np.array([k.ramp for k in column[4]], np.bool_),
            living_street=np.array([k.living_street for k in column[4]], np.bool_),
            roundabout=np.array(column[5], np.bool_),
            structure=np.array(column[6], np.bool_),
            forward=np.array(column[0], np.bool_),
            backward=np.array(column[1], np.bool_),
            forward_mps=np.array(column[2], np.float64),
            backward_mps=np.array(column[3], np.float64),
            urban=np.full(len(rows), -1, np.int8),
            name_idx=np.array(column[7], np.int32),
            stretch=_stretch(lon_array, lat_array, point_array, first_array, np.array(column[8], np.float64)),
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


def _stretch(
    lon_e7: NDArray[np.int32],
    lat_e7: NDArray[np.int32],
    point: NDArray[np.int32],
    first: NDArray[np.int64],
    stated_m: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Stated length over that of the line, float64 (W,), 1 where none is stated or the two don't belong together."""
    a, b = point[:-1], point[1:]
    step_m = short_distance_m(lon_e7[a], lat_e7[a], lon_e7[b], lat_e7[b])
    step_m[first[1:-1] - 1] = 0.0
    drawn_m = np.add.reduceat(step_m, first[:-1])
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


def _coordinate(data: dict[str, Any], name: str, limit: float, node: Hashable) -> float:
    try:
        value = float(data[name])
    except (KeyError, TypeError, ValueError) as error:
        raise ImportFailedError(f"node {node} {name}", data.get(name), f"allowed: -{limit:g}..{limit:g} deg") from error
    if not -limit <= value <= limit:
        raise ImportFailedError(f"node {node} {name}", value, f"allowed: -{limit:g}..{limit:g} deg")
    return value


def _length_m(data: dict[str, Any], source: str) -> float:
    try:
        return float(data.get("length", "nan"))
    except (TypeError, ValueError) as error:
        raise ImportFailedError("length", data.get("length"), f"no number, in an edge of {source}") from error


def _limit_mps(data: dict[str, Any]) -> float:
    """Limit of an edge [m/s], NaN where none is stated; the lowest of several."""
    unlimited = may_be_unlimited({"highway": ";".join(_values(data.get("highway", "")))})
    limit = limit_mps_from_value(";".join(_values(data.get("maxspeed", ""))), unlimited=unlimited)
    if limit is None and "speed_kph" in data:
        kmh = float(_first(data["speed_kph"]))
        limit = kmh * KMH if LOWEST_KMH <= kmh <= HIGHEST_KMH else None
    return np.nan if limit is None else limit


def _line_e7(geometry: Any) -> list[tuple[int, int]]:
    if geometry is None or geometry == "":
        return []
    try:
        line = shapely.from_wkt(geometry) if isinstance(geometry, str) else geometry
        coordinates = np.rint(shapely.get_coordinates(line) * E7).astype(np.int64).tolist()
    except (shapely.errors.GEOSException, TypeError) as error:
        raise ImportFailedError("geometry", str(geometry)[:60], "allowed: a WKT LINESTRING") from error
    return [(x, y) for x, y in coordinates]


def _values(value: Any) -> list[str]:
    """The values of an attribute as text; OSMnx writes several as a Python list in text."""
    if isinstance(value, str) and value.startswith("["):
        try:
            value = ast.literal_eval(value)
        except (ValueError, SyntaxError):
            return [value]
    if isinstance(value, (list, tuple, set)):
        return [str(v) for v in value]
    return [str(value)]


def _first(value: Any) -> str:
    values = _values(value)
    return values[0] if values else ""


def _whole(value: str) -> int:
    try:
        return int(float(value)) if "." in value else int(value)
    except ValueError:
        return 0
