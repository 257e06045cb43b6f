"""Answers as rows: routes, their links, bands, and pairs of a matrix."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from app.conversions.lean.digits import rounded
from app.conversions.lean.selection import asks_for, part_of, selection_of
from app.conversions.route import link_rows
from energy.force.parts import PART_NAMES
from energy.units import JOULE_PER_KWH
from routing.queries import LIMIT_UNITS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from app.exports.content import RangeContent, RouteContent
    from app.schemas.matrix import MatrixResponse

# names and Arrow types of columns, in their order
ROUTE_FIGURES: Final[Mapping[str, str]] = {
    "feasible": "bool",
    "distance_m": "double",
    "duration_s": "double",
    "total_s": "double",
    "energy_kwh": "double",
    "battery_kwh": "double",
    "soc_start": "double",
    "soc_end": "double",
    "soc_min": "double",
    "deficit_kwh": "double",
    "climb_m": "double",
    "descent_m": "double",
}
ROUTE_COLUMNS: Final[Mapping[str, str]] = {"route": "string", **ROUTE_FIGURES}
PARTS: Final = "energy_parts_wh"
LINK_COLUMNS: Final[Mapping[str, str]] = {
    "route": "string",
    "id": "int64",
    "from_m": "double",
    "to_m": "double",
    "rest": "bool",
    "length_m": "double",
    "duration_s": "double",
    "energy_wh": "double",
    **{f"{PARTS}.{name}": "double" for name in PART_NAMES},
    "soc_end": "double",
    "soc_end_p10": "double",
    "soc_end_p90": "double",
    "grade": "double",
    "height_end_m": "double",
    "geometry_end": "int64",
    "speed_limit_kmh": "double",
    "speed_end_kmh": "double",
    "stop_probability": "double",
    "name": "string",
}
BAND_FIGURES: Final[Mapping[str, str]] = {
    "soc_left": "double",
    "limit": "double",
    "probability": "double",
    "area_km2": "double",
    "tolerance_m": "double",
    "node_count": "int64",
    "false_in_share": "double",
    "false_out_share": "double",
    "reaches_map_edge": "bool",
    "road_nearest_km": "double",
    "road_farthest_km": "double",
}
PAIR_FIGURES: Final[Mapping[str, str]] = {
    "feasible": "bool",
    "energy_kwh": "double",
    "battery_kwh": "double",
    "duration_s": "double",
    "distance_m": "double",
    "soc_end": "double",
    "soc_min": "double",
    "deficit_kwh": "double",
    "reason": "string",
}
PAIR_COLUMNS: Final[Mapping[str, str]] = {"source": "int64", "target": "int64", **PAIR_FIGURES}


def route_rows(content: RouteContent) -> list[dict[str, Any]]:
    """A row for each route."""
    return [
        {
            "route": route.name,
            "feasible": route.feasible,
            "distance_m": route.distance_m,
            "duration_s": route.duration_s,
            "total_s": route.duration_s + route.stop_s,
            "energy_kwh": route.energy_j / JOULE_PER_KWH,
            "battery_kwh": route.battery_j / JOULE_PER_KWH,
            "soc_start": route.soc_start_frac,
            "soc_end": route.soc_end_frac,
            "soc_min": route.soc_min_frac,
            "deficit_kwh": route.deficit_j / JOULE_PER_KWH,
            "climb_m": route.climb_m,
            "descent_m": route.descent_m,
        }
        for route in content.answer.routes
    ]


def all_link_rows(content: RouteContent) -> list[dict[str, Any]]:
    """A row for each link of each route, in driving order, its parts of the energy in columns of their own."""
    rows = []
    for route in content.answer.routes:
        for row in link_rows(route.links):
            parts: Mapping[str, float] = row.pop(PARTS)  # type: ignore[assignment]  # the fields of EnergyPartsWh
            rows.append({"route": route.name, **row, **{f"{PARTS}.{name}": part for name, part in parts.items()}})
    return rows


def link_columns(content: RouteContent) -> dict[str, str]:
    """Columns of the table of links: all, or those that `fields` ask for under routes.links."""
    asked = part_of(selection_of(content.understood.fields), "routes", "links")
    return {name: kind for name, kind in LINK_COLUMNS.items() if name == "route" or asks_for(asked, *name.split("."))}


def band_rows(content: RangeContent) -> list[dict[str, Any]]:
    """A row for each band, the outermost first."""
    unit = LIMIT_UNITS.get(content.understood.by, 1.0)
    return [
        {
            "soc_left": band.soc_left_frac,
            "limit": None if band.limit is None else round(band.limit / unit, 9),
            "probability": band.probability_frac,
            "area_km2": band.area_m2 / 1e6,
            "tolerance_m": band.tolerance_m,
            "node_count": band.node_count,
            "false_in_share": band.false_in_frac,
            "false_out_share": band.false_out_frac,
            "reaches_map_edge": band.map_edge is not None,
            "road_nearest_km": None if band.road_reach.nearest_m is None else band.road_reach.nearest_m / 1000.0,
            "road_farthest_km": band.road_reach.farthest_m / 1000.0,
        }
        for band in content.answer.bands
    ]


def pair_rows(answer: MatrixResponse, sources: Sequence[object], targets: Sequence[object]) -> list[dict[str, Any]]:
    """A row for each pair, sources in order and for each of them the targets, both by what they are called."""
    return [
        {
            "source": source,
            "target": target,
            **{name: getattr(answer, name)[i][j] for name in PAIR_FIGURES},
        }
        for i, source in enumerate(sources)
        for j, target in enumerate(targets)
    ]


def compact_rows(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows with figures to six significant digits."""
    return [{name: rounded(cell) if isinstance(cell, float) else cell for name, cell in row.items()} for row in rows]
