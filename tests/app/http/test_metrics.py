"""GET /metrics: figures that grow with what was asked, under labels that nobody from outside can add to."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import pytest
from prometheus_client.parser import text_string_to_metric_families
from starlette.testclient import TestClient

from app.caches import CacheFigures, CacheRegistry
from app.main import create_app
from tests.app.expected import CHAIN_LINK, check_problem

if TYPE_CHECKING:
    from collections.abc import Iterator

    from app.service.service import Service
    from app.settings import Settings

ROUTE: dict[str, Any] = {"start": [8.0, 46.5], "goal": [8.02, 46.52], "soc": 0.5}


@pytest.fixture
def client(settings: Settings, service: Service) -> Iterator[TestClient]:
    """A client of an application whose figures begin at nothing."""
    with TestClient(create_app(settings, service)) as started:
        yield started


def figures(client: TestClient) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    """Every sample of the page by its name and labels."""
    answer = client.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def of(name: str, **labels: str) -> tuple[str, tuple[tuple[str, str], ...]]:
    return name, tuple(sorted(labels.items()))


def test_a_route_counts_with_its_stages_and_the_labels_that_it_says_it_settled(client: TestClient) -> None:
    settled = 0
    for _ in range(3):
        answer = client.post("/route", json=ROUTE).json()
        settled += sum(stats["labels_settled"] for stats in answer["stats"])
    found = figures(client)
    assert found[of("joulepath_requests_total", method="POST", endpoint="/route", status="200")] == 3
    assert found[of("joulepath_request_seconds_count", method="POST", endpoint="/route")] == 3
    assert found[of("joulepath_labels_settled_total", endpoint="/route")] == settled > 0
    total_s = found[of("joulepath_request_seconds_sum", method="POST", endpoint="/route")]
    stages = {
        stage: found[of("joulepath_stage_seconds_sum", endpoint="/route", stage=stage)]
        for stage in ("wait", "search", "write")
    }
    assert all(seconds > 0.0 for seconds in stages.values())
    assert sum(stages.values()) <= total_s


@pytest.mark.parametrize(
    ("endpoint", "body"),
    [
        ("/matrix", {"sources": [[8.0, 46.5], [8.02, 46.5]], "targets": [[8.02, 46.52]], "soc": 0.5}),
        ("/range", {"origin": [8.0, 46.5], "soc": 0.5}),
    ],
)
def test_searches_of_other_kinds_count_the_labels_that_they_say_too(
    client: TestClient, endpoint: str, body: dict[str, Any]
) -> None:
    answer = client.post(endpoint, json=body)
    assert answer.status_code == 200, answer.text
    said = answer.json()
    stats = said["stats"]
    found = figures(client)
    assert found[of("joulepath_labels_settled_total", endpoint=endpoint)] == stats["labels_settled"] > 0
    assert found[of("joulepath_stage_seconds_count", endpoint=endpoint, stage="search")] == 1


def test_labels_of_figures_are_the_apis_own_whatever_is_asked(client: TestClient) -> None:
    client.get("/vehicles/vw-id4")
    before = set(figures(client))
    for k in range(30):
        client.get(f"/nothing/{k}")
        client.get(f"/vehicles/unknown-{k}")
        client.get(f"/graphs/grid/tiles/12/{k}/3.mvt")
        client.request(f"BREW{k}", "/route")
        client.get(f"/web/{k}.js")
        client.post("/simulate", json={"chain": [CHAIN_LINK], "vehicle": f"unknown-{k}"})
    added = {(name, labels) for name, labels in set(figures(client)) - before if "_bucket" not in name}
    endpoints = {dict(labels)["endpoint"] for _, labels in added if "endpoint" in dict(labels)}
    known = {"/vehicles/{id}", "/graphs/{name}/tiles/{z}/{x}/{y}.mvt", "/route", "/web", "/simulate", "/metrics"}
    assert endpoints <= known | {"other"}
    assert {dict(labels)["method"] for _, labels in added if "method" in dict(labels)} <= {"GET", "POST", "other"}
    assert len(added) < 60


def test_what_waits_runs_and_is_loaded_is_shown(client: TestClient) -> None:
    found = figures(client)
    for cost in ("short", "part", "long"):
        assert found[of("joulepath_searches_waiting", cost=cost)] == 0
        assert found[of("joulepath_searches_running", cost=cost)] == 0
        for reason in ("refused", "late", "abandoned"):
            assert found[of("joulepath_searches_unanswered_total", cost=cost, reason=reason)] == 0
    assert found[of("joulepath_diagnoses", state="queued")] == found[of("joulepath_diagnoses", state="running")] == 0
    assert found[of("joulepath_graph_loaded", graph="grid")] == 1
    assert found[of("process_resident_memory_bytes")] > 1e6
    assert found[of("process_open_fds")] > 3


def test_search_over_its_time_is_counted_as_late(settings: Settings, service: Service) -> None:
    hasty = settings.model_copy(update={"time_limit_s": 1e-9})
    with TestClient(create_app(hasty, service)) as client:
        check_problem(client.post("/route", json=ROUTE), 503, "time_limit")
        found = figures(client)
    assert found[of("joulepath_searches_unanswered_total", cost="short", reason="late")] == 1
    assert found[of("joulepath_requests_total", method="POST", endpoint="/route", status="503")] == 1


def test_tiles_that_are_kept_count_as_hits(client: TestClient) -> None:
    def tiles() -> list[float]:
        found = figures(client)
        return [found[of(f"joulepath_cache_{name}", cache="tiles")] for name in ("bytes", "hits_total", "misses_total")]

    client.get("/graphs/grid/tiles/11/1070/723.mvt")
    first = tiles()
    client.get("/graphs/grid/tiles/11/1070/723.mvt")
    second = tiles()
    assert first[0] == second[0] > 0
    assert (second[1] - first[1], second[2] - first[2]) == (1, 0)


def test_vehicles_and_what_they_know_show_as_caches_that_are_hit_when_asked_again(client: TestClient) -> None:
    def spaces() -> tuple[float, float]:
        found = figures(client)
        return found[of("joulepath_cache_hits_total", cache="spaces")], found[
            of("joulepath_cache_misses_total", cache="spaces")
        ]

    windy = {**ROUTE, "conditions": {"wind_speed_mps": 3.5, "wind_from_deg": 10}}
    client.post("/route", json=ROUTE)
    before = spaces()
    assert client.post("/route", json=windy).status_code == 200
    once = spaces()
    client.post("/route", json=windy)
    twice = spaces()
    assert once[1] == before[1] + 1
    assert twice[1] == once[1]
    assert twice[0] > once[0]
    found = figures(client)
    assert min(found[of("joulepath_cache_bytes", cache=kind)] for kind in ("spaces", "drives", "workspaces")) > 0


def test_figures_are_read_while_requests_hold_all_threads(settings: Settings, service: Service) -> None:
    app = create_app(settings, service)
    let_go = threading.Event()

    @app.get("/held")
    def held() -> None:
        let_go.wait(60.0)

    with TestClient(app) as client, ThreadPoolExecutor(51) as threads:
        try:
            for _ in range(50):  # more than the framework's threads
                threads.submit(client.get, "/held")
            time.sleep(0.5)
            assert threads.submit(client.get, "/metrics").result(20.0).status_code == 200
        finally:
            let_go.set()


def test_figures_are_there_before_the_service_has_started(settings: Settings) -> None:
    found = figures(TestClient(create_app(settings)))
    assert not any(name.startswith("joulepath_searches") for name, _ in found)
    assert found[of("process_resident_memory_bytes")] > 1e6


def test_caches_of_one_kind_are_added_up_and_what_is_not_counted_is_left_unsaid() -> None:
    registry = CacheRegistry()
    registry.add(lambda: {"views": CacheFigures(100, hits=2, misses=1)})
    registry.add(lambda: {"views": CacheFigures(50), "drives": CacheFigures(7)})
    assert registry.figures() == {
        "views": CacheFigures(150, hits=2, misses=1),
        "drives": CacheFigures(7),
    }
