"""Whether the database answers, asked on a thread of its own, for a short time, and not at every request."""

from __future__ import annotations

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.store.errors import DatabaseUnavailableError

if TYPE_CHECKING:
    from app.store.database import Database

KEPT_S: Final = 1.0
LIMIT_S: Final = 1.0


@dataclass(frozen=True, slots=True)
class Reachable:
    """Whether a database can be read, and the reason where it can't."""

    reachable: bool
    reason: str | None = None


class DatabaseProbe:
    """Asks a database whether it can be read; to be used from one event loop.

    One question is asked at a time, so that a server that does not answer holds one thread, and is not asked again
    while it is silent.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="database-probe")
        self._asked: asyncio.Future[Reachable] | None = None
        self._answered_s = 0.0

    async def reachable(self) -> Reachable:
        """What was found within the last KEPT_S, or now; "no answer" after LIMIT_S."""
        asked = self._asked
        if asked is None or (asked.done() and time.monotonic() - self._answered_s > KEPT_S):
            asked = self._asked = asyncio.get_running_loop().run_in_executor(self._thread, self._ask)
            asked.add_done_callback(self._note_answer)
        await asyncio.wait((asked,), timeout=LIMIT_S)
        return asked.result() if asked.done() else Reachable(False, f"no answer within {LIMIT_S:g} s")

    def close(self) -> None:
        """Ask no more."""
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _note_answer(self, _: asyncio.Future[Reachable]) -> None:
        self._answered_s = time.monotonic()

    def _ask(self) -> Reachable:
        try:
            self._database.check()
        except DatabaseUnavailableError as error:
            return Reachable(False, error.reason)
        return Reachable(True)
