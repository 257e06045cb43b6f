"""Properties of the parsers of prices, hours, numbers and names: any text ends in an answer that is in bounds."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.charging.charging import MOST_POWER_W
from routing.places import Point
from routing.stations.formats.gathering import MOST_TEXT, clean
from routing.stations.formats.hours import english_hours, osm_hours, weekly_hours
from routing.stations.formats.numbers import LEAST_POWER_W, count_of, number_of, place_of, power_w_of
from routing.stations.formats.plugs import connector_of
from routing.stations.formats.prices import MOST_PRICE, price_of
from routing.stations.notes import LeftOutError

PRICE_WORDS = st.lists(
    st.sampled_from(
        ["0.39", "1,50", "€", "$", "kWh", "/", "per", "min", "session", ";", "+", "and", "free", "EUR", "ct", "-", "AC"]
    ),
    max_size=12,
).map(" ".join)
HOUR_WORDS = st.lists(
    st.sampled_from(
        ["Mon", "Fri", "-", "8am", "5:30pm", "daily", ";", "24 hours", "24/7", "closed", ",", "Su", "10:00"]
    ),
    max_size=14,
).map(" ".join)


@given(st.text(max_size=400) | PRICE_WORDS, st.sampled_from(["", "US", "NO", "DE"]))
def test_any_price_is_words_and_numbers_in_bounds(text: str, country: str) -> None:
    price, is_fee = price_of(text, country)
    if price is None:
        assert not "".join(letter for letter in text if letter.isprintable()).strip()
        return
    rates = [rate for rate in (price.per_kwh, price.per_min, price.per_session) if rate is not None]
    assert all(0.0 <= rate <= MOST_PRICE for rate in rates)
    assert price.text.isprintable()
    assert (is_fee is None) == (not rates)
    assert price.currency or not any(rates)


@pytest.mark.parametrize(
    ("text", "country", "rates"),
    [
        ("0,39 €/kWh", "", ("EUR", 0.39, None, None)),
        ("$0.43/kWh", "US", ("USD", 0.43, None, None)),
        ("$0.43/kWh", "", ("", None, None, None)),
        ("0.25 EUR/min; 1 EUR session fee", "", ("EUR", None, 0.25, 1.0)),
        ("£0.35 per kWh", "", ("GBP", 0.35, None, None)),
        ("35p/kWh", "", ("GBP", 0.35, None, None)),
        ("29 ct/kWh", "", ("EUR", 0.29, None, None)),
        ("$1.50 per hour", "US", ("USD", None, 0.025, None)),
        ("$2 per session", "CA", ("CAD", None, None, 2.0)),
        ("NOK 5,50 per kWh", "", ("NOK", 5.5, None, None)),
        ("kr 3.50/kWh", "SE", ("SEK", 3.5, None, None)),
        ("1 EUR Startgebühr; 0,45 EUR je kWh", "", ("EUR", 0.45, None, 1.0)),
        ("Free", "", ("", 0.0, None, None)),
        ("kostenlos", "", ("", 0.0, None, None)),
        # what is not sure stays words
        ("2€", "", ("", None, None, None)),
        ("0", "", ("", None, None, None)),
        ("free for 2h", "", ("", None, None, None)),
        ("0.29-0.39 €/kWh", "", ("", None, None, None)),
        ("AC 0.39 €/kWh, DC 0.59 €/kWh", "", ("", None, None, None)),
        ("0.39 €/kWh, 0.59 €/kWh", "", ("", None, None, None)),
        ("0.30 EUR/kWh, min 1 EUR", "", ("", None, None, None)),
        ("0.30 EUR/kWh + 1 CHF session fee", "", ("", None, None, None)),
        ("999999999 €/kWh", "", ("", None, None, None)),
    ],
)
def test_prices_are_read_where_every_word_is_understood(
    text: str, country: str, rates: tuple[str, float | None, float | None, float | None]
) -> None:
    price, _ = price_of(text, country)
    assert price is not None
    assert price.text == text
    assert (price.currency, price.per_kwh, price.per_min, price.per_session) == rates


@given(st.text(max_size=700) | HOUR_WORDS)
def test_hours_of_any_text_are_none_or_in_the_syntax_of_openstreetmap(text: str) -> None:
    for hours in (english_hours(text), osm_hours(text)):
        assert hours is None or osm_hours(hours) == hours


@given(
    st.dictionaries(
        st.integers(0, 6),
        st.lists(st.tuples(*[st.integers(0, 24 * 60).map(lambda t: f"{t // 60}:{t % 60:02d}")] * 2), max_size=2),
    )
)
def test_hours_of_a_week_are_in_the_syntax_of_openstreetmap(spans: dict[int, list[tuple[str, str]]]) -> None:
    hours = weekly_hours(spans)
    assert hours is None or osm_hours(hours) == hours
    late = any(begin == "24:00" for day in spans.values() for begin, _ in day)
    assert hours is not None or late or not any(spans.values())


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("24 hours daily", "24/7"),
        ("24 hours daily; pay lot", "24/7"),
        ("24 hours daily; maximum stay of 2 hours", "24/7"),
        ("6am-9pm daily", "Mo-Su 06:00-21:00"),
        ("5am-12am daily", "Mo-Su 05:00-24:00"),
        ("Mon-Fri 8:30am - 5pm; Sat 9am-12pm", "Mo-Fr 08:30-17:00; Sa 09:00-12:00"),
        ("24 hours daily; access restricted to staff 5am-5pm", None),
        ("Dealership business hours", None),
        ("Dawn to dusk daily", None),
        ("13pm-14pm daily", None),
    ],
)
def test_american_hours_are_read_where_they_are_clear(text: str, expected: str | None) -> None:
    assert english_hours(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "24/7",
        "Mo-Fr 08:00-20:00",
        "Mo-Fr 08:00-12:00,13:00-18:00; Sa 09:00-13:00; PH off",
        "Apr-Oct: Mo-Su 06:00-22:00",
    ],
)
def test_hours_in_the_syntax_of_openstreetmap_stay_as_they_are(text: str) -> None:
    assert osm_hours(text) == text


@pytest.mark.parametrize("end", ["", "!", ";", "x"])
@pytest.mark.parametrize(
    "text",
    ["08:00-10:00," * 20, "Mo,Tu," * 40, "1x " * 130, " " * 600, "a " * 300, "1€/" * 40, "Mon - " * 100, "1'" * 20],
)
def test_texts_that_patterns_could_try_for_ever_end(text: str, end: str) -> None:
    at = Point(48.0, 11.0)
    assert osm_hours(text + end) is None or end in ("", ";")
    assert english_hours(text + end) is None
    assert number_of(text + end) is None
    assert power_w_of(text + end) is None
    assert connector_of(text + end, at) is None
    price, _ = price_of(text + end)
    assert price is None or price.per_kwh is None


@given(st.floats(-1e9, 1e9, allow_nan=False).map(lambda x: round(x, 3)), st.booleans())
def test_a_number_is_the_same_in_each_way_of_writing_it(number: float, decimal_comma: bool) -> None:
    plain = f"{number:.3f}"
    grouped = f"{number:,.3f}"
    if decimal_comma:
        plain, grouped = plain.replace(".", ","), grouped.translate(str.maketrans(".,", ",."))
    expected = pytest.approx(number, abs=1e-9)
    assert number_of(grouped, decimal_comma=decimal_comma) == expected
    assert number_of(f" {plain} ", decimal_comma=decimal_comma) == expected
    assert number_of(number) == number


@given(st.text(max_size=60) | st.floats() | st.integers() | st.none() | st.booleans() | st.lists(st.integers()))
def test_numbers_powers_and_counts_of_anything_are_none_or_in_bounds(value: object) -> None:
    for decimal_comma in (False, True):
        number = number_of(value, decimal_comma=decimal_comma)
        assert number is None or math.isfinite(number)
        power_w = power_w_of(value, decimal_comma=decimal_comma)
        assert power_w is None or LEAST_POWER_W <= power_w <= MOST_POWER_W
    count = count_of(value)
    assert count is None or 1 <= count <= 2000


@given(st.text(max_size=30) | st.floats() | st.none(), st.text(max_size=30) | st.floats() | st.integers())
def test_a_place_of_anything_is_in_range_or_left_out(lat: object, lon: object) -> None:
    message = ""
    at = Point(0.0, 0.0)
    try:
        at = place_of(lat, lon)
    except LeftOutError as error:
        message = str(error)
    assert len(message) < 400
    assert abs(at.lat_deg) <= 90.0
    assert abs(at.lon_deg) <= 180.0


@settings(max_examples=50)
@given(st.text(max_size=1000))
def test_names_are_printable_and_short(text: str) -> None:
    name = clean(text)
    assert name.isprintable()
    assert len(name) <= MOST_TEXT
    assert clean(name) == name
