"""The measurements on graphs of many sizes run and say what they should; no time is asserted."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.graphs import Made
from benchmarks.machine import this_machine
from benchmarks.run import main
from benchmarks.scale.opening import ArraySize, Opened, Step
from benchmarks.scale.pairs import APART_M, WITHIN_FRAC, draw_pairs
from benchmarks.scale.regions import RegionShape, kept_region, shape_of
from benchmarks.scale.report import scale_json, verdicts
from benchmarks.scale.run import MOST_SOURCES, ScaleReport, SizeFigures, scale_settings
from benchmarks.scale.searches import AllFigures, RouteFigures, Searched
from benchmarks.searches import Spread
from routing.graph.earth import great_circle_m
from routing.graph.files import load_graph
from routing.graph.road_graph import RoadGraph
from routing.synth import synthesize

TINY = ["--scale", "--scale-links", "2000", "--sources", "1", "--repeat", "1", "--pairs", "2", "--ranges", "1"]
STEPS = [
    "load",
    "first place on a road",
    "vehicle and conditions",
    "room for least costs",
    "first route of 25 km",
    "same route again",
    "one to all",
    "one to all again",
]


@pytest.fixture(scope="module")
def region() -> RoadGraph:
    return synthesize("tiny", seed=3, width_km=None, height_km=None, links_target=2000)


def flat(value: float) -> Spread:
    return Spread(value, value, value, value, value)


def figures(links: int, load_s: float, route_s: float, all_s: float) -> SizeFigures:
    shape = RegionShape(links / 2.6, 2.6, 0.8, 290.0, 1.5, 6.0, 0.4)
    routes = RouteFigures(flat(route_s), flat(2e-3), flat(1e-3), flat(1e-4), flat(5000.0))
    return SizeFigures(
        made=Made("drawn", "synth", links // 2, links, 1.0, 0.1, 2.0, 100.0, 200.0, 12.0),
        kept=False,
        load_s=flat(load_s),
        load_processor_s=flat(load_s),
        opened=Opened(
            100.0, 300.0, tuple(Step(name, 1.0, 1.0, 1.0, 1.0) for name in STEPS), (ArraySize("graph", "a", 8),)
        ),
        searched=Searched(shape, routes, AllFigures(*(flat(all_s) for _ in range(4)), 1.1, 9), flat(0.1)),
    )


def report(*sizes: SizeFigures) -> ScaleReport:
    return ScaleReport(this_machine(), 0.0, scale_settings((1,), 1, 2, 3, 99, 4), sizes)


def test_run_measures_a_region_and_keeps_it(tmp_path, capsys) -> None:
    assert main([*TINY, "--scale-cache", str(tmp_path), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    (size,) = printed["sizes"]
    links = size["made"]["links"]
    assert 1000 < links < 3000
    assert size["kept"] is False
    assert size["searched"]["shape"]["links_per_km2"] == pytest.approx(2.6, rel=0.5)
    opened = size["opened"]
    assert [step["name"] for step in opened["steps"]] == STEPS
    assert opened["peak_mb"] >= opened["before_mb"] > 0.0
    sizes = {(array["kind"], array["name"]): array["size_bytes"] for array in opened["arrays"]}
    # 8 numbers of 8 bytes a link; one of 4 bytes; and labels of which there is room for two a link and some more
    assert sizes["space", "row"] == sizes["space", "roads"] == 64 * links
    assert sizes["graph", "tail"] == 4 * links
    assert sizes["workspace", "number"] >= 64 * 2 * links
    assert ("space", "length_m") not in sizes
    searched = size["searched"]
    assert searched["routes"]["labels_settled"]["median"] > 10
    assert searched["to_all"]["labels_per_link"] >= 1.0
    assert searched["to_all"]["rows"] > links
    for name in ("whole_s", "first_s", "again_s", "snap_s"):
        assert 0.0 < searched["routes"][name]["least"] <= searched["routes"][name]["most"]
    made, folder, kept = kept_region(tmp_path, 2000, 1)
    assert kept
    assert made.links == links == load_graph(folder).link_count


def test_report_of_two_sizes_judges_growth_and_loading() -> None:
    small, large = figures(100_000, 0.1, 4e-3, 0.05), figures(1_000_000, 0.5, 5e-3, 0.5)
    assert verdicts(report(small, large)) == (
        "load: 0.50 s at most, target <= 2 s: met",
        "route of 25 km, largest over smallest graph: 1.25, target <= 1.25: met",
        "one to all grows with the links to the power of 1.00, target <= 1.2: met",
    )
    slow = figures(1_000_000, 2.5, 8e-3, 5.0)
    assert [line.rsplit(" ", 1)[1] for line in verdicts(report(small, slow))] == ["missed"] * 3
    fields = json.loads(scale_json(report(small, slow)))
    assert [size["load_met"] for size in fields["sizes"]] == [True, False]
    # ten times the links and a hundred times as long
    assert fields["exponent"] == pytest.approx(2.0)
    assert fields["settings"]["sources"] == MOST_SOURCES


def test_pairs_are_as_far_apart_as_asked_and_repeat_with_the_seed(region) -> None:
    pairs = draw_pairs(region, 20, np.random.default_rng(5))
    for pair in pairs:
        a, b = pair.start, pair.goal
        apart_m = float(great_circle_m(a.lat_deg, a.lon_deg, b.lat_deg, b.lon_deg))
        assert abs(apart_m - APART_M) <= WITHIN_FRAC * APART_M + 1e-6
    assert pairs == draw_pairs(region, 20, np.random.default_rng(5))
    assert pairs != draw_pairs(region, 20, np.random.default_rng(6))


def test_pairs_farther_apart_than_the_map_is_large_are_refused(region) -> None:
    with pytest.raises(ValueError, match="hardly any nodes are 500 km apart"):
        draw_pairs(region, 2, np.random.default_rng(5), apart_m=500e3)


def test_shape_of_a_region_is_that_of_its_arrays(region) -> None:
    shape = shape_of(region)
    assert shape.links_per_km2 * shape.area_km2 == pytest.approx(region.link_count)
    assert shape.link_m * region.link_count / 1000.0 == pytest.approx(shape.road_km_per_km2 * shape.area_km2)
    assert shape.turns * region.link_count == pytest.approx(region.successor.size)
