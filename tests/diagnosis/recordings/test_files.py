"""Files that recordings come in: how text is written makes no difference, and what is no table is an error."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from diagnosis.recordings.reading import RecordingError, read_recording
from tests.diagnosis.recorded_drives import drive, plain_csv


def test_utf_16_bom_carriage_returns_tabs_and_quotes_make_no_difference(read):
    text = plain_csv(drive())
    expected = read(text).power_w
    quoted = "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in text.splitlines())
    for content in (
        text.encode("utf-16"),
        "\ufeff".encode() + text.encode(),
        text.replace("\n", "\r\n"),
        text.replace("\n", "\r"),
        text.encode("utf-32"),
        text.encode() + b"\0" * 4096,
        text.replace("time_s,speed_kmh,power_w", "Time_s,Speed_KMH,POWER_W"),
        text.replace(",", "\t"),
        text.replace(",", "|"),
        quoted,
    ):
        assert np.array_equal(read(content).power_w, expected)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"\x00\x01\x02 time", r"row 1: the file is binary"),
        (b"time_s,speed_kmh,power_w\n0,1,2\n1,\x00,3\n", "row 3: the file is binary"),
        (b"PK\x03\x04rest", "row 1: the file is a zip or Excel file"),
        (b"\xff\xfea\x00\x00", "broken UTF-16"),
        ("time_s,speed_kmh,power_w".encode("utf-16-le"), "UTF-16 without a mark"),
    ],
)
def test_what_is_no_text_is_an_error(read, content, found):
    with pytest.raises(RecordingError, match=found):
        read(content)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        ("time_s;speed_kmh;power_w\n0.0;1;2\n1,0;1;2\n", "row 3: time_s is 1,0, allowed: .* with a decimal point"),
        (
            "time_s,speed_kmh,power_w\n0,1,2\n1,0,1,2\n",
            "row 3: the row is 4 cells long, .*; numbers with a decimal point",
        ),
        (
            "time_s,speed_kmh,power_w\n0;1;2\n1;1;2\n",
            "row 2: the row is 1 cells long, allowed: 3, as the header, set off by ,",
        ),
        ("time_s,speed_kmh,power_w\nx,real,real\n0,1,2\n", r"row 2: the row is a second header line \(x, real, real\)"),
        (
            "time_s,speed_kmh,power_w\ns,mph,W\n0,1,2\n1,1,2\n",
            "row 2: speed_kmh is in mph by the line below the header, allowed: km/h, which the column's name says",
        ),
        ("time_s,speed_kmh,power_w\n0,-1,2\n1,1,2\n", "row 2: speed_kmh is -1, allowed: a number from 0 to 200"),
        ("time_s,speed_kmh,power_w\n0,1,2\n1,1,\n2,1,nan\n", "row 3: power_w is empty"),
        ("0,1,2\n1,1,2\n2,1,2\n", "row 1: the header is 0, 1, 2, allowed: columns of a format"),
    ],
)
def test_bad_table_is_told_by_row_and_column(read, content, found):
    with pytest.raises(RecordingError, match=found):
        read(content)


def test_file_of_a_gigabyte_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "large.csv"
    with path.open("wb") as file:
        file.truncate(1_000_000_000)
    with pytest.raises(RecordingError, match="larger than 100 MB unpacked, allowed: at most 100 MB; split it"):
        read_recording(path)


def test_gzip_that_unpacks_to_too_much_is_refused(read):
    bomb = gzip.compress(b"\n" * 100_000_100)
    assert len(bomb) < 1_000_000
    with pytest.raises(RecordingError, match="larger than 100 MB unpacked"):
        read(bomb, "bomb.csv.gz")
