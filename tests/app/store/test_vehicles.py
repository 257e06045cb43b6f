"""The vehicle database: kept, shared, migrated, and what happens where it is damaged or out of reach."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from pydantic import ValidationError
from sqlalchemy import Engine, create_engine, event
from sqlalchemy.orm import Session
from starlette.testclient import TestClient

from app.main import create_app
from app.service.service import Service
from app.settings import Settings, default_database_url
from app.store import database as database_module
from app.store.database import Database, driver_url
from app.store.diagnoses import DiagnosisStore
from app.store.errors import ConflictError, DatabaseUnavailableError, StorageFullError
from app.store.presence import SUFFIX
from app.store.tables import Base
from app.store.vehicles import VehicleDocument, VehicleStore
from tests.app.expected import TABLE, VEHICLE, check_problem, database_in

if TYPE_CHECKING:
    from collections.abc import Iterator

CAR = VehicleDocument("my-car", "physical", "my car", '{"a": 1}')


def client_on(settings: Settings, service: Service, url: str) -> TestClient:
    """A client of an application of its own on a database, with graphs that are loaded already."""
    own = Service(settings.model_copy(update={"database_url": url}), {})
    own.atlas = service.atlas
    return TestClient(create_app(own.settings, own))


def run_sql(folder: Path, statement: str, *values: object) -> list[Any]:
    with closing(sqlite3.connect(folder / "vehicles.sqlite")) as connection:
        rows = connection.execute(statement, values).fetchall()
        connection.commit()
        return rows


def test_vehicle_is_there_after_a_restart(settings: Settings, service: Service, tmp_path: Path) -> None:
    with client_on(settings, service, database_in(tmp_path)) as first:
        stored = first.put("/vehicles/my-car", json=VEHICLE).json()
    with client_on(settings, service, database_in(tmp_path)) as second:
        assert second.get("/vehicles/my-car").json() == stored


def test_two_applications_on_one_file_see_each_others_changes_at_once(
    settings: Settings, service: Service, tmp_path: Path
) -> None:
    url = database_in(tmp_path)
    with client_on(settings, service, url) as first, client_on(settings, service, url) as other:
        for mass_kg in (1000, 1001, 1002):
            first.put("/vehicles/my-car", json=VEHICLE | {"mass_kg": mass_kg})
            assert other.get("/vehicles/my-car").json()["mass_kg"] == mass_kg
        assert other.delete("/vehicles/my-car").status_code == 204
        check_problem(first.get("/vehicles/my-car"), 404, "unknown_vehicle")
        check_problem(first.delete("/vehicles/my-car"), 404, "unknown_vehicle")


def test_put_keeps_when_a_vehicle_was_created_and_notes_when_it_changed(tmp_path: Path) -> None:
    store = VehicleStore(Database(database_in(tmp_path)))
    assert store.put(CAR) is True
    before = run_sql(tmp_path, "SELECT created, updated FROM vehicles")
    assert store.put(CAR) is False
    after = run_sql(tmp_path, "SELECT created, updated FROM vehicles")
    assert before[0][0] == after[0][0] == before[0][1] < after[0][1]
    assert store.find("my-car") == CAR


def test_put_that_another_process_overtakes_replaces_what_that_one_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # as PostgreSQL has it: found nothing to update, and then the other's row is in the way of the insert
    store = VehicleStore(Database(database_in(tmp_path)))
    attempts: list[int] = []
    put_once = VehicleStore._put

    def overtaken(self: VehicleStore, vehicle: VehicleDocument) -> bool:
        attempts.append(1)
        if len(attempts) == 1:
            put_once(self, VehicleDocument("my-car", "physical", "theirs", "{}"))
            raise ConflictError("a database", "duplicate key")
        return put_once(self, vehicle)

    monkeypatch.setattr(VehicleStore, "_put", overtaken)
    assert store.put(CAR) is False
    assert store.find("my-car") == CAR


def test_migration_from_nothing_makes_the_tables_that_the_code_describes(tmp_path: Path) -> None:
    database = Database(database_in(tmp_path))
    database.open()
    engine = create_engine(database_in(tmp_path))
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    engine.dispose()


def test_migration_of_a_database_of_vehicles_keeps_them_and_adds_diagnoses(tmp_path: Path) -> None:
    store = VehicleStore(Database(database_in(tmp_path)))
    store.put(CAR)
    for table in ("diagnoses", "learned_effects", "diagnosis_trips"):
        run_sql(tmp_path, f"DROP TABLE {table}")
    run_sql(tmp_path, "UPDATE alembic_version SET version_num = '0001'")
    later = Database(database_in(tmp_path))
    assert VehicleStore(later).find(CAR.id) == CAR
    assert DiagnosisStore(later).all() == []


def test_migration_of_a_database_that_is_up_to_date_changes_nothing(tmp_path: Path) -> None:
    VehicleStore(Database(database_in(tmp_path))).put(CAR)
    file = tmp_path / "vehicles.sqlite"
    before = file.read_bytes()
    again = Database(database_in(tmp_path))
    again.open()
    again.close()
    again.open()
    assert file.read_bytes() == before
    assert VehicleStore(again).find("my-car") == CAR


def test_processes_that_start_at_once_on_no_database_all_find_it_ready(tmp_path: Path) -> None:
    program = "import sys; from app.store.database import Database; Database(sys.argv[1]).open()"
    command = [sys.executable, "-c", program, database_in(tmp_path / "new")]
    root = Path(__file__).resolve().parents[3]
    started = [subprocess.Popen(command, cwd=root, stderr=subprocess.PIPE, text=True) for _ in range(4)]
    ended = [(process.communicate()[1], process.returncode) for process in started]
    assert ended == [("", 0)] * 4
    assert run_sql(tmp_path / "new", "SELECT version_num FROM alembic_version") == [("0003",)]


def test_threads_that_open_a_database_at_once_all_find_it_ready(tmp_path: Path) -> None:
    databases = [Database(database_in(tmp_path)) for _ in range(6)]
    with ThreadPoolExecutor(6) as pool:
        list(pool.map(lambda database: database.open(), databases))


def test_database_of_a_newer_version_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    VehicleStore(Database(database_in(tmp_path))).put(CAR)
    run_sql(tmp_path, "UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(DatabaseUnavailableError, match=r"another version of joulepath: .*9999"):
        Database(database_in(tmp_path)).open()
    assert run_sql(tmp_path, "SELECT id FROM vehicles") == [("my-car",)]


@pytest.mark.fault("database-gone", now="refused with 503 until it is put back; bundled vehicles go on")
@pytest.mark.parametrize("how", ["removed", "emptied", "without tables"])
@pytest.mark.parametrize("again", [False, True], ids=["while running", "after a restart"])
def test_database_that_is_gone_is_refused_until_it_is_back_or_given_up(tmp_path: Path, how: str, again: bool) -> None:
    file, marker = tmp_path / "vehicles.sqlite", tmp_path / f"vehicles.sqlite{SUFFIX}"
    store = VehicleStore(Database(database_in(tmp_path)))
    store.put(CAR)
    kept = file.read_bytes()
    file.unlink()
    if how == "emptied":
        file.touch()
    elif how == "without tables":
        with closing(sqlite3.connect(file)) as connection:
            connection.execute("CREATE TABLE other (id TEXT)")
    if again:
        store = VehicleStore(Database(database_in(tmp_path)))
    elif how == "without tables":
        with pytest.raises(DatabaseUnavailableError, match="no such table"):
            store.find("my-car")
    for _ in range(2):
        with pytest.raises(DatabaseUnavailableError, match=f"put it back from a backup, or remove .*{SUFFIX}"):
            store.find("my-car")
    file.write_bytes(kept)
    assert store.find("my-car") == CAR
    file.unlink()
    with pytest.raises(DatabaseUnavailableError, match="is missing or empty"):
        store.put(CAR)
    assert not file.exists()
    marker.unlink()
    assert store.find("my-car") is None
    assert store.put(CAR) is True


def test_database_of_before_markers_gets_one_at_its_first_use(tmp_path: Path) -> None:
    VehicleStore(Database(database_in(tmp_path))).put(CAR)
    marker = tmp_path / f"vehicles.sqlite{SUFFIX}"
    marker.unlink()
    assert VehicleStore(Database(database_in(tmp_path))).find("my-car") == CAR
    assert "vehicles.sqlite" in marker.read_text(encoding="utf-8")


def test_database_beside_which_no_marker_can_be_written_is_missed_by_the_process_that_used_it(tmp_path: Path) -> None:
    (tmp_path / f"vehicles.sqlite{SUFFIX}").symlink_to(tmp_path / "nowhere" / "marker")
    store = VehicleStore(Database(database_in(tmp_path)))
    store.put(CAR)
    (tmp_path / "vehicles.sqlite").unlink()
    with pytest.raises(DatabaseUnavailableError, match="is missing or empty"):
        store.find("my-car")


def test_database_that_was_named_and_had_to_be_made_is_warned_of(
    settings: Settings, service: Service, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for _ in range(2):
        with client_on(settings, service, database_in(tmp_path)) as client:
            client.get("/vehicles")
    warnings = [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]
    assert warnings == [
        f"the vehicle database {database_in(tmp_path).replace('sqlite:', 'sqlite+pysqlite:')} was empty,"
        " and its tables were made"
    ]


def test_database_that_nobody_named_is_made_without_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    Database(database_in(tmp_path)).open()
    assert not [record for record in caplog.records if record.levelname == "WARNING"]


def test_missing_database_is_not_made_where_that_is_set(settings: Settings, service: Service, tmp_path: Path) -> None:
    url = database_in(tmp_path / "volume")
    strict = settings.model_copy(update={"database_create": False})
    with client_on(strict, service, url) as client:
        problem = check_problem(client.put("/vehicles/my-car", json=VEHICLE), 503, "database_unavailable")
        assert "JOULEPATH_DATABASE_CREATE is false" in problem["detail"]
        assert "JOULEPATH_DATABASE_CREATE" in client.get("/readyz").json()["database"]["reason"]
    assert not (tmp_path / "volume").exists()
    VehicleStore(Database(url)).put(CAR)
    with client_on(strict, service, url) as client:
        assert client.put("/vehicles/other-car", json=VEHICLE).status_code == 201


@pytest.mark.parametrize(
    ("document", "reason"),
    [
        ("{", "not valid JSON"),
        ("", "not valid JSON"),
        ("[]", "an object that describes a vehicle"),
        ('{"kind": "physical"}', "mass_kg is missing"),
        ('{"kind": "steam"}', "kind is"),
        (b"\xff\xfe", "not valid JSON"),
        (7, "an object that describes a vehicle"),
    ],
)
def test_damaged_vehicle_is_named_and_leaves_the_others(
    settings: Settings, service: Service, tmp_path: Path, document: object, reason: str
) -> None:
    with client_on(settings, service, database_in(tmp_path)) as client:
        for vehicle_id, body in (("a-car", VEHICLE), ("b-car", VEHICLE), ("c-van", TABLE)):
            client.put(f"/vehicles/{vehicle_id}", json=body)
        run_sql(tmp_path, "UPDATE vehicles SET document = ?, updated = 'never' WHERE id = 'b-car'", document)
        listed = client.get("/vehicles").json()
        assert [line["id"] for line in listed["vehicles"] if not line["bundled"]] == ["a-car", "c-van"]
        assert len(listed["warnings"]) == 1
        assert "'b-car' can't be read" in listed["warnings"][0]
        assert reason in listed["warnings"][0]
        problem = check_problem(client.get("/vehicles/b-car"), 409, "vehicle_damaged")
        assert reason in problem["detail"]
        body = {"chain": [{"length_m": 100, "speed_limit_kmh": 50}], "vehicle": "b-car"}
        check_problem(client.post("/simulate", json=body), 409, "vehicle_damaged")
        assert client.get("/vehicles/a-car").status_code == 200
        assert client.put("/vehicles/b-car", json=VEHICLE).status_code == 200
        assert client.get("/vehicles").json()["warnings"] == []


def test_damaged_vehicle_can_be_removed(settings: Settings, service: Service, tmp_path: Path) -> None:
    with client_on(settings, service, database_in(tmp_path)) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
        run_sql(tmp_path, "UPDATE vehicles SET document = '{'")
        assert client.delete("/vehicles/my-car").status_code == 204


def test_stored_vehicle_of_a_bundled_id_stays_hidden(settings: Settings, service: Service, tmp_path: Path) -> None:
    VehicleStore(Database(database_in(tmp_path))).put(VehicleDocument("vw-id4", "physical", "mine", "{}"))
    with client_on(settings, service, database_in(tmp_path)) as client:
        listed = client.get("/vehicles").json()
        assert [line["bundled"] for line in listed["vehicles"] if line["id"] == "vw-id4"] == [True]
        assert listed["warnings"] == ["stored vehicle 'vw-id4' is hidden by the bundled one of this id"]


def unusable(folder: Path, how: str) -> str:
    """URL of a database that can't be used."""
    (folder / "file").write_text("in the way", encoding="utf-8")
    return {
        "folder that can't be made": f"sqlite:///{folder}/file/deeper/vehicles.sqlite",
        "folder in place of the file": f"sqlite:///{folder}",
        "file that is no database": f"sqlite:///{folder}/file",
        "server that is not there": "postgresql://someone:secret@127.0.0.1:1/vehicles",
    }[how]


@pytest.mark.parametrize(
    "how",
    [
        "folder that can't be made",
        "folder in place of the file",
        "file that is no database",
        "server that is not there",
    ],
)
def test_database_out_of_reach_answers_503_while_bundled_vehicles_work(
    settings: Settings, service: Service, tmp_path: Path, how: str
) -> None:
    (tmp_path / "file").write_text("x" * 5000, encoding="utf-8")
    with client_on(settings, service, unusable(tmp_path, how)) as client:
        listed = client.get("/vehicles").json()
        assert {line["bundled"] for line in listed["vehicles"]} == {True}
        (warning,) = listed["warnings"]
        assert warning.startswith("stored vehicles are missing: the vehicle database")
        assert "secret" not in warning
        for method, path in (("GET", "/vehicles/my-car"), ("DELETE", "/vehicles/my-car")):
            answer = client.request(method, path)
            problem = check_problem(answer, 503, "database_unavailable")
            assert answer.headers["retry-after"] == "5"
            assert "secret" not in problem["detail"]
        check_problem(client.put("/vehicles/my-car", json=VEHICLE), 503, "database_unavailable")
        assert client.get("/vehicles/vw-id4").status_code == 200


def test_service_starts_without_its_database_and_says_so(
    settings: Settings, service: Service, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    url = unusable(tmp_path, "folder that can't be made")
    own = Service(settings.model_copy(update={"database_url": url}))
    own.atlas = service.atlas
    own.load_all()
    assert "is not available: Not a directory" in caplog.text


@pytest.fixture
def read_only() -> Iterator[None]:
    """SQLite connections that refuse every change, as they do on a read-only disk."""

    def refuse_changes(connection: Any, _: Any) -> None:
        connection.execute("PRAGMA query_only = ON")

    event.listen(Engine, "connect", refuse_changes)
    yield
    event.remove(Engine, "connect", refuse_changes)


def test_read_only_database_answers_reads_and_503_to_changes(
    settings: Settings, service: Service, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    with client_on(settings, service, database_in(tmp_path)) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
    request.getfixturevalue("read_only")
    with client_on(settings, service, database_in(tmp_path)) as client:
        assert client.get("/vehicles/my-car").status_code == 200
        for answer in (client.put("/vehicles/my-car", json=VEHICLE), client.delete("/vehicles/my-car")):
            assert "readonly" in check_problem(answer, 503, "database_unavailable")["detail"]
        assert client.get("/vehicles/my-car").status_code == 200


def test_database_that_another_process_keeps_locked_answers_503_and_then_works(
    settings: Settings, service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(database_module, "WAIT_S", 0.05)
    with client_on(settings, service, database_in(tmp_path)) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
        with closing(sqlite3.connect(tmp_path / "vehicles.sqlite", isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            answer = client.put("/vehicles/my-car", json=VEHICLE)
            assert "locked" in check_problem(answer, 503, "database_unavailable")["detail"]
            other.execute("ROLLBACK")
        assert client.put("/vehicles/my-car", json=VEHICLE).status_code == 200


def test_failed_change_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = VehicleStore(Database(database_in(tmp_path)))
    store.put(CAR)

    def fail(self: Session) -> None:
        self.flush()
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Session, "commit", fail)
        with pytest.raises(StorageFullError, match="No space left"):
            store.remove("my-car")
    assert store.find("my-car") == CAR


@pytest.fixture
def full() -> Iterator[None]:
    """SQLite databases that may not grow, as they do on a full disk."""

    def keep_size(connection: Any, _: Any) -> None:
        connection.execute("PRAGMA max_page_count = 1")  # of what it has already, none is taken away

    event.listen(Engine, "connect", keep_size)
    yield
    event.remove(Engine, "connect", keep_size)


def test_full_disk_answers_507_to_changes_and_leaves_what_is_stored(
    settings: Settings, service: Service, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    with client_on(settings, service, database_in(tmp_path)) as client:
        client.put("/vehicles/my-car", json=VEHICLE)
    request.getfixturevalue("full")
    with client_on(settings, service, database_in(tmp_path)) as client:
        long = {**TABLE, "name": "x" * 180}
        answers = [client.put(f"/vehicles/car-{k}", json=long) for k in range(40)]
        refused = [answer for answer in answers if answer.status_code != 201]
        assert refused
        for answer in refused:
            assert "database or disk is full" in check_problem(answer, 507, "storage_full")["detail"]
        assert client.get("/vehicles/my-car").status_code == 200
        assert client.get("/readyz").json()["database"]["reachable"]


def test_full_disk_at_the_first_use_is_an_unavailable_database(
    settings: Settings, service: Service, tmp_path: Path, full: None
) -> None:
    with client_on(settings, service, database_in(tmp_path)) as client:
        check_problem(client.get("/vehicles/my-car"), 503, "database_unavailable")
        assert client.get("/vehicles").json()["warnings"]


@pytest.mark.parametrize(
    "error",
    [
        sqlite3.ProgrammingError("Cannot operate on a closed database."),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
        OverflowError("Python int too large to convert to SQLite INTEGER"),
        ImportError("no pq wrapper available"),
        PermissionError(13, "Permission denied", "/data/vehicles.sqlite"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_error_of_a_driver_that_is_not_wrapped_is_an_unavailable_database(
    settings: Settings, service: Service, tmp_path: Path, error: Exception
) -> None:
    def fail(connection: Any, _: Any) -> None:
        raise error

    with client_on(settings, service, database_in(tmp_path)) as client:
        event.listen(Engine, "connect", fail)
        try:
            for answer in (client.get("/vehicles/my-car"), client.put("/vehicles/my-car", json=VEHICLE)):
                assert check_problem(answer, 503, "database_unavailable")["detail"]
            assert not client.get("/readyz").json()["database"]["reachable"]
        finally:
            event.remove(Engine, "connect", fail)
        assert client.put("/vehicles/my-car", json=VEHICLE).status_code == 201


@pytest.mark.parametrize(
    ("url", "driver"),
    [
        ("sqlite:////srv/vehicles.sqlite", "sqlite+pysqlite"),
        ("postgresql://me@db/vehicles", "postgresql+psycopg"),
        ("postgres://me@db/vehicles", "postgresql+psycopg"),
        ("postgresql+psycopg://me@db/vehicles", "postgresql+psycopg"),
    ],
)
def test_database_url_gets_its_driver(url: str, driver: str) -> None:
    assert driver_url(url).drivername == driver


@pytest.mark.parametrize(
    "url",
    ["", "vehicles.sqlite", "sqlite://", "sqlite:///:memory:", "mysql://me:secret@db/x", "sqlite:///file:x?uri=true"],
)
def test_database_url_of_another_kind_is_refused_without_showing_it(url: str) -> None:
    with pytest.raises(ValidationError) as raised:
        Settings(database_url=url)
    (error,) = raised.value.errors()
    assert "sqlite:///PATH or postgresql://" in error["msg"]
    assert "secret" not in error["msg"]


def test_database_is_by_default_in_the_users_data_directory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", "/data/home")
    assert Settings().database_url == default_database_url() == "sqlite:////data/home/joulepath/vehicles.sqlite"
    for ignored in ("", "relative/path"):
        monkeypatch.setenv("XDG_DATA_HOME", ignored)
        monkeypatch.setenv("HOME", "/home/someone")
        assert default_database_url() == "sqlite:////home/someone/.local/share/joulepath/vehicles.sqlite"


def test_database_that_an_older_version_has_left_at_home_stays_in_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_DATA_HOME", raising=False)
    monkeypatch.setattr("app.settings.user_folder", lambda: tmp_path / "Library" / "joulepath")  # as on macOS
    older = tmp_path / ".local" / "share" / "joulepath" / "vehicles.sqlite"
    newer = tmp_path / "Library" / "joulepath" / "vehicles.sqlite"
    assert default_database_url() == f"sqlite:///{newer}"
    for file in (older, newer):
        file.parent.mkdir(parents=True)
        file.touch()
        assert default_database_url() == f"sqlite:///{file}"


def test_settings_do_not_print_the_database_url() -> None:
    assert "secret" not in repr(Settings(database_url="postgresql://me:secret@db/x"))
