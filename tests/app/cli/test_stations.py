"""Stations on the command line: brought into a graph with a map or by themselves, and listed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from routing.stations.files import STATIONS_FILE
from tests.app.conftest import street_grid

if TYPE_CHECKING:
    from pathlib import Path

    from typer.testing import Result

pytestmark = pytest.mark.usefixtures("environment")

HEADER = "id,name,lat,lon,connectors,power_kw,operator,access,opening_hours\n"
ROWS = (
    "a,Inn [old],46.5001,8.005,CCS2,150,EnBW,customers,Mo-Fr 08:00-18:00\n"
    "b,Bare,46.5102,8.005,Type 2,22,Town,public,\n"
    "c,Meadow,46.5050,8.005,Type 2,22,Town,public,\n"  # 550 m from a street
    "d,Beyond,47.9,8.005,Type 2,22,Town,public,\n"
)
MAP = """<osm version="0.6">
<node id="1" lat="42.00" lon="1.50"/><node id="2" lat="42.02" lon="1.50"/>
<node id="3" lat="42.0100" lon="1.5001"><tag k="amenity" v="charging_station"/><tag k="socket:type2" v="2"/></node>
<node id="4" lat="42.0150" lon="1.5001"><tag k="amenity" v="charging_station"/><tag k="bicycle" v="yes"/></node>
<way id="10"><nd ref="1"/><nd ref="2"/><tag k="highway" v="primary"/></way>
</osm>"""


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, arguments)


def listed(*arguments: str) -> dict[str, Any]:
    result = run("stations", "list", *arguments, "--json")
    assert result.exit_code == 0, result.output
    answer: dict[str, Any] = json.loads(result.stdout)
    return answer


def names(answer: dict[str, Any]) -> list[str]:
    return [feature["properties"]["name"] for feature in answer["features"]]


@pytest.fixture
def grid(tmp_path: Path) -> str:
    save_graph(street_grid("own", Terrain.ABSENT), tmp_path / "own")
    return str(tmp_path / "own")


def write(folder: Path, name: str, rows: str) -> str:
    path = folder / name
    path.write_text(HEADER + rows, encoding="utf-8")
    return str(path)


def test_stations_of_a_file_are_placed_listed_and_what_is_left_out_is_told(grid: str, tmp_path: Path) -> None:
    done = run("stations", "import", write(tmp_path, "own.csv", ROWS), "--graph", grid)
    assert done.exit_code == 0, done.output
    assert "2 stations" in done.stderr
    assert "with lat, lon, connectors and power_kw: 4 told, 4 stations, 0 left out" in done.stderr
    assert "left out, outside the map: 1" in done.stderr
    assert "left out, over 250 m from a road: 1" in done.stderr
    assert "too far from a road: file-own:c 'Meadow' at lat 46.505, lon 8.005" in done.stderr
    assert names(listed("--graph", grid)) == ["Inn [old]", "Bare"]
    table = run("stations", "list", "--graph", grid).stdout
    assert "Inn [old]" in table
    assert "1 × ccs2 150 kW" in table
    assert "2 stations" in table


@pytest.mark.parametrize(
    ("options", "found"),
    [
        (("--connectors", "ccs2"), ["Inn [old]"]),
        (("--min-power-kw", "22"), ["Inn [old]", "Bare"]),
        (("--network", "town"), ["Bare"]),
        (("--access", "public"), ["Bare"]),
        (("--bbox", "8.0,46.505,8.02,46.52"), ["Bare"]),
        (("--open-at", "2026-11-29T12:00:00"), ["Bare"]),
        (("--limit", "1"), ["Inn [old]"]),
    ],
)
def test_stations_are_listed_by_what_is_asked(
    grid: str, tmp_path: Path, options: tuple[str, ...], found: list[str]
) -> None:
    assert run("stations", "import", write(tmp_path, "own.csv", ROWS), "--graph", grid).exit_code == 0
    assert names(listed("--graph", grid, *options)) == found


def test_stations_of_another_source_stay_unless_they_are_to_be_replaced(grid: str, tmp_path: Path) -> None:
    first = write(tmp_path, "first.csv", "a,First,46.5001,8.005,CCS2,150,EnBW,,\n")
    second = write(tmp_path, "second.csv", "a,Second,46.5102,8.005,CCS2,150,EnBW,,\n")
    for path in (first, second):
        assert run("stations", "import", path, "--graph", grid).exit_code == 0
    assert names(listed("--graph", grid)) == ["First", "Second"]
    write(tmp_path, "first.csv", "b,Newer,46.5201,8.005,CCS2,150,EnBW,,\n")
    assert run("stations", "import", first, "--graph", grid, "--merge").exit_code == 0
    assert names(listed("--graph", grid)) == ["Newer", "Second"]
    assert run("stations", "import", first, "--graph", grid, "--replace").exit_code == 0
    assert names(listed("--graph", grid)) == ["Newer"]


def test_what_is_told_twice_under_one_id_is_counted(grid: str, tmp_path: Path) -> None:
    first = write(tmp_path, "own.csv", ROWS)
    (tmp_path / "other").mkdir()
    second = write(tmp_path / "other", "own.csv", "a,Inn,46.5001,8.005,CCS2,150,EnBW,,\n")
    done = run("stations", "import", first, second, "--graph", grid)
    assert "read from file-own: 5" in done.stderr
    assert "told again under the same id, the later one holds: 1" in done.stderr


def test_a_map_brings_its_stations_with_its_roads(tmp_path: Path) -> None:
    (tmp_path / "town.osm").write_text(MAP, encoding="utf-8")
    folder = str(tmp_path / "town")
    done = run("import", str(tmp_path / "town.osm"), "--out", folder)
    assert done.exit_code == 0, done.output
    assert "charging stations: 1" in done.stderr
    assert "left out, not for cars: 1" in done.stderr
    assert "OpenStreetMap: 2 told, 1 stations, 1 left out" in done.stderr
    assert "source: © OpenStreetMap contributors, ODbL-1.0 (osm)" in done.stderr
    (found,) = listed("--graph", folder)["features"]
    assert found["id"] == "osm:n3"


def test_stations_of_a_map_file_are_brought_into_a_graph_that_is_there(tmp_path: Path) -> None:
    (tmp_path / "town.osm").write_text(MAP, encoding="utf-8")
    folder = str(tmp_path / "town")
    assert run("import", str(tmp_path / "town.osm"), "--out", folder).exit_code == 0
    (tmp_path / "town" / STATIONS_FILE).unlink()
    assert listed("--graph", folder)["features"] == []
    assert run("stations", "import", str(tmp_path / "town.osm"), "--graph", folder).exit_code == 0
    assert [found["id"] for found in listed("--graph", folder)["features"]] == ["osm:n3"]


def test_stations_of_which_none_is_near_a_road_are_refused_and_those_of_before_stay(grid: str, tmp_path: Path) -> None:
    assert run("stations", "import", write(tmp_path, "own.csv", ROWS), "--graph", grid).exit_code == 0
    swapped = write(tmp_path, "own.csv", "a,Inn,8.005,46.5001,CCS2,150,EnBW,,\n")
    done = run("stations", "import", swapped, "--graph", grid, "--replace")
    assert done.exit_code == 2
    assert "every station is left out (outside the map: 1)" in done.stderr
    assert "are they swapped?" in done.stderr
    assert names(listed("--graph", grid)) == ["Inn [old]", "Bare"]


def test_synth_places_stations(tmp_path: Path) -> None:
    folder = str(tmp_path / "small")
    done = run("synth", "--links", "600", "--out", folder)
    assert done.exit_code == 0, done.output
    assert "charging stations:" in done.stderr
    answer = listed("--graph", folder)
    assert answer["matched"] > 0
    assert [source["licence"] for source in answer["sources"]] == ["CC0-1.0"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("import", "{gone}", "--graph", "{grid}"), "gone.csv"),
        (("import", "{bad}", "--graph", "{grid}"), "bad.csv"),
        (("import", "{good}", "--graph", "atlantis"), "atlantis"),
        (("list", "--graph", "atlantis"), "atlantis"),
        (("list", "--graph", "{grid}", "--connectors", "type9"), 'connectors is "type9"'),
        (("list", "--graph", "{grid}", "--bbox", "1,2"), 'bbox is "1,2"'),
    ],
)
def test_errors_are_one_line_and_nothing_is_written(
    grid: str, tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    (tmp_path / "bad.csv").write_text("nothing of use\n1\n", encoding="utf-8")
    paths = {
        "gone": str(tmp_path / "gone.csv"),
        "bad": str(tmp_path / "bad.csv"),
        "good": write(tmp_path, "good.csv", ROWS),
        "grid": grid,
    }
    done = run("stations", *(argument.format(**paths) for argument in arguments))
    assert done.exit_code == 2, done.output
    assert said in done.stderr
    assert not (tmp_path / "own" / STATIONS_FILE).exists()


def test_damaged_stations_are_named_and_can_be_replaced(grid: str, tmp_path: Path) -> None:
    (tmp_path / "own" / STATIONS_FILE).write_bytes(b"[")
    path = write(tmp_path, "own.csv", ROWS)
    for command in (("list", "--graph", grid), ("import", path, "--graph", grid)):
        done = run("stations", *command)
        assert done.exit_code == 2
        assert STATIONS_FILE in done.stderr
    checked = run("graphs", "check", grid)
    assert checked.exit_code == 1
    assert STATIONS_FILE in checked.stderr
    assert run("stations", "import", path, "--graph", grid, "--replace").exit_code == 0
    assert len(listed("--graph", grid)["features"]) == 2
    checked = run("graphs", "check", grid)
    assert checked.exit_code == 0
    assert "2 charging stations" in checked.stdout
