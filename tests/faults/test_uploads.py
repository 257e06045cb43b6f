"""Small recordings that unpack to much: what they take is bounded before they are unpacked."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from diagnosis.recordings.formats.csv_tables import MOST_ROW
from diagnosis.recordings.reading import read_recordings
from tests.faults.measured import read_apart

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


ROWS = 100_000


def refused_csv(rows: int) -> bytes:
    """A packed table that is read whole before its last row is refused."""
    body = "\n".join(f"{k},{k % 90},{k % 700}" for k in range(rows))
    return gzip.compress(f"time_s,speed_kmh,power_w\n{body}\n{rows},fast,1\n{rows + 1},1,1\n".encode(), 6)


def write_texts(path: Path, text: str, rows: int) -> None:
    """A Parquet of three columns, in one of which each row has the same long text."""
    time_s = np.arange(rows, dtype=np.float64)
    speed = pa.array(np.full(rows, 50.0))
    power = pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, np.int32)), pa.array([text]))
    table = pa.table({"time_s": pa.array(time_s), "speed_kmh": speed, "power_w": power})
    parquet.write_table(table, path, compression="zstd", store_schema=False)


@pytest.mark.fault("refused-uploads")
def test_refused_recordings_hold_no_table(tmp_path: Path, record_property: Callable[[str, object], None]) -> None:
    for folder, count in (("few", 1), ("many", 4)):
        (tmp_path / folder).mkdir()
        for k in range(count):
            (tmp_path / folder / f"{k}.csv.gz").write_bytes(refused_csv(ROWS))
    few, many = (read_apart(tmp_path / folder) for folder in ("few", "many"))
    assert len(many.errors) == 4
    assert "speed_kmh is fast" in many.errors[-1]
    record_property("now", f"reading one takes {few.peak_mb:.0f} MB, reading four {many.peak_mb:.0f} MB")
    assert many.peak_mb < 1.3 * few.peak_mb


def test_kept_errors_have_no_frames(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(gzip.decompress(refused_csv(3)))
    (tmp_path / "b.csv").write_text("drive_id,date,speed,power\n1,x,1,1\n1,y,1,1\n2,x,1,1\n2,y,1,1\n", "utf-8")
    _, errors = read_recordings([tmp_path])
    assert len(errors) == 3
    for error in errors:
        assert (error.__traceback__, error.__cause__, error.__context__) == (None, None, None)


@pytest.mark.fault("decoded-size")
def test_long_text_that_rows_share_is_refused_before_each_has_its_own(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    write_texts(tmp_path / "texts.parquet", "0123456789" * 1_000, 500_000)
    assert (tmp_path / "texts.parquet").stat().st_size < 4_500_000
    measured = read_apart(tmp_path)
    (error,) = measured.errors
    assert "power_w is texts of more than 200 MB, each as often as rows have it" in error
    record_property("now", f"texts of 5 GB in all are refused, with {measured.peak_mb:.0f} MB")
    assert measured.peak_mb < 300.0


def test_text_that_rows_share_is_read_once(tmp_path: Path) -> None:
    write_texts(tmp_path / "texts.parquet", "fifty kilowatts" * 20, 500_000)
    measured = read_apart(tmp_path)
    (error,) = measured.errors
    assert "row 1: power_w is fifty" in error
    assert measured.peak_mb < 300.0


def test_pages_that_unpack_to_more_than_the_footer_says_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "pages.parquet"
    texts = [f"{k:0200d}" for k in range(20_000)]
    table = pa.table({"time_s": texts, "speed_kmh": np.zeros(20_000), "power_w": np.zeros(20_000)})
    parquet.write_table(table, path, use_dictionary=False, data_page_size=8_000_000, write_statistics=False)
    begin = parquet.ParquetFile(path).metadata.row_group(0).column(0).data_page_offset
    content = bytearray(path.read_bytes())
    assert content[begin : begin + 3] == b"\x15\x00\x15"  # the page's kind, and its size in four bytes
    content[begin + 3 : begin + 7] = b"\xfe\xff\xff\x7f"
    path.write_bytes(content)
    measured = read_apart(tmp_path)
    assert "time_s is pages of 134 MB unpacked, which its footer does not say" in measured.errors[0]
    assert measured.peak_mb < 100.0


def test_line_that_never_ends_is_refused_before_it_is_taken_apart(tmp_path: Path) -> None:
    (tmp_path / "wide.csv.gz").write_bytes(gzip.compress(b"time_s,speed_kmh,power_w\n" + b"1," * 45_000_000, 1))
    measured = read_apart(tmp_path)
    (error,) = measured.errors
    assert f"a line is more than {MOST_ROW} letters long" in error
    assert measured.peak_mb < 400.0


def test_row_that_quotes_spread_over_lines_is_refused(tmp_path: Path) -> None:
    rows = b'"1\n",' * 5_000_000
    (tmp_path / "quoted.csv.gz").write_bytes(gzip.compress(b"time_s,speed_kmh,power_w\n" + rows, 1))
    (error,) = read_apart(tmp_path).errors
    assert f"a line is more than {MOST_ROW} letters long" in error


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("empty.json.jsonl", b"[" + b"{}," * 20_000_000 + b"{}]"),
        ("nested.jsonl", b"[" + b"[]," * 20_000_000 + b"[]]"),
        ("elements.gpx", b"<gpx>" + b"<a/>" * 20_000_000 + b"</gpx>"),
    ],
    ids=["objects", "arrays", "elements"],
)
def test_text_of_many_small_values_is_refused_before_it_is_read(tmp_path: Path, name: str, text: bytes) -> None:
    (tmp_path / name).write_bytes(text)
    measured = read_apart(tmp_path)
    (error,) = measured.errors
    assert "GB once it is read, allowed: at most 1.5 GB" in error
    assert measured.peak_mb < 400.0


@pytest.mark.parametrize("element", [b"trkseg", b"trkpt"])
def test_tracks_within_tracks_are_refused_before_each_has_the_points_of_all(tmp_path: Path, element: bytes) -> None:
    deep = 2_000
    text = b"<gpx>" + (b"<%s>" % element) * deep + b"<a/>" * 3_000 + (b"</%s>" % element) * deep + b"</gpx>"
    (tmp_path / "deep.gpx").write_bytes(text)
    measured = read_apart(tmp_path)
    assert "the file is tracks or points within each other" in measured.errors[0]
    assert measured.peak_mb < 100.0


def test_columns_that_few_rows_have_are_counted_for_all_of_them(tmp_path: Path) -> None:
    names = [f'"{"".join(c.upper() if k >> i & 1 else c for i, c in enumerate("speed_kmh"))}":1' for k in range(256)]
    lines = b'{"time_s":1}\n' * 240_000 + b"{" + ",".join(names).encode() + b"}\n"
    (tmp_path / "sparse.jsonl").write_bytes(lines)
    measured = read_apart(tmp_path)
    (error,) = measured.errors
    assert "the table is more than 30000000 cells in columns that are read" in error
    assert measured.peak_mb < 400.0


def test_sums_of_long_drives_are_counted_before_all_are_made(tmp_path: Path) -> None:
    rows = "".join(f"2000,55,{k % 9}\n" for k in range(2_000))
    (tmp_path / "sums.csv").write_text(f"distance_km,duration_h,energy_kwh\n{rows}", "utf-8")
    measured = read_apart(tmp_path)
    assert "drives of more than 16667 hours in all" in measured.errors[0]
    assert measured.peak_mb < 700.0


def test_files_together_unpack_to_no_more_than_is_allowed(tmp_path: Path) -> None:
    for k in range(5):
        (tmp_path / f"{k}.csv.gz").write_bytes(gzip.compress(b"x" * 40_000_000, 1))
    measured = read_apart(tmp_path, 100_000_000)
    assert sum("beyond the 100 MB that may be unpacked of all files" in error for error in measured.errors) == 3


def test_errors_of_very_many_drives_of_one_file_are_the_first_and_how_many_more(tmp_path: Path) -> None:
    rows = "".join(f"{k},0,1,1\n" for k in range(5_000))
    (tmp_path / "sums.csv").write_text(f"trip,distance_km,duration_h,energy_kwh\n{rows}", "utf-8")
    _, errors = read_recordings([tmp_path])
    assert len(errors) == 101
    assert "5000 drives that can't be read, of which 100 are named" in str(errors[-1])
