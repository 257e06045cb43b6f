"""A small car on the hand-made grid with stations, which needs a charging stop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from app.settings import Settings
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from routing.stations.files import STATIONS_FILE, stations_bytes
from tests.app.conftest import VEHICLES, street_grid
from tests.app.expected import VEHICLE, database_in
from tests.app.stations_beside import grid_stations

if TYPE_CHECKING:
    from pathlib import Path

START, GOAL = [8.003, 46.5], [8.02, 46.518]
CHARGES: Final = {"connectors": ["ccs2"], "curve_soc_percent": [0, 50, 100], "curve_kw": [60, 60, 15], "ac_kw": 11}
CAPACITY_KWH: Final = 1.0
CAR: dict[str, Any] = VEHICLE | {"usable_capacity_kwh": CAPACITY_KWH, "charging": CHARGES}
LOW: Final = 0.45  # charge that reaches a station, and the goal with less than GOAL_SOC
ARRIVE_SOC, GOAL_SOC = 0.02, 0.3
ROUTE: dict[str, Any] = {
    "start": START,
    "goal": GOAL,
    "soc": LOW,
    "vehicle": CAR,
    "graph": "grid",
    "charging": {"overhead_s": 60.0, "connectors": ["ccs2"], "arrive_soc": ARRIVE_SOC, "goal_soc": GOAL_SOC},
}


def charged_settings(folder: Path) -> Settings:
    """The grid with stations, beside a level one without and one whose stations are damaged."""
    grid = street_grid("grid", Terrain.SYNTHETIC)
    save_graph(grid, folder / "grid", {STATIONS_FILE: stations_bytes(grid, grid_stations(grid))})
    save_graph(street_grid("level", Terrain.ABSENT), folder / "level")
    save_graph(street_grid("torn", Terrain.ABSENT), folder / "torn", {STATIONS_FILE: b'{"format_version": 9}'})
    return Settings(graph_dirs=(folder,), vehicle_dir=VEHICLES, database_url=database_in(folder), default_graph="grid")


def timeless(answer: dict[str, Any]) -> dict[str, Any]:
    """An answer without what depends on the clock and on what was asked before."""
    for stats in answer["stats"]:
        stats.pop("seconds")
    answer["planning"] = None
    return answer
