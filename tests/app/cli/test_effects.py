"""--effects on the command line: refused where causes are open, compared before it is applied."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from tests.app.conversions.test_learned_effects import store_effects
from tests.app.totals import OPEN_CAR, write_totals

if TYPE_CHECKING:
    from pathlib import Path

    from typer.testing import Result

    from app.service.service import Service

pytestmark = pytest.mark.usefixtures("environment")

CAR = "hyundai-kona-64"
CLEAR = {"cabin_ua_w_per_k": 150, "heating_cop": 1, "parameters": {"mass_kg": 2400}}
OPEN_FROM = {
    "vehicle": CAR,
    "verdict": "cannot_tell",
    "open_causes": [{"cause": "Heat", "rivals": ["Cold tyres"], "recording": "A recording with standstill."}],
}
ENDS = ("--start", "46.5,8.003", "--goal", "46.518,8.02", "--soc", "0.4", "--vehicle", CAR)
COLD = ("--condition", "ambient_c=-5")
REFUSED = (
    "--effects is not applied, for it was learned from drives that could not tell their causes apart: heat could as"
    " well be cold tyres; what would tell: a recording with standstill"
)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def file_of(folder: Path, **effects: Any) -> Path:
    path = folder / "effects.json"
    path.write_text(json.dumps(effects), encoding="utf-8")
    return path


@pytest.fixture
def open_file(tmp_path: Path) -> Path:
    """Effects whose causes could not be told apart."""
    return file_of(tmp_path, **CLEAR, learned_from=OPEN_FROM)


def commands(folder: Path) -> dict[str, tuple[object, ...]]:
    (folder / "links.json").write_text(json.dumps({"links": [{"id": 0}], "vehicle": CAR}), encoding="utf-8")
    (folder / "places.csv").write_text("lat,lon\n46.5,8.003\n46.518,8.02\n", encoding="utf-8")
    return {
        "route": ("route", *ENDS),
        "range": ("range", "--origin", "46.5,8.003", "--soc", "0.02", "--vehicle", CAR),
        "simulate": ("simulate", folder / "links.json"),
        "matrix": ("matrix", folder / "places.csv", "--soc", "0.4", "--vehicle", CAR, "--threads", "1"),
    }


@pytest.mark.parametrize("command", ["route", "range", "simulate", "matrix"])
def test_effects_of_open_causes_are_refused_by_name_until_told_otherwise(
    tmp_path: Path, open_file: Path, command: str
) -> None:
    asked = commands(tmp_path)[command]
    refused = run(*asked, "--effects", open_file)
    assert refused.exit_code == 2
    assert REFUSED in refused.stderr
    assert "--apply-uncertain" in refused.stderr
    assert refused.stdout == ""
    applied = run(*asked, "--effects", open_file, "--apply-uncertain")
    assert applied.exit_code == 0, applied.output
    assert "could not tell their causes apart" in " ".join(applied.stderr.split())
    clear = run(*asked, "--effects", file_of(tmp_path, **CLEAR, learned_from={"verdict": "left_out_physics"}))
    assert clear.exit_code == 0, clear.output
    assert "could not tell" not in clear.stderr


def test_effects_of_open_causes_are_refused_by_the_id_of_their_diagnosis_too(service: Service) -> None:
    document = json.dumps({**CLEAR, "learned_from": OPEN_FROM})
    store_effects(service, "20260302-open", CAR, document)
    refused = run("route", *ENDS, "--effects", "20260302-open")
    assert (refused.exit_code, REFUSED in refused.stderr) == (2, True)


def test_effects_in_the_body_of_a_simulation_are_its_own_choice(tmp_path: Path) -> None:
    body = {"links": [{"id": 0}], "vehicle": CAR, "effects": {**CLEAR, "learned_from": OPEN_FROM}}
    (tmp_path / "body.json").write_text(json.dumps(body), encoding="utf-8")
    answer = run("simulate", tmp_path / "body.json", "--json")
    assert answer.exit_code == 0, answer.output
    assert "could not tell their causes apart" in " ".join(json.loads(answer.stdout)["warnings"])


def energies(*options: object) -> tuple[float, float]:
    """Energy [kWh] and charge at the end of a route."""
    (route,) = json.loads(run("route", *ENDS, *COLD, *options, "--json").stdout)["routes"]
    return route["energy_kwh"], route["soc_end"]


def test_comparison_shows_both_before_anything_is_applied(open_file: Path) -> None:
    file, learned = energies(), energies("--effects", open_file, "--apply-uncertain")
    shown = run("route", *ENDS, *COLD, "--effects", open_file, "--compare")  # not refused: nothing is applied
    assert shown.exit_code == 0, shown.output
    for kwh, soc_end in (file, learned):
        assert f"{kwh:.3f}" in shown.stdout
        assert f"{soc_end:.3f}" in shown.stdout
    assert f"{learned[0] / file[0] - 1.0:+.0%}" in shown.stdout
    assert "cabin" in shown.stdout
    assert "could not tell their causes apart" in " ".join(shown.stderr.split())
    both = json.loads(run("route", *ENDS, *COLD, "--effects", open_file, "--compare", "--json").stdout)
    assert [both[which]["routes"][0]["energy_kwh"] for which in ("file", "learned")] == [file[0], learned[0]]
    assert both["file"]["request"]["effects"] is None


def test_applied_effects_say_what_they_change_without_being_asked(tmp_path: Path) -> None:
    clear = file_of(tmp_path, **CLEAR)
    file, learned = energies(), energies("--effects", clear)
    shown = run("route", *ENDS, *COLD, "--effects", clear)
    assert learned[0] > 1.05 * file[0]
    expected = (
        f"eco: {learned[0]:.3f} kWh with what was learned, {file[0]:.3f} kWh by the vehicle's file"
        f" ({learned[0] / file[0] - 1.0:+.0%}); {learned[1]:.3f} of the charge at the end instead of {file[1]:.3f}"
    )
    assert expected in shown.stdout
    area = run(*commands(tmp_path)["range"], *COLD, "--effects", clear)
    assert "km² with what was learned" in area.stdout
    simulated = run(*commands(tmp_path)["simulate"], "--effects", clear)
    assert "kWh with what was learned" in simulated.stdout
    assert "what was learned" not in run("route", *ENDS, *COLD).stdout


@pytest.mark.parametrize("options", [(), ("--pareto", "0.05")])
def test_comparison_without_effects_or_of_a_pareto_set_is_refused(open_file: Path, options: tuple[str, ...]) -> None:
    effects = ("--effects", open_file) if options else ()
    refused = run("route", *ENDS, "--compare", *options, *effects)
    assert (refused.exit_code, "allowed: with --effects, without --pareto" in refused.stderr) == (2, True)


def test_nothing_carried_is_said_and_nothing_compared(tmp_path: Path) -> None:
    nothing = file_of(tmp_path, learned_from={**OPEN_FROM, "not_carried": {"all": "they err by 9.0 % and by 8.0 %"}})
    shown = run("route", *ENDS, "--effects", nothing)
    assert shown.exit_code == 0, shown.output
    assert "nothing is carried by the effects" in shown.stderr
    assert "they err by 9.0 % and by 8.0 %" in " ".join(shown.stderr.split())
    assert "with what was learned" not in shown.stdout


def test_diagnosis_of_open_causes_says_that_routes_will_refuse_it_and_they_do(tmp_path: Path) -> None:
    table = write_totals(tmp_path / "totals.csv")
    found = run("diagnose", table, "--vehicle", OPEN_CAR, "--out", tmp_path / "out")
    assert found.exit_code == 0, found.output
    assert "with --apply-uncertain only" in found.stdout
    ends = ("--start", "46.5,8.003", "--goal", "46.518,8.02", "--soc", "0.4", "--vehicle", OPEN_CAR)
    refused = run("route", *ends, "--effects", tmp_path / "out" / "effects.json")
    assert refused.exit_code == 2
    assert "heating the cabin in the cold could as well be tyres that roll harder in the cold" in refused.stderr
    few = run("diagnose", write_totals(tmp_path / "few.csv", 4), "--vehicle", OPEN_CAR, "--out", tmp_path / "few")
    assert "nothing is carried to routes" in few.stdout
    warned = run("route", *ends, "--effects", tmp_path / "few" / "effects.json")
    assert (warned.exit_code, "too few drives to learn from" in " ".join(warned.stderr.split())) == (0, True)
