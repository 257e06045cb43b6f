"""The command line: the same answers as HTTP, and errors in one line."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from routing.graph.files import save_graph
from tests.app.expected import VEHICLE
from tests.app.service.test_graph_choice import moved

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.testclient import TestClient
    from typer.testing import Result

    from app.settings import Settings

USABLE_KWH = 64.0  # of the default vehicle
PLACES = ("--start", "46.5,8.003", "--goal", "46.518,8.02")


pytestmark = pytest.mark.usefixtures("environment")


def run(*arguments: str, text: str | None = None) -> Result:
    return CliRunner().invoke(cli, arguments, input=text)


def run_json(*arguments: str, text: str | None = None) -> dict[str, Any]:
    result = run(*arguments, "--json", text=text)
    assert result.exit_code == 0, result.output
    answer: dict[str, Any] = json.loads(result.stdout)
    return timeless(answer)


def timeless(answer: dict[str, Any]) -> dict[str, Any]:
    """The answer without the seconds that the search took."""
    stats = answer.get("stats", [])
    for entry in stats if isinstance(stats, list) else [stats]:
        entry.pop("seconds")
    return answer


def test_route_as_json_equals_http(client: TestClient) -> None:
    body = {
        "start": {"lat": 46.5, "lon": 8.003},
        "goal": {"lat": 46.518, "lon": 8.02},
        "soc": 0.4,
        "vehicle": "vw-id4",
        "graph": "grid",
        "alternatives": ["eco", "fastest"],
        "reserve_soc": 0.1,
        "stops": "counted",
        "link_model": "integrated",
    }
    asked = ("--soc", "0.4", "--vehicle", "vw-id4", "--graph", "grid", "--alternatives", "eco,fastest")
    from_cli = run_json("route", *PLACES, *asked, "--reserve-soc", "0.1", "--stops", "counted")
    assert from_cli == timeless(client.post("/route", json=body).json())


def test_route_over_via_points_as_json_equals_http(client: TestClient) -> None:
    via = [{"lat": 46.505, "lon": 8.0}, {"lat": 46.513, "lon": 8.01}]
    body = {"start": {"lat": 46.5, "lon": 8.003}, "goal": {"lat": 46.518, "lon": 8.02}, "soc": 0.4, "via": via}
    from_cli = run_json("route", *PLACES, "--soc", "0.4", "--via", "46.505,8", "--via", "46.513,8.01")
    assert len(from_cli["routes"][0]["legs"]) == 3
    assert from_cli == timeless(client.post("/route", json=body).json())


def test_pareto_set_as_json_equals_http_and_prints_what_is_proven(client: TestClient) -> None:
    asked = ("--soc", "0.4", "--graph", "grid", "--pareto", "0.01,4")
    ends = {"start": {"lat": 46.5, "lon": 8.003}, "goal": {"lat": 46.518, "lon": 8.02}}
    body = ends | {"soc": 0.4, "graph": "grid", "pareto": {"epsilon_frac": 0.01, "most": 4}}
    assert run_json("route", *PLACES, *asked) == timeless(client.post("/route", json=body).json())
    assert "proven: for any way that keeps the reserve" in " ".join(run("route", *PLACES, *asked).stdout.split())


def test_range_as_json_equals_http(client: TestClient) -> None:
    from_cli = run_json("range", "--origin", "46.5,8.003", "--soc", "0.3", "--bands", "2", "--vehicle", "nissan-leaf")
    query = "lat=46.5&lon=8.003&soc=0.3&bands=2&vehicle=nissan-leaf"
    assert from_cli == timeless(client.get(f"/range?{query}").json())


@pytest.mark.parametrize("from_file", [True, False])
def test_simulate_as_json_equals_http(client: TestClient, tmp_path: Path, from_file: bool) -> None:
    body = {"links": [{"id": 0}], "soc": 0.5}
    (tmp_path / "links.json").write_text(json.dumps(body), encoding="utf-8")
    if from_file:
        from_cli = run_json("simulate", str(tmp_path / "links.json"))
    else:
        from_cli = run_json("simulate", "-", text=json.dumps(body))
    assert from_cli == client.post("/simulate", json=body).json()


@pytest.mark.parametrize(
    ("arguments", "path"),
    [
        (("vehicles", "list"), "/vehicles"),
        (("vehicles", "show", "bmw-i3-60ah"), "/vehicles/bmw-i3-60ah"),
        (("graphs", "show", "grid"), "/graphs/grid"),
    ],
)
def test_listing_as_json_equals_http(client: TestClient, arguments: tuple[str, ...], path: str) -> None:
    assert run_json(*arguments) == client.get(path).json()


def test_listing_of_graphs_as_json_is_that_of_http_and_says_where_they_lie(
    client: TestClient, settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing, there = tmp_path / "not-yet", settings.graph_dirs[0]
    monkeypatch.setenv("JOULEPATH_GRAPH_DIRS", os.pathsep.join((str(missing), str(there))))
    listed = run_json("graphs", "list")
    assert listed.pop("folders") == [{"path": str(missing), "exists": False}, {"path": str(there), "exists": True}]
    assert listed.pop("paths") == {name: str(there / name) for name in ("grid", "level")}
    assert listed == client.get("/graphs").json()
    shown = run("graphs", "list")
    assert f"{missing} (does not exist yet)" in shown.stdout
    assert f"{there}\n" in shown.stdout


def test_route_as_a_table_names_energy_charge_and_data() -> None:
    result = run("route", *PLACES, "--soc", "0.5", "--alternatives", "eco,fastest")
    assert result.exit_code == 0, result.output
    for shown in ("eco", "fastest", "kWh", "rolling", "grid: synthetic terrain", "CC0-1.0"):
        assert shown in result.stdout


@pytest.mark.parametrize(
    ("arguments", "shown"),
    [
        (("range", "--origin", "46.5,8.003", "--soc", "0.01", "--bands", "2"), "km²"),
        (("vehicles", "list"), "hyundai-kona-64 (default)"),
        (("vehicles", "show", "hyundai-kona-64"), "EPA test car list"),
        (("graphs", "list"), "grid (default)"),
        (("graphs", "show", "level"), "tertiary"),
        (("--help",), "simulate"),
    ],
)
def test_command_without_json_prints_a_table(arguments: tuple[str, ...], shown: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    assert shown in result.stdout


def test_simulate_as_a_table_prints_links_and_their_sum() -> None:
    body = {"chain": [{"length_m": 300, "speed_limit_kmh": 50}], "soc": 0.5}
    result = run("simulate", "-", text=json.dumps(body))
    assert result.exit_code == 0, result.output
    assert "sum" in result.stdout


CHAIN: dict[str, Any] = {
    "chain": [
        {"length_m": 500, "speed_limit_kmh": 80},
        {"length_m": 20, "speed_limit_kmh": 30, "cross": "large"},
        {"length_m": 300, "speed_limit_kmh": 50},
    ]
}


def test_simulate_by_time_steps_as_json_equals_http(client: TestClient) -> None:
    text = json.dumps(CHAIN)
    asked = ("--model", "timestep", "--stops", "counted", "--profile")
    from_cli = run_json("simulate", "-", *asked, text=text)
    body = CHAIN | {"model": "timestep", "stops": "counted", "profile": True}
    assert from_cli == client.post("/simulate", json=body).json()
    assert from_cli["profile"]["stops"] == "counted"


def test_simulate_options_replace_those_of_the_body(client: TestClient) -> None:
    from_cli = run_json("simulate", "-", "--model", "fast", text=json.dumps(CHAIN | {"model": "timestep"}))
    assert from_cli == client.post("/simulate", json=CHAIN | {"model": "fast"}).json()


def test_simulate_with_a_profile_as_a_table_prints_its_points() -> None:
    result = run("simulate", "-", "--profile", "--model", "timestep", text=json.dumps(CHAIN))
    assert result.exit_code == 0, result.output
    assert "820.0" in result.stdout


def test_simulate_with_a_plot_writes_a_picture(tmp_path: Path) -> None:
    path = tmp_path / "speed.png"
    result = run("simulate", "-", "--plot", str(path), text=json.dumps(CHAIN))
    assert result.exit_code == 0, result.output
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--model", "exact"), "model is"),
        (("--model", "timestep", "--stops", "expected"), "stops is"),
        (("--plot", "/nowhere/speed.png"), "No such file or directory"),
    ],
)
def test_simulate_with_options_that_cannot_be_ends_in_one_line(options: tuple[str, ...], message: str) -> None:
    result = run("simulate", "-", *options, text=json.dumps(CHAIN))
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert result.stderr.strip().count("\n") == 0


def test_graph_given_as_a_folder_is_the_one_that_answers(settings: Settings) -> None:
    folder = settings.graph_dirs[0] / "level"
    answer = run_json("route", *PLACES, "--soc", "0.5", "--graph", str(folder))
    assert answer["terrain"]["graph"] == "level"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("route", *PLACES, "--soc", "1.5"), "soc is 1.5, allowed: at most 1"),
        (("route", "--start", "north", "--goal", "46.5,8", "--soc", "0.5"), "graph 'grid' has no index of places"),
        (("route", "--start", "95,8", "--goal", "46.5,8", "--soc", "0.5"), "start.lat is 95.0, allowed: at most 90"),
        (("route", *PLACES, "--soc", "0.5", "--weights", "1,2"), "weights is '1,2', allowed: E,T,D"),
        (("route", *PLACES, "--soc", "0.5", "--alternatives", "best"), "alternatives[0] is"),
        (("route", *PLACES, "--soc", "0.5", "--pareto", "0.02,5,1"), "pareto is '0.02,5,1', allowed: E or E,N"),
        (("route", *PLACES, "--soc", "0.5", "--link-model", "exact"), "link_model is"),
        (("route", *PLACES, "--soc", "0.5", "--vehicle", "delorean"), "vehicle 'delorean' is unknown"),
        (("route", *PLACES, "--soc", "0.5", "--graph", "atlantis"), "graph 'atlantis' is unknown, known: grid, level"),
        (("route", "--start", "60,8", "--goal", "46.5,8", "--soc", "0.5"), "start (lat 60, lon 8) is outside the map"),
        (
            ("route", *PLACES, "--soc", "0.5", "--via", "46.5,8", "--via", "north"),
            "graph 'grid' has no index of places",
        ),
        (("range", "--origin", "46.5,8", "--soc", "0.5", "--bands", "0"), "bands is 0, allowed: at least 1"),
        (
            ("range", "--origin", "46.5,8", "--soc", "0.5", "--bands", "many"),
            "bands is 'many', allowed: a whole number",
        ),
        (("range", "--origin", "95,8", "--soc", "0.5"), "origin.lat is 95.0, allowed: at most 90"),
        (("graphs", "show", "/nowhere/at/all"), "graph '/nowhere/at/all' is unknown"),
        (("vehicles", "show", "delorean"), "vehicle 'delorean' is unknown"),
        (("simulate", "/nowhere/links.json"), "No such file or directory"),
        (("synth", "--out", "/nowhere/out", "--links", "3"), "links_target is 3, allowed: at least 500"),
        (("import", "/nowhere/map.osm.pbf", "--out", "/nowhere/out"), "/nowhere/map.osm.pbf"),
    ],
)
def test_error_of_a_command_is_one_line_on_stderr_and_exit_code_2(arguments: tuple[str, ...], message: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert result.stderr.strip().count("\n") == 0
    assert result.stdout == ""


def test_places_on_different_graphs_end_in_one_line_that_names_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_graph(moved("grid", 0.0), tmp_path / "grid")
    save_graph(moved("apart", 1.0), tmp_path / "apart")
    monkeypatch.setenv("JOULEPATH_GRAPH_DIRS", str(tmp_path))
    result = run("route", "--start", "46.5,8.003", "--goal", "46.5,9.003", "--soc", "0.5")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "goal (lat 46.5, lon 9.003) is on graph 'apart', but start (lat 46.5, lon 8.003) is on graph 'grid'" in (
        result.stderr
    )


def test_charge_that_hardly_does_not_suffice_never_reads_as_if_nothing_were_missing() -> None:
    needed = 0.5 - run_json("route", *PLACES, "--soc", "0.5")["routes"][0]["soc_min"]
    shown = run("route", *PLACES, "--soc", str(needed - 2e-6)).stdout
    assert f"no, {2e-6 * USABLE_KWH:.4f} kWh missing" in shown
    assert "-0.000002" in shown


def test_simulate_of_text_that_is_not_json_ends_in_one_line() -> None:
    result = run("simulate", "-", text="{")
    assert result.exit_code == 2
    assert result.stderr.startswith("the input is not valid JSON: ")


NOT_JSON = [
    pytest.param(b'{"chain": "\xff"}', "is not UTF-8 at byte 11", id="not UTF-8"),
    pytest.param(b"[" * 100_000, "is nested too deeply", id="deep"),
    pytest.param(b'{"soc": ' + 5000 * b"1" + b"}", "has a whole number of more than 4300 digits", id="long number"),
    pytest.param(b'{"soc": }', "is not valid JSON: Expecting value", id="broken"),
]


@pytest.mark.parametrize(("content", "message"), NOT_JSON)
@pytest.mark.parametrize("command", [("simulate",), ("vehicles", "add")])
def test_file_that_is_not_json_ends_in_one_line(
    tmp_path: Path, command: tuple[str, ...], content: bytes, message: str
) -> None:
    path = tmp_path / "sent.json"
    path.write_bytes(content)
    result = run(*command, str(path))
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert f"{path} {message}" in result.stderr
    assert result.stderr.strip().count("\n") == 0


@pytest.mark.parametrize(("content", "message"), NOT_JSON)
def test_input_that_is_not_json_ends_in_one_line(content: bytes, message: str) -> None:
    result = CliRunner().invoke(cli, ("simulate", "-"), input=content)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert f"the input {message}" in result.stderr


def test_file_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    (tmp_path / "chain.json").write_text(json.dumps(CHAIN), encoding="utf-8-sig")
    assert run_json("simulate", str(tmp_path / "chain.json")) == run_json("simulate", "-", text=json.dumps(CHAIN))


@pytest.mark.parametrize("body", [{"id": "\ud800"}, {"id": "my-car", "\ud800": 1}, {"id": "my-car", "name": "\ud800"}])
def test_lone_surrogate_in_a_vehicle_ends_in_one_line(tmp_path: Path, body: dict[str, object]) -> None:
    (tmp_path / "car.json").write_text(json.dumps(VEHICLE | body), encoding="ascii")
    result = run("vehicles", "add", str(tmp_path / "car.json"))
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert result.stderr.strip().count("\n") == 0


@pytest.mark.parametrize("name", ["speed.svg", "speed", "speed.png.pdf"])
def test_simulate_with_a_plot_of_another_format_is_refused_before_driving(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr("app.service.service.Service.simulate", lambda *_: pytest.fail("driven"))
    result = run("simulate", "-", "--plot", str(tmp_path / name), text=json.dumps(CHAIN))
    assert result.exit_code == 2, result.output
    assert f"plot is '{tmp_path / name}', allowed: a file name that ends in .png" in result.stderr
    assert list(tmp_path.iterdir()) == []


CONDITIONS = ("--condition", "ambient_c=-5", "--condition", "road=wet", "--condition", "climate=false")


def test_range_under_conditions_as_json_equals_http(client: TestClient) -> None:
    from_cli = run_json("range", "--origin", "46.5,8.003", "--soc", "0.01", "--bands", "0.002,0.005", *CONDITIONS)
    query = "lat=46.5&lon=8.003&soc=0.01&bands=0.002,0.005&ambient_c=-5&road=wet&climate=false"
    assert from_cli == timeless(client.get(f"/range?{query}").json())
    assert from_cli["request"]["conditions"]["road"] == "wet"


@pytest.mark.parametrize("name", ["soc", "reserve_soc", "bands", "vehicle", "graph", "lat", "uncertainty"])
@pytest.mark.parametrize("command", ["route", "range"])
def test_condition_of_another_name_is_refused(command: str, name: str) -> None:
    places = PLACES if command == "route" else PLACES[:2]
    result = run(command, *places, "--soc", "0.5", "--condition", f"{name}=0.9")
    assert (result.exit_code, result.stdout) == (2, "")
    assert f"conditions.{name} is 0.9, allowed: no field of this name" in result.stderr


@pytest.mark.parametrize("value", ["[" * 100_000, "1" * 5000], ids=["deep", "long number"])
def test_condition_that_json_cannot_read_is_a_text(value: str) -> None:
    result = run("range", *PLACES[:2], "--soc", "0.5", "--condition", f"payload_kg={value}")
    assert result.exit_code == 2, result.output
    assert "conditions.payload_kg is" in result.stderr
    assert result.stderr.strip().count("\n") == 0


def test_exported_graph_imports_again(tmp_path: Path) -> None:
    exported = tmp_path / "grid.graphml"
    assert run("graphs", "export", "grid", str(exported)).exit_code == 0
    imported = run("import", str(exported), "--out", str(tmp_path / "again"), "--name", "again")
    assert imported.exit_code == 0, imported.output
    folder = str(tmp_path / "again")
    answer = run_json("route", *PLACES, "--soc", "0.5", "--graph", folder)
    assert answer["terrain"]["graph"] == "again"
    assert answer["routes"][0]["feasible"] is True


def test_graph_without_out_goes_to_the_users_folder_and_is_found_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("JOULEPATH_GRAPH_DIRS")
    monkeypatch.delenv("JOULEPATH_DEFAULT_GRAPH")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    size = ("--links", "2000", "--width-km", "30", "--height-km", "20")
    assert run("synth", "--name", "mine", *size).exit_code == 0
    listed = run_json("graphs", "list")
    assert listed["paths"]["mine"] == str(tmp_path / "joulepath" / "graphs" / "mine")
    assert {graph["name"] for graph in listed["graphs"]} == {"coquimbo", "highlands", "mine"}


def test_own_graph_hides_a_bundled_one_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    own = tmp_path / "joulepath" / "graphs" / "highlands"
    assert run("graphs", "export", "grid", str(tmp_path / "grid.graphml")).exit_code == 0
    monkeypatch.delenv("JOULEPATH_GRAPH_DIRS")
    monkeypatch.delenv("JOULEPATH_DEFAULT_GRAPH")
    assert run("import", str(tmp_path / "grid.graphml"), "--name", "highlands").exit_code == 0
    listed = run_json("graphs", "list")
    assert listed["paths"]["highlands"] == str(own)
    assert [graph["link_count"] < 1000 for graph in listed["graphs"] if graph["name"] == "highlands"] == [True]


def test_data_folder_that_cannot_be_written_leaves_what_is_bundled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "blocked"
    blocked.write_text("a file, where no folder can be made", encoding="utf-8")
    for name in ("GRAPH_DIRS", "DEFAULT_GRAPH", "DATABASE_URL"):
        monkeypatch.delenv(f"JOULEPATH_{name}")
    monkeypatch.setenv("XDG_DATA_HOME", str(blocked))
    vehicles = run_json("vehicles", "list")
    assert "nissan-leaf" in [vehicle["id"] for vehicle in vehicles["vehicles"]]
    assert str(blocked) in vehicles["warnings"][0]
    assert run_json("graphs", "list")["folders"][0]["exists"] is False
    refused = run("synth", "--links", "2000")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert refused.stderr.strip() == f"Not a directory: {blocked / 'joulepath' / 'graphs'}"


@pytest.mark.parametrize("name", ["../elsewhere", "a/b", "..", ""])
def test_name_that_is_no_folder_is_refused_without_out(name: str) -> None:
    result = run("synth", "--name", name, "--links", "2000")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "allowed without --out: the name of a folder" in result.stderr


def test_synth_writes_a_graph_that_answers(tmp_path: Path) -> None:
    folder = str(tmp_path / "small")
    made = run("synth", "--out", folder, "--seed", "3", "--links", "2000", "--width-km", "30", "--height-km", "20")
    assert made.exit_code == 0, made.output
    shown = run_json("graphs", "show", folder)
    assert shown["name"] == "small"
    assert shown["terrain"] == "synthetic"


APART = """<osm version="0.6">
<node id="1" lat="42.00" lon="1.50"/><node id="2" lat="42.02" lon="1.50"/>
<node id="3" lat="42.10" lon="1.60"/><node id="4" lat="42.11" lon="1.60"/>
<way id="10"><nd ref="1"/><nd ref="2"/><tag k="highway" v="primary"/></way>
<way id="11"><nd ref="3"/><nd ref="4"/><tag k="highway" v="primary"/><tag k="name" v="Camí [vell]"/></way>
</osm>"""


def test_import_tells_the_length_and_place_of_what_is_not_connected(tmp_path: Path) -> None:
    (tmp_path / "apart.osm").write_text(APART, encoding="utf-8")
    folder = str(tmp_path / "apart")
    done = run("import", str(tmp_path / "apart.osm"), "--out", folder)
    # 0.01° of latitude at 42° N: 1.11 km
    assert "not connected: 1.11 km of road in 2 links at lat 42.1" in done.stderr
    assert "(Camí [vell])" in done.stderr
    (part,) = run_json("graphs", "show", folder)["cut_off"]
    assert (part["link_count"], part["name"]) == (2, "Camí [vell]")
    assert part["length_km"] == pytest.approx(1.1107, abs=1e-3)
    assert "Camí [vell]" in run("graphs", "show", folder).stdout
    assert "roads cut by the extract: the file does not say" in done.stderr


def test_import_tells_at_how_many_places_the_extract_cuts_roads(tmp_path: Path) -> None:
    cut = APART.replace('<nd ref="2"/>', '<nd ref="2"/><nd ref="99"/>')
    (tmp_path / "cut.osm").write_text(cut.replace("42.11", "42.101"), encoding="utf-8")
    done = run("import", str(tmp_path / "cut.osm"), "--out", str(tmp_path / "cut"))
    assert "roads cut by the extract: at 1 place\n" in done.stderr


SOUND = """<osm version="0.6">
<node id="1" lat="42.00" lon="1.50"/><node id="2" lat="42.01" lon="1.50"/>
<node id="3" lat="42.03" lon="1.50"/><node id="4" lat="42.05" lon="1.50"/>
<way id="10"><nd ref="1"/><nd ref="2"/><tag k="highway" v="primary"/></way>
<way id="11"><nd ref="3"/><nd ref="4"/><tag k="highway" v="primary"/></way>
<way id="12"><nd ref="2"/><nd ref="3"/><tag k="route" v="ferry"/><tag k="name" v="Old [Line]"/>
<tag k="duration" v="00:15"/></way>
</osm>"""


def test_import_tells_ferries_that_it_leaves_out_and_brings_them_in_where_asked(tmp_path: Path) -> None:
    (tmp_path / "sound.osm").write_text(SOUND, encoding="utf-8")
    plain = run("import", str(tmp_path / "sound.osm"), "--out", str(tmp_path / "plain"))
    assert "ferry left out: 2.22 km from lat 42.01000, lon 1.50000 (Old [Line]); --ferries brings it in" in plain.stderr
    folder = str(tmp_path / "sound")
    done = run("import", str(tmp_path / "sound.osm"), "--ferries", "--out", folder)
    assert "ferries: 4 directed links, 4.4 km, no energy on board" in done.stderr
    assert "ferry left out" not in done.stderr
    shown = run_json("graphs", "show", folder)
    (ferry,) = [kind for kind in shown["road_classes"] if kind["functional_class"] == "ferry"]
    assert (ferry["link_count"], ferry["length_km"]) == (4, pytest.approx(4.443, abs=0.01))
    assert sum(kind["link_count"] for kind in shown["road_classes"]) == shown["link_count"]
    route = run_json("route", "--start", "42.001,1.5", "--goal", "42.049,1.5", "--soc", "0.8", "--graph", folder)
    assert any("'Old [Line]' (15 min)" in warning for warning in route["warnings"])
