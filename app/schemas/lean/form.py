"""How lines and numbers of an answer are written."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

COMPACT_MEANS: Final = (
    "true rounds figures to six significant digits and leaves out parts of the energy that are 0, false does neither; "
    "without it, so in GeoJSON only"
)


class GeometryFormat(StrEnum):
    """As what lines are written: GeoJSON, or the polyline encoding with so many decimals, latitude first."""

    GEOJSON = "geojson"
    POLYLINE5 = "polyline5"
    POLYLINE6 = "polyline6"


class Overview(StrEnum):
    """How much of a route's line is written: all of it, as much as a map of the whole route shows, or none."""

    FULL = "full"
    SIMPLIFIED = "simplified"
    NONE = "none"
