"""Times of every engine and their ratios, as tables or as JSON."""

from __future__ import annotations

import json
import statistics
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from rich import box
from rich.table import Table

from benchmarks.peers import ours, routee, valhalla
from benchmarks.searches import Spread, spread

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from benchmarks.machine import Machine
    from benchmarks.peers.compare import Rounds
    from benchmarks.peers.questions import EngineAnswer

Part = Literal["whole", "search"]
WHOLE: Final[Part] = "whole"
SEARCH: Final[Part] = "search"
HEADINGS: Final = ("engine", "what", "ms", "ours over it", "target", "km", "kWh", "nodes", "kB")
LEFT_COLUMNS: Final = 2


@dataclass(frozen=True, slots=True)
class Subject:
    """One line of a table: an engine, what of it is timed, and at most which share of that ours shall take."""

    engine: str
    what: str
    part: Part
    target: float | None = None


ROUTES: Final = (
    Subject(ours.NAME, "POST /route, whole request", WHOLE),
    Subject(ours.NAME, "of that the search", SEARCH),
    Subject(routee.NAME, "least energy, search alone", SEARCH, 1 / 20),
    Subject(routee.NAME, "least energy, whole call", WHOLE),
    Subject(valhalla.NAME, "fastest, whole call", WHOLE, 1 / 2),
)
RANGES: Final = (
    Subject(ours.NAME, "GET /range, 3 bands, whole request", WHOLE),
    Subject(ours.NAME, "of that the search", SEARCH),
    Subject(valhalla.NAME, "isochrone, 3 contours, whole call", WHOLE, 1 / 4),
    Subject(routee.NAME, "tree, search alone", SEARCH),
    Subject(routee.NAME, "tree as GeoJSON lines, whole call", WHOLE),
)


@dataclass(frozen=True, slots=True)
class Line:
    """Figures of a subject over all rounds; over: whole answers of ours over it, round by round, None for ours.

    distance_m, energy_kwh, reached, size_bytes: medians, None where the engine does not say.
    """

    subject: Subject
    seconds: Spread
    over: Spread | None
    distance_m: float | None
    energy_kwh: float | None
    reached: float | None
    size_bytes: float

    @property
    def met(self) -> bool | None:
        """Whether the median ratio is within the target; None without one."""
        if self.over is None or self.subject.target is None:
            return None
        return self.over.median <= self.subject.target


@dataclass(frozen=True, slots=True)
class Asked:
    """Lines of one kind of question; rounds: questions that count, left_out: others, which not all engines knew."""

    title: str
    lines: list[Line]
    rounds: int
    left_out: int


@dataclass(frozen=True, slots=True)
class PeerReport:
    """One run; notes: what it had to leave out; load_after: of the machine, over the last minute."""

    machine: Machine
    load_after: float
    versions: dict[str, str]
    seed: int
    asked: list[Asked]
    notes: list[str]


def asked_of(title: str, subjects: Sequence[Subject], rounds: Rounds) -> Asked:
    """The lines of those subjects whose engine took part; none where no question counts."""
    lines = [_line(subject, rounds) for subject in subjects if subject.engine in rounds.names and rounds.answers]
    return Asked(title, lines, len(rounds.answers), rounds.left_out)


def _line(subject: Subject, rounds: Rounds) -> Line:
    column = rounds.names.index(subject.engine)
    own = rounds.names.index(ours.NAME)
    answers = [answered[column] for answered in rounds.answers]
    seconds = np.array([_seconds(answer, subject.part) for answer in answers])
    whole = np.array([_seconds(answered[own], WHOLE) for answered in rounds.answers])
    return Line(
        subject=subject,
        seconds=spread(seconds),
        over=None if column == own else spread(whole / seconds),
        distance_m=_median([answer.distance_m for answer in answers]),
        energy_kwh=_median([answer.energy_kwh for answer in answers]),
        reached=_median([float(reached[column]) for reached in rounds.reached]),
        size_bytes=statistics.median(answer.size_bytes for answer in answers),
    )


def _seconds(answer: EngineAnswer, part: Part) -> float:
    """The time of a part; ValueError where the engine does not time its search apart from the rest."""
    if part == WHOLE:
        return answer.seconds
    if answer.search_s is None:
        raise ValueError("an answer has no time of its search")
    return answer.search_s


def _median(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return statistics.median(known) if known else None


def verdicts(report: PeerReport) -> list[str]:
    """One sentence a target: the median ratio, the target, and whether it is met."""
    return [
        f"{asked.title}, ours over {line.subject.engine}, {line.subject.what}: {_plain(line.over.median)}, "
        f"target <= 1/{1.0 / line.subject.target:g}: {'met' if line.met else 'MISSED'}"
        for asked in report.asked
        for line in asked.lines
        if line.over is not None and line.subject.target is not None
    ]


def report_json(report: PeerReport) -> str:
    """The report as one JSON object, verdicts included."""
    fields = asdict(report)
    for asked, said in zip(report.asked, fields["asked"], strict=True):
        for line, row in zip(asked.lines, said["lines"], strict=True):
            row["met"] = line.met
    return json.dumps(fields, indent=2)


def print_report(report: PeerReport, console: Console) -> None:
    """Print the report as tables."""
    machine = report.machine
    console.print(
        f"{machine.cpu}, {machine.cores} cores, {machine.memory_gb:.0f} GB; Python {machine.python}, "
        f"numpy {machine.numpy}, numba {machine.numba}; load {machine.load:.2f} before, {report.load_after:.2f} after",
    )
    named = "".join(f"; {engine} {version}" for engine, version in report.versions.items())
    console.print(f"vehicle {ours.VEHICLE}; seed {report.seed}{named}")
    for note in report.notes:
        console.print(f"note: {note}", style="yellow", markup=False)
    for asked in report.asked:
        console.print()
        console.print(_table(asked))
    console.print()
    for verdict in verdicts(report):
        console.print(verdict, markup=False)


def _table(asked: Asked) -> Table:
    """A table without the columns in which no engine has a figure."""
    title = f"{asked.title}: {asked.rounds} questions, {asked.left_out} left out; medians, and least..most"
    table = Table(title=title, title_justify="left", title_style="bold", box=box.MARKDOWN)
    rows = [_cells(line) for line in asked.lines]
    shown = [k for k in range(len(HEADINGS)) if any(row[k] for row in rows)]
    for k in shown:
        table.add_column(HEADINGS[k], justify="right" if k >= LEFT_COLUMNS else "left", overflow="fold")
    for row in rows:
        table.add_row(*(row[k] for k in shown))
    return table


def _cells(line: Line) -> tuple[str, ...]:
    """One cell a heading, empty where there is no figure."""
    target = line.subject.target
    return (
        line.subject.engine,
        line.subject.what,
        _spread(line.seconds, 1e3),
        "" if line.over is None else _spread(line.over, 1.0),
        "" if target is None else f"1/{1.0 / target:g} {'met' if line.met else 'MISSED'}",
        "" if line.distance_m is None else f"{line.distance_m / 1e3:.1f}",
        "" if line.energy_kwh is None else f"{line.energy_kwh:.2f}",
        "" if line.reached is None else f"{line.reached:.0f}",
        f"{line.size_bytes / 1e3:.0f}",
    )


def _spread(figures: Spread, unit: float) -> str:
    median, least, most = (_plain(unit * x) for x in (figures.median, figures.least, figures.most))
    return f"{median} ({least}..{most})"


def _plain(value: float) -> str:
    """Three significant digits, without an exponent."""
    return f"{float(f'{value:.3g}'):g}" if value < 1e6 else f"{value:.0f}"
