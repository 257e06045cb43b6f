"""The database on PostgreSQL: migrated, shared between processes, in other encodings, gone and back."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import create_engine
from starlette.testclient import TestClient

from app.http.readiness import LIMIT_S
from app.main import create_app
from app.service.service import Service
from app.store.database import Database, driver_url
from app.store.diagnoses import DiagnosisDocuments, DiagnosisState, DiagnosisStore, NewDiagnosis, TripDocument, Turn
from app.store.errors import DatabaseUnavailableError
from app.store.tables import Base
from app.store.vehicles import VehicleDocument, VehicleStore
from tests.app.expected import TABLE, VEHICLE, check_problem
from tests.app.store.revisions import to_revision

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.settings import Settings
    from tests.app.store.postgresql_server import Server

ROOT = Path(__file__).resolve().parents[3]
NOW = "2026-02-01 10:00:00+00"


@contextmanager
def client_on(settings: Settings, service: Service, url: str, **changes: Any) -> Iterator[TestClient]:
    """A client of an application of its own on a database, with graphs that are loaded already."""
    own = Service(settings.model_copy(update={"database_url": url, **changes}), {})
    own.atlas = service.atlas
    with TestClient(create_app(own.settings, own)) as client:
        yield client
    own.close()


def test_migration_from_nothing_makes_the_tables_that_the_code_describes(postgresql: Server) -> None:
    url = postgresql.make_database("tables")
    database = Database(url)
    database.open()
    database.close()
    engine = create_engine(driver_url(url))
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    engine.dispose()


def test_migrations_keep_what_is_stored_on_the_way_up_and_down(postgresql: Server) -> None:
    url = postgresql.make_database("steps")
    to_revision(url, "0001")
    values = f"('my-car', 'physical', 'my car', '{{}}', '{NOW}', '{NOW}')"
    postgresql.run_sql("steps", f"INSERT INTO vehicles VALUES {values}")
    to_revision(url, "0002")
    result = json.dumps(
        {"verdict": "nothing_missing", "text": "Nothing.", "findings": [], "parameter_errors": [], "unexplained": []}
    )
    postgresql.run_sql(
        "steps",
        "INSERT INTO diagnoses (id, state, stage, progress_frac, worker, vehicle, request, result, created, updated)"
        f" VALUES ('found', 'done', '', 1, 'host:1:a', 'vw-id4', '{{}}', '{result}', '{NOW}', '{NOW}')",
    )
    database = Database(url)
    found = DiagnosisStore(database).find("found")
    assert found is not None
    assert (found.verdict, found.text) == ("nothing_missing", "Nothing.")
    database.close()
    to_revision(url, "0001", down=True)
    assert postgresql.run_sql("steps", "SELECT id FROM vehicles") == [("my-car",)]
    again = Database(url)
    assert DiagnosisStore(again).all() == []
    again.close()


def test_processes_that_start_at_once_on_no_tables_all_find_them_ready(postgresql: Server) -> None:
    url = postgresql.make_database("at_once")
    opens = f"from app.store.database import Database; Database({url!r}).open()"
    running = [subprocess.Popen([sys.executable, "-c", opens], cwd=ROOT, stderr=subprocess.PIPE) for _ in range(4)]
    for process in running:
        _, said = process.communicate(timeout=120)
        assert process.returncode == 0, said


def test_vehicles_are_stored_listed_replaced_and_removed(
    postgresql: Server, settings: Settings, service: Service
) -> None:
    url = postgresql.make_database("vehicles")
    with client_on(settings, service, url) as client:
        named = {**VEHICLE, "name": "Škoda 斯柯达 🚗 it's"}
        first = client.put("/vehicles/my-car", json=named)
        assert first.status_code == 201
        assert first.json()["name"] == named["name"]
        assert client.put("/vehicles/my-car", json={**TABLE, "name": "a table"}).status_code == 200
        assert client.put("/vehicles/a-car", json=VEHICLE).status_code == 201
        listed = [line for line in client.get("/vehicles").json()["vehicles"] if not line["bundled"]]
        assert [(line["id"], line["name"]) for line in listed] == [("a-car", "a-car"), ("my-car", "a table")]
        assert client.get("/readyz").json()["database"] == {"reachable": True, "reason": None}
        assert client.delete("/vehicles/my-car").status_code == 204
        check_problem(client.get("/vehicles/my-car"), 404, "unknown_vehicle")


@pytest.mark.parametrize("sent", ["a\u0000b", "é" * 50, "x" * 100, "'; DROP TABLE vehicles; --", "%00"])
def test_names_that_no_table_can_hold_are_unknown_not_a_fault(
    postgresql: Server, settings: Settings, service: Service, sent: str
) -> None:
    with client_on(settings, service, postgresql.make_database("odd")) as client:
        route = {"start": [8.003, 46.5], "goal": [8.02, 46.518], "soc": 0.5}
        check_problem(client.post("/route", json={**route, "effects": sent}), 404, "unknown_effects")
        check_problem(client.post("/route", json={**route, "vehicle": sent}), 404, "unknown_vehicle")
        for path in ("vehicles", "diagnoses"):
            answer = client.get(f"/{path}/{quote(sent, safe='')}")
            assert answer.status_code in (404, 422), answer.text


def test_changes_at_the_same_time_leave_one_of_them_whole(postgresql: Server) -> None:
    store = VehicleStore(Database(postgresql.make_database("raced")))

    def put(k: int) -> bool:
        return store.put(VehicleDocument("my-car", "physical", f"car {k}", json.dumps({"k": k})))

    with ThreadPoolExecutor(8) as threads:
        created = list(threads.map(put, range(40)))
    assert created.count(True) == 1
    kept = store.find("my-car")
    assert kept is not None
    assert kept.name == f"car {json.loads(kept.document)['k']}"
    store.database.close()


def test_diagnosis_goes_from_queued_to_done_with_all_that_it_leaves(postgresql: Server) -> None:
    store = DiagnosisStore(Database(postgresql.make_database("diagnoses")))
    assert store.submit(NewDiagnosis("20260301-0c9f2a7b1d4e", "host:1:run-a", "vw-id4", "{}", 3), 1)
    assert not store.submit(NewDiagnosis("20260301-0c9f2a7b1d4f", "host:1:run-a", "vw-id4", "{}", 3), 1)
    assert store.begin("20260301-0c9f2a7b1d4e", "run") is Turn.NOW
    store.advance("20260301-0c9f2a7b1d4e", "matching", 0.5)
    trips = (TripDocument("monday – ü", '{"a": 1}', "[1]"), TripDocument("monday – ü", "{}", "[2]"))
    documents = DiagnosisDocuments("{}", "<p>ü</p>", "{}", "[]", "nothing_missing", "Nothing.", "[]", "{}", trips)
    assert store.finish("20260301-0c9f2a7b1d4e", documents)
    found = store.find("20260301-0c9f2a7b1d4e")
    assert found is not None
    assert (found.state, found.verdict, found.recordings) == (DiagnosisState.DONE, "nothing_missing", 3)
    assert found.created.tzinfo is not None
    assert store.report("20260301-0c9f2a7b1d4e") == "<p>ü</p>"
    assert store.timeline("20260301-0c9f2a7b1d4e", "monday – ü") == "[1]"
    assert len(store.trip_outlines("20260301-0c9f2a7b1d4e")) == 2
    assert store.remove("20260301-0c9f2a7b1d4e")
    assert store.all() == []
    store.database.close()


@pytest.mark.fault("database-encoding", now="works, with a warning")
@pytest.mark.parametrize(("encoding", "doubt"), [("SQL_ASCII", "does not check texts"), ("LATIN1", "can't hold every")])
def test_database_of_another_encoding_works_and_is_warned_of(
    postgresql: Server,
    settings: Settings,
    service: Service,
    caplog: pytest.LogCaptureFixture,
    encoding: str,
    doubt: str,
) -> None:
    url = postgresql.make_database("encoded", encoding)
    with client_on(settings, service, url) as client:
        assert client.put("/vehicles/my-car", json={**VEHICLE, "name": "Citroën é"}).status_code == 201
        assert client.get("/vehicles/my-car").json()["name"] == "Citroën é"
    assert [record.getMessage() for record in caplog.records if encoding in record.getMessage()] == [
        f"the vehicle database postgresql+psycopg://joulepath:***@127.0.0.1:{postgresql.port}/encoded has the encoding"
        f" {encoding} and {doubt}{' name' if encoding == 'LATIN1' else ''}; make it with UTF8"
    ]


def test_text_of_an_sql_ascii_database_that_is_no_utf8_is_a_named_fault(
    postgresql: Server, settings: Settings, service: Service
) -> None:
    url = postgresql.make_database("broken", "SQL_ASCII")
    with client_on(settings, service, url) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
        postgresql.run_sql("broken", r"UPDATE vehicles SET name = E'\xff'")
        check_problem(client.get("/vehicles/my-car"), 503, "database_unavailable")
        assert client.get("/vehicles").json()["warnings"]


def test_server_that_goes_away_answers_503_and_works_when_it_is_back(
    postgresql: Server, settings: Settings, service: Service
) -> None:
    url = postgresql.make_database("away")
    with client_on(settings, service, url) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
        postgresql.stop()
        try:
            problem = check_problem(client.get("/vehicles/my-car"), 503, "database_unavailable")
            assert "secret" not in problem["detail"]
            check_problem(client.put("/vehicles/my-car", json=VEHICLE), 503, "database_unavailable")
            assert client.get("/vehicles").json()["warnings"]
        finally:
            postgresql.start()
        assert client.get("/vehicles/my-car").status_code == 200
        assert client.put("/vehicles/my-car", json=VEHICLE).status_code == 200


def test_server_that_takes_connections_and_says_nothing_holds_up_neither_health_nor_routes(
    postgresql: Server, settings: Settings, service: Service
) -> None:
    url = postgresql.make_database("silent")
    route = {"start": [8.003, 46.5], "goal": [8.02, 46.518], "soc": 0.5}
    with client_on(settings, service, url) as client:
        with postgresql.silent():
            for _ in range(3):
                began = time.monotonic()
                assert client.get("/readyz").json()["database"] == {
                    "reachable": False,
                    "reason": f"no answer within {LIMIT_S:g} s",
                }
                assert client.get("/healthz").status_code == 200
                assert client.post("/route", json=route).status_code == 200
                assert time.monotonic() - began < LIMIT_S + 3.0
            check_problem(client.get("/vehicles/my-car"), 503, "database_unavailable")
        until = time.monotonic() + 30.0
        while not (found := client.get("/readyz").json()["database"])["reachable"]:
            assert time.monotonic() < until, found
            time.sleep(0.1)


def test_full_disk_of_the_server_answers_507(postgresql: Server, settings: Settings, service: Service) -> None:
    url = postgresql.make_database("full_disk")
    with client_on(settings, service, url) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
        # the code that the server sends when it can't extend a file
        raises = "BEGIN RAISE EXCEPTION USING ERRCODE = 'disk_full', MESSAGE = 'could not extend file'; END"
        postgresql.run_sql("full_disk", f"CREATE FUNCTION fail() RETURNS trigger LANGUAGE plpgsql AS $$ {raises} $$")
        trigger = "CREATE TRIGGER full_disk BEFORE INSERT OR UPDATE ON vehicles FOR EACH ROW EXECUTE FUNCTION fail()"
        postgresql.run_sql("full_disk", trigger)
        problem = check_problem(client.put("/vehicles/other", json=VEHICLE), 507, "storage_full")
        assert "could not extend file" in problem["detail"]
        assert client.get("/vehicles/my-car").status_code == 200


def test_read_only_server_answers_reads_and_503_to_changes(
    postgresql: Server, settings: Settings, service: Service
) -> None:
    url = postgresql.make_database("standby")
    with client_on(settings, service, url) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
    postgresql.run_sql("postgres", "ALTER DATABASE standby SET default_transaction_read_only = on")
    with client_on(settings, service, url) as client:
        assert client.get("/readyz").json()["database"]["reachable"]
        problem = check_problem(client.put("/vehicles/other", json=VEHICLE), 503, "database_unavailable")
        assert "read-only transaction" in problem["detail"]


def test_database_without_tables_is_warned_of_or_refused(
    postgresql: Server, settings: Settings, service: Service, caplog: pytest.LogCaptureFixture
) -> None:
    url = postgresql.make_database("empty")
    with client_on(settings, service, url, database_create=False) as client:
        problem = check_problem(client.get("/vehicles/my-car"), 503, "database_unavailable")
        assert "it has no tables; JOULEPATH_DATABASE_CREATE is false" in problem["detail"]
    assert postgresql.run_sql("empty", "SELECT count(*) FROM pg_tables WHERE schemaname = 'public'") == [(0,)]
    caplog.clear()
    with client_on(settings, service, url) as client:
        check_problem(client.get("/vehicles/my-car"), 404, "unknown_vehicle")
    assert [record.levelname for record in caplog.records if "was empty" in record.getMessage()] == ["WARNING"]


def test_database_that_the_server_does_not_have_is_named(postgresql: Server) -> None:
    with pytest.raises(DatabaseUnavailableError, match='database "nowhere" does not exist'):
        Database(postgresql.url("nowhere")).open()
