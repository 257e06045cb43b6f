"""A road graph as the files that RouteE Compass reads."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.units import KMH_PER_MPS
from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph

VERTICES: Final = "vertices-compass.csv.gz"
EDGES: Final = "edges-compass.csv.gz"
SPEEDS: Final = "edges-posted-speed-enumerated.txt.gz"
GRADES: Final = "edges-grade-enumerated.txt.gz"
HEADINGS: Final = "edges-headings-enumerated.csv.gz"
GEOMETRIES: Final = "edges-geometries-enumerated.txt.gz"


def write_compass_files(graph: RoadGraph, folder: Path) -> None:
    """Write nodes, links, speed limits [km/h], grades, headings [deg] and lines, by the names its configuration has.

    Permitted transitions are not among them: Compass may turn where a restriction forbids it, and around at any node.
    """
    folder.mkdir(parents=True)
    places = zip(graph.node_lon_deg.tolist(), graph.node_lat_deg.tolist(), strict=True)
    _write(folder / VERTICES, "vertex_id,x,y", (f"{i},{lon:.7f},{lat:.7f}" for i, (lon, lat) in enumerate(places)))
    links = zip(graph.tail.tolist(), graph.head.tolist(), graph.length_m.tolist(), strict=True)
    header = "edge_id,src_vertex_id,dst_vertex_id,distance"
    _write(folder / EDGES, header, (f"{i},{tail},{head},{length:.3f}" for i, (tail, head, length) in enumerate(links)))
    _write(folder / SPEEDS, None, (f"{speed:.1f}" for speed in (KMH_PER_MPS * graph.speed_limit_mps).tolist()))
    _write(folder / GRADES, None, (f"{grade:.4f}" for grade in (graph.climb_m() / graph.length_m).tolist()))
    headings = headings_deg(graph).tolist()
    _write(folder / HEADINGS, "arrival_heading,departure_heading", (f"{first},{last}" for first, last in headings))
    _write(folder / GEOMETRIES, None, (_line(graph.geometry(i)) for i in range(graph.link_count)))


def headings_deg(graph: RoadGraph) -> NDArray[np.int64]:
    """Compass direction of each link's first and last piece, int64 (M, 2), 0..359 clockwise from north [deg]."""
    first, end = graph.geometry_first[:-1], graph.geometry_first[1:]
    lon, lat = graph.geometry_lon_e7 / E7, graph.geometry_lat_e7 / E7
    columns = []
    for a, b in ((first, first + 1), (end - 2, end - 1)):
        east = (lon[b] - lon[a]) * np.cos(np.radians(lat[a]))
        columns.append(np.rint(np.degrees(np.arctan2(east, lat[b] - lat[a]))).astype(np.int64) % 360)
    return np.column_stack(columns)


def _line(points: NDArray[np.float64]) -> str:
    return f"LINESTRING ({', '.join(f'{lon:.7f} {lat:.7f}' for lon, lat in points.tolist())})"


def _write(path: Path, header: str | None, lines: Iterable[str]) -> None:
    with gzip.open(path, "wt", encoding="utf-8", compresslevel=1) as out:
        if header is not None:
            out.write(f"{header}\n")
        out.writelines(f"{line}\n" for line in lines)
