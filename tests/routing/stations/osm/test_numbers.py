"""Numbers as mappers write them."""

from __future__ import annotations

import pytest

from routing.stations.osm.numbers import count_of, outputs_w, price_of
from routing.stations.station import Price

pytestmark = pytest.mark.nojit


@pytest.mark.parametrize(
    ("text", "kilowatts"),
    [
        ("22 kW", [22]),
        ("22kW", [22]),
        ("22 KW", [22]),
        ("22 kVA", [22]),
        ("22", [22]),
        ("7,4 kW", [7.4]),
        ("3.7", [3.7]),
        ("22000", [22]),
        ("22000 W", [22]),
        ("350000", [350]),
        ("1 MW", [1000]),
        ("50;22", [50, 22]),
        ("50 kW; 22 kW", [50, 22]),
        ("50 kW/22 kW", [50, 22]),
        ("2x11 kW", [11, 11]),
        ("2 x 22 kW", [22, 22]),
        ("up to 150 kW", [150]),
        ("max. 22kW", [22]),
        ("", []),
        ("yes", []),
        ("0", []),
        ("99999 kW", []),
        ("-", []),
    ],
)
def test_outputs_are_read_in_any_form(text: str, kilowatts: list[float]) -> None:
    assert outputs_w(text) == pytest.approx([1000.0 * kw for kw in kilowatts])


@pytest.mark.parametrize(
    ("text", "count"),
    [("2", 2), ("yes", 1), ("no", 0), ("0", 0), ("1;2", 3), ("", None), ("some", None), ("4 posts", 4)],
)
def test_counts_are_numbers_or_yes_and_no(text: str, count: int | None) -> None:
    assert count_of(text) == count


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.49 EUR/kWh", Price("0.49 EUR/kWh", "EUR", 0.49)),
        ("0,39 €/kWh", Price("0,39 €/kWh", "EUR", 0.39)),
        ("€0.39 per kWh", Price("€0.39 per kWh", "EUR", 0.39)),
        ("$0.25/kWh; $1/session", Price("$0.25/kWh; $1/session", "USD", 0.25, None, 1.0)),
        ("0.49 EUR/kWh;0.10 EUR/min", Price("0.49 EUR/kWh;0.10 EUR/min", "EUR", 0.49, 0.10)),
        ("6 GBP/hour", Price("6 GBP/hour", "GBP", None, 0.1)),
        ("0.49 EUR/kWh AC; 0.69 EUR/kWh DC", Price("0.49 EUR/kWh AC; 0.69 EUR/kWh DC", "EUR", 0.69)),
        ("0.49 EUR/kWh; 5 CHF/h", Price("0.49 EUR/kWh; 5 CHF/h")),
        ("0.49/kWh", Price("0.49/kWh")),
        ("ask at the desk", Price("ask at the desk")),
    ],
)
def test_prices_are_understood_where_they_name_one_currency(text: str, expected: Price) -> None:
    assert price_of(text) == expected
