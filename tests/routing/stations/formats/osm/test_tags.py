"""What tags of charging stations mean."""

from __future__ import annotations

import pytest

from energy.charging.charging import Connector
from routing.places import Point
from routing.stations.formats.osm.tags import (
    SOCKET_KINDS,
    LeftOut,
    access_of,
    capacity_of,
    charge_of,
    fee_of,
    operational_of,
    reason_to_leave_out,
    sockets_of,
)
from routing.stations.station import Access, Price, Socket

pytestmark = pytest.mark.nojit

MUNICH, OHIO, TOKYO, SANTIAGO = Point(48.1, 11.6), Point(40.0, -83.0), Point(35.7, 139.7), Point(-33.4, -70.7)
STATION = {"amenity": "charging_station"}


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        ({"socket:type2": "2", "socket:type2:output": "22 kW"}, [Socket(Connector.TYPE2, 22_000.0, 2, 3)]),
        ({"socket:type2_cable": "1", "socket:type2_cable:output": "7.4 kW"}, [Socket(Connector.TYPE2, 7_400.0, 1)]),
        ({"socket:type2": "yes"}, [Socket(Connector.TYPE2, None, 1)]),
        ({"socket:type2": "no", "socket:chademo": "0"}, []),
        (
            {"socket:type2_combo": "2", "socket:type2_combo:output": "50;150"},
            [Socket(Connector.CCS2, 150_000.0, 1), Socket(Connector.CCS2, 50_000.0, 1)],
        ),
        ({"socket:type2_combo": "1", "socket:type2_combo:output": "50;150"}, [Socket(Connector.CCS2, 150_000.0, 1)]),
        (
            {"socket:type2_combo": "3", "socket:type2_combo:output": "50;150"},
            [Socket(Connector.CCS2, 150_000.0, 1), Socket(Connector.CCS2, 50_000.0, 2)],
        ),
        (
            {"socket:type2": "1", "socket:type2:voltage": "400", "socket:type2:current": "32"},
            [Socket(Connector.TYPE2, 22_200.0, 1, 3)],
        ),
        (
            {"socket:chademo": "1", "socket:chademo:voltage": "500", "socket:chademo:current": "125"},
            [Socket(Connector.CHADEMO, 62_500.0, 1)],
        ),
        ({"socket:type1": "1", "socket:type1:voltage": "230 V"}, [Socket(Connector.TYPE1, None, 1, 1)]),
        ({"socket:cee_red_32a": "1"}, [Socket(Connector.CEE, 22_200.0, 1, 3)]),
        ({"socket:cee_blue": "2"}, [Socket(Connector.CEE, 3_700.0, 2, 1)]),
        ({"socket:schuko": "2"}, [Socket(Connector.DOMESTIC, None, 2, 1)]),
        (
            {"socket:type2": "1", "socket:type2_combo": "1", "charging_station:output": "150 kW"},
            [Socket(Connector.TYPE2, 43_000.0, 1, 3), Socket(Connector.CCS2, 150_000.0, 1)],
        ),
        ({"voltage": "400", "amperage": "32", "capacity": "2"}, [Socket(Connector.TYPE2, 22_200.0, 2, 3)]),
        (
            {"socket:type2": "2", "voltage": "400", "amperage": "32"},
            [Socket(Connector.TYPE2, 22_200.0, 2, 3)],
        ),
        (
            {"socket:type2": "1", "socket:type2_combo": "1", "voltage": "400", "amperage": "125"},
            [Socket(Connector.TYPE2, None, 1, 3), Socket(Connector.CCS2, None, 1)],
        ),
        ({"voltage": "230", "amperage": "16"}, []),
        ({"socket:bosch_3pin": "4", "socket:usb-A": "2"}, []),
        ({"socket:type2": "99999999"}, []),
    ],
)
def test_sockets_have_the_plug_count_and_output_of_their_tags(tags: dict[str, str], expected: list[Socket]) -> None:
    assert list(sockets_of(STATION | tags, MUNICH)) == expected


@pytest.mark.parametrize(
    ("kind", "at", "plug"),
    [
        ("tesla_supercharger", MUNICH, Connector.TESLA_EU),
        ("tesla_supercharger", OHIO, Connector.NACS),
        ("tesla_supercharger", TOKYO, Connector.NACS),
        ("tesla_supercharger", SANTIAGO, Connector.TESLA_EU),
        ("tesla_supercharger_ccs", MUNICH, Connector.CCS2),
        ("tesla_supercharger_ccs", OHIO, Connector.CCS1),
        ("tesla_destination", MUNICH, Connector.TYPE2),
        ("tesla_destination", OHIO, Connector.NACS),
        ("nacs", OHIO, Connector.NACS),
    ],
)
def test_teslas_plug_is_that_of_the_region(kind: str, at: Point, plug: Connector) -> None:
    assert [socket.connector for socket in sockets_of(STATION | {f"socket:{kind}": "8"}, at)] == [plug]


def test_every_kind_of_socket_is_read() -> None:
    for kind, meant in SOCKET_KINDS.items():
        (found,) = sockets_of(STATION | {f"socket:{kind}": "1"}, MUNICH)
        assert found.connector is meant.connector, kind
    assert {kind.connector for kind in SOCKET_KINDS.values()} == set(Connector) - {Connector.TESLA_EU}


@pytest.mark.parametrize(
    ("tags", "reason"),
    [
        (STATION, None),
        ({"man_made": "charge_point"}, None),
        (STATION | {"motorcar": "no"}, LeftOut.NOT_FOR_CARS),
        (STATION | {"bicycle": "yes"}, LeftOut.NOT_FOR_CARS),
        (STATION | {"bicycle": "yes", "motorcar": "yes"}, None),
        (STATION | {"bicycle": "yes", "car": "no"}, LeftOut.NOT_FOR_CARS),
        (STATION | {"bicycle": "yes", "socket:type2": "1"}, None),
        (STATION | {"bicycle": "yes", "socket:schuko": "4"}, LeftOut.NOT_FOR_CARS),
        (STATION | {"socket:bosch_3pin": "4"}, LeftOut.NOT_FOR_CARS),
        (STATION | {"bus": "designated"}, LeftOut.NOT_FOR_CARS),
        (STATION | {"bicycle": "no"}, None),
        (STATION | {"disused": "yes"}, LeftOut.NOT_IN_USE),
        (STATION | {"construction": "yes"}, LeftOut.NOT_IN_USE),
        ({"disused:amenity": "charging_station"}, LeftOut.NOT_IN_USE),
        ({"construction:amenity": "charging_station"}, LeftOut.NOT_IN_USE),
    ],
)
def test_what_no_car_can_charge_at_is_left_out(tags: dict[str, str], reason: LeftOut | None) -> None:
    found = reason_to_leave_out(tags)
    assert (None if found is None else found[0]) is reason
    assert found is None or found[1] in tags


@pytest.mark.parametrize(
    ("tags", "access"),
    [
        ({}, Access.UNKNOWN),
        ({"access": "yes"}, Access.PUBLIC),
        ({"access": "customers"}, Access.CUSTOMERS),
        ({"access": "permit"}, Access.RESTRICTED),
        ({"access": "private"}, Access.PRIVATE),
        ({"access": "yes", "motorcar": "private"}, Access.PRIVATE),
        ({"access": "customers", "motorcar": "yes"}, Access.CUSTOMERS),
        ({"access": "who knows"}, Access.UNKNOWN),
    ],
)
def test_access_says_who_may_charge(tags: dict[str, str], access: Access) -> None:
    assert access_of(STATION | tags) is access


def test_fee_capacity_and_status_are_read_and_unknown_where_nothing_is_said() -> None:
    assert [fee_of({"fee": value}) for value in ("yes", "no", "Mo-Fr", "unknown")] == [True, False, True, None]
    assert fee_of({}) is None
    assert fee_of({"charge": "0.49 EUR/kWh"}) is True
    assert charge_of({"charge": "0.49 EUR/kWh"}) == Price("0.49 EUR/kWh", "EUR", 0.49)
    assert charge_of({"charge": "$2 per hour", "addr:country": "CA"}) == Price("$2 per hour", "CAD", None, 0.03333333)
    assert charge_of({}) is None
    assert fee_of({"fee": "no", "fee:conditional": "yes @ (stay > 4 hours)"}) is True
    assert [capacity_of({"capacity": value}) for value in ("4", "0", "many")] == [4, None, None]
    assert capacity_of({"capacity": "10", "capacity:motorcar": "2"}) == 2
    assert operational_of({"operational_status": "broken"}) is False
    assert operational_of({"operational_status": "operational"}) is True
    assert operational_of({"opening_hours": "closed"}) is False
    assert operational_of({}) is None
