"""Answers as the bytes of a CSV, GeoParquet or Parquet file."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any, Final

import shapely

from app.conversions.lean.lines import drawn
from app.conversions.place import DECIMALS
from app.exports.tables import (
    BAND_FIGURES,
    PAIR_COLUMNS,
    ROUTE_COLUMNS,
    all_link_rows,
    band_rows,
    compact_rows,
    link_columns,
    pair_rows,
    route_rows,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from app.exports.content import RangeContent, RouteContent
    from app.schemas.matrix import MatrixResponse

GEOMETRY: Final = "geometry"


def links_csv(content: RouteContent) -> bytes:
    """A line for each link of each route."""
    rows = all_link_rows(content)
    return csv_file(compact_rows(rows) if content.understood.compact else rows, link_columns(content))


def pairs_csv(answer: MatrixResponse) -> bytes:
    """A line for each pair of places."""
    rows = _numbered_pairs(answer)
    return csv_file(compact_rows(rows) if answer.request.compact else rows, PAIR_COLUMNS)


def csv_file(rows: Iterable[Mapping[str, Any]], columns: Iterable[str]) -> bytes:
    """Rows as CSV (RFC 4180); no value is an empty cell, truth is `true` or `false`."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    names = list(columns)
    writer.writerow(names)
    for row in rows:
        cells = (row[name] for name in names)
        writer.writerow([str(cell).lower() if isinstance(cell, bool) else cell for cell in cells])
    return text.getvalue().encode("utf-8")


def route_geoparquet(content: RouteContent) -> bytes:
    """A row for each link with its line, or, with `links` false, one for each route."""
    if not content.understood.links:
        routes = [drawn(route, content.understood.overview)[0] for route in content.answer.routes]
        lines = [shapely.LineString(route.geometry.round(DECIMALS)) for route in routes]
        return geoparquet(route_rows(content), ROUTE_COLUMNS, lines, "LineString")
    lines = []
    for route in content.answer.routes:
        begin = 0
        for end in route.links.geometry_end_idx:
            line = route.geometry[begin : end + 1].round(DECIMALS)
            lines.append(shapely.LineString(line if len(line) > 1 else line.repeat(2, axis=0)))
            begin = end
    return geoparquet(all_link_rows(content), link_columns(content), lines, "LineString")


def range_geoparquet(content: RangeContent) -> bytes:
    """A row for each band with its area, the outermost first."""
    areas = [band.area for band in content.answer.bands]
    return geoparquet(band_rows(content), BAND_FIGURES, areas, "MultiPolygon")


def pairs_parquet(answer: MatrixResponse) -> bytes:
    """A row for each pair of places."""
    return parquet_file(_numbered_pairs(answer), PAIR_COLUMNS)


def geoparquet(
    rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], shapes: Sequence[shapely.Geometry], kind: str
) -> bytes:
    """Rows and their shapes, in WGS 84, as GeoParquet 1.1."""
    placed = [{**row, GEOMETRY: shapely.to_wkb(shape)} for row, shape in zip(rows, shapes, strict=True)]
    column: dict[str, Any] = {"encoding": "WKB", "geometry_types": [kind]}
    if shapes:
        column["bbox"] = shapely.total_bounds(list(shapes)).tolist()
    about = {"version": "1.1.0", "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    return parquet_file(placed, {**columns, GEOMETRY: "binary"}, {"geo": json.dumps(about)})


def parquet_file(
    rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str], metadata: Mapping[str, str] | None = None
) -> bytes:
    """Rows as Parquet; columns: Arrow types by their names."""
    import pyarrow as pa  # which takes long to import
    from pyarrow import parquet

    fields = [pa.field(name, pa.type_for_alias(kind)) for name, kind in columns.items()]
    schema = pa.schema(fields, metadata=dict(metadata or {}))
    with pa.BufferOutputStream() as out:
        parquet.write_table(pa.Table.from_pylist([dict(row) for row in rows], schema=schema), out)
        written: bytes = out.getvalue().to_pybytes()
    return written


def _numbered_pairs(answer: MatrixResponse) -> list[dict[str, Any]]:
    """A row for each pair, places by their position."""
    return pair_rows(answer, range(len(answer.sources)), range(len(answer.targets)))
