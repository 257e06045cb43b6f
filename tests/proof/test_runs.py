"""A proof from end to end in processes of Dask, taken up again, and refused where it must not be believed."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import distributed
import pytest

from proof.answers import read_answer, write_answer
from proof.errors import BrokenSealError, ProofError
from proof.plans import small_plan
from proof.runs import ANSWERS, MAKING, ProofOrder, prove
from proof.sealed import LABELS, SEALED_FILE, WORLDS, read_seal
from proof.tool import answered
from proof.worlds.orders import WorldOrder
from proof.worlds.trips import WorldRegime
from proof.worlds.world import WorldKind

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

FEW = WorldOrder(WorldKind.FEW_TRIPS, trips=(2, 2), regime=WorldRegime(minutes=(3.0, 4.0)))


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler with one worker, so that each run need not begin its own."""
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster.scheduler_address


@pytest.fixture
def done(tmp_path: Path, address: str) -> ProofOrder:
    """A proof that was carried out, of two worlds of two short drives, which the tool says at once are too few."""
    order = ProofOrder("few", (FEW, FEW), 7, tmp_path / "proof", scheduler=address)
    assert prove(order).worlds == 2
    return order


def test_the_small_plan_is_proved_from_end_to_end(tmp_path: Path) -> None:
    stages: dict[str, float] = {}
    proof = prove(ProofOrder("small", small_plan(), 12, tmp_path, processes=2), stages.__setitem__)
    named = {(figure.group, figure.name): figure for figure in proof.figures}
    assert (proof.worlds, proof.unmade, proof.hidden) == (13, 0, None)
    assert named["all worlds", "the tool broke"].successes == 0
    assert named["nothing left out", "a false finding"].successes == 0
    assert named["recall", "one effect of 12 %: named or among rivals"].successes == 2
    assert named["few trips", "says too few, concludes nothing"].met is None
    assert named["few trips", "says too few, concludes nothing"].value == 1.0
    assert [line.rule for line in proof.compared[-2:]] == ["joulepath", "oracle"]
    assert all(done == 1.0 for done in stages.values())
    assert next(iter(stages)) == MAKING


def test_a_proof_is_taken_up_where_it_was_left(done: ProofOrder) -> None:
    files = sorted((done.folder / ANSWERS).iterdir())
    kept, lost = files[0].stat().st_mtime_ns, files[1].read_bytes()
    files[1].unlink()
    again = prove(done)
    assert files[0].stat().st_mtime_ns == kept
    assert read_answer(files[1]).verdict == json.loads(lost)["verdict"] == "too_few_trips"
    assert again.worlds == 2


def test_answers_of_an_older_tool_are_asked_anew(done: ProofOrder) -> None:
    file = sorted((done.folder / ANSWERS).iterdir())[0]
    before = read_answer(file)
    write_answer(replace(before, tool="older", verdict="nothing_missing"), file)
    prove(done)
    assert (read_answer(file).tool, read_answer(file).verdict) == (before.tool, "too_few_trips")


def test_a_label_changed_after_sealing_stops_the_proof(done: ProofOrder) -> None:
    file = sorted((done.folder / LABELS).glob("*/label.json"))[0]
    file.write_text(file.read_text(encoding="utf-8").replace("few_trips", "null"), encoding="utf-8")
    with pytest.raises(BrokenSealError, match=f"label of world '{file.parent.name}' is changed"):
        prove(done)


def test_another_seed_needs_another_folder(done: ProofOrder) -> None:
    with pytest.raises(ProofError, match="a proof of another plan or seed"):
        prove(replace(done, seed=8))
    assert read_seal(done.folder) is not None


def test_worlds_of_an_unsealed_run_are_kept(done: ProofOrder) -> None:
    worlds = {path.name: path.stat().st_mtime_ns for path in (done.folder / WORLDS).iterdir()}
    (done.folder / SEALED_FILE).unlink()
    prove(done)
    assert {path.name: path.stat().st_mtime_ns for path in (done.folder / WORLDS).iterdir()} == worlds


def test_a_world_on_which_the_tool_breaks_is_answered_with_what_broke(tmp_path: Path) -> None:
    (tmp_path / "w1").mkdir()
    assert answered(tmp_path / "w1", tmp_path / "w1.json", rules=True) == "w1"
    broke = read_answer(tmp_path / "w1.json")
    assert broke.error is not None
    assert "vehicle.toml" in broke.error
    assert (broke.verdict, broke.claims, broke.trips) == ("", (), ())


def test_an_address_at_which_nothing_runs_is_named(tmp_path: Path) -> None:
    order = ProofOrder("few", (FEW,), 7, tmp_path, scheduler="nowhere://1")
    with pytest.raises(ProofError, match="--scheduler is 'nowhere://1'"):
        prove(order)
