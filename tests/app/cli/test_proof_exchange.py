"""Worlds for other tools: exported with a page, scored by the same rules, answers of the wrong form refused by name."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from app.cli.proof_exchange import HELD_OUT_FILE, PAGE_FILE, export, given, score
from diagnosis.engine import diagnose
from proof.answers import answer_of
from proof.errors import ProofError
from proof.runs import ProofOrder
from proof.sealed import LABELS, WORLDS
from proof.tool import read
from proof.worlds.orders import WorldOrder, single
from proof.worlds.trips import WorldRegime
from proof.worlds.world import WorldKind

SHORT = WorldRegime(minutes=(8.0, 11.0))
PLAN = (WorldOrder(WorldKind.NULL, (), (14, 14), SHORT), single("cabin_heating", 0.12, minutes=(8.0, 11.0)))


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exported")
    export(ProofOrder("two", PLAN, 4, folder, processes=1), lambda _stage, _done: None)
    return folder


def test_the_page_and_the_held_out_trips_are_there_and_name_no_truth(exported: Path) -> None:
    page = (exported / PAGE_FILE).read_text(encoding="utf-8")
    held_out = json.loads((exported / HELD_OUT_FILE).read_text(encoding="utf-8"))
    assert "2 folders" in page
    assert set(held_out) == {path.name for path in (exported / WORLDS).iterdir()}
    for world, trips in held_out.items():
        assert frozenset(trips) == read(exported / WORLDS / world)[2]
        assert {path.suffix for path in (exported / WORLDS / world).iterdir()} == {".csv", ".toml"}


def test_our_own_answers_are_scored_as_anybodys(exported: Path, tmp_path: Path) -> None:
    for world in (exported / WORLDS).iterdir():
        recordings, vehicle, held_out = read(world)
        answer = answer_of(world.name, "", diagnose(recordings, vehicle, held_out=held_out), (), 0.0)
        (tmp_path / f"{world.name}.json").write_text(json.dumps(asdict(answer)), encoding="utf-8")
        assert given(world.name, tmp_path / f"{world.name}.json").claims == answer.claims
    named = {(figure.group, figure.name): figure for figure in score(exported, tmp_path)}
    assert named["nothing left out", "a false finding"].successes == 0
    assert named["recall", "one effect of 12 %: named clearly"].successes == 1
    assert named["all worlds", "the tool broke"].successes == 0


def test_a_world_without_an_answer_counts_as_broken(exported: Path, tmp_path: Path) -> None:
    named = {(figure.group, figure.name): figure for figure in score(exported, tmp_path)}
    assert named["all worlds", "the tool broke"].value == 1.0
    assert named["nothing left out", "a false finding"].value == 1.0


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("{", "JSONDecodeError"),
        ("[]", "AttributeError"),
        ("{}", "'trips'"),
        ('{"trips": [{"id": "T1"}]}', "'after_kwh'"),
        ('{"trips": [], "claims": [{"family": "thermal"}]}', "'energy_kwh'"),
        ('{"trips": [], "capacity_frac": [0.9]}', "ValueError"),
    ],
)
def test_an_answer_of_another_form_is_refused_by_file_and_key(tmp_path: Path, text: str, what: str) -> None:
    file = tmp_path / "w1.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ProofError, match=f"w1.json.*{what}"):
        given("w1", file)


def test_a_folder_without_sealed_worlds_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProofError, match="a folder that --export has filled"):
        score(tmp_path, tmp_path)
    assert not (tmp_path / LABELS).exists()
