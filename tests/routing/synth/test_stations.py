"""Stations of synthetic regions: the same for the same seed, of mixed power, apart from each other."""

from __future__ import annotations

import numpy as np
import pytest

from energy.charging.charging import DC_CONNECTORS
from energy.stops import FunctionalClass
from routing.graph.earth import great_circle_m
from routing.graph.road_graph import RoadGraph
from routing.stations.files import stations_bytes
from routing.stations.opening import is_understood
from routing.stations.placing import EXTRA_M
from routing.stations.station import Stations
from routing.synth import synthesize
from routing.synth.stations import ASIDE_M, MOTORWAY_APART_M, RURAL_APART_M, SYNTH_KEY, TOWN_APART_M, synthetic_stations


@pytest.fixture(scope="module")
def region() -> RoadGraph:
    return synthesize("small", seed=3, width_km=None, height_km=None, links_target=12_000)


@pytest.fixture(scope="module")
def stations(region: RoadGraph) -> Stations:
    return synthetic_stations(region, 3)


def test_the_same_seed_makes_the_same_stations_and_another_one_others(region: RoadGraph, stations: Stations) -> None:
    assert stations_bytes(region, synthetic_stations(region, 3)) == stations_bytes(region, stations)
    assert synthetic_stations(region, 4) != stations


def test_stations_are_beside_roads_of_every_sort(region: RoadGraph, stations: Stations) -> None:
    kinds = {found.id.removeprefix(f"{SYNTH_KEY}:").partition("-")[0] for found in stations.stations}
    assert kinds == {"motorway", "town", "rural"}
    for found in stations.stations:
        assert found.position
        assert found.snap_m <= ASIDE_M[1] + EXTRA_M[FunctionalClass.TRUNK]  # a smaller road may be a little farther
        assert region.functional_class[found.position[0].link_idx] != FunctionalClass.MOTORWAY
        assert found.opening_hours is not None
        assert is_understood(found.opening_hours)
        assert found.price is not None
        assert found.price.per_kwh is not None


def test_stations_keep_apart_from_each_other(stations: Stations) -> None:
    every = stations.stations
    lat, lon = (np.array([getattr(s.at, f) for s in every]) for f in ("lat_deg", "lon_deg"))
    for kind, apart_m in (("motorway", MOTORWAY_APART_M), ("rural", RURAL_APART_M), ("town", TOWN_APART_M)):
        chosen = [k for k, found in enumerate(every) if found.id.startswith(f"{SYNTH_KEY}:{kind}")]
        away_m = great_circle_m(lat[chosen][:, None], lon[chosen][:, None], lat[chosen], lon[chosen])
        np.fill_diagonal(away_m, np.inf)
        assert away_m.min(initial=np.inf) > apart_m - 2.0 * ASIDE_M[1] - 0.01 * apart_m


def test_power_is_mixed_and_highest_at_motorways(stations: Stations) -> None:
    powers = {socket.output_w for found in stations.stations for socket in found.sockets}
    assert {11_000.0, 22_000.0, 50_000.0} <= powers
    for found in stations.stations:
        if found.id.startswith(f"{SYNTH_KEY}:motorway"):
            assert any(s.connector in DC_CONNECTORS and (s.output_w or 0.0) >= 150_000.0 for s in found.sockets)
