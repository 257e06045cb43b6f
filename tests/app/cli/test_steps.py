"""`joulepath route --steps`."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from app.cli.main import cli
from app.cli.step_tables import length_text

ROUTE = ("route", "--start", "46.5,8.003", "--goal", "46.518,8.02", "--soc", "0.5")


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.mark.usefixtures("environment")
def test_steps_are_printed_a_line_each_only_where_asked_for() -> None:
    plain, table = printed(*ROUTE), printed(*ROUTE, "--steps")
    assert "what to do" not in plain
    steps = json.loads(printed(*ROUTE, "--steps", "--json"))["routes"][0]["steps"]
    assert len(steps) > 2
    for step in steps:
        assert step["instruction"] in table


@pytest.mark.parametrize(("distance_m", "text"), [(349.6, "350 m"), (1000.0, "1.0 km"), (2140.0, "2.1 km")])
def test_lengths_are_told_in_metres_below_a_kilometre(distance_m: float, text: str) -> None:
    assert length_text(distance_m) == text
