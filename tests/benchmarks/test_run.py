"""The benchmarks run and say what they should; no time is asserted."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.run import main
from benchmarks.searches import CASES, spread
from benchmarks.terrain import HIGHEST_M, MARGIN_DEG, hills_m, map_bounds, write_hills

TINY = ["--synth-links", "500", "--sources", "2", "--repeat", "1", "--pairs", "3", "--ranges", "1"]
BOUNDS = (-8.62, 41.14, -8.60, 41.16)


def test_run_without_maps_measures_the_synthetic_region_alone(tmp_path, capsys) -> None:
    assert main(["--maps", str(tmp_path), "--json", *TINY]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["machine"]["cores"] >= 1
    assert {"cpu", "python", "numpy", "numba", "load"} <= printed["machine"].keys()
    assert printed["settings"] == {
        "vehicle": "hyundai-kona-64",
        "seed": 1,
        "sources": 2,
        "repeat": 1,
        "pairs": 3,
        "ranges": 1,
    }
    assert any("no porto.osm.pbf" in note for note in printed["notes"])
    assert any("no andorra.osm.pbf and no N42E001.hgt.zip" in note for note in printed["notes"])
    (graph,) = printed["graphs"]
    made, loaded = graph["made"], graph["loaded"]
    assert (made["name"], made["kind"]) == ("synth", "synth")
    assert made["links"] > 0
    assert made["peak_mb"] >= made["idle_mb"] > 0.0
    assert made["saved_mb"] > 0.0
    assert set(loaded) == {"load_s", "added_mb", "touched_mb", "private_mb"}
    assert len(graph["searches"]) == len(CASES)
    for row, case in zip(graph["searches"], CASES, strict=True):
        assert row["case"] == {"stops": case.stops.value, "soc_frac": case.soc_frac}
        for name in ("search_s", "scalar_length_s", "scalar_time_s", "over_length", "over_time"):
            assert 0.0 < row[name]["least"] <= row[name]["median"] <= row[name]["most"]
        assert row["met"] == (max(row["over_length"]["median"], row["over_time"]["median"]) <= printed["target_ratio"])
        assert 0.0 < row["reached_frac"] <= 1.0
        assert row["labels_made_per_link"] >= row["labels_settled_per_link"] > 0.0
    assert [q["kind"] for q in graph["queries"]] == [
        "route, eco",
        "route, fastest",
        "route, balanced",
        "range, 4 bands",
    ]
    models = graph["models"]
    assert 0 < models["routes"] <= 3
    assert models["links"] > 0
    assert models["steps_per_km"] > 100  # at 130 km/h it is 277
    assert 0.5 < models["energy_ratio"] < 1.5
    for name in ("ratio", "kernel_ratio"):
        assert 0.0 < models[name]["least"] <= models[name]["median"] <= models[name]["most"]
    assert all(q["count"] + q["refused"] == (1 if "range" in q["kind"] else 3) for q in graph["queries"])


def test_run_prints_every_table_and_a_verdict(tmp_path, capsys) -> None:
    assert main(["--maps", str(tmp_path), *TINY]) == 0
    printed = capsys.readouterr().out
    for title in (
        "One-to-all eco search",
        "Import or generation",
        "Loading, each",
        "Whole queries",
        "Time-step model",
    ):
        assert title in printed
    assert printed.strip().endswith(("met", "missed"))


@pytest.mark.parametrize("option", ["--sources", "--repeat", "--synth-links"])
def test_run_with_a_number_too_small_says_what_is_allowed(option, capsys) -> None:
    with pytest.raises(SystemExit):
        main([option, "0"])
    assert "is 0, allowed: at least" in capsys.readouterr().err


def test_spread_of_known_values_has_their_quartiles() -> None:
    found = spread(np.array([4.0, 1.0, 3.0, 2.0, 5.0]))
    assert (found.median, found.lower_quartile, found.upper_quartile) == (3.0, 2.0, 4.0)
    assert (found.least, found.most) == (1.0, 5.0)


def test_hills_fill_their_range_smoothly_and_repeat_with_the_seed() -> None:
    height, corner = hills_m(BOUNDS, np.random.default_rng(7))
    assert corner == pytest.approx((BOUNDS[0] - MARGIN_DEG, BOUNDS[3] + MARGIN_DEG))
    assert height.min() == 0.0
    assert height.max() == pytest.approx(HIGHEST_M)
    # waves of at least 1000 m and at most ±300 m climb less than 2π·300/1000 a metre, cells are at most 31 m apart
    assert np.abs(np.diff(height, axis=0)).max() < 31.0 * 2.0 * np.pi * 300.0 / 1000.0
    again, _ = hills_m(BOUNDS, np.random.default_rng(7))
    other, _ = hills_m(BOUNDS, np.random.default_rng(8))
    assert np.array_equal(height, again)
    assert not np.array_equal(height, other)


def test_hills_written_for_a_map_cover_it(tmp_path) -> None:
    osmium = pytest.importorskip("osmium")
    rasterio = pytest.importorskip("rasterio")
    header = osmium.io.Header()
    header.add_box(osmium.osm.Box(*BOUNDS))
    path = tmp_path / "drawn.osm.pbf"
    with osmium.SimpleWriter(str(path), header=header) as writer:
        writer.add_node(osmium.osm.mutable.Node(id=1, location=BOUNDS[:2]))
    assert map_bounds(path) == pytest.approx(BOUNDS)
    write_hills(path, tmp_path / "hills.tif", 1)
    with rasterio.open(tmp_path / "hills.tif") as raster:
        west, south, east, north = raster.bounds
    assert west < BOUNDS[0]
    assert south < BOUNDS[1]
    assert east > BOUNDS[2]
    assert north > BOUNDS[3]
