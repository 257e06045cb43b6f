"""Recordings written to a folder of the test's own."""

from __future__ import annotations

import gzip

import pytest

from diagnosis.recordings.reading import read_recording
from tests.diagnosis.recording_rows import I3_HEADER, i3_rows, plain_rows


@pytest.fixture
def read(tmp_path):
    """Writes a text or bytes, and reads it as a recording."""

    def written(content, name="drive.csv"):
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return read_recording(path)

    return written


@pytest.fixture
def i3_file(tmp_path):
    def write(rows=None, header=I3_HEADER, name="TripX01.csv.gz", newline="\r\n"):
        lines = [header, *(";".join(row) for row in (i3_rows() if rows is None else rows))]
        content = (newline.join(lines) + newline).encode("latin-1")
        path = tmp_path / name
        path.write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
        return path

    return write


@pytest.fixture
def plain_file(tmp_path):
    def write(rows=None, header="time_s,speed_kmh,power_w", name="drive.csv"):
        path = tmp_path / name
        lines = [header, *(",".join(row) for row in (plain_rows() if rows is None else rows))]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write
