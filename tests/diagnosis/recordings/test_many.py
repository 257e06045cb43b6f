"""Many recordings at once: folders and patterns, bad files among good ones, ids that clash."""

from __future__ import annotations

import gzip

import pytest

from diagnosis.recordings.files import recording_files
from diagnosis.recordings.reading import read_recordings
from tests.diagnosis.recorded_drives import drive, plain_csv
from tests.diagnosis.recording_rows import SAMPLES, plain_rows


@pytest.fixture
def folder(tmp_path):
    text = plain_csv(drive(120.0))
    (tmp_path / "b.csv").write_text(text, encoding="utf-8")
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text.encode()))
    (tmp_path / "bad.csv").write_text("no table\n", encoding="utf-8")
    (tmp_path / "README.md").write_text("no recording\n", encoding="utf-8")
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "c.csv").write_text(text, encoding="utf-8")
    return tmp_path


def test_folder_gives_its_recordings_in_order_and_the_errors_apart(folder):
    recordings, errors = read_recordings([folder])
    assert [recording.id for recording in recordings] == ["a", "b"]
    assert [error.path for error in errors] == [str(folder / "bad.csv")]


def test_patterns_and_files_come_once_in_the_order_given(folder):
    found = recording_files([folder / "b.csv", str(folder / "*.csv"), str(folder / "**" / "c.csv")])
    assert [path.name for path in found] == ["b.csv", "bad.csv", "c.csv"]


def test_file_whose_name_looks_like_a_pattern_is_that_file(folder):
    path = folder / "drive [1].csv"
    path.write_text(plain_csv(drive(120.0)), encoding="utf-8")
    assert recording_files([path]) == [path]


def test_two_files_of_one_id_are_an_error_for_the_second(folder):
    (folder / "b.csv.gz").write_bytes(gzip.compress((folder / "b.csv").read_bytes()))
    recordings, errors = read_recordings([folder / "b.csv", folder / "b.csv.gz"])
    assert [recording.id for recording in recordings] == ["b"]
    (error,) = errors
    assert (error.column, error.value) == ("its id", "b")
    assert error.allowed == f"one that {folder / 'b.csv'} does not have already"


def test_path_that_is_not_there_is_an_error_among_the_others(folder):
    recordings, errors = read_recordings([folder / "absent.csv", str(folder / "none*.csv"), folder / "b.csv"])
    assert [recording.id for recording in recordings] == ["b"]
    assert [error.value for error in errors] == ["not to be opened (No such file or directory)"] * 2


def test_hidden_columns_and_progress_reach_every_file(folder):
    seen = []
    _, errors = read_recordings([folder], ["power_w"], lambda done, of: seen.append((done, of)))
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert len(errors) == 3


@pytest.mark.parametrize("header", ["time_s,speed_kmh,power_w\n", ""])
def test_drives_joined_in_a_file_are_taken_apart_and_a_bad_one_is_named(tmp_path, header):
    first, bad, last = ["\n".join(",".join(row) for row in plain_rows()) + "\n" for _ in range(3)]
    path = tmp_path / "joined.csv"
    bad = bad.replace("\n50,80.0000,", "\n50,fast,")
    path.write_text(f"time_s,speed_kmh,power_w\n{first}{header}{bad}{header}{last}", encoding="utf-8")
    found, (error,) = read_recordings([path])
    assert [drive.id for drive in found] == ["joined-1", "joined-3"]
    assert [drive.time_s.size for drive in found] == [SAMPLES, SAMPLES]
    assert "joined.csv, drive joined-2, row 6" in str(error)
    assert "speed_kmh is fast" in str(error)


def test_rows_with_the_newest_first_are_turned_and_shuffled_ones_are_refused(tmp_path):
    rows = [",".join(row) for row in plain_rows()]
    for name, order in (("turned", rows[::-1]), ("shuffled", [*rows[300:], *rows[100:300], *rows[:100:-1]])):
        (tmp_path / f"{name}.csv").write_text("\n".join(["time_s,speed_kmh,power_w", *order]), encoding="utf-8")
    (turned,), (error,) = read_recordings([tmp_path])
    assert turned.time_s.tolist() == list(range(SAMPLES))
    assert any("newest came first" in note.text for note in turned.notes)
    assert "at least that of the row before" in str(error)
