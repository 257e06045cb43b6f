"""What is told of one station several times becomes one, and no socket is counted twice."""

from __future__ import annotations

import random

import pytest

from energy.charging.charging import Connector
from routing.places import Point
from routing.stations.duplicates import ALIKE_M, UNSAID_M, united
from routing.stations.station import Access, Price, Socket
from tests.routing.stations.drawn import CCS, TYPE2, place, station

pytestmark = pytest.mark.nojit


def test_posts_of_one_source_and_operator_add_up() -> None:
    (found,), count = united(
        [station("a", 0, 0, operator="EnBW", capacity=2), station("b", 25, 0, operator="EnBW mobility+", capacity=2)]
    )
    assert count == 1
    assert found.id == "drawn:a"
    assert found.merged == ("drawn:b",)
    assert found.sockets == (Socket(Connector.TYPE2, 22_000.0, 4, 3),)
    assert found.capacity == 4


def test_one_station_told_by_two_sources_has_each_socket_once() -> None:
    unsaid = Socket(Connector.TYPE2, None, 2)
    a = station("a", 0, 0, operator="Ionity GmbH", sockets=(unsaid, CCS), capacity=3, source="x")
    b = station(
        "b", 20, 10, operator="IONITY", sockets=(TYPE2,), capacity=4, source="y", opening_hours="24/7", fee=True
    )
    (found,), count = united([a, b])
    assert count == 1
    assert set(found.sockets) == {TYPE2, CCS}
    assert (found.capacity, found.opening_hours, found.fee) == (4, "24/7", True)


def test_posts_of_one_source_beside_another_source_are_counted_once() -> None:
    posts = [station(f"post {k}", 5 * k, 0, operator="Fastned", sockets=(CCS,), source="x") for k in range(4)]
    register = station("all", 8, 5, operator="Fastned", sockets=(Socket(Connector.CCS2, 150_000.0, 4),), source="y")
    (found,), count = united([register, *posts])
    assert count == 4
    assert found.sockets == (Socket(Connector.CCS2, 150_000.0, 4),)


@pytest.mark.parametrize(
    ("operator", "other", "apart_m", "one"),
    [
        ("Shell", "Aral Pulse", 5, False),
        ("Shell", "Shell Recharge", ALIKE_M - 1, True),
        ("Shell", "Shell Recharge", ALIKE_M + 1, False),
        ("Stadtwerke München", "Stadtwerke Freising", 5, False),
        ("Stadtwerke München", "STADTWERKE MUNCHEN", 5, True),
        ("", "", ALIKE_M - 1, True),
        ("", "", ALIKE_M + 1, False),
        ("Shell", "", UNSAID_M - 1, True),
        ("Shell", "", UNSAID_M + 1, False),
        ("Tesla, Inc.", "Tesla Supercharger", 30, True),
        ("AG", "SE", 30, True),  # legal forms are no names
    ],
)
def test_operators_that_are_alike_make_one_station(operator: str, other: str, apart_m: float, one: bool) -> None:
    pair = [station("a", 0, 0, operator=operator), station("b", apart_m, 0, operator=other)]
    found, count = united(pair)
    assert (len(found) == 1, count == 1) == (one, one)


def test_a_network_tells_a_station_as_an_operator_does() -> None:
    found, _ = united(
        [station("a", 0, 0, operator="Hotel Post", network="ladenetz.de"), station("b", 9, 0, network="Ladenetz.de")]
    )
    assert len(found) == 1


def test_stations_of_one_network_and_different_operators_are_apart() -> None:
    found, _ = united(
        [
            station("a", 0, 0, operator="Stadtwerke Ulm", network="ladenetz.de"),
            station("b", 9, 0, operator="Bäckerei Huber", network="ladenetz.de"),
        ]
    )
    assert len(found) == 2


def test_of_one_id_the_later_one_holds() -> None:
    (found,), count = united([station("a", 0, 0, name="old"), station("a", 5000, 0, name="new")])
    assert (found.name, count) == ("new", 0)


def test_a_row_of_posts_along_a_street_is_not_one_station() -> None:
    found, _ = united([station(f"{k:02}", 35 * k, 0, operator="Ubitricity") for k in range(20)])
    assert len(found) == 10


def test_what_is_united_depends_on_nothing_but_the_stations() -> None:
    rng = random.Random(1)
    operators = ["", "EnBW", "Ionity", "EnBW mobility+", "Shell"]
    stations = [
        station(
            str(k), rng.uniform(0, 600), rng.uniform(0, 600), operator=rng.choice(operators), source=rng.choice("xy")
        )
        for k in range(300)
    ]
    expected = united(stations)
    for _ in range(5):
        rng.shuffle(stations)
        assert united(stations) == expected


def test_stations_apart_of_one_operator_are_found_by_looking_at_all_pairs() -> None:
    rng = random.Random(2)
    stations = [station(str(k), rng.uniform(0, 900), rng.uniform(0, 900), operator="EnBW") for k in range(200)]
    found, count = united(stations)
    assert len(found) + count == 200
    for k, a in enumerate(found):
        for b in found[:k]:
            north_m = (a.at.lat_deg - b.at.lat_deg) * 111_195.0
            east_m = (a.at.lon_deg - b.at.lon_deg) * 82_634.0
            assert (north_m**2 + east_m**2) ** 0.5 > ALIKE_M - 0.5


def test_facts_come_from_whoever_says_them() -> None:
    a = station("a", 0, 0, source="x", operator="EnBW")
    b = station("b", 1, 0, source="y", operator="EnBW", access=Access.CUSTOMERS, price=Price("0.50"), operational=False)
    (found,), _ = united([a, b])
    assert (found.access, found.price, found.operational) == (Access.CUSTOMERS, Price("0.50"), False)


@pytest.mark.parametrize("lat", [0.0, 60.0, -89.999, 90.0])
def test_stations_anywhere_are_united(lat: float) -> None:
    found, _ = united([station("a", 0, 0, at=Point(lat, 179.99)), station("b", 0, 0, at=Point(lat, 179.99))])
    assert len(found) == 1


def test_many_stations_at_one_place_take_no_pairs() -> None:
    stations = [station(f"{k:06}", 0, 0, operator=f"operator{k}", at=place(0, 0)) for k in range(20_000)]
    stations += [station(f"x{k:06}", 0, 0, operator="same", at=place(0, 0)) for k in range(20_000)]
    found, count = united(stations)
    assert (len(found), count) == (20_001, 19_999)
