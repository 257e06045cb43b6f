"""GET /metrics of several processes: the sums of all, which never go down."""

from __future__ import annotations

import os
import signal
from http.client import HTTPConnection
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from prometheus_client.metrics_core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.parser import text_string_to_metric_families

from app.serving.figures import Tally, added_up
from tests.app.server_process import PATIENCE_S
from tests.app.serving.supervised import TRIP, WORKERS, Supervised, supervised, until

if TYPE_CHECKING:
    from collections.abc import Iterator

    from prometheus_client.metrics_core import Metric

Labels = tuple[tuple[str, str], ...]
on_linux = pytest.mark.skipif(not Path("/proc/self/smaps_rollup").exists(), reason="processes are looked at in /proc")
GROWING = ("_total", "_count", "_sum", "_bucket")


def read(text: str) -> dict[tuple[str, Labels], float]:
    """Every sample of a page by its name and labels, which must not be there twice."""
    found: dict[tuple[str, Labels], float] = {}
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            key = (sample.name, tuple(sorted(sample.labels.items())))
            assert key not in found
            found[key] = sample.value
    return found


def scraped(service: Supervised, connection: HTTPConnection | None = None) -> dict[tuple[str, Labels], float]:
    asked = connection or HTTPConnection("127.0.0.1", service.server.port, timeout=PATIENCE_S)
    asked.request("GET", "/metrics")
    answer = asked.getresponse()
    text = answer.read().decode()
    assert answer.status == 200, text
    if connection is None:
        asked.close()
    return read(text)


def of(name: str, **labels: str) -> tuple[str, Labels]:
    return name, tuple(sorted(labels.items()))


ROUTES = of("joulepath_requests_total", method="POST", endpoint="/route", status="200")


@pytest.fixture
def service(tmp_path: Path, own_graphs: Path) -> Iterator[Supervised]:
    with supervised(tmp_path, own_graphs) as running:
        yield running


@on_linux
def test_any_worker_tells_what_all_have_counted(service: Supervised, both: dict[int, HTTPConnection]) -> None:
    settled = 0
    for times, connection in enumerate(both.values(), 2):
        for _ in range(times):
            status, answer = service.ask("POST", "/route", TRIP, connection=connection)
            assert status == 200
            settled += sum(stats["labels_settled"] for stats in answer["stats"])
    pages = [scraped(service, connection) for connection in both.values()]
    for page in pages:
        assert page[ROUTES] == 2 + 3
        assert page[of("joulepath_request_seconds_count", method="POST", endpoint="/route")] == 5
        assert page[of("joulepath_request_seconds_bucket", method="POST", endpoint="/route", le="+Inf")] == 5
        assert page[of("joulepath_labels_settled_total", endpoint="/route")] == settled > 0
        assert page[of("joulepath_graph_loaded", graph="grid")] == 1
        assert page[of("joulepath_workers")] == WORKERS
        assert [value for (name, _), value in page.items() if name == "joulepath_info"] == [1]
    processes = {dict(labels)["worker"] for name, labels in pages[0] if name == "process_resident_memory_bytes"}
    assert processes == {"0", "1", "supervisor"}
    assert min(pages[0][of("process_resident_memory_bytes", worker=process)] for process in processes) > 1e6


@on_linux
def test_sums_do_not_go_down_when_a_worker_is_killed_and_replaced(
    service: Supervised, both: dict[int, HTTPConnection]
) -> None:
    (killed, here), (_, there) = both.items()
    for connection in (here, here, here, there):
        assert service.ask("POST", "/route", TRIP, connection=connection)[0] == 200
    before = scraped(service, there)
    assert before[ROUTES] == 4
    os.kill(killed, signal.SIGKILL)
    until("the worker is gone", lambda: killed not in service.workers())
    alone = scraped(service, there)
    service.all_workers()
    for _ in range(4):
        assert service.ask("POST", "/route", TRIP)[0] == 200
    after = scraped(service)
    for earlier, later in ((before, alone), (alone, after)):
        growing = {key for key in earlier if key[0].endswith(GROWING) and not key[0].startswith("process_")}
        assert len(growing) > 20
        assert {key for key in growing if later[key] < earlier[key]} == set()
    assert after[ROUTES] == 8
    assert after[of("joulepath_workers_ended_total")] == 1


@on_linux
def test_worker_that_does_not_answer_counts_with_what_it_told_last(
    service: Supervised, both: dict[int, HTTPConnection]
) -> None:
    (stopped, here), (_, there) = both.items()
    for connection in (here, there):
        assert service.ask("POST", "/route", TRIP, connection=connection)[0] == 200
    assert scraped(service, there)[ROUTES] == 2
    os.kill(stopped, signal.SIGSTOP)
    try:
        for _ in range(2):
            assert scraped(service, there)[ROUTES] == 2
    finally:
        os.kill(stopped, signal.SIGCONT)
    assert service.ask("POST", "/route", TRIP, connection=here)[0] == 200
    until("its figures are there again", lambda: scraped(service, there)[ROUTES] == 3)


@on_linux
def test_without_the_supervisor_figures_are_not_ready_and_not_those_of_one_worker(service: Supervised) -> None:
    service.signal(signal.SIGSTOP)
    try:
        status, problem = service.ask("GET", "/metrics")
    finally:
        service.signal(signal.SIGCONT)
    assert (status, problem["code"]) == (503, "not_ready")
    for _ in range(2):  # the answer that came late is not taken for a later one
        assert service.ask("POST", "/route", TRIP)[0] == 200
        asked = scraped(service)[ROUTES]
    assert asked == 2


def counted(count: float, queued: float, loaded: float) -> list[Metric]:
    requests = CounterMetricFamily("joulepath_requests", "Requests", labels=("endpoint",))
    requests.add_metric(("/route",), count)
    diagnoses = GaugeMetricFamily("joulepath_diagnoses", "Diagnoses", labels=("state",))
    diagnoses.add_metric(("queued",), queued)
    graphs = GaugeMetricFamily("joulepath_graph_loaded", "Graphs", labels=("graph",))
    graphs.add_metric(("grid",), loaded)
    memory = GaugeMetricFamily("process_resident_memory_bytes", "Memory")
    memory.add_metric((), 100.0)
    processor = CounterMetricFamily("process_cpu_seconds", "Processor time")
    processor.add_metric((), 2.0)
    return [requests, diagnoses, graphs, memory, processor]


def test_of_a_worker_that_has_ended_its_counters_stay_and_nothing_else() -> None:
    tally = Tally()
    tally.hear(0, counted(5.0, 1.0, 1.0))
    tally.hear(1, counted(7.0, 2.0, 1.0))
    page = read(tally.text().decode())
    assert page[of("joulepath_requests_total", endpoint="/route")] == 12.0
    assert page[of("joulepath_diagnoses", state="queued")] == 3.0
    assert page[of("process_cpu_seconds_total", worker="1")] == 2.0
    for ended in (1, 2, 3):
        tally.end(1)
        page = read(tally.text().decode())
        assert page[of("joulepath_requests_total", endpoint="/route")] == 5.0 + 7.0 * ended
        assert page[of("joulepath_diagnoses", state="queued")] == 1.0
        assert of("process_cpu_seconds_total", worker="1") not in page
        assert page[of("joulepath_workers_ended_total")] == ended
        tally.hear(1, counted(7.0, 2.0, 1.0))
    tally.end(0)
    tally.end(1)
    assert read(tally.text().decode())[of("joulepath_requests_total", endpoint="/route")] == 5.0 + 7.0 * 4


@pytest.mark.parametrize(("loaded", "expected"), [((1.0, 1.0), 1.0), ((1.0, 0.0), 0.0), ((1.0,), 0.0)])
def test_graph_counts_as_loaded_where_all_workers_have_it(loaded: tuple[float, ...], expected: float) -> None:
    (graphs,) = (
        family
        for family in added_up([counted(1.0, 0.0, each) for each in loaded], 2)
        if family.name == "joulepath_graph_loaded"
    )
    assert [sample.value for sample in graphs.samples] == [expected]
