"""The database: opened and migrated when it is first needed, its faults named in one way."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import Engine, NullPool, create_engine, event, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import IntegrityError, SQLAlchemyError
from sqlalchemy.orm import Session

from app.store.errors import DatabaseUnavailableError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import URL, Connection

MIGRATIONS: Final = Path(__file__).parent / "migrations"
WAIT_S: Final = 5  # for a lock of SQLite, a connection of PostgreSQL
MIGRATION_LOCK: Final = 0x6A6F756C65  # "joule": key of PostgreSQL's advisory lock
_BEGIN: Final = "sqlite_begin"

_migrating = Lock()  # alembic keeps its context in globals of the process


class Database:
    """One database; makes its folder, file and tables when it is first used, and again when they are gone.

    Nothing is kept between two uses but pooled connections, so that other processes' changes are seen at once.
    """

    def __init__(self, url: str) -> None:
        self.url: URL = driver_url(url)
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
        """A session that is committed at the end; raises DatabaseUnavailableError.

        On SQLite it holds the write lock from its start, since a lock that was only read can't always be raised.
        """
        with self._session("IMMEDIATE") as session:
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
    def _session(self, begin: str) -> Iterator[Session]:
        with self._faults_named():
            bound = self._opened().execution_options(**{_BEGIN: begin})
            with Session(bound) as session:
                yield session

    @contextmanager
    def _faults_named(self) -> Iterator[None]:
        try:
            yield
        except IntegrityError:
            raise  # the database works; a caller knows what it means
        except (SQLAlchemyError, OSError, ModuleNotFoundError) as error:
            self._ready = False  # looked at anew next time: a file may have been removed
            raise DatabaseUnavailableError(self.shown_url, _reason(error)) from error

    def _opened(self) -> Engine:
        with self._opening:
            if self._engine is None:
                self._engine = _engine(self.url)
            if not self._ready:
                if self.url.get_backend_name() == "sqlite":
                    Path(self.url.database or "").parent.mkdir(parents=True, exist_ok=True)
                migrate(self._engine)
                self._ready = True
            return self._engine


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


def migrate(engine: Engine) -> None:
    """Bring the tables up to date; of several processes that try at once, one does it and the others wait.

    A database that is up to date is not written to, so that it may be read only. Raises DatabaseUnavailableError
    where a newer joulepath has changed the tables.
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
    with engine.connect() as connection:
        if MigrationContext.configure(connection).get_current_revision() == newest:
            return
    with _migrating, engine.execution_options(**{_BEGIN: "IMMEDIATE"}).begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": MIGRATION_LOCK})
        config.attributes["connection"] = connection
        try:
            command.upgrade(config, "head")
        except CommandError as error:
            reason = f"its tables are of another version of joulepath: {error}"
            raise DatabaseUnavailableError(engine.url.render_as_string(hide_password=True), reason) from error


def _engine(url: URL) -> Engine:
    if url.get_backend_name() == "postgresql":
        return create_engine(url, pool_pre_ping=True, pool_timeout=WAIT_S, connect_args={"connect_timeout": WAIT_S})
    # without a pool: a file that another process replaced is never held open
    engine = create_engine(url, poolclass=NullPool, connect_args={"timeout": WAIT_S})
    event.listen(engine, "connect", _leave_transactions_to_us)
    event.listen(engine, "begin", _begin)
    return engine


def _leave_transactions_to_us(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # sqlite3 of itself begins none before changes of tables
    connection.text_factory = _readable


def _readable(stored: bytes) -> str:
    return stored.decode("utf-8", "replace")  # damaged text of one row must not break reading the others


def _begin(connection: Connection) -> None:
    connection.exec_driver_sql(f"BEGIN {connection.get_execution_options().get(_BEGIN, 'DEFERRED')}")


def _reason(error: Exception) -> str:
    if isinstance(error, ModuleNotFoundError):
        return f"{error}; PostgreSQL needs the package psycopg (pip install 'psycopg[binary]')"
    if isinstance(error, OSError):
        return f"{error.strerror or error}{f': {error.filename}' if error.filename else ''}"
    original = getattr(error, "orig", None)
    lines = str(original or error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
