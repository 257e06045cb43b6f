"""The import of a region: a map file and elevation files in, a RoadGraph out."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.errors import ImportFailedError
from routing.graph.cut_roads import Extent, cut_nodes
from routing.graph.earth import E7
from routing.graph.networkx_graph import from_networkx, is_export, load_networkx
from routing.graph.road_graph import GraphMeta, RoadGraph, Terrain, assemble_graph
from routing.importers.built_up import urban_pieces
from routing.importers.chains import chains_from_roads, junction_positions, pieces_of
from routing.importers.crossings import place_controls
from routing.importers.ferries import without_spurs
from routing.importers.graphml import roads_from_networkx
from routing.importers.heights.elevation import sample_heights
from routing.importers.heights.profile import limit_grades, smooth_along_roads
from routing.importers.links import loose_graph
from routing.importers.osm import read_osm
from routing.importers.osm_files import is_graphml
from routing.importers.roads import cut_at_antimeridian
from routing.importers.tags import Dropped
from routing.importers.way_bans import with_bans_over_ways

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from routing.importers.beside import ReadBeside
    from routing.importers.chains import Chains, Pieces
    from routing.importers.roads import Roads, WayBan

DEFAULT_SMOOTHING_M: Final = 300.0
MAX_SMOOTHING_M: Final = 5000.0
PROFILE_STEP_M: Final = 30.0
FLAT_STEP_M: Final = 250.0  # without heights points are put in only to bound the length of links
GRADE_TOLERANCE_M: Final = 2.5
LONGEST_LINK_M: Final = 1500.0


def import_region(
    map_path: Path,
    dem_paths: Sequence[Path],
    name: str,
    *,
    smoothing_m: float = DEFAULT_SMOOTHING_M,
    ferries: bool = False,
    beside: ReadBeside | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> RoadGraph:
    """The road graph of a map, with heights from elevation files; nothing is written.

    map_path: OpenStreetMap PBF or XML, or GraphML as OSMnx writes it. dem_paths: GeoTIFF, .hgt, .hgt.zip; none gives a
    graph without terrain, unless a GraphML brings its own heights. smoothing_m: 0..5000 [m], see smooth_along_roads.
    ferries: bring in those that take cars, as links with a duration and no energy; OpenStreetMap files only.
    beside: takes what it needs beside the roads from an OpenStreetMap file; a GraphML has nothing for it.
    progress: called with a stage's name and the part of it that is done, 0..1.
    Raises ImportFailedError, and GraphFormatError for a GraphML that another version of joulepath wrote.
    """
    if not 0.0 <= smoothing_m <= MAX_SMOOTHING_M:
        raise ImportFailedError("smoothing_m", smoothing_m, f"allowed: 0..{MAX_SMOOTHING_M:g} m")

    def stage(label: str) -> Callable[[float], None]:
        def report(done: float) -> None:
            if progress:
                progress(label, done)

        report(0.0)
        return report

    report = stage("read map")
    if map_path.suffix.lower() == ".graphml" or is_graphml(map_path):
        if ferries:
            raise ImportFailedError("ferries", "on", f"{map_path.name} is GraphML, allowed: an OpenStreetMap file")
        if not map_path.is_file():
            raise ImportFailedError("map", map_path, "no such file")
        loaded = load_networkx(map_path)
        report(0.5)
        if is_export(loaded):
            if dem_paths:
                names = ", ".join(path.name for path in dem_paths)
                reason = f"{map_path.name} is a joulepath export with its own heights; import its original map instead"
                raise ImportFailedError("dem", names, reason)
            graph = from_networkx(loaded, str(map_path))
            return replace(graph, meta=replace(graph.meta, name=name))
        roads = roads_from_networkx(loaded, map_path.name)
    else:
        roads = read_osm(map_path, report, ferries=ferries, beside=beside)
    report(1.0)
    return graph_from_roads(roads, dem_paths, name, smoothing_m=smoothing_m, stage=stage)


def graph_from_roads(
    roads: Roads,
    dem_paths: Sequence[Path],
    name: str,
    *,
    smoothing_m: float,
    stage: Callable[[str], Callable[[float], None]],
) -> RoadGraph:
    """The road graph of roads already read, arguments as in import_region."""
    dropped: Counter[str] = Counter({str(reason): count for reason, count in roads.dropped.items()})
    roads = cut_at_antimeridian(roads)
    chains = chains_from_roads(roads, PROFILE_STEP_M if dem_paths else FLAT_STEP_M)
    height_m = outside = None
    if dem_paths:
        height_m, outside = _heights(roads, chains, dem_paths, smoothing_m, stage, dropped)
        method = _method(smoothing_m)
    elif roads.height_m is not None:
        height_m = limit_grades(chains, roads.ways.functional_class, _interpolated(roads, chains))
        method = "as given by the nodes of the map, straight between them, grades limited by road class"
    else:
        method = "none"
    report = stage("cut links")
    bans_left: list[WayBan] = []
    stops = place_controls(roads, chains)
    node = junction_positions(chains)
    node |= np.isin(chains.point, list(stops.nodes))
    is_cut = np.zeros(chains.point_count, np.bool_)
    if roads.extent is not None:
        is_cut[list(roads.extent.lacking)] = True
        node |= is_cut[chains.point]
    is_left_out = np.zeros(chains.point_count, np.bool_)
    pieces = pieces_of(chains, node, height_m, GRADE_TOLERANCE_M, LONGEST_LINK_M)
    dropped[Dropped.LOOP] += pieces.loops
    if outside is not None:
        covered = pieces.without(chains, outside)
        left_out = ~np.isin(pieces.begin, covered.begin)
        is_left_out[np.concatenate((pieces.tail[left_out], pieces.head[left_out]))] = True
        dropped[Dropped.HEIGHT] += pieces.length_m.size - covered.length_m.size
        pieces = covered
    if roads.ways.ferry is not None:
        leading = without_spurs(chains, pieces, roads.ways.ferry)
        dropped[Dropped.FERRY_END] += _ferry_count(roads, chains, pieces) - _ferry_count(roads, chains, leading)
        pieces = leading
    report(0.5)
    nodes, links = loose_graph(
        roads, chains, pieces, stops, urban_pieces(roads, chains, pieces), height_m, dropped, bans_left
    )
    report(1.0)
    report = stage("assemble graph")
    sources = [roads.source, *(path.name for path in dem_paths)]
    meta = GraphMeta(
        name=name,
        source="; ".join(sources),
        licence=roads.licence,
        attribution=roads.attribution,
        terrain=Terrain.ABSENT if height_m is None else Terrain.MEASURED,
        elevation_method=method,
        smoothing_m=smoothing_m if dem_paths else 0.0,
        bbox=(0.0, 0.0, 0.0, 0.0),  # assemble_graph finds it
        dropped={str(reason): count for reason, count in sorted(dropped.items()) if count},
        ferries_left_out=roads.ferries_left_out,
    )
    graph = assemble_graph(meta, roads.names, nodes, links)
    if roads.extent is not None or is_left_out.any():
        node = np.unique(np.concatenate((pieces.tail, pieces.head)))  # the points that loose_graph takes as nodes
        way_end = np.zeros(chains.point_count, np.bool_)
        way_end[chains.point[chains.first[:-1]]] = way_end[chains.point[chains.first[1:] - 1]] = True
        masks = (is_cut[node], way_end[node], is_left_out[node])
        graph = replace(graph, cut_node=cut_nodes(graph, roads.extent or Extent(), nodes, links, *masks))
    graph = with_bans_over_ways(graph, bans_left)
    report(1.0)
    return graph


def _heights(
    roads: Roads,
    chains: Chains,
    dem_paths: Sequence[Path],
    smoothing_m: float,
    stage: Callable[[str], Callable[[float], None]],
    dropped: Counter[str],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    report = stage("read elevation")
    lon_deg, lat_deg, ferry = chains.lon_e7 / E7, chains.lat_e7 / E7, roads.ways.ferry
    if ferry is None:
        raw_m, outside = sample_heights(dem_paths, lon_deg, lat_deg, report, dropped)
    else:  # what ferries alone pass has no ground
        on_road = np.zeros(chains.point_count, np.bool_)
        on_road[chains.point[~ferry[chains.way]]] = True
        ground_m, beyond = sample_heights(dem_paths, lon_deg[on_road], lat_deg[on_road], report, dropped)
        raw_m, outside = np.full(on_road.size, float(ground_m.mean())), np.zeros(on_road.size, np.bool_)
        raw_m[on_road], outside[on_road] = ground_m, beyond
    report = stage("smooth heights")
    smooth_m = smooth_along_roads(chains, roads.ways.structure, raw_m, smoothing_m)
    report(0.5)
    height_m = limit_grades(chains, roads.ways.functional_class, smooth_m, ferry)
    report(1.0)
    return height_m, outside


def _ferry_count(roads: Roads, chains: Chains, pieces: Pieces) -> int:
    """Number of ferries of which a piece is there."""
    assert roads.ways.ferry is not None
    way = chains.way[pieces.begin]
    return int(np.unique(roads.ways.id[way[roads.ways.ferry[way]]]).size)


def _interpolated(roads: Roads, chains: Chains) -> NDArray[np.float64]:
    """Heights of all points where the map knows them at the ends of ways, float64 (P,) [m]."""
    assert roads.height_m is not None
    begin, end = chains.first[:-1], chains.first[1:] - 1
    tail_m, head_m = roads.height_m[chains.point[begin]], roads.height_m[chains.point[end]]
    length_m = np.maximum(chains.distance_m[end], 1e-9)
    height_m = np.empty(chains.point_count)
    height_m[chains.point] = tail_m[chains.way] + ((head_m - tail_m) / length_m)[chains.way] * chains.distance_m
    height_m[chains.point[begin]] = tail_m
    height_m[chains.point[end]] = head_m
    return height_m


def _method(smoothing_m: float) -> str:
    return (
        f"bilinear, voids filled, smoothed over {smoothing_m:g} m along the road, bridges and tunnels interpolated, "
        "grades limited by road class"
    )
