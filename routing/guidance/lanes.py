"""Lanes before a junction, and which of them lead on."""

from __future__ import annotations

from typing import Final

from routing.guidance.step import Lane

# Arrows of the wiki's page Key:turn in the words of OSRM's lanes, and where each points [deg].
_ARROWS: Final = {
    "": ("none", 0.0),
    "none": ("none", 0.0),
    "through": ("straight", 0.0),
    "left": ("left", -90.0),
    "slight_left": ("slight left", -35.0),
    "sharp_left": ("sharp left", -140.0),
    "right": ("right", 90.0),
    "slight_right": ("slight right", 35.0),
    "sharp_right": ("sharp right", 140.0),
    "reverse": ("uturn", -180.0),
    "merge_to_left": ("straight", 0.0),
    "merge_to_right": ("straight", 0.0),
}
MOST_LANES: Final = 16
SAME_DEG: Final = 1.0
FAR_DEG: Final = 60.0  # an arrow that points further off is not of this turn (assumed)


def lanes_for(turn_lanes: str, turn_deg: float) -> tuple[Lane, ...]:
    """Lanes from left to right, of a tag `turn:lanes`, valid where an arrow is the nearest of all to the turn.

    Empty where nothing is tagged, and where no lane has an arrow.
    """
    if not turn_lanes:
        return ()
    rows = [[part.strip() for part in lane.split(";")] for lane in turn_lanes.lower().split("|")]
    known = [[arrow for arrow in row if arrow in _ARROWS] for row in rows]
    if len(rows) > MOST_LANES or not any(arrow not in ("", "none") for row in known for arrow in row):
        return ()
    off = [[_off(arrow, turn_deg) for arrow in row] for row in known]
    least = min(value for row in off for value in row)
    if least > FAR_DEG:  # no arrow points there: lanes without one may lead there
        plain = [any(arrow in ("", "none") for arrow in row) for row in known]
        off = [[0.0 if is_plain else 180.0] for is_plain in plain] if any(plain) else off
        least = min(value for row in off for value in row)
    return tuple(
        Lane(
            tuple(dict.fromkeys(_ARROWS[arrow][0] for arrow in row)) or ("none",),
            any(value <= least + SAME_DEG for value in values),
        )
        for row, values in zip(known, off, strict=True)
    )


def _off(arrow: str, turn_deg: float) -> float:
    """How far an arrow points from a turn [deg]; one that points back does so to either side."""
    points = _ARROWS[arrow][1]
    return abs(points - turn_deg) if abs(points) < 180.0 else 180.0 - abs(turn_deg)
