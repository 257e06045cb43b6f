"""Places on the command line: indexed with a map or by themselves, shown and searched."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from routing.gazetteer.files import PLACES_FILE
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import street_grid

if TYPE_CHECKING:
    from pathlib import Path

    from typer.testing import Result

pytestmark = pytest.mark.usefixtures("environment")

MAP = """<osm version="0.6">
<node id="1" lat="42.00" lon="1.50"/><node id="2" lat="42.02" lon="1.50"/>
<node id="3" lat="42.0100" lon="1.5001"><tag k="place" v="village"/><tag k="name" v="Sant Pere"/></node>
<node id="4" lat="42.0150" lon="1.5001"><tag k="addr:housenumber" v="7"/></node>
<node id="5" lat="42.0050" lon="1.5001"><tag k="addr:housenumber" v="3"/><tag k="addr:street" v="Carrer Major"/></node>
<way id="10"><nd ref="1"/><nd ref="2"/><tag k="highway" v="primary"/><tag k="name" v="Carrer Major"/></way>
</osm>"""


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, arguments)


def said(result: Result) -> str:
    return " ".join(result.output.split())


def test_an_import_indexes_the_places_of_its_map_and_says_what_it_left_out(tmp_path: Path) -> None:
    (tmp_path / "village.osm").write_text(MAP, encoding="utf-8")
    folder = tmp_path / "out" / "village"
    imported = run("import", str(tmp_path / "village.osm"), "--out", str(folder))
    assert imported.exit_code == 0, imported.output
    assert "places to search: city 1, house 1, street 1" in said(imported)
    assert "left out, house numbers without a street: 1" in said(imported)
    found = json.loads(run("search", "c. major 3, sant pere", "--graph", str(folder), "--json").stdout)
    assert [found["features"][0]["properties"][key] for key in ("street", "housenumber")] == ["Carrer Major", "3"]
    table = run("search", "major", "5", "--graph", str(folder))
    assert "nearest is 3" in said(table)
    shown = run("places", "show", "--graph", str(folder))
    assert "city 1, house 1, street 1" in said(shown)


def test_a_graph_that_exists_gets_an_index_with_and_without_its_map(tmp_path: Path) -> None:
    folder = tmp_path / "graphs" / "own"
    save_graph(street_grid("own", Terrain.ABSENT), folder)
    refused = run("search", "street", "--graph", str(folder))
    assert refused.exit_code == 2
    assert "joulepath places build" in said(refused)
    assert run("places", "build", "--graph", str(folder)).exit_code == 0
    assert "Street 3" in said(run("search", "street 3", "--graph", str(folder)))
    (tmp_path / "far.osm").write_text(MAP, encoding="utf-8")
    far = run("places", "build", str(tmp_path / "far.osm"), "--graph", str(folder))
    assert far.exit_code == 2
    assert "0 of its 1 streets lie on graph 'own'" in said(far)
    (tmp_path / "near.osm").write_text(MAP.replace('"42.0', '"46.5').replace('"1.50', '"8.00'), encoding="utf-8")
    assert run("places", "build", str(tmp_path / "near.osm"), "--graph", str(folder)).exit_code == 0
    assert "Sant Pere" in said(run("search", "sant pere", "--graph", str(folder)))
    assert (folder / PLACES_FILE).is_file()


def test_a_route_between_names_says_what_they_were_taken_for(tmp_path: Path) -> None:
    folder = tmp_path / "graphs" / "own"
    save_graph(street_grid("own", Terrain.ABSENT), folder)
    run("places", "build", "--graph", str(folder))
    found = run("route", "--start", "street 0", "--goal", "46.52,8.02", "--soc", "0.5", "--graph", str(folder))
    assert found.exit_code == 0, found.output
    assert "start: Street 0 (46.50000, 8.00" in said(found)
    wrong = run("route", "--start", "nowhere at all", "--goal", "46.52,8.02", "--soc", "0.5", "--graph", str(folder))
    assert wrong.exit_code == 2
    assert "start is nowhere at all" in said(wrong)
    area = run("range", "--origin", "street 11", "--soc", "0.1", "--graph", str(folder))
    assert "origin: Street 11" in said(area)
