"""Stations for a terminal: as a table, and what became of those that were imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.markup import escape
from rich.table import Table

from routing.places import place_text
from routing.stations.reading import ReadStations

if TYPE_CHECKING:
    from collections.abc import Iterable

    from app.stations.answer import SocketAnswer, StationCollection
    from routing.stations.importing import ReadSource, StationsReport
    from routing.stations.station import Stations

FAR_NAMED: Final = 10  # of the stations too far from a road the nearest are told by name


def stations_table(found: StationCollection) -> Table:
    """One line a station."""
    table = Table()
    for column in ("id", "name", "operator", "sockets", "access", "hours", "lat", "lon", "road m"):
        table.add_column(column, justify="right" if column in ("lat", "lon", "road m") else "left")
    for feature in found.features:
        told = feature.properties
        lon, lat = feature.geometry.coordinates
        hours = told.opening_hours or "–"
        table.add_row(
            escape(feature.id),
            escape(told.name),
            escape(told.operator or told.network),
            _sockets_text(told.sockets),
            told.access.value,
            escape(hours if told.open is None else f"{hours} ({told.open.value})"),
            f"{lat:.5f}",
            f"{lon:.5f}",
            f"{told.road_distance_m:.0f}",
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
    lines = [f"source: {source.name}, {source.licence}" for source in kept.sources]
    lines += [f"read from {key}: {count}" for key, count in report.told.items()]
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
    for told in read:
        if isinstance(told, ReadStations):
            lines += [f"unknown plug {name!r}: {count}" for name, count in told.unknown_plugs.items()]
            lines += [f"{told.format}: {note}" for note in told.notes]
            lines += [f"such as {examples[0]}" for examples in told.examples.values() if examples]
    return lines
