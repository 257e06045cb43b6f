"""The dotted names by which parts of an answer are asked for."""

from __future__ import annotations

from difflib import get_close_matches
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Final, get_args

from pydantic import BaseModel, Field

from app.schemas.base import refusal

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

MOST_FIELDS: Final = 200
MOST_NAME_CHARS: Final = 200
WHOLE: Final = frozenset({"geometry", "map_edge", "request"})  # which are not asked for in parts
MOST_NAMED: Final = 3  # names that an unknown one may stand for
LEAST_LIKE: Final = 0.6
PICKED_MEANS: Final = (
    "dotted names of what the answer is to have, such as routes.distance_m (docs/answers.md); what is not named is "
    "missing then, also where the schema of whole answers demands it"
)
Picked = Annotated[
    list[Annotated[str, Field(max_length=MOST_NAME_CHARS)]] | None,
    Field(default=None, min_length=1, max_length=MOST_FIELDS, description=PICKED_MEANS, examples=[None]),
]


@cache
def names_of(answer: type[BaseModel]) -> tuple[str, ...]:
    """All dotted names of an answer's parts, in its order; the items of a list have that of the list."""
    return tuple(dict.fromkeys(_names(answer)))


def _names(answer: type[BaseModel], before: str = "") -> Iterator[str]:
    for field, info in answer.model_fields.items():
        name = info.alias or field
        yield before + name
        if name not in WHOLE:
            for inner in _models(info.annotation):
                yield from _names(inner, f"{before}{name}.")


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def check_names(asked: Iterable[str] | None, answer: type[BaseModel]) -> None:
    """Refuse a name that an answer has not, naming those most like it."""
    known = names_of(answer)
    for k, name in enumerate(asked or ()):
        if name not in known:
            likely = _likely(name, known)
            question = f"; did you mean {' or '.join(likely)}?" if likely else ""
            raise refusal(f"fields[{k}]", name, f"a name of docs/answers.md{question}")


def _likely(name: str, known: Sequence[str]) -> list[str]:
    """Names that end as this one does, the shortest paths first, then those that are spelled like it."""
    by_path = sorted(known, key=lambda other: other.count("."))
    last = _last(name)
    ends = {last} & {_last(other) for other in known} or set(
        get_close_matches(last, {_last(other): None for other in known}, n=1, cutoff=LEAST_LIKE)
    )
    ending = [other for other in by_path if _last(other) in ends]
    alike = get_close_matches(name, known, n=MOST_NAMED, cutoff=LEAST_LIKE)
    return list(dict.fromkeys([*alike[:1], *ending, *alike]))[:MOST_NAMED]


def _last(name: str) -> str:
    return name.rpartition(".")[2]
