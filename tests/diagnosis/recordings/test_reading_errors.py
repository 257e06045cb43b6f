"""What cannot be read is an error that says where and what."""

from __future__ import annotations

import pytest

from diagnosis.recordings.reading import RecordingError, read_recording
from tests.diagnosis.recording_rows import I3_HEADER, i3_rows, plain_rows


@pytest.mark.parametrize(
    ("column", "cell", "shown"),
    [(1, "fast", "fast"), (1, "-3", "-3"), (1, "250", "250"), (1, "", "empty"), (1, "12,5", "12,5"), (5, "nan", "nan")],
)
def test_bad_cell_of_an_i3_file_is_told_by_file_row_and_column(i3_file, column, cell, shown):
    rows = i3_rows()
    rows[41][column] = cell
    path = i3_file(rows)
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    error = caught.value
    assert (error.path, error.row, error.value) == (str(path), 43, shown)  # the header is row 1
    assert error.column == I3_HEADER.split(";")[column].strip()
    assert "a number from" in error.allowed


def test_time_that_runs_back_is_an_error(plain_file):
    rows = plain_rows()
    rows[7][0] = "3"
    with pytest.raises(RecordingError, match="row 9: time_s is 3, allowed: at least that of the row before, 6"):
        read_recording(plain_file(rows))


def test_time_in_milliseconds_is_an_error(plain_file):
    with pytest.raises(RecordingError, match="time is 100 later a row"):
        read_recording(plain_file(plain_rows(step_s=100.0)))


def test_recording_that_lasts_for_weeks_is_an_error(plain_file):
    rows = plain_rows()
    rows[-1][0] = "2e6"
    with pytest.raises(RecordingError, match=r"time is 2e\+06 later at the end, allowed: seconds, at most 1e\+06"):
        read_recording(plain_file(rows))


def test_current_with_the_wrong_sign_is_an_error(i3_file):
    rows = [[*row[:5], f"{-float(row[5])}", *row[6:]] for row in i3_rows()]
    with pytest.raises(RecordingError, match="positive for discharge, so higher while accelerating"):
        read_recording(i3_file(rows))


@pytest.mark.parametrize(
    ("header", "found"),
    [("a,b,c", "the header is a, b, c"), ("time_s,speed_kmh,power_hp", "power_w is missing")],
)
def test_header_of_no_format_is_an_error_that_names_what_is_needed(plain_file, header, found):
    with pytest.raises(RecordingError, match=found) as caught:
        read_recording(plain_file(header=header))
    assert caught.value.row == 1
    assert "power_w" in caught.value.allowed or "Velocity [km/h]" in caught.value.allowed


def test_column_that_is_there_twice_is_an_error_where_it_is_used(plain_file):
    rows = [[*row, row[1]] for row in plain_rows()]
    with pytest.raises(RecordingError, match="speed_kmh is there twice"):
        read_recording(plain_file(rows, "time_s,speed_kmh,power_w,speed_kmh"))


def test_row_of_another_length_is_an_error(plain_file):
    rows = plain_rows()
    rows[3] = rows[3][:2]
    with pytest.raises(RecordingError, match="row 5: the row is 2 cells long, allowed: 3, as the header"):
        read_recording(plain_file(rows))


@pytest.mark.parametrize("content", [b"", b"time_s,speed_kmh,power_w\n", b"time_s,speed_kmh,power_w\n0,0,0\n"])
def test_file_without_samples_is_an_error(tmp_path, content):
    path = tmp_path / "empty.csv"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="allowed: at least 2 samples"):
        read_recording(path)


def test_file_whose_times_are_all_the_same_is_an_error(plain_file):
    with pytest.raises(RecordingError, match="time_s is always the same, allowed: rising"):
        read_recording(plain_file([["5", "0", "0"]] * 3))


def test_truncated_gzip_file_is_an_error(i3_file):
    path = i3_file()
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(RecordingError, match="allowed: a whole gzip file"):
        read_recording(path)


def test_file_that_is_not_there_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_recording(tmp_path / "absent.csv")
