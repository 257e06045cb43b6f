"""Colours of GeoJSON features by simplestyle-spec 1.1, those of our own map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

ROUTES: Final = {"eco": "#0b7a55", "fastest": "#b3421b", "balanced": "#5a3fb5"}
FURTHER: Final = ("#0b7a55", "#b3421b", "#5a3fb5", "#1f5fa8", "#b8860b", "#8a2b6b")  # by position
BEYOND: Final = "#8a9293"  # a route that the charge does not suffice for
# viridis (CC0) from its middle to its ends, told apart by people who are colour-blind; light to dark inwards
BANDS: Final = ("#fde725", "#8fd744", "#35b779", "#21918c", "#31688e", "#443983")
ALONE: Final = 2  # of BANDS
MARKERS: Final = {
    "start": "#0b7a55",
    "origin": "#0b7a55",
    "via": "#5a3fb5",
    "stop": "#1f5fa8",
    "halt": "#6f8fb5",
    "goal": "#b3421b",
}


def route_colour(name: str, position: int, *, feasible: bool) -> str:
    """The stroke of a route among others."""
    return ROUTES.get(name, FURTHER[position % len(FURTHER)]) if feasible else BEYOND


def band_colours(levels: Sequence[float]) -> list[str]:
    """The fill of each band; levels: of what bands are ordered by, growing inwards."""
    known = sorted(set(levels))
    if len(known) < 2:
        return [BANDS[ALONE]] * len(levels)
    return [BANDS[round(known.index(level) * (len(BANDS) - 1) / (len(known) - 1))] for level in levels]
