from __future__ import annotations

from typing import Any

import pytest

from energy.charging.charging import Connector
from routing.stations.station import Access, Price, Socket
from tests.routing.stations.formats.conftest import Reading

STATION = {
    "Fuel Type Code": "ELEC", "Station Name": "Mill", "Status Code": "E", "Groups With Access Code": "Public",
    "Access Days Time": "24 hours daily", "EV Level1 EVSE Num": "", "EV Level2 EVSE Num": "2", "EV DC Fast Count": "",
    "EV Network": "Non-Networked", "Latitude": "41.5", "Longitude": "-74.07", "ID": "44174",
    "Updated At": "2025-02-12 00:16:32 UTC", "EV Connector Types": "J1772", "Country": "US", "Access Code": "public",
    "EV Pricing": "Free", "Restricted Access": "false",
}  # fmt: skip
UNITS = ("EV J1772", "EV CCS", "EV CHAdeMO", "EV J3400", "EV J3271")


def table(*changes: dict[str, str], columns: tuple[str, ...] = ()) -> str:
    names = (*STATION, *columns)
    rows = [",".join(f'"{(STATION | change).get(name, "")}"' for name in names) for change in changes]
    return "\n".join([",".join(names), *rows]) + "\n"


def test_a_station_is_read(read_text: Reading) -> None:
    read = read_text(table({}))
    (station,) = read.stations
    assert station.id == "afdc:44174"
    assert station.sockets == (Socket(Connector.TYPE1, 6_240.0, 2, 1),)
    assert (station.capacity, station.network, station.access) == (2, "", Access.PUBLIC)
    assert (station.opening_hours, station.operational, station.fee) == ("24/7", True, False)
    assert read.source.retrieved == "2025-02-12"
    assert any("level alone" in note for note in read.notes)


def test_fast_chargers_have_no_power_where_only_their_number_is_said(read_text: Reading) -> None:
    change = {"EV DC Fast Count": "4", "EV Connector Types": "CHADEMO J1772 J1772COMBO"}
    assert read_text(table(change)).stations[0].sockets == (
        Socket(Connector.TYPE1, 6_240.0, 2, 1),
        Socket(Connector.CHADEMO, None),  # how many of the four is not said
        Socket(Connector.CCS1, None),
    )


@pytest.mark.parametrize(
    ("change", "sockets"),
    [
        (
            {"EV Network": "Tesla", "EV Level2 EVSE Num": "", "EV DC Fast Count": "8", "EV Connector Types": "TESLA"},
            (Socket(Connector.NACS, None, 8),),
        ),
        (
            {"EV Network": "Tesla Destination", "EV Level2 EVSE Num": "3", "EV Connector Types": "J1772 TESLA"},
            (Socket(Connector.TYPE1, 6_240.0, 1, 1), Socket(Connector.NACS, 6_240.0, 1, 1)),
        ),
        (
            {"EV Level1 EVSE Num": "1", "EV Level2 EVSE Num": "", "EV Connector Types": "J1772 NEMA520"},
            (Socket(Connector.DOMESTIC, 1_440.0, 1, 1),),
        ),
    ],
)
def test_plugs_are_those_of_their_level(
    read_text: Reading, change: dict[str, str], sockets: tuple[Socket, ...]
) -> None:
    assert read_text(table(change)).stations[0].sockets == sockets


def test_charging_units_with_powers_are_joined_to_their_station(read_text: Reading) -> None:
    columns = tuple(f"{name} {kind}" for name in UNITS for kind in ("Connector Count", "Power Output (kW)"))
    fast = {"EV CCS Connector Count": "1", "EV CCS Power Output (kW)": "200", "EV J3400 Connector Count": "1",
            "EV J3400 Power Output (kW)": "325.5"}  # fmt: skip
    slow = {"EV J1772 Connector Count": "2", "EV J1772 Power Output (kW)": "6.5"}
    (station,) = read_text(table(fast, fast, slow, columns=columns)).stations
    assert station.sockets == (
        Socket(Connector.CCS1, 200_000.0, 2),
        Socket(Connector.NACS, 325_500.0, 2),
        Socket(Connector.TYPE1, 6_500.0, 2, 1),
    )


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"Fuel Type Code": "CNG"}, "not electric"),
        ({"Status Code": "P"}, "planned"),
        ({"ID": ""}, "no id"),
        ({"Latitude": "-74.07", "Longitude": "41.5"}, "latitude and longitude swapped"),
        ({"Latitude": ""}, "no place"),
        ({"EV Connector Types": ""}, "no plug given"),
        ({"EV Connector Types": "WAVE"}, "no plug that is known"),
    ],
)
def test_a_row_that_is_no_station_is_left_out_by_its_reason(
    read_text: Reading, change: dict[str, str], reason: str
) -> None:
    read = read_text(table({}, {"ID": "2"} | change))
    assert len(read.stations) == 1
    assert read.left_out == {reason: 1}


@pytest.mark.parametrize(
    ("change", "access"),
    [
        ({"Access Code": "private"}, Access.PRIVATE),
        ({"Restricted Access": "true"}, Access.RESTRICTED),
        ({"Access Days Time": "24 hours daily; guest use only"}, Access.CUSTOMERS),
        ({"Access Code": "", "Groups With Access Code": ""}, Access.UNKNOWN),
    ],
)
def test_access_is_that_of_codes_and_words(read_text: Reading, change: dict[str, str], access: Access) -> None:
    assert read_text(table(change)).stations[0].access is access


def test_a_station_that_is_shut_for_a_time_is_not_operational(read_text: Reading) -> None:
    assert read_text(table({"Status Code": "T"})).stations[0].operational is False


def test_prices_of_canada_are_in_its_dollars(read_text: Reading) -> None:
    (station,) = read_text(table({"Country": "CA", "EV Pricing": "$1.50 per hour"})).stations
    assert station.price == Price("$1.50 per hour", "CAD", per_min=0.025)


def test_the_interface_in_json_says_the_same_and_powers_of_units(read_text: Reading) -> None:
    station: dict[str, Any] = {
        "fuel_type_code": "ELEC", "station_name": "Mill", "id": 44174, "latitude": 41.5, "longitude": -74.07,
        "status_code": "E", "access_code": "public", "access_days_time": "24 hours daily", "ev_level2_evse_num": 2,
        "ev_dc_fast_num": None, "ev_level1_evse_num": None, "ev_network": "Non-Networked", "country": "US",
        "ev_connector_types": ["J1772"], "ev_pricing": "Free", "updated_at": "2025-02-12T00:16:32Z",
        "groups_with_access_code": "Public", "restricted_access": False,
    }  # fmt: skip
    answer = {"station_locator_url": "x", "total_results": 1, "fuel_stations": [station]}
    assert read_text(answer).stations == read_text(table({})).stations
    unit = {"port_count": 1, "connectors": {"J1772COMBO": {"power_kw": 150, "port_count": 2}}}
    station["ev_charging_units"] = [unit]
    assert read_text(answer).stations[0].sockets == (Socket(Connector.CCS1, 150_000.0, 2),)
    feature = {"type": "Feature", "geometry": {"type": "Point", "coordinates": [-74.07, 41.5]}, "properties": station}
    assert read_text({"type": "FeatureCollection", "features": [feature]}).source.key == "afdc"
