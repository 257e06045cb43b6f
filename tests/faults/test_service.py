"""A running service under load and faults: it goes on answering, and refuses in its own words what it can't answer."""

from __future__ import annotations

import asyncio
import json
import random
import statistics
import time
from shutil import copytree
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from routing.graph.files import load_graph
from tests.apart import run_apart
from tests.faults.asking import Answer, Service
from tests.faults.served import ROOT, Served, served
from tests.fuzz.api import faults_in, hand_made_answers

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

GRAPH = "coquimbo"
TIME_LIMIT_S = 10.0
TOWN_LAT, TOWN_LON = -29.9, -71.25


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A service on a graph of its own, which tests may damage."""
    folder = tmp_path_factory.mktemp("service")
    copytree(ROOT / "data" / "graphs" / GRAPH, folder / "graphs" / GRAPH)
    settings = {"graph_dirs": folder / "graphs", "default_graph": GRAPH, "time_limit_s": TIME_LIMIT_S}
    with served(folder, settings) as service:
        yield service


@pytest.fixture(scope="module")
def places() -> list[dict[str, float]]:
    """Places on the roads of the graph."""
    graph = load_graph(ROOT / "data" / "graphs" / GRAPH)
    dice = random.Random(3)
    nodes = dice.sample(range(graph.node_count), 200)
    return [{"lat": float(graph.node_lat_deg[k]), "lon": float(graph.node_lon_deg[k])} for k in nodes]


@pytest.fixture(scope="module")
def near() -> list[dict[str, float]]:
    """Places in one part of the town, between which searches are short on any machine."""
    graph = load_graph(ROOT / "data" / "graphs" / GRAPH)
    off = np.hypot(graph.node_lat_deg - TOWN_LAT, graph.node_lon_deg - TOWN_LON)
    nodes = random.Random(3).sample(np.argsort(off)[:1500].tolist(), 200)
    return [{"lat": float(graph.node_lat_deg[k]), "lon": float(graph.node_lon_deg[k])} for k in nodes]


def trip(places: list[dict[str, float]], k: int) -> dict[str, Any]:
    """The k-th of many routes."""
    return {"start": places[k % 100], "goal": places[100 + 7 * k % 100], "soc": 0.8, "links": False}


def big_matrix(places: list[dict[str, float]]) -> dict[str, Any]:
    """100 × 100 places."""
    return {"sources": places[:100], "targets": places[100:], "soc": 0.8}


async def timed(service: Service, count: int, pause_s: float = 0.0) -> list[float]:
    """Times of count health checks, one after another [s]."""
    seconds = []
    for _ in range(count):
        answer = await service.ask("GET", "/healthz")
        assert answer.status == 200
        seconds.append(answer.seconds)
        await asyncio.sleep(pause_s)
    return seconds


@pytest.mark.fault("graph-cut")
def test_service_goes_on_answering_the_same_while_its_graph_is_cut(
    running: Served, places: list[dict[str, float]], record_property: Callable[[str, object], None]
) -> None:
    service = Service(running.url)
    folder = running.log.parent / "graphs" / GRAPH
    asked = [trip(places, k) for k in range(5)]

    async def routes() -> list[Any]:
        answers = [await service.ask("POST", "/route", body) for body in asked]
        return [(answer.status, answer.json.get("routes")) for answer in answers]

    async def body() -> None:
        before = await routes()
        assert all(status in (200, 404) for status, _ in before)
        assert before[0][0] == 200
        whole = {path: path.read_bytes() for path in sorted(folder.iterdir())}
        try:
            for path, content in whole.items():
                with path.open("r+b") as file:  # the very file that was read, as `cp` does it
                    file.truncate(len(content) // 3)
                if path.suffix == ".npy":
                    assert (await service.ask("POST", "/route", asked[0])).json["routes"] == before[0][1]
            refused = await service.ask("POST", "/reload")
            assert (refused.status, refused.json["code"]) == (409, "graph_damaged")
            assert await routes() == before
            assert running.alive
        finally:
            for path, content in whole.items():
                path.write_bytes(content)

    run_apart(body)
    record_property("now", "answers stay the same; a reload names the damaged file and changes nothing")


@pytest.mark.fault("unknown-keys")
def test_health_checks_are_quick_while_two_clients_send_bodies_of_unknown_keys(
    running: Served, record_property: Callable[[str, object], None]
) -> None:
    """The measure is what Python's own reader takes for such a body on the same machine at the same time."""
    service = Service(running.url)
    sent = json.dumps({f"k{k}": 1 for k in range(300_000)}).encode()
    assert len(sent) < 4 * 1024 * 1024

    async def body() -> tuple[list[float], list[float], list[Answer]]:
        quiet = await timed(service, 20)
        stop = asyncio.Event()
        answers: list[Answer] = []

        async def client() -> None:
            while not stop.is_set():
                answers.append(await service.ask("POST", "/route", sent))

        clients = [asyncio.create_task(client()) for _ in range(2)]
        await asyncio.sleep(0.2)
        busy = await timed(service, 12, pause_s=0.03)
        stop.set()
        await asyncio.gather(*clients)
        return quiet, busy, answers

    began = time.perf_counter()
    json.loads(sent)
    reading_s = time.perf_counter() - began
    quiet, busy, answers = run_apart(body)
    assert {answer.status for answer in answers} == {422}
    assert len(answers) >= 2
    median_s = statistics.median(busy)
    record_property(
        "now",
        f"`/healthz` {1e3 * median_s:.0f} ms in the median, {max(busy):.2f} s at most "
        f"({1e3 * statistics.median(quiet):.0f} ms quiet; to read such a body takes {1e3 * reading_s:.0f} ms)",
    )
    assert median_s < 10.0 * reading_s
    assert max(busy) < 20.0 * reading_s


@pytest.mark.fault("matrices")
def test_of_sixteen_large_matrices_some_are_answered_and_short_requests_meanwhile(
    running: Served, near: list[dict[str, float]], record_property: Callable[[str, object], None]
) -> None:
    service = Service(running.url)

    async def body() -> tuple[list[Answer], list[Answer]]:
        await service.ask("POST", "/matrix", {**big_matrix(near), "sources": near[:10]})
        large = [asyncio.create_task(service.ask("POST", "/matrix", big_matrix(near))) for _ in range(16)]
        short = []
        for k in range(40):
            short.append(await service.ask("POST", "/route", trip(near, k)))
            await asyncio.sleep(0.05)
        return list(await asyncio.gather(*large)), short

    large, short = run_apart(body)
    answered = [answer for answer in large if answer.status == 200]
    seconds = sorted(answer.seconds for answer in short)
    record_property(
        "now",
        f"{len(answered)} of 16 answered within {TIME_LIMIT_S:g} s, the others refused with Retry-After; short "
        f"requests {1e3 * seconds[len(seconds) // 2]:.0f} ms in the median, {seconds[-1]:.2f} s at most",
    )
    assert all(answer.announced for answer in (*large, *short))
    assert answered
    assert all(answer.status in (200, 404) for answer in short)
    assert all(len(answer.json["energy_kwh"]) == 100 for answer in answered)


@pytest.mark.fault("matrices")
def test_work_ends_when_its_clients_have_gone(
    running: Served, places: list[dict[str, float]], record_property: Callable[[str, object], None]
) -> None:
    service = Service(running.url)

    async def body() -> None:
        await asyncio.gather(*(service.ask("POST", "/matrix", big_matrix(places), gone_s=0.7) for _ in range(16)))

    run_apart(body)
    time.sleep(1.0)
    used_s = running.cpu_s()
    time.sleep(1.0)
    used_s = running.cpu_s() - used_s
    record_property("now", f"a second after the clients have gone {100 * used_s:.0f} % of a core are used")
    assert used_s < 0.3


def test_hand_made_requests_are_answered_or_refused_in_the_words_of_the_service(running: Served) -> None:
    """`make fuzz FUZZ=api` sends more of them."""
    ends = run_apart(lambda: hand_made_answers(Service(running.url), range(150)))
    assert {end for end in ends if not end.isdigit()} <= {"closed"}
    assert ends["closed"] < 30
    assert faults_in(running.log.read_text(encoding="utf-8")) == []
    assert running.alive


@pytest.mark.fault("many-clients")
@pytest.mark.parametrize("clients", [64, 256])
def test_many_clients_get_answers_or_refusals_that_are_announced(
    running: Served, places: list[dict[str, float]], clients: int, record_property: Callable[[str, object], None]
) -> None:
    service = Service(running.url)

    async def client(k: int) -> list[Answer]:
        asked: list[tuple[str, str, object]] = [
            ("POST", "/route", trip(places, k)),
            ("GET", "/healthz", None),
            ("POST", "/range", {"origin": places[k % 200], "soc": 0.01}),
            ("POST", "/route", {**trip(places, k), "soc": 2}),
            ("GET", f"/graphs/{GRAPH}", None),
            ("POST", "/matrix", {"sources": places[:3], "targets": places[k % 100 : k % 100 + 3], "soc": 0.5}),
        ]
        return [await service.ask(*asked[(k + turn) % len(asked)]) for turn in range(2)]

    async def body() -> list[list[Answer]]:
        return await asyncio.gather(*(client(k) for k in range(clients)))

    began = time.perf_counter()
    answers = [answer for got in run_apart(body) for answer in got]
    rate = len(answers) / (time.perf_counter() - began)
    good = sum(answer.status == 200 for answer in answers)
    record_property("now", f"{clients} clients: {rate:.0f} requests a second, the testing process on the same cores")
    assert [answer for answer in answers if not answer.announced] == []
    assert good > len(answers) / 2
