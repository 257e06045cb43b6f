"""What is observed of a request while it is answered: where its time goes, and what it was about.

The observation is a context variable, so that use cases need not be handed it; without one nothing is noted.
"""

from __future__ import annotations

import time
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import StrEnum
from threading import Lock
from typing import TYPE_CHECKING, Final

from opentelemetry import trace

if TYPE_CHECKING:
    from collections.abc import Iterator

INLINE: Final = "inline"  # a vehicle that the request describes; its numbers are nobody else's business
TRACER: Final = trace.get_tracer("joulepath")  # does nothing until somebody sets OpenTelemetry up


class Stage(StrEnum):
    """Where the time of a request goes: until a thread is free, on the search, on the words of the answer.

    What a request for charging stops takes until its answer is known is planning, not search.
    """

    WAIT = "wait"
    SEARCH = "search"
    PLAN = "plan"
    WRITE = "write"


@dataclass(slots=True)
class Observation:
    """One request; to be added to from any thread.

    graph, vehicle: that it was answered on, names of things that exist, or INLINE. labels_settled: by its searches.
    problem: code of the error that was answered. stage_s: time [s] by stage, added up over threads that worked side
    by side.
    """

    request_id: str
    graph: str | None = None
    vehicle: str | None = None
    labels_settled: int = 0
    problem: str | None = None
    stage_s: dict[Stage, float] = field(default_factory=dict)
    _lock: Lock = field(default_factory=Lock)

    def add_time(self, stage: Stage, seconds: float) -> None:
        """Add to the time of a stage [s]."""
        with self._lock:
            self.stage_s[stage] = self.stage_s.get(stage, 0.0) + seconds

    def add_labels(self, count: int) -> None:
        """Add labels that a search has settled."""
        with self._lock:
            self.labels_settled += count


_ACTIVE: Final[ContextVar[Observation | None]] = ContextVar("observation", default=None)


def observation() -> Observation | None:
    """What is observed in this context, or None."""
    return _ACTIVE.get()


@contextmanager
def observing(observed: Observation) -> Iterator[None]:
    """Within it, what happens in this context is noted."""
    token = _ACTIVE.set(observed)
    try:
        yield
    finally:
        _ACTIVE.reset(token)


@contextmanager
def stage(name: Stage) -> Iterator[None]:
    """Within it, time counts as that of a stage, and is a span where the request is traced."""
    observed = _ACTIVE.get()
    if observed is None:
        yield
        return
    began = time.perf_counter()
    try:
        if trace.get_current_span().is_recording():
            with TRACER.start_as_current_span(name.value):
                yield
        else:
            yield
    finally:
        observed.add_time(name, time.perf_counter() - began)


def note_subject(*, graph: str | None = None, vehicle: str | None = None) -> None:
    """Note what a request is answered on."""
    observed = _ACTIVE.get()
    if observed is not None:
        observed.graph = graph or observed.graph
        observed.vehicle = vehicle or observed.vehicle


def note_labels(count: int) -> None:
    """Note labels that a search of the request has settled."""
    observed = _ACTIVE.get()
    if observed is not None:
        observed.add_labels(count)


def note_problem(code: str) -> None:
    """Note the error that is answered."""
    observed = _ACTIVE.get()
    if observed is not None:
        observed.problem = code
