"""New connections go to the worker that has fewest: a board that all see, and a socket that leaves them to others."""

from __future__ import annotations

import mmap
import os
import socket
import struct
import sys
import time
from typing import TYPE_CHECKING, Any, Final

from app.settings import MOST_WORKERS

if TYPE_CHECKING:
    from collections.abc import Callable

_SLOT: Final = struct.Struct("<q")
ABSENT: Final = -1  # in the slot of a worker that takes no connections
PATIENCE_S: Final = 0.02  # that a connection waits for a worker with fewer; meanwhile the event loop turns


class Board:
    """How many connections each worker has, in memory that all of them see; each writes its own slot only."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self._memory = mmap.mmap(descriptor, MOST_WORKERS * _SLOT.size)

    def __getitem__(self, slot: int) -> int:
        return int(_SLOT.unpack_from(self._memory, slot * _SLOT.size)[0])

    def __setitem__(self, slot: int, count: int) -> None:
        _SLOT.pack_into(self._memory, slot * _SLOT.size, count)

    def fewest(self, slots: int) -> int:
        """The least of the first so many slots, ABSENT where nobody takes connections."""
        counts = struct.unpack_from(f"<{slots}q", self._memory)
        return min((count for count in counts if count != ABSENT), default=ABSENT)


def new_board() -> Board | None:
    """A board on which all are absent; None where the system has no memory to share without a file."""
    if sys.platform != "linux":
        return None
    descriptor = os.memfd_create("joulepath-board", os.MFD_CLOEXEC)
    os.ftruncate(descriptor, MOST_WORKERS * _SLOT.size)
    board = Board(descriptor)
    for slot in range(MOST_WORKERS):
        board[slot] = ABSENT
    return board


class Place:
    """The slot of one worker on a board of so many workers."""

    def __init__(self, board: Board, slot: int, workers: int) -> None:
        self.board = board
        self.slot = slot
        self.workers = workers

    @property
    def count(self) -> int:
        """Connections of this worker, ABSENT while it takes none."""
        return self.board[self.slot]

    @count.setter
    def count(self, value: int) -> None:
        self.board[self.slot] = value

    @property
    def has_fewest(self) -> bool:
        """Whether no other worker has fewer."""
        return self.count <= self.board.fewest(self.workers)


class SharedListener(socket.socket):
    """A listening socket that several workers share; it takes a connection where no other worker has fewer.

    Without that, whichever process the system wakes first takes them all. A worker that does not come to take what is
    left to it, since it is busy, is not waited for. Used by one event loop, level-triggered: it asks again at once.
    place: of this worker, None where there is no board: it then takes what comes. begun: called when it listens.
    """

    def __init__(self, descriptor: int, place: Place | None, begun: Callable[[], None]) -> None:
        super().__init__(fileno=descriptor)
        self._place = place
        self._begun = begun
        self._waits_since_s: float | None = None

    def listen(self, backlog: int = 128, /) -> None:
        """Begin to take connections."""
        super().listen(backlog)
        if self._place is not None:
            self._place.count = max(self._place.count, 0)
        self._begun()

    def accept(self) -> tuple[socket.socket, Any]:
        """A connection and its address; raises BlockingIOError where there is none, or none for this worker."""
        place = self._place
        if place is None:
            return super().accept()
        if not place.has_fewest:
            now_s = time.monotonic()
            if self._waits_since_s is None:
                self._waits_since_s = now_s
            if now_s - self._waits_since_s < PATIENCE_S:
                raise BlockingIOError
        self._waits_since_s = None
        plain, address = super().accept()
        place.count += 1
        return _Counted(plain, place), address

    def dup(self) -> socket.socket:  # type: ignore[override]  # a plain one, since sockets are copied by their class
        """The same socket once more."""
        return socket.socket(self.family, self.type, self.proto, fileno=os.dup(self.fileno()))

    def close(self) -> None:
        """Take no more connections."""
        if self._place is not None:
            self._place.count = ABSENT
        super().close()


class _Counted(socket.socket):
    """A connection that is taken from the board when it is closed."""

    def __init__(self, plain: socket.socket, place: Place) -> None:
        super().__init__(plain.family, plain.type, plain.proto, fileno=plain.detach())
        self._place: Place | None = place

    def close(self) -> None:
        """Close it."""
        place, self._place = self._place, None
        if place is not None and place.count > 0:
            place.count -= 1
        super().close()
