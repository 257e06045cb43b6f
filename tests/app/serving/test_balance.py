"""Which of several workers takes a connection."""

from __future__ import annotations

import os
import socket
import sys
import time
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

import pytest

from app.serving.balance import ABSENT, PATIENCE_S, Board, Place, SharedListener, new_board
from app.serving.listening import bound_sockets

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="there is no board")
WORKERS = 3


@pytest.fixture
def board() -> Board:
    board = new_board()
    assert board is not None
    return board


@pytest.fixture
def listeners(board: Board) -> Iterator[list[SharedListener]]:
    (bound,) = bound_sockets("127.0.0.1", 0)
    with ExitStack() as opened:
        opened.enter_context(bound)
        made = [
            SharedListener(os.dup(bound.fileno()), Place(board, slot, WORKERS), lambda: None) for slot in range(WORKERS)
        ]
        for listener in made:
            opened.callback(listener.close)
            listener.setblocking(False)
        yield made


def connected(listener: SharedListener, opened: ExitStack) -> None:
    opened.enter_context(socket.create_connection(listener.getsockname(), timeout=5.0))


def test_connection_is_taken_by_a_worker_that_has_fewest(listeners: list[SharedListener], board: Board) -> None:
    for listener in listeners:
        listener.listen()
    with ExitStack() as opened:
        for _ in range(4 * WORKERS):
            connected(listeners[0], opened)
            for listener in listeners:  # the first one always asks first
                with suppress(BlockingIOError):
                    opened.enter_context(listener.accept()[0])
                    break
        assert [board[slot] for slot in range(WORKERS)] == [4] * WORKERS


def test_closed_connections_make_room(listeners: list[SharedListener], board: Board) -> None:
    listeners[0].listen()
    listeners[1].listen()
    with ExitStack() as opened:
        connected(listeners[0], opened)
        taken = listeners[0].accept()[0]
        assert board[0] == 1
        taken.close()
        taken.close()
        assert board[0] == 0
        connected(listeners[0], opened)
        opened.enter_context(listeners[0].accept()[0])


def test_worker_that_takes_no_connections_is_not_waited_for(listeners: list[SharedListener], board: Board) -> None:
    for listener in listeners:
        listener.listen()
    listeners[1].close()
    board[2] = ABSENT  # as the supervisor notes of one that has ended
    with ExitStack() as opened:
        for count in range(1, 4):
            connected(listeners[0], opened)
            opened.enter_context(listeners[0].accept()[0])
            assert board[0] == count


def test_busy_worker_is_waited_for_a_moment_only(listeners: list[SharedListener], board: Board) -> None:
    listeners[0].listen()
    listeners[1].listen()
    board[0] = 5
    with ExitStack() as opened:
        connected(listeners[0], opened)
        with pytest.raises(BlockingIOError):
            listeners[0].accept()
        time.sleep(2.0 * PATIENCE_S)
        opened.enter_context(listeners[0].accept()[0])
        assert board[0] == 6


def test_addresses_of_a_host_share_a_port() -> None:
    with ExitStack() as opened:
        bound = [opened.enter_context(listener) for listener in bound_sockets("localhost", 0)]
        assert len({listener.getsockname()[1] for listener in bound}) == 1


def test_address_in_use_is_named() -> None:
    (bound,) = bound_sockets("127.0.0.1", 0)
    with bound:
        bound.listen()
        port = bound.getsockname()[1]
        with pytest.raises(OSError, match=rf"127\.0\.0\.1 port {port}: .*in use"):
            bound_sockets("127.0.0.1", port)
