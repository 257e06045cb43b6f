"""Cells, times and lines as loggers write them: what is read, what is blanked and told, what is refused and how."""

from __future__ import annotations

import json

import numpy as np
import pytest

from diagnosis.recordings.notes import NoteKind, RecordingError
from diagnosis.recordings.reading import read_recordings
from tests.diagnosis.recording_rows import SAMPLES, plain_rows, with_column

HEADER = "time_s,speed_kmh,power_w"


def csv_of(header, rows, delimiter=","):
    return "\n".join([header, *(delimiter.join(row) for row in rows)]) + "\n"


def texts(recording, kind, channel=None):
    return [note.text for note in recording.notes if note.kind is kind and channel in (None, note.channel)]


@pytest.mark.parametrize(
    ("name", "cell", "channel", "good"),
    [
        ("soc_frac", "80", "soc_frac", "0.8"),
        ("soc_percent", "127.5", "soc_frac", "80"),
        ("ambient_c", "215", "ambient_k", "20"),
        ("battery_c", "-100", "battery_k", "20"),
        ("lat", "180", "latitude_deg", "48.1"),
        ("heater_w", "Off", "heater_w", "100"),
    ],
)
def test_bad_cells_of_an_optional_channel_are_blanked_and_told(read, name, cell, channel, good):
    header, rows = with_column(plain_rows(), name, [good, cell, cell, *[good] * (SAMPLES - 3)])
    recording = read(csv_of(header, rows))
    assert np.flatnonzero(np.isnan(getattr(recording, channel))).tolist() == [1, 2]
    (text,) = texts(recording, NoteKind.REPAIRED, channel)
    assert text.startswith(f"row 3: {name} is {cell}, the first of 2 cells of {SAMPLES}")
    assert recording.speed_mps.size == SAMPLES


def test_optional_channel_without_a_good_cell_is_left_out_and_the_drive_stays(read):
    header, rows = with_column(plain_rows(), "ambient_c", ["Off"] * SAMPLES)
    recording = read(csv_of(header, rows))
    assert recording.ambient_k is None
    assert texts(recording, NoteKind.REPAIRED, "ambient_k")


@pytest.mark.parametrize("word", ["-", "n/a", "NaN", "null", "\\N", "--"])
def test_words_for_no_value_are_empty_cells_without_a_word_on_repairs(read, word):
    header, rows = with_column(plain_rows(), "battery_c", [word, *["20"] * (SAMPLES - 1)])
    recording = read(csv_of(header, rows))
    assert np.isnan(recording.battery_k[0])
    assert not texts(recording, NoteKind.REPAIRED)


def test_text_where_a_number_is_needed_is_told_by_line_and_column(read):
    rows = plain_rows()
    rows[0][1] = "Off"
    with pytest.raises(RecordingError, match="row 2: speed_kmh is Off, allowed: a number from 0 to 200"):
        read(csv_of(HEADER, rows))


def long_log(speed="48.2", current="24.7", extra=(), comma=False):
    rows = []
    for k in range(40):
        stamp = f"{30189.2 + 0.5 * k:.3f}"
        for name, value, unit in (
            ("Vehicle speed", speed, "km/h"), ("HV battery current", current, "A"),
            ("HV battery voltage", "380.5", "V"), *extra,
        ):  # fmt: skip
            rows.append([f'"{cell}"' for cell in (stamp, name, value, unit)])
    text = csv_of('"SECONDS";"PID";"VALUE";"UNITS"', rows, ";")
    return text.replace(".", ",") if comma else text


@pytest.mark.parametrize("word", ["Off", "-"])
def test_first_reading_of_a_parameter_that_is_a_text_is_no_second_header(read, word):
    recording = read(long_log(extra=[("Ambient air temperature", word, "°C")]))
    assert recording.ambient_k is None
    assert recording.power_w[0] == pytest.approx(24.7 * 380.5)
    with pytest.raises(RecordingError, match="row 2: Vehicle speed is Off"):
        read(long_log(speed="Off"))


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_decimal_commas_are_read_and_told(read, delimiter):
    rows = [[cell.replace(".", ",") for cell in row] for row in plain_rows()]
    recording = read(csv_of(HEADER.replace(",", delimiter), rows, delimiter))
    plain = read(csv_of(HEADER, plain_rows()))
    np.testing.assert_array_equal(recording.power_w, plain.power_w)
    assert any("decimal commas" in text for text in texts(recording, NoteKind.READ))


def test_decimal_commas_of_a_long_log_are_read(read):
    assert read(long_log(comma=True)).power_w[0] == pytest.approx(24.7 * 380.5)


def test_commas_that_may_set_off_thousands_are_refused(read):
    rows = [[row[0], "50", "1,234"] for row in plain_rows()]
    with pytest.raises(RecordingError, match=r"row 2: power_w is 1,234, allowed: decimal points"):
        read(csv_of(HEADER.replace(",", ";"), rows, ";"))


@pytest.mark.parametrize(
    ("before", "told"),
    [
        ("sep=,\n", 1),
        ('"sep=,"\r\n', 1),
        ("# logged by hand\n# 2026-03-01, cold\n", 2),
        ("// a car\n\n", 2),
        ("My logger 2.1\nDrive of Monday, 3 March\n", 2),
    ],
)
def test_lines_before_the_header_are_left_out_and_told(read, before, told):
    rows = plain_rows()
    recording = read(before + csv_of(HEADER, rows))
    assert recording.speed_mps.size == SAMPLES
    assert f"lines before the header: {told}" in texts(recording, NoteKind.IGNORED)
    rows[4][1] = "fast"
    with pytest.raises(RecordingError, match=rf"row {6 + told}: speed_kmh is fast"):
        read(before + csv_of(HEADER, rows))


def test_header_behind_a_comment_mark_and_a_given_separator_are_taken(read):
    assert read("# " + csv_of(HEADER, plain_rows())).speed_mps.size == SAMPLES
    assert read("sep=|\n" + csv_of(HEADER.replace(",", "|"), plain_rows(), "|")).speed_mps.size == SAMPLES


@pytest.mark.parametrize(
    "write",
    [
        lambda value: f"{value:_.2f}".replace("_", "'"),
        lambda value: f"{value:_.2f}".replace("_", " "),
        lambda value: f"{value:_.2f}".replace("_", "\u202f").replace(".", ","),
        lambda value: f"{value:_.2f}".replace(".", ",").replace("_", "."),
        lambda value: f"{value:,.2f}",
        lambda value: f"{value:.2f}".replace("-", "\u2212"),
        lambda value: f"{abs(value):.2f}{'-' * (value < 0.0)}",
        lambda value: f"({-value:.2f})" if value < 0.0 else f"{value:.2f}",
        lambda value: f'="{value:.2f}"',
        lambda value: f"{value:.2f} W",
        lambda value: f"{value / 1000.0:.6f}kW",
    ],
    ids=["'", "space", "narrow", "point", "comma", "minus", "behind", "brackets", "excel", "W", "kW"],
)
def test_numbers_are_read_however_they_are_written(read, write):
    rows = [[row[0], row[1], write(float(row[2]))] for row in plain_rows()]
    recording = read(csv_of(HEADER.replace(",", ";"), rows, ";"))
    assert recording.power_w == pytest.approx([float(row[2]) for row in plain_rows()], abs=0.006)
    assert texts(recording, NoteKind.READ)


def test_unit_in_cells_counts_before_that_of_the_column_and_another_kind_is_no_number(read):
    rows = plain_rows()
    header, more = with_column(rows, "ambient_c", ["41 \u00b0F", "5 km", *["5\u00b0C"] * (SAMPLES - 2)])
    more = [[row[0], f"{float(row[1]) / 1.609344:.6f} mph", *row[2:]] for row in more]
    recording = read(csv_of(header, more))
    assert recording.speed_mps == pytest.approx([float(row[1]) / 3.6 for row in rows], abs=1e-5)
    assert recording.ambient_k[[0, 2]] == pytest.approx([278.15, 278.15])
    assert np.isnan(recording.ambient_k[1])


def test_points_that_may_set_off_thousands_beside_decimal_commas_are_refused(read):
    rows = [[row[0], row[1].replace(".", ","), "2.500"] for row in plain_rows()]
    with pytest.raises(RecordingError, match=r"power_w is 2\.500, allowed: no points that may set off thousands"):
        read(csv_of(HEADER.replace(",", ";"), rows, ";"))


def test_columns_with_commas_beside_columns_with_points_are_read_each_in_its_way(read):
    rows = [[row[0], row[1].replace(".", ","), row[2]] for row in plain_rows()]
    recording = read(csv_of(HEADER.replace(",", ";"), rows, ";"))
    np.testing.assert_array_equal(recording.speed_mps, read(csv_of(HEADER, plain_rows())).speed_mps)


UNIT_LINE = csv_of("\n".join([HEADER, "s,[km/h],W"]), plain_rows())
NAMED_BY_UNITS = csv_of("time,Vehicle speed,HV battery power\ns,km/h,W", plain_rows())
TWICE = csv_of(HEADER, plain_rows()[:300]) + csv_of(HEADER, plain_rows()[300:])
IN_PARTS = csv_of(HEADER, plain_rows()[:300]) + csv_of(
    "time_s,ambient_c,speed_kmh,power_w", [[row[0], "5", *row[1:]] for row in plain_rows()[300:]]
)


@pytest.mark.parametrize(
    ("text", "kind", "found"),
    [
        (UNIT_LINE, NoteKind.READ, "a line of units below the header"),
        (NAMED_BY_UNITS, NoteKind.READ, "a line of units below the header"),
        (TWICE, NoteKind.READ, "the header comes again, 1 times"),
        (IN_PARTS, NoteKind.READ, "the header comes again, 1 times"),
        (csv_of(HEADER, plain_rows()) + "Total,,123\n# end\n", NoteKind.IGNORED, "last rows dropped"),
        (csv_of(HEADER + "\n# parked", plain_rows()), NoteKind.IGNORED, "comments and rules between rows: 1"),
        ("sep=;\n" + csv_of(HEADER, plain_rows()), NoteKind.IGNORED, "lines before the header: 1"),
        (csv_of(HEADER.replace(",", " "), plain_rows(), "  "), None, ""),
        (csv_of(f'"{HEADER}"', [[f'"{",".join(row)}"'] for row in plain_rows()]), None, ""),
    ],
    ids=["units", "names", "twice", "parts", "footer", "comment", "sep", "spaces", "wrapped"],
)
def test_lines_that_are_no_samples_do_not_refuse_a_drive(read, text, kind, found):
    recording = read(text)
    assert recording.power_w == pytest.approx([float(row[2]) for row in plain_rows()])
    assert kind is None or any(found in text for text in texts(recording, kind))
    assert text is not IN_PARTS or np.count_nonzero(np.isnan(recording.ambient_k)) == 300


def test_last_row_that_was_cut_off_is_dropped_and_told(read):
    recording = read(csv_of(HEADER, plain_rows()) + "600,12\n")
    assert recording.speed_mps.size == SAMPLES
    assert texts(recording, NoteKind.REPAIRED) == ["the last row dropped: 2 cells long"]


@pytest.mark.parametrize(
    ("stamps", "seconds"),
    [
        (["13.05.2024 13:50:00", "13.05.2024 13:50:01.5"], 1.5),
        (["13.05.24 23:59:59", "14.05.24 00:00:01"], 2.0),
        (["01:50:00 PM", "01:50:02 PM"], 2.0),
        (["11:59:59.5 am", "12:00:01.5 p.m."], 2.0),
        (["11:59:59 PM", "12:00:01 AM"], 2.0),
        (["5/13/2024 11:59:59 AM", "5/13/2024 12:00:01 PM"], 2.0),
        (["13/05/2024 13:50", "13/05/2024 13:51"], 60.0),
        (['"2024/05/13 13:50:00,250"', '"2024/05/13 13:50:01,250"'], 1.0),
        (["16-Feb-2017 12:39:12.316", "16-Feb-2017 12:39:13.316"], 1.0),
        (["2024-05-13T13:50:00Z", "2024-05-13T15:50:02+02:00"], 2.0),
        (["1700000000", "1700000002"], 2.0),
        (["1700000000000", "1700000002500"], 2.5),
    ],
)
def test_forms_of_time_are_read(read, stamps, seconds):
    recording = read(csv_of(HEADER, [[stamps[0], "10", "100"], [stamps[1], "10", "100"]]))
    assert float(np.diff(recording.time_s)[0]) == pytest.approx(seconds)


CLOCKS = [
    ("2026-03-01 08:00:00 UTC", "2026-03-01 08:00:02 UTC", 1772352000.0),
    ("2026-03-01 08:00:00 GMT+1", "2026-03-01 08:00:02 GMT+1", 1772348400.0),
    ("2026-03-01T08:00:00+01:00[Europe/Berlin]", "2026-03-01T08:00:02+01:00[Europe/Berlin]", 1772348400.0),
    ("2026-03-01 08:00:00 +0000 UTC", "2026-03-01 08:00:02 +0000 UTC", 1772352000.0),
    ("2026-03-01 08:00:00 CET", "2026-03-01 08:00:02 CET", 1772348400.0),
    ("Sun Mar 01 08:00:00 2026", "Sun Mar 01 08:00:02 2026", 1772352000.0),
    ("Sun Mar 01 08:00:00 GMT+01:00 2026", "Sun Mar 01 08:00:02 GMT+01:00 2026", 1772348400.0),
    ('"Sun, 01 Mar 2026 08:00:00 +0000"', '"Sun, 01 Mar 2026 08:00:02 +0000"', 1772352000.0),
    ('"Mar 1, 2026 08:00:00 AM"', '"Mar 1, 2026 08:00:02 AM"', 1772352000.0),
    ("01-M\u00e4r-2026 08:00:00.0", "01-M\u00e4r-2026 08:00:02.0", 1772352000.0),
    ("01. Mrz 2026 08:00:00", "01. Mrz 2026 08:00:02", 1772352000.0),
    ("1 d\u00e9c. 2025 08:00:00", "1 d\u00e9c. 2025 08:00:02", 1764576000.0),
    ("2026-03-01_08-00-00", "2026-03-01_08-00-02", 1772352000.0),
    ("2026-03-01 08.00.00", "2026-03-01 08.00.02", 1772352000.0),
    ("20260301080000", "20260301080002", 1772352000.0),
    ("04/03/2026 23:59:59", "05/03/2026 00:00:01", 1772668799.0),
    ("2026-10-25 02:59:59", "2026-10-25 02:00:01", 1792897199.0),
    ("12:59:59", "01:00:01", 46799.0),
    ("0 days 00:00:01.5", "0 days 00:00:03.5", 1.5),
    ("59:59.0", "00:01.0", 3599.0),
    ("134167256000000000", "134167256020000000", 1772252000.0),
]


@pytest.mark.parametrize(("first", "second", "seconds"), CLOCKS, ids=[first for first, *_ in CLOCKS])
def test_clocks_of_loggers_and_spreadsheets_are_read(read, first, second, seconds):
    recording = read(csv_of(HEADER, [[first, "10", "100"], [second, "10", "100"]]))
    assert recording.time_s == pytest.approx([seconds, seconds + 2.0])


@pytest.mark.parametrize(
    ("stamp", "how"),
    [
        (lambda k: f"{46_082.0 + (28_800 + k) / 86_400:.9f}", "days since 1900"),
        (lambda k: f"{740_042.0 + (28_800 + k) / 86_400:.9f}", "days since the year 0"),
        (lambda k: f"{10_000 * ((28_800 + k) // 3600) + 100 * (k // 60 % 60) + k % 60:06d}", "digits of hours"),
        (lambda k: f"{(65_000 + k) % 65_536}", "added"),
    ],
    ids=["spreadsheet", "datenum", "digits", "16 bits"],
)
def test_numbers_that_count_no_seconds_are_known_by_their_rows(read, stamp, how):
    rows = plain_rows()
    recording = read(csv_of(HEADER, [[stamp(2 * k), *row[1:]] for k, row in enumerate(rows)]))
    assert np.diff(recording.time_s) == pytest.approx(np.full(SAMPLES - 1, 2.0), abs=2e-4)
    assert any(how in text for text in texts(recording, NoteKind.READ, "time_s"))


def test_times_in_minutes_that_rows_share_are_refused_as_no_time_of_a_row(read):
    rows = [[f"2026-03-01 08:{k // 60:02d}", "10", "100"] for k in range(SAMPLES)]
    with pytest.raises(RecordingError, match="the same minute in most rows, allowed: times with seconds"):
        read(csv_of(HEADER, rows))


def test_dates_with_dots_are_seconds_since_1970(read):
    stamps = ["13.05.2024 13:50:00", "13.05.2024 13:50:01"]
    recording = read(csv_of(HEADER, [[stamp, "10", "100"] for stamp in stamps]))
    assert recording.time_s[0] == float(np.datetime64("2024-05-13T13:50:00", "s").astype(np.int64))


def test_order_of_day_and_month_that_is_not_sure_is_told(read):
    recording = read(csv_of(HEADER, [[f"05/06/2024 13:50:0{k}", "10", "100"] for k in range(3)]))
    assert any("the month first (it may be the day" in text for text in texts(recording, NoteKind.READ))


@pytest.mark.parametrize("stamp", ["noon", "13 h 50", "13:50:00 XM", "13:70"])
def test_time_of_no_known_form_is_refused_with_the_forms(read, stamp):
    with pytest.raises(RecordingError, match=r"row 2: time_s is .*allowed: .*13:59:59.*ISO 8601"):
        read(csv_of(HEADER, [[stamp, "10", "100"], ["5", "10", "100"]]))


RECORDS = [{"utc": 1_700_000_000 + k, "speed": 20.0 + k % 7, "power": 5.0 + k % 5} for k in range(60)]


@pytest.mark.parametrize(
    "text",
    [
        json.dumps(RECORDS),
        json.dumps(RECORDS, indent=2),
        json.dumps({"data": RECORDS, "car": "x"}, indent=1),
        json.dumps([["utc", "speed", "power"], *[list(record.values()) for record in RECORDS]]),
        json.dumps({name: [record[name] for record in RECORDS] for name in RECORDS[0]}),
        "\n".join(map(json.dumps, RECORDS)),
        json.dumps([{"tlm": record} for record in RECORDS]),
        "".join(map(json.dumps, RECORDS)),
        ",\n".join(json.dumps(record, indent=1) for record in RECORDS),
        "# by hand\n" + "\n".join(map(json.dumps, RECORDS)),
        json.dumps({"drive": {"car": {"name": "x"}, "events": [{"at": 1}], "samples": RECORDS}}),
        json.dumps({name: {str(k): record[name] for k, record in enumerate(RECORDS)} for name in RECORDS[0]}),
        json.dumps({str(k): record for k, record in enumerate(RECORDS)}),
        json.dumps({"columns": list(RECORDS[0]), "index": [0], "data": [list(r.values()) for r in RECORDS]}),
        json.dumps([{**r, "power": {"value": 1000.0 * r["power"], "unit": "W"}} for r in RECORDS]),
        json.dumps([{name: f"{value:.1f}".replace(".", ",") for name, value in r.items()} for r in RECORDS]),
        json.dumps(
            [
                {"type": "Feature", "geometry": {"type": "Point", "coordinates": [9.0, 48.0]}, "properties": r}
                for r in RECORDS
            ]
        ),
    ],
    ids=[
        "array",
        "indented",
        "wrapped",
        "arrays",
        "columns",
        "lines",
        "tlm",
        "joined",
        "commas",
        "comment",
        "nested",
        "by column",
        "by row",
        "split",
        "units",
        "decimal commas",
        "geojson",
    ],
)
def test_json_in_any_of_its_forms_is_read(read, text):
    recording = read(text, "drive.json")
    assert recording.id == "drive"
    assert recording.power_w[:3] == pytest.approx([5000.0, 6000.0, 7000.0])


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('[{"utc": 1, "speed": 2, "power": 3}, 7]', "row 2: the row is 7, allowed: one JSON object a line"),
        ('[{"utc": 1, "speed": 2, "power"', "the array is broken JSON"),
        ("[]", "the table is 0 rows"),
        ("\n".join([*map(json.dumps, RECORDS), "soon", json.dumps(RECORDS[0])]), "row 61: the row is soon"),
        (
            '{"type": "Feature", "properties": {}, "geometry": {"type": "LineString", "coordinates": [[9, 48]]}}',
            "GeoJSON of a LineString, allowed: points with a time, a speed and a power",
        ),
    ],
)
def test_json_that_is_no_table_says_what_is_wrong(read, text, found):
    with pytest.raises(RecordingError, match=found):
        read(text, "drive.json")


def test_last_object_that_was_cut_off_is_dropped_and_told(read):
    recording = read("\n".join(map(json.dumps, RECORDS))[:-9], "drive.jsonl")
    assert recording.time_s.size == len(RECORDS) - 1
    assert any("cut off: row 60" in text for text in texts(recording, NoteKind.REPAIRED))


def test_one_bad_row_of_a_table_of_sums_leaves_the_other_drives(tmp_path):
    path = tmp_path / "sums.csv"
    path.write_text(
        "trip,distance_km,duration_min,energy_kwh,ambient_c\n"
        "a,20,30,4,5\nb,,30,4,5\nc,20,30,much,5\nd,20,30,4,five\na,20,30,4,5\n",
        encoding="utf-8",
    )
    found, errors = read_recordings([path])
    assert [drive.id for drive in found] == ["a", "d"]
    assert [error.row for error in errors] == [3, 4, 6]
    assert found[1].ambient_k is None
    assert found[1].notes[0].kind is NoteKind.REPAIRED
