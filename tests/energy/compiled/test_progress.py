"""What is said of kernels that are being compiled."""

from __future__ import annotations

import sys
from io import StringIO
from threading import Event
from typing import TYPE_CHECKING

import pytest

from energy.compiled import progress
from energy.compiled.progress import Compilation, Compilations, Display

if TYPE_CHECKING:
    from collections.abc import Callable


class Terminal(StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def swift(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "TICK_S", 0.001)
    monkeypatch.setattr(progress, "QUIET_S", 0.0)


@pytest.mark.nojit
@pytest.mark.usefixtures("swift")
def test_watcher_hears_of_the_innermost_kernel_and_of_the_rest_after_it() -> None:
    heard: list[Compilation | None] = []
    inner, rest = Event(), Event()

    def watcher(state: Compilation | None) -> None:
        heard.append(state)
        if state is None:
            rest.set()
        elif state.name == "inner":
            inner.set()

    work = Compilations()
    work.watch(watcher)
    work.begin("outer")
    work.begin("inner")
    assert inner.wait(10.0)
    work.end()
    work.end()
    assert rest.wait(10.0)
    assert work.state is not None
    assert work.state.done_count == 2
    assert work.state.name == ""
    assert heard[-1] is None


@pytest.mark.nojit
def test_where_nothing_was_compiled_there_is_nothing_to_say() -> None:
    work = Compilations()
    work.watch(None)
    assert work.state is None
    assert not work.watched


@pytest.mark.nojit
def test_output_that_is_no_terminal_gets_a_line_each_few_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    written, clock = StringIO(), iter((100.0, 101.0, 104.9, 105.1))
    monkeypatch.setattr(sys, "stderr", written)
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    display = Display()
    for done in range(4):
        display(Compilation(done, "search.run", 3.0 + done))
    display_lines = written.getvalue().splitlines()
    assert display_lines == [
        "compiling kernels, once for this version: 0 done, now search.run (3 s)",
        "compiling kernels, once for this version: 3 done, now search.run (6 s)",
    ]


@pytest.mark.nojit
def test_terminal_gets_one_line_that_is_wiped_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    written = Terminal()
    monkeypatch.setattr(sys, "stderr", written)
    monkeypatch.setenv("COLUMNS", "200")
    display = Display()
    for state in (Compilation(7, "", 2.0), None):
        display(state)
    assert written.getvalue() == "\rcompiling kernels, once for this version: 7 done (2 s)\x1b[K\r\x1b[K"


@pytest.mark.nojit
@pytest.mark.parametrize("closed", [True, False])
def test_error_output_that_is_closed_or_absent_ends_nothing(monkeypatch: pytest.MonkeyPatch, closed: bool) -> None:
    written = StringIO()
    written.close()
    monkeypatch.setattr(sys, "stderr", written if closed else None)
    show: Callable[[Compilation | None], None] = Display()
    show(Compilation(7, "", 2.0))
