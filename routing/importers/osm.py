"""Reads the drivable roads of an OpenStreetMap PBF or XML file."""

from __future__ import annotations

from array import array
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import osmium
from shapely import Polygon

from energy.stops import FunctionalClass
from routing.errors import ImportFailedError
from routing.graph.cut_roads import Extent
from routing.graph.earth import E7
from routing.graph.road_graph import PARTS_NAMED, LeftOutFerry
from routing.graph.signs import NO_SIGN
from routing.importers.beside import read_wanted
from routing.importers.ferries import ferry_speed, is_ferry, line_length_m, takes_cars
from routing.importers.osm_files import check_strings, deleted_objects, header_boxes, open_osm, region_boundary
from routing.importers.roads import Restriction, Roads, WayBan, Ways
from routing.importers.signs import DIRECTIONS, drives_left, exit_ref_of, is_mini_roundabout, read_tags, sign_of
from routing.importers.speeds import country_code, limits_from_tags, most_named
from routing.importers.tags import (
    Barrier,
    Control,
    Dropped,
    Oneway,
    TurnRule,
    admitted_class,
    barrier_of,
    control,
    drivable,
    is_conditional,
    is_roundabout,
    is_structure,
    oneway,
    reason_to_drop,
    road_class,
    turn_rule,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from routing.graph.signs import RoadSign
    from routing.importers.beside import ReadBeside
    from routing.importers.conditional import ConditionalLimit

    Conditional = tuple[tuple[ConditionalLimit, ...], tuple[ConditionalLimit, ...]]

BUILT_UP_LANDUSE: Final = frozenset(("residential", "commercial", "retail", "industrial"))
_KEYS: Final = (
    *("highway", "barrier", "crossing", "crossing:signals", "railway", "landuse", "type", "route"),
    *("addr:country", "ISO3166-1", "ISO3166-1:alpha2"),
)
_KEY_SET: Final = frozenset(_KEYS)
_PROGRESS_STEP: Final = 20_000


def read_osm(
    path: Path,
    progress: Callable[[float], None] | None = None,
    *,
    ferries: bool = False,
    beside: ReadBeside | None = None,
) -> Roads:
    """The drivable roads of an OSM file with their controls, turn restrictions and built-up areas, in O(file).

    Nodes, ways and relations may come in any order and with negative ids; what is marked as deleted is passed over. Of
    a way that is there twice the later one holds. Raises ImportFailedError naming the file when it is missing, empty,
    damaged, holds several versions of objects or no drivable way. Ways may name points that the file lacks, as in
    extracts: they are cut there. ferries: bring in those that take cars; otherwise they are left out and counted.
    beside: takes what it needs beside the roads from the same pass over the file.
    """
    if not path.is_file():
        raise ImportFailedError("map", path, "is a folder, allowed: a file" if path.is_dir() else "no such file")
    size_bytes = path.stat().st_size
    if size_bytes == 0:
        raise ImportFailedError("map", path, "the file is empty (0 bytes)")
    file = open_osm(path)
    check_strings(path)
    reader = _Reader(deleted_objects(path), ferries=ferries)
    try:
        processor = osmium.FileProcessor(file)
        if processor.header.has_multiple_object_versions:
            reason = "holds the history of objects, allowed: one version of each (osmium time-filter makes it)"
            raise ImportFailedError("map", path, reason)
        processor = processor.with_locations().with_filter(
            osmium.filter.KeyFilter(*_KEYS, *(beside.keys if beside else ()))
        )
        entity: Any
        for count, entity in enumerate(processor):
            if reader.is_deleted(entity):
                continue
            if progress and count % _PROGRESS_STEP == 0:  # the file's length in objects is unknown: approach 1
                progress(1.0 - 1.0 / (1.0 + count / (10.0 * _PROGRESS_STEP)))
            tags = {tag.k: tag.v for tag in entity.tags} if beside else None
            places = reader.add(entity, tags) if tags is None or not _KEY_SET.isdisjoint(tags) else None
            if beside and tags is not None:
                beside.add(entity, tags, places)
        reader.ask_for_ferries()
        if reader.missing:  # nodes behind their ways, or with negative ids, which the index of locations can't hold
            nodes = osmium.FileProcessor(file, osmium.osm.NODE)
            if min(reader.missing) >= 0:
                nodes = nodes.with_filter(osmium.filter.IdFilter(reader.missing))
            for entity in nodes:
                reader.locate(entity)
        if reader.lost():  # ways may carry the places of their points, as `out geom` of Overpass has them
            for entity in osmium.FileProcessor(file, osmium.osm.WAY):
                reader.locate_along(entity)
    except (RuntimeError, ValueError, osmium.InvalidLocationError) as error:
        raise ImportFailedError("map", path, f"not a readable OSM file ({error})") from error
    reader.cut_ways()
    if not set(reader.way_id) - set(reader.ferries):
        raise ImportFailedError("map", path, reader.why_none())
    lacking = reader.lacking()
    boxes = header_boxes(path, processor.header)
    region = None if lacking else region_boundary(file, reader.lon_e7, reader.lat_e7)
    if beside:
        read_wanted(file, beside)
        beside.finish(reader.country())
    return replace(reader.roads(path.name), extent=Extent(boxes, region, lacking))


class _Reader:
    """Collects objects in any order; ways become parts between barriers when all nodes are known."""

    def __init__(self, deleted: frozenset[tuple[str, int]], *, ferries: bool) -> None:
        self.deleted = deleted
        self.takes_ferries = ferries
        self.ferries: dict[int, str | None] = {}  # durations of those that are brought in
        self.left_out: dict[int, tuple[tuple[int, ...], str]] = {}
        self.ferry_lines: list[tuple[tuple[int, ...], str]] = []  # ways of relations, and their durations
        self.location: dict[int, tuple[int, int]] = {}
        self.missing: set[int] = set()
        self.drawn: dict[int, tuple[tuple[int, ...], tuple[Any, ...], Conditional]] = {}
        self.areas: list[tuple[int, ...]] = []
        self.dropped: Counter[str] = Counter()
        self.controls_by_id: dict[int, Control] = {}
        self.blocked: dict[int, Dropped] = {}
        self.countries: Counter[str] = Counter()
        self.country_areas: set[str] = set()
        self.point_idx: dict[int, int] = {}
        self.point_id: list[int] = []
        self.lon_e7: list[int] = []
        self.lat_e7: list[int] = []
        self.way_first: list[int] = [0]
        self.way_point: list[int] = []
        self.way_id: list[int] = []
        self.way_row: list[tuple[int, bool, bool, bool, bool, bool, bool, float, float, int, int, int, int]] = []
        self.name_idx: dict[str, int] = {"": 0}
        self.sign_idx: dict[RoadSign, int] = {NO_SIGN: 0}
        self.sign_pairs: dict[tuple[bool, tuple[tuple[str, str], ...]], tuple[int, int]] = {}
        self.exits_by_id: dict[int, str] = {}
        self.mini_ids: list[int] = []
        self.left_out_ids = array("q")  # points at which driveways and the like may be driven into
        self.driving_sides: Counter[str] = Counter()
        self.restrictions: list[Restriction] = []
        self.way_bans: list[WayBan] = []
        self.built_up: list[Polygon] = []
        self.copies = 0
        self.beside_missing: set[int] = set()
        self.conditional: dict[int, Conditional] = {}
        self.lowest_id = 0
        self.speed_mps: dict[int, float] = {}

    def is_deleted(self, entity: Any) -> bool:
        """Whether an object is marked as deleted, by `visible` or as editors do."""
        return not entity.visible or (entity.type_str(), entity.id) in self.deleted

    def locate(self, node: Any) -> None:
        """Take the place of a node that ways name and that was not known with them."""
        if node.id in self.missing and node.location.valid() and not self.is_deleted(node):
            self.location[node.id] = (node.location.x, node.location.y)

    def locate_along(self, way: Any) -> None:
        """Take the places that a way carries of points that the file lacks."""
        if way.id not in self.drawn or self.is_deleted(way):
            return
        for node in way.nodes:
            if node.ref in self.missing and node.location.valid() and ("n", node.ref) not in self.deleted:
                self.location.setdefault(node.ref, (node.location.x, node.location.y))

    def why_none(self) -> str:
        """Why there are no roads."""
        if self.drawn and (self.dropped[Dropped.POINTS] or not self.location):
            lost, roads = len(self.lost()) or "all", len(self.drawn)
            return f"lacks {lost} points of its {roads} roads, needed: ways with their nodes (Overpass: (._;>;);)"
        counts = ", ".join(f"{reason} {count}" for reason, count in sorted(self.dropped.items()) if count)
        reason = "no way in it may be driven by car, needed: at least one drivable highway"
        return f"{reason} (left out: {counts})" if counts else reason

    def lost(self) -> set[int]:
        """Points of ways whose place is not known."""
        return self.missing - self.location.keys()

    def _refs(self, way: Any) -> tuple[int, ...]:
        """Ids of a way's points, whose places are kept."""
        refs = []
        for node in way.nodes:
            ref, location = node.ref, node.location
            refs.append(ref)
            if ref in self.location:
                continue
            if location.valid() and ("n", ref) not in self.deleted:
                self.location[ref] = (location.x, location.y)
            else:
                self.missing.add(ref)
        return tuple(refs)

    def add(self, entity: Any, tags: Mapping[str, str] | None) -> list[tuple[int, int]] | None:
        """Take an object; the places of a road's points, those that are known. tags: of it, None to have them read."""
        if entity.is_way():
            refs = self.add_way(entity, tags)
            return None if tags is None or refs is None else self._places_e7(refs)
        if entity.is_node():
            self.add_node(entity, tags)
        elif entity.is_relation():
            self.add_relation(entity)
        return None

    def add_node(self, node: Any, known_tags: Mapping[str, str] | None = None) -> None:
        tags = known_tags or {tag.k: tag.v for tag in node.tags}
        found = control(tags)
        if found is not None:
            self.controls_by_id[node.id] = found
        if number := exit_ref_of(tags):
            self.exits_by_id[node.id] = number
        if is_mini_roundabout(tags):
            self.mini_ids.append(node.id)
        barrier = barrier_of(tags)
        if barrier is not Barrier.OPEN:
            self.blocked[node.id] = Dropped.BARRIER if barrier is Barrier.SHUT else Dropped.BARRIER_UNKNOWN
        if "addr:country" in tags:
            code = country_code(tags["addr:country"])
            if code is not None:
                self.countries[code] += 1

    def add_way(self, way: Any, known_tags: Mapping[str, str] | None = None) -> tuple[int, ...] | None:
        """Take a way; the points of a road, None of what is none."""
        if "route" in way.tags and is_ferry({"route": way.tags["route"]}):
            self._add_ferry(way)
            return None
        highway = way.tags.get("highway")
        if highway is None:
            self._add_area(way)
            return None
        found = road_class(highway) or admitted_class(highway, way.tags)
        if found is None:
            return None
        tags = known_tags or {tag.k: tag.v for tag in way.tags}
        reason = reason_to_drop(tags)
        forward, backward = drivable(tags)
        if reason is None and oneway(tags) is Oneway.CHANGING:
            reason = Dropped.REVERSIBLE
        if reason is not None:
            self.dropped[reason] += 1
            if reason is Dropped.SERVICE:
                self._leave_out(way, forward=forward, backward=backward)
            return None
        limits = limits_from_tags(tags)
        if limits.implausible:
            self.dropped[Dropped.SPEED] += limits.implausible
        if limits.country:
            self.countries[limits.country] += 1
        if is_conditional(tags):
            self.dropped[Dropped.CONDITIONAL] += 1
        if limits.unread:
            self.dropped[Dropped.LIMIT_CONDITION] += limits.unread
        label = tags.get("name") or tags.get("ref") or ""
        row = (
            int(found.functional_class),
            found.ramp,
            found.living_street,
            is_roundabout(tags),
            is_structure(tags),
            forward,
            backward,
            limits.forward_mps or np.nan,
            limits.backward_mps or np.nan,
            -1 if limits.urban is None else int(limits.urban),
            self.name_idx.setdefault(label, len(self.name_idx)),
            *self._signs(tags, oneway=forward != backward),
        )
        refs = self._refs(way)
        self.drawn[way.id] = (refs, row, limits.conditional)
        return refs

    def _leave_out(self, way: Any, *, forward: bool, backward: bool) -> None:
        """Keep where a way can be driven into that is none of the roads: drivers count it at roundabouts."""
        if forward:
            self.left_out_ids.append(way.nodes[0].ref)
        if backward:
            self.left_out_ids.append(way.nodes[-1].ref)

    def _left_out_exits(self, ways: Ways) -> dict[int, int]:
        """How many of those leave a point of a ring, by its position."""
        on_ring = np.unique(ways.point[np.repeat(ways.roundabout, np.diff(ways.way_first))])
        ids = np.array(self.point_id, np.int64)[on_ring]
        order = np.argsort(ids)
        left_out, count = np.unique(np.frombuffer(self.left_out_ids, np.int64), return_counts=True)
        at = np.minimum(np.searchsorted(ids[order], left_out), max(ids.size - 1, 0))
        found = ids[order][at] == left_out if ids.size else np.zeros(left_out.size, np.bool_)
        points = on_ring[order][at[found]] if ids.size else on_ring
        return dict(zip(points.tolist(), count[found].tolist(), strict=True))

    def _add_ferry(self, way: Any) -> None:
        tags = {tag.k: tag.v for tag in way.tags}
        if not takes_cars(tags) or not any(drivable(tags)):
            self.dropped[Dropped.ACCESS] += 1
            return
        if oneway(tags) is Oneway.CHANGING:
            self.dropped[Dropped.REVERSIBLE] += 1
            return
        label = tags.get("name") or tags.get("ref") or ""
        if not self.takes_ferries:
            refs = []
            for node in way.nodes:  # those that are not known yet are asked for only if nodes of roads are, too
                refs.append(node.ref)
                if node.location.valid():
                    self.location.setdefault(node.ref, (node.location.x, node.location.y))
            self.left_out[way.id] = (tuple(refs), label)
            return
        self.ferries[way.id] = tags.get("duration")
        name_idx = self.name_idx.setdefault(label, len(self.name_idx))
        ahead, back = drivable(tags)
        signs = self._signs(tags, oneway=ahead != back)
        row = (
            int(FunctionalClass.SERVICE),
            False,
            False,
            False,
            True,
            ahead,
            back,
            np.nan,
            np.nan,
            0,
            name_idx,
            *signs,
        )
        self.drawn[way.id] = (self._refs(way), row, ((), ()))

    def _signs(self, tags: Mapping[str, str], *, oneway: bool) -> tuple[int, int]:
        """What is read on a way along and against its points."""
        key = (oneway, read_tags(tags))
        known = self.sign_pairs.get(key)
        if known is None:
            idx = self.sign_idx
            ahead, back = (sign_of(tags, direction, oneway=oneway) for direction in DIRECTIONS)
            known = idx.setdefault(ahead, len(idx)), idx.setdefault(back, len(idx))
            self.sign_pairs[key] = known
        return known

    def ask_for_ferries(self) -> None:
        """Have the places of ferries that are left out looked for where the file is read again anyhow."""
        if self.missing:
            self.missing |= {ref for refs, _ in self.left_out.values() for ref in refs if ref not in self.location}

    def _places_e7(self, refs: tuple[int, ...]) -> list[tuple[int, int]]:
        return [self.location[ref] for ref in refs if ref in self.location]

    def _ferry_speeds_mps(self) -> dict[int, float]:
        """Speeds of the ferries that are brought in, by way."""
        length_m = {way: line_length_m(self._places_e7(self.drawn[way][0])) for way in self.ferries}
        speed_mps: dict[int, float] = {}
        for ways, duration in self.ferry_lines:  # the whole line's duration, for ways that say none of their own
            if all(way in self.ferries for way in ways):
                line = ferry_speed(duration, sum(length_m[way] for way in ways))
                if not line.assumed:
                    speed_mps.update((way, line.mps) for way in ways if self.ferries[way] is None)
                self.dropped[Dropped.FERRY_DURATION] += line.not_used
        for way, tag in self.ferries.items():
            if way not in speed_mps:
                speed = ferry_speed(tag, length_m[way])
                speed_mps[way] = speed.mps
                self.dropped[Dropped.FERRY_ASSUMED] += speed.assumed
                self.dropped[Dropped.FERRY_DURATION] += speed.not_used
        return speed_mps

    def ferries_left_out(self) -> tuple[LeftOutFerry, ...]:
        """The longest ferries that were left out; all are counted."""
        found = []
        for refs, label in self.left_out.values():
            places = self._places_e7(refs)
            lon_e7, lat_e7 = places[0] if places else (0, 0)
            found.append(
                LeftOutFerry(round(line_length_m(places), 1), round(lat_e7 / E7, 5), round(lon_e7 / E7, 5), label)
            )
        self.dropped[Dropped.FERRY] += len(found)
        self.dropped[Dropped.FERRY_M] += round(sum(ferry.length_m for ferry in found))
        found = [ferry for ferry in found if ferry.length_m > 0.0]
        return tuple(sorted(found, key=lambda ferry: -ferry.length_m)[:PARTS_NAMED])

    def cut_ways(self) -> None:
        """Make points and parts of all ways, and areas, once every object is known."""
        self.lowest_id = min(0, min(self.location, default=0))
        self.speed_mps = self._ferry_speeds_mps()
        for way_id, (refs, row, conditional) in self.drawn.items():
            for part in self._parts(refs):
                if any(conditional):
                    self.conditional[len(self.way_id)] = conditional
                self.way_point.extend(part)
                self.way_first.append(len(self.way_point))
                self.way_id.append(way_id)
                self.way_row.append(row)
        for refs in self.areas:
            ring = [(x / E7, y / E7) for x, y in (self.location[ref] for ref in refs if ref in self.location)]
            if len(ring) <= 3:
                continue
            if max(x for x, _ in ring) - min(x for x, _ in ring) > 180.0:  # over the antimeridian: once on each side
                ring = [(x % 360.0, y) for x, y in ring]
                self.built_up.append(Polygon([(x - 360.0, y) for x, y in ring]))
            self.built_up.append(Polygon(ring))

    def _parts(self, refs: tuple[int, ...]) -> list[list[int]]:
        """Point positions of a way, cut at missing points and at barriers."""
        parts: list[list[int]] = [[]]
        for at, ref in enumerate(refs):
            if ref not in self.location:
                self.dropped[Dropped.POINTS] += 1
                if ("n", ref) not in self.deleted:
                    self.beside_missing.update(refs[max(at - 1, 0) : at + 2])
                parts.append([])
                continue
            x, y = self.location[ref]
            if ref in self.blocked:
                # each side gets its own copy of the point, so that no path leads through it
                self.dropped[self.blocked[ref]] += 1
                if parts[-1]:
                    parts[-1].append(self._copy(x, y))
                parts.append([self._copy(x, y)])
                continue
            idx = self.point_idx.get(ref)
            if idx is None:
                idx = self.point_idx[ref] = self._new_point(ref, x, y)
            part = parts[-1]
            if not part or part[-1] != idx:  # two points at one place both stay: the zero step is contracted later
                part.append(idx)
        return [part for part in parts if len(part) > 1]

    def lacking(self) -> tuple[int, ...]:
        """Positions of points beside which ways name points that the file lacks."""
        return tuple(sorted(self.point_idx[ref] for ref in self.beside_missing if ref in self.point_idx))

    def _copy(self, x: int, y: int) -> int:
        self.copies += 1
        return self._new_point(self.lowest_id - self.copies, x, y)

    def _new_point(self, point_id: int, x: int, y: int) -> int:
        self.point_id.append(point_id)
        self.lon_e7.append(x)
        self.lat_e7.append(y)
        return len(self.point_id) - 1

    def _add_area(self, way: Any) -> None:
        if way.tags.get("landuse") in BUILT_UP_LANDUSE and way.is_closed():
            self.areas.append(self._refs(way))

    def add_relation(self, relation: Any) -> None:
        tags = {tag.k: tag.v for tag in relation.tags}
        code = tags.get("ISO3166-1") or tags.get("ISO3166-1:alpha2")
        if tags.get("boundary") == "administrative" and tags.get("admin_level") == "2" and code:
            self.country_areas.add(country_code(code) or code.upper())
            if "driving_side" in tags:
                self.driving_sides[tags["driving_side"].strip().lower()] += 1
        kind = tags.get("type", "").strip().lower()
        if kind == "route" and is_ferry(tags) and "duration" in tags:
            self.ferry_lines.append((tuple(m.ref for m in relation.members if m.type == "w"), tags["duration"]))
            return
        if kind != "restriction" and not kind.startswith("restriction:"):
            return
        rule = turn_rule(tags)
        if rule is None:
            return
        if isinstance(rule, Dropped):
            self.dropped[rule] += 1
            return
        self._add_restriction(relation, rule)

    def _add_restriction(self, relation: Any, rule: TurnRule) -> None:
        members = [(m.role.strip().lower(), m.type, m.ref) for m in relation.members]
        via = [(kind, ref) for role, kind, ref in members if role == "via"]
        origin = tuple(ref for role, kind, ref in members if role == "from" and kind == "w")
        target = tuple(ref for role, kind, ref in members if role == "to" and kind == "w")
        if origin and target and via and all(kind == "w" for kind, _ in via):
            self.way_bans.append(WayBan(origin, tuple(ref for _, ref in via), target, rule.only))
            return
        if len(via) != 1 or via[0][0] != "n" or not origin or not target:
            self.dropped[Dropped.RESTRICTION] += 1
            return
        self.restrictions.append(Restriction(origin, via[0][1], target, rule.only))

    def country(self) -> str | None:
        """The country most tags name, else the only one whose boundary is in the file."""
        if self.countries:
            return most_named(self.countries)
        return next(iter(self.country_areas)) if len(self.country_areas) == 1 else None

    def roads(self, source: str) -> Roads:
        columns = list(zip(*self.way_row, strict=True))
        left_out = self.ferries_left_out()
        ferry_mps = np.array([self.speed_mps.get(way, np.nan) for way in self.way_id]) if self.speed_mps else None
        controls: Mapping[int, Control] = {
            self.point_idx[point]: found for point, found in self.controls_by_id.items() if point in self.point_idx
        }
        lon_e7, lat_e7 = np.array(self.lon_e7, np.int32), np.array(self.lat_e7, np.int32)
        ways = Ways(
            way_first=np.array(self.way_first, np.int64),
            point=np.array(self.way_point, np.int32),
            id=np.array(self.way_id, np.int64),
            functional_class=np.array(columns[0], np.int8),
            ramp=np.array(columns[1], np.bool_),
            living_street=np.array(columns[2], np.bool_),
            roundabout=np.array(columns[3], np.bool_),
            structure=np.array(columns[4], np.bool_),
            forward=np.array(columns[5], np.bool_),
            backward=np.array(columns[6], np.bool_),
            forward_mps=np.array(columns[7], np.float64),
            backward_mps=np.array(columns[8], np.float64),
            urban=np.array(columns[9], np.int8),
            name_idx=np.array(columns[10], np.int32),
            ferry_mps=ferry_mps,
            sign_forward=np.array(columns[11], np.int32),
            sign_backward=np.array(columns[12], np.int32),
        )
        country = self.country()
        return Roads(
            point_id=np.array(self.point_id, np.int64),
            lon_e7=lon_e7,
            lat_e7=lat_e7,
            ways=ways,
            names=tuple(self.name_idx),
            controls=controls,
            restrictions=tuple(self.restrictions),
            way_bans=tuple(self.way_bans),
            built_up=tuple(self.built_up),
            country=country,
            source=source,
            licence="ODbL-1.0",
            attribution="© OpenStreetMap contributors",
            dropped=dict(self.dropped),
            conditional=self.conditional,
            ferries_left_out=left_out,
            signs=tuple(self.sign_idx),
            exits={self.point_idx[k]: ref for k, ref in self.exits_by_id.items() if k in self.point_idx},
            drives_left=drives_left(self.driving_sides, country, ways, lon_e7, lat_e7),
            mini=frozenset(self.point_idx[k] for k in self.mini_ids if k in self.point_idx),
            left_out_exits=self._left_out_exits(ways),
        )
