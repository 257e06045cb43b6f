"""Databases of before maps and charts of diagnoses: migrated, read, and taken back."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING

import pytest

from app.store.database import Database
from app.store.diagnoses import DiagnosisDocuments, DiagnosisStore, NewDiagnosis, TripDocument, Turn
from tests.app.expected import check_problem, database_in
from tests.app.http.test_diagnoses import started
from tests.app.store.revisions import to_revision

if TYPE_CHECKING:
    from pathlib import Path

    from app.service.service import Service
    from app.settings import Settings

NOW = "2026-02-01 10:00:00.000000"
REQUEST = json.dumps({"vehicle": "vw-id4", "recordings": ["winter"]})
FOUND = {
    "verdict": "left_out_physics",
    "text": "Heating took 2 kWh. Tyres took 1 kWh.",
    "findings": [{"text": "Heating took 2 kWh."}, {"text": "Tyres took 1 kWh."}],
    "parameter_errors": [],
    "unexplained": [],
}
NOTHING = {**FOUND, "verdict": "nothing_missing", "text": "Nothing stands out.", "findings": []}


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """The folder of a database of revision 0002 with diagnoses: `found`, `nothing`, `damaged` and `failed`."""
    to_revision(database_in(tmp_path), "0002")
    rows = [
        ("found", "done", json.dumps(FOUND)),
        ("nothing", "done", json.dumps(NOTHING)),
        ("damaged", "done", "{"),
        ("failed", "failed", None),
    ]
    with closing(sqlite3.connect(tmp_path / "vehicles.sqlite")) as connection:
        connection.executemany(
            "INSERT INTO diagnoses (id, state, stage, progress_frac, worker, vehicle, request, result, report, created,"
            " updated) VALUES (?, ?, '', 1.0, 'host:1:a', 'vw-id4', ?, ?, '<p>', ?, ?)",
            [(name, state, REQUEST, result, NOW, NOW) for name, state, result in rows],
        )
        connection.commit()
    return tmp_path


def test_older_diagnoses_are_listed_with_their_verdict_and_first_sentence(
    settings: Settings, service: Service, old: Path
) -> None:
    with started(settings, service, old) as client:
        lines = {line["id"]: line for line in client.get("/diagnoses").json()["diagnoses"]}
    headlines = {name: (line["verdict"], line["text"]) for name, line in lines.items()}
    assert headlines == {
        "found": ("left_out_physics", "Heating took 2 kWh."),
        "nothing": ("nothing_missing", "Nothing stands out."),
        "damaged": (None, None),
        "failed": (None, None),
    }
    assert {line["recordings"] for line in lines.values()} == {None}


def test_older_diagnosis_is_shown_without_trips_and_residuals(settings: Settings, service: Service, old: Path) -> None:
    with started(settings, service, old) as client:
        shown = client.get("/diagnoses/found").json()
        assert (shown["result"], shown["warnings"]) == (FOUND, [])
        assert shown["request"]["graph"] is None
        assert client.get(shown["links"]["trips"]).json() == {"trips": []}
        assert client.get(shown["links"]["residuals"]).json()["features"] == []
        check_problem(client.get(f"{shown['links']['trips']}/winter-00"), 404, "unknown_trip")
        check_problem(client.get("/diagnoses/damaged"), 409, "diagnosis_damaged")


def test_migration_can_be_taken_back_and_made_again(settings: Settings, service: Service, old: Path) -> None:
    to_revision(database_in(old), "0003")
    to_revision(database_in(old), "0002", down=True)
    with started(settings, service, old) as client:
        assert client.get("/diagnoses/found").json()["verdict"] == "left_out_physics"


def test_verdict_of_another_version_is_not_shown(settings: Settings, service: Service, old: Path) -> None:
    with started(settings, service, old) as client:
        client.get("/diagnoses")
        with closing(sqlite3.connect(old / "vehicles.sqlite")) as connection:
            connection.execute("UPDATE diagnoses SET verdict = 'witchcraft' WHERE id = 'found'")
            connection.commit()
        lines = {line["id"]: line for line in client.get("/diagnoses").json()["diagnoses"]}
    assert lines["found"]["verdict"] is None


def test_removed_diagnosis_takes_its_trips_along_and_those_of_others_stay(tmp_path: Path) -> None:
    store = DiagnosisStore(Database(database_in(tmp_path)))
    for diagnosis_id in ("first", "second"):
        assert store.submit(NewDiagnosis(diagnosis_id, "host:1:run-a", "vw-id4", "{}", 2), 10)
        assert store.begin(diagnosis_id, "run") is Turn.NOW
        two = tuple(TripDocument("trip", f'"{diagnosis_id} {k}"', "{}") for k in range(2))
        assert store.finish(diagnosis_id, DiagnosisDocuments("{}", "", "{}", "[]", trips=two))
    assert store.trip_outlines("second") == ['"second 0"', '"second 1"']
    assert store.remove("first")
    assert (store.trip_outlines("first"), store.timeline("first", "trip")) == ([], None)
    assert store.timeline("second", "trip") == "{}"


def test_damaged_outline_of_a_trip_answers_409(settings: Settings, service: Service, old: Path) -> None:
    with started(settings, service, old) as client:
        client.get("/diagnoses")
        with closing(sqlite3.connect(old / "vehicles.sqlite")) as connection:
            connection.execute("INSERT INTO diagnosis_trips VALUES ('found', 0, 'a', '{', '{}')")
            connection.commit()
        check_problem(client.get("/diagnoses/found/trips"), 409, "diagnosis_damaged")
