"""A synthetic region: an invented road network on an invented landscape, the same for the same seed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from energy.stops import FunctionalClass
from routing.graph.earth import E7, EARTH_RADIUS_M, great_circle_m
from routing.graph.road_graph import GraphMeta, LooseLinks, LooseNodes, RoadGraph, Terrain, assemble_graph
from routing.synth.corridors import find_corridors
from routing.synth.grades import GRADE_LIMIT, graded_heights_m
from routing.synth.junctions import stop_levels
from routing.synth.links import Nodes, RoadPieces, joined_nodes, joined_pieces
from routing.synth.motorways import build_motorways
from routing.synth.names import way_names
from routing.synth.polylines import Polylines, offsets, ragged_indices
from routing.synth.roads import SMOOTHING_M, chains_from_corridors, clipped_at_towns, roads_from_chains
from routing.synth.settlements import Rank, place_settlements
from routing.synth.signs import road_signs
from routing.synth.streets import lay_streets, main_streets
from routing.synth.terrain import build_landscape

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from routing.synth.settlements import Settlements
    from routing.synth.streets import Streets

LINKS_PER_KM2: Final = 2.6  # thinly peopled highlands (assumed); sets the area where it is not given
STREET_SHARE: Final = 0.46  # of all links
ASPECT: Final = 1.45  # width over height where they are not given
ONEWAY_SHARE: Final = 0.07  # of residential streets in cities
# In the North Atlantic, 620 km from the nearest land (Corvo, Azores), so that nobody takes the region for a real one.
CENTRE_LAT_DEG: Final = 44.0
CENTRE_LON_DEG: Final = -36.0
SMALLEST_LINKS: Final = 500
ELEVATION_METHOD: Final = (
    "synthetic: stream-power erosion of uplifted ranges, sampled every 40 m, smoothed along the road with a Gaussian "
    "of 180 m, then cut and filled until every link keeps the steepest grade of its class; streets follow the ground"
)


def synthesize(
    name: str,
    *,
    seed: int,
    width_km: float | None = 160.0,
    height_km: float | None = 110.0,
    links_target: int = 45_000,
    centre_lat_deg: float = CENTRE_LAT_DEG,
    centre_lon_deg: float = CENTRE_LON_DEG,
    progress: Callable[[str, float], None] | None = None,
) -> RoadGraph:
    """A synthetic road graph of about links_target directed links; terrain, towns and roads depend on the seed alone.

    width_km, height_km: extent; None for both: as large as links_target needs at the density of thinly peopled
    highlands. progress is told the stage and the share done, 0..1. Raises ValueError for arguments out of range.
    """
    if links_target < SMALLEST_LINKS:
        raise ValueError(f"links_target is {links_target}, allowed: at least {SMALLEST_LINKS}")
    if (width_km is None) != (height_km is None):
        raise ValueError("width_km and height_km must be given together or both left out")
    size = "" if width_km is None or height_km is None else f" --width-km {width_km:g} --height-km {height_km:g}"
    if width_km is None or height_km is None:
        height_km = float(np.sqrt(links_target / LINKS_PER_KM2 / ASPECT))
        width_km = height_km * ASPECT
    for field, value in (("width_km", width_km), ("height_km", height_km)):
        if not 8.0 <= value <= 4_000.0:
            raise ValueError(f"{field} is {value:g}, allowed: 8..4000")
    if not abs(centre_lat_deg) + height_km / 222.0 <= 75.0:
        raise ValueError(f"centre_lat_deg is {centre_lat_deg:g}, allowed: the whole region between -75 and 75")

    def report(stage: str, share: float) -> None:
        if progress is not None:
            progress(stage, share)

    rng = np.random.default_rng(seed)
    report("terrain", 0.0)
    land = build_landscape(width_km * 1e3, height_km * 1e3, rng)
    report("settlements", 0.15)
    places = place_settlements(land, round(STREET_SHARE * links_target / 2), rng)
    report("corridors", 0.2)
    motorway_grid, road_grid = find_corridors(land, places, rng)
    report("streets", 0.5)
    streets = lay_streets(land, places, rng)
    report("roads", 0.55)
    fixed = np.column_stack((places.x_m, places.y_m))
    col, row = (places.x_m / road_grid.cell_m).astype(np.int64), (places.y_m / road_grid.cell_m).astype(np.int64)
    chains = clipped_at_towns(chains_from_corridors(road_grid, row * road_grid.cols + col, fixed), streets)
    street_nodes = Nodes(streets.x_m, streets.y_m, land.sample_m(streets.x_m, streets.y_m))
    grid_nodes = Nodes(chains.node_x_m, chains.node_y_m, land.sample_m(chains.node_x_m, chains.node_y_m))
    base = streets.x_m.size + chains.node_x_m.size
    wanted = round(links_target / 2) - streets.tail.size
    cut_nodes, roads = roads_from_chains(land, places, streets, chains, base, wanted, rng)
    at_town = np.concatenate((chains.tail, chains.head))
    gates = at_town < streets.x_m.size
    street_class = main_streets(streets, at_town[gates], np.tile(chains.functional_class, 2)[gates])
    street_pieces = _street_pieces(places, streets, street_class, rng)
    nodes = joined_nodes((street_nodes, grid_nodes, cut_nodes))
    report("motorways", 0.7)
    motorway_chains = chains_from_corridors(motorway_grid, np.empty(0, np.int64), np.empty((0, 2)))
    motorway_nodes, motorways, joints = build_motorways(land, motorway_chains, nodes, roads)
    nodes = joined_nodes((nodes, motorway_nodes))
    parts = (street_pieces, roads, motorways)
    names, name_idx = way_names(places, streets, parts, land)
    report("heights", 0.75)
    graph = _assemble(
        _meta(name, seed, size, links_target, centre_lat_deg, centre_lon_deg),
        names,
        name_idx,
        nodes,
        parts,
        joints,
        (centre_lat_deg, centre_lon_deg, width_km * 500.0, height_km * 500.0),
        report,
    )
    report("done", 1.0)
    return graph


def _meta(name: str, seed: int, size: str, links_target: int, lat_deg: float, lon_deg: float) -> GraphMeta:
    place = ""
    command = f"joulepath synth --seed {seed} --name {name}{size} --links {links_target}"
    if (lat_deg, lon_deg) != (CENTRE_LAT_DEG, CENTRE_LON_DEG):
        place = f", centred at {lat_deg:g}, {lon_deg:g}"
    command += f" --out data/graphs/{name}"
    return GraphMeta(
        name=name,
        source=f"joulepath synth, seed {seed}: generated, no real place; made by `{command}`{place}",
        licence="CC0-1.0",
        attribution="Synthetic region, generated by joulepath: no real place",
        terrain=Terrain.SYNTHETIC,
        elevation_method=ELEVATION_METHOD,
        smoothing_m=SMOOTHING_M,
        bbox=(0.0, 0.0, 0.0, 0.0),  # assemble_graph sets it
    )


def _street_pieces(
    places: Settlements, streets: Streets, street_class: NDArray[np.int8], rng: np.random.Generator
) -> RoadPieces:
    """Street links as pieces with a slight bend in the middle."""
    rank = places.rank[streets.place[streets.tail]]
    urban = rank <= Rank.VILLAGE
    limit = np.where(street_class >= FunctionalClass.RESIDENTIAL, 30, np.where(urban, 50, 70))
    x = np.empty((streets.tail.size, 3))
    y = np.empty((streets.tail.size, 3))
    x[:, 0], y[:, 0] = streets.x_m[streets.tail], streets.y_m[streets.tail]
    x[:, 2], y[:, 2] = streets.x_m[streets.head], streets.y_m[streets.head]
    bend = np.clip(0.03 * rng.standard_normal(streets.tail.size), -0.08, 0.08)
    x[:, 1] = 0.5 * (x[:, 0] + x[:, 2]) - bend * (y[:, 2] - y[:, 0])
    y[:, 1] = 0.5 * (y[:, 0] + y[:, 2]) + bend * (x[:, 2] - x[:, 0])
    oneway = (
        (rng.random(streets.tail.size) < ONEWAY_SHARE)
        & (rank == Rank.CITY)
        & (street_class == FunctionalClass.RESIDENTIAL)
    )
    degree = np.bincount(np.concatenate((streets.tail, streets.head)), minlength=streets.x_m.size)
    oneway &= (degree[streets.tail] >= 3) & (degree[streets.head] >= 3)
    return RoadPieces(
        tail=streets.tail,
        head=streets.head,
        functional_class=street_class,
        limit_kmh=limit,
        urban=urban,
        oneway=oneway,
        way=streets.line,
        shape=Polylines(np.arange(streets.tail.size + 1) * 3, x.ravel(), y.ravel()),
    )


def _assemble(
    meta: GraphMeta,
    names: tuple[str, ...],
    name_idx: NDArray[np.int32],
    nodes: Nodes,
    parts: Sequence[RoadPieces],
    joints: NDArray[np.int64],
    frame: tuple[float, float, float, float],
    report: Callable[[str, float], None],
) -> RoadGraph:
    """Pieces as directed links on the globe, with heights and stop levels."""
    pieces = joined_pieces(parts)
    lat, lon = _lat_lon_e7(nodes.x_m, nodes.y_m, frame)
    shape = pieces.shape
    point_lat, point_lon = _lat_lon_e7(shape.x_m, shape.y_m, frame)
    for end, node in ((shape.first[:-1], pieces.tail), (shape.first[1:] - 1, pieces.head)):
        point_lat[end], point_lon[end] = lat[node], lon[node]
    step = np.zeros(point_lat.size)
    step[1:] = great_circle_m(point_lat[:-1] / E7, point_lon[:-1] / E7, point_lat[1:] / E7, point_lon[1:] / E7)
    step[shape.first[:-1]] = 0.0
    length = np.add.reduceat(step, shape.first[:-1])
    limit = GRADE_LIMIT[pieces.functional_class]
    height = graded_heights_m(nodes.ground_m, pieces.tail, pieces.head, length, limit)
    offset = height - nodes.ground_m
    mean_offset = 0.5 * (offset[pieces.tail] + offset[pieces.head])
    structure = (mean_offset > 10.0) | (mean_offset < -14.0)
    report("links", 0.85)
    good = (pieces.tail != pieces.head) & (length > 0.5)
    ahead, back = np.flatnonzero(good), np.flatnonzero(good & ~pieces.oneway)
    piece = np.concatenate((ahead, back))
    reversed_ = np.arange(piece.size) >= ahead.size
    tail = np.where(reversed_, pieces.head[piece], pieces.tail[piece])
    head = np.where(reversed_, pieces.tail[piece], pieces.head[piece])
    forward_points = ragged_indices(shape.first[ahead], shape.first[ahead + 1])
    begin, end = shape.first[back], shape.first[back + 1]
    backward_points = np.repeat(begin + end - 1, end - begin) - ragged_indices(begin, end)
    point = np.concatenate((forward_points, backward_points))
    ends = np.concatenate((pieces.tail[good], pieces.head[good]))
    levels = stop_levels(
        nodes.x_m.size,
        head,
        pieces.functional_class[piece],
        pieces.urban[piece],
        ends,
        np.tile(pieces.functional_class[good], 2),
    )
    links = LooseLinks(
        tail=tail.astype(np.int32),
        head=head.astype(np.int32),
        length_m=length[piece],
        speed_limit_mps=pieces.limit_kmh[piece] / 3.6,
        functional_class=pieces.functional_class[piece],
        cross=levels,
        urban=pieces.urban[piece],
        structure=structure[piece],
        way_id=name_idx[piece].astype(np.int64) + 1,
        name_idx=name_idx[piece],
        geometry_first=offsets(np.diff(shape.first)[piece]),
        geometry_lon_e7=point_lon[point],
        geometry_lat_e7=point_lat[point],
        forbidden_turns=_turning_back(joints, tail, head, pieces.way[piece], pieces.functional_class[piece]),
        signs=road_signs(parts, piece),
    )
    loose = LooseNodes(lat / E7, lon / E7, height, np.arange(1, nodes.x_m.size + 1))
    return assemble_graph(meta, names, loose, links)


def _lat_lon_e7(
    x_m: NDArray[np.float64], y_m: NDArray[np.float64], frame: tuple[float, float, float, float]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Latitude and longitude [1e-7 deg] of points of the plane (sinusoidal projection, true to distance east-west)."""
    lat0, lon0, half_x_m, half_y_m = frame
    lat = lat0 + np.degrees((y_m - half_y_m) / EARTH_RADIUS_M)
    lon = lon0 + np.degrees((x_m - half_x_m) / EARTH_RADIUS_M) / np.cos(np.radians(lat))
    return np.rint(lat * E7).astype(np.int32), np.rint(lon * E7).astype(np.int32)


def _turning_back(
    joints: NDArray[np.int64],
    tail: NDArray[np.int64],
    head: NDArray[np.int64],
    way: NDArray[np.int64],
    road_class: NDArray[np.int8],
) -> NDArray[np.int64]:
    """Forbidden turns from one carriageway to the other of the same motorway where carriageways meet, int64 (k, 2)."""
    motorway = road_class == FunctionalClass.MOTORWAY
    arriving = np.flatnonzero(motorway & np.isin(head, joints))
    leaving = np.flatnonzero(motorway & np.isin(tail, joints))
    pairs = [
        (i, j)
        for i in arriving.tolist()
        for j in leaving[tail[leaving] == head[i]].tolist()
        if way[i] != way[j] and way[i] // 2 == way[j] // 2
    ]
    return np.array(pairs, np.int64).reshape(-1, 2)
