"""Synthetic regions of many sizes, kept in a cache folder from run to run."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.graphs import ROOT, Made, synthesize_in_process
from routing.graph.earth import great_circle_m

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph


@dataclass(frozen=True, slots=True)
class RegionShape:
    """What roads look like on the whole; alike at every size where a region keeps its structure.

    turns, points: permitted transitions and points of geometry a link. road_km_per_km2: of both directions together.
    """

    area_km2: float
    links_per_km2: float
    road_km_per_km2: float
    link_m: float
    turns: float
    points: float
    urban_frac: float


def cache_folder() -> Path:
    """Where regions are kept where nothing else is asked for."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "joulepath" / "scale"


def kept_region(cache: Path, links: int, seed: int) -> tuple[Made, Path, bool]:
    """A region of about so many links, its folder, and whether it was there; one made by other code is made again."""
    name = f"synth-{links}-{seed}-{_generator_digest()}"
    folder, record = cache / name, cache / f"{name}.json"
    if record.is_file() and (folder / "meta.json").is_file():
        return Made(**json.loads(record.read_text(encoding="utf-8"))), folder, True
    cache.mkdir(parents=True, exist_ok=True)
    made = synthesize_in_process(f"synth-{links}", links, seed, folder)
    record.write_text(json.dumps(asdict(made)), encoding="utf-8")
    return made, folder, False


def _generator_digest() -> str:
    """Of all that a region's arrays depend on but its seed and size."""
    digest = hashlib.sha256(np.__version__.encode())
    for path in (*sorted((ROOT / "routing/synth").glob("*.py")), ROOT / "routing/graph/road_graph.py"):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def shape_of(graph: RoadGraph) -> RegionShape:
    """What a graph's roads look like on the whole."""
    west, south, east, north = graph.meta.bbox
    middle = 0.5 * (south + north)
    area_km2 = float(great_circle_m(middle, west, middle, east) * great_circle_m(south, west, north, west)) / 1e6
    links = graph.link_count
    return RegionShape(
        area_km2=area_km2,
        links_per_km2=links / area_km2,
        road_km_per_km2=float(graph.length_m.sum()) / 1000.0 / area_km2,
        link_m=float(graph.length_m.mean()),
        turns=graph.successor.size / links,
        points=graph.geometry_lon_e7.size / links,
        urban_frac=float(graph.urban.mean()),
    )
