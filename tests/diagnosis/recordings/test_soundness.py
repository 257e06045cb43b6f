"""One fault planted in a drive at a time: each is found and named, and the clean drive has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.recordings.reading import NoteKind, RecordingError
from diagnosis.recordings.soundness.lag import power_lag_s
from diagnosis.recordings.soundness.plausibility import apparent_mass_kg
from tests.diagnosis.recorded_drives import MASS_KG, drive, plain_csv


def texts(recording, *kinds):
    return [note.text for note in recording.notes if note.kind in kinds]


def with_positions(driven, **columns):
    return plain_csv(driven, lat=driven.lat_deg, lon=driven.lon_deg, **columns)


def delayed(driven, lag_s):
    """The drive with a power that comes so much later than its speed."""
    return replace(driven, power_w=np.interp(driven.time_s - lag_s, driven.time_s, driven.power_w))


def test_clean_drive_has_no_fault(read):
    recording = read(with_positions(drive()))
    assert [note.kind for note in recording.notes] == [NoteKind.CHECKED]
    assert recording.gaps == ()


# units and signs


def test_current_with_the_wrong_sign_says_how_to_mend_it(read):
    driven = drive()
    turned = plain_csv(driven, power_w=-driven.power_w)
    with pytest.raises(RecordingError, match="higher while accelerating; turn the sign of power, or else of current"):
        read(turned)


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1.0 / 3.6, "in m/s"), (1.0 / 1.609344, "in miles an hour"), (1.609344, "in km/h")],
)
def test_speed_in_another_unit_is_proven_by_positions_and_converted(read, factor, unit):
    driven = drive()
    recording = read(with_positions(driven, speed_kmh=3.6 * factor * driven.speed_mps))
    np.testing.assert_allclose(recording.speed_mps, driven.speed_mps, atol=1e-6)
    (text,) = texts(recording, NoteKind.UNIT)
    assert text.startswith(f"is {unit}, declared as")
    assert "converted" in text


def test_speed_that_positions_contradict_by_the_factor_of_no_unit_is_refused(read):
    driven = drive()
    with pytest.raises(RecordingError, match=r"speed is too low: .* 1\.50 times as fast"):
        read(with_positions(driven, speed_kmh=3.6 / 1.5 * driven.speed_mps))


def test_speedometer_that_is_a_tenth_fast_is_suspect_only(read):
    driven = drive()
    recording = read(with_positions(driven, speed_kmh=3.6 * 1.1 * driven.speed_mps))
    assert texts(recording, NoteKind.SUSPECT) == ["by the positions 0.91 times as fast, in 60 stretches of 10 s"]


def test_speed_in_metres_a_second_without_positions_is_suspect(read):
    driven = drive()
    (text,) = texts(read(plain_csv(driven, speed_kmh=driven.speed_mps)), NoteKind.SUSPECT)
    assert "speed in metres a second" in text
    assert texts(read(plain_csv(driven)), NoteKind.SUSPECT) == []


def test_power_in_kilowatts_is_suspect(read):
    driven = drive()
    (text,) = texts(read(plain_csv(driven, power_w=driven.power_w / 1000.0)), NoteKind.SUSPECT)
    assert "power in kW" in text


def test_apparent_mass_is_that_of_a_car_without_losses(read):
    # v·(m·a + 600 N) while a = 1 m/s²: slope m + 600 N / (1 m/s²)
    assert apparent_mass_kg(read(plain_csv(drive()))) == pytest.approx(MASS_KG + 600.0, rel=0.01)


def test_power_and_current_of_other_signs_are_suspect(read):
    driven = drive()
    columns = {"voltage_v": np.full(driven.time_s.size, 400.0), "current_a": -driven.power_w / 400.0}
    (text,) = texts(read(plain_csv(driven, **columns)), NoteKind.SUSPECT)
    assert text.endswith("whose sign is the other; power counts")


def test_drive_that_fills_the_battery_is_suspect(read):
    driven = drive()
    recording = read(
        plain_csv(driven, speed_kmh=np.full(driven.time_s.size, 50.0), power_w=-1000.0 - 0.01 * driven.time_s)
    )
    assert texts(recording, NoteKind.SUSPECT) == ["-0.22 kWh over 11.1 km: a long descent, or the sign is wrong"]


# clocks


@pytest.mark.parametrize("lag_s", [-1.2, 0.8, 3.0])
def test_lag_of_power_is_found_and_removed(read, lag_s):
    driven = drive(step_s=0.2)
    recording = read(plain_csv(delayed(driven, lag_s)))
    (text,) = texts(recording, NoteKind.LAG)
    assert text.startswith(f"moved by {-lag_s:+.1f}")
    assert abs(power_lag_s(recording)) < 0.1
    true_w = np.interp(recording.time_s, driven.time_s, driven.power_w)
    assert float(np.sqrt(np.mean((recording.power_w - true_w) ** 2))) < 0.05 * float(np.std(driven.power_w))


def test_lag_below_a_third_of_a_second_is_left_as_it_is(read):
    driven = drive(step_s=0.2)
    recording = read(plain_csv(delayed(driven, 0.2)))
    assert texts(recording, NoteKind.LAG) == []
    assert recording.time_s.size == driven.time_s.size


def test_no_lag_is_told_from_power_that_does_not_follow_the_speed(read):
    driven = drive(step_s=0.2)
    noise = np.random.default_rng(3).normal(5000.0, 5000.0, driven.time_s.size)
    assert power_lag_s(read(plain_csv(driven, power_w=noise + 0.05 * driven.power_w))) is None


def test_lag_is_not_drawn_over_a_gap(read):
    driven = delayed(drive(step_s=0.2), 1.0)
    keep = (driven.time_s < 305.0) | (driven.time_s > 425.0)
    lines = plain_csv(driven).splitlines()
    kept = [lines[0], *(line for line, good in zip(lines[1:], keep, strict=True) if good)]
    recording = read("\n".join(kept))
    ((begin, end),) = recording.gaps
    assert begin == pytest.approx(304.0, abs=0.5)
    assert end == pytest.approx(425.2)
    assert begin in recording.time_s


def test_date_times_are_seconds_since_1970(read):
    driven = drive()
    start = np.datetime64("2024-03-31T00:58:20")
    stamps = [f"{start + np.timedelta64(int(time), 's')}+01:00" for time in driven.time_s]
    for k in range(200, len(stamps)):  # the zone changes on the way, an hour later on the clock
        stamps[k] = f"{start + np.timedelta64(int(driven.time_s[k]) + 3600, 's')}+02:00"
    recording = read(plain_csv(driven, time_s=stamps))
    # 2024-03-31T00:58:20+01:00 is 23:58:20 of the day before in UTC
    assert recording.time_s - 1_711_843_100.0 == pytest.approx(driven.time_s)
    assert recording.gaps == ()
    assert texts(recording, NoteKind.READ) == ["seconds, from date and time"]


def test_clock_that_is_put_forward_is_named(read):
    driven = drive()
    start = np.datetime64("2024-03-31T01:58:20")
    stamps = [str(start + np.timedelta64(int(time) + 3600 * (time >= 100.0), "s")) for time in driven.time_s]
    (text,) = texts(read(plain_csv(driven, time_s=stamps)), NoteKind.GAP)
    assert text.endswith("an hour may be a clock that was put forward")


@pytest.mark.parametrize(
    ("stamp", "found"),
    [
        ("2024-01-01T00:00:00", "row 6: time_s is 2024-01-01T00:00:00, allowed: at least that of the row before"),
        ("2024-01-01T00:00:09Z", "row 6: time_s is 2024-01-01T00:00:09Z, allowed: a time zone in all rows, or in none"),
        ("soon", "row 6: time_s is soon, allowed: a date and time as in the rows before"),
    ],
)
def test_bad_date_time_is_told_by_its_row(read, stamp, found):
    driven = drive(60.0)
    stamps = [str(np.datetime64("2024-01-01T00:00:00") + np.timedelta64(int(time), "s")) for time in driven.time_s]
    stamps[4] = stamp
    with pytest.raises(RecordingError, match=found):
        read(plain_csv(driven, time_s=stamps))


@pytest.mark.parametrize(("per_s", "name"), [(10**3, "milli"), (10**6, "micro"), (10**9, "nano")])
def test_parts_of_seconds_since_1970_are_read_and_told(read, per_s, name):
    driven = drive()
    stamps = [f"{1_700_000_000 * per_s + per_s * int(time)}" for time in driven.time_s]
    recording = read(plain_csv(driven, time_s=stamps))
    assert recording.time_s == pytest.approx(1_700_000_000.0 + driven.time_s)
    assert f"seconds, from {name}seconds since 1970" in texts(recording, NoteKind.READ)


def test_milliseconds_at_a_hundred_samples_a_second_are_refused(read):
    driven = drive(200.0, step_s=0.01)
    found = r"time is too slow: the speed changes by 20 m/s, never faster than 0.002 m/s², allowed: seconds; divide"
    with pytest.raises(RecordingError, match=found):
        read(plain_csv(driven, time_s=1000.0 * driven.time_s))


def test_two_minutes_missing_are_a_gap_without_energy_or_way(read):
    driven = drive()
    lines = plain_csv(driven).splitlines()
    recording = read("\n".join(lines[:301] + lines[421:]))
    assert recording.gaps == ((299.0, 420.0),)
    parts = (slice(0, 300), slice(420, None))
    for measured, values in ((recording.energy_j(), driven.power_w), (recording.distance_m(), driven.speed_mps)):
        assert measured == pytest.approx(
            sum(np.trapezoid(values[part], driven.time_s[part]) for part in parts), rel=1e-6
        )
    (text,) = texts(recording, NoteKind.GAP)
    assert text == "gaps: 1, the longest 121.0 s after 299.0 s; their energy is not counted"


def test_steps_with_a_gap_in_them_are_told(read):
    lines = plain_csv(drive()).splitlines()
    recording = read("\n".join(lines[:301] + lines[421:501] + lines[621:]))
    time_s = np.array([0.0, 298.0, 299.0, 300.0, 420.0, 430.0, 499.0, 499.5, 620.0, 700.0])
    assert recording.gap_steps(time_s).tolist() == [False, False, True, True, False, False, True, True, False]


# channels


def test_one_sample_of_no_speed_on_the_motorway_is_bridged(read):
    driven = drive()
    speed = driven.speed_mps.copy()
    assert speed[35] == speed[36] == 20.0
    speed[35] = 0.0
    recording = read(plain_csv(driven, speed_kmh=3.6 * speed))
    assert recording.speed_mps[35] == pytest.approx(20.0)
    assert texts(recording, NoteKind.REPAIRED) == ["dropouts to 0 bridged: 1 samples, the first at 35.0 s"]


def test_spike_of_height_is_taken_out_and_a_step_kept(read):
    driven = drive()
    height = np.full(driven.time_s.size, 500.25) + np.where(driven.time_s > 600.0, 20.0, 0.0)
    height[200] = height[201] = 4000.0
    recording = read(plain_csv(driven, elevation_m=height))
    assert np.flatnonzero(np.isnan(recording.elevation_m)).tolist() == [200, 201]
    assert recording.elevation_m[601] == pytest.approx(520.25)
    assert texts(recording, NoteKind.REPAIRED) == ["spikes taken out: 2 samples, the first 4000 m at 200.0 s"]
    assert recording.profile().elevation_m.max() < 521.0


def test_height_in_whole_metres_is_noted_also_between_them(read):
    driven = drive()
    rise = 500.0 + driven.time_s / 70.0
    whole = [f"{value:.0f}" for value in np.floor(rise)]
    lines = np.interp(np.arange(driven.time_s.size), np.arange(0, driven.time_s.size, 25), np.floor(rise[::25]))
    for column, noted in (
        (whole, True),
        (np.round(lines, 2), True),
        (np.round(rise + 0.013 * driven.time_s % 0.7, 2), False),
    ):
        found = [note for note in read(plain_csv(driven, elevation_m=column)).notes if note.channel == "elevation_m"]
        assert any("whole metres" in note.text for note in found) == noted


def test_height_known_on_less_than_half_of_the_way_is_none(read):
    driven = drive()
    way_m = np.concatenate(([0.0], np.cumsum(0.5 * (driven.speed_mps[1:] + driven.speed_mps[:-1]))))
    rise = 500.0 + 0.01 * way_m
    for known_frac, kept in ((0.4, False), (0.6, True)):
        column = [f"{h:.2f}" if x <= known_frac * way_m[-1] else "" for h, x in zip(rise, way_m, strict=True)]
        recording = read(plain_csv(driven, elevation_m=column))
        assert (recording.elevation_m is not None) == kept
        assert ("taken out: known on 40% of 9.0 km only" in texts(recording, NoteKind.MISSING)) != kept


def test_height_known_now_and_then_is_kept(read):
    driven = drive()
    column = [f"{500.0 + 0.1 * k:.1f}" if k % 45 == 0 else "" for k in range(driven.time_s.size)]
    assert read(plain_csv(driven, elevation_m=column)).elevation_m is not None


def test_height_that_changes_at_standstill_is_late(read):
    driven = drive()
    way_m = np.concatenate(([0.0], np.cumsum(0.5 * (driven.speed_mps[1:] + driven.speed_mps[:-1]))))
    late_m = 500.03 + 0.02 * np.interp(driven.time_s - 8.0, driven.time_s, way_m)
    found = read(plain_csv(driven, elevation_m=late_m)).notes
    (text,) = [note.text for note in found if note.kind is NoteKind.LAG]
    # a stop ends 10 s of braking from 20 m/s, of which the last 8 s come late: 64 m of way, 1.28 m of height, ten times
    assert text.startswith("changes by 13 of ")
    assert text.endswith("s after stopping: late, or drifting")


def test_charging_at_standstill_is_cut_out(read):
    driven = drive()
    lines = plain_csv(driven).splitlines()
    charge = [f"{480.0 + k},0,-11000" for k in range(600)]
    later = [",".join((f"{float(line.split(',')[0]) + 600.0:g}", *line.split(",")[1:])) for line in lines[481:]]
    recording = read("\n".join([*lines[:481], *charge, *later]))
    assert recording.gaps == ((479.0, 1080.0),)
    assert recording.energy_j() == pytest.approx(float(np.trapezoid(driven.power_w, driven.time_s)), rel=0.01)
    assert texts(recording, NoteKind.REPAIRED) == [
        "charging cut out from 480.0 s to 1079.0 s, 1.83 kWh, while standing"  # 599 s of 11 kW
    ]


def test_recording_of_charging_alone_is_an_error(read):
    rows = "\n".join(f"{k},0,-11000" for k in range(100))
    with pytest.raises(RecordingError, match=r"charging only \(while standing\), allowed: a drive"):
        read("time_s,speed_kmh,power_w\n" + rows)


def test_samples_ten_seconds_apart_are_noted_as_coarse(read):
    assert "10 s apart as a rule: accelerations" in texts(read(plain_csv(drive(step_s=10.0))), NoteKind.SUSPECT)[0]


# direction


def test_profile_has_the_direction_of_the_positions(read):
    driven = drive()
    heading = read(with_positions(driven)).profile().heading
    assert heading.shape == (799, 2)
    assert heading == pytest.approx(np.tile([1.0, 0.0], (799, 1)))  # eastward, while standing too


def test_profile_takes_the_recorded_heading_first_and_through_north(read):
    driven = drive()
    degrees = np.where(driven.time_s % 2.0 == 0.0, 359.0, 1.0)
    heading = read(with_positions(driven, heading_deg=degrees)).profile().heading
    assert heading == pytest.approx(np.tile([0.0, 1.0], (799, 1)), abs=1e-9)


def test_profile_of_a_car_that_stays_has_no_direction(read):
    driven = drive()
    still = plain_csv(
        driven, lat=driven.lat_deg, lon=np.full(driven.time_s.size, 11.0), speed_kmh=np.zeros(driven.time_s.size)
    )
    assert read(still).profile().heading is None
    assert read(plain_csv(driven)).profile().heading is None


def test_times_that_differ_by_nothing_but_rounding_are_the_same(read):
    driven = drive()
    time_s = driven.time_s.copy()
    time_s[10] = np.nextafter(time_s[9], 10.0)
    stamps = [f"{time!r}" for time in time_s.tolist()]
    recording = read(plain_csv(driven, time_s=stamps))
    assert recording.time_s.size == driven.time_s.size - 1
    assert texts(recording, NoteKind.REPAIRED) == ["rows dropped, whose time the row before has already: 1"]


def test_channel_known_only_while_charging_is_no_channel_of_the_drive(read):
    rows = [f"{k},0,-11000,0.5,500" for k in range(100)]
    rows += [f"{100 + time:g},{3.6 * speed:g},{power:g},," for time, speed, power in zip(
        drive().time_s, drive().speed_mps, drive().power_w, strict=True
    )]  # fmt: skip
    recording = read("time_s,speed_kmh,power_w,soc_frac,elevation_m\n" + "\n".join(rows))
    assert (recording.soc_frac, recording.elevation_m) == (None, None)
    assert texts(recording, NoteKind.MISSING) == ["no value at all"] * 2
    assert recording.profile().elevation_m is None
