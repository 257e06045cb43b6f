"""AequilibraE projects: geometry blobs written byte by byte, and a project of four streets."""

from __future__ import annotations

import sqlite3
import struct
import zipfile
from collections.abc import Sequence
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from docs.coquimbo_graph import DATABASE, import_aequilibrae, line_from_spatialite
from energy.stops import Cross, FunctionalClass
from routing.errors import ImportFailedError
from routing.graph.road_graph import Terrain

Point = tuple[float, float]
LINE = [(-71.25, -29.9), (-71.251, -29.901), (-71.252, -29.9)]


def blob(points: Sequence[Point], *, order: str = "<", srid: int = 4326, kind: int = 2) -> bytes:
    """A SpatiaLite geometry: start, byte order, srid, bounding box, mark, type, count, coordinates, end."""
    lon, lat = [p[0] for p in points], [p[1] for p in points]
    head = struct.pack(order + "i4d", srid, min(lon), min(lat), max(lon), max(lat))
    if kind == 1_000_002:  # ends in full, steps between as 32-bit floats
        steps = pairwise(points[:-1])
        body = struct.pack(order + "2d", *points[0])
        body += b"".join(struct.pack(order + "2f", b[0] - a[0], b[1] - a[1]) for a, b in steps)
        body += struct.pack(order + "2d", *points[-1])
    else:
        extra = (0.0,) if kind in (1002, 2002) else ()
        body = b"".join(struct.pack(f"{order}{2 + len(extra)}d", *p, *extra) for p in points)
    mark = bytes([1 if order == "<" else 0])
    return b"\x00" + mark + head + b"\x7c" + struct.pack(order + "iI", kind, len(points)) + body + b"\xfe"


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [2, 1002, 2002])
def test_line_from_spatialite_plain_line_is_exact(order: str, kind: int) -> None:
    np.testing.assert_array_equal(line_from_spatialite(blob(LINE, order=order, kind=kind)), LINE)


def test_line_from_spatialite_compressed_line_is_good_to_a_millimetre() -> None:
    np.testing.assert_allclose(line_from_spatialite(blob(LINE, kind=1_000_002)), LINE, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    "damaged",
    [
        b"",
        b"\x01" + blob(LINE)[1:],
        blob(LINE)[:-1],
        blob(LINE)[:-9] + b"\xfe",
        blob(LINE, srid=32719),
        blob(LINE, kind=3),
        blob(LINE[:1]),
    ],
)
def test_line_from_spatialite_anything_else_is_refused(damaged: bytes) -> None:
    with pytest.raises(ImportFailedError, match="geometry"):
        line_from_spatialite(damaged)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A square of streets with a main road along its south side; a footway, a bus street and a connector besides.

         6
         │
    4 ── 3
    │    │     1-2 primary at 60 km/h, 2-3 and 4-1 residential, 3-4 a oneway drawn from 4 to 3 but driven 3 to 4,
    1 ── 2 ─ 5 2-5 primary, 3-6 residential.
    """
    place = {1: (0.0, 0.0), 2: (0.004, 0.0), 3: (0.004, 0.004), 4: (0.0, 0.004), 5: (0.008, 0.0), 6: (0.004, 0.008)}
    rows: list[tuple[int, int, int, int, str, str, float | None, float | None]] = [
        (1, 1, 2, 0, "ct", "primary", 60.0, 60.0),
        (2, 2, 3, 0, "cwbt", "residential", None, None),
        (3, 4, 3, -1, "ct", "residential", None, 30.0),
        (4, 4, 1, 0, "ct", "living_street", None, None),
        (5, 2, 5, 0, "ct", "primary", 999.0, None),
        (6, 1, 3, 0, "wb", "residential", None, None),
        (7, 1, 3, 0, "w", "footway", None, None),
        (9, 3, 6, 0, "ct", "residential", None, None),
        (8, 1, 3, 0, "cwbt", "centroid_connector", None, None),
    ]
    folder = tmp_path / "town"
    folder.mkdir()
    with closing(sqlite3.connect(folder / DATABASE)) as connection:
        connection.execute(
            "create table links (link_id integer, a_node integer, b_node integer, direction integer, modes text, "
            "link_type text, name text, speed_ab numeric, speed_ba numeric, geometry blob)"
        )
        for link_id, a, b, direction, modes, kind, ab, ba in rows:
            connection.execute(
                "insert into links values (?,?,?,?,?,?,?,?,?,?)",
                (link_id, a, b, direction, modes, kind, f"Calle {link_id}", ab, ba, blob([place[a], place[b]])),
            )
        connection.commit()
    return folder


def test_import_aequilibrae_project_becomes_a_graph(project: Path) -> None:
    graph = import_aequilibrae(project, "town", country="CL")
    assert graph.meta.terrain is Terrain.ABSENT
    assert graph.meta.licence == "ODbL-1.0"
    assert graph.meta.attribution == "© OpenStreetMap contributors"
    assert "rules of CL, assumed" in graph.meta.source
    assert graph.meta.dropped == {
        "links_centroid_connector": 1,
        "links_footway": 1,
        "ways_without_access": 1,
        "speed_limits_implausible": 1,
        "not_connected": 0,
    }
    assert graph.link_count == 11  # five two-way streets and a oneway
    assert (graph.node_height_m == 0.0).all()
    # 0.004° on the equator: 445.3 m east on the ellipsoid, 442.3 m north
    np.testing.assert_allclose(np.sort(graph.length_m)[[0, -1]], [442.30, 445.28], atol=0.05)


def test_import_aequilibrae_limit_comes_from_the_link_or_the_country(project: Path) -> None:
    graph = import_aequilibrae(project, "town", country="CL")
    kmh = {int(w): round(float(v) * 3.6) for w, v in zip(graph.way_id, graph.speed_limit_mps, strict=True)}
    assert kmh[1] == 60
    assert kmh[3] == 30
    assert kmh[4] == 20  # living street
    assert kmh[5] == 100  # 999 km/h is no limit; a country road in Chile


def test_import_aequilibrae_oneway_runs_against_its_points_where_the_direction_is_minus_one(project: Path) -> None:
    graph = import_aequilibrae(project, "town")
    (link,) = np.flatnonzero(graph.way_id == 3)
    assert graph.reverse_idx[link] == -1
    assert (graph.node_id[graph.tail[link]], graph.node_id[graph.head[link]]) == (3, 4)


def test_import_aequilibrae_street_gives_way_to_the_main_road(project: Path) -> None:
    graph = import_aequilibrae(project, "town")
    into_main = (graph.way_id == 2) & (graph.node_id[graph.head] == 2)
    assert graph.cross[into_main].tolist() == [Cross.MEDIUM]
    assert (graph.cross[graph.functional_class == FunctionalClass.PRIMARY] == Cross.NONE).all()


@pytest.mark.parametrize("nested", [False, True])
def test_import_aequilibrae_zip_and_wheel_give_the_same_as_the_folder(
    project: Path, tmp_path: Path, nested: bool
) -> None:
    archive = tmp_path / "town.zip"
    with zipfile.ZipFile(archive, "w") as out:
        out.write(project / DATABASE, f"town/{DATABASE}")
    if nested:
        wheel = tmp_path / "aequilibrae-1.7.2-py3-none-any.whl"
        with zipfile.ZipFile(wheel, "w") as out:
            out.write(archive, "aequilibrae/reference_files/town.zip")
        archive = wheel
    graph = import_aequilibrae(archive, "town")
    assert graph.link_count == import_aequilibrae(project, "town").link_count
    assert ("aequilibrae 1.7.2" in graph.meta.source) == nested


def test_import_aequilibrae_unknown_project_names_those_there_are(project: Path, tmp_path: Path) -> None:
    wheel = tmp_path / "some.whl"
    with zipfile.ZipFile(wheel, "w") as out:
        out.writestr("reference_files/nauru.zip", b"")
    with pytest.raises(ImportFailedError, match="nauru"):
        import_aequilibrae(wheel, "town")


def test_import_aequilibrae_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "town.zip"
    path.write_bytes(b"no zip")
    with pytest.raises(ImportFailedError, match="archive"):
        import_aequilibrae(path, "town")
    with pytest.raises(ImportFailedError, match=DATABASE):
        import_aequilibrae(tmp_path, "town")
    (tmp_path / DATABASE).write_bytes(b"no database")
    with pytest.raises(ImportFailedError, match="database"):
        import_aequilibrae(tmp_path, "town")
