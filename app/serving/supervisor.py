"""Several processes that serve as one: started, looked after, told of changed graphs, and stopped together."""

from __future__ import annotations

import asyncio
import logging
import signal
import socket
import sys
import time
import zlib
from contextlib import suppress
from dataclasses import dataclass, field
from threading import Thread
from typing import TYPE_CHECKING, Any, Final

from app.errors.raised import CommandError
from app.logs import configure_logs
from app.service.service import new_run_name
from app.serving.balance import ABSENT, new_board
from app.serving.channel import (
    Channel,
    Figures,
    FiguresAnswer,
    FiguresAsked,
    Order,
    Ready,
    ReloadAnswer,
    ReloadAsked,
    TakeIn,
    Taken,
    TellFigures,
)
from app.serving.division import settings_of_worker
from app.serving.figures import Tally
from app.serving.listening import bound_sockets
from app.sharing.shelf import GraphShelf
from app.sharing.sources import Reloaded
from routing.errors import GraphFormatError, GraphNotFoundError

if TYPE_CHECKING:
    from asyncio.subprocess import Process
    from collections.abc import Callable, Coroutine

    from app.serving.channel import Message
    from app.settings import Settings
    from app.sharing.sources import GraphSource

LOG: Final = logging.getLogger("uvicorn.error.supervisor")  # below the logger that the server sets up
STEADY_S: Final = 10.0  # a worker that has served so long has started well
FIRST_PAUSE_S: Final = 0.5  # before a worker that has failed again is started again; doubled each time
LONGEST_PAUSE_S: Final = 30.0
KILLED_AFTER_S: Final = 1.0  # beyond the time to stop in, at whose end workers end themselves
FIGURES_S: Final = 1.0  # that workers have to tell their figures; after it, those that they told last count


@dataclass(eq=False)
class Worker:
    """One process in a slot; gone: it has ended. taken: what it says of changed graphs. ready_s: since when it serves.

    telling: done once it has told its figures, None while it is not asked.
    """

    slot: int
    process: Process
    channel: Channel
    gone: asyncio.Event = field(default_factory=asyncio.Event)
    taken: asyncio.Queue[Taken | None] = field(default_factory=asyncio.Queue)
    ready_s: float | None = None
    telling: asyncio.Future[None] | None = None

    def end_telling(self) -> None:
        """It has told its figures, or will not tell them any more."""
        telling, self.telling = self.telling, None
        if telling is not None:
            telling.set_result(None)


class Supervisor:
    """Keeps as many workers as the settings say; to be used from one event loop.

    source: of graphs, each of which it reads once; say: what is printed once the service answers.
    """

    def __init__(
        self,
        settings: Settings,
        source: GraphSource,
        listeners: list[socket.socket],
        host: str,
        port: int,
        say: Callable[[str], None],
    ) -> None:
        self.settings = settings
        self._shelf = GraphShelf(source)
        self._listeners = listeners
        self._host = host
        self._port = port
        self._say = say
        self._run_name = new_run_name()
        self._turn = 0
        self._board = new_board()
        self._workers: set[Worker] = set()
        self._stopping = asyncio.Event()
        self._answering = asyncio.Event()
        self._changing = asyncio.Lock()  # graphs, and which worker knows of which
        self._errands: set[asyncio.Task[None]] = set()
        self._tally = Tally()

    async def run(self) -> None:
        """Serve until told to stop.

        Raises GraphNotFoundError, GraphFormatError, and CommandError where no worker starts.
        """
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self._stop)
        loop.add_signal_handler(signal.SIGHUP, self._reload_soon, None)
        refused = (await self._refreshed()).refused
        if refused:
            raise CommandError("; ".join(refused.values()))
        slots = [asyncio.create_task(self._keep(idx)) for idx in range(self.settings.workers)]
        stopped = asyncio.create_task(self._stopping.wait())
        try:
            await asyncio.wait([stopped, *slots], return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._stopping.set()
            await self._end()
            outcomes = await asyncio.gather(*slots, return_exceptions=True)
            stopped.cancel()
        for outcome in outcomes:
            if isinstance(outcome, BaseException):
                raise outcome

    async def _keep(self, idx: int) -> None:
        """Keep one worker running; all but the first wait until that one has compiled what is to be compiled."""
        if idx > 0:
            await self._unless_stopping(self._answering.wait())
        failures = 0
        while not self._stopping.is_set():
            worker = await self._started(idx)
            code = await worker.process.wait()
            await worker.gone.wait()
            if self._board is not None:
                self._board[idx] = ABSENT
            if self._stopping.is_set():
                return
            if not self._answering.is_set():
                raise CommandError(f"the first worker ended ({ending(code)}) before it could serve")
            served_s = 0.0 if worker.ready_s is None else time.monotonic() - worker.ready_s
            failures = 1 if served_s >= STEADY_S else failures + 1
            pause_s = 0.0 if failures == 1 else min(FIRST_PAUSE_S * 2.0 ** (failures - 2), LONGEST_PAUSE_S)
            again = f"in {pause_s:g} s" if pause_s else "now"
            LOG.error("worker %d ended (%s): started again %s", worker.process.pid, ending(code), again)
            await self._unless_stopping(asyncio.sleep(pause_s))

    async def _started(self, idx: int) -> Worker:
        """A new worker that knows what to do, in place of an earlier one."""
        async with self._changing:
            here, there = socket.socketpair()
            with there:
                process = await asyncio.create_subprocess_exec(
                    sys.executable,
                    "-m",
                    "app.serving.worker",
                    str(there.fileno()),
                    pass_fds=[there.fileno()],
                    start_new_session=True,  # a terminal's interrupt is for the supervisor
                )
            worker = Worker(idx, process, Channel(here))
            Thread(target=self._listen, args=(worker, asyncio.get_running_loop()), daemon=True).start()
            self._workers.add(worker)
            if self._stopping.is_set():  # meanwhile, so that nobody has told this one
                process.terminate()
            offers, descriptors = self._shelf.offers()
            settings = settings_of_worker(self.settings)
            order = Order(
                settings,
                self._host,
                self._port,
                len(self._listeners),
                idx,
                self._board is not None,
                offers,
                self._run_name,
            )
            board = [] if self._board is None else [self._board.descriptor]
            with suppress(OSError):  # it has ended already
                worker.channel.send(order, [*(listener.fileno() for listener in self._listeners), *board, *descriptors])
            return worker

    def _listen(self, worker: Worker, loop: asyncio.AbstractEventLoop) -> None:
        """Pass on what a worker says; on a thread of its own."""
        with suppress(EOFError, OSError):
            while True:
                message, _ = worker.channel.receive()
                loop.call_soon_threadsafe(self._heard, worker, message)
        with suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(self._gone, worker)

    def _heard(self, worker: Worker, message: Message) -> None:
        if isinstance(message, Ready):
            worker.ready_s = time.monotonic()
            if not self._answering.is_set():
                self._answering.set()
                self._say(f"serving on {addresses(self._listeners)}")
            LOG.info("worker %d serves", worker.process.pid)
        elif isinstance(message, Taken):
            worker.taken.put_nowait(message)
        elif isinstance(message, ReloadAsked):
            self._reload_soon(worker)
        elif isinstance(message, Figures):
            self._tally.hear(worker.slot, message.families)
            worker.end_telling()
        elif isinstance(message, FiguresAsked):
            self._do_soon(self._tell_figures(worker, message.number))

    async def _tell_figures(self, asking: Worker, number: int) -> None:
        """Tell a worker the figures of all; one that does not tell its own in time counts with what it told last."""
        for worker in self._workers:
            if worker.ready_s is not None and worker.telling is None:  # never asked twice, so that no socket fills
                worker.telling = asyncio.get_running_loop().create_future()
                with suppress(OSError):
                    worker.channel.send(TellFigures())
        if telling := [worker.telling for worker in self._workers if worker.telling is not None]:
            await asyncio.wait(telling, timeout=FIGURES_S)
        with suppress(OSError):
            asking.channel.send(FiguresAnswer(number, zlib.compress(self._tally.text(), 1)))

    def _gone(self, worker: Worker) -> None:
        self._workers.discard(worker)
        worker.end_telling()
        self._tally.end(worker.slot)
        worker.channel.close()
        worker.taken.put_nowait(None)
        worker.gone.set()

    def _reload_soon(self, asking: Worker | None) -> None:
        self._do_soon(self._reload(asking))

    def _do_soon(self, errand: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(errand)
        self._errands.add(task)
        task.add_done_callback(self._errands.discard)

    async def _reload(self, asking: Worker | None) -> None:
        """Have all workers take in what has changed on disk, and tell the one whose client has asked."""
        outcome: Reloaded | GraphNotFoundError | GraphFormatError
        async with self._changing:
            try:
                outcome = await self._refreshed()
            except (GraphNotFoundError, GraphFormatError) as error:
                LOG.warning("graphs are not reloaded: %s", error)
                outcome = error
            else:
                changed = outcome.added + outcome.replaced
                if changed or outcome.removed:
                    outcome = with_refused(outcome, await self._told(changed))
                self._shelf.release()
                LOG.info("graphs reloaded: %s", outcome)
        if asking is not None:
            with suppress(OSError):
                asking.channel.send(ReloadAnswer(outcome))

    async def _told(self, changed: tuple[str, ...]) -> dict[str, str]:
        """Have every worker take in changed graphs; what they could not take in, and why.

        Those that are not ready yet take them in before they serve, or soon after, and are not waited for.
        """
        self._turn += 1
        offers, descriptors = self._shelf.offers(changed)
        workers = list(self._workers)
        for worker in workers:
            with suppress(OSError):
                worker.channel.send(TakeIn(self._turn, offers), descriptors)
        refused: dict[str, str] = {}
        for worker in workers:
            while worker.ready_s is not None and (taken := await worker.taken.get()) is not None:
                if taken.turn == self._turn:  # not that of a turn before it was ready
                    refused |= taken.refused
                    break
        return refused

    def _stop(self) -> None:
        """Begin to stop, or, told again, end at once."""
        if not self._stopping.is_set():
            self._stopping.set()
            return
        for worker in self._workers:
            with suppress(ProcessLookupError):
                worker.process.kill()

    async def _end(self) -> None:
        """Stop all workers: what has begun is answered, within the time to stop in."""
        for listener in self._listeners:
            listener.close()
        for worker in self._workers:
            with suppress(ProcessLookupError):
                worker.process.terminate()
        ended = [asyncio.ensure_future(worker.gone.wait()) for worker in self._workers]
        if ended:
            await asyncio.wait(ended, timeout=self.settings.stop_limit_s + KILLED_AFTER_S)
        for worker in self._workers:
            LOG.error("worker %d does not stop: killed", worker.process.pid)
            with suppress(ProcessLookupError):
                worker.process.kill()
        for task in self._errands:
            task.cancel()

    async def _unless_stopping(self, waiting: Coroutine[Any, Any, object]) -> None:
        """Wait, until the service stops at most."""
        waits = [asyncio.ensure_future(waiting), asyncio.ensure_future(self._stopping.wait())]
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        for wait in waits:
            wait.cancel()

    async def _refreshed(self) -> Reloaded:
        """What the shelf's refresh returns, on a thread that nothing waits for when the service stops."""
        loop = asyncio.get_running_loop()
        done: asyncio.Future[Reloaded] = loop.create_future()

        def tell(outcome: Reloaded | Exception) -> None:
            if done.cancelled():
                return
            if isinstance(outcome, Exception):
                done.set_exception(outcome)
            else:
                done.set_result(outcome)

        def refresh() -> None:
            outcome: Reloaded | Exception
            try:
                outcome = self._shelf.refresh(self.settings.default_graph)
            except Exception as error:
                outcome = error
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(tell, outcome)

        Thread(target=refresh, name="graphs", daemon=True).start()
        return await done


def supervise(settings: Settings, source: GraphSource, host: str, port: int, say: Callable[[str], None]) -> None:
    """Serve with as many workers as the settings say, until told to stop.

    say: is given a line to print once the service answers. Raises CommandError where the system can't, or where the
    first worker does not start; OSError where the address can't be listened on; GraphNotFoundError, GraphFormatError.
    """
    if sys.platform == "win32":
        raise CommandError("several workers share a socket, which this system does not have: serve with one")
    configure_logs(settings)
    listeners = bound_sockets(host, port)

    async def run() -> None:
        await Supervisor(settings, source, listeners, host, port, say).run()

    asyncio.run(run())


def with_refused(changed: Reloaded, refused: dict[str, str]) -> Reloaded:
    """What a reload has changed, without what some worker could not take in."""
    if not refused:
        return changed
    return Reloaded(
        added=tuple(name for name in changed.added if name not in refused),
        replaced=tuple(name for name in changed.replaced if name not in refused),
        removed=changed.removed,
        refused=changed.refused | refused,
    )


def ending(code: int) -> str:
    """How a process ended, in words."""
    if code >= 0:
        return f"exit code {code}"
    with suppress(ValueError):
        return signal.Signals(-code).name
    return f"signal {-code}"


def addresses(listeners: list[socket.socket]) -> str:
    """The addresses of sockets, as URLs."""
    names = []
    for listener in listeners:
        host, port = listener.getsockname()[:2]
        names.append(f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}")
    return ", ".join(names)
