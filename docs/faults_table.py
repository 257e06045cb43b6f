"""`python -m docs.faults_table` runs the tests of all faults and renews the table of faults.md with what they found."""

from __future__ import annotations

import ast
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest

from tests.faults.faults import FAULTS

ROOT: Final = Path(__file__).resolve().parents[1]
PAGE: Final = ROOT / "docs" / "faults.md"
MARKS: Final = ("<!-- faults -->", "<!-- /faults -->")
FOUND: Final = "now"  # the property of a test that says what came of a fault


@dataclass(frozen=True, slots=True)
class ShownBy:
    """A test that shows what came of some faults: its file and name, and what its mark says of it."""

    file: Path
    name: str
    keys: tuple[str, ...]
    now: str


def shown_by() -> list[ShownBy]:
    """All tests that are marked with faults, in the order of their files; raises KeyError for an unknown fault."""
    found = []
    for file in sorted((ROOT / "tests").rglob("test_*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            for mark in getattr(node, "decorator_list", []):
                if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.fault":
                    keys = tuple(ast.literal_eval(key) for key in mark.args)
                    for key in keys:
                        FAULTS[key]
                    named = {word.arg: ast.literal_eval(word.value) for word in mark.keywords}
                    found.append(ShownBy(file, getattr(node, "name", ""), keys, named.get(FOUND, "")))
    return found


class Found:
    """A plugin of pytest that keeps what tests found, by their names."""

    def __init__(self) -> None:
        self.texts: dict[str, list[str]] = defaultdict(list)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take the property of a test that has passed."""
        if report.when == "call" and report.passed:
            name = report.location[2].partition("[")[0]
            self.texts[name] += [str(text) for key, text in report.user_properties if key == FOUND]


def rows(tests: list[ShownBy], texts: dict[str, list[str]]) -> list[str]:
    """Lines of the table."""
    lines = ["| fault | before | now | shown by |", "|---|---|---|---|"]
    for key, fault in FAULTS.items():
        own = [test for test in tests if key in test.keys]
        now = dict.fromkeys(text for test in own for text in (*([test.now] if test.now else []), *texts[test.name]))
        names = [f"[`{test.name}`](../{test.file.relative_to(ROOT).as_posix()})" for test in own]
        lines.append(f"| {fault.done} | {fault.before} | {'; '.join(now) or '–'} | {', '.join(names) or '–'} |")
    return lines


def main(arguments: list[str]) -> int:
    """Run the tests and write the page; the exit status is that of the tests."""
    tests, found = shown_by(), Found()
    files: list[Any] = sorted({test.file for test in tests})
    status = pytest.main(["-q", "-m", "fault", "-p", "no:cacheprovider", *arguments, *map(str, files)], plugins=[found])
    if status == pytest.ExitCode.OK:
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(MARKS[0])
        table = "\n".join(rows(tests, found.texts))
        PAGE.write_text(f"{before}{MARKS[0]}\n{table}\n{MARKS[1]}{rest.partition(MARKS[1])[2]}", encoding="utf-8")
    return int(status)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
