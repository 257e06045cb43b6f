"""The folder of results: complete or not there, figures as computed, pictures that show something."""

from __future__ import annotations

import json
import math
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from diagnosis.comparison import report
from diagnosis.comparison.comparison import compare
from diagnosis.comparison.plots import bin_edges, energy_boxes_png, error_boxes_png, error_histogram_png, type_boxes_png
from diagnosis.comparison.report import comparison_figures, file_names, write_comparison
from diagnosis.comparison.tables import clock, markdown_page
from diagnosis.comparison.trips import read_trips
from diagnosis.errors import ComparisonError

if TYPE_CHECKING:
    from pathlib import Path

PICTURES = {"energy-boxes.png", "error-boxes.png", "error-by-type-fast.png", "error-histogram-fast.png"}


@pytest.fixture
def records(make_trip):
    """Six urban trips with errors of -15, -10, -10, 1, 2, 13 % (table VIII), one highway trip with 5 %."""
    errors = (13, 2, 1, -15, -10, -10)
    urban = [make_trip(f"u{k}") for k in range(6)] + [make_trip("h", kind="highway")]
    fast = [make_trip(f"u{k}", "fast", kwh=2.0 * (1.0 + error / 100.0)) for k, error in enumerate(errors)]
    return [*urban, *fast, make_trip("h", "fast", kind="highway", kwh=2.1)]


def test_folder_has_all_files_and_nothing_else(tmp_path: Path, records):
    folder = tmp_path / "new" / "out"
    written = write_comparison(folder, compare(records), records)
    assert {path.name for path in folder.iterdir()} == {"comparison.json", "tables.md", "trips.csv", *PICTURES}
    assert {path.name for path in written} == {path.name for path in folder.iterdir()}
    assert list(folder.parent.iterdir()) == [folder]
    assert read_trips([folder / "trips.csv"]) == tuple(records)


def test_figures_are_those_of_the_comparison(tmp_path: Path, records):
    comparison = compare(records)
    write_comparison(tmp_path / "out", comparison, records)
    figures = json.loads((tmp_path / "out" / "comparison.json").read_text(encoding="utf-8"))
    assert figures == json.loads(json.dumps(comparison_figures(comparison)))
    urban = figures["series"][0]["types"][0]
    # table VIII: mean (13 + 2 + 1 - 15 - 10 - 10)/6 = -19/6; squares 599 - 361/6 = 538.83; SD √(538.83/5), √(538.83/6)
    assert urban["energy_error_percent"]["mean"] == pytest.approx(-19.0 / 6.0)
    assert urban["energy_error_percent"]["sd"] == pytest.approx(math.sqrt(538.8333 / 5.0), rel=1e-5)
    assert urban["energy_error_percent"]["population_sd"] == pytest.approx(math.sqrt(538.8333 / 6.0), rel=1e-5)
    assert urban["measured"]["energy_kwh_per_100km"] == pytest.approx(20.0)
    assert urban["measured"]["speed_kmh"] == pytest.approx(36.0)
    assert figures["series"][0]["types"][1]["energy_error_percent"]["sd"] is None


def test_writing_twice_gives_the_same_bytes(tmp_path: Path, records):
    for name in ("a", "b"):
        write_comparison(tmp_path / name, compare(records), records)
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes(), path.name


def test_later_comparison_replaces_its_own_files_and_leaves_others(tmp_path: Path, records, make_trip):
    folder = tmp_path / "out"
    write_comparison(folder, compare(records), records)
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    other = [make_trip("1"), make_trip("1", "slow")]
    write_comparison(folder, compare(other), other)
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "comparison.json",
        "tables.md",
        "trips.csv",
        "energy-boxes.png",
        "error-boxes.png",
        "error-histogram-slow.png",
        "error-by-type-slow.png",
        "notes.txt",
    }


def test_failure_leaves_no_folder_that_claims_success(tmp_path: Path, records, monkeypatch):
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(report, "write_trips", fail)
    with pytest.raises(OSError, match="No space"):
        write_comparison(tmp_path / "out", compare(records), records)
    assert list(tmp_path.iterdir()) == []


def test_file_in_place_of_the_folder_is_refused(tmp_path: Path, records):
    (tmp_path / "out").write_text("", encoding="utf-8")
    with pytest.raises(ComparisonError, match="a folder, or a new name"):
        write_comparison(tmp_path / "out", compare(records), records)


def test_files_that_may_be_somebodys_data_are_not_overwritten(tmp_path: Path, records):
    (tmp_path / "trips.csv").write_text("mine", encoding="utf-8")
    with pytest.raises(ComparisonError, match=r"trips\.csv, allowed: a folder without"):
        write_comparison(tmp_path, compare(records), records)
    assert [path.name for path in tmp_path.iterdir()] == ["trips.csv"]
    assert (tmp_path / "trips.csv").read_text(encoding="utf-8") == "mine"


def test_series_without_relative_error_has_no_picture_of_errors(tmp_path: Path, make_trip):
    records = [make_trip("1", kwh=-1.0), make_trip("1", "fast")]
    write_comparison(tmp_path / "out", compare(records), records)
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"comparison.json", "tables.md", "trips.csv", "energy-boxes.png"}
    with pytest.raises(ValueError, match="no values"):
        error_boxes_png(compare(records))
    with pytest.raises(ValueError, match="no relative error"):
        error_histogram_png(compare(records).series[0])


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(BytesIO(png)).convert("RGB"))


def assert_nothing_is_cut_off(image: np.ndarray) -> None:
    for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
        assert bool(np.all(edge == 255))


def test_pictures_show_boxes_bars_and_marks(records):
    comparison = compare(records)
    series = comparison.series[0]
    for png in (
        error_histogram_png(series),
        error_boxes_png(comparison),
        type_boxes_png(series),
        energy_boxes_png(comparison),
    ):
        image = pixels(png)
        assert image.shape[0] > 250
        assert image.shape[1] > 900
        assert len(np.unique(image.reshape(-1, 3), axis=0)) > 20
        for colour in ((0xDB, 0xE7, 0xF5), (0x11, 0x11, 0x11), (0xC0, 0x39, 0x2B)):  # bar or box, mean, median or curve
            assert int(np.all(image == colour, axis=2).sum()) > 20, colour
        assert_nothing_is_cut_off(image)


def test_pictures_take_any_series_name(make_trip):
    for name in ("a$b_{", "W" * 200, "100 %"):
        trips = [make_trip("1"), make_trip("2"), make_trip("1", name, kwh=2.5), make_trip("2", name)]
        comparison = compare(trips)
        assert_nothing_is_cut_off(pixels(error_boxes_png(comparison)))
        assert_nothing_is_cut_off(pixels(energy_boxes_png(comparison)))
        assert_nothing_is_cut_off(pixels(error_histogram_png(comparison.series[0])))


def test_bin_edges_hold_all_values_and_stay_few():
    assert bin_edges(-3.0, 7.0) == [-5.0, 0.0, 5.0, 10.0]
    assert bin_edges(5.0, 5.0) == [5.0, 10.0]
    edges = bin_edges(-90.0, 1e7)
    assert len(edges) <= 61
    assert edges[0] <= -90.0
    assert edges[-1] > 1e7


def test_file_names_differ_also_without_case():
    assert file_names(["fast", "Fast", "a/b", "a b", "…"]) == ["fast", "Fast-2", "a-b", "a-b-2", "series"]


def test_markdown_keeps_table_cells_whole(make_trip):
    records = [make_trip("1", kind="a|b"), make_trip("1", "fast", kind="a|b")]
    page = markdown_page(compare(records))
    assert "a\\|b" in page
    assert "a|b" not in page.replace("a\\|b", "")


def test_clock_rounds_to_seconds():
    assert clock(2855.6) == "0:47:36"
    assert clock(59.6) == "0:01:00"
