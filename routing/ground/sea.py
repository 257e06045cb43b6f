"""The sea from the lines of a coast, which have land on their left and water on their right."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

ASIDE_DEG: Final = 1e-6  # how far beside a line it is looked at what lies there
AGREED_FRAC: Final = 0.9  # of the looks, weighted by length, of which land or sea must be said; assumed
MOST_BRIDGED_FRAC: Final = 0.05  # of the box, from the end of a line to its edge; assumed


def sea_of(
    coast: Sequence[shapely.LineString], box: tuple[float, float, float, float]
) -> tuple[list[shapely.Polygon], int]:
    """Areas of sea in a box (west, south, east, north) [deg], and how many areas by the coast can't be told.

    Ends of lines close to the edge of the box are led on to it, since extracts cut them there. Where looks to the sides
    of the lines disagree, as where a line has a gap, the area is not drawn.
    """
    frame = shapely.box(*box)
    lines = _within(coast, frame)
    if not lines:
        return [], 0
    lines += _led_on(lines, box)
    noded = shapely.unary_union([*lines, frame.exterior])
    faces = np.array(list(shapely.get_parts(shapely.polygonize([noded]))), np.object_)
    if not faces.size:
        return [], 0
    sea, length = _looks(lines, faces)
    known = length > 0.0
    share = np.divide(sea, length, out=np.zeros(faces.size), where=known)
    is_sea = known & (share >= AGREED_FRAC)
    unclear = known & (share > 1.0 - AGREED_FRAC) & (share < AGREED_FRAC)
    return [face for face, water in zip(faces, is_sea, strict=True) if water], int(unclear.sum())


def _within(coast: Sequence[shapely.LineString], frame: shapely.Polygon) -> list[shapely.LineString]:
    """The lines as far as they lie in the box, joined where one goes on in the other."""
    if not coast:
        return []
    parts = shapely.get_parts(shapely.intersection(np.array(coast, np.object_), frame))
    lines = [part for part in parts if part.geom_type == "LineString" and part.length > 0.0]
    if not lines:
        return []
    return list(shapely.get_parts(shapely.line_merge(shapely.MultiLineString(lines), directed=True)))


def _led_on(lines: Sequence[shapely.LineString], box: tuple[float, float, float, float]) -> list[shapely.LineString]:
    """From the loose ends of lines to the edge of the box, where that is not far."""
    west, south, east, north = box
    most = MOST_BRIDGED_FRAC * min(east - west, north - south)
    found = []
    for line in lines:
        if line.is_ring:
            continue
        for at_end in (False, True):
            x, y = line.coords[-1 if at_end else 0]
            edges = ((x - west, (west, y)), (east - x, (east, y)), (y - south, (x, south)), (north - y, (x, north)))
            distance, onto = min(edges)
            if 0.0 < distance <= most:
                found.append(shapely.LineString([(x, y), onto] if at_end else [onto, (x, y)]))
    return found


def _looks(
    lines: Sequence[shapely.LineString], faces: NDArray[np.object_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of each face the length of lines that have it on their right, and that have it on either side."""
    coordinates, line = shapely.get_coordinates(np.array(lines, np.object_), return_index=True)
    step = np.diff(coordinates, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    kept = (np.diff(line) == 0) & (length > 0.0)
    step, length = step[kept], length[kept]
    middle = (coordinates[:-1] + coordinates[1:])[kept] / 2.0
    aside = ASIDE_DEG * np.column_stack((step[:, 1], -step[:, 0])) / length[:, None]
    sea, every = np.zeros(faces.size), np.zeros(faces.size)
    tree = shapely.STRtree(faces)
    for side, is_right in ((aside, True), (-aside, False)):
        point, face = tree.query(shapely.points(middle + side), predicate="within")
        np.add.at(every, face, length[point])
        if is_right:
            np.add.at(sea, face, length[point])
    return sea, every
