"""Plots: scales and ticks, marks where their values lie, smoothing that keeps energy, bars that add up."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from diagnosis.answer.regimes import Axis, RegimeResidual
from diagnosis.answer.results import TripAccount, TripTimeline
from diagnosis.report.axes import Scale, scale, shortened, tick_text
from diagnosis.report.fit import example_trips
from diagnosis.report.plots import (
    MOST_BARS,
    MOST_POINTS,
    energy_bars,
    energy_reach,
    families,
    fit_panel,
    regime_panel,
    smoothed,
    trip_panel,
)

EMPTY = TripTimeline(*(np.zeros(0) for _ in range(6)))


def timeline(begin_s, duration_s, measured_w) -> TripTimeline:
    measured = np.array(measured_w, np.float64)
    return TripTimeline(
        np.array(begin_s, np.float64), np.array(duration_s, np.float64), measured / 1000.0, measured, measured, measured
    )


def trip(name: str = "A", **changes: object) -> TripAccount:
    known = TripAccount(name, False, 5.0, 10.0, 600.0, 2.0, 1.5, 1.6, 1.9, 1.9, {"thermal": 0.5, "wind": -0.2}, EMPTY)
    return replace(known, **changes)


def parsed(svg: str) -> ElementTree.Element:
    return ElementTree.fromstring(svg)


def with_class(svg: ElementTree.Element, name: str) -> list[ElementTree.Element]:
    return [element for element in svg.iter() if name in element.get("class", "").split()]


@pytest.mark.parametrize(
    ("low", "high", "most", "ticks"),
    [
        (0.0, 1.0, 5, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (-3.0, 14.0, 5, [0.0, 5.0, 10.0]),
        (0.0, 950.0, 5, [0.0, 200.0, 400.0, 600.0, 800.0]),
        (0.011, 0.029, 4, [0.015, 0.02, 0.025]),
    ],
)
def test_ticks_are_round_and_within_the_scale(low, high, most, ticks):
    assert Scale(low, high, 0.0, 1.0).ticks(most) == pytest.approx(ticks)


def test_tick_texts_have_the_decimals_of_their_step():
    assert [tick_text(tick, [0.0, 0.2]) for tick in (0.0, 0.2, 1.0)] == ["0.0", "0.2", "1.0"]
    assert [tick_text(tick, [0.0, 500.0]) for tick in (-500.0, 0.0)] == ["−500", "0"]
    assert tick_text(0.0, [0.0]) == "0"


def test_scale_holds_its_values_and_survives_odd_ones():
    whole = scale([1.0, 3.0, math.nan], 0.0, 100.0, zero=True)
    assert whole.low == 0.0
    assert whole.high > 3.0
    for values in ([], [0.0], [2.0, 2.0], [math.nan], [-1e-9, 1e9]):
        found = scale(values, 0.0, 100.0)
        assert found.low < found.high
        assert found.ticks(5)


def test_long_ids_keep_both_ends():
    assert shortened("short", 200.0) == "short"
    assert shortened("2024-01-01-morning-commute-a", 66.0) == "2024-…te-a"


def test_drives_lie_where_their_energies_are_and_held_out_ones_are_filled():
    trips = [trip("A"), trip("B", held_out=True, measured_kwh=4.0, after_kwh=4.0), trip("C", after_kwh=math.nan)]
    reach = energy_reach(trips)
    marks = parsed(fit_panel(trips, lambda trip: trip.after_kwh, "After", "after", reach)).findall("circle")
    assert [mark.get("class") for mark in marks] == ["after fitted", "after held"]
    x, y = Scale(*reach, 52, 328), Scale(*reach, 292, 44)
    for mark, (measured, model) in zip(marks, [(2.0, 1.9), (4.0, 4.0)], strict=True):
        assert float(mark.get("cx", "")) == pytest.approx(x.at(measured), abs=0.06)
        assert float(mark.get("cy", "")) == pytest.approx(y.at(model), abs=0.06)


def test_energies_below_zero_are_drawn_too():
    assert energy_reach([trip(measured_kwh=-0.5)])[0] < -0.5
    assert energy_reach([])[1] > 0.0


def test_regimes_have_a_mark_before_and_after_and_a_whisker_where_an_interval_is_known():
    known = RegimeResidual(Axis.SPEED, 0.0, 5.0, 100.0, 50.0, 150.0, 1.0, 3600.0, 5)
    alone = RegimeResidual(Axis.SPEED, 5.0, 30.0, -40.0, None, None, 1.0, 3600.0, 1)
    svg = parsed(regime_panel(Axis.SPEED, [known, alone], [replace(known, mean_w=10.0, low_w=-30.0, high_w=50.0)]))
    assert len(with_class(svg, "before")) == 3  # two marks, one whisker
    assert len(with_class(svg, "after")) == 2
    (before,) = (whisker for whisker in with_class(svg, "whisker") if "before" in whisker.get("class", ""))
    (zero,) = with_class(svg, "zero")
    circle, lower = svg.findall(".//circle")
    y1, y2, at, level = (
        float(value) for value in (before.get("y1"), before.get("y2"), circle.get("cy"), zero.get("y1")) if value
    )
    # 50, 100 and 150 W lie at equal distances above 0, which lies below them: y grows downwards
    assert level - y1 == pytest.approx((level - at) / 2.0, abs=0.2)
    assert level - y2 == pytest.approx((level - at) * 1.5, abs=0.2)
    assert float(lower.get("cy", "")) > level


def test_one_wild_interval_does_not_flatten_a_panel():
    usual = [RegimeResidual(Axis.SPEED, low, low + 5.0, 100.0, 50.0, 150.0, 1.0, 3600.0, 5) for low in (0.0, 5.0, 10.0)]
    wild = RegimeResidual(Axis.SPEED, 15.0, 20.0, 100.0, -1e6, 1e6, 1.0, 3600.0, 2)
    svg = parsed(regime_panel(Axis.SPEED, [*usual, wild], []))
    heights = [abs(float(mark.get("y1", "")) - float(mark.get("y2", ""))) for mark in with_class(svg, "whisker")]
    assert heights[0] > 25.0  # 100 W of 500 W over 158 px; 0.01 px with the wild interval whole
    assert heights[3] <= 202.0 - 44.0 + 0.1


def test_smoothing_is_the_mean_by_time_in_each_minute():
    found = smoothed(timeline([0.0, 20.0, 70.0], [20.0, 40.0, 10.0], [3000.0, 6000.0, 9000.0]))
    assert found.begin_s.tolist() == [0.0, 60.0]
    assert found.duration_s.tolist() == [60.0, 60.0]
    assert found.measured_w.tolist() == pytest.approx([5000.0, 9000.0])  # (3 · 20 + 6 · 40)/60 kW
    assert found.speed_mps.tolist() == pytest.approx([5.0, 9.0])


def test_smoothing_of_a_long_trip_has_few_points_and_keeps_the_energy():
    begin = np.arange(0.0, 36_000.0, 5.0)
    power = 5000.0 + 4000.0 * np.sin(begin / 500.0)
    found = smoothed(timeline(begin, np.full(begin.size, 5.0), power))
    assert found.begin_s.size == MOST_POINTS
    assert float(found.measured_w @ found.duration_s) == pytest.approx(float(power.sum() * 5.0), rel=1e-9)


def test_line_of_a_trip_breaks_at_a_gap():
    begin = [*range(0, 300, 60), *range(900, 1200, 60)]
    svg = parsed(trip_panel(trip(timeline=timeline(begin, [60.0] * 10, [1000.0] * 10))))
    (measured,) = with_class(svg, "measured")
    assert re.findall("[ML]", measured.get("d", "")) == [*"MLLLL", *"MLLLL"]


def test_trip_without_windows_or_with_holes_is_still_drawn():
    assert with_class(parsed(trip_panel(trip())), "measured")[0].get("d") == ""
    holed = timeline([0.0, 60.0, 120.0], [60.0] * 3, [1000.0, math.nan, 3000.0])
    assert "nan" not in trip_panel(trip(timeline=holed))


def test_bars_add_up_by_family_and_shares_below_zero_lie_left_of_nought():
    svg = parsed(energy_bars([trip(by_family_kwh={"rolling": 1.6, "thermal": 0.5, "wind": -0.2})]))
    thermal, rolling, wind = (with_class(svg, f"f-{name}")[0] for name in ("thermal", "rolling", "wind"))
    begin, width = (
        {share: float(share.get(name, "")) for share in (thermal, rolling, wind)} for name in ("x", "width")
    )
    assert begin[rolling] == pytest.approx(begin[thermal] + width[thermal], abs=0.2)
    assert begin[wind] + width[wind] == pytest.approx(begin[thermal], abs=0.2)
    per_kwh = width[rolling] / 1.6
    assert width[thermal] == pytest.approx(0.5 * per_kwh, abs=0.2)
    assert width[wind] == pytest.approx(0.2 * per_kwh, abs=0.2)
    points = with_class(svg, "measured-mark")[0].get("points", "")
    middle = float(points.split()[1].split(",")[0])
    assert middle == pytest.approx(begin[thermal] + 2.0 * per_kwh, abs=0.3)


def test_bars_stop_at_their_limit():
    svg = parsed(energy_bars([trip(f"T{k}") for k in range(MOST_BARS + 5)]))
    assert len(with_class(svg, "measured-mark")) == MOST_BARS


def test_families_keep_their_order_and_empty_ones_are_left_out():
    mixed = trip(by_family_kwh={"wind": 0.1, "thermal": 0.2, "mass": 0.0, "zebra": 0.1, "ants": 0.1})
    assert families([mixed, trip(by_family_kwh={"rolling": 1.0})]) == ("thermal", "rolling", "wind", "ants", "zebra")


def test_examples_are_the_most_explained_and_the_worst_of_the_held_out():
    fitted = trip("F", before_kwh=0.1, after_kwh=2.0)
    most = trip("M", held_out=True, before_kwh=1.0, after_kwh=1.9)
    worst = trip("W", held_out=True, before_kwh=1.2, after_kwh=1.3)
    assert [example.id for _, example in example_trips([fitted, worst, most])] == ["M", "W"]
    assert [example.id for _, example in example_trips([fitted])] == ["F"]
    same = trip("S", before_kwh=1.5, after_kwh=1.5)
    assert example_trips([same]) == [("The drive that is met worst", same)]
    assert example_trips([trip(after_kwh=math.nan)]) == []
    assert example_trips([]) == []
