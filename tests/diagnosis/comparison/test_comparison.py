"""The statistics of the source's tables IV to VII, by hand and as published."""

from __future__ import annotations

import math

import pytest

from diagnosis.comparison.comparison import TripPair as TripPair
from diagnosis.comparison.comparison import averages, compare, distribution, mean_interval, paired_test, relative_error
from diagnosis.errors import ComparisonError


def test_table_four_is_a_mean_of_each_trips_own_value(make_trip):
    # 10 km in 1000 s and 30 km in 1000 s: speeds 10 and 30 m/s, mean 20; 40 km in 2000 s are 20 too.
    # 10 km in 1000 s and 10 km in 500 s: 10 and 20 m/s, mean 15; 20 km in 1500 s are 13.3.
    trips = [make_trip("1", mass=1800.0), make_trip("2", seconds=500.0, kwh=4.0, mass=2000.0, stops=5, standstill=0.0)]
    mean = averages(trips)
    assert mean.trip_count == 2
    assert mean.mass_kg == 1900.0
    assert mean.speed_mps == pytest.approx(15.0)
    assert mean.pooled_speed_mps == pytest.approx(20_000.0 / 1500.0)
    assert (mean.stop_count, mean.standstill_s, mean.duration_s) == (7.5, 50.0, 750.0)
    # 20 and 40 kWh/100 km of 36 J/m each
    assert mean.specific_j_per_m == pytest.approx(30.0 * 36.0)
    assert mean.energy_j == pytest.approx(3.0 * 3.6e6)


def test_pooled_consumption_weighs_long_trips_more(make_trip):
    # 2 kWh over 10 km and 2 kWh over 30 km: 20 and 6.67 kWh/100 km, mean 13.3; 4 kWh over 40 km are 10
    mean = averages([make_trip("1"), make_trip("2", km=30.0)])
    assert mean.specific_j_per_m / 36.0 == pytest.approx(40.0 / 3.0)
    assert mean.pooled_specific_j_per_m / 36.0 == pytest.approx(10.0)


def test_mass_is_absent_where_one_trip_has_none(make_trip):
    assert averages([make_trip("1", mass=1800.0), make_trip("2")]).mass_kg is None


def test_table_five_by_hand(make_trip):
    # errors of trip 1: distance +10 %, time -20 %, speed 1.1/0.8 - 1 = +37.5 %, energy +50 %, a km 1.5/1.1 - 1
    # errors of trip 2: none
    records = [
        make_trip("1"),
        make_trip("2"),
        make_trip("1", "fast", km=11.0, seconds=800.0, stops=5, standstill=150.0, kwh=3.0),
        make_trip("2", "fast"),
    ]
    (series,) = compare(records).series
    (kind,) = series.types
    errors = kind.errors
    assert errors.distance.mean_frac == pytest.approx(0.05)
    assert errors.duration.mean_frac == pytest.approx(-0.10)
    assert errors.speed.mean_frac == pytest.approx(0.375 / 2)
    # pooled: 21 km in 1800 s against 20 km in 2000 s
    assert errors.speed.pooled_frac == pytest.approx((21.0 / 1800.0) / (20.0 / 2000.0) - 1.0)
    assert errors.stops.mean_frac == pytest.approx(-0.25)
    assert errors.standstill.mean_frac == pytest.approx(0.25)
    assert errors.energy.mean_frac == pytest.approx(0.25)
    assert errors.specific_energy.mean_frac == pytest.approx((1.5 / 1.1 - 1.0) / 2)
    assert errors.energy.trip_count == 2


def test_zero_measured_stops_have_no_relative_error_but_a_pooled_one(make_trip):
    records = [
        make_trip("1", stops=0.0),
        make_trip("2", stops=4.0),
        make_trip("1", "fast", stops=3.0),
        make_trip("2", "fast", stops=5.0),
    ]
    stops = compare(records).series[0].types[0].errors.stops
    assert (stops.mean_frac, stops.trip_count) == (pytest.approx(0.25), 1)
    assert stops.pooled_frac == pytest.approx(1.0)  # 8 against 4
    records = [make_trip("1", stops=0.0), make_trip("1", "fast", stops=3.0)]
    stops = compare(records).series[0].types[0].errors.stops
    assert (stops.mean_frac, stops.pooled_frac, stops.trip_count) == (None, None, 0)


def test_distribution_by_hand():
    # -1, 0, 1, 4: mean 1, squares 4 + 1 + 0 + 9 = 14; SD √(14/3) and √(14/4)
    # quartiles at ranks 0.75, 1.5, 2.25 of 0..3: -0.25, 0.5, 1.75
    found = distribution([4.0, -1.0, 1.0, 0.0])
    assert (found.count, found.mean, found.minimum, found.maximum) == (4, 1.0, -1.0, 4.0)
    assert found.sd == pytest.approx(math.sqrt(14.0 / 3.0))
    assert found.population_sd == pytest.approx(math.sqrt(14.0 / 4.0))
    assert found.quartiles == pytest.approx((-0.25, 0.5, 1.75))
    assert found.trips_low == pytest.approx(1.0 - 1.96 * math.sqrt(14.0 / 3.0))
    # t(0.975, 3) = 3.1824
    assert found.mean_high == pytest.approx(1.0 + 3.1824 * math.sqrt(14.0 / 3.0) / 2.0, rel=1e-4)


def test_one_value_has_no_spread():
    found = distribution([0.5])
    assert (found.mean, found.minimum, found.maximum, found.quartiles) == (0.5, 0.5, 0.5, (0.5, 0.5, 0.5))
    assert found.sd is found.population_sd is found.mean_low is found.mean_high is found.trips_low is None


def test_published_intervals_follow_from_published_mean_and_deviation():
    # table VII: mean 3.6, SD 10.4, n = 23; t(0.975, 22) = 2.074; 2.074·10.4/√23 = 4.50
    low, high = mean_interval(3.6, 10.4, 23)
    assert (round(low, 1), round(high, 1)) == (-0.9, 8.1)
    # table X, complex algorithm
    low, high = mean_interval(-6.2, 15.9, 23)
    assert (round(low, 1), round(high, 1)) == (-13.1, 0.7)  # printed 0.6; its mean is -6.24 (table IX)
    # two values with mean 3.6 and SD 10.4 give the published range of 95 % of trips
    found = distribution([3.6 - 10.4 / math.sqrt(2.0), 3.6 + 10.4 / math.sqrt(2.0)])
    assert found.sd == pytest.approx(10.4)
    assert found.trips_low is not None
    assert found.trips_high is not None
    assert (round(found.trips_low, 1), round(found.trips_high, 1)) == (-16.8, 24.0)


def test_paired_test_by_hand(make_trip):
    # differences 1, 2, 3 kWh: mean 2, SD 1, t = 2/(1/√3) = 2√3 with 2 degrees of freedom; p = 1 - t/√(t² + 2)
    pairs = [TripPair(make_trip(str(k)), make_trip(str(k), "fast", kwh=2.0 + k)) for k in (1, 2, 3)]
    found = paired_test(pairs)
    t = 2.0 * math.sqrt(3.0)
    assert found.difference_j == pytest.approx(2.0 * 3.6e6)
    assert found.statistic == pytest.approx(t)
    assert found.degrees_of_freedom == 2
    assert found.p_value == pytest.approx(1.0 - t / math.sqrt(t * t + 2.0))


@pytest.mark.parametrize("offset_kwh", [0.0, 0.3])
def test_paired_test_of_equal_differences_has_no_t(make_trip, offset_kwh):
    pairs = [
        TripPair(make_trip(str(k), kwh=float(k)), make_trip(str(k), "fast", kwh=k + offset_kwh)) for k in (1, 2, 3)
    ]
    found = paired_test(pairs)
    assert found.difference_j == pytest.approx(offset_kwh * 3.6e6)
    assert (found.statistic, found.p_value) == (None, None)


def test_one_trip_is_compared_without_test_and_spread(make_trip):
    (series,) = compare([make_trip("1"), make_trip("1", "fast", kwh=2.2)]).series
    assert series.paired_test is None
    assert series.energy_error is not None
    assert series.energy_error.mean == pytest.approx(0.1)
    assert series.energy_error.sd is None


def test_trips_without_partner_are_reported_and_left_out(make_trip):
    records = [make_trip("1"), make_trip("2", kind="highway"), make_trip("1", "fast"), make_trip("3", "fast")]
    comparison = compare(records)
    (series,) = comparison.series
    assert comparison.route_types == ("urban", "highway")
    assert [pair.measured.trip_id for pair in series.pairs] == ["1"]
    assert (series.measured_only, series.simulated_only) == (("2",), ("3",))
    assert [kind.route_type for kind in series.types] == ["urban"]


def test_trip_with_recuperated_measurement_is_reported_as_undefined(make_trip):
    records = [
        make_trip("1", kwh=-1.0),
        make_trip("2"),
        make_trip("1", "fast", kwh=1.0),
        make_trip("2", "fast", kwh=3.0),
    ]
    (series,) = compare(records).series
    assert series.undefined == ("1",)
    assert series.energy_error is not None
    assert (series.energy_error.count, series.energy_error.mean) == (1, pytest.approx(0.5))
    assert series.measured_energy_j.count == 2  # the paired test and the energies keep it
    assert series.paired_test is not None
    assert relative_error(1.0, 0.0) is None


def test_each_simulated_series_is_compared_with_the_named_one(make_trip):
    records = [make_trip("1", "logger"), make_trip("1", "fast"), make_trip("1", "timestep")]
    comparison = compare(records, "logger")
    assert comparison.measured == "logger"
    assert [series.series for series in comparison.series] == ["fast", "timestep"]


@pytest.mark.parametrize(
    ("trips", "measured", "message"),
    [
        ([("1", "fast", "urban")], "measured", "measured series is 'measured', allowed: 'fast'"),
        ([("1", "measured", "urban")], "measured", "'measured' alone"),
        ([("1", "measured", "urban"), ("2", "fast", "urban")], "measured", "series 'fast' is without a trip"),
        ([("1", "measured", "urban"), ("1", "fast", "hills")], "measured", "type of trip '1' in series 'fast'"),
        ([("1", "fast", "urban"), ("1", "fast", "urban")], "measured", "each trip once"),
        ([], "measured", "a series of trips"),
    ],
)
def test_what_cannot_be_compared_is_refused(make_trip, trips, measured, message):
    with pytest.raises(ComparisonError, match=message):
        compare([make_trip(trip, series, kind=kind) for trip, series, kind in trips], measured)
