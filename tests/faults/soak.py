"""`python -m tests.faults.soak SECONDS [CLIENTS]`: many clients of all kinds, for long, on a service of its own.

Each client waits a while between its requests, as people do. Printed are times by kind, alone and among the others,
every answer that the service does not promise, and its memory. The exit status is 1 where something is not as it should
be.
"""

from __future__ import annotations

import asyncio
import os
import random
import sys
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from routing.graph.files import load_graph
from tests.faults.asking import Answer, Service
from tests.faults.served import ROOT, Served, held_bytes, served
from tests.fuzz.samples import samples

PAUSE_S: Final = 3.0  # of a client between two requests, in the mean
QUIET_FRAC: Final = 0.05  # of the time, in which one client asks alone
LEAST_QUIET_S: Final = 10.0
SHORT: Final = ("health", "graph", "route")
MOST_RATIO: Final = 5.0  # of the p99 of short requests among others to that alone
MOST_GROWTH_FRAC: Final = 0.05
CACHE_LIMIT_BYTES: Final = 300_000_000  # which is full before half of the time is over
BOUNDARY: Final = "soak-boundary"
GRAPHS: Final = ("highlands", "coquimbo")
VEHICLES: Final = ("hyundai-kona-64", "bmw-i3-60ah", "tesla-model-3")
# kind and how often, of all
MIX: Final = dict(
    [
        *(
            ("health", 15),
            ("graph", 5),
            ("route", 45),
            ("drawn vehicle", 8),
            ("range", 4),
            ("pareto", 2),
            ("matrix", 3),
        ),
        *(("abandoned", 6), ("refused", 6), ("vehicle stored", 2), ("upload", 1), ("damaged upload", 1)),
        ("diagnoses", 2),
    ]
)


@dataclass(slots=True)
class Seen:
    """Times [s] and statuses by kind, what was not announced, and memory over time [s, B]."""

    seconds: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    statuses: defaultdict[str, Counter[int]] = field(default_factory=lambda: defaultdict(Counter))
    unannounced: list[str] = field(default_factory=list)
    memory: list[tuple[float, int, int]] = field(default_factory=list)


class Asker:
    """Requests of every kind, drawn anew each time."""

    def __init__(self, service: Service, dice: random.Random) -> None:
        self._service = service
        self._dice = dice
        self._places = {}
        for name in GRAPHS:
            graph = load_graph(ROOT / "data" / "graphs" / name)
            nodes = zip(graph.node_lat_deg.tolist(), graph.node_lon_deg.tolist(), strict=True)
            self._places[name] = [{"lat": lat, "lon": lon} for lat, lon in nodes]
        files = samples()
        self._uploads = [form("plain.csv", files["plain.csv"]), form("i3.csv", files["i3.csv"])]
        self._damaged = [form(name, content[: len(content) // 2]) for name, content in files.items()]

    def _sites(self, count: int) -> tuple[str, list[dict[str, float]]]:
        graph = self._dice.choice(GRAPHS)
        return graph, [self._dice.choice(self._places[graph]) for _ in range(count)]

    def _trip(self, **change: object) -> dict[str, Any]:
        graph, (start, goal) = self._sites(2)
        vehicle = self._dice.choice(VEHICLES)
        return {"graph": graph, "start": start, "goal": goal, "soc": 0.8, "vehicle": vehicle, "links": False, **change}

    async def ask(self, kind: str) -> Answer:
        """One request of a kind."""
        ask, dice = self._service.ask, self._dice
        if kind == "health":
            return await ask("GET", "/healthz")
        if kind == "graph":
            return await ask("GET", f"/graphs/{dice.choice(GRAPHS)}")
        if kind == "route":
            return await ask("POST", "/route", self._trip())
        if kind == "drawn vehicle":
            conditions = {"ambient_c": dice.uniform(-20, 35), "wind_speed_mps": dice.uniform(0, 12)}
            return await ask("POST", "/route", self._trip(vehicle=drawn_vehicle(dice), conditions=conditions))
        if kind == "range":
            graph, (origin,) = self._sites(1)
            return await ask("POST", "/range", {"graph": graph, "origin": origin, "soc": dice.uniform(0.02, 0.1)})
        if kind == "pareto":
            return await ask("POST", "/route", self._trip(pareto={}))
        if kind in ("matrix", "abandoned"):
            graph, places = self._sites(30)
            body = {"graph": graph, "sources": places[:15], "targets": places[15:], "soc": 0.9}
            return await ask("POST", "/matrix", body, gone_s=0.3 if kind == "abandoned" else 0.0)
        if kind == "refused":
            body = dice.choice((b"{", b'{"soc": NaN}', b"[" * 50_000, {f"k{k}": 1 for k in range(20_000)}, {"soc": 7}))
            return await ask("POST", dice.choice(("/route", "/range", "/matrix", "/simulate")), body)
        if kind == "vehicle stored":
            return await ask("PUT", f"/vehicles/soak-{dice.randrange(50)}", drawn_vehicle(dice))
        if kind == "diagnoses":
            return await ask("GET", "/diagnoses")
        sent = dice.choice(self._uploads if kind == "upload" else self._damaged)
        return await ask(
            "POST", "/diagnoses", sent, headers={"Content-Type": f"multipart/form-data; boundary={BOUNDARY}"}
        )


def form(name: str, content: bytes) -> bytes:
    """A form with one recording."""
    field_of = 'Content-Disposition: form-data; name="{}"'
    head = f"--{BOUNDARY}\r\n{field_of.format('vehicle')}\r\n\r\nbmw-i3-60ah\r\n--{BOUNDARY}\r\n"
    head += f'{field_of.format("recordings")}; filename="{name}"\r\n\r\n'
    return head.encode() + content + f"\r\n--{BOUNDARY}--\r\n".encode()


def drawn_vehicle(dice: random.Random) -> dict[str, Any]:
    """A car that nobody has asked for before."""
    return {
        "name": "drawn",
        "mass_kg": dice.uniform(1000, 3000),
        "road_load": {"a_n": dice.uniform(80, 200), "b_n_per_kmh": 0.3, "c_n_per_kmh2": dice.uniform(0.02, 0.04)},
        "drive_eff": 0.9,
        "recuperation_eff": 0.6,
        "aux_power_w": 400,
        "usable_capacity_kwh": dice.uniform(20, 90),
    }


async def client(asker: Asker, seen: Seen, dice: random.Random, kinds: dict[str, int], until: float) -> None:
    """Ask until the time is up, with pauses."""
    while time.monotonic() < until:
        kind = dice.choices(list(kinds), list(kinds.values()))[0]
        try:
            answer = await asker.ask(kind)
        except TimeoutError:
            answer = Answer(0)
        if kind != "abandoned":
            seen.seconds[kind].append(answer.seconds)
            seen.statuses[kind][answer.status] += 1
            if not answer.announced:
                seen.unannounced.append(f"{kind}: status {answer.status} {answer.body[:300]!r}")
        await asyncio.sleep(min(dice.expovariate(1.0 / PAUSE_S), 5.0 * PAUSE_S))


async def watch(service: Served, seen: Seen, until: float) -> None:
    """Write down what memory the service and its workers hold, every half second."""
    while time.monotonic() < until:
        workers = sum(held_bytes(pid) for pid in descendants(service.process.pid))
        seen.memory.append((time.monotonic(), service.held_bytes(), workers))
        await asyncio.sleep(0.5)


def descendants(pid: int) -> list[int]:
    """Processes that a process has started, and those of theirs."""
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            children = [int(word) for word in task.read_text().split()]
        except OSError:
            continue
        for child in children:
            found += [child, *descendants(child)]
    return [child for child in found if Path(f"/proc/{child}/statm").exists()]


def quantile(values: list[float], frac: float) -> float:
    """A quantile of values, the greatest of those below it."""
    return sorted(values)[min(int(frac * len(values)), len(values) - 1)]


def growth_frac(memory: list[tuple[float, int, int]]) -> float:
    """By how much the mean of the last quarter is above that of the one before."""
    third, last = memory[len(memory) // 2 : 3 * len(memory) // 4], memory[3 * len(memory) // 4 :]
    return (sum(own for _, own, _ in last) / len(last)) / (sum(own for _, own, _ in third) / len(third)) - 1.0


def eighths(memory: list[tuple[float, int, int]]) -> list[float]:
    """Mean memory in each eighth of the time [B]."""
    size = len(memory) / 8
    parts = [memory[int(k * size) : int((k + 1) * size)] for k in range(8)]
    return [sum(own for _, own, _ in part) / max(len(part), 1) for part in parts]


async def soak(service: Served, seconds: float, clients: int, seed: int) -> tuple[Seen, Seen]:
    """What one client sees alone, and what many see together."""
    alone, together = Seen(), Seen()
    dice = random.Random(seed)
    asker = Asker(Service(service.url), dice)
    short = {kind: MIX[kind] for kind in SHORT}
    for kind in MIX:  # what is made once counts for none
        await asker.ask(kind)
    quiet_s = max(QUIET_FRAC * seconds, LEAST_QUIET_S)
    began = time.monotonic()
    while time.monotonic() < began + quiet_s:
        await client(asker, alone, dice, short, time.monotonic() + 1e-3)
    until = time.monotonic() + seconds
    await asyncio.gather(
        watch(service, together, until), *(client(asker, together, dice, MIX, until) for _ in range(clients))
    )
    return alone, together


def main(seconds: float, clients: int = 64, seed: int = 0) -> int:
    """Soak a service, print a table, and return the exit status."""
    with (
        tempfile.TemporaryDirectory() as folder,
        served(Path(folder), {"cache_limit_bytes": CACHE_LIMIT_BYTES}) as service,
    ):
        alone, together = asyncio.run(soak(service, seconds, clients, seed))
        alive = service.alive
        log = service.log.read_text(encoding="utf-8", errors="replace")
    console = Console(width=110)
    table = Table(
        "kind",
        "requests",
        "p50 [ms]",
        "p99 [ms]",
        "alone p99 [ms]",
        "statuses",
        title=f"{clients} clients, {seconds:g} s",
    )
    for kind, times in sorted(together.seconds.items()):
        quiet = f"{1e3 * quantile(alone.seconds[kind], 0.99):.0f}" if alone.seconds[kind] else ""
        statuses = ", ".join(f"{status}: {count}" for status, count in together.statuses[kind].most_common())
        table.add_row(
            kind,
            str(len(times)),
            f"{1e3 * quantile(times, 0.5):.0f}",
            f"{1e3 * quantile(times, 0.99):.0f}",
            quiet,
            statuses,
        )
    console.print(table)
    short_s = [second for kind in SHORT for second in together.seconds[kind]]
    quiet_s = [second for kind in SHORT for second in alone.seconds[kind]]
    ratio = quantile(short_s, 0.99) / quantile(quiet_s, 0.99)
    growth = growth_frac(together.memory)
    first, last = together.memory[0], together.memory[-1]
    most = max(own for _, own, _ in together.memory)
    total = sum(map(len, together.seconds.values()))
    rows = {
        "requests a second": f"{total / seconds:.1f}",
        "load of the machine, mean of 1 and 15 min": "{0:.1f}, {2:.1f}".format(*os.getloadavg()),
        "p99 of short requests, times that alone": f"{ratio:.1f} (at most {MOST_RATIO:g})",
        "memory at first, at most, at last [MB]": f"{first[1] / 1e6:.0f}, {most / 1e6:.0f}, {last[1] / 1e6:.0f}",
        "memory of the last quarter over the third": f"{100 * growth:+.1f} % (within {100 * MOST_GROWTH_FRAC:g} %)",
        "memory by eighths of the time [MB]": ", ".join(f"{mean / 1e6:.0f}" for mean in eighths(together.memory)),
        "workers' memory at most [MB]": f"{max(worker for _, _, worker in together.memory) / 1e6:.0f}",
        "answers that are not announced": str(len(together.unannounced)),
        "faults in the log": str(log.count("Traceback")),
    }
    for name, text in rows.items():
        console.print(f"{name}: {text}", highlight=False)
    for line in together.unannounced[:10]:
        console.print(line, markup=False, highlight=False)
    if "Traceback" in log:
        console.print(log[log.find("Traceback") :][:4000], markup=False, highlight=False)
    good = alive and not together.unannounced and "Traceback" not in log
    return 0 if good and ratio <= MOST_RATIO and abs(growth) <= MOST_GROWTH_FRAC else 1


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]), *map(int, sys.argv[2:])))
