"""What Prometheus is told: how long requests take and where, what waits and runs, what is kept, the process.

docs/operations.md says what each figure means. Labels are bounded: addresses as the API writes them, never as they
were asked for.
"""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Final

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector, disable_created_metrics
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4, generate_latest
from prometheus_client.registry import Collector

from app import VERSION
from app.observation import Stage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from prometheus_client.metrics_core import Metric
    from starlette.datastructures import State

    from app.caches import CacheFigures
    from app.diagnosing.use_cases import Diagnoses
    from app.http.admission import Admission
    from app.observation import Observation
    from app.service.service import Service

MEDIA_TYPE: Final = CONTENT_TYPE_PLAIN_0_0_4
METHODS: Final = frozenset({"GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS"})
OTHER: Final = "other"  # a method or an address that the service does not have
SECONDS: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)


disable_created_metrics()  # type: ignore[no-untyped-call]  # a third of all lines, to say when each was first seen


class Metrics:
    """The figures of one application; requests are added on the event loop, all is read from any thread.

    of_service: where the application is one of several that serve as one, what tells the text of all of them together;
    it is called on a thread of its own, and may raise NotReadyError.
    """

    def __init__(self, state: State) -> None:
        self.of_service: Callable[[], bytes] | None = None
        self._registry = CollectorRegistry()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="metrics")
        self._request_s = Histogram(
            "joulepath_request_seconds",
            "Time from a request to the end of its answer",
            ("method", "endpoint"),
            buckets=SECONDS,
            registry=self._registry,
        )
        self._stage_s = Histogram(
            "joulepath_stage_seconds",
            "Time of a request by stage: wait for a thread, search or plan charging stops, write the answer",
            ("endpoint", "stage"),
            buckets=SECONDS,
            registry=self._registry,
        )
        self._requests = Counter(
            "joulepath_requests", "Requests answered", ("method", "endpoint", "status"), registry=self._registry
        )
        self._labels = Counter(
            "joulepath_labels_settled", "Labels settled by searches", ("endpoint",), registry=self._registry
        )
        self._times: dict[tuple[str, str], Histogram] = {}
        self._stage_times: dict[tuple[str, Stage], Histogram] = {}
        ProcessCollector(registry=self._registry)
        self._registry.register(_Running(state))

    def count(self, method: str, endpoint: str, status: int, seconds: float, observed: Observation) -> None:
        """Add a request; method and endpoint of a bounded set."""
        times = self._times.get((method, endpoint))
        if times is None:  # looking up what is made costs a third of what labels() does
            times = self._times[method, endpoint] = self._request_s.labels(method, endpoint)
        times.observe(seconds)
        self._requests.labels(method, endpoint, str(status)).inc()
        for name, stage_s in observed.stage_s.items():
            stage_times = self._stage_times.get((endpoint, name))
            if stage_times is None:
                stage_times = self._stage_times[endpoint, name] = self._stage_s.labels(endpoint, name.value)
            stage_times.observe(stage_s)
        if observed.labels_settled:
            self._labels.labels(endpoint).inc(observed.labels_settled)

    def families(self) -> list[Metric]:
        """All figures of this process."""
        return list(self._registry.collect())

    async def text(self) -> bytes:
        """All figures, in the text format of Prometheus; also while requests hold all other threads.

        Raises NotReadyError where those of the other processes can't be had.
        """
        asked = self.of_service or (lambda: generate_latest(self._registry))
        return await asyncio.get_running_loop().run_in_executor(self._thread, asked)


class _Running(Collector):
    """Figures that are looked up when they are asked for; none of what has not started."""

    def __init__(self, state: State) -> None:
        self._state = state

    def collect(self) -> Iterator[Metric]:
        """All of them."""
        information = GaugeMetricFamily("joulepath_info", "Always 1; the version is in the label", labels=("version",))
        information.add_metric((VERSION,), 1.0)
        yield information
        admission: Admission | None = getattr(self._state, "admission", None)
        if admission is not None:
            yield from _searches(admission)
        diagnoses: Diagnoses | None = getattr(self._state, "diagnoses", None)
        if diagnoses is not None:
            yield _by_label("joulepath_diagnoses", "Diagnoses that wait and run", "state", diagnoses.jobs.counts)
        service: Service | None = getattr(self._state, "service", None)
        if service is not None:
            yield from _caches(service.caches.figures())
            loaded = {name: float(service.atlas.is_loaded(name)) for name in service.atlas.names}
            yield _by_label("joulepath_graph_loaded", "1 where a graph is loaded", "graph", loaded)


def _searches(admission: Admission) -> Iterator[Metric]:
    yield _by_label("joulepath_searches_waiting", "Searches that wait for a thread", "cost", admission.waiting)
    yield _by_label("joulepath_searches_running", "Searches that run", "cost", admission.running)
    unanswered = CounterMetricFamily(
        "joulepath_searches_unanswered", "Searches that were not answered", labels=("cost", "reason")
    )
    for (cost, outcome), count in admission.unanswered.items():
        unanswered.add_metric((cost.value, outcome.value), float(count))
    yield unanswered


def _caches(figures: Mapping[str, CacheFigures]) -> Iterator[Metric]:
    held = GaugeMetricFamily("joulepath_cache_bytes", "Bytes that a cache holds", labels=("cache",))
    counters = {
        name: CounterMetricFamily(f"joulepath_cache_{name}", text, labels=("cache",))
        for name, text in (
            ("hits", "What was asked of a cache and was there"),
            ("misses", "What was asked of a cache and had to be made"),
            ("dropped", "What a cache dropped to make room"),
        )
    }
    for kind, cache in figures.items():
        held.add_metric((kind,), float(cache.bytes))
        for name, counter in counters.items():
            count: int | None = getattr(cache, name)
            if count is not None:
                counter.add_metric((kind,), float(count))
    yield held
    yield from counters.values()


def _by_label(name: str, text: str, label: str, values: Mapping[Any, float]) -> GaugeMetricFamily:
    family = GaugeMetricFamily(name, text, labels=(label,))
    for value, number in values.items():  # by text, or by an enum of texts
        family.add_metric((str(value),), float(number))
    return family
