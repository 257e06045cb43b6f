"""What of a drawn OpenStreetMap file is one station, and that no socket of it counts twice."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import osmium
import pytest

from energy.charging.charging import Connector
from routing.stations.formats.osm.reading import read_osm_stations
from routing.stations.reading import ReadStations, read_stations
from routing.stations.station import Access, Socket

STATION = {"amenity": "charging_station"}
POINT = {"man_made": "charge_point"}
SITE = {"type": "site"} | STATION
AREA = {"type": "multipolygon"} | STATION
TYPE2 = {"socket:type2": "1", "socket:type2:output": "22 kW"}
TYPE2_2 = {"socket:type2": "2", "socket:type2:output": "22 kW"}
CCS = {"socket:type2_combo": "1", "socket:type2_combo:output": "150 kW"}
# two car parks of 60 m by 40 m, 40 m apart; 5, 6 in the first, 15, 16 in the second
CORNERS = {
    1: (0, 0),
    2: (60, 0),
    3: (60, 40),
    4: (0, 40),
    5: (20, 20),
    6: (40, 20),
    11: (100, 0),
    12: (160, 0),
    13: (160, 40),
    14: (100, 40),
    15: (120, 20),
    16: (140, 20),
    7: (1000, 0),
    8: (1020, 0),
}
FIRST, SECOND = [1, 2, 3, 4, 1], [11, 12, 13, 14, 11]
HALVES = {20: ([1, 2, 3], {}), 21: ([3, 4, 1], {})}


def sockets(read: ReadStations) -> dict[str, list[tuple[str, float | None, int]]]:
    return {
        found.id: sorted((s.connector.value, s.output_w, s.count) for s in found.sockets) for found in read.stations
    }


@pytest.mark.parametrize("point", [5, 2])
def test_a_charge_point_in_an_area_or_on_its_outline_is_a_part_of_it(draw_map: Any, point: int) -> None:
    read = read_osm_stations(draw_map(CORNERS, {10: (FIRST, STATION | TYPE2)}, {point: POINT | TYPE2}))
    assert sockets(read) == {"osm:w10": [("type2", 22_000.0, 1)]}
    assert read.parts == 1


@pytest.mark.parametrize("point", [5, 15])
def test_a_charge_point_in_any_ring_of_a_multipolygon_is_a_part_of_it(draw_map: Any, point: int) -> None:
    ways = HALVES | {22: (SECOND, {})}
    members = (("w", 20, "outer"), ("w", 21, "outer"), ("w", 22, "outer"))
    read = read_osm_stations(draw_map(CORNERS, ways, {point: POINT | TYPE2}, [(members, AREA)]))
    assert sockets(read) == {"osm:r1": [("type2", 22_000.0, 1)]}


def test_an_outline_that_is_tagged_as_its_multipolygon_is_one_station(draw_map: Any) -> None:
    ways = {10: (FIRST, STATION | TYPE2_2)}
    read = read_osm_stations(draw_map(CORNERS, ways, {5: POINT | TYPE2}, [((("w", 10, "outer"),), AREA | TYPE2_2)]))
    assert len(read.stations) == 1
    assert list(sockets(read).values()) == [[("type2", 22_000.0, 2)]]
    assert read.parts == 2


@pytest.mark.parametrize("own", [{}, TYPE2_2])
@pytest.mark.parametrize("kind", [POINT, STATION])
def test_members_of_a_site_are_its_parts_with_their_sockets_once(
    draw_map: Any, own: dict[str, str], kind: dict[str, str]
) -> None:
    members = (("n", 5, ""), ("n", 15, ""))
    points = {5: kind | TYPE2, 15: kind | TYPE2}
    read = read_osm_stations(draw_map(CORNERS, {}, points, [(members, SITE | own)]))
    assert sockets(read) == {"osm:r1": [("type2", 22_000.0, 2)]}
    assert read.stations[0].merged == ("osm:n15", "osm:n5")


def test_areas_of_a_site_are_its_parts_with_the_charge_points_in_them(draw_map: Any) -> None:
    ways = {10: (FIRST, STATION), 11: (SECOND, STATION | TYPE2_2)}
    points = {5: POINT | CCS, 6: POINT | CCS, 15: POINT | TYPE2, 16: POINT | TYPE2}
    members = (("w", 10, ""), ("w", 11, ""), ("n", 5, ""), ("n", 15, ""))
    read = read_osm_stations(draw_map(CORNERS, ways, points, [(members, SITE)]))
    assert sockets(read) == {"osm:r1": [("ccs2", 150_000.0, 2), ("type2", 22_000.0, 2)]}
    assert read.parts == 6


def test_a_site_of_nothing_but_other_relations_lies_among_them(draw_map: Any) -> None:
    ways = HALVES
    halves = (("w", 20, "outer"), ("w", 21, "outer"))
    read = read_osm_stations(draw_map(CORNERS, ways, {}, [(halves, AREA | TYPE2), ((("r", 1, ""),), SITE)]))
    assert sockets(read) == {"osm:r2": [("type2", 22_000.0, 1)]}


def test_members_far_from_a_site_are_stations_of_their_own(draw_map: Any) -> None:
    points = dict.fromkeys((5, 6, 7, 8), STATION | TYPE2)
    read = read_osm_stations(
        draw_map(CORNERS, {}, points, [(tuple(("n", k, "") for k in (1, 2, 3, 4, 5, 6, 7)), SITE)])
    )
    assert sockets(read) == {
        "osm:r1": [("type2", 22_000.0, 2)],
        "osm:n7": [("type2", 22_000.0, 1)],
        "osm:n8": [("type2", 22_000.0, 1)],
    }


def test_sockets_of_several_charge_points_add_up_beside_a_station_that_sums_them(draw_map: Any) -> None:
    points = {1: STATION | TYPE2_2, 2: POINT | TYPE2, 5: POINT | TYPE2, 15: POINT | CCS}
    read = read_osm_stations(draw_map(CORNERS, {}, points))
    assert sockets(read) == {"osm:n1": [("type2", 22_000.0, 2)], "osm:n15": [("ccs2", 150_000.0, 1)]}


def test_a_station_drawn_in_an_area_has_the_charge_points_beside_it_not_the_area(draw_map: Any) -> None:
    points = {5: STATION | TYPE2_2, 6: POINT | TYPE2, 2: POINT | TYPE2}
    read = read_osm_stations(draw_map(CORNERS, {10: (FIRST, STATION)}, points))
    assert sockets(read) == {"osm:w10": [("type2", 22_000.0, 2)]}
    assert read.parts == 3


def test_each_plug_is_as_the_station_or_its_charge_points_say_who_knows_more_of_it(draw_map: Any) -> None:
    whole = STATION | {"socket:type2": "2", "socket:type2_combo": "4", "socket:type2_combo:output": "150 kW"}
    points = {5: POINT | TYPE2 | CCS, 6: POINT | TYPE2}
    read = read_osm_stations(draw_map(CORNERS, {10: (FIRST, whole)}, points))
    assert sockets(read) == {"osm:w10": [("ccs2", 150_000.0, 4), ("type2", 22_000.0, 2)]}


def test_facts_that_a_station_does_not_say_come_from_its_charge_points(draw_map: Any) -> None:
    said = {"operator": "EnBW", "access": "customers", "fee": "yes", "opening_hours": "24/7", "ref": "DE1"}
    (found,) = read_osm_stations(draw_map(CORNERS, {10: (FIRST, STATION)}, {5: POINT | TYPE2 | said})).stations
    assert (found.operator, found.access, found.fee, found.opening_hours) == ("EnBW", Access.CUSTOMERS, True, "24/7")
    assert found.name == ""
    assert found.capacity == 1


def test_a_station_of_another_operator_in_an_area_is_one_of_its_own(draw_map: Any) -> None:
    points = {5: STATION | CCS | {"operator": "Tesla, Inc."}, 6: STATION | TYPE2 | {"operator": "EnBW mobility+"}}
    read = read_osm_stations(draw_map(CORNERS, {10: (FIRST, STATION | {"operator": "EnBW"})}, points))
    assert sockets(read) == {"osm:w10": [("type2", 22_000.0, 1)], "osm:n5": [("ccs2", 150_000.0, 1)]}


def test_what_is_not_in_use_is_no_part(draw_map: Any) -> None:
    points = {5: POINT | TYPE2, 6: POINT | TYPE2 | {"disused": "yes"}}
    read = read_osm_stations(draw_map(CORNERS, {10: (FIRST, STATION)}, points))
    assert sockets(read) == {"osm:w10": [("type2", 22_000.0, 1)]}
    assert (read.parts, read.left_out) == (1, {"disused or not built yet": 1})


def test_members_in_a_circle_are_read(draw_map: Any) -> None:
    circle = [((("r", 2, ""), ("n", 5, "")), SITE), ((("r", 1, ""), ("n", 6, "")), SITE)]
    read = read_osm_stations(draw_map(CORNERS, {}, {5: POINT | TYPE2, 6: POINT | TYPE2}, circle))
    assert [found for station in sockets(read).values() for found in station] == [("type2", 22_000.0, 2)]


def test_geojson_of_a_map_has_the_stations_of_the_map(draw_map: Any, tmp_path: Path) -> None:
    ways = {10: (FIRST, STATION | {"brand": "Aral pulse"}), 11: (SECOND, STATION | TYPE2)}
    points = {5: POINT | CCS, 6: POINT | CCS, 7: STATION | {"name": "bare"}, 8: STATION | {"bicycle": "yes"}}
    path = draw_map(CORNERS, ways, points)
    features: list[dict[str, Any]] = []
    elements: list[dict[str, Any]] = []
    drawn: Any
    for drawn in osmium.FileProcessor(str(path)).with_locations():
        tags = dict(drawn.tags)
        if not tags:
            continue
        kind = "node" if drawn.is_node() else "way"
        places = [node.location for node in drawn.nodes] if drawn.is_way() else [drawn.location]
        corners = [[place.lon, place.lat] for place in places]
        geometry = (
            {"type": "Point", "coordinates": corners[0]}
            if len(corners) == 1
            else {"type": "Polygon", "coordinates": [corners]}
        )
        features.append({"type": "Feature", "geometry": geometry, "properties": tags | {"@id": f"{kind}/{drawn.id}"}})
        where: dict[str, Any] = {"lat": corners[0][1], "lon": corners[0][0]}
        if len(corners) > 1:
            where = {"geometry": [{"lat": lat, "lon": lon} for lon, lat in corners]}
        elements.append({"type": kind, "id": drawn.id, "tags": tags} | where)
    of_map = read_osm_stations(path)
    assert len(of_map.stations) == 3
    for name, content in (("features", features), ("elements", elements)):
        (tmp_path / "stations.json").write_text(json.dumps({name: content}), encoding="utf-8")
        read = read_stations(tmp_path / "stations.json")
        assert read.stations == of_map.stations
        assert (read.parts, read.left_out) == (of_map.parts, of_map.left_out) == (2, {"not for cars": 1})
        assert (read.source.key, read.source.name, read.source.licence) == (
            of_map.source.key,
            of_map.source.name,
            of_map.source.licence,
        )
    assert of_map.stations[1].network == "Aral pulse"
    assert Socket(Connector.CCS2, 150_000.0, 2) in of_map.stations[1].sockets
