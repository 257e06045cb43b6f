"""Numbers as mappers write them."""

from __future__ import annotations

import pytest

from routing.stations.formats.osm.numbers import count_of, outputs_w

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
        ("22,000 W", [22]),
        ("3.700 W", [3.7]),
        ("2x11.000 VA", [11, 11]),
        ("250 W", []),  # bicycles, or a mistake
        ("22 W; 11 kW", [11]),
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
