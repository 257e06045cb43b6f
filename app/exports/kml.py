"""Routes and areas as KML 2.2."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final
from xml.etree.ElementTree import Element

import shapely

from app.conversions.lean.colours import MARKERS, band_colours, route_colour
from app.conversions.lean.lines import drawn
from app.conversions.place import DECIMALS
from app.conversions.range import band_levels
from app.exports.content import data_note, summary_of
from app.exports.tables import BAND_FIGURES, ROUTE_FIGURES, band_rows, route_rows
from app.exports.xml import add, document
from routing.graph.snap import road_point

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from app.exports.content import RangeContent, RouteContent
    from routing.places import Point

NAMESPACE: Final = "http://www.opengis.net/kml/2.2"
SOLID, SHEER = "ff", "66"  # opacities
LINE_PIXELS: Final = "4"


def route_kml(content: RouteContent) -> bytes:
    """A line for each route, and points for its places and charging stops."""
    root, folder = _begun("joulepath route", data_note(content.graph))
    answer = content.answer
    for k, (route, row) in enumerate(zip(answer.routes, route_rows(content), strict=True)):
        mark = add(folder, "Placemark")
        add(mark, "name", route.name)
        add(mark, "description", summary_of(route))
        line = add(add(mark, "Style"), "LineStyle")
        add(line, "color", _colour(route_colour(route.name, k, feasible=route.feasible), SOLID))
        add(line, "width", LINE_PIXELS)
        _data(mark, {name: row[name] for name in ROUTE_FIGURES})
        shape = add(mark, "LineString")
        add(shape, "tessellate", "1")
        add(shape, "coordinates", _coordinates(drawn(route, content.understood.overview)[0].geometry))
    for place, kind in [(answer.start, "start"), *((via, "via") for via in answer.via), (answer.goal, "goal")]:
        _point(folder, kind.capitalize(), place.on_road, MARKERS[kind])
    for plan in content.plans:
        for stop in () if plan is None else plan.stops:
            name = "Charging stop" if stop.station is None else stop.station.name or "Charging stop"
            figures = {"arrive_soc": stop.arrive_soc_frac, "depart_soc": stop.depart_soc_frac}
            _point(folder, name, road_point(content.graph, stop.position), MARKERS["stop"], figures)
    return document(root)


def range_kml(content: RangeContent) -> bytes:
    """An area for each band, the outermost first, and the origin."""
    root, folder = _begun("joulepath range", data_note(content.graph))
    answer, rows = content.answer, band_rows(content)
    for band, row, colour in zip(answer.bands, rows, band_colours(band_levels(answer)), strict=True):
        mark = add(folder, "Placemark")
        add(mark, "name", _band_name(row))
        style = add(mark, "Style")
        add(add(style, "LineStyle"), "color", _colour(colour, SOLID))
        add(add(style, "PolyStyle"), "color", _colour(colour, SHEER))
        _data(mark, {name: row[name] for name in BAND_FIGURES})
        shapes = add(mark, "MultiGeometry")
        for polygon in band.area.geoms:
            shape = add(shapes, "Polygon")
            for name, ring in [
                ("outerBoundaryIs", polygon.exterior),
                *(("innerBoundaryIs", r) for r in polygon.interiors),
            ]:
                outline = add(add(shape, name), "LinearRing")
                add(outline, "coordinates", _coordinates(shapely.get_coordinates(ring)))
    _point(folder, "Origin", answer.origin.on_road, MARKERS["origin"])
    return document(root)


def _begun(name: str, about: str) -> tuple[Element, Element]:
    root = Element("kml", {"xmlns": NAMESPACE})
    folder = add(root, "Document")
    add(folder, "name", name)
    add(folder, "description", about)
    return root, folder


def _band_name(row: dict[str, object]) -> str:
    level = f"{row['soc_left']:.3g} of charge left" if row["soc_left"] is not None else f"limit {row['limit']:.6g}"
    return level if row["probability"] is None else f"{level}, probability {row['probability']}"


def _point(folder: Element, name: str, at: Point, colour: str, figures: Mapping[str, object] | None = None) -> None:
    mark = add(folder, "Placemark")
    add(mark, "name", name)
    add(add(add(mark, "Style"), "IconStyle"), "color", _colour(colour, SOLID))
    _data(mark, figures or {})
    add(add(mark, "Point"), "coordinates", f"{at.lon_deg:.{DECIMALS}f},{at.lat_deg:.{DECIMALS}f}")


def _data(mark: Element, figures: Mapping[str, object]) -> None:
    shown = {name: value for name, value in figures.items() if value is not None}
    if shown:
        data = add(mark, "ExtendedData")
        for name, value in shown.items():
            text = (
                str(value).lower()
                if isinstance(value, bool)
                else f"{value:.6g}"
                if isinstance(value, float)
                else str(value)
            )
            add(add(data, "Data", name=name), "value", text)


def _coordinates(lonlat: NDArray[np.float64]) -> str:
    return " ".join(_pairs(lonlat.tolist()))


def _pairs(points: Iterable[list[float]]) -> Iterable[str]:
    for lon, lat in points:
        yield f"{lon:.{DECIMALS}f},{lat:.{DECIMALS}f}"


def _colour(rgb: str, opacity: str) -> str:
    """A colour in the order of KML: opacity, blue, green, red."""
    return opacity + rgb[5:7] + rgb[3:5] + rgb[1:3]
