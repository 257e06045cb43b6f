"""Reading recorded drives: units, signs, what is repaired and noted."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.recordings.reading import NoteKind, Recording, RecordingError, read_recording
from diagnosis.recordings.soundness.repairs import without_impossible
from tests.diagnosis.recording_rows import SAMPLES, i3_rows, plain_rows, with_column

SHARED = Path(__file__).resolve().parents[4] / "shared/data/recordings/bmw-i3"


def notes(recording: Recording, kind: NoteKind) -> list[tuple[str, str]]:
    return [(note.channel, note.text) for note in recording.notes if note.kind is kind]


# channels, units and signs


@pytest.mark.parametrize("name", ["TripX01.csv.gz", "TripX01.csv"])
def test_i3_file_is_read_into_si_units_with_discharge_positive(i3_file, name):
    recording = read_recording(i3_file(name=name))
    assert recording.id == "TripX01"
    assert recording.time_s.size == SAMPLES
    assert recording.speed_mps[50] == pytest.approx(80.0 / 3.6)
    # sample 25: −65.04 A · 380 V
    assert recording.current_a[25] == pytest.approx(65.04)
    assert recording.power_w[25] == pytest.approx(65.04 * 380.0)
    assert recording.soc_frac[100] == pytest.approx(0.78)
    assert recording.heater_w[0] == 1500.0
    assert recording.aircon_w[0] == 0.0
    assert recording.ambient_k[0] == pytest.approx(270.65)
    assert recording.battery_k[0] == pytest.approx(285.15)
    assert recording.elevation_m[200] == pytest.approx(502.0)
    assert recording.latitude_deg is None


def test_columns_that_are_there_twice_or_not_used_are_noted(i3_file):
    found = notes(read_recording(i3_file()), NoteKind.IGNORED)
    assert found[0] == ("", "column 'Temperature Vent right [°C]' is there 2 times")
    assert "Regenerative Braking Signal" in found[1][1]


def test_same_i3_file_in_utf_8_is_the_same(i3_file):
    path = i3_file(name="TripX01.csv")
    again = path.with_name("TripX01-utf8.csv")
    again.write_text(path.read_bytes().decode("latin-1"), encoding="utf-8")
    assert np.array_equal(read_recording(path).ambient_k, read_recording(again).ambient_k)


def test_plain_file_takes_every_optional_column(plain_file):
    columns = {
        "elevation_m": "510.5",
        "lat": "48.1",
        "lon": "11.6",
        "heading_deg": "90",
        "soc_frac": "0.75",
        "ambient_c": "-10",
        "battery_c": "5",
        "heater_w": "0",
        "aircon_w": "0",
        "wind_speed_mps": "3",
        "wind_from_deg": "180",
        "wet": "1",
        "payload_kg": "70",
    }
    rows = [[*row, *columns.values()] for row in plain_rows()]
    recording = read_recording(plain_file(rows, ",".join(["time_s", "speed_kmh", "power_w", *columns])))
    assert recording.latitude_deg[0] == 48.1
    assert recording.longitude_deg[0] == 11.6
    assert recording.heading_rad[0] == pytest.approx(np.pi / 2.0)
    assert recording.wind_from_rad[0] == pytest.approx(np.pi)
    assert recording.ambient_k[0] == pytest.approx(263.15)
    assert (recording.soc_frac[0], recording.wet_frac[0], recording.payload_kg[0]) == (0.75, 1.0, 70.0)
    assert recording.wind_speed_mps[0] == 3.0
    assert recording.id == "drive"


def test_power_is_voltage_times_current_where_it_has_no_column(plain_file):
    rows = [[time, speed, "400", f"{float(power) / 400.0:.6f}"] for time, speed, power in plain_rows()]
    recording = read_recording(plain_file(rows, "time_s,speed_kmh,voltage_v,current_a"))
    assert recording.power_w == pytest.approx([float(row[2]) for row in plain_rows()], abs=1e-3)


def test_voltage_may_have_holes_where_power_is_given(plain_file):
    header, rows = with_column(plain_rows(), "voltage_v", ["", *["400"] * (SAMPLES - 1)])
    recording = read_recording(plain_file(rows, header))
    assert np.isnan(recording.voltage_v[0])
    assert recording.power_w[0] == float(plain_rows()[0][2])


def test_energy_and_distance_are_integrals(plain_file):
    # a constant 36 km/h and 3600 W over 599 s, by the trapezoidal rule
    recording = read_recording(plain_file([[f"{k}", "36", "3600"] for k in range(SAMPLES)]))
    assert recording.energy_j() == pytest.approx(3600.0 * 599.0)
    assert recording.distance_m() == pytest.approx(10.0 * 599.0)


def test_hidden_columns_are_not_read_whatever_their_case(i3_file):
    rows = i3_rows()
    rows[5][8] = "broken"
    recording = read_recording(i3_file(rows), hidden=["heating*", " AirCon Power*"])
    assert recording.heater_w is None
    assert recording.aircon_w is None
    assert recording.power_w.size == SAMPLES


def test_hiding_a_column_that_is_needed_is_an_error(plain_file):
    with pytest.raises(RecordingError, match="power_w is missing, allowed: power_w, or voltage_v and current_a"):
        read_recording(plain_file(), hidden=["power*"])


def test_i3_file_without_current_names_the_column(i3_file):
    with pytest.raises(RecordingError, match=r"Battery Current \[A\] is missing, allowed: a column of this name"):
        read_recording(i3_file(), hidden=["*current*"])


def test_profile_for_replay_keeps_speed_height_and_the_end(i3_file):
    recording = read_recording(i3_file())
    profile = recording.profile()
    assert profile.time_s[1] - profile.time_s[0] == 1.0
    assert profile.time_s[-1] == recording.time_s[-1]
    assert profile.speed_mps[30] == recording.speed_mps[300]
    assert profile.elevation_m[30] == pytest.approx(recording.elevation_m[300])
    assert read_recording(i3_file(), hidden=["Elevation*"]).profile().elevation_m is None


# what is repaired and noted


def test_end_that_repeats_one_sample_is_cut_off(i3_file):
    rows = i3_rows()
    frozen = [[f"{60.0 + 0.1 * k:.1f}", *rows[-1][1:7], "", *rows[-1][8:]] for k in range(400)]
    recording = read_recording(i3_file([*rows, *frozen]))
    assert recording.time_s[-1] == pytest.approx(59.9)
    assert not np.isnan(recording.soc_frac).any()
    ((channel, text),) = notes(recording, NoteKind.REPAIRED)
    assert channel == ""
    assert text.startswith("cut off at 59.9 s: speed (0.08 km/h)")
    assert "for the 40.0 s up to the end" in text


def test_parked_car_that_takes_nothing_is_not_cut_off(plain_file):
    rows = [*plain_rows(), *([f"{600 + k}", "0", "0"] for k in range(200))]
    recording = read_recording(plain_file(rows))
    assert recording.time_s[-1] == 799.0
    assert notes(recording, NoteKind.REPAIRED) == []


def test_stretch_that_repeats_one_sample_in_the_middle_is_noted_and_kept(plain_file):
    rows = plain_rows()
    for k in range(200, 320):
        rows[k][1:] = rows[200][1:]
    recording = read_recording(plain_file(rows))
    assert recording.time_s.size == SAMPLES
    assert notes(recording, NoteKind.FROZEN) == [("", "speed and power stay the same from 200.0 s to 319.0 s")]


def test_heater_beyond_the_battery_at_standstill_is_taken_out(i3_file):
    rows = i3_rows(1200)
    for row in rows[:600]:
        row[1], row[5], row[8] = "0", f"{-2.0 - 0.01 * (int(float(row[0]) * 10) % 5):.2f}", "5.3"  # 760 W in all
    recording = read_recording(i3_file(rows))
    assert recording.heater_w is None
    assert recording.aircon_w is not None
    ((channel, text),) = notes(recording, NoteKind.STUCK)
    assert channel == "heater_w"
    assert text.startswith("taken out: at standstill above the battery's whole power for 60 of 61 s, on average 5262 W")


def test_consumers_that_only_together_exceed_the_battery_are_all_taken_out():
    time = np.arange(0.0, 400.0)
    speed = np.where(time < 120.0, 0.0, 12.0)
    plain = Recording("T", time, speed, np.where(speed > 0.0, 6000.0, 900.0))
    both = replace(plain, heater_w=np.full(400, 700.0), aircon_w=np.full(400, 800.0))
    repaired = without_impossible(both)
    assert repaired.heater_w is None
    assert repaired.aircon_w is None
    assert all("together" in note.text for note in repaired.notes)
    mended = without_impossible(replace(both, aircon_w=np.full(400, 300.0)))
    assert mended.heater_w is not None


def test_missing_samples_are_counted_and_the_end_named(i3_file):
    rows = i3_rows()
    for row in rows[550:]:
        row[7] = ""
    recording = read_recording(i3_file(rows))
    assert int(np.isnan(recording.soc_frac).sum()) == 50
    text = "50 of 600 samples missing, among them all after 54.9 s"
    assert notes(recording, NoteKind.MISSING) == [("soc_frac", text)]


def test_column_without_any_value_is_no_channel(plain_file):
    header, rows = with_column(plain_rows(), "soc_frac", [""] * SAMPLES)
    recording = read_recording(plain_file(rows, header))
    assert recording.soc_frac is None
    assert notes(recording, NoteKind.MISSING) == [("soc_frac", "no value at all")]


def test_gap_is_noted_with_its_length_and_place(plain_file):
    rows = plain_rows()
    recording = read_recording(plain_file(rows[:300] + rows[345:]))
    assert notes(recording, NoteKind.GAP) == [
        ("time_s", "gaps: 1, the longest 46.0 s after 299.0 s; their energy is not counted")
    ]


def test_jumps_of_speed_height_and_charge_are_noted(plain_file):
    rows = plain_rows()
    rows[100][1] = "90"
    values = ["100"] * 300 + ["130"] * 300
    header, rows = with_column(rows, "elevation_m", values)
    found = dict(notes(read_recording(plain_file(rows, header)), NoteKind.JUMP))
    assert found["speed_mps"].startswith("jumps: 2, the largest 24.98 m/s at 99.0 s")  # up and down again
    assert found["elevation_m"] == "jumps: 1, the largest 30.00 m at 299.0 s"


def test_height_that_never_changes_over_a_long_way_is_none(plain_file):
    header, rows = with_column(plain_rows(), "elevation_m", ["500"] * SAMPLES)
    recording = read_recording(plain_file(rows, header))
    assert recording.elevation_m is None
    text = "taken out: always 500 m over 6.7 km: a flat road or a stuck sensor"
    assert notes(recording, NoteKind.STUCK) == [("elevation_m", text)]


def test_rows_with_the_time_of_the_row_before_are_dropped(plain_file):
    rows = plain_rows()
    rows[10][0] = rows[9][0]
    recording = read_recording(plain_file(rows))
    assert recording.time_s.size == SAMPLES - 1
    found = notes(recording, NoteKind.REPAIRED)
    assert found == [("time_s", "rows dropped, whose time the row before has already: 1")]


def test_charge_and_power_together_tell_the_capacity(i3_file):
    recording = read_recording(i3_file())
    ((channel, text),) = notes(recording, NoteKind.CHECKED)
    kwh = recording.energy_j() / 3.6e6
    assert channel == "soc_frac"
    assert text == f"falls by 12.0% while the battery gives {kwh:.2f} kWh: 100 % would be {kwh / 0.1198:.1f} kWh"


# the published files


@pytest.mark.shared_data
def test_published_files_are_read_and_their_traps_found():
    if not SHARED.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no recordings in {SHARED}: CI must have them")
        pytest.skip("no recordings beside the repository (shared/data/recordings)")
    stuck = read_recording(SHARED / "TripA06.csv.gz")
    assert stuck.heater_w is None
    assert stuck.energy_j() / 3.6e6 == pytest.approx(5.02, abs=0.005)
    assert stuck.distance_m() / 1000.0 == pytest.approx(46.0, abs=0.05)
    cold = read_recording(SHARED / "TripB37.csv.gz")
    assert cold.heater_w is not None
    assert np.median(cold.ambient_k) == pytest.approx(269.65)
    ends = "1 of 14173 samples missing, among them all after 1417.1 s"
    assert sorted(notes(cold, NoteKind.MISSING)) == [("displayed_frac", ends), ("soc_frac", ends)]
    shortened = read_recording(SHARED / "TripB34.csv.gz")
    assert shortened.time_s[-1] == pytest.approx(293.0)
    assert [channel for channel, _ in notes(shortened, NoteKind.REPAIRED)] == [""]
    for recording in (stuck, cold):  # 22 kWh gross, as the maker says
        ((_, text),) = notes(recording, NoteKind.CHECKED)
        assert 20.0 < float(text.rsplit(" ", 2)[1]) < 25.0
