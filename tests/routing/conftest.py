"""Maps drawn in a test, and where the real ones are."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import osmium
import pytest

Tags: TypeAlias = Mapping[str, str]
DrawMap: TypeAlias = Callable[..., Path]
MAPS = Path(__file__).parents[2].parent / "shared/data/maps"


@pytest.fixture
def draw_map(tmp_path: Path) -> DrawMap:
    """A function that writes points and ways to a PBF: metres east and north of 42° N 1.5° E."""

    def draw(
        points: Mapping[int, tuple[float, float]],
        ways: Mapping[int, tuple[Sequence[int], Tags]],
        point_tags: Mapping[int, Tags] | None = None,
        relations: Sequence[tuple[Sequence[tuple[str, int, str]], Tags]] = (),
        name: str = "drawn.osm.pbf",
    ) -> Path:
        path = tmp_path / name
        with osmium.SimpleWriter(str(path), overwrite=True) as writer:
            for ref, (east_m, north_m) in sorted(points.items()):
                # radii of curvature at 42° on WGS 84: 111 073.4 m a degree north, 82 850.8 m a degree east
                location = (1.5 + east_m / 82_850.76, 42.0 + north_m / 111_073.38)
                tags = dict((point_tags or {}).get(ref, {}))
                writer.add_node(osmium.osm.mutable.Node(id=ref, location=location, tags=tags))
            for ref, (nodes, tags) in sorted(ways.items()):
                writer.add_way(osmium.osm.mutable.Way(id=ref, nodes=list(nodes), tags=dict(tags)))
            for ref, (members, tags) in enumerate(relations, start=1):
                writer.add_relation(osmium.osm.mutable.Relation(id=ref, members=list(members), tags=dict(tags)))
        return path

    return draw


@pytest.fixture
def real_maps() -> Path:
    """The folder of real maps; skips where it is absent, except in CI."""
    if not MAPS.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no real maps in {MAPS}: CI must have them")
        pytest.skip("no real maps beside the repository (shared/data/maps)")
    return MAPS
