"""Which road a station is reached from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from energy.stops import FunctionalClass
from routing.graph.nearest import RoadTree
from routing.graph.road_graph import RoadGraph
from routing.graph.snap import RoadIndex
from routing.importers.region import import_region
from routing.places import Point
from routing.stations.placing import EXTRA_M, STATION_LIMIT_M, place_stations
from routing.synth import synthesize
from tests.routing.stations.drawn import place, station

STREET, SERVICE = {"highway": "residential"}, {"highway": "service"}
MOTORWAY = {"highway": "motorway", "oneway": "yes"}

#  3 ------------------------------ 4    y = 1000, a street both ways; 7-8 is an oneway service road at y = 940
#  |   (7 ---------> 8)             |
#  1 ------------------------------ 2    y = 0, a motorway from 1 to 2; the rest is streets
POINTS = {
    1: (0, 0),
    2: (2000, 0),
    3: (0, 1000),
    4: (2000, 1000),
    7: (500, 940),
    8: (900, 940),
    9: (500, 1000),
    10: (900, 1000),
}
WAYS = {
    20: ([1, 2], MOTORWAY),
    21: ([2, 4, 10, 9, 3, 1], STREET),
    22: ([9, 7, 8, 10], {**SERVICE, "oneway": "yes"}),
}


@pytest.fixture
def town(draw_map: Any) -> RoadGraph:
    return import_region(draw_map(POINTS, WAYS), [], "town")


def classes(graph: RoadGraph, *stations: Any) -> list[FunctionalClass]:
    placed = place_stations(graph, stations)
    return [FunctionalClass(int(graph.functional_class[s.position[0].link_idx])) for s in placed.stations]


def test_a_station_is_placed_on_both_directions_of_its_road(town: RoadGraph) -> None:
    (found,) = place_stations(town, [station("a", 1500, 1010)]).stations
    assert len(found.position) == 2
    there, back = found.position
    assert town.reverse_idx[there.link_idx] == back.link_idx
    assert there.offset_m + back.offset_m == pytest.approx(town.length_m[there.link_idx])
    snapped, _ = RoadIndex(town).snap("a", found.at, 100.0)
    assert there.offset_m == pytest.approx(snapped.offset_m, abs=0.01)
    assert found.snap_m == pytest.approx(10.0, abs=0.1)


def test_a_station_on_a_oneway_road_is_reached_in_its_direction_only(town: RoadGraph) -> None:
    (found,) = place_stations(town, [station("a", 700, 935)]).stations
    (only,) = found.position
    assert town.functional_class[only.link_idx] == FunctionalClass.SERVICE
    assert town.reverse_idx[only.link_idx] == -1


def test_a_service_road_is_preferred_to_a_main_road_that_is_a_little_nearer(draw_map: Any) -> None:
    def graph(kind: str) -> RoadGraph:
        ways = {**WAYS, 21: ([2, 4, 10, 9, 3, 1], {"highway": kind})}
        return import_region(draw_map(POINTS, ways), [], "town")

    # 26 m from the road, 34 m from the service road
    assert classes(graph("primary"), station("a", 700, 974)) == [FunctionalClass.SERVICE]
    assert classes(graph("residential"), station("a", 700, 974)) == [FunctionalClass.RESIDENTIAL]
    assert EXTRA_M[FunctionalClass.PRIMARY] > 34 - 26


def test_nobody_stops_on_a_motorway(town: RoadGraph) -> None:
    placed = place_stations(town, [station("behind the fence", 1000, 20), station("near a street", 1900, 20)])
    assert [s.id for s in placed.stations] == ["drawn:near a street"]
    assert [far.id for far in placed.far] == ["drawn:behind the fence"]
    assert placed.far[0].distance_m == pytest.approx(920, abs=15)  # the service road


def test_stations_off_the_road_and_beyond_the_map_are_left_out_with_their_distance(town: RoadGraph) -> None:
    stations = [
        station("far", 1000, 400),
        station("beyond", 90_000, 0),
        station("near", 1000, 1020),
        station("less far", 1500, 1000 - STATION_LIMIT_M - 10),
    ]
    placed = place_stations(town, stations)
    assert [found.id for found in placed.stations] == ["drawn:near"]
    assert placed.outside == 1
    assert [far.id for far in placed.far] == ["drawn:less far", "drawn:far"]
    assert [far.distance_m for far in placed.far] == pytest.approx([260, 549], abs=3)  # to the street, the service road
    assert placed.left_out == {"outside the map": 1, "over 250 m from a road": 2}


def test_a_station_on_an_island_is_left_out(draw_map: Any) -> None:
    points = {**POINTS, 30: (1000, 3000), 31: (1200, 3000), 32: (500, 5000), 33: (600, 5000)}
    ways = {**WAYS, 30: ([30, 31], STREET), 31: ([32, 33], STREET)}
    graph = import_region(draw_map(points, ways), [], "town")
    placed = place_stations(graph, [station("island", 1100, 3005)])
    assert placed.stations == ()
    assert sum(placed.left_out.values()) == 1


def test_no_stations_and_no_near_ones_are_no_error(town: RoadGraph) -> None:
    assert place_stations(town, []).stations == ()
    assert place_stations(town, [station("pole", 0, 0, at=place(0, 5e6))]).outside == 1


def test_the_road_found_is_the_best_of_all_roads() -> None:
    graph = synthesize("small", seed=5, width_km=None, height_km=None, links_target=900)
    rng = np.random.default_rng(4)
    west, south, east, north = graph.meta.bbox
    stations = [
        station(str(k), 0, 0, at=Point(float(lat), float(lon)))
        for k, (lat, lon) in enumerate(zip(rng.uniform(south, north, 60), rng.uniform(west, east, 60), strict=True))
    ]
    roads = RoadTree(graph)
    placed = {found.id: found for found in place_stations(graph, stations).stations}
    assert len(placed) > 3
    for asked in stations:
        scores = []
        for link in range(graph.link_count):
            share, away_m, _ = roads.foot(link, asked.at)
            offset_m = share * float(graph.length_m[link])
            extra_m = EXTRA_M[FunctionalClass(int(graph.functional_class[link]))] + 60.0 * bool(graph.structure[link])
            if away_m <= STATION_LIMIT_M:
                scores.append((away_m + extra_m, offset_m, away_m))
        best = min(scores, default=(np.inf, 0.0, 0.0))
        if best[0] == np.inf:
            assert asked.id not in placed
            continue
        found = placed[asked.id]
        on = found.position[0]
        extra_m = EXTRA_M[FunctionalClass(int(graph.functional_class[on.link_idx]))] + 60.0 * bool(
            graph.structure[on.link_idx]
        )
        assert found.snap_m + extra_m == pytest.approx(best[0], abs=0.02)


@pytest.mark.parametrize(("north_m", "south_of_m", "north_of_m"), [(-45.0, 0.0, -90.0), (75.0, 120.0, 30.0)])
def test_a_station_of_motorway_services_is_reached_from_its_own_carriageway_only(
    draw_map: Any, north_m: float, south_of_m: float, north_of_m: float
) -> None:
    points = {
        1: (0, 0),
        2: (1000, 0),
        3: (2000, 0),
        4: (3000, 0),
        5: (3000, 30),
        6: (2000, 30),
        7: (1000, 30),
        8: (0, 30),
        9: (1300, -40),
        10: (1700, -40),
        11: (1700, 70),
        12: (1300, 70),
    }
    motorway, ramp = {"highway": "motorway"}, {"highway": "motorway_link", "oneway": "yes"}
    ways = {
        20: ([1, 2, 3, 4], motorway),
        21: ([5, 6, 7, 8], motorway),
        22: ([2, 9, 10, 3], ramp),
        23: ([6, 11, 12, 7], ramp),
        24: ([4, 5], {"highway": "primary"}),
        25: ([8, 1], {"highway": "primary"}),
    }
    graph = import_region(draw_map(points, ways), [], "services")
    (found,) = place_stations(graph, [station("a", 1500, north_m)]).stations
    (position,) = found.position  # no link leads the other way
    lat_deg = graph.geometry(position.link_idx)[:, 1]
    assert place(0, north_of_m).lat_deg < float(lat_deg.min())
    assert float(lat_deg.max()) < place(0, south_of_m).lat_deg + 1e-7
