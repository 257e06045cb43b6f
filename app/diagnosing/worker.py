"""One diagnosis in a process of its own, so that searches and the event loop keep their processor."""

from __future__ import annotations

import json
import logging
import multiprocessing
import os
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from app.diagnosing.documents import Documents, documents_of
from app.diagnosing.errors import RefusedFile, UnusableRecordingsError
from app.diagnosing.order import carry_out
from app.errors import problem_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from multiprocessing.connection import Connection
    from pathlib import Path

    from app.diagnosing.order import DiagnosisOrder

LOG: Final = logging.getLogger(__name__)
NICENESS: Final = 10  # of 19: what the service answers meanwhile goes first
TOLD_EVERY_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class Advanced:
    """How far it is: what is being done, and the share of the whole that is done."""

    stage: str
    done_frac: float


@dataclass(frozen=True, slots=True)
class Finished:
    """It is done; refused: JSON text."""

    documents: Documents
    refused: str


@dataclass(frozen=True, slots=True)
class Failed:
    """It can't be done: the problem and the files that could not be used, as JSON texts."""

    problem: str
    refused: str


Message = Advanced | Finished | Failed


def portable(order: DiagnosisOrder) -> DiagnosisOrder:
    """An order that can be sent to another process: read-only views of mappings can't."""
    vehicle = replace(order.vehicle, sources=dict(order.vehicle.sources), sd=dict(order.vehicle.sd))
    return replace(order, vehicle=vehicle)


def work(order: DiagnosisOrder, folder: Path, diagnosis_id: str, address: str, sender: Connection) -> None:
    """Carry out an order whose files are relative to a folder, and send what comes of it; runs in its own process.

    address: path of the diagnosis in the service, which problems name.
    """
    with suppress(OSError):
        os.nice(NICENESS)
    os.chdir(folder)  # so that messages name files as they were sent
    parent = multiprocessing.parent_process()
    reporter = _Reporter(sender)
    message: Message
    try:
        diagnosed = carry_out(order, reporter.told, lambda: parent is not None and not parent.is_alive())
        documents = documents_of(diagnosed, diagnosis_id=diagnosis_id)
        message = Finished(documents, refused_json(diagnosed.refused))
    except Exception as error:  # whatever it is, the diagnosis has failed by it
        problem = problem_of(error, address)
        if problem.status >= 500:
            LOG.exception("diagnosis %s", diagnosis_id)
        refused = error.refused if isinstance(error, UnusableRecordingsError) else ()
        message = Failed(problem.model_dump_json(), refused_json(refused))
    sender.send(message)
    sender.close()


def refused_json(refused: Sequence[RefusedFile]) -> str:
    """Files that could not be used, as they are stored."""
    return json.dumps([{"file": one.file, "error": one.error} for one in refused])


class _Reporter:
    """Sends progress, but not each little step of it."""

    def __init__(self, sender: Connection) -> None:
        self._sender = sender
        self._stage = ""
        self._sent_s = 0.0

    def told(self, stage: str, done: float) -> None:
        now = time.monotonic()
        if stage != self._stage or now - self._sent_s >= TOLD_EVERY_S:
            self._stage, self._sent_s = stage, now
            self._sender.send(Advanced(stage, min(max(done, 0.0), 1.0)))
