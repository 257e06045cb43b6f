"""Work spread over processes by Dask: an embedded scheduler, or the one at an address."""

from __future__ import annotations

from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, TypeVar

from proof.errors import ProofError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

Result = TypeVar("Result")

# Set before numpy is imported: with a pool of threads in each process the processes would fight for the cores.
ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


class ProofWorkers:
    """Processes that take calls of functions and hand their results back as they are done."""

    def __init__(self, distributed: Any, client: Any) -> None:
        self._distributed = distributed
        self._client = client

    def each(
        self, function: Callable[..., Result], arguments: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, Result]]:
        """Call the function once for each tuple of arguments; yields its place and result in the order of finishing.

        Raises what a call has raised, and ProofError where a process died over one, which memory is the usual cause of.
        """
        if not arguments:
            return
        futures = [self._client.submit(function, *call, pure=False) for call in arguments]
        place = {future.key: k for k, future in enumerate(futures)}
        try:
            for future in self._distributed.as_completed(futures):
                yield place[future.key], future.result()
        except self._distributed.KilledWorker as error:
            raise ProofError(f"a worker died ({error}): allow fewer --workers, or more memory") from error
        finally:
            self._client.cancel(futures)


@contextmanager
def workers(count: int, scheduler: str | None = None) -> Iterator[ProofWorkers]:
    """Processes of this machine, or the workers of the scheduler at an address; they must see the same folders.

    Raises ProofError without Dask, or where nothing answers at the address.
    """
    try:
        dask: Any = import_module("dask")
        distributed: Any = import_module("distributed")
    except ModuleNotFoundError as error:
        raise ProofError(f"{error.name} is not installed: install joulepath with the extra `proof`") from error
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout="10s")
        except (OSError, ValueError, TimeoutError) as error:
            raise ProofError(f"--scheduler is {scheduler!r}, allowed: the address of a running scheduler") from error
        with client:
            yield ProofWorkers(distributed, client)
        return
    with (
        dask.config.set(
            {"distributed.nanny.pre-spawn-environ": ONE_THREAD, "distributed.scheduler.allowed-failures": 1}
        ),
        distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            memory_limit=0,
            silence_logs=40,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield ProofWorkers(distributed, client)
