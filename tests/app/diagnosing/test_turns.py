"""Which of several queued diagnoses may begin, of one and of several processes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from app.store.database import Database
from app.store.diagnoses import DiagnosisStore, NewDiagnosis, Turn
from tests.app.expected import database_in

if TYPE_CHECKING:
    from pathlib import Path

RUN, OTHER_RUN = "a1", "b2"


@pytest.fixture
def store(tmp_path: Path) -> DiagnosisStore:
    return DiagnosisStore(Database(database_in(tmp_path)))


def queue(store: DiagnosisStore, diagnosis_id: str, process: int, run: str = RUN) -> None:
    assert store.submit(NewDiagnosis(diagnosis_id, f"host:{process}:{run}-{process}", "car", "{}"), 8)


def test_one_diagnosis_of_a_run_runs_at_a_time_whichever_process_has_it(store: DiagnosisStore) -> None:
    queue(store, "first", 1)
    queue(store, "second", 2)
    assert store.begin("first", RUN) is Turn.NOW
    assert store.begin("second", RUN) is Turn.LATER
    assert store.fail("first", "{}")
    assert store.begin("second", RUN) is Turn.NOW


def test_diagnoses_begin_in_the_order_in_which_they_were_queued(store: DiagnosisStore) -> None:
    for k, diagnosis_id in enumerate(("c", "a", "b")):
        queue(store, diagnosis_id, k)
    assert [store.begin(diagnosis_id, RUN) for diagnosis_id in ("b", "a")] == [Turn.LATER, Turn.LATER]
    assert store.cancel("c")
    assert store.begin("b", RUN) is Turn.LATER
    assert store.begin("a", RUN) is Turn.NOW


def test_diagnosis_that_is_cancelled_or_gone_never_begins(store: DiagnosisStore) -> None:
    queue(store, "first", 1)
    assert store.cancel("first")
    assert store.begin("first", RUN) is Turn.NEVER
    assert store.begin("unheard-of", RUN) is Turn.NEVER


def test_runs_of_other_services_on_the_same_database_do_not_wait_for_each_other(store: DiagnosisStore) -> None:
    queue(store, "first", 1)
    queue(store, "second", 1, OTHER_RUN)
    assert store.begin("first", RUN) is Turn.NOW
    assert store.begin("second", OTHER_RUN) is Turn.NOW
