"""Recordings that requests name: names of uploads, and patterns of files below a folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from app.diagnosing.sources import files_below, uploaded_name
from app.errors.diagnosing import SourceError

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.nojit


@pytest.mark.parametrize("filename", [".csv", "..csv", "...csv.gz", ".", "..", "", "a\0.csv", "\ud800.csv", "x" * 201])
def test_name_that_makes_no_address_of_a_trip_is_refused(filename: str) -> None:
    with pytest.raises(SourceError, match="the name of a file"):
        uploaded_name(filename, "recordings[0]")


@pytest.mark.parametrize(
    ("filename", "name"),
    [("a b+c.csv", "a b+c.csv"), ("C:\\trips\\é.csv", "é.csv"), ("../../etc/x.csv", "x.csv"), ("....csv", "....csv")],
)
def test_name_of_an_upload_is_kept_without_its_folders(filename: str, name: str) -> None:
    assert uploaded_name(filename, "recordings[0]") == name


@pytest.fixture
def drives(tmp_path: Path) -> Path:
    """A folder with drives in folders, links within and outside, and a loop."""
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "secret.csv").write_text("x", encoding="utf-8")
    folder = tmp_path / "drives"
    for name in ("a.csv", "notes.txt", "may/b.csv", "may/late/c.jsonl", "may/late/.hidden.csv", "june/[x].csv"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("x", encoding="utf-8")
    (folder / "again").symlink_to("may")
    (folder / "may" / "loop").symlink_to("..")
    (folder / "away").symlink_to(outside)
    (folder / "secret.csv").symlink_to(outside / "secret.csv")
    (folder / "nothing.csv").symlink_to("gone.csv")
    return folder


@pytest.mark.parametrize(
    ("pattern", "named"),
    [
        (".", ["a.csv"]),
        ("a.csv", ["a.csv"]),
        ("./may//b.csv", ["may/b.csv"]),
        ("may", ["may/b.csv"]),
        ("may/", ["may/b.csv"]),
        ("*", ["a.csv", "june/[x].csv", "may/b.csv"]),
        ("*.csv", ["a.csv"]),
        ("m?y/*.c[a-z]v", ["may/b.csv"]),
        ("june/[[]x].csv", ["june/[x].csv"]),
        ("again/*.csv", ["again/b.csv"]),
        ("**/*.csv", ["a.csv", "june/[x].csv", "may/b.csv", "may/late/.hidden.csv"]),
        ("**/late", ["may/late/.hidden.csv", "may/late/c.jsonl"]),
        ("may/**", ["may/b.csv", "may/late/.hidden.csv", "may/late/c.jsonl"]),
        ("**/late/*.jsonl", ["may/late/c.jsonl"]),
        ("may/loop/a.csv", ["may/loop/a.csv"]),
    ],
)
def test_pattern_names_recordings_below_the_folder_only(drives: Path, pattern: str, named: list[str]) -> None:
    assert [str(path) for path in files_below(drives, [pattern])] == named


@pytest.mark.parametrize(
    ("pattern", "allowed"),
    [
        ("**/may/**/*.csv", r"at most one \*\*"),
        ("may**", r"\*\* only in place of a folder"),
        ("may/***", r"\*\* only in place of a folder"),
        ("../outside/*", "without .."),
        ("may\\..\\..", "without .."),
        ("/etc/*", "below the folder"),
        ("away/*.csv", "that is there"),
        ("away/secret.csv", "that is there"),
        ("secret.csv", "that is there"),
        ("nothing.csv", "that is there"),
        ("notes.txt", "that is there"),
        ("x" * 900, "that is there"),
        ("a\0.csv", "that is there"),
    ],
)
def test_pattern_that_names_no_recording_below_the_folder_is_refused(drives: Path, pattern: str, allowed: str) -> None:
    with pytest.raises(SourceError, match=rf"recordings\[1\] is .*, allowed: .*{allowed}"):
        files_below(drives, ["a.csv", pattern])


def test_file_that_several_patterns_name_comes_once(drives: Path) -> None:
    assert [str(path) for path in files_below(drives, ["may/*.csv", "a.csv", "**/b.csv"])] == ["may/b.csv", "a.csv"]


def test_patterns_look_at_no_more_entries_and_no_longer_than_allowed(drives: Path) -> None:
    assert files_below(drives, ["may/b.csv"] * 10, most_entries=30)
    with pytest.raises(SourceError, match=r"recordings\[1\] is .*at no more than 20 files and folders in all"):
        files_below(drives, ["may/b.csv", "**/*.csv"], most_entries=20)
    with pytest.raises(SourceError, match=r"found within 0 s in all"):
        files_below(drives, ["may/b.csv"] * 100, most_s=0.0)
