"""docs/faults.md is the table that docs/faults_table.py writes of the tests there are."""

from __future__ import annotations

from docs.faults_table import MARKS, PAGE, rows, shown_by
from tests.faults.faults import FAULTS


def test_page_names_every_fault_and_its_tests_as_they_are() -> None:
    table = PAGE.read_text(encoding="utf-8").partition(MARKS[0])[2].partition(MARKS[1])[0].strip().splitlines()
    written = rows(shown_by(), {test.name: [] for test in shown_by()})
    assert table[:2] == written[:2]
    assert len(table) == len(FAULTS) + 2
    for line, current in zip(table[2:], written[2:], strict=True):
        done, before, _, names = cells(line)  # what was found depends on the machine
        current_done, current_before, _, current_names = cells(current)
        assert (done, before, names) == (current_done, current_before, current_names)


def cells(line: str) -> list[str]:
    return line.removeprefix("| ").removesuffix(" |").split(" | ")
