"""Exports of what a car tells a service: positions of TeslaMate's database, metrics of OVMS by their names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.formats.clocks import Series, recording_of_series
from diagnosis.recordings.formats.named_columns import (
    MOST_KMH,
    MOST_W,
    named_series,
    unused_notes,
)
from diagnosis.recordings.formats.tables import Column, LogTable
from diagnosis.recordings.formats.units import RADIAN_PER_DEGREE
from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from energy.units import JOULE_PER_KWH, KMH_PER_MPS, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.recordings.recording import Recording

DRIVE: Final = "drive_id"
TESLAMATE_TIME: Final = Column("date", "time_s", 0.0, 1e10)
TESLAMATE_MARKS: Final = ("battery_level", "usable_battery_level", "ideal_battery_range_km", "rated_battery_range_km")
TESLAMATE_COLUMNS: Final = (
    Column("speed", "speed_mps", 0.0, 300.0, 1.0 / KMH_PER_MPS),
    Column("power", "power_w", -MOST_W / 1000.0, MOST_W / 1000.0, 1000.0),
    Column("odometer", "odometer_m", 0.0, 1e7, 1000.0),
    Column("latitude", "latitude_deg", -90.0, 90.0),
    Column("longitude", "longitude_deg", -180.0, 180.0),
    Column("elevation", "elevation_m", -500.0, 9000.0),
    Column("usable_battery_level", "soc_frac", 0.0, 100.0, 0.01),
    Column("battery_level", "displayed_frac", 0.0, 100.0, 0.01),
    Column("outside_temp", "ambient_k", -50.0, 56.0, offset=ZERO_CELSIUS_K),
)
OVMS_TIMES: Final = ("m.time.utc", "timestamp", "time", "date", "utc", "time_s")
OVMS_SPEEDS: Final = ("v.p.speed", "v.p.gpsspeed")
OVMS_COLUMNS: Final = (
    Column("v.p.speed", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS),
    Column("v.p.gpsspeed", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS),
    Column("v.b.power", "power_w", -MOST_W / 1000.0, MOST_W / 1000.0, 1000.0),
    Column("v.b.voltage", "voltage_v", 0.0, 2000.0),
    Column("v.b.current", "current_a", -5000.0, 5000.0),
    Column("v.b.soc", "soc_frac", 0.0, 100.0, 0.01),
    Column("v.b.temp", "battery_k", -50.0, 100.0, offset=ZERO_CELSIUS_K),
    Column("v.b.energy.recd", "regen_j", -1e6, 1e6, JOULE_PER_KWH),
    Column("v.e.temp", "ambient_k", -50.0, 56.0, offset=ZERO_CELSIUS_K),
    Column("v.p.latitude", "latitude_deg", -90.0, 90.0),
    Column("v.p.longitude", "longitude_deg", -180.0, 180.0),
    Column("v.p.altitude", "elevation_m", -500.0, 9000.0),
    Column("v.p.direction", "heading_rad", -360.0, 360.0, RADIAN_PER_DEGREE),
    Column("v.p.odometer", "odometer_m", 0.0, 1e7, 1000.0),
)
METRIC, VALUE = "metric", "value"  # of the long form, a reading a row
TOPIC, PAYLOAD = "topic", "payload"  # as brokers of MQTT name them
SERVICE_NAMES: Final = frozenset(
    (
        TESLAMATE_TIME.name,
        DRIVE,
        METRIC,
        VALUE,
        TOPIC,
        PAYLOAD,
        *OVMS_TIMES,
        *(column.name for column in (*TESLAMATE_COLUMNS, *OVMS_COLUMNS)),
    )
)


def is_teslamate(names: Sequence[str]) -> bool:
    """Whether a header is that of TeslaMate's table of positions."""
    return {"date", "speed", "power"} <= set(names) and any(mark in names for mark in (DRIVE, *TESLAMATE_MARKS))


def teslamate_drives(table: LogTable) -> list[LogTable]:
    """A table for each drive_id; rows without one are of a car that stands or is charged.

    Raises RecordingError where no row is of a drive.
    """
    if DRIVE not in table.names:
        return [table]
    ids = [str(cell).strip().removesuffix(".0") for cell in table.cells(DRIVE)]
    rows_of: dict[str, list[int]] = {}
    for row, drive in enumerate(ids):
        if drive and drive.lower() not in ("nan", "\\n"):
            rows_of.setdefault(drive, []).append(row)
    if not rows_of:
        raise RecordingError(table.path, 1, DRIVE, "empty in each row", "a drive's id, or no such column")
    if len(rows_of) == 1:
        return [table.rows(next(iter(rows_of.values())), table.id)]
    in_turn = sorted(rows_of, key=lambda drive: (int(drive) if drive.isdigit() else 0, drive))
    return [table.rows(rows_of[drive], f"{table.id}-{drive}") for drive in in_turn]


def read_teslamate(table: LogTable) -> Recording:
    """A drive of TeslaMate's positions in any order; times are of UTC, power [kW] is positive while discharging."""
    unordered_s, _ = table.clock(TESLAMATE_TIME, going=False)
    if bool((np.diff(unordered_s) < 0.0).any()):
        table = table.rows(np.argsort(unordered_s, kind="stable").tolist(), table.id)
    time_s, written = table.times(TESLAMATE_TIME)
    notes = [
        *unused_notes(table, {TESLAMATE_TIME.name, DRIVE, *(column.name for column in TESLAMATE_COLUMNS)}),
        Note(NoteKind.READ, "time_s", f"seconds, from {written or 'a number'}"),
    ]
    return recording_of_series(table.path, table.id, named_series(table, time_s, TESLAMATE_COLUMNS), notes)


def is_ovms(names: Sequence[str]) -> bool:
    """Whether a header is that of OVMS metrics with a time: a column each, or names and values in columns."""
    shown = any(name in names for name in OVMS_SPEEDS) or _reading_columns(names) is not None
    return shown and any(name in names for name in OVMS_TIMES)


def read_ovms(table: LogTable) -> Recording:
    """OVMS metrics, a column each or a reading a row; power [kW] and current [A] are positive while discharging."""
    clock = Column(next(name for name in OVMS_TIMES if name in table.names), "time_s", -1e12, 1e12)
    time_s, written = table.times(clock)
    known = {column.name for column in OVMS_COLUMNS}
    notes = [Note(NoteKind.READ, "time_s", f"seconds, from {written}")] if written else []
    columns = _reading_columns(table.names)
    if columns is not None:
        series: list[Series] = []
        rows_of: dict[str, list[int]] = {}
        for row, cell in enumerate(table.cells(columns[0])):
            rows_of.setdefault(str(cell).strip().rpartition("metric/")[2].replace("/", "."), []).append(row)
        for name in known & rows_of.keys():
            rows = rows_of[name]
            part = table.rows(rows, table.id)
            part = LogTable(table.path, table.id, (name,), (part.cells(columns[1]),), part.lines, table.notes)
            series += named_series(part, time_s[rows], OVMS_COLUMNS)
        series.sort(key=lambda record: [column.name for column in OVMS_COLUMNS].index(record.source))
        other = sorted(rows_of.keys() - known)
        if other:
            notes.append(Note(NoteKind.IGNORED, "", f"metrics not used: {', '.join(other)}"))
    else:
        series = named_series(table, time_s, OVMS_COLUMNS)
        notes += unused_notes(table, {clock.name, *known})
    return recording_of_series(table.path, table.id, series, notes)


def _reading_columns(names: Sequence[str]) -> tuple[str, str] | None:
    """The columns of metrics and their values, where a row is a reading."""
    return next((pair for pair in ((METRIC, VALUE), (TOPIC, PAYLOAD)) if set(pair) <= set(names)), None)
