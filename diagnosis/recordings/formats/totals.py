"""Tables of sums, a row a drive: distance, duration, energy or charge, and what else is known of it."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.formats.tables import MOST_ROWS, Column, LogTable, check_drives, named_errors
from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from diagnosis.recordings.recording import Detail, Recording
from energy.units import JOULE_PER_KWH, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

STEP_S: Final = 10.0  # of the drives that are made of rows
MOST_MPS: Final = 200.0 / 3.6
MOST_SAMPLES: Final = 3 * MOST_ROWS  # that are made of the rows of a table: 16,000 hours
DISTANCE: Final = Column("distance_km", "", 0.01, 2000.0, 1000.0)
DURATIONS: Final = (
    Column("duration_s", "", 10.0, 200_000.0),
    Column("duration_min", "", 0.2, 3000.0, 60.0),
    Column("duration_h", "", 0.003, 55.0, 3600.0),
)
ENERGY: Final = Column("energy_kwh", "", -500.0, 2000.0, JOULE_PER_KWH)
CHARGES: Final = (Column("soc_start_percent", "", 0.0, 100.0, 0.01), Column("soc_end_percent", "", 0.0, 100.0, 0.01))
AMBIENT: Final = Column("ambient_c", "", -50.0, 56.0, offset=ZERO_CELSIUS_K)
CLIMB: Final = Column("climb_m", "", -5000.0, 5000.0)
PAYLOAD: Final = Column("payload_kg", "", 0.0, 100_000.0)
TRIP, DATE, REMARKS = "trip", "date", "remarks"
TOTALS_NAMES: Final = frozenset(
    {TRIP, DATE, REMARKS, *(c.name for c in (DISTANCE, *DURATIONS, ENERGY, *CHARGES, AMBIENT, CLIMB, PAYLOAD))}
)


def is_totals(names: Sequence[str]) -> bool:
    """Whether a header is that of sums: distance, a duration, and an energy or the charge at both ends."""
    there = set(names)
    charges = {column.name for column in CHARGES}
    lasts = any(column.name in there for column in DURATIONS)
    return DISTANCE.name in there and lasts and (ENERGY.name in there or charges <= there) and "time_s" not in there


def read_totals(table: LogTable) -> tuple[list[Recording], list[RecordingError]]:
    """A drive a row, at its mean speed and mean power, and the errors of rows that are none.

    Drives of a charge alone wait for a capacity. No drive is a row without distance or duration, with neither energy
    nor both charges, faster than any vehicle, or of an id that is there already. Raises RecordingError where columns
    are missing or there twice.
    """
    for name in table.names:
        if name in TOTALS_NAMES:
            table.cells(name)
    check_drives(table.path, len(table.lines))
    found: list[Recording] = []
    errors: list[RecordingError] = []
    ids: set[str] = set()
    samples = 0
    for row in range(len(table.lines)):
        try:
            drive = _drive(_row(table, row))
            if drive.id in ids:
                raise table.error(row, TRIP, drive.id, "an id that no row before has")
        except RecordingError as error:
            errors.append(error.without_trace())
            continue
        ids.add(drive.id)
        found.append(drive)
        samples += drive.time_s.size
        if samples > MOST_SAMPLES:
            lasting = f"drives of more than {MOST_SAMPLES * STEP_S / 3600.0:.0f} hours in all"
            raise table.error(row, "the table", lasting, "fewer; split it")
    return found, named_errors(table.path, errors)


def _row(table: LogTable, row: int) -> LogTable:
    """A table of one row of another."""
    columns = tuple(cells[row : row + 1] for cells in table.columns)
    return LogTable(table.path, table.id, table.names, columns, [table.lines[row]])


def _drive(table: LogTable) -> Recording:
    """The drive in a table of one row."""
    distance_m = table.values(DISTANCE, required=True)
    lasts = next(column for column in DURATIONS if column.name in table.names)
    duration_s = table.values(lasts, required=True)
    energy_j, start, end = (_known(table, column, strict=True) for column in (ENERGY, *CHARGES))
    ambient_k, climb_m, payload_kg = (_known(table, column) for column in (AMBIENT, CLIMB, PAYLOAD))
    row = 0
    speed_mps = float(distance_m[row] / duration_s[row])
    if speed_mps > MOST_MPS:
        raise table.error(row, DISTANCE.name, f"{3.6 * speed_mps:.0f} km/h on average", "at most 200 km/h")
    known_charge = not np.isnan(start[row]) and not np.isnan(end[row])
    if np.isnan(energy_j[row]) and not known_charge:
        raise table.error(row, ENERGY.name, "empty", "an energy, or the charge at both ends")
    time_s = _begin_s(table, row) + np.append(np.arange(0.0, duration_s[row], STEP_S), duration_s[row])
    n = time_s.size
    along = np.linspace(0.0, 1.0, n)
    power_w = 0.0 if np.isnan(energy_j[row]) else float(energy_j[row] / duration_s[row])
    remarks = str(table.cells(REMARKS)[row]).strip() if REMARKS in table.names else ""
    notes = (Note(NoteKind.READ, "", f"remarks: {remarks}"),) if remarks else ()
    return Recording(
        id=_id(table, row),
        time_s=time_s,
        speed_mps=np.full(n, speed_mps),
        power_w=np.full(n, power_w),
        elevation_m=None if np.isnan(climb_m[row]) else climb_m[row] * along,
        ambient_k=None if np.isnan(ambient_k[row]) else np.full(n, ambient_k[row]),
        soc_frac=start[row] + (end[row] - start[row]) * along if known_charge else None,
        payload_kg=None if np.isnan(payload_kg[row]) else np.full(n, payload_kg[row]),
        notes=(*notes, *table.notes),
        detail=Detail.TOTALS,
    )


def _known(table: LogTable, column: Column, *, strict: bool = False) -> NDArray[np.float64]:
    """A column, NaN where the table has none."""
    return table.values(column, strict=strict) if column.name in table.names else np.full(len(table.lines), np.nan)


def _id(table: LogTable, row: int) -> str:
    own = str(table.cells(TRIP)[row]).strip() if TRIP in table.names else ""
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", own).strip("-")
    return name or f"{table.id}-{table.lines[row]}"


def _begin_s(table: LogTable, row: int) -> float:
    """When a drive began, seconds since 1970; 0 where no date is given."""
    if DATE not in table.names:
        return 0.0
    text = str(table.cells(DATE)[row]).strip()
    if not text:
        return 0.0
    try:
        when = datetime.fromisoformat(text)
    except ValueError as error:
        raise table.error(row, DATE, text, "a date or date and time in ISO 8601, such as 2026-03-01T08:30") from error
    return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()


__all__ = ["TOTALS_NAMES", "RecordingError", "is_totals", "read_totals"]
