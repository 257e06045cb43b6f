"""joulepath vehicles: list, show, add, remove and check, each answering as HTTP does."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from app.service.service import Service
from tests.app.expected import HERE, MAPBOX, TABLE, TOMTOM, VEHICLE, database_in

if TYPE_CHECKING:
    from typer.testing import Result

    from app.settings import Settings

BUNDLED = Path(__file__).resolve().parents[3] / "data" / "vehicles"


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch, settings: Settings, tmp_path: Path) -> None:
    monkeypatch.setenv("JOULEPATH_GRAPH_DIRS", str(settings.graph_dirs[0]))
    monkeypatch.setenv("JOULEPATH_DEFAULT_GRAPH", "grid")
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", database_in(tmp_path / "data"))
    monkeypatch.setenv("COLUMNS", "250")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ("vehicles", *arguments))


def run_json(*arguments: str) -> dict[str, Any]:
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.output
    answer: dict[str, Any] = json.loads(result.stdout)
    return answer


def written(folder: Path, name: str, body: object) -> str:
    (folder / name).write_text(json.dumps(body), encoding="utf-8")
    return str(folder / name)


@pytest.mark.parametrize("body", [TOMTOM, HERE, MAPBOX], ids=["tomtom", "here", "mapbox"])
def test_vehicle_in_a_services_parameters_is_added_as_a_consumption_table(tmp_path: Path, body: dict[str, Any]) -> None:
    shown = run_json("add", written(tmp_path, "moved-here.json", body))
    assert (shown["id"], shown["kind"]) == ("moved-here", "consumption_table")
    assert run_json("show", "moved-here") == shown


def test_vehicle_in_a_services_parameters_with_a_wrong_one_names_it(tmp_path: Path) -> None:
    result = run("add", written(tmp_path, "moved-here.json", HERE | {"descent": 9.5}))
    assert result.exit_code == 2
    assert "descent of vehicle 'moved-here' is 9.5, allowed: 0..9, at most ascent" in result.stderr


def test_added_vehicle_is_shown_listed_and_removed(settings: Settings, tmp_path: Path) -> None:
    shown = run_json("add", written(tmp_path, "my-van.json", TABLE))
    assert shown["id"] == "my-van"
    assert run_json("show", "my-van") == shown
    assert "my-van" in [line["id"] for line in run_json("list")["vehicles"] if not line["bundled"]]
    own = settings.model_copy(update={"database_url": database_in(tmp_path / "data")})
    assert Service(own).show_vehicle("my-van").model_dump(mode="json") == shown
    assert run_json("remove", "my-van") == {"removed": "my-van"}
    assert run("show", "my-van").exit_code == 2


def test_added_vehicle_replaces_the_one_of_its_id(tmp_path: Path) -> None:
    path = written(tmp_path, "car.json", VEHICLE | {"id": "my-car"})
    assert "my-car added" in run("add", path).stderr
    again = run("add", written(tmp_path, "car.json", VEHICLE | {"id": "my-car", "mass_kg": 1234}))
    assert "my-car replaced" in again.stderr
    assert "1234" in again.stdout
    assert run_json("show", "my-car")["mass_kg"] == 1234


def test_vehicle_file_is_added_with_its_sources(tmp_path: Path) -> None:
    text = (BUNDLED / "vw-id4.toml").read_text(encoding="utf-8").replace('id = "vw-id4"', 'id = "my-id4"')
    (tmp_path / "my-id4.toml").write_text(text, encoding="utf-8")
    added = run_json("add", str(tmp_path / "my-id4.toml"))
    bundled = run_json("show", "vw-id4")
    assert {**added, "id": "vw-id4"} == bundled


def test_shown_json_can_be_added_under_another_name(tmp_path: Path) -> None:
    shown = run_json("show", "nissan-leaf")
    path = written(tmp_path, "my-leaf.json", {key: value for key, value in shown.items() if key != "id"})
    assert run_json("add", path) == shown | {"id": "my-leaf"}


def test_tables_tell_bundled_from_stored_and_show_deviations(tmp_path: Path) -> None:
    run("add", written(tmp_path, "my-van.json", TABLE | {"sd": {"ascent_wh_per_m": 0.125}}))
    listed = run("list")
    assert [line for line in listed.stdout.splitlines() if "my-van" in line and "database" in line and "table" in line]
    assert "0.125" in run("show", "my-van").stdout
    assert "my-van removed" in run("remove", "my-van").stderr


def test_damaged_vehicle_is_a_warning_of_the_list(tmp_path: Path) -> None:
    run("add", written(tmp_path, "my-car.json", VEHICLE))
    with closing(sqlite3.connect(tmp_path / "data" / "vehicles.sqlite")) as connection:
        connection.execute("UPDATE vehicles SET document = '{'")
        connection.commit()
    listed = run("list")
    assert listed.exit_code == 0
    assert "warning: stored vehicle 'my-car' can't be read" in listed.stderr


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("my-car.json", VEHICLE | {"mass_kg": 0}, "mass_kg is 0, allowed: at least 1"),
        ("my-car.json", VEHICLE | {"kind": "steam"}, "kind is \"steam\", allowed: 'physical' or 'consumption_table'"),
        ("my-car.json", [], "holds no JSON object"),
        ("My_Car.json", VEHICLE, "id is 'My_Car', allowed: lower-case letters"),
        ("vw-id4.json", VEHICLE, "vehicle 'vw-id4' is bundled"),
        ("my-car.toml", "none", "my-car.toml: "),
        ("absent/my-car.json", None, "No such file or directory"),
    ],
)
def test_add_of_what_is_no_vehicle_is_one_line_on_stderr_and_exit_code_2(
    tmp_path: Path, name: str, content: object, message: str
) -> None:
    path = str(tmp_path / name) if content is None else written(tmp_path, name, content)
    result = run("add", path)
    assert result.exit_code == 2, result.output
    assert message in result.stderr
    assert result.stderr.strip().count("\n") == 0
    assert result.stdout == ""


def test_add_of_a_file_that_is_not_utf_8_says_so(tmp_path: Path) -> None:
    (tmp_path / "car.json").write_bytes(b'{"name": "\xe4"}')
    result = run("add", str(tmp_path / "car.json"))
    assert (result.exit_code, result.stdout) == (2, "")
    assert "is not UTF-8 at byte 10" in result.stderr


@pytest.mark.parametrize("value", ["[" * 100_000, "1" * 5000], ids=["deep", "long number"])
def test_add_of_toml_that_cannot_be_read_is_one_line_on_stderr(tmp_path: Path, value: str) -> None:
    path = tmp_path / "my-car.toml"
    path.write_text(f"mass_kg = {value}", encoding="utf-8")
    result = run("add", str(path))
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(str(path))
    assert result.stderr.strip().count("\n") == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("remove", "delorean"), "vehicle 'delorean' is unknown"),
        (("remove", "vw-id4"), "vehicle 'vw-id4' is bundled and can't be changed"),
        (("check", "delorean"), "vehicle 'delorean' is unknown"),
    ],
)
def test_error_is_one_line_on_stderr_and_exit_code_2(arguments: tuple[str, ...], message: str) -> None:
    result = run(*arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert message in result.stderr
    assert result.stderr.strip().count("\n") == 0


def test_unusable_database_is_one_line_while_bundled_vehicles_are_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", f"sqlite:///{tmp_path}/file/vehicles.sqlite")
    result = run("list")
    assert result.exit_code == 0
    assert "vw-id4" in result.stdout
    assert "is not available" in result.stderr
    assert run("show", "vw-id4").exit_code == 0


def test_commands_on_bundled_vehicles_make_no_database(tmp_path: Path) -> None:
    assert run("show", "vw-id4").exit_code == 0
    assert not (tmp_path / "data").exists()


def test_database_url_that_is_none_is_refused_without_its_password(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", "mysql://me:secret@db/vehicles")
    result = run("list")
    assert result.exit_code == 2
    assert "database_url is \"unknown kind of database 'mysql'\", allowed: sqlite:///PATH" in result.stderr
    assert "secret" not in result.stderr


def test_check_holds_the_model_beside_what_is_published(tmp_path: Path) -> None:
    run("add", written(tmp_path, "my-van.json", TABLE))
    kona, van = run_json("check", "hyundai-kona-64", "my-van")["vehicles"]
    assert (kona["id"], van["id"]) == ("hyundai-kona-64", "my-van")
    assert (van["figures"], van["met"]) == ([], None)
    assert all(10 < value < 40 for value in van["battery_kwh_per_100km"].values())
    for figure in kona["figures"]:
        assert figure["ratio"] == pytest.approx(figure["model_kwh_per_100km"] / figure["published_kwh_per_100km"])
        low, high = figure["allowed_ratio"]
        assert figure["met"] == (low <= figure["ratio"] <= high)


def test_check_without_ids_is_of_all_vehicles(tmp_path: Path) -> None:
    run("add", written(tmp_path, "my-van.json", TABLE))
    checked = [vehicle["id"] for vehicle in run_json("check")["vehicles"]]
    assert checked == [line["id"] for line in run_json("list")["vehicles"]]
    assert "my-van" in run("check").stdout
