"""Stations by what is asked for."""

from __future__ import annotations

from datetime import datetime

import pytest

from energy.charging.charging import Connector
from routing.places import Point
from routing.stations.selection import StationFilter, StationIndex, power_w
from routing.stations.station import Access, Socket, Stations
from tests.routing.stations.drawn import CCS, SOURCE, TYPE2, station

pytestmark = pytest.mark.nojit

SLOW_CCS = Socket(Connector.CCS2, 50_000.0)
UNSAID = Socket(Connector.CHADEMO, None)
STATIONS = (
    station("a", 0, 0, at=Point(42.0, 1.5), operator="Ionity", sockets=(CCS,), access=Access.PUBLIC),
    station(
        "b", 0, 0, at=Point(43.0, 2.5), network="ladenetz.de", sockets=(TYPE2, SLOW_CCS), opening_hours="Mo 08:00-10:00"
    ),
    station("c", 0, 0, at=Point(44.0, 179.9), sockets=(UNSAID,), access=Access.PRIVATE, opening_hours="ask"),
    station("d", 0, 0, at=Point(44.0, -179.9), sockets=()),
)
INDEX = StationIndex(Stations(STATIONS, (SOURCE,)))
MONDAY = datetime(2026, 6, 1, 9)


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        (StationFilter(), "abcd"),
        (StationFilter(bbox=(1.0, 41.0, 2.0, 43.0)), "a"),
        (StationFilter(bbox=(1.5, 42.0, 1.5, 42.0)), "a"),
        (StationFilter(bbox=(179.0, 40.0, -179.0, 50.0)), "cd"),
        (StationFilter(connectors=frozenset((Connector.CCS2,))), "ab"),
        (StationFilter(connectors=frozenset((Connector.CCS2, Connector.CHADEMO))), "abc"),
        (StationFilter(min_power_w=22_000.0), "ab"),
        (StationFilter(min_power_w=22_000.0, connectors=frozenset((Connector.TYPE2,))), "b"),
        (StationFilter(min_power_w=30_000.0, connectors=frozenset((Connector.TYPE2,))), ""),
        (StationFilter(network="LADENETZ"), "b"),
        (StationFilter(network="ionity"), "a"),
        (StationFilter(access=frozenset((Access.PUBLIC, Access.UNKNOWN))), "abd"),
        (StationFilter(open_at=MONDAY), "abcd"),
        (StationFilter(open_at=MONDAY.replace(hour=11)), "acd"),
        (StationFilter(bbox=(0.0, 0.0, 3.0, 50.0), open_at=MONDAY, min_power_w=100_000.0), "a"),
    ],
)
def test_filters_let_through_what_is_as_asked_or_not_known_to_be_closed(asked: StationFilter, found: str) -> None:
    assert "".join(STATIONS[k].id[-1] for k in INDEX.matching(asked).tolist()) == found


def test_power_is_that_of_the_strongest_socket_and_0_where_none_is_known() -> None:
    assert [power_w(found) for found in STATIONS] == [150_000.0, 50_000.0, 0.0, 0.0]
    assert INDEX.power_w.tolist() == [150_000.0, 50_000.0, 0.0, 0.0]


def test_an_index_of_no_stations_has_none() -> None:
    assert len(StationIndex(Stations((), ()))) == 0
    assert StationIndex(Stations((), ())).matching(StationFilter(min_power_w=1.0)).tolist() == []
