"""A PostgreSQL server that tests start and stop themselves, of the programs that lie on the machine."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import psycopg
import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

VARIABLE: Final = "JOULEPATH_POSTGRESQL_BIN"
OWNER: Final = "joulepath"
START_S: Final = 60.0
UNPRIVILEGED: Final = ("postgres", "nobody")  # PostgreSQL does not run as root


class NoServerError(Exception):
    """There are no programs of a PostgreSQL server."""

    def __init__(self) -> None:
        super().__init__(
            "there is no PostgreSQL server: install it (Debian: apt install postgresql; `make postgresql` does where "
            f"root asks) or name the folder of its programs: {VARIABLE}=/path/to/bin"
        )


def programs() -> Path:
    """The folder of a server's programs; raises NoServerError."""
    named = os.environ.get(VARIABLE)
    if named:
        return Path(named)
    found = shutil.which("initdb")
    if found:
        return Path(found).resolve().parent
    debian = Path("/usr/lib/postgresql").glob("*/bin/initdb")
    newest = max(debian, key=lambda path: int(path.parts[-3]) if path.parts[-3].isdigit() else 0, default=None)
    if newest is None:
        raise NoServerError
    return newest.parent


class Server:
    """One cluster in a folder of its own, listening on a port of 127.0.0.1; root runs it as somebody else."""

    def __init__(self) -> None:
        self._programs = programs()
        self._folder = Path(tempfile.mkdtemp(prefix="joulepath-postgresql-"))
        self._process: subprocess.Popen[bytes] | None = None
        self._as_user: dict[str, Any] = {}
        if os.geteuid() == 0:
            user = next(entry for name in UNPRIVILEGED if (entry := _entry(name)) is not None)
            self._as_user = {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
            os.chown(self._folder, user.pw_uid, user.pw_gid)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port: int = probe.getsockname()[1]
        # not waiting for the disk: a cluster that lives as long as the tests need not survive a power cut
        options = ("--auth=trust", f"--username={OWNER}", "--encoding=UTF8", "--locale=C", "--no-sync")
        self._run("initdb", f"--pgdata={self._data}", *options)

    @property
    def _data(self) -> Path:
        return self._folder / "data"

    def url(self, database: str) -> str:
        """URL of one of its databases."""
        return f"postgresql://{OWNER}:secret@127.0.0.1:{self.port}/{database}"

    def start(self) -> None:
        """Have it answer."""
        settings = {"listen_addresses": "127.0.0.1", "unix_socket_directories": "", "fsync": "off"}
        options = [part for name, value in settings.items() for part in ("-c", f"{name}={value}")]
        command = [str(self._programs / "postgres"), "-D", str(self._data), "-p", str(self.port), *options]
        with (self._folder / "log").open("ab") as log:
            self._process = subprocess.Popen(command, cwd=self._folder, stdout=log, stderr=log, **self._as_user)
        until = time.monotonic() + START_S
        while True:
            try:
                self.run_sql("postgres", "SELECT 1")
                return
            except psycopg.OperationalError:
                if self._process.poll() is not None or time.monotonic() > until:
                    raise RuntimeError((self._folder / "log").read_text(encoding="utf-8")) from None
                time.sleep(0.05)

    @contextmanager
    def silent(self) -> Iterator[None]:
        """Within it, new connections are taken and never answered."""
        assert self._process is not None
        self._process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self._process.send_signal(signal.SIGCONT)

    def stop(self) -> None:
        """Have it end at once, with its connections."""
        if self._process is not None:
            self._process.send_signal(signal.SIGINT)  # its fast shutdown
            self._process.wait(START_S)
            self._process = None

    def remove(self) -> None:
        """Stop it and remove what it kept."""
        self.stop()
        shutil.rmtree(self._folder, ignore_errors=True)

    def run_sql(self, database: str, statement: str) -> list[tuple[Any, ...]]:
        """What a statement returns."""
        with psycopg.connect(self.url(database), autocommit=True) as connection:
            cursor = connection.execute(statement.encode())
            return cursor.fetchall() if cursor.description else []

    def make_database(self, name: str, encoding: str = "UTF8") -> str:
        """Make an empty database, in place of one of this name; its URL."""
        self.run_sql("postgres", f"DROP DATABASE IF EXISTS {name} WITH (FORCE)")
        self.run_sql("postgres", f"CREATE DATABASE {name} ENCODING '{encoding}' TEMPLATE template0")
        return self.url(name)

    def _run(self, program: str, *arguments: str) -> None:
        command = [str(self._programs / program), *arguments]
        subprocess.run(command, cwd=self._folder, check=True, capture_output=True, **self._as_user)


@contextmanager
def running_server() -> Iterator[Server]:
    """A server of a new cluster; skips the test where the machine has none, except in CI, where it fails."""
    try:
        server = Server()
    except NoServerError as error:
        if os.environ.get("CI"):
            pytest.fail(f"{error}. CI must have it")
        pytest.skip(str(error))
    try:
        server.start()
        yield server
    finally:
        server.remove()


def _entry(name: str) -> pwd.struct_passwd | None:
    with suppress(KeyError):
        return pwd.getpwnam(name)
    return None
