from __future__ import annotations

import json
from typing import Any

import pytest

from app.stations.features import station_feature
from energy.charging.charging import Connector
from routing.places import Point
from routing.stations.notes import StationFileError
from routing.stations.station import Access, Price, Socket, Station
from tests.routing.stations.formats.conftest import Reading


def feature(properties: Any, at: Any = (11.5, 48.1), **changes: Any) -> dict[str, Any]:
    geometry = {"type": "Point", "coordinates": list(at)}
    return {"type": "Feature", "geometry": geometry, "properties": properties} | changes


def collection(*features: Any, **members: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": list(features)} | members


TAGS = {
    "amenity": "charging_station", "socket:type2": "2", "socket:type2:output": "22 kW", "socket:type2_combo": "1",
    "socket:type2_combo:output": "150 kW", "socket:chademo": "no", "operator": "Stadtwerke", "access": "customers",
    "fee": "yes", "charge": "0.45 EUR/kWh", "capacity": "3", "opening_hours": "Mo-Sa 08:00-20:00; PH off",
}  # fmt: skip


def test_points_with_documented_names_are_read(read_text: Reading) -> None:
    properties = {"name": "Inn", "connectors": ["CCS2", "Type 2"], "power_kw": 50, "id": 5, "operator": "X", "more": {}}
    read = read_text(collection(feature(properties)))
    (station,) = read.stations
    assert station.id == "file-stations:5"
    assert (station.at.lat_deg, station.at.lon_deg) == (48.1, 11.5)
    assert [socket.connector for socket in station.sockets] == [Connector.CCS2, Connector.TYPE2]
    assert read.source.key == station.source == "file-stations"


def test_plugs_may_be_objects(read_text: Reading) -> None:
    plugs = [{"type": "CCS2", "power_kw": 150, "count": 2}, {"type": "Type 2", "powerKW": "11"}, {"what": 1}]
    read = read_text(collection(feature({"connectors": plugs})))
    assert read.stations[0].sockets == (Socket(Connector.CCS2, 150_000.0, 2), Socket(Connector.TYPE2, 11_000.0, 1, 3))


@pytest.mark.parametrize(
    "entry",
    [
        feature(TAGS | {"@id": "node/123"}),
        feature(TAGS, id="node/123"),
        feature({"type": "node", "id": 123, "tags": TAGS, "meta": {}}),
        {"type": "node", "id": 123, "lat": 48.1, "lon": 11.5, "tags": TAGS},
    ],
)
def test_tags_of_openstreetmap_are_read_as_its_tools_write_them(read_text: Reading, entry: dict[str, Any]) -> None:
    name = "elements" if "lat" in entry else "features"
    read = read_text({"type": "FeatureCollection", name: [entry]})
    (station,) = read.stations
    assert station.id == "osm:n123"
    assert station.sockets == (Socket(Connector.TYPE2, 22_000.0, 2, 3), Socket(Connector.CCS2, 150_000.0))
    assert (station.access, station.fee, station.capacity) == (Access.CUSTOMERS, True, 3)
    assert station.price == Price("0.45 EUR/kWh", "EUR", 0.45)
    assert station.opening_hours == "Mo-Sa 08:00-20:00; PH off"
    assert (read.source.key, read.source.licence) == ("osm", "ODbL-1.0")


def test_an_outline_stands_for_its_middle(read_text: Reading) -> None:
    ring = [[11.0, 48.0], [11.2, 48.0], [11.2, 48.4], [11.0, 48.4], [11.0, 48.0]]
    entry = feature(TAGS, id="way/7", geometry={"type": "Polygon", "coordinates": [ring]})
    (station,) = read_text(collection(entry)).stations
    assert station.id == "osm:w7"
    assert (station.at.lat_deg, station.at.lon_deg) == pytest.approx((48.2, 11.1))


def test_sockets_without_an_own_output_take_that_of_the_station_where_there_is_one_kind(read_text: Reading) -> None:
    tags = {"amenity": "charging_station", "socket:nacs": "8", "charging_station:output": "72 kW;250 kW"}
    (station,) = read_text(collection(feature(tags, at=(-118.2, 35.1)))).stations
    assert station.sockets == (Socket(Connector.NACS, 250_000.0, 8),)


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        (feature(TAGS | {"motorcar": "no"}), "not for cars"),
        (feature({"amenity": "charging_station", "socket:usb-a": "1", "socket:bosch": "2"}), "not for cars"),
        (feature({"disused:amenity": "charging_station"}), "disused or not built yet"),
        (feature(TAGS, at=(48.1, 116.5)), "latitude and longitude swapped"),
        (feature(TAGS, at=()), "no place"),
        (feature(TAGS, geometry=None), "no place"),
        (feature(TAGS, geometry={"type": "Polygon", "coordinates": [[]]}), "no place"),
        (feature(None), "no plug given"),
        ("x", "no object"),
        ({"type": "way", "id": 1, "nodes": [], "tags": {"highway": "service"}}, "no charging station"),
        (feature({str(k): k for k in range(600)}), "too many properties"),
    ],
)
def test_a_feature_that_is_no_station_is_left_out_by_its_reason(read_text: Reading, entry: Any, reason: str) -> None:
    read = read_text(collection(feature(TAGS, id="node/1"), entry))
    assert len(read.stations) == 1
    assert read.left_out == {reason: 1}


def test_coordinates_of_another_system_are_refused(read_text: Reading) -> None:
    system = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    for text in (collection(feature(TAGS), crs=system), {"crs": system} | collection(feature(TAGS))):
        with pytest.raises(StationFileError, match=r"EPSG::25832.*longitude and latitude of WGS 84"):
            read_text(text)


def test_an_object_a_line_is_read(read_text: Reading) -> None:
    lines = "\n".join(json.dumps(feature(TAGS, id=f"node/{k}")) for k in (1, 2, 3))
    assert [station.id for station in read_text(lines).stations] == ["osm:n1", "osm:n2", "osm:n3"]


def test_stations_of_several_kinds_are_of_the_file(read_text: Reading) -> None:
    read = read_text(collection(feature(TAGS, id="node/1"), feature({"connectors": "CCS2"}, at=(11.6, 48.2))))
    assert {station.source for station in read.stations} == {read.source.key} == {"file-stations"}
    assert "ODbL" in read.source.licence


def test_what_is_true_or_false_in_json_is_read_as_such(read_text: Reading) -> None:
    names = {"connectors": "CCS2", "fee": False, "operational": False}
    (station,) = read_text(collection(feature(names))).stations
    assert (station.fee, station.operational) == (False, False)
    (station,) = read_text(collection(feature(names | {"fee": True, "operational": True}))).stations
    assert (station.fee, station.operational) == (True, True)


def test_plugs_that_are_objects_have_powers_with_or_without_a_unit(read_text: Reading) -> None:
    plugs = [{"type": "CCS2", "power": "150 kW", "count": 2}, {"type": "Type 2", "power_kw": 22}, {"type": "CHAdeMO"}]
    (station,) = read_text(collection(feature({"connectors": plugs, "power_kw": 60}))).stations
    assert [(socket.output_w, socket.count) for socket in station.sockets] == [(150e3, 2), (22e3, 1), (60e3, 1)]


def test_stations_as_the_service_answers_them_are_read_again(read_text: Reading) -> None:
    sockets = (Socket(Connector.CCS2, 300e3, 4), Socket(Connector.TYPE2, 11e3, 2, 3), Socket(Connector.CHADEMO, 50e3))
    price = Price("0.59 EUR/kWh + 0.1 EUR/min", "EUR", 0.59, 0.1)
    answered = Station(
        *("x:1", Point(48.1, 11.5), sockets, "Inn", "Op", "Net", 6, Access.CUSTOMERS, True, price, "24/7", False),
        source="x",
    )
    (station,) = read_text(collection(station_feature(answered))).stations
    same = ("at", "sockets", "name", "operator", "network", "capacity", "access", "fee", "opening_hours", "operational")
    assert [getattr(station, name) for name in same] == [getattr(answered, name) for name in same]
    assert station.price == price


def test_an_outline_over_the_antimeridian_stands_for_its_middle(read_text: Reading) -> None:
    ring = [[179.99, -17.0], [-179.97, -17.0], [-179.97, -17.2], [179.99, -17.2], [179.99, -17.0]]
    entry = feature(TAGS, geometry={"type": "Polygon", "coordinates": [ring]})
    (station,) = read_text(collection(entry)).stations
    assert (station.at.lat_deg, station.at.lon_deg) == pytest.approx((-17.1, -179.99))
