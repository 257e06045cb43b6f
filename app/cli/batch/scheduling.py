"""Calls spread by Dask: over threads of this process, or over the workers of a scheduler."""

from __future__ import annotations

from collections import deque
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, TypeVar

from app.errors.raised import CommandError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

Result = TypeVar("Result")

THIS_HOST: Final = "127.0.0.1:0"  # for status pages, which by default every host could open
CALLS_A_THREAD: Final = 4  # that wait or run at a time, so that no thread idles and no long list is kept


class BatchWorkers:
    """Threads or processes that calls are spread over."""

    def __init__(self, distributed: Any, client: Any) -> None:
        self._distributed, self._client = distributed, client

    @property
    def thread_count(self) -> int:
        """Calls that run at the same time."""
        return sum(self._client.nthreads().values())

    def in_order(self, function: Callable[..., Result], arguments: Iterable[tuple[Any, ...]]) -> Iterator[Result]:
        """What the function returns for each tuple of arguments, in their order; a few calls wait or run at a time.

        Raises what a call raises, and CommandError where a worker died over one or the scheduler went away.
        """
        most = CALLS_A_THREAD * max(self.thread_count, 1)
        running: deque[Any] = deque()
        try:
            for given in arguments:
                running.append(self._client.submit(function, *given, pure=False))
                if len(running) >= most:
                    yield running.popleft().result()
            while running:
                yield running.popleft().result()
        except self._distributed.KilledWorker as error:
            raise CommandError(f"a worker died ({error}): give workers more memory") from error
        except self._distributed.CancelledError as error:
            raise CommandError("the scheduler went away") from error
        finally:
            self._client.cancel(list(running))


def dask_distributed() -> Any:
    """Dask's package of schedulers; raises CommandError where it is not installed."""
    try:
        return import_module("distributed")
    except ModuleNotFoundError as error:
        raise CommandError(f"{error.name} is not installed: install `dask[distributed]`") from error


@contextmanager
def workers(scheduler: str | None, threads: int) -> Iterator[BatchWorkers]:
    """The workers of the scheduler at an address, or of an embedded one with threads of this process.

    Threads are enough here, since searches release Python's lock. Raises CommandError without Dask, and where nothing
    answers at the address.
    """
    distributed = dask_distributed()
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout="10s")
        except (OSError, ValueError, TimeoutError) as error:
            raise CommandError(f"--scheduler is {scheduler!r}, allowed: the address of a running scheduler") from error
        with client:
            found = BatchWorkers(distributed, client)
            if found.thread_count == 0:
                raise CommandError(f"--scheduler {scheduler} has no workers: start some, with joulepath installed")
            yield found
        return
    with (
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=threads,
            processes=False,
            dashboard_address=THIS_HOST,
            worker_dashboard_address=THIS_HOST,
            memory_limit=0,
            silence_logs=40,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield BatchWorkers(distributed, client)
