"""The road graph as compact frozen arrays, and its assembly from loose links."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from energy.conditions import RoadSurface
from routing.errors import ImportFailedError
from routing.graph.earth import E7, EARTH_RADIUS_M

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from energy.conditions import Conditions
    from routing.graph.conditional_limits import ConditionalLimits
    from routing.graph.ferries import Ferries
    from routing.graph.link_copies import LinkCopies
    from routing.graph.signs import RoadSigns

    SomeLinks = NDArray[np.integer] | slice  # indices of links, or a run of them

FORMAT_VERSION: Final = 1

ALL_LINKS: Final = slice(None)


class Terrain(StrEnum):
    """Where the heights of a graph come from."""

    MEASURED = "measured"
    SYNTHETIC = "synthetic"
    ABSENT = "absent"


@dataclass(frozen=True, slots=True)
class CutOffPart:
    """A part of a map that is not connected to the graph: links, length of road (both directions once) and a place.

    lat_deg, lon_deg: the middle of its longest link [deg]; name: of the road there, or empty.
    """

    link_count: int
    length_m: float
    lat_deg: float
    lon_deg: float
    name: str


@dataclass(frozen=True, slots=True)
class LeftOutFerry:
    """A ferry that takes cars and that the import was not asked for: its length, where it begins, its name or ""."""

    length_m: float
    lat_deg: float
    lon_deg: float
    name: str


PARTS_NAMED: Final = 10  # of the parts that were cut off the longest are kept by name


@dataclass(frozen=True, slots=True)
class GraphMeta:
    """What a graph is made of; goes into meta.json and, shortened, into every answer.

    bbox: west, south, east, north [deg].
    elevation_method: how heights were made, in words; smoothing_m: smoothing length along the road [m], 0 where none.
    dropped: what the import left out, by reason.
    cut_off: the longest parts of the map that are not connected to the graph, longest first, at most PARTS_NAMED.
    ferries_left_out: likewise.
    """

    name: str
    source: str
    licence: str
    attribution: str
    terrain: Terrain
    elevation_method: str
    smoothing_m: float
    bbox: tuple[float, float, float, float]
    dropped: Mapping[str, int] = field(default_factory=dict)
    cut_off: tuple[CutOffPart, ...] = ()
    ferries_left_out: tuple[LeftOutFerry, ...] = ()


def meta_fields(meta: GraphMeta) -> dict[str, object]:
    """The fields of a GraphMeta as JSON takes them, for meta.json and for exports."""
    left_out = [asdict(ferry) for ferry in meta.ferries_left_out]
    return {
        "name": meta.name,
        "source": meta.source,
        "licence": meta.licence,
        "attribution": meta.attribution,
        "terrain": meta.terrain.value,
        "elevation_method": meta.elevation_method,
        "smoothing_m": meta.smoothing_m,
        "bbox": list(meta.bbox),
        "dropped": dict(meta.dropped),
        "cut_off": [asdict(part) for part in meta.cut_off],
        **({"ferries_left_out": left_out} if left_out else {}),
    }


def left_out_ferries(raw: Mapping[str, Any]) -> tuple[LeftOutFerry, ...]:
    """The ferries of meta.json that were left out; raises KeyError, TypeError, ValueError."""
    return tuple(
        LeftOutFerry(float(ferry["length_m"]), float(ferry["lat_deg"]), float(ferry["lon_deg"]), str(ferry["name"]))
        for ferry in raw.get("ferries_left_out", ())
    )


def cut_off_parts(raw: Mapping[str, Any]) -> tuple[CutOffPart, ...]:
    """The parts of meta.json that were cut off, none where it is older; raises KeyError, TypeError, ValueError."""
    return tuple(
        CutOffPart(
            int(part["link_count"]),
            float(part["length_m"]),
            float(part["lat_deg"]),
            float(part["lon_deg"]),
            str(part["name"]),
        )
        for part in raw.get("cut_off", ())
    )


@dataclass(frozen=True, slots=True)
class RoadGraph:
    """Directed links between nodes; every array is read-only.

    N nodes, M links sorted by tail node, S permitted link-to-link transitions, G geometry points.
    node_lat_deg, node_lon_deg, node_height_m: float64 (N,); node_id: int64 (N,) outside identifier.
    tail, head: int32 (M,) node indices; length_m: float64 (M,) > 0; speed_limit_mps: float64 (M,) > 0.
    functional_class, cross: int8 (M,), values of energy.stops.FunctionalClass and Cross; urban: bool (M,).
    way_id: int64 (M,) outside identifier; name_idx: int32 (M,) into names.
    reverse_idx: int32 (M,) the link driven the other way, -1 on a oneway.
    structure: bool (M,) bridge or tunnel.
    geometry_first: int64 (M+1,), geometry_lon_e7, geometry_lat_e7: int32 (G,) polyline of a link, ends included.
    successor_first: int64 (M+1,), successor: int32 (S,) links that may follow a link: turn restrictions and
    U-turns (permitted at dead ends only) are already taken out.
    conditional: limits under a condition, None where there are none.
    cut_node: int32 (k,) ascending, nodes at which the map's extract cuts a road; None where the import knew of none and
    of no rim without any. ferries: links over which a ferry carries the vehicle, None where there are none; their
    speed_limit_mps is the ferry's speed. copies: of links, which come last
    and lead elsewhere than these for those who may not go on as others; None where there are none. signs: what drivers
    read along links, None where the import kept none.
    """

    meta: GraphMeta
    names: tuple[str, ...]
    node_lat_deg: NDArray[np.float64]
    node_lon_deg: NDArray[np.float64]
    node_height_m: NDArray[np.float64]
    node_id: NDArray[np.int64]
    tail: NDArray[np.int32]
    head: NDArray[np.int32]
    length_m: NDArray[np.float64]
    speed_limit_mps: NDArray[np.float64]
    functional_class: NDArray[np.int8]
    cross: NDArray[np.int8]
    urban: NDArray[np.bool_]
    structure: NDArray[np.bool_]
    way_id: NDArray[np.int64]
    name_idx: NDArray[np.int32]
    reverse_idx: NDArray[np.int32]
    geometry_first: NDArray[np.int64]
    geometry_lon_e7: NDArray[np.int32]
    geometry_lat_e7: NDArray[np.int32]
    successor_first: NDArray[np.int64]
    successor: NDArray[np.int32]
    conditional: ConditionalLimits | None = None
    cut_node: NDArray[np.int32] | None = None
    ferries: Ferries | None = None
    copies: LinkCopies | None = None
    signs: RoadSigns | None = None

    def __post_init__(self) -> None:
        for name in ARRAY_NAMES:
            getattr(self, name).flags.writeable = False
        if self.cut_node is not None:
            self.cut_node.flags.writeable = False

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return int(self.node_lat_deg.size)

    @property
    def link_count(self) -> int:
        """Number of directed links."""
        return int(self.tail.size)

    @property
    def road_link_count(self) -> int:
        """Number of directed links without copies, which are the last ones."""
        return self.link_count - (0 if self.copies is None else self.copies.of.size)

    def is_copy(self) -> NDArray[np.bool_]:
        """Whether a link is a copy of another, bool (M,)."""
        return np.arange(self.link_count) >= self.road_link_count

    def originals(self, links: Sequence[int]) -> tuple[int, ...]:
        """Links, those that are copies replaced by what they are copies of."""
        count = self.road_link_count
        if self.copies is None:
            return tuple(links)
        return tuple(link if link < count else int(self.copies.of[link - count]) for link in links)

    def copies_of(self, link_idx: int) -> list[int]:
        """The copies of a link."""
        if self.copies is None:
            return []
        return (self.road_link_count + np.flatnonzero(self.copies.of == link_idx)).tolist()

    def is_ferry(self) -> NDArray[np.bool_]:
        """Whether a ferry carries the vehicle over a link, bool (M,)."""
        ferry = np.zeros(self.link_count, np.bool_)
        if self.ferries is not None:
            ferry[self.ferries.link] = True
        return ferry

    def limit_mps(self, conditions: Conditions) -> NDArray[np.float64]:
        """Speed limits on the road as it lies and at the time of departure, float64 (M,) > 0 [m/s].

        speed_limit_mps itself where none differs.
        """
        if self.conditional is None:
            return self.speed_limit_mps
        wet = conditions.road is RoadSurface.WET
        return self.conditional.over(self.speed_limit_mps, wet=wet, minute=conditions.departure_min)

    def climb_m(self, links: SomeLinks = ALL_LINKS) -> NDArray[np.float64]:
        """Height gained along links from their node heights, float64 (k,) [m]."""
        climb: NDArray[np.float64] = self.node_height_m[self.head[links]] - self.node_height_m[self.tail[links]]
        return climb

    def altitude_m(self, links: SomeLinks = ALL_LINKS) -> NDArray[np.float64]:
        """Mean height of the ends of links, float64 (k,) [m]."""
        both = self.node_height_m[self.head[links]] + self.node_height_m[self.tail[links]]
        return np.asarray(0.5 * both, np.float64)

    def heading(self, links: SomeLinks = ALL_LINKS) -> NDArray[np.float64]:
        """East and north part of links' ways over their lengths, float64 (k, 2): 1 together where one is straight."""
        lat, lon = self.node_lat_deg, self.node_lon_deg
        tail, head, length_m = self.tail[links], self.head[links], self.length_m[links]
        shrink = np.cos(np.radians(0.5 * (lat[head] + lat[tail])))
        span = lon[head] - lon[tail]
        span = np.where(np.abs(span) > 180.0, span - np.copysign(360.0, span), span)  # over the antimeridian
        east = np.radians(span) * shrink * EARTH_RADIUS_M / length_m
        north = np.radians(lat[head] - lat[tail]) * EARTH_RADIUS_M / length_m
        whole = np.maximum(np.hypot(east, north), 1.0)  # rounding, and lengths measured otherwise
        heading = np.empty((length_m.size, 2))
        heading[:, 0], heading[:, 1] = east / whole, north / whole
        return heading

    def geometry(self, link_idx: int) -> NDArray[np.float64]:
        """Polyline of a link in driving direction, float64 (k, 2), columns lon and lat [deg]."""
        begin, end = self.geometry_first[link_idx], self.geometry_first[link_idx + 1]
        line = np.empty((end - begin, 2))
        line[:, 0], line[:, 1] = self.geometry_lon_e7[begin:end], self.geometry_lat_e7[begin:end]
        line /= E7
        return line

    def successors(self, link_idx: int) -> NDArray[np.int32]:
        """Links that may follow a link, int32 (k,)."""
        return self.successor[self.successor_first[link_idx] : self.successor_first[link_idx + 1]]


_NO_ARRAYS: Final = ("meta", "names", "conditional", "cut_node", "ferries", "copies", "signs")
ARRAY_NAMES: Final = tuple(f.name for f in fields(RoadGraph) if f.name not in _NO_ARRAYS)


@dataclass(frozen=True, slots=True)
class LooseLinks:
    """Links in any order, as an importer makes them; shapes and units as in RoadGraph.

    forbidden_turns: int64 (k, 2), positions in these arrays: the first link may not be followed by the second.
    conditional: limits under a condition, of positions in these arrays, or None. ferries: of positions, or None. signs:
    of positions, exits at positions of nodes, or None.
    """

    tail: NDArray[np.int32]
    head: NDArray[np.int32]
    length_m: NDArray[np.float64]
    speed_limit_mps: NDArray[np.float64]
    functional_class: NDArray[np.int8]
    cross: NDArray[np.int8]
    urban: NDArray[np.bool_]
    structure: NDArray[np.bool_]
    way_id: NDArray[np.int64]
    name_idx: NDArray[np.int32]
    geometry_first: NDArray[np.int64]
    geometry_lon_e7: NDArray[np.int32]
    geometry_lat_e7: NDArray[np.int32]
    forbidden_turns: NDArray[np.int64]
    conditional: ConditionalLimits | None = None
    ferries: Ferries | None = None
    signs: RoadSigns | None = None

    def is_ferry(self) -> NDArray[np.bool_]:
        """Whether a ferry carries the vehicle over a link, bool (M,)."""
        ferry = np.zeros(self.tail.size, np.bool_)
        if self.ferries is not None:
            ferry[self.ferries.link] = True
        return ferry


@dataclass(frozen=True, slots=True)
class LooseNodes:
    """Nodes as an importer makes them; shapes and units as in RoadGraph."""

    lat_deg: NDArray[np.float64]
    lon_deg: NDArray[np.float64]
    height_m: NDArray[np.float64]
    id: NDArray[np.int64]


def assemble_graph(meta: GraphMeta, names: tuple[str, ...], nodes: LooseNodes, links: LooseLinks) -> RoadGraph:
    """The strongly connected part of loose links with most road as a RoadGraph, in O((M + S) log M).

    Connected means link to link, over permitted transitions, so that every link reaches every other one. A road
    counts once, whether it is driven in one or both directions, and a ferry is no road.
    meta.dropped gains `not_connected`, the number of links left out here, and `not_connected_m`, the length of road
    that is lost with them; meta.cut_off names the longest parts of it.
    Raises ImportFailedError when nothing is left.
    """
    kept = np.arange(links.tail.size)
    twin = _reverse_of(links, kept)
    road_m = np.where(twin >= 0, 0.5, 1.0) * links.length_m  # a road counts once, in one direction or both
    road_m[links.is_ferry()] = 0.0
    forbidden = _pair_keys(links.forbidden_turns, links.tail.size)
    while True:
        reverse = twin if kept.size == twin.size else _reverse_of(links, kept)
        first, successor = _transitions(links, kept, reverse, forbidden)
        matrix = csr_array((np.ones(successor.size, np.int8), successor, first), shape=(kept.size, kept.size))
        count, component = connected_components(matrix, directed=True, connection="strong")
        if kept.size == 0 or successor.size == 0:
            raise ImportFailedError("links", int(links.tail.size), "no two drivable links are connected")
        if count == 1:
            break
        kept = kept[component == np.argmax(np.bincount(component, road_m[kept]))]
    order = np.argsort(links.tail[kept], kind="stable")
    rank = np.empty(kept.size, np.int64)
    rank[order] = np.arange(kept.size)
    degree = np.diff(first)[order]
    new_first = np.concatenate(([0], np.cumsum(degree)))
    gather = np.repeat(first[:-1][order] - new_first[:-1], degree) + np.arange(int(new_first[-1]))
    used = kept[order]
    node_used = np.unique(np.concatenate((links.tail[used], links.head[used])))
    node_rank = np.full(nodes.lat_deg.size, -1, np.int32)
    node_rank[node_used] = np.arange(node_used.size, dtype=np.int32)
    points = np.diff(links.geometry_first)[used]
    geometry_first = np.concatenate(([0], np.cumsum(points)))
    point = np.repeat(links.geometry_first[:-1][used] - geometry_first[:-1], points) + np.arange(
        int(geometry_first[-1])
    )
    lon, lat = links.geometry_lon_e7[point], links.geometry_lat_e7[point]
    apart = np.setdiff1d(np.arange(links.tail.size), used)
    lost = apart[~np.isin(twin[apart], used)]  # of the others the road stays in its other direction
    dropped = dict(meta.dropped)
    dropped["not_connected"] = dropped.get("not_connected", 0) + int(apart.size)
    if lost.size:
        dropped["not_connected_m"] = dropped.get("not_connected_m", 0) + round(float(road_m[lost].sum()))
    bbox = (float(lon.min() / E7), float(lat.min() / E7), float(lon.max() / E7), float(lat.max() / E7))
    return RoadGraph(
        meta=replace(meta, bbox=bbox, dropped=dropped, cut_off=_cut_off(names, nodes, links, lost, road_m[lost])),
        names=names,
        node_lat_deg=nodes.lat_deg[node_used],
        node_lon_deg=nodes.lon_deg[node_used],
        node_height_m=nodes.height_m[node_used],
        node_id=nodes.id[node_used],
        tail=node_rank[links.tail[used]],
        head=node_rank[links.head[used]],
        length_m=links.length_m[used],
        speed_limit_mps=links.speed_limit_mps[used],
        functional_class=links.functional_class[used],
        cross=links.cross[used],
        urban=links.urban[used],
        structure=links.structure[used],
        way_id=links.way_id[used],
        name_idx=links.name_idx[used],
        reverse_idx=np.where(reverse >= 0, rank[reverse], -1)[order].astype(np.int32),
        geometry_first=geometry_first,
        geometry_lon_e7=lon,
        geometry_lat_e7=lat,
        successor_first=new_first,
        successor=rank[successor[gather]].astype(np.int32),
        conditional=None if links.conditional is None else links.conditional.of_links(kept, rank),
        ferries=None if links.ferries is None else links.ferries.of_links(kept, rank),
        signs=None if links.signs is None else links.signs.of_links(used, node_rank),
    )


def _cut_off(
    names: tuple[str, ...],
    nodes: LooseNodes,
    links: LooseLinks,
    apart: NDArray[np.int64],
    road_m: NDArray[np.float64],
) -> tuple[CutOffPart, ...]:
    """The longest parts of links that were left out; a part is what hangs together, whatever its directions."""
    if not apart.size:
        return ()
    size = nodes.lat_deg.size
    joined = coo_array((np.ones(apart.size, np.int8), (links.tail[apart], links.head[apart])), shape=(size, size))
    part = np.unique(connected_components(joined, directed=False)[1][links.tail[apart]], return_inverse=True)[1]
    part_m, count = np.bincount(part, road_m), np.bincount(part)
    parts: list[CutOffPart] = []
    for k in np.argsort(-part_m, kind="stable")[:PARTS_NAMED].tolist():
        inside = apart[part == k]
        longest = int(inside[np.argmax(links.length_m[inside])])
        middle = int(links.geometry_first[longest : longest + 2].sum()) // 2
        parts.append(
            CutOffPart(
                link_count=int(count[k]),
                length_m=round(float(part_m[k]), 1),
                lat_deg=round(float(links.geometry_lat_e7[middle] / E7), 5),
                lon_deg=round(float(links.geometry_lon_e7[middle] / E7), 5),
                name=names[int(links.name_idx[longest])] if names else "",
            )
        )
    return tuple(parts)


def _pair_keys(pairs: NDArray[np.int64], link_count: int) -> NDArray[np.int64]:
    keys: NDArray[np.int64] = np.unique(pairs[:, 0] * link_count + pairs[:, 1]) if pairs.size else np.empty(0, np.int64)
    return keys


def _reverse_of(links: LooseLinks, kept: NDArray[np.int64]) -> NDArray[np.int64]:
    """Position in kept of the link that runs the other way over the same points, -1 where none, int64 (K,).

    Where several ways lie over the same points a link's reverse is that of its own way, and only where that has none
    one of another way.
    """
    middle, other_middle = _middles(links, kept)
    node_count = int(max(links.tail.max(initial=0), links.head.max(initial=0))) + 1
    reverse = np.full(kept.size, -1, np.int64)
    tail, head = links.tail[kept], links.head[kept]
    twoway_keys = np.isin(tail.astype(np.int64) * node_count + head, head.astype(np.int64) * node_count + tail)
    lon, lat, length = links.geometry_lon_e7, links.geometry_lat_e7, links.length_m
    for way in (links.way_id[kept], np.zeros(kept.size, np.int64)):
        waiting: dict[tuple[int, ...], list[int]] = {}
        for k in np.flatnonzero(twoway_keys & (reverse < 0)).tolist():
            mm, way_id = round(float(length[kept[k]]) * 1000.0), int(way[k])
            here = (int(tail[k]), int(head[k]), int(lon[middle[k]]), int(lat[middle[k]]), mm, way_id)
            there = (int(head[k]), int(tail[k]), int(lon[other_middle[k]]), int(lat[other_middle[k]]), mm, way_id)
            twins = waiting.get(there)
            if twins:
                twin = twins.pop()
                reverse[k], reverse[twin] = twin, k
            else:
                waiting.setdefault(here, []).append(k)
    return reverse


def _middles(links: LooseLinks, kept: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Middle geometry points of kept links, counted from their tails and from their heads, int64 (K,) each."""
    first = links.geometry_first
    middle = (first[kept] + first[kept + 1] - 1) // 2
    return middle, first[kept] + first[kept + 1] - 1 - middle


def _transitions(
    links: LooseLinks, kept: NDArray[np.int64], reverse: NDArray[np.int64], forbidden: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """CSR of permitted transitions between kept links: first (K+1,), successor (S,)."""
    tail, head = links.tail[kept], links.head[kept]
    by_tail = np.argsort(tail, kind="stable")
    sorted_tail = tail[by_tail]
    begin = np.searchsorted(sorted_tail, head, side="left")
    out_degree = np.searchsorted(sorted_tail, head, side="right") - begin
    origin = np.repeat(np.arange(kept.size), out_degree)
    offset = np.arange(origin.size) - np.repeat(np.cumsum(out_degree) - out_degree, out_degree)
    target = by_tail[np.repeat(begin, out_degree) + offset]
    allowed = np.ones(origin.size, bool)
    if forbidden.size:
        allowed = ~np.isin(kept[origin] * links.tail.size + kept[target], forbidden)
    # back over the same points, on the link's reverse or on another way that is drawn there
    middle, other_middle = _middles(links, kept)
    lon, lat, length = links.geometry_lon_e7, links.geometry_lat_e7, links.length_m[kept]
    u_turn = (reverse[origin] == target) | (
        (head[target] == tail[origin])
        & (lon[middle[origin]] == lon[other_middle[target]])
        & (lat[middle[origin]] == lat[other_middle[target]])
        & (np.abs(length[origin] - length[target]) < 1e-3)
    )
    onward = allowed & ~u_turn
    if links.ferries is not None:  # nobody has to board where a road ends at a ferry
        ferry = links.is_ferry()[kept]
        onward &= ~ferry[target] | ferry[origin]
    elsewhere = np.bincount(origin[onward], minlength=kept.size)
    allowed &= ~u_turn | (elsewhere[origin] == 0)
    counts = np.bincount(origin[allowed], minlength=kept.size)
    return np.concatenate(([0], np.cumsum(counts))), target[allowed]
