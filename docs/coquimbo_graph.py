"""Writes data/graphs/coquimbo from the wheel of the Python package aequilibrae, which carries it as an example.

Run `python docs/coquimbo_graph.py aequilibrae-1.7.2-….whl`. An AequilibraE project is a SQLite database of links with
SpatiaLite geometry.
"""

from __future__ import annotations

import shutil
import sqlite3
import struct
import sys
import tempfile
import zipfile
from collections import Counter
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final

import numpy as np

from routing.errors import ImportFailedError
from routing.graph.earth import E7
from routing.graph.files import save_graph
from routing.graph.road_graph import RoadGraph
from routing.importers.region import graph_from_roads
from routing.importers.roads import Roads, Ways
from routing.importers.speeds import HIGHEST_KMH, KMH, LOWEST_KMH
from routing.importers.tags import Dropped, road_class

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

COQUIMBO: Final = Path(__file__).resolve().parents[1] / "data" / "graphs" / "coquimbo"
DATABASE: Final = "project_database.sqlite"
CAR: Final = "c"  # mode of cars in AequilibraE's default set of modes
MOST_BYTES: Final = 2**31  # of an unpacked database
# whose speed rules hold in AequilibraE's example projects
COUNTRY_OF: Final = {"coquimbo": "CL"}
LICENCE: Final = "ODbL-1.0"
ATTRIBUTION: Final = "© OpenStreetMap contributors"

_MBR_END: Final = 38  # start byte, byte order, srid and bounding box come before
_WGS84: Final = 4326
_LINESTRING: Final = 2
_LINESTRING_Z: Final = 1002
_LINESTRING_M: Final = 2002
_LINESTRING_COMPRESSED: Final = 1_000_002


def import_aequilibrae(archive: Path, name: str, *, country: str | None = None) -> RoadGraph:
    """The roads of an AequilibraE project that cars may drive, without terrain: all heights are 0.

    archive: a project folder, a zip of one, or the package's wheel, which carries example projects by name. Its links
    must come from OpenStreetMap. country: code of the speed rules that hold where a link has no limit of its own;
    by default that of a known example project, else general ones. Whether a road is urban is judged by how dense the
    streets are; signals and signs are not in the data, so that only a road's rank at a junction tells who stops.
    Raises ImportFailedError.
    """
    with _database(archive, name) as path:
        origin = " ".join(archive.name.split("-")[:2]) if archive.suffix == ".whl" else archive.name
        roads = _read_roads(path, origin, name, country or COUNTRY_OF.get(name))
    return graph_from_roads(roads, [], name, smoothing_m=0.0, stage=_silent)


def _silent(label: str) -> Callable[[float], None]:
    """A stage that reports to nobody."""
    return lambda done: None


def line_from_spatialite(blob: bytes) -> NDArray[np.float64]:
    """Points of a SpatiaLite line, float64 (k, 2), columns lon and lat [deg].

    Reads plain, Z, M and compressed lines in WGS 84 as SpatiaLite's page "BLOB-Geometry" describes them: 0x00, byte
    order, srid, bounding box, 0x7C, type, count, coordinates, 0xFE. Raises ImportFailedError for anything else.
    """
    if len(blob) < _MBR_END + 10 or blob[0] != 0x00 or blob[_MBR_END] != 0x7C or blob[-1] != 0xFE or blob[1] > 1:
        raise ImportFailedError("geometry", blob[:8].hex(), "not a SpatiaLite geometry")
    order = "<" if blob[1] == 1 else ">"
    (srid,) = struct.unpack_from(order + "i", blob, 2)
    if srid != _WGS84:
        raise ImportFailedError("geometry srid", srid, f"allowed: {_WGS84}")
    kind, count = struct.unpack_from(order + "iI", blob, _MBR_END + 1)
    body = blob[_MBR_END + 9 : -1]
    width = {_LINESTRING: 2, _LINESTRING_Z: 3, _LINESTRING_M: 3}.get(kind)
    expected = 32 + 8 * (count - 2) if kind == _LINESTRING_COMPRESSED else count * 8 * (width or 0)
    if (width is None and kind != _LINESTRING_COMPRESSED) or count < 2 or len(body) != expected:
        raise ImportFailedError("geometry", f"type {kind} with {count} points", "allowed: a line of at least 2 points")
    if width is not None:
        return np.frombuffer(body, order + "f8").reshape(count, width)[:, :2].astype(np.float64)
    points = np.empty((count, 2))
    points[0] = np.frombuffer(body, order + "f8", 2)
    steps = np.frombuffer(body, order + "f4", 2 * (count - 2), 16).reshape(-1, 2)
    points[1:-1] = points[0] + np.cumsum(steps, axis=0, dtype=np.float64)
    points[-1] = np.frombuffer(body, order + "f8", 2, len(body) - 16)
    return points


@contextmanager
def _database(archive: Path, name: str) -> Iterator[Path]:
    """The project's database as a file, unpacked where it must be."""
    if archive.is_dir():
        path = archive / DATABASE
        if not path.is_file():
            raise ImportFailedError("archive", archive, f"holds no {DATABASE}")
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / DATABASE
        try:
            with zipfile.ZipFile(archive) as outer:
                projects = {Path(n).stem: n for n in outer.namelist() if n.endswith(".zip")}
                if any(Path(n).name == DATABASE for n in outer.namelist()):
                    _unpack(outer, archive, target)
                elif name in projects:
                    with outer.open(projects[name]) as stream, zipfile.ZipFile(stream) as inner:
                        _unpack(inner, archive, target)
                else:
                    known = ", ".join(sorted(projects)) or "none"
                    raise ImportFailedError("name", name, f"no such project in {archive.name}, there are: {known}")
        except (OSError, zipfile.BadZipFile) as error:
            raise ImportFailedError("archive", archive, f"can't be read as a zip ({error})") from error
        yield target


def _unpack(source: zipfile.ZipFile, archive: Path, target: Path) -> None:
    member = next((info for info in source.infolist() if Path(info.filename).name == DATABASE), None)
    if member is None:
        raise ImportFailedError("archive", archive, f"holds no {DATABASE}")
    if member.file_size > MOST_BYTES:
        raise ImportFailedError("archive", archive, f"{DATABASE} has {member.file_size} bytes, allowed: {MOST_BYTES}")
    stream: IO[bytes]
    with source.open(member) as stream, target.open("wb") as out:
        shutil.copyfileobj(stream, out)


def _read_roads(path: Path, origin: str, name: str, country: str | None) -> Roads:
    query = (
        "select link_id, a_node, b_node, direction, modes, link_type, name, speed_ab, speed_ba, geometry "
        "from links order by link_id"
    )
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as connection:
            rows = connection.execute(query).fetchall()
    except sqlite3.Error as error:
        raise ImportFailedError("database", path.name, f"no AequilibraE project ({error})") from error
    dropped: Counter[str] = Counter()
    node_at: dict[int, int] = {}
    ids: list[int] = []
    lons: list[float] = []
    lats: list[float] = []
    name_at: dict[str, int] = {"": 0}
    points: list[list[int]] = []
    table: list[tuple[int, int, bool, bool, float, float, int, bool]] = []
    inner_id = max((max(int(row[1] or 0), int(row[2] or 0)) for row in rows), default=0)

    def node(node_id: int, place: NDArray[np.float64]) -> int:
        if node_id not in node_at:
            node_at[node_id] = add(node_id, place)
        return node_at[node_id]

    def add(point_id: int, place: NDArray[np.float64]) -> int:
        ids.append(point_id)
        lons.append(float(place[0]))
        lats.append(float(place[1]))
        return len(ids) - 1

    for link_id, a_node, b_node, direction, modes, link_type, street, speed_ab, speed_ba, blob in rows:
        kind = "residential" if link_type == "living_street" else link_type
        known = road_class(kind or "")
        if known is None:
            dropped[f"links_{link_type}"] += 1
            continue
        if CAR not in modes:
            dropped[Dropped.ACCESS] += 1
            continue
        line = line_from_spatialite(blob)
        inner = range(inner_id + 1, inner_id + line.shape[0] - 1)
        inner_id = inner.stop - 1
        middle = [add(k, place) for k, place in zip(inner, line[1:-1], strict=True)]
        points.append([node(a_node, line[0]), *middle, node(b_node, line[-1])])
        idx = name_at.setdefault(street or "", len(name_at))
        limits = (_limit_mps(speed_ab, dropped), _limit_mps(speed_ba, dropped))
        road = int(known.functional_class)
        table.append((link_id, road, direction >= 0, direction <= 0, *limits, idx, link_type == "living_street"))
    if not table:
        raise ImportFailedError("links", len(rows), "no car may drive any of them")
    count = len(table)
    column = list(zip(*table, strict=True))
    ways = Ways(
        way_first=np.concatenate(([0], np.cumsum([len(p) for p in points]))).astype(np.int64),
        point=np.array([k for p in points for k in p], np.int32),
        id=np.array(column[0], np.int64),
        functional_class=np.array(column[1], np.int8),
        ramp=np.zeros(count, bool),  # AequilibraE files ramps under the class of their road
        living_street=np.array(column[7], bool),
        roundabout=np.zeros(count, bool),
        structure=np.zeros(count, bool),
        forward=np.array(column[2], bool),
        backward=np.array(column[3], bool),
        forward_mps=np.array(column[4], np.float64),
        backward_mps=np.array(column[5], np.float64),
        urban=np.full(count, -1, np.int8),
        name_idx=np.array(column[6], np.int32),
    )
    rules = f"the general rules of {country}" if country else "general rules"
    return Roads(
        point_id=np.array(ids, np.int64),
        lon_e7=np.rint(np.array(lons) * E7).astype(np.int32),
        lat_e7=np.rint(np.array(lats) * E7).astype(np.int32),
        ways=ways,
        names=tuple(name_at),
        controls={},
        restrictions=(),
        built_up=(),
        country=country,
        source=f"AequilibraE project {name} in {origin}, from OpenStreetMap; limits not in it: {rules}, assumed",
        licence=LICENCE,
        attribution=ATTRIBUTION,
        dropped=dict(dropped),
    )


def _limit_mps(speed_kmh: float | None, dropped: Counter[str]) -> float:
    """Limit [m/s] of a speed column, NaN where there is none or it is implausible."""
    if not speed_kmh:
        return float("nan")
    if not LOWEST_KMH <= speed_kmh <= HIGHEST_KMH:
        dropped[Dropped.SPEED] += 1
        return float("nan")
    return float(speed_kmh) * KMH


if __name__ == "__main__":
    save_graph(import_aequilibrae(Path(sys.argv[1]), COQUIMBO.name), COQUIMBO)
