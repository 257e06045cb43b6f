"""The table of sizes in docs/operations.md, measured: `python -m docs.sizing_table GRAPH...` with folders of graphs.

Each graph is measured in a process of its own, as the only one of a service. Linux only.
"""

from __future__ import annotations

import gc
import json
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import numpy as np

from diagnosis.comparison.tables import markdown_table

PAGE: Final = Path(__file__).resolve().parent / "operations.md"
NAME: Final = "sizes"
ROUTE_COUNT: Final = 20
ROUTE_DEG: Final = 0.2  # half the side of the box around a start that its goal lies in
VEHICLES: Final = ("hyundai-kona-64", "nissan-leaf", "vw-id4")
BYTE_PER_MB: Final = 1e6
HEADER: Final = [
    "graph",
    "directed links",
    "disk [MB]",
    "start [s]",
    "memory after start [MB]",
    "kept for a vehicle [B a link]",
    "route, median [ms]",
    "its slowest of 20 [ms]",
    "area [ms]",
    "most memory [MB]",
]


def resident_bytes(name: str) -> int:
    """A figure of this process by its name in /proc, as VmRSS or VmHWM [B]."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) * 1024
    raise KeyError(name)


def measured(folder: Path) -> dict[str, Any]:
    """Figures of this process with one graph; it must not have done anything else before."""
    from app.schemas.range import RangeRequest
    from app.schemas.route import RouteRequest
    from app.service.service import Service
    from app.settings import Settings
    from routing.errors import NoPathError

    name = folder.name
    with tempfile.TemporaryDirectory() as place:
        settings = Settings(database_url=f"sqlite:///{place}/vehicles.sqlite", default_graph=name)
        service = Service(settings, {name: folder})
        service.load_all()
        ready_s = time.time()
        gc.collect()
        after_start = resident_bytes("VmRSS")
        graph = service.atlas.planner(name).graph
        random = np.random.default_rng(1)
        routes_s: list[float] = []
        areas_s: list[float] = []
        kept: list[int] = []
        for vehicle in VEHICLES:
            answered = 0
            while answered < ROUTE_COUNT:
                start, goal = _pair(graph.node_lat_deg, graph.node_lon_deg, random)
                began_s = time.process_time()
                with suppress(NoPathError):  # a few roads lead off the map only
                    service.route_json(RouteRequest(start=start, goal=goal, soc=0.9, vehicle=vehicle))
                    routes_s.append(time.process_time() - began_s)
                    answered += 1
            began_s = time.process_time()
            service.range_json(RangeRequest(origin=start, soc=0.5, reserve_soc=0.1, vehicle=vehicle))
            areas_s.append(time.process_time() - began_s)
            kept.append(sum(service.atlas.budget.held_bytes().values()))
        service.close()
        own = routes_s[ROUTE_COUNT:]  # the first vehicle has been warmed up with
        return {
            "name": name,
            "links": graph.link_count,
            "disk": sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()),
            "ready_s": ready_s,
            "after_start": after_start,
            "kept": (kept[-1] - kept[0]) / (len(VEHICLES) - 1) / graph.link_count,
            "route_s": float(np.median(own)),
            "slowest_s": max(own),
            "area_s": max(areas_s),
            "most": resident_bytes("VmHWM"),
        }


def _pair(lat_deg: Any, lon_deg: Any, random: np.random.Generator) -> tuple[list[float], list[float]]:
    """Places of two nodes as [lon, lat], the second within a box around the first."""
    first = random.integers(lat_deg.size)
    near = (np.abs(lat_deg - lat_deg[first]) < ROUTE_DEG) & (np.abs(lon_deg - lon_deg[first]) < ROUTE_DEG)
    second = random.choice(np.flatnonzero(near))
    return [float(lon_deg[first]), float(lat_deg[first])], [float(lon_deg[second]), float(lat_deg[second])]


def table(folders: list[Path]) -> str:
    """The table of all graphs, the smallest first."""
    found = []
    for folder in folders:
        began_s = time.time()
        command = [sys.executable, "-m", "docs.sizing_table", "--measure", str(folder)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        figures = json.loads(done.stdout.splitlines()[-1])
        found.append(figures | {"start_s": figures["ready_s"] - began_s})
        print(found[-1], file=sys.stderr)
    rows = [
        (
            figures["name"],
            f"{figures['links']:,}",
            f"{figures['disk'] / BYTE_PER_MB:.1f}",
            f"{figures['start_s']:.1f}",
            f"{figures['after_start'] / BYTE_PER_MB:.0f}",
            f"{figures['kept']:.0f}",
            f"{1e3 * figures['route_s']:.0f}",
            f"{1e3 * figures['slowest_s']:.0f}",
            f"{1e3 * figures['area_s']:.0f}",
            f"{figures['most'] / BYTE_PER_MB:.0f}",
        )
        for figures in sorted(found, key=lambda figures: int(figures["links"]))
    ]
    return markdown_table(HEADER, rows)


def main(arguments: list[str]) -> None:
    """Measure one graph, or write the table of all that are named into the page."""
    if arguments[0] == "--measure":
        print(json.dumps(measured(Path(arguments[1]))))
        return
    written = table([Path(argument) for argument in arguments])
    page = PAGE.read_text(encoding="utf-8")
    before, rest = page.split(f"<!-- {NAME} -->\n")
    after = rest.split(f"<!-- /{NAME} -->")[1]
    PAGE.write_text(f"{before}<!-- {NAME} -->\n{written}\n<!-- /{NAME} -->{after}", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
