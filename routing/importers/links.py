"""Pieces of road as loose directed nodes and links, with limits, crossings and forbidden turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from routing.graph.conditional_limits import DAY_MIN, EVERY_DAY, ConditionalLimits
from routing.graph.earth import E7
from routing.graph.ferries import Ferries
from routing.graph.road_graph import LooseLinks, LooseNodes
from routing.graph.signs import RoadSigns
from routing.importers.crossings import cross_at_heads
from routing.importers.curves import bend_speeds_mps
from routing.importers.ferries import levelled
from routing.importers.roads import HALF_TURN_E7
from routing.importers.speeds import default_limits_mps
from routing.importers.tags import Dropped
from routing.importers.way_bans import banned_over_ways

if TYPE_CHECKING:
    from collections import Counter

    from numpy.typing import NDArray

    from routing.importers.chains import Chains, Pieces
    from routing.importers.crossings import Stops
    from routing.importers.roads import Roads, WayBan


def loose_graph(
    roads: Roads,
    chains: Chains,
    pieces: Pieces,
    stops: Stops,
    urban: NDArray[np.bool_],
    height_m: NDArray[np.float64] | None,
    dropped: Counter[str],
    bans_left: list[WayBan],
) -> tuple[LooseNodes, LooseLinks]:
    """Nodes and directed links of pieces; both directions of a road have the same length to the last bit.

    urban: bool (K,) by piece; height_m: float64 (P,) by point or None; counts of what is left out go into dropped, and
    bans over ways that are no forbidden turns into bans_left.
    """
    ways = roads.ways
    way_of_piece = chains.way[pieces.begin]
    ahead = np.flatnonzero(ways.forward[way_of_piece])
    back = np.flatnonzero(ways.backward[way_of_piece])
    piece = np.concatenate((ahead, back))
    reversed_ = np.concatenate((np.zeros(ahead.size, np.bool_), np.ones(back.size, np.bool_)))
    way = way_of_piece[piece]

    node_point, node_of_end = np.unique(np.concatenate((pieces.tail, pieces.head)), return_inverse=True)
    tail_node, head_node = np.split(node_of_end.astype(np.int32), 2)
    tail = np.where(reversed_, head_node[piece], tail_node[piece])
    head = np.where(reversed_, tail_node[piece], head_node[piece])
    added = node_point >= chains.map_points
    lowest_id = min(0, int(roads.point_id.min(initial=0)))
    node_id = np.empty(node_point.size, np.int64)
    node_id[~added] = roads.point_id[node_point[~added]]
    node_id[added] = lowest_id - 1 - np.arange(int(added.sum()))  # points put in have no identifier outside

    tagged = np.where(reversed_, ways.backward_mps[way], ways.forward_mps[way])
    default = default_limits_mps(
        roads.country, ways.functional_class[way], ways.ramp[way], ways.living_street[way], urban[piece]
    )
    default = np.where(urban[piece], default, np.minimum(default, bend_speeds_mps(roads)[way]))
    limit_mps = np.where(np.isnan(tagged), default, tagged)
    cross = cross_at_heads(roads, chains, pieces, stops, piece, reversed_)
    node_height_m = np.zeros(node_point.size) if height_m is None else height_m[node_point]
    ferries = None
    if ways.ferry_mps is not None and bool((ferry := ~np.isnan(ways.ferry_mps[way])).any()):
        limit_mps = np.where(ferry, ways.ferry_mps[way], limit_mps)
        cross = np.where(ferry, 0, cross).astype(np.int8)
        node_height_m = levelled(node_height_m, tail, head, ferry)
        ferries = Ferries(np.flatnonzero(ferry), pieces.length_m[piece[ferry]] / limit_mps[ferry])
    first, lon, lat = _geometry(chains, pieces, piece, reversed_)
    links = LooseLinks(
        tail=tail,
        head=head,
        length_m=pieces.length_m[piece],
        speed_limit_mps=limit_mps,
        functional_class=ways.functional_class[way],
        cross=cross,
        urban=urban[piece],
        structure=ways.structure[way],
        way_id=ways.id[way],
        name_idx=ways.name_idx[way],
        geometry_first=first,
        geometry_lon_e7=lon,
        geometry_lat_e7=lat,
        forbidden_turns=_forbidden_turns(
            roads, tail, head, ways.id[way], pieces.length_m[piece], node_id, dropped, bans_left
        ),
        conditional=_conditional(roads, way, reversed_),
        ferries=ferries,
        signs=_signs(roads, chains, pieces, piece, reversed_, node_point, head),
    )
    nodes = LooseNodes(
        lat_deg=chains.lat_e7[node_point] / E7,
        lon_deg=chains.lon_e7[node_point] / E7,
        height_m=node_height_m,
        id=node_id,
    )
    return nodes, links


def _signs(
    roads: Roads,
    chains: Chains,
    pieces: Pieces,
    piece: NDArray[np.int64],
    reversed_: NDArray[np.bool_],
    node_point: NDArray[np.int64],
    head: NDArray[np.int32],
) -> RoadSigns | None:
    """What is read along links, None where the map tells nothing of it.

    piece, reversed_: of each link. node_point: int64 (N,) points of nodes; head: int32 (M,) the node that it leads to.
    """
    ahead, back = roads.ways.sign_forward, roads.ways.sign_backward
    if ahead is None or back is None:
        return None
    way = chains.way[pieces.begin[piece]]
    exits, node = _nodes_of(np.array(sorted(roads.exits), np.int64), node_point)
    left_out = _left_out_exits(roads, chains, pieces)[piece]
    if roads.left_out_exits:
        # where nothing but the ring goes on, what is left out leaves the link that leads there
        at_node, node_of = _nodes_of(np.array(sorted(roads.left_out_exits), np.int64), node_point)
        count = np.zeros(node_point.size, np.int64)
        count[node_of] = [roads.left_out_exits[point] for point in at_node.tolist()]
        into = np.bincount(head, minlength=node_point.size)
        left_out += np.where(roads.ways.roundabout[way] & (into[head] == 1), count[head], 0)
    link = np.flatnonzero(left_out)
    return RoadSigns(
        np.where(reversed_, back[way], ahead[way]).astype(np.int32),
        roads.signs,
        node.astype(np.int32),
        tuple(roads.exits[point] for point in exits.tolist()),
        roads.drives_left,
        _nodes_of(np.array(sorted(roads.mini), np.int64), node_point)[1].astype(np.int32),
        link.astype(np.int32),
        left_out[link].astype(np.int32),
    )


def _nodes_of(point: NDArray[np.int64], node_point: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Those of ascending points that are nodes, and these nodes, int64 (k,) each."""
    node = np.minimum(np.searchsorted(node_point, point), node_point.size - 1)
    found = node_point[node] == point
    return point[found], node[found]


def _left_out_exits(roads: Roads, chains: Chains, pieces: Pieces) -> NDArray[np.int64]:
    """How many ways that are left out leave each piece of a ring between its ends, int64 (K,)."""
    if not roads.left_out_exits:
        return np.zeros(pieces.begin.size, np.int64)
    count = np.zeros(chains.point_count, np.int64)
    count[list(roads.left_out_exits)] = list(roads.left_out_exits.values())
    before = np.concatenate(([0], np.cumsum(count[chains.point])))
    between: NDArray[np.int64] = before[pieces.end] - before[pieces.begin + 1]
    return np.where(roads.ways.roundabout[chains.way[pieces.begin]], between, 0)


def _conditional(roads: Roads, way: NDArray[np.int64], reversed_: NDArray[np.bool_]) -> ConditionalLimits | None:
    """Limits under a condition of the links of ways, None where no way has one."""
    rows: list[tuple[int, float, bool, int, int, int]] = []
    for link in np.flatnonzero(np.isin(way, list(roads.conditional))).tolist():
        for limit in roads.conditional[int(way[link])][int(reversed_[link])]:
            spans = [(sum(1 << day for day in h.days), h.begin_min, h.end_min) for h in limit.hours]
            rows += [(link, limit.limit_mps, limit.wet, *span) for span in spans or [(EVERY_DAY, 0, DAY_MIN)]]
    if not rows:
        return None
    link_idx, limit_mps, wet, days, begin_min, end_min = zip(*rows, strict=True)
    return ConditionalLimits(
        link=np.array(link_idx, np.int64),
        limit_mps=np.array(limit_mps),
        wet=np.array(wet, np.bool_),
        days=np.array(days, np.int64),
        begin_min=np.array(begin_min, np.int64),
        end_min=np.array(end_min, np.int64),
    )


def _geometry(
    chains: Chains, pieces: Pieces, piece: NDArray[np.int64], reversed_: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int32]]:
    """Polylines of links in driving direction: the map's own points and the ends; points put in add no shape."""
    begin, end = pieces.begin[piece], pieces.end[piece]
    count = end - begin + 1
    first = np.concatenate(([0], np.cumsum(count)))
    offset = np.arange(int(first[-1])) - np.repeat(first[:-1], count)
    flip = np.repeat(reversed_, count)
    position = np.where(flip, np.repeat(end, count) - offset, np.repeat(begin, count) + offset)
    point = chains.point[position]
    at_tail, at_head = first[:-1], first[1:] - 1
    point[at_tail] = np.where(reversed_, pieces.head[piece], pieces.tail[piece])  # merged nodes move by centimetres
    point[at_head] = np.where(reversed_, pieces.tail[piece], pieces.head[piece])
    kept = point < chains.map_points
    kept[at_tail] = kept[at_head] = True
    kept_before = np.concatenate(([0], np.cumsum(kept)))
    point = point[kept]
    first = kept_before[first]
    lon = chains.lon_e7[point]
    for end, inner in ((first[:-1], first[:-1] + 1), (first[1:] - 1, first[1:] - 2)):
        east = lon[inner] < 0  # 180° is -180° to those who come from there
        edge = np.abs(lon[end]) == HALF_TURN_E7
        lon[end[edge]] = np.where(east[edge], -HALF_TURN_E7, HALF_TURN_E7)
    return first, lon, chains.lat_e7[point]


def _forbidden_turns(
    roads: Roads,
    tail: NDArray[np.int32],
    head: NDArray[np.int32],
    way_id: NDArray[np.int64],
    length_m: NDArray[np.float64],
    node_id: NDArray[np.int64],
    dropped: Counter[str],
    bans_left: list[WayBan],
) -> NDArray[np.int64]:
    """Pairs of links that restrictions forbid, int64 (k, 2); an only-rule forbids all other turns at its node."""
    node_of_id: dict[int, int] = {}
    wanted = {r.via_point_id for r in roads.restrictions}
    for idx in np.flatnonzero(np.isin(node_id, list(wanted))).tolist():
        node_of_id[int(node_id[idx])] = idx
    via_nodes = list(node_of_id.values())
    into: dict[int, list[int]] = {}
    out_of: dict[int, list[int]] = {}
    for link in np.flatnonzero(np.isin(head, via_nodes)).tolist():
        into.setdefault(int(head[link]), []).append(link)
    for link in np.flatnonzero(np.isin(tail, via_nodes)).tolist():
        out_of.setdefault(int(tail[link]), []).append(link)
    pairs: list[tuple[int, int]] = []
    ordered: dict[int, set[int]] = {}  # of several orders that hold for a link each names a turn that is permitted
    for rule in roads.restrictions:
        node = node_of_id.get(rule.via_point_id, -1)
        origin = [k for k in into.get(node, []) if int(way_id[k]) in rule.from_way_ids]
        target = [k for k in out_of.get(node, []) if int(way_id[k]) in rule.to_way_ids]
        if not origin or not target:
            dropped[Dropped.RESTRICTION_MOOT] += 1
        elif len(origin) > len(rule.from_way_ids) or len(target) > len(rule.to_way_ids):
            dropped[Dropped.RESTRICTION] += 1  # the way runs on through the node: which side is meant?
        elif rule.only:
            for a in origin:
                ordered.setdefault(a, set()).update(target)
        else:
            pairs += [(a, b) for a in origin for b in target]
    pairs += [(a, b) for a, permitted in ordered.items() for b in out_of[int(head[a])] if b not in permitted]
    pairs += banned_over_ways(roads.way_bans, tail, head, way_id, length_m, dropped, bans_left)
    return np.array(pairs, np.int64).reshape(-1, 2)
