"""Numbers rounded to what their intervals carry, and the words around them."""

from __future__ import annotations

import math

import pytest
from jinja2 import UndefinedError
from markupsafe import Markup

from diagnosis.answer.regimes import Axis, RegimeResidual
from diagnosis.report.rendering import pixels, rendered
from diagnosis.report.tables import Header, Table, cell, data, interval_cell
from diagnosis.report.text import (
    axis_name,
    decimals,
    effect_name,
    fixed,
    number,
    parameter_name,
    places,
    plain,
    probability,
    quantity,
    regime_range,
    span,
)


def regime(axis: Axis, low: float, high: float) -> RegimeResidual:
    return RegimeResidual(axis, low, high, 100.0, 50.0, 150.0, 1.0, 3600.0, 5)


@pytest.mark.parametrize(
    ("value", "interval", "shown"),
    [
        (1.9231, (1.71, 2.13), "1.92"),  # half width 0.21: two digits of it are hundredths
        (1443.27, (1381.0, 1502.0), "1443"),  # half width 60.5: ones
        (812.4, (630.0, 994.0), "810"),  # half width 182: tens
        (0.00812, (0.0061, 0.0101), "0.0081"),  # half width 0.002: ten-thousandths
        (3.0, (-900.0, 906.0), "0"),  # half width 903: the value drowns
        (1.23456, None, "1.23"),
        (1.23456, (1.2, 1.2), "1.23"),  # an interval of no width says nothing
        (1.23456, (-math.inf, math.inf), "1.23"),
        (-0.0, None, "0"),
        (-2.5, None, "−2.50"),
        (math.nan, None, "–"),
        (math.inf, (0.0, 1.0), "–"),
    ],
)
def test_number_has_two_digits_of_its_intervals_half_width_or_three_of_its_own(value, interval, shown):
    assert number(value, interval) == shown


def test_rounding_to_zero_leaves_no_sign():
    assert fixed(-0.004, 2) == "0.00"
    assert fixed(0.004, 2, signed=True) == "0.00"
    assert fixed(0.5, 1, signed=True) == "+0.5"


def test_decimals_below_zero_round_to_tens():
    assert decimals(0.0, (0.0, 300.0)) == -1
    assert fixed(1234.0, -2) == "1200"


def test_quantity_carries_unit_and_interval():
    assert quantity(34.213, (30.02, 38.44), "kWh") == "34.2\xa0kWh (95\xa0%: 30.0 to 38.4)"
    assert quantity(0.23, (0.1, 0.36), "1") == "0.23 (95\xa0%: 0.10 to 0.36)"
    assert quantity(5.0, None, "min") == "5.00\xa0min"
    assert quantity(math.nan, (0.0, 1.0), "kWh") == "–"


def test_plain_number_shows_no_digit_for_show():
    assert [plain(value) for value in (1443.2, 8.0, -0.05, 1e-7, math.nan)] == ["1443.2", "8", "−0.05", "1e−07", "–"]


@pytest.mark.parametrize(
    ("p", "shown"), [(0.0, "< 0.001"), (0.0009, "< 0.001"), (0.0042, "0.004"), (0.25, "0.25"), (math.nan, "–")]
)
def test_chance_is_never_rounded_to_nothing(p, shown):
    assert probability(p) == shown


def test_open_ends_of_a_range_are_said():
    assert span(-math.inf, 5.0, "km") == "below 5\xa0km"
    assert span(5.0, math.inf, "km") == "above 5\xa0km"
    assert span(-math.inf, math.inf) == "everywhere"
    assert span(-2.0, 5.0, "°C") == "−2 to 5\xa0°C"


def test_outermost_regimes_are_open_and_a_speed_starts_at_zero():
    assert regime_range(Axis.AMBIENT, -50.0, -5.0) == "below −5\xa0°C"
    assert regime_range(Axis.AMBIENT, 28.0, 55.0) == "above 28\xa0°C"
    assert regime_range(Axis.SPEED, 0.0, 5.0) == "0 to 5\xa0km/h"
    assert regime_range(Axis.SPEED, 130.0, 200.0) == "above 130\xa0km/h"
    assert regime_range(Axis.STANDSTILL, 0.0, 0.9) == "driving"
    assert regime_range(Axis.STANDSTILL, 0.9, 1.0) == "standing"


def test_regimes_that_touch_are_one_place():
    cold = [regime(Axis.AMBIENT, -5.0, 5.0), regime(Axis.AMBIENT, -50.0, -5.0), regime(Axis.AMBIENT, 22.0, 28.0)]
    assert places(cold) == ("below 5\xa0°C", "at 22 to 28\xa0°C")
    start = [regime(Axis.SINCE_START, 0.0, 2.0), regime(Axis.STANDSTILL, 0.9, 1.0)]
    assert places(start) == ("while standing", "0 to 2\xa0min after the start")
    assert places([]) == ()


def test_names_lose_their_unit():
    assert axis_name("speed_kmh") == "Speed"
    assert axis_name("distance_km") == "Distance"
    assert axis_name("trip") == "Trip"
    assert effect_name("cabin_warm_up") == "cabin warm up"
    assert effect_name("rolling_temp_per_k") == "rolling temp"
    assert effect_name("heating_w_per_k") == "heating"
    assert parameter_name("mass_kg") == "mass"
    assert parameter_name("aux_idle_eff") == "aux idle eff"


def test_template_escapes_texts_and_leaves_markup():
    assert rendered("nothing.html", text="a < b & \"c\" 'd'") == "<p>a &lt; b &amp; &#34;c&#34; &#39;d&#39;</p>"
    assert rendered("nothing.html", text=Markup("<b>a &lt; b</b>")) == "<p><b>a &lt; b</b></p>"
    assert rendered("nothing.html", text="a\x00b\u202ec\ud800") == "<p>a\ufffdb\ufffdc?</p>"


def test_template_without_a_fact_that_it_asks_for_is_refused():
    with pytest.raises(UndefinedError, match="'text' is undefined"):
        rendered("nothing.html")


def test_coordinates_are_tenths_of_a_pixel():
    assert [pixels(value) for value in (1.25, 3.0, 3, -0.04, 12.96)] == ["1.2", "3", "3", "0", "13"]


def test_number_for_machines_stands_beside_its_text():
    rows = [
        ["a", data(1.23456789, "1.2"), interval_cell(1.92, (1.71, 2.13))],
        ["b", cell(math.nan), interval_cell(1.92, None)],
    ]
    table = Table("T", [Header("name"), Header("value", numeric=True), Header("95 %")], rows)
    page = rendered("profile.html", sentence=None, splits=table)
    assert '<td class="n"><data value="1.23457">1.2</data></td>' in page
    assert '<td><data value="1.71">1.71</data> to <data value="2.13">2.13</data></td>' in page
    assert '<th scope="row">b</th><td class="n">–</td><td>–</td>' in page


def test_table_with_a_row_of_other_length_is_refused():
    with pytest.raises(ValueError, match="a row of 'T' has 1 cells, allowed: 2"):
        Table("T", [Header("a"), Header("b")], [["only"]])
