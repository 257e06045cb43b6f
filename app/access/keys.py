"""API keys: a file of their names, roles and hashes, and the keys that requests send."""

from __future__ import annotations

import hashlib
import hmac
import json
import logging
import os
import re
import secrets
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final

from app.access.errors import KeyFileError
from app.access.roles import Role

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

LOG: Final = logging.getLogger(__name__)
PREFIX: Final = "jp"
SECRET_BYTES: Final = 32  # so many that no slow hash is needed: there is nothing to guess
LOOK_EVERY_S: Final = 1.0
NAME_FORM: Final = "1 to 100 letters, digits, dots, hyphens and underscores"
_NAME: Final = re.compile(r"[A-Za-z0-9._-]{1,100}\Z")
_HEX: Final = re.compile(r"[0-9a-f]+\Z")


@dataclass(frozen=True, slots=True)
class ApiKey:
    """What is kept of a key; hash: SHA-256 of salt and secret. daily_quota: in units, None for that of all clients."""

    name: str
    role: Role
    id: str
    salt: str
    hash: str
    created: str
    daily_quota: int | None = None


_NOBODY: Final = ApiKey("", Role.READ, "", "00", "0" * 64, "")


class KeyRing:
    """The keys of a file, which is read again when it has changed.

    A file that is gone lets nobody in; one that can't be read leaves the keys as they were, and a line in the log.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._keys: Mapping[str, ApiKey] = {}
        self._state: tuple[int, int, int] | None = None
        self._looked_s = -LOOK_EVERY_S

    def known(self, sent: str) -> ApiKey | None:
        """What is kept of a key that was sent, None for one that is not known."""
        now = time.monotonic()
        if now - self._looked_s >= LOOK_EVERY_S:
            self._looked_s = now
            self._look()
        prefix, _, rest = sent.partition("_")
        key_id, _, secret = rest.partition("_")
        key = self._keys.get(key_id, _NOBODY)  # which is compared all the same, and takes as long
        same = hmac.compare_digest(_hash(key.salt, secret), key.hash)
        return key if same and prefix == PREFIX and key is not _NOBODY else None

    def _look(self) -> None:
        try:
            found = self.path.stat()
        except OSError:
            self._keys, self._state = {}, None
            return
        state = (found.st_ino, found.st_mtime_ns, found.st_size)
        if state == self._state:
            return
        self._state = state
        try:
            self._keys = {key.id: key for key in read_keys(self.path)}
        except KeyFileError as error:
            LOG.error("keys stay as they were: %s", error)


def read_keys(path: Path) -> list[ApiKey]:
    """The keys of a file, none where there is no file; raises KeyFileError."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return []
    except (OSError, UnicodeDecodeError) as error:
        raise _unreadable(path, str(error)) from error
    try:
        entries = json.loads(text)["keys"]
        keys = [_key(entry) for entry in entries]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise _unreadable(path, f"{type(error).__name__}: {error}") from error
    for what in ("id", "name"):
        values = [getattr(key, what) for key in keys]
        if len(set(values)) < len(values):
            raise _unreadable(path, f"an {what} stands in it twice")
    return keys


def add_key(path: Path, name: str, role: Role, daily_quota: int | None = None) -> str:
    """Store a new key under a name that no other has, and return it: it can't be had again. Raises KeyFileError."""
    if not _NAME.match(name):
        raise KeyFileError("NAME", name, NAME_FORM)
    secret, salt = secrets.token_urlsafe(SECRET_BYTES), secrets.token_hex(16)
    with _changing(path):
        keys = read_keys(path)
        if any(key.name == name for key in keys):
            raise KeyFileError("NAME", name, f"a name that no other key in {path} has")
        created = datetime.now(UTC).isoformat(timespec="seconds")
        new = ApiKey(name, role, secrets.token_hex(8), salt, _hash(salt, secret), created, daily_quota)
        _write(path, [*keys, new])
    return f"{PREFIX}_{new.id}_{secret}"


def remove_key(path: Path, name: str) -> None:
    """Remove the key of a name; raises KeyFileError."""
    with _changing(path):
        keys = read_keys(path)
        kept = [key for key in keys if key.name != name]
        if len(kept) == len(keys):
            raise KeyFileError("NAME", name, f"one of {', '.join(key.name for key in keys) or 'none'} in {path}")
        _write(path, kept)


def _hash(salt: str, secret: str) -> str:
    return hashlib.sha256(bytes.fromhex(salt) + secret.encode("utf-8", "replace")).hexdigest()


def _key(entry: Mapping[str, Any]) -> ApiKey:
    key = ApiKey(**entry)
    texts = (key.name, key.role, key.id, key.salt, key.hash, key.created)
    if not all(isinstance(text, str) for text in texts) or not _NAME.match(key.name):
        raise ValueError(f"name, role, id, salt, hash and created of {key.name!r} are not texts of their kind")
    if not (_HEX.match(key.id) and _HEX.match(key.salt) and _HEX.match(key.hash)) or len(key.hash) != 64:
        raise ValueError(f"id, salt or hash of {key.name!r} is not hexadecimal")
    if key.daily_quota is not None and (type(key.daily_quota) is not int or key.daily_quota < 1):
        raise ValueError(f"daily_quota of {key.name!r} is {key.daily_quota!r}, allowed: a whole number, at least 1")
    return replace(key, role=Role(key.role))


def _unreadable(path: Path, reason: str) -> KeyFileError:
    return KeyFileError("keys_file", str(path), "a file of `joulepath keys add`", message=f"keys in {path}: {reason}")


@contextmanager
def _changing(path: Path) -> Iterator[None]:
    """Hold off others that change the file."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = os.open(path.with_name(f"{path.name}.lock"), os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise _unreadable(path, str(error)) from error
    try:
        if sys.platform != "win32":
            import fcntl

            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def _write(path: Path, keys: Sequence[ApiKey]) -> None:
    """Put a whole new file in the place of the old one, readable by its owner."""
    text = json.dumps({"keys": [asdict(key) for key in keys]}, indent=1) + "\n"
    try:
        handle, name = tempfile.mkstemp(prefix=f"{path.name}.", dir=path.parent)
        try:
            with open(handle, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            os.replace(name, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(name)
            raise
    except OSError as error:
        raise _unreadable(path, str(error)) from error
