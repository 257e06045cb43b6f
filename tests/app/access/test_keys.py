"""Keys: made once, kept as hashes, known at once and no longer than they stand in their file."""

from __future__ import annotations

import json
import stat
from typing import TYPE_CHECKING, Any

import pytest

from app.access import keys as module
from app.access.errors import KeyFileError
from app.access.keys import KeyRing, add_key, read_keys, remove_key
from app.access.roles import Role

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "below" / "keys.json"


@pytest.fixture(autouse=True)
def looks_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """No second of waiting between two looks at the file."""
    monkeypatch.setattr(module, "LOOK_EVERY_S", 0.0)


def test_key_that_was_made_is_known_with_its_role_and_no_other_is(file: Path) -> None:
    sent = add_key(file, "anna", Role.WRITE, 1000)
    ring = KeyRing(file)
    known = ring.known(sent)
    assert known is not None
    assert (known.name, known.role, known.daily_quota) == ("anna", Role.WRITE, 1000)
    prefix, key_id, secret = sent.split("_", 2)
    for wrong in (
        "",
        "_",
        secret,
        sent[:-1],
        sent + "x",
        sent.upper(),
        f"{prefix}_{key_id}_",
        f"{prefix}_{'0' * 16}_{secret}",
        f"xx_{key_id}_{secret}",
        "jp__",
        "é\ud800",
    ):
        assert ring.known(wrong) is None, wrong


def test_file_holds_no_key_and_nobody_else_may_read_it(file: Path) -> None:
    sent = add_key(file, "anna", Role.READ)
    text = file.read_text(encoding="utf-8")
    assert sent not in text
    assert sent.split("_", 2)[2] not in text
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_equal_secrets_would_have_different_hashes(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("secrets.token_urlsafe", lambda count: "the same")
    add_key(file, "anna", Role.READ)
    add_key(file, "bert", Role.READ)
    first, second = read_keys(file)
    assert first.hash != second.hash


def test_ring_follows_its_file(file: Path) -> None:
    ring = KeyRing(file)
    assert ring.known("jp_00_x") is None  # no file yet
    anna, bert = add_key(file, "anna", Role.READ), add_key(file, "bert", Role.ADMIN)
    assert ring.known(anna) is not None
    assert ring.known(bert) is not None
    remove_key(file, "anna")
    assert ring.known(anna) is None
    assert ring.known(bert) is not None
    file.write_text("{ damaged")
    assert ring.known(bert) is not None  # as it was
    file.unlink()
    assert ring.known(bert) is None


def test_name_is_taken_once_and_must_be_one(file: Path) -> None:
    add_key(file, "anna", Role.READ)
    for name in ("anna", "", "two words", "x" * 101, "a/b"):
        with pytest.raises(KeyFileError, match="allowed: "):
            add_key(file, name, Role.READ)
    with pytest.raises(KeyFileError, match="NAME is bert, allowed: one of anna"):
        remove_key(file, "bert")
    assert [key.name for key in read_keys(file)] == ["anna"]


@pytest.mark.parametrize(
    "change",
    [
        {"role": "owner"},
        {"hash": "00"},
        {"hash": 5},
        {"salt": "not hexadecimal"},
        {"id": ""},
        {"name": "two words"},
        {"daily_quota": 0},
        {"daily_quota": True},
        {"daily_quota": "many"},
        {"more": 1},
    ],
)
def test_file_with_an_entry_that_is_no_key_is_refused_by_name(file: Path, change: dict[str, Any]) -> None:
    add_key(file, "anna", Role.READ)
    stored = json.loads(file.read_text())
    stored["keys"][0] |= change
    file.write_text(json.dumps(stored))
    with pytest.raises(KeyFileError, match=r"keys in .*keys\.json: "):
        read_keys(file)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"keys": 5}', '{"keys": [5]}', "[" * 100_000])
def test_file_that_is_none_of_keys_is_refused(file: Path, text: str) -> None:
    file.parent.mkdir()
    file.write_text(text)
    with pytest.raises(KeyFileError, match="keys in "):
        read_keys(file)


def test_entry_that_stands_twice_is_refused(file: Path) -> None:
    add_key(file, "anna", Role.READ)
    stored = json.loads(file.read_text())
    file.write_text(json.dumps({"keys": stored["keys"] * 2}))
    with pytest.raises(KeyFileError, match="twice"):
        read_keys(file)
