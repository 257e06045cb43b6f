"""One of several processes that serve as one: told by its supervisor what to do, it serves until it is told to stop."""

from __future__ import annotations

import gc
import logging
import os
import signal
import socket
import sys
import time
import zlib
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import TYPE_CHECKING, Final

from rich.console import Console

from app.errors.raised import NotReadyError
from app.http.server import run_server
from app.logs import configure_logs
from app.main import create_app
from app.service.service import Service, reloaded_answer
from app.serving.balance import Board, Place, SharedListener
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
from app.sharing.shelf import OfferedGraphs
from app.sharing.sources import GraphsOnDisk
from app.store.errors import StoreError
from energy.compiled.progress import Display, compilations
from energy.errors import EnergyError, Refusal
from routing.errors import RoutingError
from routing.graph.folders import graph_folders

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.http.metrics import Metrics
    from app.schemas.graph import GraphsReloaded

LOG: Final = logging.getLogger("uvicorn.error.worker")  # below the logger that the server sets up
REFUSED: Final = 2  # exit code: what it was told to serve can't be served
FIGURES_S: Final = 5.0  # that figures are waited for


class WorkerService(Service):
    """A service whose graphs its supervisor looks after."""

    def __init__(self, order: Order, graphs: OfferedGraphs, channel: Channel) -> None:
        super().__init__(order.settings, graphs, order.run_name)
        self._graphs = graphs
        self._channel = channel
        self._asking = Lock()
        self._answers: SimpleQueue[ReloadAnswer | None] = SimpleQueue()
        self._changes: SimpleQueue[tuple[TakeIn, list[int]]] = SimpleQueue()
        self._figures: SimpleQueue[FiguresAnswer | None] = SimpleQueue()
        self._asked_figures = 0

    def reload_graphs(self) -> GraphsReloaded:
        """Have all workers take in what has changed on disk; raises as Service.reload_graphs does, and NotReadyError.

        NotReadyError where the supervisor is gone, and this process about to end.
        """
        with self._asking:
            try:
                self._channel.send(ReloadAsked())
            except OSError as error:
                raise NotReadyError from error
            answer = self._answers.get()
        if answer is None:
            raise NotReadyError
        if isinstance(answer.outcome, RoutingError):
            raise answer.outcome
        return reloaded_answer(answer.outcome)

    def service_figures(self) -> bytes:
        """The figures of all workers together, for one thread; raises NotReadyError where they do not come in time."""
        self._asked_figures += 1
        until_s = time.monotonic() + FIGURES_S
        try:
            self._channel.send(FiguresAsked(self._asked_figures))
            while (answer := self._figures.get(timeout=max(until_s - time.monotonic(), 0.0))) is not None:
                if answer.number == self._asked_figures:
                    return zlib.decompress(answer.compressed)
        except (OSError, Empty) as error:
            raise NotReadyError from error
        raise NotReadyError

    def listen(self, metrics: Metrics) -> None:
        """Do what the supervisor says until it is gone; this process then stops, too. metrics: of this worker."""
        Thread(target=self._take_in_changes, name="graphs", daemon=True).start()  # which may take long
        try:
            while True:
                message, descriptors = self._channel.receive()
                if isinstance(message, TakeIn):
                    self._changes.put((message, descriptors))
                elif isinstance(message, ReloadAnswer):
                    self._answers.put(message)
                elif isinstance(message, TellFigures):
                    self._channel.send(Figures(tuple(metrics.families())))
                elif isinstance(message, FiguresAnswer):
                    self._figures.put(message)
        except (EOFError, OSError):
            self._answers.put(None)
            self._figures.put(None)
            LOG.error("the supervisor is gone: this worker stops")
            os.kill(os.getpid(), signal.SIGTERM)

    def _take_in_changes(self) -> None:
        """Take in changed graphs, one change after the other."""
        while True:
            change, descriptors = self._changes.get()
            self._graphs.take(change.offers, descriptors)
            taken = Taken(change.turn, self._taken_in())
            with suppress(OSError):  # the supervisor is gone, and this process about to end
                self._channel.send(taken)

    def _taken_in(self) -> dict[str, str]:
        """Answer on the graphs that are offered now; those that can't be taken in, and why."""
        try:
            return self.take_in().refused
        except Exception as error:  # the graphs of before stay, and so does the worker
            LOG.exception("graphs are not taken in")
            return dict.fromkeys(self._graphs.folders(), str(error))


def _listeners(order: Order, descriptors: list[int], begun: Callable[[], None]) -> list[socket.socket]:
    """The sockets to serve on; begun: called when the last of them listens."""
    place = None
    if order.has_board:
        place = Place(Board(descriptors[order.socket_count]), order.slot, order.settings.workers)
    silent, last = descriptors[: order.socket_count - 1], descriptors[order.socket_count - 1]
    return [*(SharedListener(listener, place, lambda: None) for listener in silent), SharedListener(last, place, begun)]


def main() -> None:
    """Serve as the first message on a descriptor says, whose number is the first argument."""
    end = socket.socket(fileno=int(sys.argv[1]))
    end.set_inheritable(False)  # by processes that diagnose
    channel = Channel(end)
    message, descriptors = channel.receive()
    if not isinstance(message, Order):
        raise TypeError(f"an order is what a worker is told first, not {type(message).__name__}")
    compilations.watch(Display())
    settings = message.settings
    configure_logs(settings)
    listeners = _listeners(message, descriptors, lambda: channel.send(Ready()))
    graphs = OfferedGraphs(GraphsOnDisk(lambda: graph_folders(settings.graph_dirs)))
    graphs.take(message.offers, descriptors[message.socket_count + message.has_board :])
    service = WorkerService(message, graphs, channel)
    try:
        service.load_all()
    except (Refusal, EnergyError, RoutingError, StoreError) as error:
        Console(stderr=True, soft_wrap=True).print(str(error), style="red", markup=False, highlight=False)
        sys.exit(REFUSED)
    application = create_app(settings, service)
    # what is loaded stays, as in a single process
    gc.collect()
    gc.freeze()
    metrics: Metrics = application.state.metrics
    metrics.of_service = service.service_figures
    Thread(target=service.listen, args=(metrics,), name="supervisor", daemon=True).start()
    run_server(application, settings, message.host, message.port, listeners)


if __name__ == "__main__":
    main()
