"""Valhalla in an environment of its own: `build MAP FOLDER` makes its tiles, `serve FOLDER` answers questions."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from benchmarks.peers.questions import EngineAnswer, Question, serve

if TYPE_CHECKING:
    from collections.abc import Callable

CONTOURS: Final = 3
POLYLINE_UNIT_DEG: Final = 1e-6


def build(map_path: Path, folder: Path) -> None:
    """Make the tiles of a map; raises CalledProcessError."""
    import valhalla  # type: ignore[import-not-found]

    tiles, no_archive = folder / "tiles", folder / "no-archive.tar"
    tiles.mkdir(parents=True)
    no_archive.touch()  # the configuration wants one to be there
    config = valhalla.get_config(tile_extract=no_archive, tile_dir=tiles)
    config["mjolnir"]["tile_extract"] = ""
    path = folder / "valhalla.json"
    path.write_text(json.dumps(config), encoding="utf-8")
    builder = Path(valhalla.__file__).parent / "bin/valhalla_build_tiles"
    subprocess.run([builder, "-c", path, map_path], check=True, stdout=sys.stderr)


def load(folder: Path) -> Callable[[Question], EngineAnswer]:
    """An engine on the tiles of a folder."""
    import valhalla

    actor = valhalla.Actor(str(folder / "valhalla.json"))
    return lambda question: _area(actor, question) if question.goal is None else _route(actor, question)


def _route(actor: Any, question: Question) -> EngineAnswer:
    """The fastest way by car, as a line without driving instructions."""
    asked = json.dumps(
        {
            "locations": [_location(question.start), _location(question.goal)],
            "costing": "auto",
            "directions_type": "none",
        }
    )
    began = time.perf_counter()
    said = actor.route(asked)
    seconds = time.perf_counter() - began
    trip = json.loads(said)["trip"]
    line = decoded(trip["legs"][0]["shape"])
    distance_m = 1000.0 * trip["summary"]["length"]
    return EngineAnswer(seconds=seconds, size_bytes=len(said), distance_m=distance_m, ends=(line[0], line[-1]))


def _area(actor: Any, question: Question) -> EngineAnswer:
    """Polygons of what is reached in a third, two thirds and all of the budget; the outermost is answered."""
    contours = [{"time": question.budget * (k + 1) / CONTOURS} for k in range(CONTOURS)]
    asked = json.dumps(
        {"locations": [_location(question.start)], "costing": "auto", "contours": contours, "polygons": True}
    )
    began = time.perf_counter()
    said = actor.isochrone(asked)
    seconds = time.perf_counter() - began
    widest = max(json.loads(said)["features"], key=lambda feature: feature["properties"]["contour"])["geometry"]
    shape = widest["coordinates"] if widest["type"] == "MultiPolygon" else [widest["coordinates"]]
    return EngineAnswer(seconds=seconds, size_bytes=len(said), shape=shape)


def _location(place: Any) -> dict[str, float]:
    return {"lat": place[0], "lon": place[1]}


def decoded(polyline: str) -> list[tuple[float, float]]:
    """Latitudes and longitudes [deg] of an encoded polyline with six decimals."""
    numbers, value, shift = [], 0, 0
    for letter in polyline:
        part = ord(letter) - 63
        value |= (part & 0x1F) << shift
        shift += 5
        if part < 0x20:
            numbers.append(~(value >> 1) if value & 1 else value >> 1)
            value = shift = 0
    lat = lon = 0
    places = []
    for north, east in zip(numbers[::2], numbers[1::2], strict=True):
        lat, lon = lat + north, lon + east
        places.append((lat * POLYLINE_UNIT_DEG, lon * POLYLINE_UNIT_DEG))
    return places


if __name__ == "__main__":
    if sys.argv[1] == "build":
        build(Path(sys.argv[2]), Path(sys.argv[3]))
    else:
        serve(lambda: load(Path(sys.argv[2])))
