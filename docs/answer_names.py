"""The names of parts of answers on docs/answers.md, written from the schemas: `python -m docs.answer_names`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.schemas.lean.names import names_of
from app.schemas.matrix import MatrixResponse
from app.schemas.range import RangeFeatureCollection
from app.schemas.route import RouteResponse

if TYPE_CHECKING:
    from pydantic import BaseModel

PAGE: Final = Path(__file__).resolve().parent / "answers.md"
PLACE: Final = re.compile(r"(<!-- names -->\n).*?(<!-- /names -->)", re.DOTALL)
ANSWERS: Final = {"/route": RouteResponse, "/range": RangeFeatureCollection, "/matrix": MatrixResponse}


def names_table(answer: type[BaseModel]) -> str:
    """All names of an answer as Markdown, a row for each part that has parts."""
    parts: dict[str, list[str]] = {}
    for name in names_of(answer):
        before, _, last = name.rpartition(".")
        parts.setdefault(before, []).append(last)
    rows = [f"| {f'`{before}.`' if before else 'the whole'} | {', '.join(names)} |" for before, names in parts.items()]
    return "\n".join(["| of | names |", "| --- | --- |", *rows])


def with_names(page: str) -> str:
    """The page with the names of today."""
    written = "\n\n".join(f"Of `{path}`:\n\n{names_table(answer)}" for path, answer in ANSWERS.items())
    return PLACE.sub(lambda found: f"{found[1]}{written}\n{found[2]}", page)


if __name__ == "__main__":
    PAGE.write_text(with_names(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
