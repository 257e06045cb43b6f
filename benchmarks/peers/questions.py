"""What engines are asked and what they answer, and how a process of its own is asked line by line.

The environments of the peers run this file too: it imports the standard library alone.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

Place = tuple[float, float]  # latitude, longitude [deg]
READY: Final = "ready"


@dataclass(frozen=True, slots=True)
class Question:
    """A route where there is a goal, otherwise what can be reached from the start.

    budget: of a range, in the engine's own measure: minutes with Valhalla, otherwise the charge at departure, 0..1.
    """

    start: Place
    goal: Place | None = None
    budget: float = 0.0


@dataclass(frozen=True, slots=True)
class EngineAnswer:
    """One answer; seconds: the whole call; search_s: of that the search, None where the engine does not say.

    distance_m, energy_kwh, ends: of a route; without ends the engine itself refuses what is far from its roads.
    reached: nodes of the engine's own graph, shape: coordinates of a GeoJSON MultiPolygon; of a range, as it has them.
    refused: why there is no answer.
    """

    seconds: float = 0.0
    search_s: float | None = None
    size_bytes: int = 0
    distance_m: float | None = None
    energy_kwh: float | None = None
    ends: tuple[Place, Place] | None = None
    reached: int | None = None
    shape: list[Any] | None = None
    refused: str | None = None


class Engine(Protocol):
    """Anything that answers questions."""

    def ask(self, question: Question) -> EngineAnswer:
        """The answer, which may be a refusal."""


def line_of(sent: Question | EngineAnswer) -> str:
    """One line of JSON."""
    return json.dumps(asdict(sent)) + "\n"


def question_of(line: str) -> Question:
    """A question as it was before line_of."""
    fields = json.loads(line)
    goal = fields["goal"]
    return Question(_place(fields["start"]), None if goal is None else _place(goal), fields["budget"])


def answer_of(line: str) -> EngineAnswer:
    """An answer as it was before line_of."""
    fields = json.loads(line)
    ends = fields.pop("ends")
    return EngineAnswer(ends=None if ends is None else (_place(ends[0]), _place(ends[1])), **fields)


def serve(load: Callable[[], Callable[[Question], EngineAnswer]]) -> None:
    """Load an engine, say so, and answer one question a line until there are no more.

    Whatever an engine's libraries print goes to stderr; any error of theirs is a refusal.
    """
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as out:
        os.dup2(2, 1)
        ask = load()
        print(READY, file=out, flush=True)
        for line in sys.stdin:
            try:
                answer = ask(question_of(line))
            except Exception as error:  # of a foreign library: all that matters is that there is no answer
                answer = EngineAnswer(refused=f"{type(error).__name__}: {error}")
            out.write(line_of(answer))
            out.flush()


def _place(pair: list[float]) -> Place:
    return pair[0], pair[1]
