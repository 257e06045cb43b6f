"""joulepath matrix and joulepath batch: the figures of single requests, row by row, on threads and on a cluster."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import distributed
import psutil
import pytest
import shapely
from pyarrow import parquet
from typer.testing import CliRunner

from app.cli.batch.scheduling import workers
from app.cli.main import cli

if TYPE_CHECKING:
    from collections.abc import Iterator

    from starlette.testclient import TestClient
    from typer.testing import Result


PLACES = "id,lat,lon\nhome,46.5,8.003\nmill,46.518,8.02\n,46.507,8.01\n"
ROUTE = {"start": {"lat": 46.5, "lon": 8.003}, "goal": {"lat": 46.518, "lon": 8.02}}
REQUESTS: list[dict[str, Any]] = [
    {"id": 7, **ROUTE, "soc": 0.5},
    {"id": "no charge", **ROUTE, "soc": 0.002},
    {"id": "far", "start": [0, 0], "goal": [8.01, 46.507], "soc": 0.5},
    {**ROUTE, "soc": 0.6, "alternatives": ["eco", "fastest"], "conditions": {"ambient_c": -5}},
    {**ROUTE, "soc": 1.5},
]
CSV = """id,start.lat,start.lon,goal,soc,alternatives,conditions.ambient_c,vehicle
7,46.5,8.003,"[8.02, 46.518]",0.5,,,
,46.5,8.003,"{""lat"": 46.518, ""lon"": 8.02}",0.6,"eco,fastest",-5,bmw-i3-60ah
odd,46.5,8.003,"[8.02, 46.518]",much,,,
"""


pytestmark = pytest.mark.usefixtures("environment")


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """A scheduler with one worker in a process of its own."""
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as running:
        yield running.scheduler_address


@pytest.fixture
def places(tmp_path: Path) -> Path:
    path = tmp_path / "places.csv"
    path.write_text(PLACES, encoding="utf-8")
    return path


@pytest.fixture
def requests(tmp_path: Path) -> Path:
    path = tmp_path / "requests.jsonl"
    path.write_text("".join(f"{json.dumps(body)}\n" for body in REQUESTS) + '\n{"start":\n[1]\n', encoding="utf-8")
    return path


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def lines_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def timeless(answer: dict[str, Any]) -> dict[str, Any]:
    stats = answer["stats"]
    for search in stats if isinstance(stats, list) else [stats]:
        search.pop("seconds")
    return answer


def test_matrix_as_json_equals_http(client: TestClient, places: Path) -> None:
    points = [{"lat": 46.5, "lon": 8.003}, {"lat": 46.518, "lon": 8.02}, {"lat": 46.507, "lon": 8.01}]
    body = {
        "sources": points,
        "soc": 0.4,
        "vehicle": "vw-id4",
        "weights": {"energy": 1, "time": 5, "distance": 0},
        "conditions": {"ambient_c": -5},
        "reserve_soc": 0.1,
    }
    options = ("--soc", "0.4", "--vehicle", "vw-id4", "--weights", "1,5,0", "--condition", "ambient_c=-5")
    result = run("matrix", places, *options, "--reserve-soc", "0.1", "--json")
    assert result.exit_code == 0, result.output
    assert timeless(json.loads(result.stdout)) == timeless(client.post("/matrix", json=body).json())


def test_matrix_on_a_cluster_equals_that_on_threads(places: Path, cluster: str) -> None:
    here, there = (
        run("matrix", places, "--soc", "0.5", "--json", *more)
        for more in (("--threads", "1"), ("--scheduler", cluster))
    )
    assert (here.exit_code, there.exit_code) == (0, 0), there.output
    assert timeless(json.loads(here.stdout)) == timeless(json.loads(there.stdout))


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_matrix_table_has_one_line_a_pair_with_ids_or_rows(places: Path, tmp_path: Path, kind: str) -> None:
    targets, out = tmp_path / "targets.csv", tmp_path / f"pairs.{kind}"
    targets.write_text("lon,lat\n8.02,46.518\n", encoding="utf-8")
    result = run("matrix", places, "--targets", targets, "--soc", "0.002", "--out", out)
    assert result.exit_code == 0, result.output
    if kind == "csv":
        with out.open(encoding="utf-8", newline="") as file:
            lines = list(csv.DictReader(file))
    else:
        lines = parquet.read_table(out).to_pylist()
    assert [(line["source"], line["target"]) for line in lines] == [("home", "1"), ("mill", "1"), ("3", "1")]
    nothing, whether = ("", ["false", "true"]) if kind == "csv" else (None, [False, True])
    assert [lines[0]["feasible"], lines[1]["feasible"]] == whether
    assert (lines[0]["energy_kwh"], lines[0]["reason"]) == (nothing, "charge")
    assert (float(lines[1]["energy_kwh"]), lines[1]["reason"]) == (0.0, nothing)
    assert float(lines[0]["deficit_kwh"]) > 0.0


def test_matrix_prints_energies_and_why_a_pair_has_none(places: Path) -> None:
    printed = run("matrix", places, "--soc", "0.002").output
    assert "home" in printed
    assert "charge" in printed
    assert "0.00" in printed


def test_batch_answers_each_row_as_http_does(client: TestClient, requests: Path, tmp_path: Path) -> None:
    out = tmp_path / "results.jsonl"
    result = run("batch", requests, "--out", out)
    assert result.exit_code == 0, result.output
    lines = lines_of(out)
    assert [(line["row"], line["id"]) for line in lines] == [
        (1, "7"),
        (2, "no charge"),
        (3, "far"),
        (4, None),
        (5, None),
        (6, None),
        (7, None),
    ]
    for line, body in zip(lines[:5], REQUESTS, strict=True):
        sent = {"links": False, **{name: value for name, value in body.items() if name != "id"}}
        alone = client.post("/route", json=sent).json()
        if "problem" in line:
            assert line["problem"] == alone
        else:
            assert timeless(line["response"]) == timeless(alone)
    problems = [line["problem"]["code"] for line in lines if "problem" in line]
    assert problems == ["point_outside_map", "invalid_request", "malformed_json", "malformed_json"]
    said = "7 requests, 4 routes (1 beyond the charge), 4 problems (2 malformed_json, 1 point_outside_map, 1 invalid"
    assert said in result.output
    assert not out.with_name("results.jsonl.part").exists()


def test_batch_of_a_csv_file_takes_fields_by_dots_and_defaults_by_options(client: TestClient, tmp_path: Path) -> None:
    asked, out = tmp_path / "requests.csv", tmp_path / "results.jsonl"
    asked.write_text(CSV, encoding="utf-8-sig")
    options = ("--vehicle", "vw-id4", "--reserve-soc", "0.1", "--links")
    result = run("batch", asked, "--out", out, *options)
    assert result.exit_code == 0, result.output
    first, second, odd = lines_of(out)
    sent = {**ROUTE, "goal": [8.02, 46.518], "soc": 0.5, "vehicle": "vw-id4", "reserve_soc": 0.1}
    assert first["id"] == "7"
    assert timeless(first["response"]) == timeless(client.post("/route", json=sent).json())
    assert [route["name"] for route in second["response"]["routes"]] == ["eco", "fastest"]
    assert second["response"]["request"]["conditions"]["ambient_c"] == -5
    assert second["response"]["request"]["vehicle"] == "bmw-i3-60ah"
    assert odd["problem"]["detail"].startswith('soc is "much"')


def test_batch_to_parquet_has_one_flat_line_a_route_and_geometry(requests: Path, tmp_path: Path) -> None:
    out, plain = tmp_path / "results.parquet", tmp_path / "results.jsonl"
    assert run("batch", requests, "--out", out).exit_code == 0
    assert run("batch", requests, "--out", plain).exit_code == 0
    table = parquet.read_table(out)
    records = table.to_pylist()
    assert [record["row"] for record in records] == [1, 2, 3, 4, 4, 5, 6, 7]
    assert json.loads(table.schema.metadata[b"geo"])["columns"]["geometry"]["encoding"] == "WKB"
    (route,) = lines_of(plain)[0]["response"]["routes"]
    for name in ("energy_kwh", "duration_s", "distance_m", "soc_end", "soc_min", "feasible", "climb_m"):
        assert records[0][name] == route[name]
    assert shapely.from_wkb(records[0]["geometry"]).coords[:] == [tuple(at) for at in route["geometry"]["coordinates"]]
    assert [record["problem_code"] for record in records[2:4]] == ["point_outside_map", None]
    assert records[2]["energy_kwh"] is None


def test_batch_on_a_cluster_equals_that_on_threads(requests: Path, tmp_path: Path, cluster: str) -> None:
    here, there = tmp_path / "here.jsonl", tmp_path / "there.jsonl"
    assert run("batch", requests, "--out", here, "--threads", "3").exit_code == 0
    result = run("batch", requests, "--out", there, "--scheduler", cluster)
    assert result.exit_code == 0, result.output
    pairs = zip(lines_of(here), lines_of(there), strict=True)
    for local, other in pairs:
        for line in (local, other):
            if "response" in line:
                timeless(line["response"])
        assert local == other


def test_batch_of_many_rows_keeps_their_order(tmp_path: Path) -> None:
    asked, out = tmp_path / "many.ndjson", tmp_path / "many.jsonl"
    asked.write_text("".join(f"{json.dumps({'id': k, **ROUTE, 'soc': 0.5})}\n" for k in range(203)), encoding="utf-8")
    result = run("batch", asked, "--out", out, "--threads", "4")
    assert result.exit_code == 0, result.output
    lines = lines_of(out)
    assert [line["id"] for line in lines] == [str(k) for k in range(203)]
    assert {line["response"]["routes"][0]["energy_kwh"] for line in lines} == {
        lines[0]["response"]["routes"][0]["energy_kwh"]
    }


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "is empty, allowed: a header and rows"),
        ("lat,lat\n1,2\n", "has two columns 'lat'"),
        ("lat\n1\n", "has no column 'lon', required: lat, lon"),
        ("lat,lon\n", "has no places"),
        ("lat,lon\n46,\n", "row 1: lon is '', allowed: degrees"),
        ("lat,lon\n46,8,9\n", "row 1 has more cells than the header"),
        ("lat,lon\n46,east\n", "row 1: lon is 'east'"),
        ("lat,lon\n46.507,8.01\n0,0\n", r"sources[1] (lat 0, lon 0) is outside the map"),
        ("lat,lon\n95,8\n", "sources[0].lat is 95.0, allowed: at most 90"),
    ],
)
def test_places_that_can_not_be_used_are_named(tmp_path: Path, content: str, said: str) -> None:
    path = tmp_path / "places.csv"
    path.write_text(content, encoding="utf-8")
    result = run("matrix", path, "--soc", "0.5")
    assert (result.exit_code, said in result.output) == (2, True), result.output


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.txt", b"x", "is of an unknown kind, allowed: .csv, .jsonl, .ndjson"),
        ("a.csv", b"start,start.lat\n1,2\n", "has columns 'start' and 'start.lat', allowed: either"),
        ("a.csv", b"start.,goal\n1,2\n", "has a column 'start.'"),
        ("a.csv", b"start\n\xff\n", "is not UTF-8"),
        ("a.csv", b"start,goal\n", "has no requests"),
        ("a.jsonl", b"\n", "has no requests"),
    ],
)
def test_requests_that_can_not_be_read_are_named(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    result = run("batch", path, "--out", tmp_path / "out.jsonl")
    assert (result.exit_code, said in result.output) == (2, True), result.output
    assert not (tmp_path / "out.jsonl").exists()


@pytest.mark.parametrize("kind", ["jsonl", "parquet"])
def test_row_whose_id_no_file_can_hold_is_a_problem_of_its_own(tmp_path: Path, kind: str) -> None:
    path, out = tmp_path / "a.jsonl", tmp_path / f"out.{kind}"
    bodies = [{"id": row_id, **ROUTE, "soc": 0.5} for row_id in ("\ud800", ["a", 1])]
    path.write_text("".join(f"{json.dumps(body)}\n" for body in bodies), encoding="utf-8")
    result = run("batch", path, "--out", out)
    assert result.exit_code == 0, result.output
    odd, listed = lines_of(out) if kind == "jsonl" else parquet.read_table(out).to_pylist()
    said = odd["problem"]["detail"] if kind == "jsonl" else odd["problem_detail"]
    assert (odd["id"], said) == (None, "its id is not valid Unicode")
    assert listed["id"] == '["a", 1]'


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("batch", "REQUESTS", "--out", "out.csv"), "--out is 'out.csv', allowed: a name that ends in .jsonl"),
        (("batch", "REQUESTS", "--out", "out.parquet", "--links"), "--links is set"),
        (("batch", "REQUESTS", "--out", "OUT", "--scheduler", "nowhere://1"), "--scheduler is 'nowhere://1'"),
        (("batch", "REQUESTS", "--out", "OUT", "--graph", "atlantis"), "graph 'atlantis' is unknown"),
        (("batch", "REQUESTS", "--out", "no/out.jsonl"), "--out is 'no/out.jsonl', allowed: a name in a folder that"),
        (
            ("batch", "REQUESTS", "--out", "REQUESTS"),
            "requests.jsonl', allowed: another file than the one that is read",
        ),
        (("matrix", "PLACES", "--soc", "0.5", "--out", "out.json"), "--out is 'out.json'"),
        (("matrix", "PLACES", "--soc", "0.5", "--out", "no/out.csv"), "--out is 'no/out.csv', allowed: a name in a"),
        (("matrix", "PLACES", "--soc", "0.5", "--out", "PLACES"), "places.csv', allowed: another file than the one"),
        (("matrix", "PLACES", "--soc", "0.5", "--scheduler", "nowhere://1"), "--scheduler is 'nowhere://1'"),
        (("matrix", "PLACES", "--soc", "0.5", "--weights", "fast"), "weights is 'fast', allowed: E,T,D"),
    ],
)
def test_options_out_of_range_are_refused(
    requests: Path, places: Path, tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    files = {"REQUESTS": requests, "PLACES": places, "OUT": tmp_path / "out.jsonl"}
    result = run(*(files.get(argument, argument) for argument in arguments))
    assert (result.exit_code, said in result.output) == (2, True), result.output


def test_embedded_scheduler_can_not_be_reached_from_other_hosts() -> None:
    with workers(None, 1) as own:
        listening = [at for at in psutil.Process().net_connections() if at.status == psutil.CONN_LISTEN]
        assert own.thread_count == 1
        assert listening
        assert {at.laddr.ip for at in listening} == {"127.0.0.1"}


def test_without_dask_it_is_named(requests: Path, tmp_path: Path) -> None:
    """In a process of its own, from which the package is kept away."""
    run_it = f"cli(['batch', {str(requests)!r}, '--out', {str(tmp_path / 'out.jsonl')!r}])"
    code = f"import sys; sys.modules['distributed'] = None; from app.cli.main import cli; {run_it}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "distributed is not installed: install `dask[distributed]`" in " ".join(done.stderr.split())
