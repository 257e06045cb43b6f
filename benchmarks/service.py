"""`python -m benchmarks.service`: mixed requests of many clients, with one worker and with several, in turns.

All services run all the time and are asked in short turns, so that what else the machine does meets them alike.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from rich.console import Console
from rich.table import Table

from routing.graph.files import load_graph

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT: Final = Path(__file__).resolve().parents[1]
GRAPH: Final = "highlands"
NEAR_DEG: Final = 0.15  # between the ends of a short route
# kinds of requests and their shares
MIX: Final = (("route", 0.6), ("range", 0.2), ("simulation", 0.1), ("list", 0.05), ("health", 0.05))
CHAIN: Final = [{"length_m": 100, "speed_limit_kmh": 50}] * 40
SERVING: Final = re.compile(r"(?:Uvicorn running|serving) on http://127\.0\.0\.1:(\d+)")
START_S: Final = 300.0
WARM_REQUESTS: Final = 100


@dataclass(frozen=True, slots=True)
class Asked:
    """One request: its kind, and its bytes."""

    kind: str
    content: bytes


@dataclass(slots=True)
class Round:
    """What one service answered: seconds of each answer by kind, and what it took."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    failed: int = 0
    per_s: float = 0.0
    cpu_ms: float = 0.0  # of all processes of the service, a request
    supervisor_mb: float = 0.0  # memory of its own and its part of what is shared, of the first process
    worker_mb: float = 0.0  # the same, the mean of the workers
    graphs_mb: float = 0.0  # the parts of graphs in memory, summed over all processes
    load: float = 0.0


def requests(count: int, seed: int) -> list[Asked]:
    """Requests, always the same ones of a seed."""
    graph = load_graph(ROOT / "data" / "graphs" / GRAPH)
    lat, lon = np.asarray(graph.node_lat_deg), np.asarray(graph.node_lon_deg)
    rng = random.Random(seed)

    def place() -> tuple[float, float]:
        k = rng.randrange(graph.node_count)
        return float(lat[k]), float(lon[k])

    def near(start: tuple[float, float]) -> tuple[float, float]:
        for _ in range(1000):
            goal = place()
            if max(abs(goal[0] - start[0]), abs(goal[1] - start[1])) < NEAR_DEG:
                return goal
        return start

    asked: list[Asked] = []
    kinds, shares = zip(*MIX, strict=True)
    for kind in rng.choices(kinds, shares, k=count):
        here = place()
        if kind == "route":
            there = near(here)
            start, goal = ({"lat": end[0], "lon": end[1]} for end in (here, there))
            asked.append(_post(kind, "/route", {"start": start, "goal": goal, "soc": 0.8, "graph": GRAPH}))
        elif kind == "range":
            asked.append(_get(kind, f"/range?lat={here[0]}&lon={here[1]}&soc=0.15&graph={GRAPH}"))
        elif kind == "simulation":
            asked.append(_post(kind, "/simulate", {"vehicle": "hyundai-kona-64", "chain": CHAIN}))
        else:
            asked.append(_get(kind, "/vehicles" if kind == "list" else "/healthz"))
    return asked


def _get(kind: str, path: str) -> Asked:
    return Asked(kind, f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nAccept-Encoding: gzip\r\n\r\n".encode())


def _post(kind: str, path: str, body: dict[str, Any]) -> Asked:
    content = json.dumps(body).encode()
    head = f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nAccept-Encoding: gzip\r\nContent-Type: application/json\r\n"
    return Asked(kind, f"{head}Content-Length: {len(content)}\r\n\r\n".encode() + content)


async def ask_all(port: int, asked: list[Asked], clients: int) -> Round:
    """Answers of a service to clients, each of which keeps its connection and asks again when it is answered."""
    found = Round()
    rest = iter(asked)

    async def client() -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for request in rest:
            began = time.perf_counter()
            writer.write(request.content)
            head = (await reader.readuntil(b"\r\n\r\n")).lower()
            await reader.readexactly(int(head.split(b"content-length:", 1)[1].split(b"\r\n", 1)[0]))
            found.seconds[request.kind].append(time.perf_counter() - began)
            found.failed += not head.startswith(b"http/1.1 200")
        writer.close()

    began = time.perf_counter()
    await asyncio.gather(*(client() for _ in range(clients)))
    found.per_s = len(asked) / (time.perf_counter() - began)
    return found


@contextmanager
def service(workers: int, folder: Path, root: Path) -> Iterator[tuple[int, int]]:
    """A running service of a checkout: its process and port."""
    log = folder / f"service-{workers}.log"
    environment = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
    environment["JOULEPATH_DATABASE_URL"] = f"sqlite:///{folder / 'database.sqlite'}"
    command = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
    if workers > 1:
        command += ["--workers", str(workers)]
    with log.open("wb") as said:
        process = subprocess.Popen(command, cwd=root, env=environment, stdout=said, stderr=said)
    try:
        until = time.monotonic() + START_S
        while True:
            text = log.read_text(errors="replace")
            serving = SERVING.search(text)
            if serving and (workers == 1 or len(set(re.findall(r"worker (\d+) serves", text))) == workers):
                break
            if process.poll() is not None or time.monotonic() > until:
                raise RuntimeError(f"the service did not start:\n{text}")
            time.sleep(0.1)
        yield process.pid, int(serving.group(1))
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait()


def processes_of(pid: int) -> list[int]:
    """A process and its children."""
    found = [pid]
    for task in os.listdir(f"/proc/{pid}/task"):
        found += map(int, Path(f"/proc/{pid}/task/{task}/children").read_text().split())
    return found


def cpu_s(pids: list[int]) -> float:
    """Processor time that processes have taken [s]."""
    ticks = 0
    for pid in pids:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def proportional_mb(pid: int, of: str = "") -> float:
    """Memory of a process, what it shares counted by its part [MB]; of: of mappings of a name only."""
    if not of:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
        return float(re.findall(r"^Pss: +(\d+) kB", text, re.MULTILINE)[0]) * 1024 / 1e6
    text = Path(f"/proc/{pid}/smaps").read_text()
    mapped = re.findall(rf"^\S+ \S+ \S+ \S+ \d+ +/memfd:{of}\S* .*\n((?:\w+: .*\n)*)", text, re.MULTILINE)
    return sum(float(kib) for part in mapped for kib in re.findall(r"^Pss: +(\d+) kB", part, re.MULTILINE)) * 1024 / 1e6


def measured(workers: int, pid: int, port: int, chosen: argparse.Namespace) -> Round:
    """One service under load; the clients are in a process of their own."""
    pids = processes_of(pid)
    before_s = cpu_s(pids)
    load = os.getloadavg()[0]
    found = _clients(port, chosen.requests, chosen.clients, chosen.seed)
    found.load = load
    found.cpu_ms = 1e3 * (cpu_s(pids) - before_s) / chosen.requests
    serving = pids[1:] if workers > 1 else pids
    found.worker_mb = statistics.fmean(proportional_mb(worker) for worker in serving)
    found.supervisor_mb = proportional_mb(pid) if workers > 1 else 0.0
    found.graphs_mb = sum(proportional_mb(worker, f"joulepath-{GRAPH}") for worker in pids)
    return found


def _clients(port: int, count: int, clients: int, seed: int) -> Round:
    command = [sys.executable, "-m", "benchmarks.service", "--ask", str(port), "--requests", str(count)]
    command += ["--clients", str(clients), "--seed", str(seed)]
    said = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)
    return Round(seconds=said["seconds"], failed=said["failed"], per_s=said["per_s"])


def main() -> int:
    """Measure and print, or be the clients."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.service", description=__doc__)
    options.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="numbers of workers to compare")
    options.add_argument("--clients", type=int, default=64)
    options.add_argument("--requests", type=int, default=500, help="in a round")
    options.add_argument("--rounds", type=int, default=9, help="of each number of workers, in turns")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--root", type=Path, default=ROOT, help="checkout whose service is measured")
    options.add_argument("--ask", type=int, metavar="PORT", help=argparse.SUPPRESS)
    chosen = options.parse_args()
    asked = requests(chosen.requests, chosen.seed)
    if chosen.ask is not None:
        found = asyncio.run(ask_all(chosen.ask, asked, chosen.clients))
        print(json.dumps({"seconds": found.seconds, "failed": found.failed, "per_s": found.per_s}))
        return 0
    rounds: dict[int, list[Round]] = defaultdict(list)
    with ExitStack() as opened:
        scratch = Path(opened.enter_context(tempfile.TemporaryDirectory(prefix="joulepath-bench-")))
        running = {workers: opened.enter_context(service(workers, scratch, chosen.root)) for workers in chosen.workers}
        for _, port in running.values():
            _clients(port, WARM_REQUESTS, chosen.clients, seed=-1)
        for turn in range(chosen.rounds):
            for workers in chosen.workers if turn % 2 == 0 else reversed(chosen.workers):
                rounds[workers].append(measured(workers, *running[workers], chosen))
    _print(rounds, chosen.clients, chosen.requests)
    return 0


def _print(rounds: dict[int, list[Round]], clients: int, count: int) -> None:
    console = Console(width=110)
    table = Table(title=f"{clients} clients, {count} requests a round, median of rounds")
    names = (
        *("workers", "requests/s", "rounds", "failed", "CPU ms/request"),
        *("MB a worker", "MB supervisor", "MB graph, all", "load before"),
    )
    for name in names:
        table.add_column(name, justify="right")

    def middle(of: list[Round], name: str) -> float:
        return statistics.median(getattr(each, name) for each in of)

    for workers, of in rounds.items():
        table.add_row(
            str(workers),
            f"{middle(of, 'per_s'):.0f}",
            f"{min(each.per_s for each in of):.0f}..{max(each.per_s for each in of):.0f}",
            str(sum(each.failed for each in of)),
            f"{middle(of, 'cpu_ms'):.2f}",
            f"{middle(of, 'worker_mb'):.0f}",
            f"{middle(of, 'supervisor_mb'):.0f}",
            f"{middle(of, 'graphs_mb'):.1f}",
            f"{middle(of, 'load'):.1f}",
        )
    console.print(table)
    times = Table(title="ms until the answer, p50 / p99 of all rounds")
    for name in ("workers", *(kind for kind, _ in MIX)):
        times.add_column(name, justify="right")
    for workers, of in rounds.items():
        cells = []
        for kind, _ in MIX:
            seconds = sorted(value for each in of for value in each.seconds.get(kind, ()))
            p50, p99 = seconds[len(seconds) // 2], seconds[int(0.99 * (len(seconds) - 1))]
            cells.append(f"{1e3 * p50:.0f} / {1e3 * p99:.0f}")
        times.add_row(str(workers), *cells)
    console.print(times)
    (first, base), *others = rounds.items()
    for workers, of in others:
        pairs = [other.per_s / alone.per_s for alone, other in zip(base, of, strict=True)]
        each = " ".join(f"{ratio:.2f}" for ratio in pairs)
        console.print(f"{workers} workers / {first}: {statistics.median(pairs):.2f} x (turns: {each})")


if __name__ == "__main__":
    sys.exit(main())
