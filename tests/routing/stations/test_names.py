"""What queries name of stations: what is unknown is refused, with what may have been meant."""

from __future__ import annotations

import re

import numpy as np
import pytest

from energy.charging.charging import Charging, Connector, PowerCurve
from routing.errors import QueryError
from routing.places import Point
from routing.stations.names import StationNames, network_rules
from routing.stations.station import Socket, Station, Stations

CCS = Socket(Connector.CCS2, 150_000.0)
TYPE2 = Socket(Connector.TYPE2, 22_000.0)
CAR = Charging((Connector.CCS2,), PowerCurve(np.array([0.0, 1.0]), np.array([1e5, 2e4])), ac_power_w=11_000.0)


def named(*stations: Station) -> StationNames:
    return StationNames("drawn", Stations(stations, ()))


def station(station_id: str, *sockets: Socket, network: str = "", operator: str = "") -> Station:
    return Station(station_id, Point(46.5, 8.0), sockets, operator=operator, network=network)


def test_unknown_id_is_refused_with_those_that_may_be_meant() -> None:
    names = named(station("osm:n1"), station("osm:n2"), station("ocm:345"))
    names.check_id("stations[0]", "osm:n2")
    with pytest.raises(QueryError, match=re.escape("stations[1] is 345, allowed: ids of stations of graph 'drawn'")):
        names.check_id("stations[1]", "345")
    with pytest.raises(QueryError, match="did you mean 'ocm:345'"):
        names.check_id("stations[0]", "345")
    with pytest.raises(QueryError, match="did you mean 'osm:n1'"):
        names.check_id("stations[0]", "OSM:N1")


def test_what_was_meant_is_found_among_very_many_ids() -> None:
    names = named(*(station(f"osm:n{k}") for k in range(0, 200_000, 10)))
    with pytest.raises(QueryError, match=r"did you mean 'osm:n1234\d+'"):
        names.check_id("stations[0]", "osm:n12345")


def test_an_id_like_none_is_refused_without_a_question() -> None:
    for wrong in ("?", "x" * 400):
        with pytest.raises(QueryError, match=r"ids of stations of graph 'drawn'$"):
            named(station("osm:n1")).check_id("stations[0]", wrong)


def test_networks_are_found_in_any_case_among_networks_and_operators() -> None:
    names = named(station("a", network="Fast"), station("b", operator="FAST"), station("c", operator="Town Works"))
    assert names.networks("network", "fast") == {"Fast", "FAST"}
    factors, excluded = network_rules(
        names, "networks.", [("preferred", ["fast"], 0.8), ("excluded", ["town works"], None)]
    )
    assert factors == {"Fast": 0.8, "FAST": 0.8}
    assert excluded == frozenset({"Town Works"})
    with pytest.raises(QueryError, match=r"networks.avoided\[0\] is town, .* did you mean 'Town Works'\?"):
        network_rules(names, "networks.", [("avoided", ["town"], 1.5)])


def test_plugs_must_fit_the_vehicle_and_be_at_a_station() -> None:
    names = named(station("a", CCS, TYPE2))
    assert set(names.usable_plugs("connectors", CAR, ())) == {Connector.CCS2, Connector.TYPE2}
    assert names.usable_plugs("connectors", CAR, (Connector.CCS2,)) == [Connector.CCS2]
    with pytest.raises(QueryError, match=r"connectors\[0\] is chademo, allowed: plugs that fit the vehicle: ccs2"):
        names.usable_plugs("connectors", CAR, (Connector.CHADEMO,))
    with pytest.raises(QueryError, match="plugs that stations of graph 'drawn' have: type2"):
        named(station("a", TYPE2)).usable_plugs("connectors", CAR, (Connector.CCS2,))
    assert named(station("a", Socket(Connector.CHADEMO, 5e4))).usable_plugs("connectors", CAR, ()) == []


def test_least_power_is_at_most_that_of_the_best_socket() -> None:
    names = named(station("a", CCS, TYPE2))
    names.check_power("power", 150.0, [Connector.CCS2, Connector.TYPE2])
    with pytest.raises(QueryError, match="power is 30, allowed: at most 22"):
        names.check_power("power", 30, [Connector.TYPE2])


def test_without_stations_only_ids_are_refused() -> None:
    names = named()
    assert names.usable_plugs("connectors", CAR, (Connector.CCS2,)) == []
    assert names.networks("networks", "Ionity") == set()
    with pytest.raises(QueryError, match="ids of stations of graph 'drawn', which has none"):
        names.check_id("stations[0]", "a")
    with pytest.raises(QueryError, match="plugs that fit the vehicle"):
        names.usable_plugs("connectors", CAR, (Connector.CHADEMO,))
