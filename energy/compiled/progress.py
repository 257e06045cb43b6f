"""What is being compiled, told to whoever watches: the first compilation takes long and would else look like a hang.

This module imports no numba, so that a command can watch before it knows whether anything is to be compiled.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import time
from dataclasses import dataclass
from threading import Event, RLock, Thread
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

QUIET_S: Final = 1.0  # so long nothing is said, since most of what is compiled so fast needs no word
TICK_S: Final = 0.5
LINE_S: Final = 5.0  # between two lines on an output that is no terminal


@dataclass(frozen=True, slots=True)
class Compilation:
    """How far compiling is. done_count: kernels that are compiled; name: of the one in work, "" between two of them."""

    done_count: int
    name: str
    seconds: float

    @property
    def text(self) -> str:
        """One line that says so."""
        now = f", now {self.name}" if self.name else ""
        return f"compiling kernels, once for this version: {self.done_count} done{now} ({self.seconds:.0f} s)"


class Compilations:
    """The kernels of this process that had to be compiled; told to one watcher, from any thread."""

    def __init__(self) -> None:
        self._lock = RLock()
        self._watcher: Callable[[Compilation | None], None] | None = None
        self._names: list[str] = []  # in work, each called by the one before it
        self._done = 0
        self._begin_s: float | None = None
        self._idle = Event()

    @property
    def state(self) -> Compilation | None:
        """How far compiling is; None where nothing had to be compiled."""
        with self._lock:
            if self._begin_s is None:
                return None
            name = self._names[-1] if self._names else ""
            return Compilation(self._done, name, time.monotonic() - self._begin_s)

    @property
    def watched(self) -> bool:
        """Whether somebody is told."""
        return self._watcher is not None

    def watch(self, watcher: Callable[[Compilation | None], None] | None) -> None:
        """Tell a watcher what is compiled from now on, and None when it rests; in place of the watcher before it."""
        with self._lock:
            self._watcher, self._done, self._begin_s = watcher, 0, None

    def begin(self, name: str) -> None:
        """A kernel is being compiled."""
        with self._lock:
            if self._begin_s is None:
                self._begin_s = time.monotonic()
            self._names.append(name)
            if len(self._names) == 1 and self._watcher is not None:
                self._idle.clear()
                Thread(target=self._tell, name="joulepath-compilation", daemon=True).start()

    def end(self) -> None:
        """The kernel that was begun last is compiled, or can't be."""
        with self._lock:
            self._names.pop()
            self._done += 1
            if not self._names:
                self._idle.set()

    def _tell(self) -> None:
        """Tell the watcher at each tick until nothing is being compiled, and then that it rests."""
        said = False
        while not self._idle.wait(TICK_S):
            state, watcher = self.state, self._watcher
            if state is not None and watcher is not None and state.seconds >= QUIET_S:
                watcher(state)
                said = True
        if said and self._watcher is not None:
            self._watcher(None)


class Display:
    """A watcher that writes to the error output: on a terminal one line that changes, else a line each few seconds."""

    def __init__(self) -> None:
        self._last_s = -LINE_S

    def __call__(self, state: Compilation | None) -> None:
        """Say how far compiling is, and nothing more once it rests."""
        if sys.stderr is not None:  # as where there is no console
            with contextlib.suppress(OSError, ValueError):  # an output that was closed must not end the compilation
                self._show(state)

    def _show(self, state: Compilation | None) -> None:
        if sys.stderr.isatty() and not hasattr(sys.stderr, "rich_proxied_file"):  # which is beneath a bar
            text = "" if state is None else state.text
            print(f"\r{text[: shutil.get_terminal_size().columns - 1]}\x1b[K", end="", file=sys.stderr, flush=True)
            return
        now_s = time.monotonic()
        if state is not None and now_s - self._last_s >= LINE_S:
            self._last_s = now_s
            print(state.text, file=sys.stderr, flush=True)


compilations: Final = Compilations()
