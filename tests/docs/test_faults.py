"""docs/faults.md is the table that docs/faults_table.py writes of the tests there are."""

from __future__ import annotations

import re

from docs.faults_table import MARKS, PAGE, rows, shown_by
from tests.faults.faults import FAULTS


def test_page_names_every_fault_and_its_tests_as_they_are() -> None:
    table = PAGE.read_text(encoding="utf-8").partition(MARKS[0])[2].partition(MARKS[1])[0].strip().splitlines()
    written = rows(shown_by(), {test.name: [] for test in shown_by()})
    assert len(table) == len(FAULTS) + 2
    for line, current in zip(table, written, strict=True):
        for column in (1, 2, -2):  # what was found depends on the machine
            assert cells(line)[column] == cells(current)[column]


def cells(line: str) -> list[str]:
    return re.split(r" \| |^\| | \|$", line)
