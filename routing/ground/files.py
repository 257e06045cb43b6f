"""The ground on disk: ground.gpkg beside a graph's own files, a GeoPackage as docs/tiles.md describes it.

Source: OGC GeoPackage Encoding Standard 1.3, sections 1.1 and 2.1.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
import struct
import tempfile
from contextlib import closing
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from routing.errors import GraphFormatError
from routing.ground.kinds import Layer

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from routing.ground.features import Ground, LayerShapes

GROUND_FILE: Final = "ground.gpkg"
APPLICATION_ID: Final = 0x47504B47  # GPKG
VERSION: Final = 10300
WGS84: Final = 4326
_HEADER: Final = struct.Struct("<2sBBi4d")  # magic, version, flags, reference system, west, east, south, north
_FLAGS: Final = 0b0000_0011  # little-endian, with an envelope of x and y
_WHEN: Final = "2000-01-01T00:00:00.000Z"  # the same ground gives the same file
_SYSTEMS: Final = (
    ("Undefined cartesian SRS", -1, "NONE", -1, "undefined"),
    ("Undefined geographic SRS", 0, "NONE", 0, "undefined"),
    (
        "WGS 84 geodetic",
        WGS84,
        "EPSG",
        WGS84,
        'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],'
        'UNIT["degree",0.0174532925199433]]',
    ),
)
_TABLES: Final = """
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER NOT NULL PRIMARY KEY,
    organization TEXT NOT NULL, organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE,
    description TEXT DEFAULT '', last_change DATETIME NOT NULL, min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE,
    srs_id INTEGER);
CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL PRIMARY KEY, column_name TEXT NOT NULL,
    geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL);
"""
_COLUMNS: Final = """(fid INTEGER PRIMARY KEY NOT NULL, geom BLOB NOT NULL, class TEXT NOT NULL, names TEXT,
    rank INTEGER NOT NULL, first_zoom INTEGER NOT NULL, last_zoom INTEGER NOT NULL)"""


def ground_bytes(ground: Ground, attribution: str) -> bytes:
    """The ground as a GeoPackage with one table a layer."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, GROUND_FILE)
        with closing(sqlite3.connect(path, isolation_level=None)) as database:
            database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
            database.execute(f"PRAGMA user_version = {VERSION}")
            database.execute("PRAGMA journal_mode = OFF")
            database.executescript(_TABLES)
            database.execute("BEGIN")
            database.executemany("INSERT INTO gpkg_spatial_ref_sys VALUES (?, ?, ?, ?, ?, NULL)", _SYSTEMS)
            for layer in Layer:
                _write_layer(database, layer, ground.layers[layer], attribution)
            database.execute("COMMIT")
        with open(path, "rb") as file:
            return file.read()


def _write_layer(database: sqlite3.Connection, layer: Layer, shapes: LayerShapes, attribution: str) -> None:
    database.execute(f"CREATE TABLE {layer} {_COLUMNS}")
    bounds = shapely.bounds(shapes.shape) if shapes.kind else np.zeros((0, 4))
    whole = (*bounds[:, :2].min(axis=0).tolist(), *bounds[:, 2:].max(axis=0).tolist()) if shapes.kind else (None,) * 4
    database.execute(
        "INSERT INTO gpkg_contents VALUES (?, 'features', ?, ?, ?, ?, ?, ?, ?, ?)",
        (str(layer), str(layer), attribution, _WHEN, *whole, WGS84),
    )
    kind = "POINT" if layer is Layer.PLACE else "GEOMETRY"
    database.execute("INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, 0, 0)", (str(layer), kind, WGS84))
    forms: list[bytes] = shapely.to_wkb(shapes.shape).tolist() if shapes.kind else []
    rows = zip(
        (
            _HEADER.pack(b"GP", 0, _FLAGS, WGS84, w, e, s, n) + form
            for form, (w, s, e, n) in zip(forms, bounds.tolist(), strict=True)
        ),
        shapes.kind,
        (json.dumps(dict(names), ensure_ascii=False) if names else None for names in shapes.names),
        shapes.rank.tolist(),
        shapes.first_zoom.tolist(),
        shapes.last_zoom.tolist(),
        strict=True,
    )
    database.executemany(
        f"INSERT INTO {layer} (geom, class, names, rank, first_zoom, last_zoom) VALUES (?, ?, ?, ?, ?, ?)", rows
    )


@dataclass(frozen=True, slots=True)
class _Boxes:
    """Of the shapes of one layer: row ids, boxes float32 (n, 4) west, south, east, north [deg], and zoom levels."""

    fid: NDArray[np.int64]
    box: NDArray[np.float32]
    first_zoom: NDArray[np.int8]
    last_zoom: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class Shown:
    """Shapes of a layer that a view shows, with class, names by language and rank of each."""

    shape: NDArray[np.object_]
    kind: list[str]
    names: list[dict[str, str]]
    rank: list[int]


class GroundFile:
    """The ground of a graph, whose boxes are kept in memory; for any number of threads.

    Raises GraphFormatError where the file can't be read.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / GROUND_FILE
        self._lock = Lock()
        try:
            self._database = sqlite3.connect(
                f"{self._path.absolute().as_uri()}?mode=ro&immutable=1", uri=True, check_same_thread=False
            )
            self._boxes = {layer: self._boxes_of(layer) for layer in Layer}
        except (sqlite3.Error, struct.error) as error:
            raise GraphFormatError(
                str(folder), GROUND_FILE, str(error), "allowed: a GeoPackage as import writes it"
            ) from error

    def digest(self) -> bytes:
        """A name for the contents."""
        with self._path.open("rb") as file:
            return hashlib.file_digest(file, hashlib.blake2b).digest()

    def counts(self) -> dict[Layer, int]:
        """How many shapes each layer has, over all zoom levels."""
        return {layer: boxes.fid.size for layer, boxes in self._boxes.items() if boxes.fid.size}

    def _boxes_of(self, layer: Layer) -> _Boxes:
        rows = self._database.execute(
            f"SELECT fid, substr(geom, 1, {_HEADER.size}), first_zoom, last_zoom FROM {layer} ORDER BY fid"
        ).fetchall()
        boxes = np.array([_HEADER.unpack(header)[4:] for _, header, _, _ in rows], np.float64).reshape(-1, 4)
        outward = np.array([-1.0, 1.0, -1.0, 1.0]) * np.spacing(np.float32(180.0))
        fid, first, last = (np.array([row[k] for row in rows], np.int64) for k in (0, 2, 3))
        rounded = (boxes + outward)[:, [0, 2, 1, 3]].astype(np.float32)
        return _Boxes(fid, rounded, first.astype(np.int8), last.astype(np.int8))

    def shown(self, layer: Layer, zoom: int, box: tuple[float, float, float, float]) -> Shown:
        """Shapes of a layer whose box meets one (west, south, east, north) [deg], at a zoom level."""
        boxes = self._boxes[layer]
        west, south, east, north = box
        meets = (boxes.first_zoom <= zoom) & (boxes.last_zoom >= zoom)
        meets &= (boxes.box[:, 2] >= west) & (boxes.box[:, 0] <= east)
        meets &= (boxes.box[:, 3] >= south) & (boxes.box[:, 1] <= north)
        rows: list[tuple[bytes, str, str | None, int]] = []
        for fid in boxes.fid[meets].tolist():
            with self._lock:
                rows += self._database.execute(f"SELECT geom, class, names, rank FROM {layer} WHERE fid = ?", (fid,))
        shapes = np.asarray(shapely.from_wkb([row[0][_HEADER.size :] for row in rows]), np.object_)
        return Shown(
            shapes, [row[1] for row in rows], [json.loads(row[2] or "{}") for row in rows], [row[3] for row in rows]
        )


def open_ground(folder: Path) -> GroundFile | None:
    """The ground of a graph, None where it has none; raises GraphFormatError where it can't be read."""
    return GroundFile(folder) if (folder / GROUND_FILE).is_file() else None
