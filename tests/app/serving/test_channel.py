"""What a supervisor and its workers say to each other."""

from __future__ import annotations

import os
import socket
import sys
from threading import Thread

import pytest

from app.serving.channel import MOST_AT_ONCE, Channel, ReloadAnswer, TakeIn
from app.serving.division import settings_of_worker
from app.settings import Settings
from routing.errors import GraphFormatError, GraphNotFoundError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no several workers")


def test_more_descriptors_than_one_call_takes_arrive_in_their_order() -> None:
    here, there = (Channel(end) for end in socket.socketpair())
    sent = [os.open("/dev/null", os.O_RDONLY) for _ in range(MOST_AT_ONCE + 3)]
    sent.append(os.open("/dev/zero", os.O_RDONLY))
    sending = Thread(target=here.send, args=(TakeIn(1, ()), sent))
    sending.start()
    message, received = there.receive()
    sending.join()
    assert message == TakeIn(1, ())
    assert [os.fstat(number).st_rdev for number in received] == [os.fstat(number).st_rdev for number in sent]
    for number in (*sent, *received):
        os.close(number)
    here.close()
    with pytest.raises(EOFError):
        there.receive()
    there.close()


@pytest.mark.parametrize(
    "error",
    [GraphNotFoundError("atlantis", ("grid",)), GraphFormatError("/graphs/grid", "length_m.npy", -1.0, "above 0")],
)
def test_errors_arrive_with_their_facts(error: GraphNotFoundError | GraphFormatError) -> None:
    here, there = (Channel(end) for end in socket.socketpair())
    here.send(ReloadAnswer(error))
    message, _ = there.receive()
    assert isinstance(message, ReloadAnswer)
    assert type(message.outcome) is type(error)
    assert vars(message.outcome) == vars(error)
    assert str(message.outcome) == str(error)
    here.close()
    there.close()


def test_threads_and_caches_are_divided_unless_they_are_set() -> None:
    shares = settings_of_worker(Settings(workers=2))
    assert shares.search_threads == max((os.cpu_count() or 1) // 2, 1)
    assert shares.cache_limit_bytes == Settings().cache_limit_bytes // 2
    chosen = settings_of_worker(Settings(workers=2, search_threads=3, cache_limit_bytes=1000))
    assert (chosen.search_threads, chosen.cache_limit_bytes) == (3, 1000)
    assert settings_of_worker(Settings(workers=100)).search_threads >= 1
