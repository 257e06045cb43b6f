"""One diagnosis in a process of its own, so that searches and the event loop keep their processor."""

from __future__ import annotations

import importlib
import json
import logging
import multiprocessing
import os
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from app.diagnosing.documents import documents_of
from app.diagnosing.limits import go_first, held_memory
from app.diagnosing.order import carry_out
from app.errors.diagnosing import DiagnosisLimitError, RefusedFile, UnusableRecordingsError, storable
from app.errors.table import problem_of
from app.store.diagnoses import DiagnosisDocuments

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from multiprocessing.connection import Connection
    from pathlib import Path

    from app.diagnosing.limits import JobLimits
    from app.diagnosing.order import DiagnosisOrder, Progress
    from diagnosis.answer.results import Diagnosis
    from routing.planner import Planner

LOG: Final = logging.getLogger(__name__)
NICENESS: Final = 10  # of 19: what the service answers meanwhile goes first
TOLD_EVERY_S: Final = 0.2
DIAGNOSING_SHARE: Final = 0.7  # of all the time, about, where a graph is matched to as well


@dataclass(frozen=True, slots=True)
class Task:
    """An order that is stored under an id; folder: what its files are relative to.

    graph_dir: folder of the graph to which its recordings are matched, None for none.
    """

    diagnosis_id: str
    order: DiagnosisOrder
    folder: Path
    limits: JobLimits
    graph_dir: Path | None = None


@dataclass(frozen=True, slots=True)
class Advanced:
    """How far it is: what is being done, and the share of the whole that is done."""

    stage: str
    done_frac: float


@dataclass(frozen=True, slots=True)
class Finished:
    """It is done, and this is what it leaves."""

    documents: DiagnosisDocuments


@dataclass(frozen=True, slots=True)
class Failed:
    """It can't be done: the problem and the files that could not be used, as JSON texts."""

    problem: str
    refused: str


Message = Advanced | Finished | Failed


def portable(task: Task) -> Task:
    """A task that can be sent to another process: read-only views of mappings can't."""
    vehicle = task.order.vehicle
    charging = vehicle.charging
    if charging is not None:
        charging = replace(charging, sources=dict(charging.sources))
    plain = replace(vehicle, sources=dict(vehicle.sources), sd=dict(vehicle.sd), charging=charging)
    return replace(task, order=replace(task.order, vehicle=plain))


def work(task: Task, sender: Connection) -> None:
    """Carry out a task, and send what comes of it; runs in its own process."""
    with suppress(OSError):
        os.nice(NICENESS)
    go_first()
    os.chdir(task.folder)  # so that messages name files as they were sent
    parent = multiprocessing.parent_process()
    reporter = _Reporter(sender)
    message: Message | None = None
    try:
        message = Finished(_documents(task, reporter.advanced, lambda: parent is not None and not parent.is_alive()))
    except MemoryError:
        pass  # its frames hold what there was no memory beside: they go before anything is said
    except Exception as error:  # whatever it is, the diagnosis has failed by it
        problem = problem_of(error, f"/diagnoses/{task.diagnosis_id}")
        if problem.status >= 500:
            LOG.exception("diagnosis %s", task.diagnosis_id)
        refused = error.refused if isinstance(error, UnusableRecordingsError) else ()
        message = Failed(problem.model_dump_json(), refused_json(refused))
    if message is None:
        message = beyond(task, "memory", f"{task.limits.memory_bytes / 1e9:.3g} GB", "JOULEPATH_DIAGNOSIS_MEMORY_BYTES")
    sender.send(message)
    sender.close()


def beyond(task: Task, what: str, limit: str, setting: str) -> Failed:
    """What comes of a task that takes more than it may."""
    problem = problem_of(DiagnosisLimitError(what, limit, setting), f"/diagnoses/{task.diagnosis_id}")
    return Failed(problem.model_dump_json(), refused_json(()))


def headline(diagnosis: Diagnosis) -> str:
    """The first thing that a diagnosis concludes."""
    concluded = [finding.text for finding in diagnosis.findings] + [error.text for error in diagnosis.parameter_errors]
    concluded += [remainder.text for remainder in diagnosis.unexplained]
    return concluded[0] if concluded else diagnosis.text


def refused_json(refused: Sequence[RefusedFile]) -> str:
    """Files that could not be used, as they are stored."""
    return json.dumps([{"file": file.file, "error": file.error} for file in refused])


def _documents(task: Task, advanced: Progress, cancelled: Callable[[], bool]) -> DiagnosisDocuments:
    """What a task leaves; raises what carrying it out raises, MemoryError where it takes more memory than it may."""
    # what is imported here takes a while, and the process that serves needs none of it
    importlib.import_module("diagnosis.engine")  # so that it is there before memory is limited
    from routing.graph.files import load_graph
    from routing.planner import Planner

    planner = None if task.graph_dir is None else Planner(load_graph(task.graph_dir))
    with held_memory(task.limits.memory_bytes):
        return _carried_out(task, planner, advanced, cancelled)


def _carried_out(
    task: Task, planner: Planner | None, advanced: Progress, cancelled: Callable[[], bool]
) -> DiagnosisDocuments:
    from app.diagnosing.places import on_graph
    from app.diagnosing.timelines import trip_documents
    from app.diagnosing.tracks import track_features
    from diagnosis.matching.matched_drives import MatchedDrives

    drives = None if planner is None else MatchedDrives(planner.graph)
    share = 1.0 if planner is None else DIAGNOSING_SHARE
    diagnosed = carry_out(task.order, lambda stage, done: advanced(stage, share * done), cancelled, drives=drives)
    residuals: str | None = None
    warnings: tuple[str, ...] = ()
    if planner is not None and drives is not None:

        def laid_out(stage: str, done: float) -> None:
            advanced(stage, share + (1.0 - share) * done)

        laid = on_graph(diagnosed, planner, drives, task.order.vehicle, laid_out)
        diagnosed, residuals = laid.diagnosed, laid.places
        warnings = tuple(f"not on the graph: {trip}" for trip in laid.unmatched)
    documents = documents_of(diagnosed, diagnosis_id=task.diagnosis_id)
    return DiagnosisDocuments(
        result=documents.result,
        report=documents.report,
        effects=documents.effects,
        refused=refused_json(diagnosed.refused),
        verdict=diagnosed.diagnosis.verdict.value,
        text=storable(headline(diagnosed.diagnosis)),
        warnings=json.dumps([storable(warning) for warning in warnings]),
        residuals=storable(residuals or json.dumps(track_features(diagnosed), ensure_ascii=False, allow_nan=False)),
        trips=trip_documents(diagnosed, task.diagnosis_id),
    )


class _Reporter:
    """Sends progress, but not each little step of it."""

    def __init__(self, sender: Connection) -> None:
        self._sender = sender
        self._stage = ""
        self._sent_s = 0.0

    def advanced(self, stage: str, done: float) -> None:
        now = time.monotonic()
        if stage != self._stage or now - self._sent_s >= TOLD_EVERY_S:
            self._stage, self._sent_s = stage, now
            self._sender.send(Advanced(stage, min(max(done, 0.0), 1.0)))
