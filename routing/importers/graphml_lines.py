"""Where the nodes and edges of a GraphML lie: its coordinate system, and lines held against the nodes they join."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely
from rasterio.crs import CRS
from rasterio.errors import RasterioError
from rasterio.warp import transform

from routing.errors import ImportFailedError
from routing.graph.earth import E7, great_circle_m

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

FAR_FROM_NODE_M: Final = 50.0  # ends of lines lie at their nodes but for rounding and merged junctions (assumed)
# names of WGS 84, letters and digits alone
_DEGREES: Final = frozenset(
    (
        *("", "epsg4326", "4326", "wgs84", "wgs1984", "gcswgs1984", "gcswgs84", "crs84", "ogccrs84"),
        *("worldgeodeticsystem1984", "worldgeodeticsystem84", "longlatwgs84", "ogc13crs84"),
    )
)
_EPSG: Final = re.compile(
    r"^(?:(?:urn:(?:x-)?ogc:def:crs:)?epsg(?:[: ]+|:[\d.]*:)"
    r"|https?://(?:www\.)?opengis\.net/(?:def/crs/epsg/[^/]*/|gml/srs/epsg\.xml#))?(\d{4,6})(?:\.0)?$",
    re.IGNORECASE,
)
# Forms that PROJ reads by itself. All else is kept from GDAL, which takes it for a file or an address to fetch.
_OFFLINE: Final = re.compile(r"^(?:\{|\+|[A-Z_]+\s*\[|[A-Z]+:[\w+:]+$|urn:[\w:.+-]+$)", re.IGNORECASE)
_SWAPPED_LENGTH: Final = 0.007  # median difference of stated from drawn lengths: a sphere is within 0.6 % (assumed)
_WRONG_LENGTH: Final = 0.02
_LINE: Final = re.compile(r"\s*(?:MULTILINESTRING|LINESTRING|LINEARRING)\b", re.IGNORECASE)


def projection_of(crs: str) -> CRS | None:
    """The coordinate system of a graph, None for longitude and latitude on WGS 84.

    Raises ImportFailedError where the text names no known system.
    """
    text = _named(crs.strip())
    if re.sub(r"[^a-z0-9]", "", text.lower()) in _DEGREES or text.lower().endswith((":crs84", "/crs84")):
        return None
    epsg = _EPSG.match(text)
    text = f"EPSG:{epsg[1]}" if epsg else text
    allowed = "allowed: epsg:4326, or what PROJ knows, such as epsg:32631"
    if not _OFFLINE.match(text):
        raise ImportFailedError("crs", crs[:200], allowed)
    try:
        found = CRS.from_user_input(text)
    except (RasterioError, ValueError, RecursionError) as error:
        raise ImportFailedError("crs", crs[:200], allowed) from error
    if not (found.is_geographic or found.is_projected):
        raise ImportFailedError("crs", crs, "is no system on the Earth, allowed: such as epsg:4326 or epsg:32631")
    return None if found.is_geographic and found.to_epsg() == 4326 else found


def _named(text: str) -> str:
    """A coordinate system as PROJ names it, where it is given as a dictionary or by `+init=`."""
    if text.startswith("{"):
        try:
            given = ast.literal_eval(text)
            if "init" in given:
                text = str(given["init"])
            elif given.get("type") == "name":  # GeoJSON
                text = str(given["properties"]["name"])
            elif "proj" in given:  # early versions of OSMnx
                text = " ".join(f"+{key}" if value is True else f"+{key}={value}" for key, value in given.items())
        except (ValueError, SyntaxError, LookupError, TypeError, AttributeError, RecursionError, MemoryError):
            pass  # PROJJSON, which is read as such
    return text[len("+init=") :] if text.lower().startswith("+init=") else text


def lonlat_deg(crs: CRS | None, xy: NDArray[np.float64], field: str) -> NDArray[np.float64]:
    """Longitude and latitude of points, float64 (k, 2) [deg]; raises ImportFailedError naming the field."""
    if crs is None or xy.size == 0:
        return xy
    if crs.is_projected and bool((np.abs(xy) <= (180.0, 90.0)).all()):
        reason = f"looks like degrees, but the graph's crs is {crs.to_string()}, allowed: coordinates in that system"
        raise ImportFailedError(field, xy[0].tolist(), reason)
    try:
        lon, lat = transform(crs, "EPSG:4326", xy[:, 0], xy[:, 1])[:2]
    except Exception as error:  # what rasterio raises for GDAL's errors has no public base
        reason = f"beyond what the graph's crs {crs.to_string()} can hold ({error})"
        raise ImportFailedError(field, xy[0].tolist(), reason) from error
    found = np.column_stack((lon, lat)).astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
    if bad.size:
        reason = f"beyond what the graph's crs {crs.to_string()} can hold"
        raise ImportFailedError(field, xy[bad[0]].tolist(), reason)
    return found


def lines_of(
    geometries: Sequence[Any],
    names: Sequence[str],
    tail_deg: NDArray[np.float64],
    head_deg: NDArray[np.float64],
    crs: CRS | None,
) -> list[list[tuple[int, int]]]:
    """Inner points of edges' lines from tail to head, (lon, lat) in whole 1e-7 deg; none where no line is given.

    geometries: WKT, a LineString or None, in the graph's coordinate system; names: of the edges, for errors.
    tail_deg, head_deg: float64 (k, 2) [deg]. A line that runs from head to tail is turned. Raises ImportFailedError
    naming `geometry` where a line is none, has its axes swapped or does not begin and end at its nodes.
    """
    raw = [_coordinates(geometry, name) for geometry, name in zip(geometries, names, strict=True)]
    drawn = np.array([k for k, line in enumerate(raw) if len(line)], np.int64)
    result: list[list[tuple[int, int]]] = [[] for _ in raw]
    if drawn.size == 0:
        return result
    first = np.concatenate(([0], np.cumsum([len(raw[k]) for k in drawn])))
    given = np.concatenate([raw[k] for k in drawn])
    ends = np.concatenate((first[:-1], first[1:] - 1))
    nodes = np.concatenate((tail_deg[drawn], head_deg[drawn]))
    if crs is None:
        _refuse_swapped(given[ends], nodes, [names[k] for k in drawn])
        bad = np.flatnonzero((np.abs(given) > (180.0, 90.0)).any(axis=1))
        if bad.size:
            name = names[drawn[np.searchsorted(first, bad[0], side="right") - 1]]
            reason = "allowed: longitude -180..180 and latitude -90..90 deg; is it in metres of another crs?"
            raise ImportFailedError(f"geometry of edge {name}", _shown(given[bad[0]]), reason)
    line_deg = lonlat_deg(crs, given, "geometry")
    begin, end = line_deg[first[:-1]], line_deg[first[1:] - 1]
    tail, head = tail_deg[drawn], head_deg[drawn]
    straight = np.maximum(_distance_m(begin, tail), _distance_m(end, head))
    turned = np.maximum(_distance_m(begin, head), _distance_m(end, tail))
    far = np.flatnonzero(np.minimum(straight, turned) > FAR_FROM_NODE_M)
    if far.size:
        k = far[np.argmax(np.minimum(straight, turned)[far])]
        raise ImportFailedError(
            f"geometry of edge {names[drawn[k]]}",
            _shown(given[first[k]]),
            f"ends {min(straight[k], turned[k]):.0f} m from its nodes, allowed: {FAR_FROM_NODE_M:g} m, in the "
            f"coordinates of the graph's crs ({far.size} of {drawn.size} lines lie elsewhere)",
        )
    whole = np.rint(line_deg * E7).astype(np.int64)
    for k, edge in enumerate(drawn.tolist()):
        inner = [(x, y) for x, y in whole[first[k] + 1 : first[k + 1] - 1].tolist()]
        result[edge] = inner[::-1] if turned[k] < straight[k] else inner
    return result


def refuse_swapped_axes(stated_m: NDArray[np.float64], drawn_m: NDArray[np.float64], swapped_m: NDArray[Any]) -> None:
    """Raise where stated lengths are those of lines with latitude and longitude the other way round.

    stated_m, drawn_m, swapped_m: float64 (k,) [m], lengths of edges as stated, as drawn, and as drawn if swapped.
    """
    known = (stated_m > 1.0) & (drawn_m > 1.0) & (swapped_m > 1.0)
    if not known.any():
        return
    off, off_swapped = (float(np.median(np.abs(np.log(stated_m[known] / m[known])))) for m in (drawn_m, swapped_m))
    if off > _WRONG_LENGTH and off_swapped < _SWAPPED_LENGTH:
        reason = "latitude and longitude are swapped: the stated lengths fit the other order, allowed: x is longitude"
        raise ImportFailedError("node x, y", "of the graph", reason)


def _refuse_swapped(ends: NDArray[np.float64], nodes: NDArray[np.float64], names: Sequence[str]) -> None:
    """Raise where the ends of lines lie at their nodes only with latitude and longitude swapped."""
    half = len(names)
    turned = np.concatenate((nodes[half:], nodes[:half]))

    def off_m(points: NDArray[np.float64]) -> NDArray[np.float64]:
        ahead, back = _distance_m(points, nodes), _distance_m(points, turned)
        return np.minimum(np.maximum(ahead[:half], ahead[half:]), np.maximum(back[:half], back[half:]))

    swapped = np.flatnonzero((off_m(ends) > FAR_FROM_NODE_M) & (off_m(ends[:, ::-1]) <= FAR_FROM_NODE_M))
    if swapped.size:
        k = int(swapped[0])
        reason = f"latitude and longitude are swapped ({swapped.size} of {half} lines), allowed: longitude first"
        raise ImportFailedError(f"geometry of edge {names[k]}", _shown(ends[k]), reason)


def _distance_m(a_deg: NDArray[np.float64], b_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    return great_circle_m(a_deg[:, 1], a_deg[:, 0], b_deg[:, 1], b_deg[:, 0])


def _coordinates(geometry: Any, name: str) -> NDArray[np.float64]:
    """Points of an edge's line, float64 (n, 2), none where it has no line."""
    allowed = "allowed: a WKT LINESTRING"
    if geometry is None:
        return np.empty((0, 2))
    if isinstance(geometry, str) and not _LINE.match(geometry):  # GEOS dies of collections within collections
        raise ImportFailedError(f"geometry of edge {name}", geometry[:60], allowed)
    try:
        with np.errstate(invalid="ignore"):
            line = shapely.from_wkt(geometry) if isinstance(geometry, str) else geometry
        if shapely.is_empty(line):
            return np.empty((0, 2))
        if shapely.get_type_id(line) == shapely.GeometryType.MULTILINESTRING:
            line = shapely.line_merge(line)  # one line where its parts follow each other
        kind, points = shapely.get_type_id(line), np.asarray(shapely.get_coordinates(line), np.float64)
    except (shapely.errors.GEOSException, TypeError, ValueError) as error:
        raise ImportFailedError(f"geometry of edge {name}", str(geometry)[:60], allowed) from error
    if kind not in (shapely.GeometryType.LINESTRING, shapely.GeometryType.LINEARRING) or len(points) == 1:
        raise ImportFailedError(f"geometry of edge {name}", str(geometry)[:60], allowed)
    if not np.isfinite(points).all():
        raise ImportFailedError(f"geometry of edge {name}", str(geometry)[:60], f"{allowed} of finite numbers")
    return points


def _shown(point: NDArray[np.float64]) -> str:
    return f"{point[0]:.7g} {point[1]:.7g}"
