"""Recordings in ABRP's names, in Parquet, and as JSON lines: the same drive whichever way it was written."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from diagnosis.recordings.reading import NoteKind, RecordingError, read_recording
from tests.diagnosis.recorded_drives import drive, plain_csv

UTC = 1_700_000_000.0


def abrp_rows(driven):
    """What a car sends to the telemetry API, a dictionary a sample."""
    return [
        {
            "utc": UTC + time,
            "speed": 3.6 * speed,
            "power": power / 1000.0,
            "voltage": 400.0,
            "current": power / 400.0,
            "soc": 80.0 - 0.01 * k,
            "lat": lat,
            "lon": lon,
            "elevation": 500.5 + 0.01 * k,
            "heading": 90.0,
            "ext_temp": 12.5,
            "batt_temp": 20.0,
            "hvac_power": 0.4,
            "is_charging": False,
            "car_model": "made:up:20",
        }
        for k, (time, speed, power, lat, lon) in enumerate(
            zip(driven.time_s, driven.speed_mps, driven.power_w, driven.lat_deg, driven.lon_deg, strict=True)
        )
    ]


def written_as_csv(path, rows):
    lines = [",".join(rows[0]), *(",".join("" if cell is None else str(cell) for cell in row.values()) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def written_as_json(path, rows, wrap=lambda row: row):
    content = "\n".join(json.dumps(wrap(row)) for row in rows).encode()
    path.write_bytes(gzip.compress(content) if path.name.endswith(".gz") else content)
    return path


def texts(recording, kind):
    return [note.text for note in recording.notes if note.kind is kind]


# ABRP telemetry


def test_abrp_json_lines_are_read_into_si_units(tmp_path):
    driven = drive()
    recording = read_recording(written_as_json(tmp_path / "tour.jsonl.gz", abrp_rows(driven)))
    assert recording.id == "tour"
    assert recording.time_s - UTC == pytest.approx(driven.time_s)
    assert recording.speed_mps == pytest.approx(driven.speed_mps)
    assert recording.power_w == pytest.approx(driven.power_w)
    assert recording.soc_frac[100] == pytest.approx(0.79)
    assert recording.ambient_k[0] == pytest.approx(285.65)
    assert recording.battery_k[0] == pytest.approx(293.15)
    assert recording.hvac_w[0] == pytest.approx(400.0)
    assert recording.heading_rad[0] == pytest.approx(np.pi / 2.0)
    assert recording.elevation_m[100] == pytest.approx(501.5)
    assert (recording.heater_w, recording.gaps) == (None, ())
    assert texts(recording, NoteKind.IGNORED) == ["columns not used: car_model"]


def test_abrp_csv_and_the_wrapped_form_are_the_same_as_json_lines(tmp_path):
    rows = abrp_rows(drive())
    first = read_recording(written_as_json(tmp_path / "a.jsonl", rows))
    wrapped = read_recording(written_as_json(tmp_path / "b.jsonl", rows, lambda row: {"token": "x", "tlm": row}))
    as_csv = read_recording(written_as_csv(tmp_path / "c.csv", [row | {"is_charging": 0} for row in rows]))
    for other in (wrapped, as_csv):
        assert np.array_equal(first.power_w, other.power_w)
        assert np.array_equal(first.soc_frac, other.soc_frac)


def test_abrp_values_missing_in_some_rows_are_brought_to_the_clock_of_the_speed(tmp_path):
    rows = abrp_rows(drive())
    for k, row in enumerate(rows):
        if k % 2:  # power every other second, straight in between; charge every tenth, held in between
            row["power"] = None
        if k % 10:
            row["soc"] = None
    recording = read_recording(written_as_json(tmp_path / "a.jsonl", rows))
    assert recording.power_w[11] == pytest.approx(0.5 * (recording.power_w[10] + recording.power_w[12]))
    assert recording.soc_frac[19] == recording.soc_frac[10]
    assert recording.soc_frac[20] != recording.soc_frac[10]
    assert texts(recording, NoteKind.READ) == ["brought to the clock of the speed: power_w, soc_frac"]


def test_stretch_without_power_becomes_a_gap_whose_energy_is_not_made_up(tmp_path):
    driven = drive()
    rows = abrp_rows(driven)
    for row in rows[200:320]:
        row["power"] = row["voltage"] = row["current"] = None
    recording = read_recording(written_as_json(tmp_path / "a.jsonl", rows))
    (gap,) = recording.gaps
    assert (gap[0] - UTC, gap[1] - UTC) == (199.0, 320.0)
    known = np.trapezoid(driven.power_w[:200], driven.time_s[:200]) + np.trapezoid(
        driven.power_w[320:], driven.time_s[320:]
    )
    assert recording.energy_j() == pytest.approx(known)
    assert "120 of 800 samples dropped, at which power is not known within 10 s" in texts(recording, NoteKind.REPAIRED)


def test_charging_that_is_marked_is_cut_out(tmp_path):
    driven = drive()
    rows = abrp_rows(driven)
    for row in rows[300:320]:  # the car stands from 300 s to 320 s
        row |= {"is_charging": True, "power": -7.2, "current": -18.0}
    recording = read_recording(written_as_json(tmp_path / "a.jsonl", rows))
    assert recording.time_s.size == 780
    assert [(begin - UTC, end - UTC) for begin, end in recording.gaps] == [(299.0, 320.0)]
    (text,) = texts(recording, NoteKind.REPAIRED)
    assert text.endswith("0.04 kWh, marked is_charging")  # 19 s of 7.2 kW
    assert recording.power_w.min() > -60_000.0


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("[1, 2]", r"row 2: the row is \[1, 2\]"),
        ("{broken", "row 2: the row is {broken"),
        ("[" * 9999, "row 2: the row is"),
    ],
)
def test_json_line_that_is_no_object_is_an_error(tmp_path, line, found):
    path = tmp_path / "a.jsonl"
    path.write_text('{"utc": 1, "speed": 2, "power": 3}\n' + line + "\n", encoding="utf-8")
    with pytest.raises(RecordingError, match=found):
        read_recording(path)


def test_abrp_cell_out_of_range_is_told_by_its_line(tmp_path):
    rows = abrp_rows(drive())
    rows[7]["speed"] = 280
    with pytest.raises(RecordingError, match="row 8: speed is 280, allowed: a number from 0 to 200"):
        read_recording(written_as_json(tmp_path / "a.jsonl", rows))


def test_abrp_without_power_says_what_is_needed(tmp_path):
    rows = [{name: row[name] for name in ("utc", "speed")} for row in abrp_rows(drive())]
    with pytest.raises(RecordingError, match="power_w is missing, allowed: a power, or voltage and current"):
        read_recording(written_as_json(tmp_path / "a.jsonl", rows))


# Parquet


def parquet_file(path, **columns):
    sink = pa.BufferOutputStream()
    parquet.write_table(pa.table(columns), sink)
    content = sink.getvalue().to_pybytes()
    path.write_bytes(gzip.compress(content) if path.name.endswith(".gz") else content)
    return path


@pytest.mark.parametrize("name", ["tour.parquet", "tour.parquet.gz"])
def test_parquet_is_the_same_as_csv(tmp_path, name):
    driven = drive()
    found = read_recording(
        parquet_file(
            tmp_path / name,
            time_s=driven.time_s,
            speed_kmh=3.6 * driven.speed_mps,
            power_w=driven.power_w.astype(np.float32),
            soc_frac=pa.array([None, *[0.5] * (driven.time_s.size - 1)]),
            wet=np.ones(driven.time_s.size, np.bool_),
            trip=["a"] * driven.time_s.size,
        )
    )
    text = tmp_path / "tour.csv"
    text.write_text(plain_csv(driven), encoding="utf-8")
    plain = read_recording(text)
    assert found.id == plain.id
    assert found.speed_mps == pytest.approx(plain.speed_mps, abs=1e-6)
    assert found.power_w == pytest.approx(plain.power_w, rel=1e-6)
    assert np.isnan(found.soc_frac[0])
    assert found.wet_frac[0] == 1.0
    assert texts(found, NoteKind.IGNORED) == ["columns not used: trip"]


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_parquet_times_are_seconds_whatever_their_unit(tmp_path, unit):
    driven = drive()
    stamps = pa.array((driven.time_s * 1e9).astype("int64"), pa.timestamp("ns", "UTC")).cast(pa.timestamp(unit, "UTC"))
    path = parquet_file(tmp_path / "a.parquet", time_s=stamps, speed_kmh=3.6 * driven.speed_mps, power_w=driven.power_w)
    assert read_recording(path).time_s == pytest.approx(driven.time_s)


def test_parquet_columns_are_hidden_and_rows_counted_from_one(tmp_path):
    driven = drive()
    power = driven.power_w.copy()
    power[4] = np.nan
    columns = {"time_s": driven.time_s, "speed_kmh": 3.6 * driven.speed_mps, "Heater": power, "power_w": power}
    with pytest.raises(RecordingError, match="row 5: power_w is nan"):
        read_recording(parquet_file(tmp_path / "a.parquet", **columns))
    with pytest.raises(RecordingError, match="power_w is missing"):
        read_recording(tmp_path / "a.parquet", hidden=["POWER*"])


def test_broken_parquet_is_an_error(tmp_path):
    driven = drive()
    path = parquet_file(
        tmp_path / "a.parquet", time_s=driven.time_s, speed_kmh=driven.speed_mps, power_w=driven.power_w
    )
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(RecordingError, match="not Parquet"):
        read_recording(path)


def test_parquet_of_too_many_rows_is_refused_before_it_is_read(tmp_path):
    path = parquet_file(tmp_path / "a.parquet", time_s=np.zeros(2_000_001))
    assert path.stat().st_size < 20_000
    with pytest.raises(RecordingError, match="the table is more than 2000000 rows long"):
        read_recording(path)
