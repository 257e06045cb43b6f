"""Areas and matrices as files."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

import geopandas
import pyogrio
import pytest
from pyarrow import parquet
from shapely.geometry import shape

from app.exports.answers import matrix_in
from app.schemas.lean.formats import AnswerFormat
from app.schemas.matrix import MatrixRequest
from app.schemas.range import RangeRequest

if TYPE_CHECKING:
    from pathlib import Path

    from app.service.service import Service

AREA = {"origin": [8.003, 46.5], "soc": 0.006, "bands": 2}


def test_bands_as_geoparquet_and_kml_are_those_of_geojson(service: Service, tmp_path: Path) -> None:
    sent = RangeRequest.model_validate(AREA)
    answer = service.range(sent).model_dump()["features"]
    frame = geopandas.read_parquet(io.BytesIO(service.range_in(AnswerFormat.PARQUET, sent)))
    path = tmp_path / "range.kml"
    path.write_bytes(service.range_in(AnswerFormat.KML, sent))
    drawn = pyogrio.read_dataframe(path)
    for k, band in enumerate(answer[:-1]):
        area = shape(band["geometry"])
        assert frame.geometry[k].equals(area)
        assert frame["soc_left"][k] == band["properties"]["soc_left"]
        assert drawn.geometry[k].symmetric_difference(area).area < 1e-9 * area.area
        assert float(drawn["area_km2"][k]) == pytest.approx(band["properties"]["area_km2"], rel=1e-5)
    assert len(drawn) == 3


def test_matrix_as_csv_and_parquet_has_a_line_for_each_pair(service: Service) -> None:
    places = [[8.001, 46.5], [8.019, 46.52]]
    answer = service.matrix(MatrixRequest.model_validate({"sources": places, "soc": 0.4}))
    rows = list(csv.DictReader(io.StringIO(matrix_in(AnswerFormat.CSV, answer).decode())))
    assert [(row["source"], row["target"]) for row in rows] == [("0", "0"), ("0", "1"), ("1", "0"), ("1", "1")]
    assert float(rows[1]["energy_kwh"]) == answer.energy_kwh[0][1]
    assert rows[1]["reason"] == ""
    table = parquet.read_table(io.BytesIO(matrix_in(AnswerFormat.PARQUET, answer)))
    assert table.column("distance_m").to_pylist() == [figure for row in answer.distance_m for figure in row]
