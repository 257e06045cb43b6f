"""Figures of the table from hand-made cases."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from proof.answers import Rule, Spot, read_answer, write_answer
from proof.figures import Figure, Target, drawn, gap_closed, missed, rms_ratio, share
from proof.runs import Proof
from proof.scores import compared, figures
from proof.scoring import Case
from proof.telling import as_json, figure_row, markdown
from proof.worlds.world import FaultTruth, OutsideTruth, WorldKind
from tests.proof.made_up import HELD_OUT, answer, claim, label, trip

if TYPE_CHECKING:
    from pathlib import Path


def cases() -> list[Case]:
    """A world or two of each kind; the tool is wrong on one null world, blind on one effect and lost outside."""
    predicted = answer(
        claim("thermal", energy_kwh=1.0),
        trips=(trip("T1"), *(trip(name, before=2.4, after=2.11) for name in HELD_OUT)),
    )
    ruled = replace(predicted, rules=(Rule("other", ("rolling", "thermal"), (2.2, 2.2)),))
    return [
        Case(label(WorldKind.NULL), answer(claim("wind"))),
        Case(label(WorldKind.NULL), answer(spots=(Spot("soc", 40.0, 50.0, 300.0),))),
        Case(label(WorldKind.NULL), answer()),
        Case(
            label(WorldKind.NULL_WRONG_PARAMETERS, changes={"mass_kg": 1.1}),
            answer(parameters=("mass_kg", "drive_eff")),
        ),
        Case(label(WorldKind.SINGLE, "thermal"), ruled, Rule("oracle", ("thermal",), (2.1, 2.1))),
        Case(label(WorldKind.SINGLE, "rolling"), answer()),
        Case(label(WorldKind.SINGLE, "thermal", share=0.12), answer(claim("rolling", "thermal"))),
        Case(label(WorldKind.CONFOUNDED, "thermal", confounded_with=("rolling",)), answer(claim("thermal", "rolling"))),
        Case(label(WorldKind.CONFOUNDED_SEPARATED, "thermal"), answer(claim("thermal", energy_kwh=1.3))),
        Case(
            label(WorldKind.OUTSIDE, outside=OutsideTruth("speed", 50.0, 60.0, 900.0, "km/h")),
            answer(spots=(Spot("speed", 80.0, 90.0, 500.0),)),
        ),
        Case(label(WorldKind.FEW_TRIPS), answer(verdict="too_few_trips")),
        Case(label(WorldKind.FASTSIM, "thermal", share=0.3), predicted),
    ]


def found(name: str, group: str = "") -> Figure:
    own = [figure for figure in figures(cases()) if figure.name == name and group in figure.group]
    assert len(own) == 1
    return own[0]


@pytest.mark.parametrize(
    ("group", "name", "successes", "trials", "met"),
    [
        ("nothing", "a false finding", 1, 3, False),
        ("nothing", "a false finding, or something unexplained", 2, 3, None),
        ("nothing", "wrong parameters: a false finding", 0, 1, True),
        ("nothing", "wrong parameters: a parameter error is told", 1, 1, None),
        ("nothing", "wrong parameters: told parameters that are off indeed", 1, 2, None),
        ("recall", "one effect of 5 %: named clearly", 1, 2, False),
        ("recall", "one effect of 12 %: named clearly", 0, 1, False),
        ("recall", "one effect of 12 %: named or among rivals", 1, 1, True),
        ("by family", "thermal: named clearly", 1, 2, None),
        ("by effect", "`true_rolling`: named clearly", 0, 1, None),
        ("false families", "all worlds but outside ones", 1, 5, False),
        ("false families", "worlds with an effect", 0, 4, None),
        ("confounded", "says that it cannot tell", 1, 1, True),
        ("confounded", "names the true one clearly", 0, 1, None),
        ("confounded", "resolves it with the separating recording", 1, 1, True),
        ("outside", "flagged", 1, 1, True),
        ("outside", "located", 0, 1, False),
        ("outside", "misattributed", 0, 1, True),
        ("intervals", "95 % intervals hold the true energy", 1, 4, False),
        ("few", "says too few, concludes nothing", 1, 1, None),
        ("fastsim", "climate: thermal named clearly", 1, 1, None),
        ("all worlds", "the tool broke", 0, 12, True),
    ],
)
def test_figures_count_what_their_rule_says(
    group: str, name: str, successes: int, trials: int, met: bool | None
) -> None:
    figure = found(name, group)
    assert (figure.successes, figure.trials, figure.met) == (successes, trials, met)


def test_held_out_energies_are_held_against_the_oracle_and_the_base() -> None:
    """All errors are those of one world: 0.11 kWh of the tool, 0.4 of the base, 0.1 of the oracle."""
    assert found("RMS over the oracle's, 1 worlds").value == pytest.approx(1.1)
    closed = found("gap from base to oracle closed")
    assert (closed.value, closed.met) == (pytest.approx(29.0 / 30.0), True)


def test_rules_are_compared_on_worlds_on_which_they_were_asked() -> None:
    lines = {line.rule: line for line in compared(cases())}
    assert lines["other"].rms_ratio.value == pytest.approx(2.0)
    assert (lines["other"].false_families.successes, lines["other"].false_families.trials) == (1, 2)
    assert lines["base refitted"].rms_ratio.value == pytest.approx(4.0)
    assert lines["base refitted"].recall.value == 0.0
    assert lines["joulepath"].recall.value == 1.0
    assert (lines["oracle"].rms_ratio.value, lines["oracle"].recall.value) == (1.0, None)


def test_a_share_has_wilsons_interval_and_none_without_trials() -> None:
    """Wilson 1927 for 9 of 10: 0.596 to 0.982."""
    figure = share("g", "n", [True] * 9 + [False], Target(low=0.95))
    assert (figure.low, figure.high) == (pytest.approx(0.596, abs=1e-3), pytest.approx(0.982, abs=1e-3))
    assert figure.met is False
    assert share("g", "n", [], Target(low=0.95)).met is None


def test_targets_have_two_sides() -> None:
    both = Target(0.9, 0.98)
    assert [both.met(value) for value in (0.89, 0.9, 0.98, 0.99)] == [False, True, True, False]


def test_ratio_and_gap_are_of_root_mean_squares_over_worlds() -> None:
    """Two worlds: mean squares of 4 and 12 (tool), 32 and 32 (base), 1 and 3 (oracle), so roots of 8, 32 and 2."""
    rows = np.array([[4.0, 32.0, 1.0], [12.0, 32.0, 3.0]])
    assert rms_ratio(rows[:, [0, 2]]) == pytest.approx(2.0)
    assert gap_closed(rows) == pytest.approx((32.0**0.5 - 8.0**0.5) / (32.0**0.5 - 2.0**0.5))


def test_a_drawn_interval_holds_the_figure_and_is_the_same_every_time() -> None:
    rows = np.arange(20.0).reshape(-1, 1)
    once, again = (drawn("g", "n", rows, lambda chosen: float(chosen.mean())) for _ in range(2))
    assert once == again
    assert once.low is not None
    assert once.high is not None
    assert once.low < 9.5 < once.high


def test_a_missed_target_is_shown_as_missed_everywhere() -> None:
    in_order = figures(cases())
    proof = Proof("small", 1, "5ea1", "7001", 12, 1, 1, in_order, compared(cases()), None, 90.0)
    assert figure_row(found("located"))[1:] == ("0.0 %", "0/1", "0.0 % .. 79.3 %", "≥ 80.0 %", "MISSED")
    text = markdown(proof)
    assert "| located | 0.0 % | 0/1 | 0.0 % .. 79.3 % | ≥ 80.0 % | MISSED |" in text
    assert text.count("MISSED") == len(missed(in_order)) > 3
    assert "1 orders could not be made" in text
    read = json.loads(json.dumps(as_json(proof), allow_nan=False))
    assert sum(figure["met"] is False for figure in read["figures"]) == len(missed(in_order))
    assert "real drives as carriers" not in text  # nothing there to show


def test_an_answer_is_read_as_it_was_written(tmp_path: Path) -> None:
    for k, case in enumerate(cases()):
        write_answer(case.answer, tmp_path / "new" / f"{k}.json")
        assert read_answer(tmp_path / "new" / f"{k}.json") == case.answer
    aged = replace(answer(), capacity_frac=(0.9, 0.88, 0.92))
    write_answer(aged, tmp_path / "aged.json")
    assert read_answer(tmp_path / "aged.json") == aged


def test_a_capacity_is_false_but_where_the_battery_has_aged() -> None:
    aged = replace(answer(), capacity_frac=(0.9, 0.88, 0.92))
    old = replace(label(WorldKind.FAULT), fault=FaultTruth("aged", (), 0.91))
    told = figures([Case(old, aged), Case(old, answer()), Case(label(WorldKind.NULL), aged)])
    rows = {figure.name: (figure.successes, figure.trials) for figure in told if figure.group == "the field"}
    assert rows["a battery that holds 8 to 25 % less: told, within 3 points of its interval"] == (1, 2)
    assert rows["no aged battery, all worlds: a capacity is told"] == (1, 1)
    assert rows["nothing left out, whatever the channels and the file: a false finding or parameter"] == (1, 3)
