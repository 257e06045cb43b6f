"""Stations for a terminal: as a table, and what became of those that were imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.markup import escape
from rich.table import Table

from routing.places import place_text
from routing.stations.reading import ReadStations

if TYPE_CHECKING:
    from collections.abc import Iterable

    from app.schemas.stations.facts import SocketAnswer
    from app.stations.answer import StationCollection
    from routing.stations.importing import ReadSource, StationsReport
    from routing.stations.station import Stations

FAR_NAMED: Final = 10  # of the stations too far from a road the nearest are told by name


def stations_table(found: StationCollection) -> Table:
    """One line a station."""
    table = Table()
    table.add_column("id", no_wrap=True)
    for column in ("name, operator", "sockets", "access", "hours"):
        table.add_column(column, overflow="fold")
    table.add_column("lat\nlon", no_wrap=True, justify="right")
    table.add_column("road\nm", justify="right")
    for feature in found.features:
        shown = feature.properties
        lon, lat = feature.geometry.coordinates
        hours = shown.opening_hours or "–"
        operator = shown.operator or shown.network
        names = [shown.name, "" if shown.name.startswith(operator) else operator]
        table.add_row(
            escape(feature.id),
            escape(", ".join(filter(None, names))),
            _sockets_text(shown.sockets),
            shown.access.value,
            escape(hours if shown.open is None else f"{hours} ({shown.open.value})"),
            f"{lat:.5f}\n{lon:.5f}",
            f"{shown.road_distance_m:.0f}",
        )
    return table


def _sockets_text(sockets: Iterable[SocketAnswer]) -> str:
    texts = [
        f"{socket.count} × {socket.connector.value}" + (f" {socket.output_kw:g} kW" if socket.output_kw else "")
        for socket in sockets
    ]
    return ", ".join(texts) or "not known"


def report_lines(kept: Stations, report: StationsReport, read: Iterable[ReadSource] = ()) -> list[str]:
    """What became of stations that were imported, a sentence a line."""
    lines = [f"source: {source.name}, {source.licence} ({source.key})" for source in kept.sources]
    lines += [f"read from {key}: {count}" for key, count in report.read_count.items()]
    if report.repeated:
        lines.append(f"told again under the same id, the later one holds: {report.repeated}")
    if report.united:
        lines.append(f"united with another one: {report.united}")
    lines += [f"left out, {reason}: {count}" for reason, count in report.left_out.items()]
    for far in report.far[:FAR_NAMED]:
        name = f" {far.name!r}" if far.name else ""
        place = place_text(far.at.lat_deg, far.at.lon_deg)
        lines.append(f"too far from a road: {far.id}{name} at {place}, {far.distance_m:.0f} m")
    if report.without_sockets:
        lines.append(f"kept without a known socket, which no plan charges at: {report.without_sockets}")
    if report.hours_unread:
        lines.append(f"opening hours not understood, taken as not known: {report.hours_unread}")
    for part in read:
        if isinstance(part, ReadStations):
            lines.append(_count_line(part))
            lines += [f"unknown plug {name!r}: {count}" for name, count in part.unknown_plugs.items()]
            lines += [f"{part.format}: {note}" for note in part.notes]
            lines += [f"such as {examples[0]}" for examples in part.examples.values() if examples]
    return lines


def _count_line(read: ReadStations) -> str:
    """What became of all that a file tells."""
    left_out = sum(read.left_out.values())
    every = len(read.stations) + read.parts + left_out
    parts = f", {read.parts} parts of others" if read.parts else ""
    return f"{read.format}: {every} told, {len(read.stations)} stations{parts}, {left_out} left out"
