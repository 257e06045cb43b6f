"""The graphs that come with the package: there, whole, small enough, and honest about their source."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from energy.stops import FunctionalClass
from routing.graph.earth import great_circle_m
from routing.graph.files import load_graph
from routing.graph.road_graph import RoadGraph, Terrain
from routing.stations.files import NO_STATIONS, STATIONS_FILE, load_stations, stations_bytes
from routing.synth.stations import synthetic_stations

GRAPHS = Path(__file__).parents[3] / "data/graphs"
MOST_BYTES = 12_000_000
# the terms under which each may be passed on, and what must be shown with it
TERMS = {
    "highlands": ("CC0-1.0", "no real place", Terrain.SYNTHETIC),
    "coquimbo": ("ODbL-1.0", "© OpenStreetMap contributors", Terrain.ABSENT),
}


@pytest.fixture(scope="module")
def highlands() -> RoadGraph:
    return load_graph(GRAPHS / "highlands")


@pytest.fixture(scope="module")
def coquimbo() -> RoadGraph:
    return load_graph(GRAPHS / "coquimbo")


def most_climb_m(graph: RoadGraph) -> float:
    """Height gained on the longest drive that never goes down, on roads of at least tertiary class [m]."""
    climb = graph.climb_m()
    up = np.flatnonzero((graph.functional_class <= FunctionalClass.TERTIARY) & (climb > 0.0))
    gained = np.zeros(graph.node_count)
    for link in up[np.argsort(graph.node_height_m[graph.tail[up]], kind="stable")].tolist():
        tail, head = graph.tail[link], graph.head[link]
        gained[head] = max(gained[head], gained[tail] + climb[link])
    return float(gained.max())


@pytest.mark.parametrize("name", TERMS)
def test_bundled_graph_states_its_terms(name: str) -> None:
    licence, attribution, terrain = TERMS[name]
    meta = load_graph(GRAPHS / name).meta  # load_graph refuses any other format version
    assert meta.name == name
    assert meta.licence == licence
    assert attribution in meta.attribution
    assert meta.terrain is terrain
    assert meta.source


@pytest.mark.parametrize("name", TERMS)
def test_bundled_graph_is_small_enough_to_ship(name: str) -> None:
    assert sum(path.stat().st_size for path in (GRAPHS / name).iterdir()) < MOST_BYTES


@pytest.mark.parametrize("name", TERMS)
def test_bundled_graph_arrays_are_sound(name: str) -> None:
    graph = load_graph(GRAPHS / name)
    assert graph.length_m.min() > 0.0
    assert graph.speed_limit_mps.min() >= 10.0 / 3.6
    assert graph.speed_limit_mps.max() <= 150.0 / 3.6
    assert (np.diff(graph.tail) >= 0).all()
    assert (np.diff(graph.successor_first) > 0).all()
    assert (
        graph.tail[graph.successor]
        == graph.head[np.repeat(np.arange(graph.link_count), np.diff(graph.successor_first))]
    ).all()
    beeline = great_circle_m(
        graph.node_lat_deg[graph.tail],
        graph.node_lon_deg[graph.tail],
        graph.node_lat_deg[graph.head],
        graph.node_lon_deg[graph.head],
    )
    assert (beeline <= graph.length_m * 1.005 + 0.1).all()


def test_highlands_is_as_large_as_promised(highlands: RoadGraph) -> None:
    assert highlands.link_count >= 40_000
    west, south, east, north = highlands.meta.bbox
    middle = (south + north) / 2.0
    assert float(great_circle_m(middle, west, middle, east)) >= 150e3
    assert float(great_circle_m(south, west, north, west)) >= 100e3


def test_highlands_has_a_pass_of_a_thousand_metres(highlands: RoadGraph) -> None:
    assert most_climb_m(highlands) >= 1_000.0


def test_highlands_has_every_class_from_motorway_to_service_road(highlands: RoadGraph) -> None:
    km = np.bincount(highlands.functional_class, highlands.length_m, len(FunctionalClass)) / 1e3
    assert (km > 20.0).all()
    assert km[FunctionalClass.MOTORWAY] < km[FunctionalClass.PRIMARY] < km[FunctionalClass.TERTIARY]


def test_coquimbo_is_flat_and_in_chile(coquimbo: RoadGraph) -> None:
    assert (coquimbo.node_height_m == 0.0).all()
    west, south, east, north = coquimbo.meta.bbox
    assert -71.6 < west < east < -71.0
    assert -30.2 < south < north < -29.7
    assert coquimbo.link_count > 30_000
    assert 0.7 < coquimbo.urban.mean() < 1.0


def test_highlands_carries_the_stations_that_synth_makes_and_coquimbo_none(
    highlands: RoadGraph, coquimbo: RoadGraph
) -> None:
    stored = (GRAPHS / "highlands" / STATIONS_FILE).read_bytes()
    stations = synthetic_stations(highlands, 18)
    assert stations_bytes(highlands, stations) == stored
    assert load_stations(GRAPHS / "highlands", highlands) == stations
    assert load_stations(GRAPHS / "coquimbo", coquimbo) == NO_STATIONS
