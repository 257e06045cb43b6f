"""Formats and parts of answers on the command line."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import geopandas
import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from tests.app.exports.expected_gpx import checked_gpx, texts

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("environment")
ROUTE = ("route", "--start", "46.5,8.001", "--goal", "46.515,8.0", "--soc", "0.5")


def printed(*arguments: str) -> bytes:
    result = CliRunner().invoke(cli, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout_bytes


def test_route_is_printed_as_gpx_with_steps_and_as_parquet() -> None:
    root = checked_gpx(printed(*ROUTE, "--format", "gpx", "--steps"))
    assert texts(root, "rte/name") == texts(root, "trk/name") == ["eco"]
    file = printed(*ROUTE, "--format", "parquet")
    assert (file[:4], file[-4:]) == (b"PAR1", b"PAR1")


def test_route_is_printed_with_the_parts_that_are_asked_for() -> None:
    asked = ("--fields", "routes.name,routes.geometry", "--geometry-format", "polyline6", "--overview", "simplified")
    (route,) = json.loads(printed(*ROUTE, *asked, "--json"))["routes"]
    assert set(route) == {"name", "geometry"}
    assert isinstance(route["geometry"], str)


def test_range_takes_a_tolerance_and_formats() -> None:
    area = ("range", "--origin", "46.5,8.003", "--soc", "0.006")
    exact, simple = (len(printed(*area, "--format", "geojson", *more)) for more in (("--tolerance-m", "0"), ()))
    assert simple < exact
    assert printed(*area, "--format", "kml").startswith(b"<?xml")


def test_matrix_is_printed_as_csv(tmp_path: Path) -> None:
    places = tmp_path / "places.csv"
    places.write_text("lat,lon\n46.5,8.001\n46.52,8.019\n", encoding="utf-8")
    assert printed("matrix", str(places), "--soc", "0.5", "--format", "csv").count(b"\n") == 5


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--format", "gpx"), "allowed: geojson, kml, parquet"),
        (("--json", "--format", "kml"), "without --format kml"),
    ],
)
def test_format_that_there_is_not_is_refused(more: tuple[str, ...], said: str) -> None:
    result = CliRunner().invoke(cli, ["range", "--origin", "46.5,8.003", "--soc", "0.1", *more])
    assert result.exit_code != 0
    assert said in " ".join(result.output.split())


def test_rows_of_a_batch_have_the_parts_and_lines_that_they_ask_for(tmp_path: Path) -> None:
    trip = {"start": [8.001, 46.5], "goal": [8.0, 46.515], "soc": 0.5}
    lean = {"fields": ["routes.energy_kwh", "routes.geometry"], "geometry_format": "polyline5", "compact": True}
    requests, out = tmp_path / "requests.jsonl", tmp_path / "results.jsonl"
    requests.write_text("\n".join(map(json.dumps, (trip, trip | lean, trip | {"fields": ["routes.x"]}))), "utf-8")
    printed("batch", str(requests), "--out", str(out))
    whole, few, refused = (json.loads(line) for line in out.read_text("utf-8").splitlines())
    (route,) = whole["response"]["routes"]
    (parts,) = few["response"]["routes"]
    assert set(few["response"]) == {"routes"}
    assert parts["energy_kwh"] == float(f"{route['energy_kwh']:.6g}")
    assert isinstance(parts["geometry"], str)
    assert refused["problem"]["errors"][0]["field"] == "fields[0]"
    table = tmp_path / "results.parquet"
    printed("batch", str(requests), "--out", str(table))
    frame = geopandas.read_parquet(table)
    assert frame.geometry[0].equals(frame.geometry[1])
