"""Several processes that serve as one, with a supervisor and workers as they really run."""

from __future__ import annotations

import os
import re
import signal
from contextlib import ExitStack
from dataclasses import replace
from http.client import HTTPConnection
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from tests.app.conftest import street_grid
from tests.app.server_process import received
from tests.app.serving.supervised import TRIP, WORKERS, Askers, Supervised, supervised, until

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph

pytestmark = pytest.mark.skipif(not Path("/proc/self/smaps_rollup").exists(), reason="processes are looked at in /proc")
SEGMENT = re.compile(r"^\S+ \S+ \S+ \S+ (\d+) +/memfd:joulepath-grid .*\n((?:\w+: .*\n)*)", re.MULTILINE)


def slower() -> RoadGraph:
    """The grid with half the speed on all its streets."""
    grid = street_grid("grid", Terrain.SYNTHETIC)
    return replace(grid, speed_limit_mps=0.5 * grid.speed_limit_mps)


def descriptors(pid: int) -> int:
    return len(os.listdir(f"/proc/{pid}/fd"))


def test_all_workers_answer_on_one_address(running: Supervised) -> None:
    before = {pid: descriptors(pid) for pid in running.all_workers()}
    with ExitStack() as opened:
        connections = [HTTPConnection("127.0.0.1", running.server.port, timeout=30.0) for _ in range(32)]
        for connection in connections:
            opened.callback(connection.close)
            connection.connect()
        assert {running.ask("GET", "/healthz", connection=connection)[0] for connection in connections} == {200}
        taken = {pid: descriptors(pid) - count for pid, count in before.items()}
    assert len(taken) == WORKERS
    assert sum(taken.values()) >= len(connections)
    assert min(taken.values()) > 0


def test_graph_lies_in_memory_once(running: Supervised) -> None:
    resident: dict[str, list[float]] = {}
    proportional = 0.0
    for pid in running.all_workers():
        for number, text in SEGMENT.findall(Path(f"/proc/{pid}/smaps").read_text()):
            figures = dict(re.findall(r"(\w+): +(\d+) kB", text))
            resident.setdefault(number, []).append(float(figures["Rss"]))
            proportional += float(figures["Pss"])
    assert len(resident) == 1, "each worker has memory of its own"
    (of_workers,) = resident.values()
    assert len(of_workers) == WORKERS
    assert proportional == pytest.approx(max(of_workers), abs=4.0 * WORKERS)


def test_memory_of_a_graph_goes_when_it_is_replaced(running: Supervised, own_graphs: Path) -> None:
    for graph in (slower(), street_grid("grid", Terrain.SYNTHETIC)):
        save_graph(graph, own_graphs / "grid")
        assert running.ask("POST", "/reload")[1]["replaced"] == ["grid"]
    for pid in (running.pid, *running.all_workers()):
        links = [os.readlink(entry) for entry in Path(f"/proc/{pid}/fd").iterdir() if entry.is_symlink()]
        assert sum("memfd:joulepath-grid" in link for link in links) == 1


def test_reload_asked_of_one_worker_holds_for_all_and_fails_no_request(running: Supervised, own_graphs: Path) -> None:
    with Askers(running, 4) as asking:
        for k in range(4):
            save_graph(slower() if k % 2 == 0 else street_grid("grid", Terrain.SYNTHETIC), own_graphs / "grid")
            status, changed = running.ask("POST", "/reload")
            assert (status, changed["replaced"]) == (200, ["grid"])
            answered = {running.ask("POST", "/route", TRIP)[1]["routes"][0]["duration_s"] for _ in range(16)}
            assert len(answered) == 1
            asking.await_more(8)
    assert set(asking.outcomes) == {200}
    assert len(asking.durations) == 2
    assert running.ask("POST", "/reload")[1] == {"added": [], "replaced": [], "removed": [], "refused": []}


def test_sighup_takes_in_changed_graphs_without_a_failed_request(running: Supervised, own_graphs: Path) -> None:
    workers = running.all_workers()
    with Askers(running, 4) as asking:
        for k in range(2):
            save_graph(slower() if k % 2 == 0 else street_grid("grid", Terrain.SYNTHETIC), own_graphs / "grid")
            reloads = running.log.count("graphs reloaded: Reloaded(added=(), replaced=('grid',)")
            running.signal(signal.SIGHUP)
            said = "graphs reloaded: Reloaded(added=(), replaced=('grid',)"
            until("graphs are reloaded", lambda: running.log.count(said) > reloads)  # noqa: B023 - called at once
            asking.await_more(8)
    assert set(asking.outcomes) == {200}
    assert running.all_workers() == workers


def test_damaged_graph_is_refused_and_stays_as_it_was(running: Supervised, own_graphs: Path) -> None:
    save_graph(street_grid("other", Terrain.SYNTHETIC), own_graphs / "other")
    path = own_graphs / "other" / "length_m.npy"
    path.write_bytes(path.read_bytes()[:-8])
    status, changed = running.ask("POST", "/reload")
    assert status == 200
    assert [refused["name"] for refused in changed["refused"]] == ["other"]
    (own_graphs / "other" / "meta.json").write_text("{")
    status, problem = running.ask("POST", "/reload")
    assert (status, problem["code"]) == (409, "graph_damaged")
    for file in (own_graphs / "other").iterdir():
        file.unlink()
    (own_graphs / "other").rmdir()
    assert running.ask("POST", "/route", TRIP)[0] == 200


def test_killed_worker_is_started_again_while_the_others_answer(running: Supervised) -> None:
    victim, *others = sorted(running.all_workers())
    with Askers(running, 4) as asking:
        os.kill(victim, signal.SIGKILL)
        asking.await_more(20)
        assert running.all_workers() > set(others)
        assert victim not in running.workers()
        asking.await_more(20)
    assert set(asking.outcomes) <= {200, -1}
    assert asking.outcomes[-1] <= 4, "more failed than what the killed worker was asked"
    assert f"worker {victim} ended (SIGKILL)" in running.log


def test_stopping_ends_all_within_the_time_and_answers_what_has_begun(tmp_path: Path, own_graphs: Path) -> None:
    with supervised(tmp_path, own_graphs, JOULEPATH_STOP_LIMIT_S="3") as service:
        workers = service.all_workers()
        half = [
            service.server.connect(b"POST /route HTTP/1.1\r\nHost: a\r\nContent-Length: 9\r\n\r\n{") for _ in workers
        ]
        with Askers(service, 2):
            service.signal(signal.SIGTERM)
            assert service.server.process.wait(15.0) == 0  # a body may take 20 s
        assert not any(Path(f"/proc/{pid}").exists() for pid in workers)
        for connection in half:
            received(connection)
            connection.close()


def test_workers_stop_when_their_supervisor_is_killed(tmp_path: Path, own_graphs: Path) -> None:
    with supervised(tmp_path, own_graphs) as service:
        workers = service.all_workers()
        service.signal(signal.SIGKILL)
        until("workers end", lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers))


def test_service_that_can_not_start_says_why_and_ends(tmp_path: Path, own_graphs: Path) -> None:
    with pytest.raises(AssertionError, match="vehicle 'tank'"):
        supervised(tmp_path, own_graphs, JOULEPATH_DEFAULT_VEHICLE="tank").__enter__()
