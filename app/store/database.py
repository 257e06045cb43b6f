"""The database: opened and migrated when it is first needed, its faults named in one way."""

from __future__ import annotations

import errno
import logging
import sqlite3
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import Engine, NullPool, create_engine, event, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session

from app.store.errors import ConflictError, DatabaseUnavailableError, StorageFullError
from app.store.presence import Marker

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import URL, Connection

LOG: Final = logging.getLogger(__name__)
MIGRATIONS: Final = Path(__file__).parent / "migrations"
WAIT_S: Final = 5  # for a lock of SQLite, a connection of PostgreSQL
MIGRATION_LOCK: Final = 0x6A6F756C65  # "joule": key of PostgreSQL's advisory lock
FULL: Final = (errno.ENOSPC, errno.EDQUOT)
PRIMARY_CODE: Final = 0xFF  # of SQLite's extended codes
DISK_FULL: Final = "53100"  # of PostgreSQL
_BEGIN: Final = "sqlite_begin"

_migrating = Lock()  # alembic keeps its context in globals of the process


class Database:
    """One database; makes its folder, file and tables when it is first used, and never again.

    Nothing is kept between two uses but pooled connections, so that other processes' changes are seen at once.

    named: whether somebody has said that it is there, so that having to make it is a warning. create: whether it may be
    made at all.
    """

    def __init__(self, url: str, *, named: bool = False, create: bool = True) -> None:
        self.url: URL = driver_url(url)
        self._named = named
        self._create = create
        self._marker = Marker(Path(self.url.database or "")) if self.url.get_backend_name() == "sqlite" else None
        self._engine: Engine | None = None
        self._ready = False
        self._opening = Lock()

    @property
    def shown_url(self) -> str:
        """The URL without its password."""
        return self.url.render_as_string(hide_password=True)

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session that reads; raises DatabaseUnavailableError."""
        with self._session("DEFERRED") as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A session that is committed at the end; raises DatabaseUnavailableError, StorageFullError or ConflictError.

        On SQLite it holds the write lock from its start, since a lock that was only read can't always be raised.
        """
        with self._session("IMMEDIATE", changes=True) as session:
            yield session
            session.commit()

    def open(self) -> None:
        """Connect and bring the tables up to date; raises DatabaseUnavailableError."""
        with self._faults_named():
            self._opened()

    def check(self) -> None:
        """Read from it; raises DatabaseUnavailableError."""
        with self.reading() as session:
            session.execute(text("SELECT 1"))

    def close(self) -> None:
        """Close pooled connections; the next use opens them again."""
        with self._opening:
            if self._engine is not None:
                self._engine.dispose()
            self._engine, self._ready = None, False

    @contextmanager
    def _session(self, begin: str, *, changes: bool = False) -> Iterator[Session]:
        with self._faults_named(changes=changes):
            bound = self._opened().execution_options(**{_BEGIN: begin})
            with Session(bound) as session:
                yield session

    @contextmanager
    def _faults_named(self, *, changes: bool = False) -> Iterator[None]:
        """Within it, whatever a driver raises is a DatabaseUnavailableError; of a change, it says which."""
        try:
            yield
        except IntegrityError as error:
            raise ConflictError(self.shown_url, _reason(error)) from error
        except self._fault_kinds() as error:
            self._ready = False  # looked at anew next time: a file may have been removed
            kind = StorageFullError if changes and _is_full(error) else DatabaseUnavailableError
            raise kind(self.shown_url, _reason(error)) from error

    def _fault_kinds(self) -> tuple[type[Exception], ...]:
        """All that a database raises that does not work; drivers raise more than SQLAlchemy wraps."""
        engine = self._engine
        driver: tuple[type[Exception], ...] = () if engine is None else (engine.dialect.loaded_dbapi.Error,)
        return (SQLAlchemyError, OSError, ImportError, UnicodeError, OverflowError, sqlite3.Error, *driver)

    def _opened(self) -> Engine:
        with self._opening:
            if self._engine is None:
                self._engine = _engine(self.url)
            if self._marker is not None:
                self._check_present(self._marker)
            if not self._ready:
                expected = self._marker is not None and self._marker.is_expected
                if migrate(self._engine, self._refusal_of_empty(expected=expected)):
                    level = logging.WARNING if self._named else logging.INFO
                    LOG.log(level, "the vehicle database %s was empty, and its tables were made", self.shown_url)
                if self._marker is not None:
                    self._marker.note()
                else:
                    _warn_of_encoding(self._engine)
                self._ready = True
            return self._engine

    def _check_present(self, marker: Marker) -> None:
        """Refuse a file that is missing where it should not be, before SQLite makes an empty one."""
        expected = marker.is_expected  # asked first: it is noted after the file is made
        if not marker.is_missing:
            return
        self._ready = False
        reason = self._refusal_of_empty(expected=expected)
        if reason is not None:
            raise DatabaseUnavailableError(self.shown_url, f"the file {marker.file} is missing or empty; {reason}")
        marker.file.parent.mkdir(parents=True, exist_ok=True)

    def _refusal_of_empty(self, *, expected: bool) -> str | None:
        """Why a database without tables is not filled with them, or None where it is."""
        if expected and self._marker is not None:
            return f"put it back from a backup, or remove {self._marker.path} to begin with an empty one"
        return None if self._create else "JOULEPATH_DATABASE_CREATE is false, so that it is not made"


def driver_url(url: str) -> URL:
    """A database URL with the driver that is used for it; raises ValueError for one that is not supported."""
    try:
        parsed = make_url(url)
    except SQLAlchemyError as error:
        raise ValueError("not a URL") from error
    if parsed.drivername in ("postgres", "postgresql", "postgresql+psycopg"):
        return parsed.set(drivername="postgresql+psycopg")
    if parsed.drivername in ("sqlite", "sqlite+pysqlite"):
        if parsed.database in (None, "", ":memory:") or parsed.host or str(parsed.database).startswith("file:"):
            raise ValueError("SQLite without the path of a file")
        return parsed.set(drivername="sqlite+pysqlite")
    raise ValueError(f"unknown kind of database {parsed.drivername!r}")


def migrate(engine: Engine, refusal_of_empty: str | None = None) -> bool:
    """Bring the tables up to date; of several processes that try at once, one does it and the others wait.

    Whether there was none. A database that is up to date is not written to, so that it may be read only.

    refusal_of_empty: why tables are not made where there is none; None where they are. Raises DatabaseUnavailableError
    with it, and where a newer joulepath has changed the tables.
    """
    from alembic import command  # takes a while to import, and most commands need no database
    from alembic.config import Config
    from alembic.migration import MigrationContext
    from alembic.script import ScriptDirectory
    from alembic.util import CommandError

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    newest = ScriptDirectory.from_config(config).get_current_head()
    shown_url = engine.url.render_as_string(hide_password=True)
    with engine.connect() as connection:
        present = MigrationContext.configure(connection).get_current_revision()
    if present == newest:
        return False
    if present is None and refusal_of_empty is not None:
        raise DatabaseUnavailableError(shown_url, f"it has no tables; {refusal_of_empty}")
    with _migrating, engine.execution_options(**{_BEGIN: "IMMEDIATE"}).begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": MIGRATION_LOCK})
        config.attributes["connection"] = connection
        try:
            command.upgrade(config, "head")
        except CommandError as error:
            reason = f"its tables are of another version of joulepath: {error}"
            raise DatabaseUnavailableError(shown_url, reason) from error
    return present is None


def _engine(url: URL) -> Engine:
    if url.get_backend_name() == "postgresql":
        # UTF-8 on the way there and back whatever the server keeps: of SQL_ASCII, texts would come as bytes
        arguments = {"connect_timeout": WAIT_S, "client_encoding": "utf8"}
        return create_engine(url, pool_pre_ping=True, pool_timeout=WAIT_S, connect_args=arguments)
    # without a pool: a file that another process replaced is never held open
    engine = create_engine(url, poolclass=NullPool, connect_args={"timeout": WAIT_S})
    event.listen(engine, "connect", _leave_transactions_to_us)
    event.listen(engine, "begin", _begin)
    return engine


def _warn_of_encoding(engine: Engine) -> None:
    with engine.connect() as connection:
        encoding = connection.execute(text("SHOW server_encoding")).scalar_one()
    if encoding != "UTF8":
        shown_url = engine.url.render_as_string(hide_password=True)
        missing = "does not check texts" if encoding == "SQL_ASCII" else "can't hold every name"
        LOG.warning(
            "the vehicle database %s has the encoding %s and %s; make it with UTF8", shown_url, encoding, missing
        )


def _leave_transactions_to_us(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # sqlite3 of itself begins none before changes of tables
    connection.text_factory = _readable


def _readable(stored: bytes) -> str:
    return stored.decode("utf-8", "replace")  # damaged text of one row must not break reading the others


def _begin(connection: Connection) -> None:
    connection.exec_driver_sql(f"BEGIN {connection.get_execution_options().get(_BEGIN, 'DEFERRED')}")


def _is_full(error: Exception) -> bool:
    """Whether there is no space for what should be stored."""
    if isinstance(error, OSError):
        return error.errno in FULL
    original = getattr(error, "orig", None) or error
    code = getattr(original, "sqlite_errorcode", None)
    if code is not None:
        return bool(code & PRIMARY_CODE == sqlite3.SQLITE_FULL)
    return getattr(original, "sqlstate", None) == DISK_FULL


def _reason(error: Exception) -> str:
    if isinstance(error, ImportError):
        return f"{error}; PostgreSQL needs the package psycopg (pip install 'psycopg[binary]')"
    if isinstance(error, OSError):
        return f"{error.strerror or error}{f': {error.filename}' if error.filename else ''}"
    original = getattr(error, "orig", None)
    lines = str(original or error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
