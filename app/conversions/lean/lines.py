"""Lines of routes with fewer points, and as texts."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from app.schemas.lean.form import GeometryFormat, Overview
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from routing.route.route import Route

    Coordinates = Callable[[NDArray[np.float64]], object]

OVERVIEW_PIXELS: Final = 2000  # across a map of the whole route, of which a simplified line is off one at most
POLYLINE_DECIMALS: Final = {GeometryFormat.POLYLINE5: 5, GeometryFormat.POLYLINE6: 6}
CHUNK_BITS, CHUNKS = 5, 7  # which hold 360 degrees of 1e-6 and a sign
FIRST_CHARACTER, MORE = 63, 0x20


def line_of(lonlat: NDArray[np.float64], form: GeometryFormat, coordinates: Coordinates) -> dict[str, Any] | str:
    """A line in a form; coordinates: as which kind of array those of GeoJSON are given."""
    if form is GeometryFormat.GEOJSON:
        return {"type": "LineString", "coordinates": coordinates(lonlat)}
    return polyline(lonlat, POLYLINE_DECIMALS[form])


def polyline(lonlat: NDArray[np.float64], decimals: int) -> str:
    """A line in Google's polyline encoding, latitude first; lonlat: float64 (P, 2) [deg]."""
    whole = np.rint(lonlat[:, ::-1] * 10**decimals).astype(np.int64)
    steps = np.diff(whole, axis=0, prepend=np.zeros((1, 2), np.int64)).ravel()
    signed = np.where(steps < 0, ~(steps << 1), steps << 1)
    chunks = signed[:, None] >> (CHUNK_BITS * np.arange(CHUNKS))
    goes_on = chunks >> CHUNK_BITS > 0
    used = np.column_stack((np.ones(len(chunks), np.bool_), goes_on[:, :-1]))
    characters = (chunks & 0x1F | np.where(goes_on, MORE, 0)) + FIRST_CHARACTER
    text: bytes = characters[used].astype(np.uint8).tobytes()
    return text.decode("ascii")


def kept_points(route: Route) -> NDArray[np.int64]:
    """Positions of the points of a route's line that a map of the whole route shows; ends of legs are among them."""
    line = route.geometry
    middle_deg = float(np.radians(line[:, 1].mean()))
    flat = (line - line[0]) * METRE_PER_DEGREE * np.array((np.cos(middle_deg), 1.0))
    tolerance_m = float(np.ptp(flat, axis=0).max()) / OVERVIEW_PIXELS
    ends = [route.links.geometry_end_idx[leg.last_link] for leg in route.legs if leg.last_link is not None]
    bounds = sorted({0, len(line) - 1, *ends})
    kept = [np.zeros(1, np.int64)]
    for begin, end in pairwise(bounds):
        numbered = np.column_stack((flat[begin : end + 1], np.arange(begin, end + 1)))  # the number as height
        simple = shapely.simplify(shapely.LineString(numbered), tolerance_m, preserve_topology=False)
        inner = shapely.get_coordinates(simple, include_z=True)[:, 2].astype(np.int64)
        kept.append(np.append(inner[(inner > begin) & (inner < end)], end))
    return np.concatenate(kept)


def drawn(route: Route, overview: Overview) -> tuple[Route, NDArray[np.int64] | None]:
    """A route with its line as it is to be drawn, and the positions that its points had; None where all are kept.

    Links then end at the nearest point behind that is kept.
    """
    if overview is not Overview.SIMPLIFIED:
        return route, None
    kept = kept_points(route)
    ends = np.searchsorted(kept, route.links.geometry_end_idx).tolist()
    return replace(route, geometry=route.geometry[kept], links=replace(route.links, geometry_end_idx=ends)), kept
