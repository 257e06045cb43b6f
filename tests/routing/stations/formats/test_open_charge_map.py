from __future__ import annotations

from typing import Any

import pytest

from energy.charging.charging import Connector
from routing.stations.notes import StationFileError
from routing.stations.station import Access, Price, Socket
from tests.routing.stations.formats.conftest import Reading


def point(**changes: Any) -> dict[str, Any]:
    plug = {
        "ConnectionTypeID": 33,
        "StatusTypeID": 50,
        "LevelID": 3,
        "PowerKW": 350,
        "CurrentTypeID": 30,
        "Quantity": 4,
    }
    return {
        "ID": 7,
        "UUID": "AA",
        "DataProviderID": 1,
        "OperatorID": 3299,
        "UsageTypeID": 5,
        "UsageCost": "€0.79/kWh",
        "StatusTypeID": 50,
        "SubmissionStatusTypeID": 200,
        "NumberOfPoints": 4,
        "AddressInfo": {"Title": "Rest  area", "Latitude": 48.1, "Longitude": 11.5, "CountryID": 87},
        "Connections": [plug],
    } | changes


def plugs(read_text: Reading, *connections: dict[str, Any], country: int = 87) -> tuple[Socket, ...]:
    address = {"Latitude": 48.1, "Longitude": 11.5, "CountryID": country}
    return read_text([point(Connections=list(connections), AddressInfo=address)]).stations[0].sockets


def test_a_compact_point_is_read_by_the_published_codes(read_text: Reading) -> None:
    read = read_text([point()])
    (station,) = read.stations
    assert station.id == "ocm:7"
    assert (station.at.lat_deg, station.at.lon_deg) == (48.1, 11.5)
    assert station.sockets == (Socket(Connector.CCS2, 350_000.0, 4),)
    assert (station.name, station.operator, station.capacity) == ("Rest area", "Ionity", 4)
    assert (station.access, station.fee, station.operational) == (Access.PUBLIC, True, True)
    assert station.price == Price("€0.79/kWh", "EUR", 0.79)
    assert read.source.key == station.source == "ocm"
    assert "CC BY-SA 4.0" in read.source.licence


def test_a_verbose_point_says_the_same_as_a_compact_one(read_text: Reading) -> None:
    verbose = point(
        OperatorInfo={"ID": 3299, "Title": "Ionity"},
        UsageType={"ID": 5, "Title": "Public - Pay At Location", "IsPayAtLocation": True},
        StatusType={"ID": 50, "IsOperational": True},
        DataProvider={"ID": 1, "Title": "Open Charge Map Contributors", "License": "CC BY-SA 4.0"},
        Connections=[
            {"ConnectionType": {"ID": 33, "Title": "CCS (Type 2)"}, "Level": {"ID": 3}, "PowerKW": 350.0, "Quantity": 4}
        ],
    )
    for name in ("OperatorID", "UsageTypeID", "StatusTypeID", "DataProviderID"):
        del verbose[name]
    assert read_text([verbose]).stations == read_text([point()]).stations


def test_a_point_in_camel_case_says_the_same(read_text: Reading) -> None:
    def small(value: Any) -> Any:
        if isinstance(value, list):
            return [small(item) for item in value]
        if not isinstance(value, dict):
            return value
        return {name.lower() if name in ("ID", "UUID") else name[0].lower() + name[1:]: small(item)
                for name, item in value.items()}  # fmt: skip

    assert read_text([small(point())]).stations == read_text([point()]).stations


def test_a_level_that_no_fast_charger_has_says_nothing(read_text: Reading) -> None:
    (socket,) = plugs(read_text, {"ConnectionTypeID": 33, "LevelID": 2})
    assert socket.output_w is None


@pytest.mark.parametrize(
    ("plug", "expected_w"),
    [
        ({"Amps": 32, "Voltage": 400, "CurrentTypeID": 20}, 32 * 400 * 3**0.5),  # volts between phases
        ({"Amps": 32, "Voltage": 230, "CurrentTypeID": 20}, 32 * 230 * 3),  # volts of a phase
        ({"Amps": 16, "Voltage": 230, "CurrentTypeID": 10}, 16 * 230),
        ({"Amps": 32, "Voltage": 230, "PowerKW": 11}, 11_000.0),
        ({"PowerKW": 22_000_000, "LevelID": 2}, 3_700.0),
        ({"LevelID": 1}, 1_800.0),
        ({}, None),
    ],
)
def test_power_that_is_missing_is_derived(read_text: Reading, plug: dict[str, Any], expected_w: float | None) -> None:
    (socket,) = plugs(read_text, {"ConnectionTypeID": 25, **plug})
    assert socket.output_w == pytest.approx(expected_w)


def test_derived_powers_are_noted(read_text: Reading) -> None:
    given = [{"ConnectionTypeID": 25, "Amps": 32, "Voltage": 400}, {"ConnectionTypeID": 33, "LevelID": 3}]
    notes = read_text([point(Connections=given)]).notes
    assert any("amperes and volts: 1" in note for note in notes)
    assert any("level alone" in note for note in notes)


def test_a_tesla_plug_is_nacs_in_america_and_type_2_elsewhere(read_text: Reading) -> None:
    tesla = {"ConnectionTypeID": 27, "PowerKW": 150}
    assert plugs(read_text, tesla, country=2)[0].connector is Connector.NACS
    assert plugs(read_text, tesla, country=87)[0].connector is Connector.TESLA_EU


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"StatusTypeID": 150}, "planned"),
        ({"StatusTypeID": 200}, "removed"),
        ({"SubmissionStatusTypeID": 1001}, "not listed"),
        ({"ID": None}, "no id"),
        ({"Connections": [{"ConnectionTypeID": 24}]}, "no plug that is known"),
        ({"Connections": None}, "no plug given"),
        ({"Connections": "x"}, "plugs that are no list"),
        ({"AddressInfo": {"Latitude": 0.0, "Longitude": 0.0}}, "place 0, 0"),
        ({"AddressInfo": {"Latitude": 116.4, "Longitude": 39.9}}, "latitude and longitude swapped"),
        ({"AddressInfo": {"Latitude": 95, "Longitude": 139.9}}, "place out of range"),
        ({"AddressInfo": {"Latitude": None, "Longitude": 1}}, "no place"),
        ({"AddressInfo": {"Latitude": [1], "Longitude": 1}}, "place that is no number"),
    ],
)
def test_a_point_that_is_no_station_is_left_out_by_its_reason(
    read_text: Reading, change: dict[str, Any], reason: str
) -> None:
    read = read_text([point(), point(ID=8) | change])
    assert len(read.stations) == 1
    assert read.left_out == {reason: 1}
    assert read.examples[reason][0].startswith("entry 2: ")


def test_plugs_out_of_order_are_not_counted_among_those_that_work(read_text: Reading) -> None:
    working, broken = {"ConnectionTypeID": 33, "PowerKW": 50}, {"ConnectionTypeID": 2, "StatusTypeID": 100}
    read = read_text([point(Connections=[working, broken])])
    assert [socket.connector for socket in read.stations[0].sockets] == [Connector.CCS2]
    assert any("out of order" in note for note in read.notes)


def test_an_unknown_plug_is_counted_by_its_name(read_text: Reading) -> None:
    read = read_text(
        [point(Connections=[{"ConnectionTypeID": 33}, {"ConnectionTypeID": 24}, {"ConnectionTypeID": 99}])]
    )
    assert read.unknown_plugs == {"Wireless Charging": 1, "ConnectionTypeID 99": 1}


def test_licences_of_all_providers_are_named(read_text: Reading) -> None:
    licence = read_text([point(), point(ID=8, DataProviderID=29), point(ID=9, DataProviderID=22)]).source.licence
    assert "CC BY 4.0 (Bundesnetzagentur.de)" in licence
    assert "not open or not known (CHAdeMO.com)" in licence


def test_a_file_of_points_that_are_all_swapped_is_refused_with_a_question(read_text: Reading) -> None:
    swapped = [point(ID=k, AddressInfo={"Latitude": 116.4, "Longitude": 39.9}) for k in range(3)]
    with pytest.raises(StationFileError, match=r"swapped 3 of 3.*did you mean lat 39.9, lon 116.4\?"):
        read_text(swapped)


def test_a_point_that_is_there_twice_counts_once(read_text: Reading) -> None:
    assert read_text([point(), point()]).left_out == {"id that is there already": 1}


@pytest.mark.parametrize(
    ("status", "expected"),
    [
        ({"StatusTypeID": 30}, False),
        ({"StatusTypeID": 100}, False),
        ({"StatusTypeID": 0}, None),
        ({"StatusTypeID": 999, "StatusType": {"ID": 999, "IsOperational": False}}, False),
        ({"StatusTypeID": None}, None),
    ],
)
def test_whether_a_station_works_is_that_of_its_status(
    read_text: Reading, status: dict[str, Any], expected: bool | None
) -> None:
    assert read_text([point() | status]).stations[0].operational is expected


def test_operators_that_are_none_have_no_name(read_text: Reading) -> None:
    assert read_text([point(OperatorID=1)]).stations[0].operator == ""
    named = point(OperatorID=99999, OperatorInfo={"ID": 99999, "Title": "New one"})
    assert read_text([named]).stations[0].operator == "New one"


def test_a_provider_that_is_not_known_yet_has_the_licence_of_its_own_words(read_text: Reading) -> None:
    provider = {"ID": 77, "Title": "Town", "License": "CC0"}
    assert read_text([point(DataProviderID=77, DataProvider=provider)]).source.licence == "CC0 (Town)"


def test_dollars_are_those_of_the_country_that_a_point_names(read_text: Reading) -> None:
    address = {"Latitude": 48.1, "Longitude": 11.5, "Country": {"ISOCode": "US"}}
    read = read_text([point(UsageCost="$0.50/kWh", AddressInfo=address)])
    assert read.stations[0].price == Price("$0.50/kWh", "USD", 0.5)


def test_a_count_out_of_range_is_noted(read_text: Reading) -> None:
    read = read_text([point(Connections=[{"ConnectionTypeID": 33, "Quantity": -4}])])
    assert read.stations[0].sockets[0].count == 1
    assert any("out of range, taken as 1" in note for note in read.notes)
