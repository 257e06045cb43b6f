"""Diagnoses of one process of the service, queued and carried out one at a time over all its processes."""

from __future__ import annotations

import logging
import multiprocessing
import os
import queue
import secrets
import shutil
import socket
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from app.diagnosing.limits import how_ended
from app.diagnosing.spool import Spool, sweep
from app.diagnosing.worker import Advanced, Failed, Finished, Message, beyond, portable, work
from app.errors.diagnosing import DiagnosisInterruptedError
from app.errors.table import problem_of
from app.store.diagnoses import UNFINISHED, Turn
from app.store.errors import DatabaseUnavailableError, StorageFullError

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess
    from pathlib import Path

    from app.diagnosing.worker import Task
    from app.store.diagnoses import DiagnosisStore, StoredDiagnosis

LOG: Final = logging.getLogger(__name__)
POLL_S: Final = 0.1
ALIVE_EVERY_S: Final = 2.0
TURN_S: Final = 0.5  # between two looks whether a job may begin
LOST_AFTER_S: Final = 60.0  # without a sign of life from a worker on another host
STOP_WAIT_S: Final = 5.0
TRIES: Final = 5  # to store what came out, a second apart, when the database is away
Stored = TypeVar("Stored", bool, Turn)
_running_here: Final[set[str]] = set()  # workers of this process


@dataclass(slots=True)
class Job:
    """A diagnosis in the queue; own: whether its folder of files is removed with it."""

    task: Task
    own: bool
    reached: Advanced = field(default_factory=lambda: Advanced("starting", 0.0))
    cancelled: threading.Event = field(default_factory=threading.Event)

    @property
    def id(self) -> str:
        """Id of the diagnosis."""
        return self.task.diagnosis_id


class DiagnosisJobs:
    """The queue of one process; its state is in the database, its uploaded files in a folder of its own.

    The thread that works through it begins with the first job. Closing stops what runs, and records it.
    run_name: that of the service, of which one diagnosis runs at a time, in the order of the database.
    """

    def __init__(self, store: DiagnosisStore, run_name: str) -> None:
        self.store = store
        self.run_name = run_name
        self.worker = f"{socket.gethostname()[:200]}:{os.getpid()}:{run_name}-{secrets.token_hex(8)}"
        self._waiting: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        self._jobs: dict[str, Job] = {}
        self._running = False
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._spool: Spool | None = None
        self._starting = threading.Lock()
        _running_here.add(self.worker)
        sweep()

    @property
    def counts(self) -> dict[str, int]:
        """Jobs of this process that are queued and running."""
        running = int(self._running)
        return {"queued": max(len(self._jobs) - running, 0), "running": running}

    def folder(self) -> Path:
        """A new folder for the files of one job; raises OSError."""
        with self._starting:
            if self._spool is None:
                self._spool = Spool()
        return self._spool.new_folder()

    def add(self, job: Job) -> None:
        """Have a stored job carried out after those before it."""
        with self._starting:
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="diagnoses", daemon=True)
                self._thread.start()
        self._jobs[job.id] = job
        self._waiting.put(job)

    def stop(self, diagnosis_id: str) -> None:
        """Stop a job of this process, if it is one; the database says already that it is cancelled."""
        job = self._jobs.get(diagnosis_id)
        if job is not None:
            job.cancelled.set()

    def tell_lost(self, row: StoredDiagnosis) -> bool:
        """Whether nobody carries out an unfinished diagnosis any more; it is then stored as failed."""
        if row.state not in UNFINISHED or not _is_lost(row, datetime.now(UTC)):
            return False
        try:
            self._interrupted(row.id, "the service was stopped meanwhile")
        except StorageFullError:
            return False  # who only reads is answered all the same
        return True

    def close(self) -> None:
        """Stop what runs and forget what waits; both are stored as failed."""
        self._closing.set()
        self._waiting.put(None)
        if self._thread is not None:
            self._thread.join(3 * STOP_WAIT_S)
        for diagnosis_id in list(self._jobs):
            with suppress(DatabaseUnavailableError):
                self._interrupted(diagnosis_id, "the service was stopped")
        _running_here.discard(self.worker)
        if self._spool is not None:
            self._spool.close()

    def _interrupted(self, diagnosis_id: str, reason: str) -> bool:
        problem = problem_of(DiagnosisInterruptedError(reason), f"/diagnoses/{diagnosis_id}")
        return self.store.fail(diagnosis_id, problem.model_dump_json())

    def _work(self) -> None:
        while not self._closing.is_set():
            try:
                job = self._waiting.get(timeout=ALIVE_EVERY_S)
            except queue.Empty:
                continue
            if job is None:
                return
            self._running = True
            try:
                self._carry_out(job)
            except Exception as error:  # the next job must not suffer from this one
                LOG.exception("diagnosis %s", job.id)
                problem = problem_of(error, f"/diagnoses/{job.id}").model_dump_json()
                self._stored(lambda: self.store.fail(job.id, problem))  # noqa: B023 - called before the next turn
            finally:
                self._running = False
                if not self._closing.is_set():
                    self._jobs.pop(job.id, None)
                if job.own:
                    shutil.rmtree(job.task.folder, ignore_errors=True)

    def _carry_out(self, job: Job) -> None:
        if not self._begun(job):
            return
        context = multiprocessing.get_context("spawn")
        receiver, sender = context.Pipe(duplex=False)
        arguments = (portable(job.task), sender)
        process = context.Process(target=work, args=arguments, name=f"diagnosis {job.id}", daemon=True)
        process.start()
        sender.close()
        try:
            outcome = self._watched(job, receiver)
        finally:
            _stopped(process)
            receiver.close()
        if outcome is not None:
            self._stored(lambda: self._kept(job, outcome))
        elif not job.cancelled.is_set() and not self._closing.is_set():
            at = f"at {job.reached.stage!r}, {job.reached.done_frac:.0%} done"
            reason = f"{how_ended(process.exitcode)}, {at}"
            self._stored(lambda: self._interrupted(job.id, reason))

    def _begun(self, job: Job) -> bool:
        """Wait for the turn of a job; False where it is not queued any more."""
        alive_s = time.monotonic()
        while not job.cancelled.is_set():
            turn = self._stored(lambda: self.store.begin(job.id, self.run_name))
            if turn is not Turn.LATER:
                return turn is Turn.NOW
            if time.monotonic() - alive_s >= ALIVE_EVERY_S:
                alive_s = time.monotonic()
                with suppress(DatabaseUnavailableError):
                    self.store.show_alive(self.worker)
                    for row in self.store.all():  # nobody waits for a process that has ended
                        self.tell_lost(row)
            if self._closing.wait(TURN_S):
                return False
        return False

    def _watched(self, job: Job, receiver: Connection[object, Message]) -> Finished | Failed | None:
        """What comes out of a job, or that it takes too long; None where it was stopped or its process ended."""
        alive_s = time.monotonic()
        end_s = alive_s + job.task.limits.time_s
        while not job.cancelled.is_set() and not self._closing.is_set():
            if time.monotonic() - alive_s >= ALIVE_EVERY_S:
                alive_s = time.monotonic()
                with suppress(DatabaseUnavailableError):
                    self.store.show_alive(self.worker)
                    if not self.store.is_running(job.id):  # another process has cancelled it
                        job.cancelled.set()
            if time.monotonic() > end_s:
                return beyond(job.task, "time", f"{job.task.limits.time_s:g} s", "JOULEPATH_DIAGNOSIS_TIME_LIMIT_S")
            try:
                message = receiver.recv() if receiver.poll(POLL_S) else None
            except (EOFError, OSError):
                return None
            if isinstance(message, Advanced):
                job.reached = message
                with suppress(DatabaseUnavailableError):
                    self.store.advance(job.id, message.stage, message.done_frac)
            elif message is not None:
                return message
        return None

    def _kept(self, job: Job, outcome: Finished | Failed) -> bool:
        if isinstance(outcome, Failed):
            return self.store.fail(job.id, outcome.problem, outcome.refused)
        return self.store.finish(job.id, outcome.documents)

    def _stored(self, call: Callable[[], Stored]) -> Stored | bool:
        """What a change of the database returns, tried again for a while when it is away."""
        for tries_left in range(TRIES - 1, -1, -1):
            try:
                return call()
            except DatabaseUnavailableError as error:
                LOG.warning("%s", error)
                if tries_left == 0 or self._closing.wait(1.0):
                    return False
        raise AssertionError("the last try returns")


def _stopped(process: SpawnProcess) -> None:
    """See to it that a process has ended; one that has sent its outcome ends by itself."""
    process.join(0.5)
    if process.is_alive():
        process.terminate()
        process.join(STOP_WAIT_S)
    if process.is_alive():
        process.kill()
        process.join()


def _is_lost(row: StoredDiagnosis, now: datetime) -> bool:
    """Whether the worker of a diagnosis is gone: its process on this host has ended, or it was silent for long."""
    if (now - row.updated).total_seconds() > LOST_AFTER_S:
        return True
    host, _, rest = row.worker.rpartition(":")[0].rpartition(":")
    if host != socket.gethostname()[:200] or not rest.isdecimal():
        return False
    pid = int(rest)
    if pid == os.getpid():
        return row.worker not in _running_here
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    except (PermissionError, OverflowError):
        return False
    return False
