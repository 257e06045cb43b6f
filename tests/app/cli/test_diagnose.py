"""joulepath diagnose: files in, a folder with what was found out."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rasterio
from rasterio import Affine
from typer.testing import CliRunner

from app.cli.main import cli
from energy.replay.replay import DrivenProfile, replay
from energy.units import KMH_PER_MPS
from energy.vehicle.vehicle import Vehicle
from tests.app.conftest import SOUTH, SPACING_DEG, VEHICLES, WEST
from tests.app.http.test_diagnoses import BAD, CAR
from tests.app.recorded import NOISE_W, write_winter

if TYPE_CHECKING:
    from typer.testing import Result

    from app.service.service import Service

FILES = {"diagnosis.json", "effects.json", "report.html"}
METRE_PER_DEGREE = 111_195.0
CONSUMER_W = 800.0  # that the model knows nothing of


pytestmark = pytest.mark.usefixtures("environment")


@pytest.fixture(scope="module")
def car(service: Service) -> Vehicle:
    found = service.known_vehicle(CAR)
    assert isinstance(found, Vehicle)
    return found


@pytest.fixture(scope="module")
def winter(tmp_path_factory: pytest.TempPathFactory, car: Vehicle) -> Path:
    """A folder of twelve drives with a heater, most in the cold."""
    folder = tmp_path_factory.mktemp("cli") / "winter"
    write_winter(folder, car, trips=12, duration_s=300)
    return folder


@pytest.fixture
def few(winter: Path, tmp_path: Path) -> Path:
    """A folder of a few of these drives, too few to conclude anything, which is said at once."""
    return Path(shutil.copytree(winter, tmp_path / "few", ignore=shutil.ignore_patterns("winter-0[2-9].csv")))


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(cli, ["diagnose", *map(str, arguments)])


def written(folder: Path) -> dict[str, Any]:
    assert {path.name for path in folder.iterdir()} == FILES
    result: dict[str, Any] = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    return result


def test_diagnosis_of_a_folder_writes_three_files_and_prints_what_it_found(winter: Path, tmp_path: Path) -> None:
    (winter.parent / "broken.csv").write_bytes(BAD)
    out = tmp_path / "new" / "out"
    shared = ("--vehicle", CAR, "--out", out, "--holdout", "winter-0[25]", "--holdout-fraction", "0.2", "--seed", "4")
    result = run(winter, winter.parent / "*.csv", *shared)
    assert result.exit_code == 0, result.output
    assert "left out physics" in result.stdout
    assert "cabin" in result.stdout
    assert "mean absolute" in result.stdout
    assert "broken.csv, row 3: speed_kmh is ten" in result.stderr
    diagnosis = written(out)
    held_out = diagnosis["fit"]["held_out_trips"]
    assert {"winter-02", "winter-05"} < set(held_out)
    assert len(held_out) in (3, 4)  # two are named, two are drawn, of which one may be a named one
    assert diagnosis["refused"][0]["file"].endswith("broken.csv")
    assert json.loads((out / "effects.json").read_text(encoding="utf-8"))["learned_from"]["vehicle"] == CAR


def test_diagnosis_as_json_is_the_file_and_the_same_seed_gives_the_same(few: Path, tmp_path: Path) -> None:
    shared = ("--holdout-fraction", "0.5", "--seed", "2", "--json", "--vehicle", VEHICLES / f"{CAR}.toml")
    first, second = (run(few, *shared, "--out", tmp_path / name) for name in ("first", "second"))
    assert first.exit_code == 0, first.output
    assert json.loads(first.stdout) == written(tmp_path / "first")
    assert first.stdout == second.stdout
    assert json.loads(first.stdout)["verdict"] == "too_few_trips"
    pages = [(tmp_path / name / "report.html").read_bytes() for name in ("first", "second")]
    assert pages[0] == pages[1]


def test_effects_of_a_diagnosis_are_taken_by_route_range_and_simulate(tmp_path: Path) -> None:
    effects = {"cabin_ua_w_per_k": 150, "parameters": {"mass_kg": 2000}, "learned_from": {"vehicle": "nissan-leaf"}}
    (tmp_path / "effects.json").write_text(json.dumps(effects), encoding="utf-8")
    (tmp_path / "links.json").write_text(json.dumps({"links": [{"id": 0}], "vehicle": CAR}), encoding="utf-8")
    named = ("--effects", str(tmp_path / "effects.json"), "--json")
    place = ("46.5,8.003", "--vehicle", CAR, "--soc", "0.4")
    for command in (
        ["route", "--goal", "46.518,8.02", "--start", *place],
        ["range", "--origin", *place],
        ["simulate", str(tmp_path / "links.json")],
    ):
        result = CliRunner().invoke(cli, [*command, *named])
        assert result.exit_code == 0, result.output
        answer = json.loads(result.stdout)
        assert answer["request"]["effects"]["parameters"]["mass_kg"] == 2000
        assert "learned on vehicle 'nissan-leaf'" in answer["warnings"][0]
        unknown = CliRunner().invoke(cli, [*command, "--effects", "20260101-nothing"])
        assert (unknown.exit_code, "effects '20260101-nothing' are unknown" in unknown.output) == (2, True)
        missing = CliRunner().invoke(cli, [*command, "--effects", "nothing.json"])
        assert (missing.exit_code, "nothing.json" in missing.output) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--holdout", "winter-99"),
            "holdout is 'winter-99', allowed: an id of a trip, or a pattern of ids: winter-00",
        ),
        (("--holdout-fraction", "0.95"), "holdout_fraction is 0.95, allowed: 0..0.9"),
        (("--vehicle", "delorean"), "vehicle 'delorean' is unknown"),
        (("--vehicle", "nothing.toml"), "nothing.toml"),
        (("--graph", "atlantis"), "graph 'atlantis' is unknown"),
        (("--hide", "speed*"), "no recording can be used"),
    ],
)
def test_bad_option_ends_in_one_message_and_writes_nothing(
    winter: Path, tmp_path: Path, arguments: tuple[str, str], message: str
) -> None:
    out = tmp_path / "out"
    result = run(winter, "--vehicle", CAR, "--out", out, *arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert not out.exists()


def test_files_that_are_all_bad_are_named_each(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_bytes(b"")
    (tmp_path / "broken.csv").write_bytes(BAD)
    result = run(tmp_path, tmp_path / "gone.csv", "--vehicle", CAR, "--out", tmp_path / "out")
    assert result.exit_code == 2
    for name in ("empty.csv", "broken.csv, row 3", "gone.csv"):
        assert name in result.output


def test_folder_without_recordings_is_named(tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    result = run(tmp_path / "none", "--vehicle", CAR, "--out", tmp_path / "out")
    assert (result.exit_code, f"no recordings in {tmp_path / 'none'}" in result.output) == (2, True)


def test_out_that_is_a_file_is_refused_before_anything_is_read(winter: Path, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    result = run(winter, "--vehicle", CAR, "--out", tmp_path / "out")
    assert (result.exit_code, "allowed: a folder" in result.output) == (2, True)
    assert (tmp_path / "out").read_text(encoding="utf-8") == "mine"


def test_older_files_stay_whole_when_writing_fails(few: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run(few, "--vehicle", CAR, "--out", out).exit_code == 0
    (out / "diagnosis.json").unlink()
    (out / "diagnosis.json").mkdir()  # a folder can't be replaced by a file
    before = (out / "effects.json").read_bytes()
    result = run(few, "--vehicle", CAR, "--out", out)
    assert result.exit_code == 2
    assert (out / "effects.json").read_bytes() == before
    assert {path.name for path in out.iterdir()} == FILES


def test_graph_adds_where_on_its_links_differences_stay(car: Vehicle, tmp_path: Path) -> None:
    write_on_south_street(tmp_path / "drives", car)
    arguments = (tmp_path / "drives", "--vehicle", CAR, "--graph", "grid", "--out", tmp_path / "out")
    result = run(*arguments)
    assert result.exit_code == 0, result.output
    features = json.loads((tmp_path / "out" / "residuals.geojson").read_text(encoding="utf-8"))["features"]
    assert features
    for feature in features:
        assert feature["geometry"]["type"] == "LineString"
        assert all(abs(lat - SOUTH) < 1e-6 for _, lat in feature["geometry"]["coordinates"])
    splits = json.loads((tmp_path / "out" / "diagnosis.json").read_text(encoding="utf-8"))["profile"]
    assert len(splits) == 8
    assert all(split["planned_kwh"] > 0.0 for split in splits)
    assert all(split["forecast_kwh"] > 0.0 for split in splits)


def test_elevation_file_gives_drives_their_height(car: Vehicle, tmp_path: Path) -> None:
    write_on_south_street(tmp_path / "drives", car)
    with rasterio.open(
        tmp_path / "dem.tif",
        "w",
        driver="GTiff",
        width=4,
        height=4,
        count=1,
        dtype="float32",
        crs="EPSG:4326",
        transform=Affine(SPACING_DEG, 0.0, WEST - SPACING_DEG, 0.0, -SPACING_DEG, SOUTH + 2.0 * SPACING_DEG),
    ) as raster:
        raster.write(np.full((4, 4), 700.0, np.float32), 1)
    arguments = ("--vehicle", CAR, "--out", tmp_path / "out")
    result = run(tmp_path / "drives", *arguments, "--dem", tmp_path / "dem.tif")
    assert result.exit_code == 0, result.output
    diagnosis = written(tmp_path / "out")
    assert "Height was filled in from dem.tif on all drives" in diagnosis["text"]
    assert [note["kind"] for note in diagnosis["data_quality"] if note["channel"] == "elevation_m"] == 8 * ["filled"]
    assert "elevation_m" not in [lack["channel"] for lack in diagnosis["missing"]]
    gone = run(tmp_path / "drives", *arguments, "--dem", tmp_path / "gone.tif")
    assert (gone.exit_code, "gone.tif: no such file" in gone.output) == (2, True)


def test_recordings_that_do_not_lie_on_the_graph_are_named_and_diagnosed_without_it(few: Path, tmp_path: Path) -> None:
    result = run(few, "--vehicle", CAR, "--graph", "grid", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "not on the graph: winter-00: " in result.stderr
    assert "not on the graph: winter-01: " in result.stderr
    assert written(tmp_path / "out")["profile"] == []


def write_on_south_street(folder: Path, car: Vehicle) -> None:
    """Eight drives from west to east along the grid's southern street, 1.5 km at 30..51 km/h."""
    folder.mkdir()
    for k in range(8):
        top_mps = (30.0 + 3.0 * k) / KMH_PER_MPS
        cruise_s = int(1400.0 / top_mps)
        speed = np.concatenate(
            (np.arange(0.0, top_mps, 1.0), np.full(cruise_s, top_mps), np.arange(top_mps, 0.0, -1.0))
        )
        time_s = np.arange(float(speed.size))
        way_m = np.concatenate(([0.0], np.cumsum(0.5 * (speed[:-1] + speed[1:]))))
        noise_w = np.random.default_rng(k).normal(0.0, NOISE_W, time_s.size - 1)
        power = replay(car, DrivenProfile(time_s, speed)).power_w + noise_w + CONSUMER_W
        lon = WEST + 0.1 * SPACING_DEG + way_m / (METRE_PER_DEGREE * np.cos(np.radians(SOUTH)))
        rows = [
            f"{t:.0f},{v * KMH_PER_MPS:.3f},{p:.1f},{SOUTH},{x:.7f}"
            for t, v, p, x in zip(time_s, speed, np.append(power, power[-1]), lon, strict=True)
        ]
        text = "\n".join(["time_s,speed_kmh,power_w,lat,lon", *rows])
        (folder / f"drive-{k}.csv").write_text(text + "\n", encoding="utf-8")
