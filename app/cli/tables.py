"""Answers as tables for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table

from energy.force.parts import SOURCE_PART_COUNT
from routing.numerals import text_above, text_below

if TYPE_CHECKING:
    from app.schemas.graph import GraphDetail, GraphList, TerrainNote
    from app.schemas.matrix import MatrixResponse
    from app.schemas.range import RangeFeatureCollection
    from app.schemas.route import EnergyPartsKwh, RouteFound, RouteResponse
    from app.schemas.simulation import SimulateResponse, SpeedProfileAnswer
    from app.schemas.vehicles.answer import AnyVehicleDetail, VehicleList
    from app.schemas.vehicles.check import VehicleChecks

SHOWN_LINKS = 40
SHOWN_PLACES = 8
SHOWN_KWH = 0.0005
SOC_ROUNDING = 1e-9  # within which a charge counts as kept


def missing_text(deficit_kwh: float) -> str:
    """What is said of a route that the charge does not suffice for."""
    return f"no, {text_above(deficit_kwh, 0.0, 2)} kWh missing"


def _charge_text(soc: float) -> str:
    """A state of charge; one below 0 never reads as 0."""
    return f"{soc:.3f}" if soc > -SOC_ROUNDING else text_below(soc, 0.0, 3)


def routes_table(answer: RouteResponse) -> Table:
    """One line a route; kWh are what the battery gave."""
    table = _table("route", "km", "min", "kWh", "kWh/100 km", "SoC", "lowest", "climb m", "feasible")
    for route in answer.routes:
        km = route.distance_m / 1000.0
        feasible = "yes" if route.feasible else missing_text(route.deficit_kwh)
        table.add_row(
            route.name,
            f"{km:.2f}",
            f"{route.duration_s / 60.0:.1f}",
            f"{route.battery_kwh:.3f}",
            f"{100.0 * route.battery_kwh / km:.2f}" if km > 0.0 else "–",
            f"{route.soc_start:.3f} → {_charge_text(route.soc_end)}",
            _charge_text(route.soc_min),
            f"{route.climb_m:.0f}",
            feasible,
        )
    return table


def parts_table(parts: list[tuple[str, EnergyPartsKwh]]) -> Table:
    """Energy by cause, one line a cause; what effects add only where it is not 0."""
    names = tuple(type(parts[0][1]).model_fields)
    table = _table("kWh", *(label for label, _ in parts))
    for k, name in enumerate(names):
        values = [getattr(kwh, name) for _, kwh in parts]
        if k < SOURCE_PART_COUNT or any(abs(value) >= SHOWN_KWH for value in values):
            table.add_row(name.replace("_", " "), *(f"{value:.3f}" for value in values))
    return table


def hot_table(routes: list[RouteFound]) -> Table:
    """Where the energy of each route goes, one line a stretch."""
    table = _table("route", "from km", "to km", "kWh", "kWh/100 km", "why", "road")
    for route in routes:
        for hot in route.hot_links:
            table.add_row(
                route.name,
                f"{hot.from_m / 1000.0:.2f}",
                f"{hot.to_m / 1000.0:.2f}",
                f"{hot.energy_kwh:.3f}",
                f"{hot.kwh_per_100km:.1f}",
                hot.reason.value,
                ", ".join(name for name in hot.names if name)[:60],
            )
    return table


def spread_table(routes: list[RouteFound]) -> Table:
    """What may come out, one line a route; P10 is exceeded with 90 % probability."""
    table = _table("route", "kWh P10", "P50", "P90", "SoC at the end P10", "P50", "P90", "above reserve")
    for route in routes:
        if (spread := route.uncertainty) is not None:
            energies = (spread.energy_kwh_p10, spread.energy_kwh_p50, spread.energy_kwh_p90)
            charges = (spread.soc_end_p10, spread.soc_end_p50, spread.soc_end_p90)
            shown = (f"{value:.3f}" for value in (*energies, *charges))
            table.add_row(route.name, *shown, f"{spread.probability_above_reserve:.1%}")
    return table


def matrix_table(answer: MatrixResponse, sources: list[str], targets: list[str]) -> Table:
    """What the battery gives for each pair of places [kWh], the first ones where there are many, or why it can't."""
    table = _table("kWh", *targets[:SHOWN_PLACES])
    for i, source in enumerate(sources[:SHOWN_PLACES]):
        cells = zip(answer.battery_kwh[i][:SHOWN_PLACES], answer.reason[i], strict=False)
        table.add_row(source, *(f"{kwh:.2f}" if kwh is not None else str(reason) for kwh, reason in cells))
    if max(len(sources), len(targets)) > SHOWN_PLACES:
        table.caption = f"the first of {len(sources)} sources and {len(targets)} targets"
    return table


def bands_table(answer: RangeFeatureCollection) -> Table:
    """One line a band."""
    table = _table(
        "SoC left", "probability", "km²", "nodes reached", "falsely in", "falsely out", "left at the map's edge"
    )
    for feature in answer.features:
        band = feature.properties
        if band.kind == "band":
            table.add_row(
                "–" if band.soc_left is None else f"{band.soc_left:.3f}",
                "–" if band.probability is None else f"{band.probability:.0%}",
                f"{band.area_km2:.2f}",
                str(band.node_count),
                f"{band.false_in_share:.2%}",
                f"{band.false_out_share:.2%}",
                "–" if band.map_edge_left_kwh is None else f"{text_above(band.map_edge_left_kwh, 0.0, 1)} kWh",
            )
    return table


def simulation_table(answer: SimulateResponse) -> Table:
    """One line a link, and their sum."""
    table = _table("link", "m", "grade", "km/h", "s", "Wh", "SoC", "stop")
    for link in answer.links[:SHOWN_LINKS]:
        table.add_row(
            str(link.position if link.id is None else link.id),
            f"{link.length_m:.1f}",
            f"{link.grade:+.3f}",
            f"{link.speed_limit_kmh:.0f} → {link.speed_end_kmh:.0f}",
            f"{link.duration_s:.1f}",
            f"{link.energy_wh:.1f}",
            "–" if link.soc_end is None else f"{link.soc_end:.4f}",
            f"{link.stop_probability:.2f}",
        )
    if len(answer.links) > SHOWN_LINKS:
        table.add_row(f"… {len(answer.links) - SHOWN_LINKS} more")
    table.add_section()
    end = "–" if answer.soc_end is None else f"{answer.soc_end:.4f}"
    energy, stops = f"{answer.energy_kwh * 1000.0:.1f}", f"{answer.stop_count:.1f} stops"
    table.add_row("sum", f"{answer.distance_m:.1f}", "", "", f"{answer.duration_s:.1f}", energy, end, stops)
    return table


def profile_table(answer: SpeedProfileAnswer) -> Table:
    """One line a point of a speed profile, evenly chosen where there are many."""
    table = _table("m", "s", "km/h")
    count = len(answer.distance_m)
    shown = min(count, SHOWN_LINKS)
    for k in range(shown):
        i = k * (count - 1) // max(shown - 1, 1)
        table.add_row(f"{answer.distance_m[i]:.1f}", f"{answer.time_s[i]:.1f}", f"{answer.speed_kmh[i]:.1f}")
    return table


def vehicles_table(answer: VehicleList) -> Table:
    """One line a vehicle."""
    table = _table("id", "name", "from", "powertrain", "kWh", "kg")
    for vehicle in answer.vehicles:
        mark = " (default)" if vehicle.default else ""
        capacity = f"{vehicle.usable_capacity_kwh:.1f}"
        origin = "bundled" if vehicle.bundled else "database"
        mass = "table" if vehicle.mass_kg is None else f"{vehicle.mass_kg:.0f}"
        table.add_row(vehicle.id + mark, vehicle.name, origin, vehicle.powertrain.value, capacity, mass)
    return table


def vehicle_table(answer: AnyVehicleDetail) -> Table:
    """One line a number, with its standard deviation and its source."""
    table = Table("field", "value", "±", "source", title=answer.name)
    values = answer.model_dump(mode="json", exclude={"id", "name", "sources", "sd"})
    for name, value in values.items():
        leaves = {f"{name}.{key}": leaf for key, leaf in value.items()} if isinstance(value, dict) else {name: value}
        for field, leaf in leaves.items():
            shown = " ".join(map(_plain, leaf)) if isinstance(leaf, list) else _plain(leaf)
            deviation = f"{answer.sd[field]:g}" if field in answer.sd else ""
            table.add_row(field, shown, deviation, answer.sources.get(field, ""))
    return table


def checks_table(answer: VehicleChecks) -> Table:
    """One line a published figure, or a driving cycle where nothing is published."""
    table = _table("vehicle", "figure", "battery", "model", "published", "ratio", "")
    table.columns[0].no_wrap = True
    for vehicle in answer.vehicles:
        battery = {cycle: f"{kwh:.1f}" for cycle, kwh in vehicle.battery_kwh_per_100km.items()}
        for figure in vehicle.figures:
            table.add_row(
                vehicle.id,
                figure.figure.removesuffix("_kwh_per_100km").replace("_", " "),
                battery.get(figure.cycle, f"{figure.model_kwh_per_100km:.1f}"),
                f"{figure.model_kwh_per_100km:.1f}",
                f"{figure.published_kwh_per_100km:.1f}",
                f"{figure.ratio:.2f}",
                "" if figure.met else "differs",
            )
        for cycle in () if vehicle.figures else battery:
            table.add_row(vehicle.id, cycle, battery[cycle], "–", "–", "–")
    bands = {figure.allowed_ratio for vehicle in answer.vehicles for figure in vehicle.figures}
    agree = "".join(f"; a ratio of {low:g}..{high:g} agrees" for low, high in sorted(bands))
    table.caption = f"kWh/100 km; model and published from the wall (petrol: fuel, listed: battery){agree}"
    return table


def graphs_table(answer: GraphList) -> Table:
    """One line a graph."""
    table = _table("name", "nodes", "links", "terrain", "source", "licence")
    for graph in answer.graphs:
        mark = " (default)" if graph.default else ""
        nodes, links = str(graph.node_count), str(graph.link_count)
        table.add_row(graph.name + mark, nodes, links, graph.terrain.value, graph.source, graph.licence)
    return table


def graph_table(answer: GraphDetail) -> Table:
    """One line a property, then one a road class."""
    table = Table("property", "value", title=answer.name)
    west, south, east, north = answer.bbox
    table.add_row("source", answer.source)
    table.add_row("attribution", answer.attribution)
    table.add_row("licence", answer.licence)
    table.add_row(
        "terrain", f"{answer.terrain.value}: {answer.elevation_method}, smoothed over {answer.smoothing_m:g} m"
    )
    table.add_row("extent", f"lat {south:.4f}..{north:.4f}, lon {west:.4f}..{east:.4f}")
    table.add_row("heights", f"{answer.height_min_m:.0f}..{answer.height_max_m:.0f} m")
    table.add_row("size", f"{answer.node_count} nodes, {answer.link_count} links, {answer.length_km:.0f} km of links")
    for kind in answer.road_classes:
        table.add_row(kind.functional_class, f"{kind.link_count} links, {kind.length_km:.0f} km")
    for reason, count in answer.dropped.items():
        table.add_row(f"left out: {reason}", str(count))
    for part in answer.cut_off:
        place = f"at lat {part.lat:.5f}, lon {part.lon:.5f}" + (f", {escape(part.name)}" if part.name else "")
        table.add_row("not connected", f"{part.length_km:.2f} km of road in {part.link_count} links {place}")
    return table


def terrain_line(terrain: TerrainNote) -> str:
    """The data that an answer rests on, in one line."""
    heights = {
        "measured": "measured heights",
        "synthetic": "synthetic terrain",
        "absent": "no heights: all links level",
    }
    return f"{terrain.graph}: {heights[terrain.terrain.value]} · {terrain.attribution} · {terrain.licence}"


def _table(first: str, *others: str) -> Table:
    table = Table(first)
    for name in others:
        table.add_column(name, justify="right")
    return table


def _plain(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
