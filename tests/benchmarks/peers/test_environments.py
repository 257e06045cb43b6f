"""Which interpreter an engine gets, and what is said where it can't be had."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks.peers.environments import (
    DONE,
    PeerUnavailableError,
    Wanted,
    clean_environment,
    default_cache,
    environment,
    run_for,
    said_last,
)

ENGINE = Wanted("Engine", ("engine==1.2", "other"), least=(3, 12), most=(3, 13))


@pytest.mark.parametrize("found", [[], [(Path("python3.11"), (3, 11))], [(Path("python3.14"), (3, 14))]])
def test_no_interpreter_of_a_fitting_version_is_named_in_one_line(found, tmp_path) -> None:
    with pytest.raises(PeerUnavailableError) as raised:
        environment(ENGINE, tmp_path, found)
    assert str(raised.value) == "Engine left out: needs Python 3.12 to 3.13, and no such interpreter was found"


def test_an_environment_that_is_there_is_used_as_it_is(tmp_path) -> None:
    folder = tmp_path / "engine-1.2-python3.13"
    folder.mkdir()
    (folder / DONE).touch()
    found = [(tmp_path / "python3.11", (3, 11)), (tmp_path / "python3.13", (3, 13)), (tmp_path / "python3.12", (3, 12))]
    assert environment(ENGINE, tmp_path, found) == folder / "bin/python"
    assert sorted(path.name for path in folder.iterdir()) == [DONE]


def test_an_interpreter_that_is_not_there_leaves_nothing_half_made(tmp_path) -> None:
    missing = tmp_path / "nowhere/python3.12"
    for _ in range(2):
        with pytest.raises(PeerUnavailableError, match=r"Engine left out: .*nowhere/python3\.12"):
            environment(ENGINE, tmp_path / "cache", [(missing, (3, 12))])
    assert not (tmp_path / "cache/engine-1.2-python3.12" / DONE).exists()


def test_a_program_that_fails_is_named_with_its_last_error() -> None:
    script = (
        "import sys; print('ERROR: no wheel fits', file=sys.stderr); print('a notice', file=sys.stderr); sys.exit(1)"
    )
    with pytest.raises(PeerUnavailableError) as raised:
        run_for("Engine", [sys.executable, "-c", script])
    assert str(raised.value) == "Engine left out: ERROR: no wheel fits"


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ("one\ntwo\n\n", "two"),
        (
            "Traceback\n  ImportError: undefined symbol: __isoc23_strtol\nmore\n",
            "ImportError: undefined symbol: __isoc23_strtol",
        ),
        ("", "it failed without a word"),
    ],
)
def test_last_said_is_the_last_line_that_names_an_error(output, said) -> None:
    assert said_last(output) == said


def test_other_interpreters_do_not_see_this_ones_paths(monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", "/somewhere")
    monkeypatch.setenv("KEPT", "yes")
    found = clean_environment(MORE="also")
    assert "PYTHONPATH" not in found
    assert (found["KEPT"], found["MORE"]) == ("yes", "also")


def test_cache_lies_where_the_user_keeps_caches(monkeypatch, tmp_path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_cache() == tmp_path / "joulepath/peers"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # which the specification says to ignore
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert default_cache() == tmp_path / "home/.cache/joulepath/peers"
