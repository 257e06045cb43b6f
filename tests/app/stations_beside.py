"""Stations on the hand-made street grid, for tests of what is answered of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from energy.charging.charging import Connector
from routing.places import Point
from routing.stations.placing import place_stations
from routing.stations.station import Access, Price, Socket, Station, Stations, StationSource

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph

OSM = StationSource("osm", "© OpenStreetMap contributors", "ODbL-1.0", "https://www.openstreetmap.org/copyright")
OCM = StationSource("ocm", "Open Charge Map", "CC-BY-4.0")
TYPE2 = Socket(Connector.TYPE2, 22_000.0, 2, 3)
CCS = Socket(Connector.CCS2, 150_000.0, 4)

DRAWN = (
    Station(
        "osm:n1", Point(46.5001, 8.005), (TYPE2,), "Market «1»", "Town", opening_hours="Mo-Fr 08:00-18:00", source="osm"
    ),
    Station(
        "osm:n2", Point(46.5101, 8.005), (TYPE2, CCS), "", "Ionity", "Ionity", 4, Access.PUBLIC, True, source="osm"
    ),
    Station(
        "ocm:3",
        Point(46.5199, 8.015),
        (CCS,),
        price=Price("0.49 EUR/kWh", "EUR", 0.49),
        opening_hours="8 to 6",
        source="ocm",
    ),
    Station("ocm:4", Point(46.5099, 8.0151), (), access=Access.CUSTOMERS, operational=False, source="ocm"),
)


def grid_stations(graph: RoadGraph) -> Stations:
    """Four stations of two sources."""
    placed = place_stations(graph, sorted(DRAWN, key=lambda station: station.id))
    assert len(placed.stations) == len(DRAWN)
    return Stations(placed.stations, (OCM, OSM), {"outside the map": 7})
