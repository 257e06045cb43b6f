"""What a supervisor and its workers say to each other, over a pair of sockets that nobody else has."""

from __future__ import annotations

import pickle
import socket
import struct
from contextlib import suppress
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING, Final, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Sequence

    from prometheus_client.metrics_core import Metric

    from app.settings import Settings
    from app.sharing.shelf import Offer
    from app.sharing.sources import Reloaded
    from routing.errors import GraphFormatError, GraphNotFoundError

_HEAD: Final = struct.Struct("<QI")  # bytes of the message, descriptors before it
MOST_AT_ONCE: Final = 200  # descriptors in one call; Linux takes 253


@dataclass(frozen=True, slots=True)
class Order:
    """What a worker is to do: serve with these graphs on the listening sockets.

    The descriptors are those of the sockets, then of the board of connections, then of graphs. slot: the worker's own
    on the board; has_board: whether there is one. run_name: of the service, which its workers share.
    """

    settings: Settings
    host: str
    port: int
    socket_count: int
    slot: int
    has_board: bool
    offers: tuple[Offer, ...]
    run_name: str


@dataclass(frozen=True, slots=True)
class Ready:
    """A worker listens."""


@dataclass(frozen=True, slots=True)
class TakeIn:
    """The graphs have changed to these; turn: number of the change."""

    turn: int
    offers: tuple[Offer, ...]


@dataclass(frozen=True, slots=True)
class Taken:
    """A worker answers on the graphs of a turn, but for those refused, and why."""

    turn: int
    refused: dict[str, str]


@dataclass(frozen=True, slots=True)
class ReloadAsked:
    """A client of a worker asks to look at all graphs again."""


@dataclass(frozen=True, slots=True)
class ReloadAnswer:
    """What came of it."""

    outcome: Reloaded | GraphNotFoundError | GraphFormatError


@dataclass(frozen=True, slots=True)
class TellFigures:
    """A worker is to tell its figures."""


@dataclass(frozen=True, slots=True)
class Figures:
    """The figures of a worker."""

    families: tuple[Metric, ...]


@dataclass(frozen=True, slots=True)
class FiguresAsked:
    """A client of a worker asks for the figures of the service; number: of the question, that worker's own."""

    number: int


@dataclass(frozen=True, slots=True)
class FiguresAnswer:
    """They, in the text format of Prometheus, compressed with zlib: it has to fit into what a socket holds."""

    number: int
    compressed: bytes


Message: TypeAlias = (
    Order | Ready | TakeIn | Taken | ReloadAsked | ReloadAnswer | TellFigures | Figures | FiguresAsked | FiguresAnswer
)


class Channel:
    """One end of a pair of sockets; one thread may receive while any others send."""

    def __init__(self, end: socket.socket) -> None:
        self._end = end
        self._sending = Lock()

    def send(self, message: Message, descriptors: Sequence[int] = ()) -> None:
        """Send a message, and descriptors along, which stay open here; raises OSError where the other end is gone."""
        content = pickle.dumps(message)
        with self._sending:
            self._end.sendall(_HEAD.pack(len(content), len(descriptors)))
            for first in range(0, len(descriptors), MOST_AT_ONCE):
                socket.send_fds(self._end, [b"\0"], list(descriptors[first : first + MOST_AT_ONCE]))
            self._end.sendall(content)

    def receive(self) -> tuple[Message, list[int]]:
        """The next message and its descriptors; raises EOFError or OSError where the other end is gone."""
        length, count = _HEAD.unpack(self._bytes(_HEAD.size))
        descriptors: list[int] = []
        while len(descriptors) < count:
            most = min(count - len(descriptors), MOST_AT_ONCE)
            said, found, _, _ = socket.recv_fds(self._end, 1, most)
            if not said:
                raise EOFError
            if len(found) != most:
                raise OSError(f"{len(found)} of {most} descriptors arrived: too many are open")
            descriptors += found
        message: Message = pickle.loads(self._bytes(length))
        return message, descriptors

    def close(self) -> None:
        """End the conversation; who receives at the other end is told."""
        with suppress(OSError):
            self._end.shutdown(socket.SHUT_RDWR)
        self._end.close()

    def _bytes(self, count: int) -> bytes:
        whole = bytearray()
        while len(whole) < count:
            part = self._end.recv(count - len(whole))
            if not part:
                raise EOFError
            whole += part
        return bytes(whole)
