from __future__ import annotations

from typing import Any

import pytest

from energy.charging.charging import Connector
from routing.stations.station import Access, Price, Socket
from tests.routing.stations.formats.conftest import Reading

CCS = {
    "id": "1", "standard": "IEC_62196_T2_COMBO", "format": "CABLE", "power_type": "DC", "max_voltage": 920,
    "max_amperage": 500, "max_electric_power": 350_000, "tariff_ids": ["12", "13"],
}  # fmt: skip
AC = {"id": "1", "standard": "IEC_62196_T2", "format": "SOCKET", "power_type": "AC_3_PHASE"}


def location(**changes: Any) -> dict[str, Any]:
    return {
        "country_code": "DE",
        "party_id": "ABC",
        "id": "LOC1",
        "publish": True,
        "name": "Rest area",
        "address": "A 9",
        "coordinates": {"latitude": "48.100", "longitude": "11.500"},
        "operator": {"name": "Ionity"},
        "evses": [
            {"uid": "1", "status": "AVAILABLE", "connectors": [CCS]},
            {"uid": "2", "status": "CHARGING", "connectors": [CCS]},
        ],
        "opening_times": {"twentyfourseven": True},
        "last_updated": "2026-01-01T00:00:00Z",
    } | changes


@pytest.mark.parametrize(
    "wrapped",
    [
        lambda place: [place],
        lambda place: place,
        lambda place: {"data": [place], "status_code": 1000, "timestamp": "2026-01-01T00:00:00Z"},
        lambda place: {"status_code": 1000, "data": place, "timestamp": "2026-01-01T00:00:00Z"},
        lambda place: {"locations": [place]},
    ],
)
def test_a_location_is_read_alone_in_a_list_and_in_an_answer(read_text: Reading, wrapped: Any) -> None:
    read = read_text(wrapped(location()))
    (station,) = read.stations
    assert station.source == read.source.key == "ocpi-de-abc"
    assert station.id == "ocpi:DE*ABC*LOC1"
    assert (station.at.lat_deg, station.at.lon_deg) == (48.1, 11.5)
    assert station.sockets == (Socket(Connector.CCS2, 350_000.0, 2),)
    assert (station.capacity, station.operational, station.access) == (2, True, Access.PUBLIC)
    assert (station.name, station.operator, station.opening_hours) == ("Rest area", "Ionity", "24/7")
    assert station.price == Price("tariff 12, 13")


def test_a_location_of_2_1_1_is_read(read_text: Reading) -> None:
    place = location(evses=[{"uid": "1", "status": "UNKNOWN", "connectors": [AC | {"voltage": 230, "amperage": 32}]}])
    for name in ("country_code", "party_id", "publish"):
        del place[name]
    (station,) = read_text([place | {"type": "ON_STREET"}]).stations
    assert station.id == "ocpi:LOC1"
    assert station.sockets == (Socket(Connector.TYPE2, 3 * 230 * 32, 1, 3),)
    assert (station.operational, station.access) == (None, Access.UNKNOWN)


@pytest.mark.parametrize(
    ("plug", "expected_w"),
    [
        ({"max_voltage": 230, "max_amperage": 16}, 3 * 230 * 16),
        ({"max_voltage": 400, "max_amperage": 16}, 3**0.5 * 400 * 16),
        ({"max_voltage": 230, "max_amperage": 32, "power_type": "AC_1_PHASE"}, 230 * 32),
        ({"max_voltage": 120, "max_amperage": 32, "power_type": "AC_2_PHASE_SPLIT"}, 240 * 32),
        ({"max_voltage": 230, "max_amperage": 32, "max_electric_power": 11_000}, 11_000),
        ({"max_voltage": 230, "max_amperage": 32, "max_electric_power": 22}, 3 * 230 * 32),  # kilowatts are not meant
        ({}, None),
    ],
)
def test_power_is_that_given_or_of_volts_and_amperes(
    read_text: Reading, plug: dict[str, Any], expected_w: float | None
) -> None:
    place = location(evses=[{"uid": "1", "connectors": [AC | plug]}])
    assert read_text([place]).stations[0].sockets[0].output_w == pytest.approx(expected_w)


def test_regular_hours_become_rules_of_openstreetmap(read_text: Reading) -> None:
    hours = [
        {"weekday": day, "period_begin": "08:00", "period_end": "20:00" if day < 6 else "18:00"} for day in range(1, 7)
    ]
    hours.append({"weekday": 7, "period_begin": "22:00", "period_end": "02:00"})
    read = read_text([location(opening_times={"twentyfourseven": False, "regular_hours": hours})])
    assert read.stations[0].opening_hours == "Mo-Fr 08:00-20:00; Sa 08:00-18:00; Su 22:00-02:00"


def test_hours_that_are_no_times_are_noted_and_not_kept(read_text: Reading) -> None:
    hours = [{"weekday": 1, "period_begin": "8", "period_end": "25:00"}]
    read = read_text([location(opening_times={"regular_hours": hours})])
    assert read.stations[0].opening_hours is None
    assert any("opening hours" in note for note in read.notes)


def test_points_out_of_order_are_left_beside_those_that_work(read_text: Reading) -> None:
    broken = {"uid": "3", "status": "OUTOFORDER", "connectors": [CCS | {"standard": "CHADEMO"}]}
    works = {"uid": "1", "status": "AVAILABLE", "connectors": [CCS]}
    (station,) = read_text([location(evses=[works, broken])]).stations
    assert ([socket.connector for socket in station.sockets], station.capacity) == ([Connector.CCS2], 1)
    (station,) = read_text([location(evses=[broken])]).stations
    assert ([socket.connector for socket in station.sockets], station.operational) == ([Connector.CHADEMO], False)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"publish": False}, "not to be published"),
        ({"evses": [{"status": "PLANNED", "connectors": [CCS]}]}, "planned"),
        ({"evses": [{"status": "REMOVED", "connectors": [CCS]}]}, "removed"),
        ({"evses": []}, "no plug given"),
        ({"evses": [{"connectors": [CCS | {"standard": "PANTOGRAPH_TOP_DOWN"}]}]}, "no plug that is known"),
        ({"coordinates": {"latitude": "48,100.5", "longitude": "11"}}, "place that is no number"),
        ({"coordinates": {"latitude": "0.0", "longitude": "0.0"}}, "place 0, 0"),
        ({"coordinates": {}}, "no place"),
        ({"id": None}, "no id"),
        ({"id": {"a": 1}}, "no id"),
    ],
)
def test_a_location_that_is_no_station_is_left_out_by_its_reason(
    read_text: Reading, change: dict[str, Any], reason: str
) -> None:
    read = read_text([location(), location(id="LOC2") | change])
    assert len(read.stations) == 1
    assert read.left_out == {reason: 1}


def test_access_is_that_of_all_points(read_text: Reading) -> None:
    points = [{"uid": str(k), "parking_restrictions": ["CUSTOMERS"], "connectors": [CCS]} for k in range(2)]
    assert read_text([location(evses=points)]).stations[0].access is Access.CUSTOMERS
    del points[0]["parking_restrictions"]
    assert read_text([location(evses=points)]).stations[0].access is Access.PUBLIC


def test_locations_of_several_parties_are_one_source(read_text: Reading) -> None:
    read = read_text([location(), location(id="LOC2", party_id="XYZ")])
    assert {station.source for station in read.stations} == {read.source.key} == {"ocpi"}
    assert "DE*ABC, DE*XYZ" in read.source.name


@pytest.mark.parametrize(
    ("lon", "power_type", "connector"),
    [("-74.0", "DC", Connector.NACS), ("11.5", "DC", Connector.TESLA_EU), ("11.5", "AC_3_PHASE", Connector.TYPE2)],
)
def test_the_plug_of_tesla_is_that_of_its_region(
    read_text: Reading, lon: str, power_type: str, connector: Connector
) -> None:
    plug = CCS | {"standard": "TESLA_S", "power_type": power_type}
    place = location(coordinates={"latitude": "41.0", "longitude": lon}, evses=[{"uid": "1", "connectors": [plug]}])
    assert read_text([place]).stations[0].sockets[0].connector is connector


def test_hours_of_an_answer_of_2_1_1_may_be_one_object_and_exceptions_are_noted(read_text: Reading) -> None:
    hours = {"weekday": 1, "period_begin": "08:00", "period_end": "20:00"}
    times = {"regular_hours": hours, "twentyfourseven": False, "exceptional_closings": [{"period_begin": "x"}]}
    read = read_text([location(opening_times=times)])
    assert read.stations[0].opening_hours == "Mo 08:00-20:00"
    assert any("days of exception" in note for note in read.notes)
    wrong = hours | {"weekday": 8}
    assert read_text([location(opening_times={"regular_hours": [wrong]})]).stations[0].opening_hours is None
