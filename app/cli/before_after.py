"""What is driven by a vehicle's file beside what it takes with what was learned."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from app.cli.tables import missing_text, parts_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from app.schemas.range import BandProperties, RangeFeatureCollection
    from app.schemas.route import RouteFound, RouteResponse
    from app.schemas.simulation import SimulateResponse


def print_routes(console: Console, file: RouteResponse, learned: RouteResponse) -> None:
    """Routes of one request by the vehicle's file and with what was learned, then their energy by cause."""
    table = Table("route")
    for heading in ("", "kWh", "change", "SoC at the end", "min", "km", "feasible"):
        table.add_column(heading, justify="right")
    parts = []
    for before, after in _pairs(file, learned):
        for found, which in ((before, "file"), (after, "learned")):
            table.add_row(
                found.name if which == "file" else "",
                which,
                f"{found.battery_kwh:.3f}",
                "" if which == "file" else _change(before.battery_kwh, after.battery_kwh),
                f"{found.soc_end:.3f}",
                f"{found.duration_s / 60.0:.1f}",
                f"{found.distance_m / 1000.0:.2f}",
                "yes" if found.feasible else missing_text(found.deficit_kwh),
            )
            parts.append((f"{found.name}, {which}", found.energy_parts_kwh))
    console.print(table)
    console.print(parts_table(parts))
    for before, after in _pairs(file, learned):
        if before.geometry != after.geometry:
            line = f"{after.name} takes other roads with what was learned"
            console.print(line, style="dim", markup=False, highlight=False)


def route_lines(file: RouteResponse, learned: RouteResponse) -> list[str]:
    """What changes of each route, in a sentence."""
    return [
        f"{after.name}: {_energy(before.battery_kwh, after.battery_kwh)}; {after.soc_end:.3f} of the charge at the end"
        f" instead of {before.soc_end:.3f}"
        for before, after in _pairs(file, learned)
    ]


def area_line(file: RangeFeatureCollection, learned: RangeFeatureCollection) -> str:
    """What changes of the outermost area, in a sentence."""
    before, after = _outermost(file).area_km2, _outermost(learned).area_km2
    shown = _change(before, after)
    return (
        f"{after:.2f} km² with what was learned, {before:.2f} km² by the vehicle's file{f' ({shown})' if shown else ''}"
    )


def drive_line(file: SimulateResponse, learned: SimulateResponse) -> str:
    """What changes of a simulated drive, in a sentence."""
    if file.battery_kwh is None or learned.battery_kwh is None:
        return _energy(file.energy_kwh, learned.energy_kwh)
    return _energy(file.battery_kwh, learned.battery_kwh)


def _pairs(file: RouteResponse, learned: RouteResponse) -> Iterator[tuple[RouteFound, RouteFound]]:
    """Routes of the same name."""
    named = {route.name: route for route in file.routes}
    return ((named[route.name], route) for route in learned.routes if route.name in named)


def _outermost(area: RangeFeatureCollection) -> BandProperties:
    return next(feature.properties for feature in area.features if feature.properties.kind == "band")


def _energy(before_kwh: float, after_kwh: float) -> str:
    shown = _change(before_kwh, after_kwh)
    return (
        f"{after_kwh:.3f} kWh with what was learned, {before_kwh:.3f} kWh by the vehicle's file"
        f"{f' ({shown})' if shown else ''}"
    )


def _change(before: float, after: float) -> str:
    """A change in per cent of what was; none of what is not above 0."""
    return f"{(after - before) / before:+.0%}" if before > 0.0 else ""
