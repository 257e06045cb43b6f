"""Stations of drawn OpenStreetMap files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from energy.charging.charging import Connector
from routing.errors import ImportFailedError
from routing.stations.formats.osm.reading import is_osm, read_osm_stations
from routing.stations.formats.osm.tags import LeftOut
from routing.stations.station import Access, Socket
from tests.routing.stations.drawn import place

STATION = {"amenity": "charging_station"}
POINT = {"man_made": "charge_point"}
TYPE2 = {"socket:type2": "2", "socket:type2:output": "22 kW"}
# a car park of 60 m by 40 m
CORNERS = {1: (0, 0), 2: (60, 0), 3: (60, 40), 4: (0, 40), 5: (20, 20), 6: (40, 20), 7: (300, 0), 8: (90, 20)}


def test_a_station_drawn_as_a_point_has_its_tags(draw_map: Any) -> None:
    tags = STATION | TYPE2 | {
        "name": "Market", "operator": "Town", "network": "Net", "brand": "Brand", "capacity": "2", "fee": "yes",
        "charge": "0.40 EUR/kWh", "access": "customers", "opening_hours": "24/7",
    }  # fmt: skip
    read = read_osm_stations(draw_map(CORNERS, {}, {5: tags}))
    (found,) = read.stations
    assert found.id == "osm:n5"
    assert found.at.lat_deg == pytest.approx(place(20, 20).lat_deg, abs=2e-7)
    assert found.sockets == (Socket(Connector.TYPE2, 22_000.0, 2, 3),)
    assert (found.name, found.operator, found.network) == ("Market", "Town", "Net")
    assert (found.capacity, found.fee, found.access, found.opening_hours) == (2, True, Access.CUSTOMERS, "24/7")
    assert found.price is not None
    assert found.price.per_kwh == 0.4
    assert read.source.licence == "ODbL-1.0"
    assert "OpenStreetMap" in read.source.name
    assert found.source == read.source.key


def test_a_station_drawn_as_an_area_lies_in_it(draw_map: Any) -> None:
    read = read_osm_stations(draw_map(CORNERS, {10: ([1, 2, 3, 4, 1], STATION | TYPE2)}))
    (found,) = read.stations
    assert found.id == "osm:w10"
    assert place(0, 0).lat_deg < found.at.lat_deg < place(0, 40).lat_deg
    assert place(0, 0).lon_deg < found.at.lon_deg < place(60, 0).lon_deg


def test_a_station_drawn_as_a_relation_lies_among_its_members(draw_map: Any) -> None:
    outline = [(("w", 10, "outer"),), (("n", 5, ""), ("n", 6, ""))]
    for members in outline:
        ways = {10: ([1, 2, 3, 4, 1], {})}
        read = read_osm_stations(draw_map(CORNERS, ways, relations=[(members, STATION | TYPE2 | {"type": "site"})]))
        (found,) = read.stations
        assert found.id == "osm:r1"
        assert place(0, 0).lat_deg < found.at.lat_deg < place(0, 40).lat_deg


def test_charge_points_within_an_area_are_its_sockets_where_it_names_none(draw_map: Any) -> None:
    points = {5: POINT | TYPE2, 6: POINT | TYPE2}
    (found,) = read_osm_stations(draw_map(CORNERS, {10: ([1, 2, 3, 4, 1], STATION)}, points)).stations
    assert found.sockets == (Socket(Connector.TYPE2, 22_000.0, 4, 3),)
    assert found.capacity == 2
    assert found.merged == ("osm:n5", "osm:n6")


def test_charge_points_within_a_station_that_names_its_sockets_are_not_counted_again(draw_map: Any) -> None:
    area = STATION | {"socket:type2": "4", "socket:type2:output": "22 kW", "capacity": "4"}
    points = {5: POINT | TYPE2, 6: POINT | TYPE2}
    (found,) = read_osm_stations(draw_map(CORNERS, {10: ([1, 2, 3, 4, 1], area)}, points)).stations
    assert found.sockets == (Socket(Connector.TYPE2, 22_000.0, 4, 3),)
    assert found.capacity == 4


def test_a_station_drawn_twice_as_a_point_in_its_area_is_one(draw_map: Any) -> None:
    ways = {10: ([1, 2, 3, 4, 1], STATION | TYPE2)}
    (found,) = read_osm_stations(draw_map(CORNERS, ways, {5: STATION | TYPE2})).stations
    assert found.sockets == (Socket(Connector.TYPE2, 22_000.0, 2, 3),)


def test_charge_points_beside_a_station_drawn_as_a_point_are_its_own_and_far_ones_are_not(draw_map: Any) -> None:
    points = {
        5: STATION | {"operator": "EnBW"},
        6: POINT | TYPE2,
        8: POINT | TYPE2 | {"operator": "Shell"},
        7: POINT | TYPE2,
    }
    found = {s.id: s for s in read_osm_stations(draw_map(CORNERS, {}, points)).stations}
    assert set(found) == {"osm:n5", "osm:n7", "osm:n8"}  # 8 is of another operator, 7 is 280 m away
    assert found["osm:n5"].sockets == (Socket(Connector.TYPE2, 22_000.0, 2, 3),)


def test_what_is_left_out_is_counted_by_its_reason(draw_map: Any) -> None:
    points = {
        1: STATION | {"bicycle": "yes"},
        2: STATION | {"motorcar": "no"},
        3: {"disused:amenity": "charging_station"},
        4: STATION | {"construction": "yes"},
        5: STATION,
    }
    read = read_osm_stations(draw_map(CORNERS, {12: ([99], STATION)}, points))
    assert [found.id for found in read.stations] == ["osm:n5"]
    assert read.left_out == {
        str(LeftOut.NOT_FOR_CARS): 2,
        str(LeftOut.NOT_IN_USE): 2,
        str(LeftOut.NO_PLACE): 1,
    }


def test_a_number_is_the_name_of_a_station_without_one_and_fixme_is_none(draw_map: Any) -> None:
    points = {1: STATION | {"ref": "DE123"}, 7: STATION | {"ref": "fixme"}}
    assert [found.name for found in read_osm_stations(draw_map(CORNERS, {}, points)).stations] == ["DE123", ""]


def test_xml_with_negative_ids_and_deleted_objects_is_read(tmp_path: Path) -> None:
    path = tmp_path / "edited.osm"
    tag = '<tag k="amenity" v="charging_station"/>'
    path.write_text(
        '<osm version="0.6">'
        f'<node id="-1" version="1" lat="42.0" lon="1.5">{tag}</node>'
        f'<node id="-2" version="1" action="delete" lat="42.0" lon="1.6">{tag}</node>'
        '<node id="-3" version="1" lat="42.0" lon="1.7"/><node id="-4" version="1" lat="42.001" lon="1.7"/>'
        '<node id="-5" version="1" lat="42.0" lon="1.701"/>'
        f'<way id="-9" version="1"><nd ref="-3"/><nd ref="-4"/><nd ref="-5"/><nd ref="-3"/>{tag}</way>'
        "</osm>",
        encoding="utf-8",
    )
    assert [found.id for found in read_osm_stations(path).stations] == ["osm:n-1", "osm:w-9"]


def test_a_file_that_is_missing_or_damaged_is_named(tmp_path: Path) -> None:
    with pytest.raises(ImportFailedError, match="no such file"):
        read_osm_stations(tmp_path / "gone.osm.pbf")
    (tmp_path / "bad.osm.pbf").write_bytes(b"\x00\x00\x00\x0dnonsense and more of it")
    with pytest.raises(ImportFailedError, match=r"bad\.osm\.pbf"):
        read_osm_stations(tmp_path / "bad.osm.pbf")


@pytest.mark.parametrize("name", ["drawn.osm.pbf", "drawn", "drawn.csv"])
def test_a_file_of_a_map_is_told_by_its_name_or_content(draw_map: Any, tmp_path: Path, name: str) -> None:
    path = draw_map(CORNERS, {}, {5: STATION | TYPE2}).rename(tmp_path / name)
    assert is_osm(path)
    (tmp_path / "text.xml").write_text('<?xml version="1.0"?><osm version="0.6"></osm>', encoding="utf-16")
    assert is_osm(tmp_path / "text.xml")


def test_other_files_are_none_of_a_map(tmp_path: Path) -> None:
    (tmp_path / "stations.csv").write_text("lat,lon,connectors\n48,11,CCS2\n", encoding="utf-8")
    assert not is_osm(tmp_path / "stations.csv")
    assert not is_osm(tmp_path / "gone.csv")
    assert not is_osm(tmp_path)
