"""Logs of Car Scanner: parameters by their names and units, clocks of their own, the sign of current from the drive."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.recordings.reading import NoteKind, RecordingError, read_recording
from diagnosis.recordings.recording import Detail
from tests.diagnosis.recorded_drives import drive

START_S = 43_200.0


def readings(driven, sign=1.0):
    """Time, parameter, value and unit as the logger reads them in turn: each at its own time."""
    found = []
    for k, time in enumerate(driven.time_s):
        current = sign * driven.power_w[k] / 400.0
        found.append((time, "Vehicle speed", f"{3.6 * driven.speed_mps[k]:.4f}", "km/h"))
        found.append((time + 0.01, "[BMS] HV battery current", f"{current:.5f}", "A"))
        found.append((time + 0.02, "HV battery voltage", "400", "V"))
        found.append((time + 0.03, "Engine RPM", "0", "rpm"))
        if k % 20 == 0:
            found.append((time + 0.04, "State of charge", f"{80 - 0.01 * k:.2f}", "%"))
            found.append((time + 0.05, "Ambient air temperature", "41", "℉"))
            found.append((time + 0.06, "HV battery temperature sensor 1", "12", "℃"))
    return found


def long_file(path, rows, start_s=START_S):
    lines = ['"SECONDS";"PID";"VALUE";"UNITS";"LATITUDE";"LONGTITUDE";']
    lines += [
        f'"{(start_s + time) % 86400.0:.3f}";"{pid}";"{value}";"{unit}";"0";"0";' for time, pid, value, unit in rows
    ]
    path.write_bytes("\ufeff".encode() + ("\r\n".join(lines) + "\r\n").encode())
    return path


def texts(recording, kind):
    return [note.text for note in recording.notes if note.kind is kind]


def test_long_log_is_brought_to_the_clock_of_the_speed(tmp_path):
    driven = drive()
    recording = read_recording(long_file(tmp_path / "2026-05-19 21-16-39.csv", readings(driven)))
    assert recording.id == "2026-05-19 21-16-39"
    # no current is known before 0.01 s
    assert recording.time_s == pytest.approx(START_S + driven.time_s[1:])
    assert recording.speed_mps == pytest.approx(driven.speed_mps[1:], abs=1e-4)
    # the current is read 10 ms later, so the power at the speed's time lies 1 % on the way back to the second before
    expected = driven.power_w[1:] + 0.01 * (driven.power_w[:-1] - driven.power_w[1:])
    assert recording.power_w == pytest.approx(expected, abs=0.1)
    assert recording.soc_frac[29] == pytest.approx(0.798)  # at 30 s that of 20.04 s
    assert recording.ambient_k[29] == pytest.approx(278.15)
    assert recording.battery_k[29] == pytest.approx(285.15)
    assert recording.latitude_deg is None


def test_the_charge_on_the_display_is_a_channel_of_its_own_and_stands_in_for_the_other(tmp_path):
    driven = drive()
    shown = [(time, "SOC (display)", f"{90 - 0.02 * time:.2f}", "%") for time in driven.time_s[::20]]
    rows = sorted([*readings(driven), *shown])
    recording = read_recording(long_file(tmp_path / "a.csv", rows))
    assert recording.soc_frac[29] == pytest.approx(0.798)
    assert recording.displayed_frac[29] == pytest.approx(0.896)
    alone = read_recording(long_file(tmp_path / "b.csv", [row for row in rows if row[1] != "State of charge"]))
    assert alone.soc_frac == pytest.approx(alone.displayed_frac)


def test_notes_tell_which_parameters_were_read_and_which_not(tmp_path):
    recording = read_recording(long_file(tmp_path / "a.csv", readings(drive())))
    read = texts(recording, NoteKind.READ)
    assert "from 'Vehicle speed' [km/h], 800 values 1 s apart" in read
    assert "from '[BMS] HV battery current' [A], 800 values 1 s apart" in read
    assert texts(recording, NoteKind.IGNORED) == ["PIDs not used: Engine RPM [rpm]"]


def test_current_that_is_negative_while_accelerating_is_turned(tmp_path):
    driven = drive()
    turned = read_recording(long_file(tmp_path / "a.csv", readings(driven, sign=-1.0)))
    right = read_recording(long_file(tmp_path / "b.csv", readings(driven)))
    assert np.array_equal(turned.power_w, right.power_w)
    assert np.array_equal(turned.current_a, right.current_a)
    assert [text[:11] for text in texts(turned, NoteKind.REPAIRED)] == ["1 of 800 sa", "sign turned"]
    assert [text[:11] for text in texts(right, NoteKind.REPAIRED)] == ["1 of 800 sa"]


def test_log_past_midnight_goes_on(tmp_path):
    driven = drive()
    recording = read_recording(long_file(tmp_path / "a.csv", readings(driven), start_s=86_000.0))
    assert recording.time_s[-1] - recording.time_s[0] == pytest.approx(798.0)


def test_parameters_are_hidden_by_their_name(tmp_path):
    recording = read_recording(long_file(tmp_path / "a.csv", readings(drive())), hidden=["ambient*", "state of*"])
    assert recording.ambient_k is None
    assert recording.soc_frac is None
    assert recording.battery_k is not None


def test_second_speed_is_left_aside_and_compared(tmp_path):
    driven = drive()
    rows = readings(driven)
    rows += [
        (time, "Speed (GPS)", f"{2.0 * speed:.3f}", "mph")
        for time, speed in zip(driven.time_s, driven.speed_mps, strict=True)
    ]
    rows.sort(key=lambda row: row[0])
    recording = read_recording(long_file(tmp_path / "a.csv", rows))
    (text,) = [note.text for note in recording.notes if note.channel == "speed_mps" and "left aside" in note.text]
    assert text.startswith("Speed (GPS) left aside for Vehicle speed")
    assert recording.speed_mps.max() == pytest.approx(20.0)


def test_battery_of_the_lights_is_not_the_one_that_drives(tmp_path):
    rows = [(time, pid.replace("HV battery voltage", "Battery voltage"), "12.8" if unit == "V" else value, unit)
            for time, pid, value, unit in readings(drive()) if "charge" not in pid.lower()]  # fmt: skip
    with pytest.raises(RecordingError, match="power_w is missing among Vehicle speed, "):
        read_recording(long_file(tmp_path / "a.csv", rows))


def test_unit_that_is_not_known_is_named(tmp_path):
    rows = [
        (time, pid, value, "R" if pid.startswith("Ambient") else unit) for time, pid, value, unit in readings(drive())
    ]
    recording = read_recording(long_file(tmp_path / "a.csv", rows))
    assert recording.ambient_k is None
    (text,) = texts(recording, NoteKind.IGNORED)
    assert "Ambient air temperature [R] (unit not one of °c, °f, k)" in text


def test_bad_value_is_told_by_row_and_parameter(tmp_path):
    rows = readings(drive())
    rows[7] = (rows[7][0], rows[7][1], "12,5", rows[7][3])
    assert rows[7][1] == "Vehicle speed"
    with pytest.raises(
        RecordingError, match="row 9: Vehicle speed is 12,5, allowed: a number from 0 to 200, with a decimal"
    ):
        read_recording(long_file(tmp_path / "a.csv", rows))


def test_shuffled_readings_are_an_error(tmp_path):
    rows = readings(drive())
    rows[10], rows[40] = rows[40], rows[10]
    with pytest.raises(RecordingError, match=r"SECONDS is .*, allowed: at least that of the row before"):
        read_recording(long_file(tmp_path / "a.csv", rows))


def wide_file(path, driven):
    lines = [
        'time,"Vehicle speed (km/h)","[BMS] HV Battery Current (A)","HV Battery voltage (V)","Latitude","Longtitude"'
    ]
    for k, time in enumerate(driven.time_s):
        seconds = 86_000.0 + time
        clock = f"{int(seconds // 3600) % 24:02d}:{int(seconds // 60) % 60:02d}:{seconds % 60:06.3f}"
        lines.append(f"{clock},{3.6 * driven.speed_mps[k]:.4f},,,{driven.lat_deg[k]:.7f},{driven.lon_deg[k]:.7f}")
        lines.append(f"{clock},,{driven.power_w[k] / 400.0:.5f},400,,")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_wide_log_is_read_past_midnight_with_its_positions(tmp_path):
    driven = drive()
    recording = read_recording(wide_file(tmp_path / "a.csv", driven))
    assert recording.time_s - recording.time_s[0] == pytest.approx(driven.time_s)
    assert recording.power_w == pytest.approx(driven.power_w, abs=1.0)
    assert recording.longitude_deg == pytest.approx(driven.lon_deg, abs=1e-6)
    assert [note.text for note in recording.notes if note.kind is NoteKind.CHECKED] == [
        "by the positions 1.00 times as fast, in 60 stretches of 10 s"
    ]


def test_an_odometer_and_cumulative_energies_are_counters_and_stand_in_for_power(tmp_path):
    driven = drive(1600.0)
    step_s = np.diff(driven.time_s)
    rows = [
        (time, "Vehicle speed", f"{3.6 * v:.3f}", "km/h")
        for time, v in zip(driven.time_s, driven.speed_mps, strict=True)
    ]
    sums = {}
    for name, values in (
        ("Odometer", driven.speed_mps / 1609.344),
        ("Cumulative Energy Discharged", np.maximum(driven.power_w, 0.0) / 3.6e6),
        ("Cumulative Energy Charged", np.maximum(-driven.power_w, 0.0) / 3.6e6),
    ):
        sums[name] = np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * step_s)))
    for k, time in enumerate(driven.time_s):
        rows.append((time + 0.1, "Odometer", f"{np.floor(10.0 * sums['Odometer'][k]) / 10.0:.1f}", "mi"))
        for name in ("Cumulative Energy Discharged", "Cumulative Energy Charged"):
            rows.append((time + 0.2, f"[BMS] {name}", f"{np.floor(10.0 * (50.0 + sums[name][k])) / 10.0:.1f}", "kWh"))
    recording = read_recording(long_file(tmp_path / "a.csv", sorted(rows)))
    assert recording.detail is Detail.COUNTER
    used_kwh = sums["Cumulative Energy Discharged"][-1] - sums["Cumulative Energy Charged"][-1]
    assert recording.energy_j() / 3.6e6 == pytest.approx(used_kwh, rel=0.15)  # in steps of 0.1 kWh
    assert [note.kind for note in recording.notes if "by the odometer" in note.text] == [NoteKind.CHECKED]


@pytest.mark.parametrize(
    ("speed", "power", "factor_v", "factor_p"),
    [
        ("Vehicle speed (kn)", "HV battery power (hp)", 1.0 / 0.514444444, 1.0 / 745.699872),
        ("Vehicle speed (MPH)", "HV battery power [Watt]", 1.0 / 0.44704, 1.0),
        ("Vehicle speed / kph", "HV battery power / PS", 3.6, 1.0 / 735.49875),
        ("Vehicle speed, ft/s", "HV battery power, KW", 1.0 / 0.3048, 0.001),
        ("Speed in miles/hour", "Battery power in kW", 1.0 / 0.44704, 0.001),
        ("vehicle_speed_kmh", "hv_battery_power_kw", 3.6, 0.001),
        ("Fahrzeuggeschwindigkeit [km/h]", "HV-Batterieleistung [kW]", 3.6, 0.001),
        ("Vitesse du v\u00e9hicule (km/h)", "Puissance de la batterie (kW)", 3.6, 0.001),
        ("Velocidad del veh\u00edculo (km/h)", "Potencia de la bater\u00eda (kW)", 3.6, 0.001),
        ("Velocit\u00e0 veicolo (km/h)", "Potenza della batteria (kW)", 3.6, 0.001),
        ("Voertuigsnelheid (km/u)", "Accuvermogen (W)", 3.6, 1.0),
        (
            "\u0421\u043a\u043e\u0440\u043e\u0441\u0442\u044c (\u043a\u043c/\u0447)",
            "\u041c\u043e\u0449\u043d\u043e\u0441\u0442\u044c \u0431\u0430\u0442\u0430\u0440\u0435\u0438"
            " (\u043a\u0412\u0442)",
            3.6,
            0.001,
        ),
    ],
)
def test_names_and_units_are_known_in_the_ways_that_loggers_write_them(read, speed, power, factor_v, factor_p):
    driven = drive()
    rows = zip(driven.time_s, factor_v * driven.speed_mps, factor_p * driven.power_w, strict=True)
    recording = read("\n".join([f"time;{speed};{power}", *(f"{t};{v:.6f};{p:.9f}" for t, v, p in rows)]))
    assert recording.speed_mps == pytest.approx(driven.speed_mps, abs=1e-4)
    assert recording.power_w == pytest.approx(driven.power_w, abs=0.01)


@pytest.mark.parametrize(
    "unit", ["\u00b0C", "\u00ba C", "\u2103", "?C", "\u00c2\u00b0C", "deg C", "Celsius", "degF", "K"]
)
def test_degrees_are_known_however_their_sign_came_through(tmp_path, unit):
    value = {"degF": "41", "K": "278.15"}.get(unit, "5")
    rows = [
        (time, pid, value, unit) if pid.startswith("Ambient") else (time, pid, shown, own)
        for time, pid, shown, own in readings(drive())
    ]
    recording = read_recording(long_file(tmp_path / "a.csv", rows))
    assert float(recording.ambient_k[-1]) == pytest.approx(278.15)
