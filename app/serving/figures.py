"""Figures of several processes as those of one service: what counts is added up, also of processes that are gone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.exposition import generate_latest
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

COUNTING: Final = frozenset({"counter", "histogram"})  # types that only grow
PROCESS: Final = "process_"  # begins the names of what each process has for itself
LEAST: Final = frozenset({"joulepath_info", "joulepath_graph_loaded"})  # 1 where it is so of all
SUPERVISOR: Final = "supervisor"


class Tally:
    """What the workers of a service have said of themselves, last, by their slots; not for several threads."""

    def __init__(self) -> None:
        self._last: dict[int, Sequence[Metric]] = {}
        self._of_ended: list[Metric] = []
        self._ended = 0
        self._own = CollectorRegistry()
        ProcessCollector(registry=self._own)

    def hear(self, slot: int, figures: Sequence[Metric]) -> None:
        """Take what a worker says in place of what it said before."""
        self._last[slot] = figures

    def end(self, slot: int) -> None:
        """A worker is gone: what it has counted stays, as far as it has said it."""
        self._ended += 1
        last = self._last.pop(slot, ())
        counted = [family for family in last if family.type in COUNTING and not family.name.startswith(PROCESS)]
        self._of_ended = added_up([self._of_ended, counted])

    def text(self) -> bytes:
        """All figures of the service, in the text format of Prometheus."""
        heard = dict(sorted(self._last.items()))
        registry = CollectorRegistry()
        registry.register(_Fixed(added_up([*map(_of_service, heard.values()), self._of_ended], len(heard))))
        by_process = {str(slot): figures for slot, figures in heard.items()} | {SUPERVISOR: [*self._own.collect()]}
        registry.register(_Fixed(_labelled(by_process)))
        registry.register(_Fixed(self._workers(len(heard))))
        return generate_latest(registry)

    def _workers(self, heard: int) -> list[Metric]:
        workers = Metric("joulepath_workers", "Workers whose figures are in these", "gauge")
        workers.add_sample(workers.name, {}, float(heard))
        ended = Metric("joulepath_workers_ended", "Workers that have ended", "counter")
        ended.add_sample(f"{ended.name}_total", {}, float(self._ended))
        return [workers, ended]


class _Fixed(Collector):
    def __init__(self, families: Iterable[Metric]) -> None:
        self._families = families

    def collect(self) -> Iterator[Metric]:
        yield from self._families


def added_up(figures: Sequence[Sequence[Metric]], processes: int = 0) -> list[Metric]:
    """The families of several processes as one: samples of equal names and labels are added up.

    Of those that are 1 or 0 the least stays, 0 where fewer than so many processes have them.
    """
    families: dict[str, Metric] = {}
    values: dict[str, dict[tuple[str, tuple[tuple[str, str], ...]], list[float]]] = {}
    for family in (family for each in figures for family in each):
        families.setdefault(family.name, family)
        samples = values.setdefault(family.name, {})
        for sample in family.samples:
            samples.setdefault((sample.name, tuple(sample.labels.items())), []).append(sample.value)
    merged: list[Metric] = []
    for name, first in families.items():
        whole = Metric(name, first.documentation, first.type)
        for (sample_name, labels), found in values[name].items():
            least = min(found) if len(found) >= processes else 0.0
            whole.add_sample(sample_name, dict(labels), least if name in LEAST else sum(found))
        merged.append(whole)
    return merged


def _of_service(figures: Iterable[Metric]) -> list[Metric]:
    return [family for family in figures if not family.name.startswith(PROCESS)]


def _labelled(by_process: Mapping[str, Iterable[Metric]]) -> list[Metric]:
    """What each process has for itself, with a label that says which."""
    families: dict[str, Metric] = {}
    for process, figures in by_process.items():
        for family in figures:
            if family.name.startswith(PROCESS):
                whole = families.setdefault(family.name, Metric(family.name, family.documentation, family.type))
                for sample in family.samples:
                    whole.add_sample(sample.name, {**sample.labels, "worker": process}, sample.value)
    return list(families.values())
