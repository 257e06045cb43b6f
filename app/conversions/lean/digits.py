"""Answers in few digits."""

from __future__ import annotations

from typing import Any, Final

from pydantic import BaseModel

from app.schemas.as_json import fields_of

DIGITS: Final = 6
PARTS: Final = "energy_parts_"
# coordinates have decimals of their own, and a request can be sent again only as it was sent
EXACT: Final = frozenset({"bbox", "coordinates", "geometry", "lat", "lon", "map_edge", "request"})


def compacted(value: Any) -> Any:
    """An answer with its figures to six significant digits, without parts of an energy that are 0."""
    if isinstance(value, float):
        return rounded(value)
    if isinstance(value, BaseModel):
        value = fields_of(value)
    if isinstance(value, dict):
        return {name: _member(name, item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [compacted(item) for item in value]
    return value


def rounded(figure: float) -> float:
    """A figure to six significant digits."""
    return float(f"{figure:.{DIGITS}g}")


def _member(name: str, item: Any) -> Any:
    if name in EXACT:
        return item
    if name.startswith(PARTS) and isinstance(item, dict):
        return {part: rounded(energy) for part, energy in item.items() if energy != 0.0}
    return compacted(item)
