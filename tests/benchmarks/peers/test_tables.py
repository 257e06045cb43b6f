"""Ratios, verdicts and the printed tables."""

from __future__ import annotations

import io
import json

import pytest
from rich.console import Console

from benchmarks.machine import this_machine
from benchmarks.peers.compare import Rounds
from benchmarks.peers.questions import EngineAnswer
from benchmarks.peers.tables import RANGES, ROUTES, PeerReport, asked_of, print_report, report_json, verdicts

OURS, ROUTEE, VALHALLA = "joulepath", "RouteE Compass", "Valhalla"


def route(seconds, search_s, distance_m=30_000.0) -> EngineAnswer:
    return EngineAnswer(seconds=seconds, search_s=search_s, size_bytes=2_000, distance_m=distance_m, energy_kwh=4.0)


def routes() -> Rounds:
    # ours over RouteE's search: 0.05, 0.1, 0.025; over Valhalla's call: 1, 2, 0.5
    answers = [
        [route(0.010, 0.004), route(0.25, 0.2), EngineAnswer(seconds=0.010, size_bytes=3_000)],
        [route(0.020, 0.005), route(0.25, 0.2), EngineAnswer(seconds=0.010, size_bytes=3_000)],
        [route(0.005, 0.003), route(0.25, 0.2), EngineAnswer(seconds=0.010, size_bytes=3_000)],
    ]
    return Rounds((OURS, ROUTEE, VALHALLA), answers, [], 1)


def ranges() -> Rounds:
    answers = [
        [EngineAnswer(seconds=0.02, search_s=0.01, size_bytes=5_000), EngineAnswer(seconds=0.1, size_bytes=1_000)]
    ]
    return Rounds((OURS, VALHALLA), answers, [[700, 690]], 0)


def report() -> PeerReport:
    asked = [asked_of("route of 25 km", ROUTES, routes()), asked_of("range as far as 15 min", RANGES, ranges())]
    return PeerReport(this_machine(), 0.5, {ROUTEE: "0.19.5", VALHALLA: "3.9.1"}, 1, asked, ["Engine left out: none"])


def test_ratios_are_of_our_whole_answer_round_by_round() -> None:
    own, own_search, search, whole, fastest = asked_of("routes", ROUTES, routes()).lines
    assert own.over is None
    assert own_search.over is None
    assert (own.seconds.median, own_search.seconds.median) == (0.010, 0.004)
    assert search.over is not None
    assert search.over.median == pytest.approx(0.05)
    assert (search.over.least, search.over.most) == pytest.approx((0.025, 0.1))
    assert whole.seconds.median == 0.25
    assert fastest.over is not None
    assert fastest.over.median == pytest.approx(1.0)
    assert fastest.distance_m is None


def test_targets_hold_at_their_limit_and_not_above_it() -> None:
    _, _, search, whole, fastest = asked_of("routes", ROUTES, routes()).lines
    assert search.met is True  # 0.05 of at most 1/20
    assert fastest.met is False  # 1 of at most 1/2
    assert whole.met is None  # has no target


def test_engines_that_took_no_part_have_no_lines() -> None:
    asked = asked_of("ranges", RANGES, ranges())
    assert [line.subject.engine for line in asked.lines] == [OURS, OURS, VALHALLA]
    assert asked_of("ranges", RANGES, Rounds((OURS,), [], [], 3)).lines == []


def test_search_time_that_an_engine_does_not_tell_is_an_error() -> None:
    with pytest.raises(ValueError, match="has no time of its search"):
        asked_of("ranges", RANGES, Rounds((OURS,), [[EngineAnswer(seconds=0.1)]], [[1]], 0))


def test_verdicts_name_every_target_once() -> None:
    assert verdicts(report()) == [
        "route of 25 km, ours over RouteE Compass, least energy, search alone: 0.05, target <= 1/20: met",
        "route of 25 km, ours over Valhalla, fastest, whole call: 1, target <= 1/2: MISSED",
        "range as far as 15 min, ours over Valhalla, isochrone, 3 contours, whole call: 0.2, target <= 1/4: met",
    ]


def test_printed_report_has_the_tables_and_no_columns_without_figures() -> None:
    page = Console(file=io.StringIO(), record=True, width=160)
    print_report(report(), page)
    printed = page.export_text()
    assert "RouteE Compass 0.19.5; Valhalla 3.9.1" in printed
    assert "note: Engine left out: none" in printed
    first, second = (line for line in printed.splitlines() if line.startswith("| engine"))
    assert [cell.strip() for cell in first.strip("|").split("|")][-3:] == ["km", "kWh", "kB"]
    assert [cell.strip() for cell in second.strip("|").split("|")][-2:] == ["nodes", "kB"]
    row = next(line for line in printed.splitlines() if line.startswith("| Valhalla"))
    assert [cell.strip() for cell in row.strip("|").split("|")] == [
        "Valhalla",
        "fastest, whole call",
        "10 (10..10)",
        "1 (0.5..2)",
        "1/2 MISSED",
        "",
        "",
        "3",
    ]


def test_json_has_the_verdicts() -> None:
    fields = json.loads(report_json(report()))
    assert [line["met"] for line in fields["asked"][0]["lines"]] == [None, None, True, None, False]
    assert fields["asked"][1]["lines"][2]["over"]["median"] == pytest.approx(0.2)
    assert fields["notes"] == ["Engine left out: none"]
