"""RouteE Compass in an environment of its own: `serve FOLDER` answers questions on the data in that folder."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.peers.questions import EngineAnswer, Question, serve

if TYPE_CHECKING:
    from collections.abc import Callable

VEHICLE: Final = "2017_CHEVROLET_Bolt"
ROUTE_CHARGE_PERCENT: Final = 90.0
ENERGY_ALONE: Final = {"trip_distance": 0.0, "trip_time": 0.0, "trip_energy_electric": 1.0}
METRE_PER_MILE: Final = 1609.344
GEOMETRY_FILE: Final = "edges-geometries-enumerated.txt.gz"


def load(folder: Path) -> Callable[[Question], EngineAnswer]:
    """Two engines on the data of a folder, with one thread each: for routes, and for trees without a destination."""
    import tomlkit
    from nrel.routee import compass  # type: ignore[import-not-found]

    resources = compass.package_root() / "resources"

    def app(name: str, change: Callable[[Any], None]) -> Any:
        config = tomlkit.parse((resources / "osm_default_energy.toml").read_text(encoding="utf-8"))
        config["parallelism"] = 1
        for model in config["search"]["traversal"]["models"]:
            if model["type"] == "energy":
                model["vehicle_input_files"] = [str(resources / f"vehicles/{VEHICLE}.json")]
        change(config)
        path = folder / name
        path.write_text(tomlkit.dumps(config), encoding="utf-8")
        return compass.CompassApp.from_config_file(path)

    routes, trees = app("routes.toml", lambda config: None), app("trees.toml", _without_destination)
    return lambda question: _tree(trees, question) if question.goal is None else _route(routes, question)


def _without_destination(config: Any) -> None:
    config["mapping"]["queries_without_destinations"] = True
    plugins = config["plugin"]["input_plugins"]
    config["plugin"]["input_plugins"] = [p for p in plugins if p["type"] != "load_balancer"]  # it wants a destination
    traversal = {"type": "traversal", "tree": "geo_json", "geometry_input_file": GEOMETRY_FILE}
    config["plugin"]["output_plugins"] = [traversal]


def _route(app: Any, question: Question) -> EngineAnswer:
    """The way of least energy, link by link; places over 15 m from its links are refused."""
    lat, lon = question.goal or question.start
    asked = _from(question.start, ROUTE_CHARGE_PERCENT) | {"destination_x": lon, "destination_y": lat}
    said, timed = _timed(app, asked)
    if said is None:
        return timed
    state = said["route"]["final_state"]
    return EngineAnswer(
        seconds=timed.seconds,
        search_s=timed.search_s,
        size_bytes=len(json.dumps(said)),
        distance_m=METRE_PER_MILE * state["trip_distance"],
        energy_kwh=state["trip_energy_electric"],
    )


def _tree(app: Any, question: Question) -> EngineAnswer:
    """All roads in reach, as lines: there is no polygon."""
    said, timed = _timed(app, _from(question.start, 100.0 * question.budget))
    if said is None:
        return timed
    return EngineAnswer(
        seconds=timed.seconds,
        search_s=timed.search_s,
        size_bytes=len(json.dumps(said)),
        reached=said["info"]["tree_edges"] + 1,
    )


def _from(place: tuple[float, float], charge_percent: float) -> dict[str, Any]:
    return {
        "origin_x": place[1],
        "origin_y": place[0],
        "model_name": VEHICLE,
        "starting_soc_percent": charge_percent,
        "weights": ENERGY_ALONE,
    }


def _timed(app: Any, asked: dict[str, Any]) -> tuple[Any, EngineAnswer]:
    """What the engine said, None where it refused, and how long it took."""
    began = time.perf_counter()
    said = app.run(asked)
    seconds = time.perf_counter() - began
    if "error" in said:
        return None, EngineAnswer(refused=str(said["error"]))
    return said, EngineAnswer(seconds=seconds, search_s=said["info"]["runtime"]["search"])


if __name__ == "__main__":
    serve(lambda: load(Path(sys.argv[2])))
