"""What is kept between requests stays within its number of bytes, whatever is asked."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tests.faults.served import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

LIMIT_MB = 60
# routes of ever new vehicles in ever new weather, on all bundled graphs in turn; prints memory [MB] after each round
ASK = """
import ctypes, gc, json, os, random, sys
from pathlib import Path
from app.schemas.route import RouteRequest
from app.service.service import Service
from app.settings import Settings
from routing.graph.files import load_graph
from tests.faults.served import held_bytes
from tests.faults.soak import drawn_vehicle

limit_mb, rounds, folder = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
settings = Settings(cache_limit_bytes=limit_mb * 10**6, database_url=f"sqlite:///{folder}/vehicles.sqlite")
service, dice = Service(settings), random.Random(5)
for _ in range(rounds):
    for name in service.atlas.names:
        graph = service.atlas.planner(name).graph
        for _ in range(2):
            a, b = dice.sample(range(graph.node_count), 2)
            ends = [{"lat": float(graph.node_lat_deg[k]), "lon": float(graph.node_lon_deg[k])} for k in (a, b)]
            weather = {"ambient_c": dice.uniform(-20, 35), "wind_speed_mps": dice.uniform(0, 12)}
            body = {"graph": name, "start": ends[0], "goal": ends[1], "soc": 0.9, "vehicle": drawn_vehicle(dice),
                    "conditions": weather, "links": False}
            service.route_json(RouteRequest.model_validate(body))
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    held = sum(service.atlas.budget.held_bytes().values())
    print(json.dumps({"process_mb": held_bytes(os.getpid()) / 1e6, "kept_mb": held / 1e6}), flush=True)
"""


@pytest.mark.fault("memory")
def test_memory_stays_flat_over_ever_new_vehicles_and_weather(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    plain = {name: value for name, value in os.environ.items() if not name.startswith("JOULEPATH_")}
    command = [sys.executable, "-c", ASK, str(LIMIT_MB), "7", str(tmp_path)]
    ran = subprocess.run(
        command, cwd=ROOT, env={**plain, "PYTHONPATH": str(ROOT)}, capture_output=True, check=True, text=True
    )
    rounds = [json.loads(line) for line in ran.stdout.splitlines()]
    process_mb = [entry["process_mb"] for entry in rounds]
    record_property(
        "now",
        f"{process_mb[2]:.0f} MB after 3 rounds, {process_mb[-1]:.0f} MB after {len(rounds)}, of which at most "
        f"{max(entry['kept_mb'] for entry in rounds):.0f} MB kept where {LIMIT_MB} are allowed",
    )
    assert max(entry["kept_mb"] for entry in rounds) <= LIMIT_MB
    assert max(process_mb[3:]) - process_mb[2] < 0.5 * LIMIT_MB
