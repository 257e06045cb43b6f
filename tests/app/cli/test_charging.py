"""joulepath route --charging and charging stops in joulepath batch: the answers of HTTP, as JSON, tables and lines."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING, Any

import pytest
from pyarrow import parquet
from rich.console import Console
from starlette.testclient import TestClient
from typer.testing import CliRunner

from app.cli.main import cli
from app.cli.plan_tables import plan_table
from app.main import create_app
from app.schemas.charging import ChargingHaltAnswer
from app.schemas.route import RouteFound
from app.schemas.vehicles.vehicle import InlineVehicle
from app.service.service import Service
from tests.app.charged import CAR, ROUTE, charged_settings, timeless

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from typer.testing import Result

    from app.settings import Settings

PLACES = ("route", "--start", "46.5,8.003", "--goal", "46.518,8.02", "--vehicle", "small")
ASKED = (*PLACES, "--charging", "--connector", "ccs2", "--arrive-soc", "0.02", "--goal-soc", "0.3")
SENT = ROUTE | {"start": {"lat": 46.5, "lon": 8.003}, "goal": {"lat": 46.518, "lon": 8.02}, "vehicle": "small"}


@pytest.fixture(scope="module")
def charged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Settings, TestClient]]:
    """Settings of the grid with stations and a stored vehicle that needs them, and a client on the same."""
    settings = charged_settings(tmp_path_factory.mktemp("graphs"))
    service = Service(settings)
    service.load_all()
    service.put_vehicle("small", InlineVehicle.model_validate(CAR | {"name": "small car"}))
    with TestClient(create_app(settings, service)) as client:
        yield settings, client


@pytest.fixture
def client(charged: tuple[Settings, TestClient], monkeypatch: pytest.MonkeyPatch) -> TestClient:
    settings, client = charged
    monkeypatch.setenv("JOULEPATH_GRAPH_DIRS", str(settings.graph_dirs[0]))
    monkeypatch.setenv("JOULEPATH_DEFAULT_GRAPH", "grid")
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", settings.database_url)
    monkeypatch.setenv("COLUMNS", "160")
    return client


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def test_plan_as_json_is_what_http_answers(client: TestClient) -> None:
    options = "--max-soc 0.9 --overhead-s 60 --min-power-kw 50"
    names = ("--prefer-network", "Ionity", "--avoid-network", "Town")
    more = "--depart 2026-11-30T08:15 --objective cost --time-value 20 --most-stops 3 --more-plans 2 --speed-cap 60"
    stays = ("--stay", "0,10,11", "--stay", "goal,600", "--via", "46.51,8.01", "--graph", "grid", "--station", "osm:n2")
    result = run(*ASKED, "--soc", "0.45", *options.split(), *names, *more.split(), *stays, "--json")
    assert result.exit_code == 0, result.output
    charging = {
        "max_soc": 0.9,
        "arrive_soc": 0.02,
        "goal_soc": 0.3,
        "overhead_s": 60,
        "connectors": ["ccs2"],
        "min_power_kw": 50,
        "networks": {"preferred": ["Ionity"], "avoided": ["Town"]},
        "departure_time": "2026-11-30T08:15",
        "objective": "cost",
        "time_value_per_h": 20,
        "most_stops": 3,
        "alternatives": 2,
        "speed_caps_kmh": [60],
        "stays": [{"at": 0, "minutes": 10, "power_kw": 11}, {"at": "goal", "minutes": 600}],
        "stations": ["osm:n2"],
    }
    answer = client.post("/route", json=SENT | {"charging": charging, "via": [{"lat": 46.51, "lon": 8.01}]}).json()
    assert timeless(json.loads(result.stdout)) == timeless(answer)
    assert answer["routes"][0]["charging"]["stops"]


def test_plan_is_shown_as_drives_and_stops_with_times_charges_and_licence(client: TestClient) -> None:
    result = run(*ASKED, "--soc", "0.45", "--depart", "2026-11-30T08:15")
    assert result.exit_code == 0, result.output
    kinds = [line.split()[1] for line in result.output.splitlines() if line.startswith(("│ drive ", "│ charge "))]
    assert kinds == ["drive", "charge", "drive"]
    assert "08:15 → " in result.output
    assert "45.0 → " in result.output
    assert "ccs2 150 kW" in result.output
    assert "kWh from the wall" in result.output
    stop = json.loads(run(*ASKED, "--soc", "0.45", "--json").stdout)["routes"][0]["charging"]["stops"][0]
    assert f"{stop['probability_kept']:.1%} sure to get there" in " ".join(result.output.split())
    assert "sure to arrive everywhere with what is asked" in result.output
    fallback = stop["fallback"]
    assert fallback is None or f"should stop 1 fail: {fallback['station_name']}" in result.output
    bands = stop["power_bands"]
    names = [f"{band['from_kw']:g} to {band['to_kw']:g} kW" for band in bands]
    assert all(name in result.output for name in ("minutes at stop", *names))
    (minutes,) = [line for line in result.output.splitlines() if line.startswith("│ 1 ")]
    assert [float(cell) for cell in minutes.split("│")[2:-1]] == [round(band["seconds"] / 60, 1) for band in bands]
    assert "(ODbL-1.0)" in result.output or "(CC-BY-4.0)" in result.output


def test_waiting_for_a_station_is_shown(client: TestClient) -> None:
    slow = ("--connector", "type2", "--station", "osm:n1", "--depart", "2026-11-30T07:50")
    result = run(*PLACES, "--charging", *slow, "--overhead-s", "60", "--goal-soc", "0.3", "--soc", "0.45")
    assert result.exit_code == 0, result.output
    text = " ".join(result.output.split())
    assert "of them until stations open)" in text
    assert "closed for " in text


def test_halt_without_a_charge_is_a_line_of_its_own_and_its_time_goes_on(client: TestClient) -> None:
    (route,) = (RouteFound.model_validate(each) for each in client.post("/route", json=SENT).json()["routes"])
    assert route.charging is not None
    stop, first = route.charging.stops[0], route.legs[0]
    assert stop.station is not None
    halt = ChargingHaltAnswer.model_validate(
        {name: getattr(stop, name, None) for name in ChargingHaltAnswer.model_fields}
        | {"arrive_s": 600.0, "depart_s": 900.0, "overhead_s": 300.0, "soc": 0.2}
    )
    plan = route.charging.model_copy(update={"halts": [halt]})
    console = Console(width=200, record=True)
    console.print(plan_table(route, plan, None))
    drive, halted, *_ = [line for line in console.export_text().splitlines() if line.startswith("│ ")]
    end_min = round((first.duration_s + 300.0) / 60.0)
    assert f"0:00 → {end_min // 60}:{end_min % 60:02d}" in drive
    assert [cell.strip() for cell in halted.split("│")[1:4]] == ["halt", "0:10 → 0:15", "5.0"]
    assert (stop.station.name or stop.station.operator) in halted


def test_no_plan_says_what_would_help(client: TestClient) -> None:
    result = run(*ASKED, "--soc", "0.3", "--max-soc", "0.35")
    assert result.exit_code == 0, result.output
    assert "no charging stops make the goal reachable" in result.output
    assert "would help: departing with" in result.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--arrive-soc", "0.2"), "--charging is missing"),
        (("--charging", "--stay", "home,5"), "charging.stays[0] is 'home,5', allowed: PLACE,MIN"),
        (("--charging", "--station", "n2"), "did you mean 'osm:n2'?"),
        (("--charging", "--via-station", "osm:n2"), "charging.via_stations[0] is 'osm:n2', allowed: PLACE,ID"),
        (("--charging", "--via-station", "0,osm:n2"), "charging.via_stations[0].via is 0"),
        (("--charging", "--exclude-station", "n2"), "charging.excluded_stations[0] is"),
        (("--charging", "--objective", "fame"), "charging.objective is"),
        (("--charging", "--pareto", "0.02"), "pareto is"),
    ],
)
def test_options_that_contradict_or_are_unknown_are_refused(
    client: TestClient, arguments: tuple[str, ...], said: str
) -> None:
    result = run(*PLACES, "--soc", "0.45", *arguments)
    assert result.exit_code != 0
    assert said in result.stderr


def test_batch_names_field_value_and_range_of_what_is_wrong_in_its_own_row(client: TestClient, tmp_path: Path) -> None:
    wrong = {
        "charging.stays": ("goal", '[{"at": "goal", "minutes": NaN}]', '[{"at": "goal", "minutes": 600'),
        "charging.speed_caps_kmh": ("110,90", "[Infinity]"),
        "charging.departure_time": ("2026-11-30T08:15Z", "8:15"),
        "charging.networks.preferred": ("Ionity", '["nobody"]'),
    }
    requests, out = tmp_path / "requests.csv", tmp_path / "routes.jsonl"
    with requests.open("w", encoding="utf-8", newline="") as file:
        rows = csv.DictWriter(file, ["start", "goal", "soc", "vehicle", *wrong])
        rows.writeheader()
        asked = {"start": "[8.003, 46.5]", "goal": "[8.02, 46.518]", "soc": 0.45, "vehicle": "small"}
        rows.writerows(asked | {field: cell} for field, cells in wrong.items() for cell in cells)
    result = run("batch", requests, "--out", out, "--threads", "1")
    assert result.exit_code == 0, result.output
    answers = [json.loads(line) for line in out.read_text(encoding="utf-8").splitlines()]
    fields = [field for field, cells in wrong.items() for _ in cells]
    for answer, field in zip(answers, fields, strict=True):
        (error,) = answer["problem"]["errors"]
        assert answer["problem"]["status"] == 422
        assert error["field"].startswith(field)
        assert error["allowed"]
        assert error["allowed"] in answer["problem"]["detail"]


def test_batch_has_columns_of_charging_stops(client: TestClient, tmp_path: Path) -> None:
    requests, out = tmp_path / "requests.csv", tmp_path / "routes.parquet"
    requests.write_text(
        "start,goal,soc,vehicle,charging.goal_soc,charging.arrive_soc,charging.overhead_s,charging.connectors,charging.stations,"
        "charging.departure_time\n"
        '"[8.003, 46.5]","[8.02, 46.518]",0.45,small,0.3,0.02,60,"[""ccs2""]",,\n'
        '"[8.003, 46.5]","[8.02, 46.518]",0.45,small,,,,,,\n'
        '"[8.003, 46.5]","[8.02, 46.518]",0.3,small,0.3,0.02,60,"[""ccs2""]",,\n'
        '"[8.003, 46.5]","[8.02, 46.518]",0.45,small,0.3,0.02,60,"[""type2""]","[""osm:n1""]",2026-11-30T07:50\n',
        encoding="utf-8",
    )
    result = run("batch", requests, "--out", out, "--threads", "1")
    assert result.exit_code == 0, result.output
    planned, plain, none, waiting = parquet.read_table(out).to_pylist()
    route: dict[str, Any] = client.post("/route", json=SENT).json()["routes"][0]
    assert planned["stops"] == len(route["charging"]["stops"]) == 1
    assert planned["charging_s"] == route["charging"]["totals"]["charging_s"]
    assert (planned["total_s"], planned["no_plan"]) == (route["total_s"], None)
    charging, (stop,) = route["charging"], route["charging"]["stops"]
    assert planned["probability_kept"] == charging["probability_kept"]
    assert (planned["short_by"], planned["objective_unit"]) == (charging["proof"]["short_by"], "s")
    assert (planned["waiting_s"], planned["arrive_time"]) == (0.0, None)
    assert planned["least_fallback_soc"] == (stop["fallback"] and stop["fallback"]["arrive_soc"])
    assert planned["stops_without_fallback"] == int(stop["fallback"] is None or not stop["fallback"]["reached"])
    assert waiting["arrive_time"].startswith("2026-11-30T08:")
    assert waiting["waiting_s"] > 0.0
    assert (plain["stops"], plain["total_s"]) == (None, plain["duration_s"])
    assert none["no_plan"]
    assert none["feasible"] is False
