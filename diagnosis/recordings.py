"""Recorded drives in SI units, read from the files that loggers and published data sets come in."""

from __future__ import annotations

import csv
import gzip
import io
import math
import zlib
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recording_checks import REQUIRED, Note, NoteKind, RecordingError, checked
from energy.conditions import ZERO_CELSIUS_K
from energy.replay import DrivenProfile
from energy.vehicle import KMH_PER_MPS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

PROFILE_STEP_S: Final = 1.0
MOST_KMH: Final = 200.0  # the fastest that energy.vehicle knows
MOST_W: Final = 1_000_000.0
RADIAN_PER_DEGREE: Final = math.pi / 180.0
GZIP_MAGIC: Final = b"\x1f\x8b"

__all__ = ["Note", "NoteKind", "Recording", "RecordingError", "read_recording"]


@dataclass(frozen=True, slots=True)
class Recording:
    """One recorded drive: n samples, each channel float64 (n,), NaN where a channel has no value; None: not recorded.

    id: the file's name without .csv and .gz. time_s: rising; time_s, speed_mps and power_w have no NaN.
    power_w: at the battery's terminals, positive = discharge, all consumers included. voltage_v, current_a: likewise.
    soc_frac: as the file has it, of whatever capacity it means. heater_w, aircon_w: electric. heading_rad: clockwise
    from north; wind_from_rad: direction that it comes from. wet_frac: 1 on a wet road. payload_kg: beyond the
    vehicle's mass. notes: what the reader has found and what it did.
    """

    id: str
    time_s: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    power_w: NDArray[np.float64]
    elevation_m: NDArray[np.float64] | None = None
    ambient_k: NDArray[np.float64] | None = None
    soc_frac: NDArray[np.float64] | None = None
    battery_k: NDArray[np.float64] | None = None
    heater_w: NDArray[np.float64] | None = None
    aircon_w: NDArray[np.float64] | None = None
    voltage_v: NDArray[np.float64] | None = None
    current_a: NDArray[np.float64] | None = None
    latitude_deg: NDArray[np.float64] | None = None
    longitude_deg: NDArray[np.float64] | None = None
    heading_rad: NDArray[np.float64] | None = None
    wind_speed_mps: NDArray[np.float64] | None = None
    wind_from_rad: NDArray[np.float64] | None = None
    wet_frac: NDArray[np.float64] | None = None
    payload_kg: NDArray[np.float64] | None = None
    notes: tuple[Note, ...] = ()

    def energy_j(self) -> float:
        """Energy that left the battery, ∫P dt by the trapezoidal rule [J]."""
        return float(np.trapezoid(self.power_w, self.time_s))

    def distance_m(self) -> float:
        """Way driven, ∫v dt by the trapezoidal rule [m]."""
        return float(np.trapezoid(self.speed_mps, self.time_s))

    def profile(self, step_s: float = PROFILE_STEP_S) -> DrivenProfile:
        """Speed and elevation at equal steps and at the end, linear between samples, to be replayed.

        Steps of a second by default: at 10 Hz the noise of a speed sensor would be taken for accelerations, and each
        costs what drive and recuperation lose.
        """
        begin, end = float(self.time_s[0]), float(self.time_s[-1])
        time_s = np.append(np.arange(begin, end - 1e-3 * step_s, step_s), end)
        elevation_m = None
        if self.elevation_m is not None:
            known = ~np.isnan(self.elevation_m)
            elevation_m = np.interp(time_s, self.time_s[known], self.elevation_m[known])
        return DrivenProfile(time_s, np.interp(time_s, self.time_s, self.speed_mps), elevation_m)


def read_recording(path: Path, hidden: Sequence[str] = ()) -> Recording:
    """The recording in a file, plain or gzip, of any known format, checked (diagnosis.recording_checks).

    hidden: patterns such as "Heat*" of names of columns that are dropped before anything is read, letter case aside.
    Raises RecordingError naming file, row, column, value and what is allowed; OSError where the file can't be opened.
    """
    table = _table(path, hidden)
    for form in FORMATS:
        if form.recognises(table.names):
            return checked(form.read(table), table.path)
    known = "; ".join(f"{form.name}: {', '.join(form.needs)}" for form in FORMATS)
    raise RecordingError(table.path, 1, "the header", _shown(", ".join(table.names)), f"columns of a format ({known})")


@dataclass(frozen=True, slots=True)
class _Table:
    """A file's cells as texts: names of its columns, rows with their position in the file, hidden columns left out."""

    path: str
    id: str
    names: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    columns: tuple[int, ...]  # where each name stands in a row

    def error(self, row: int, column: str, value: str, allowed: str) -> RecordingError:
        return RecordingError(self.path, self.lines[row], column, value, allowed)


@dataclass(frozen=True, slots=True)
class _Column:
    """A column of a format: the channel that it fills, factor and offset to SI, and its range in the file's unit."""

    name: str
    channel: str
    low: float
    high: float
    to_si: float = 1.0
    offset: float = 0.0

    def allowed(self) -> str:
        return f"a number from {self.low:g} to {self.high:g}, with a decimal point"


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file: how its header is recognised, and how its table is read."""

    name: str
    needs: tuple[str, ...]
    read: Callable[[_Table], Recording]

    def recognises(self, names: Sequence[str]) -> bool:
        """Whether a header with these names is of this format."""
        return set(self.needs) <= set(names)


def _text(path: Path) -> str:
    content = path.read_bytes()
    if content.startswith(GZIP_MAGIC):
        try:
            content = gzip.decompress(content)
        except (OSError, EOFError, zlib.error) as error:
            raise RecordingError(str(path), 1, "the file", f"not gzip ({error})", "a whole gzip file") from error
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")  # where each byte is a letter


def _table(path: Path, hidden: Sequence[str]) -> _Table:
    text = _text(path)
    header_line = text.partition("\n")[0]
    delimiter = ";" if ";" in header_line else ","
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    header: list[str] = []
    rows: list[list[str]] = []
    lines: list[int] = []
    try:
        header = [name.strip() for name in next(reader, [])]
        for row in reader:
            if row:
                rows.append(row)
                lines.append(reader.line_num)
                if len(row) != len(header):
                    found = f"{len(row)} cells long"
                    raise RecordingError(str(path), reader.line_num, "the row", found, f"{len(header)}, as the header")
    except csv.Error as error:
        raise RecordingError(
            str(path), reader.line_num, "the row", str(error), f"cells set off by {delimiter}"
        ) from error
    if len(rows) < 2:
        raise RecordingError(str(path), reader.line_num or 1, "the table", f"{len(rows)} rows", "at least 2 samples")
    patterns = [pattern.strip().lower() for pattern in hidden]
    seen = [k for k, name in enumerate(header) if not any(fnmatchcase(name.lower(), one) for one in patterns)]
    name = path.name.removesuffix(".gz").removesuffix(".csv")
    return _Table(str(path), name, tuple(header[k] for k in seen), rows, lines, tuple(seen))


def _values(table: _Table, column: _Column, *, required: bool) -> NDArray[np.float64]:
    """A column in SI units; empty cells are NaN, and an error where the column is required."""
    at = [k for k, name in enumerate(table.names) if name == column.name]
    if len(at) > 1:
        raise RecordingError(table.path, 1, column.name, "there twice", "once")
    if not at:
        raise RecordingError(table.path, 1, column.name, "missing", "a column of this name")
    cells = [row[table.columns[at[0]]] for row in table.rows]
    try:
        values = np.array([cell or "nan" for cell in cells], np.float64)
    except ValueError:
        values = np.array([_number(table, row, column, cell) for row, cell in enumerate(cells)], np.float64)
    good = (values >= column.low) & (values <= column.high)
    if not required:
        good |= np.isnan(values)
    if not bool(good.all()):
        row = int(np.argmin(good))
        raise table.error(row, column.name, _shown(cells[row].strip()) or "empty", column.allowed())
    return values * column.to_si + column.offset


def _number(table: _Table, row: int, column: _Column, cell: str) -> float:
    try:
        return float(cell) if cell.strip() else math.nan
    except ValueError as error:
        raise table.error(row, column.name, _shown(cell), column.allowed()) from error


def _shown(text: str) -> str:
    return text if len(text) <= 80 else f"{text[:77]}..."


def _recording(table: _Table, columns: Sequence[_Column]) -> Recording:
    """A recording of the columns that a table has; power is taken from voltage and current where it has no own."""
    channels: dict[str, NDArray[np.float64]] = {}
    has_power = any(column.channel == "power_w" and column.name in table.names for column in columns)
    needed = REQUIRED if has_power else (*REQUIRED, "voltage_v", "current_a")
    for column in columns:
        required = column.channel in needed
        if column.name in table.names:
            channels[column.channel] = _values(table, column, required=required)
    if "power_w" not in channels:
        channels["power_w"] = channels["voltage_v"] * channels["current_a"]
    known = {column.name for column in columns}
    unused = [name for name in table.names if name not in known]
    notes = []
    for name in sorted({name for name in unused if unused.count(name) > 1}):
        notes.append(Note(NoteKind.IGNORED, "", f"column {name!r} is there {unused.count(name)} times"))
    if unused:
        notes.append(Note(NoteKind.IGNORED, "", f"columns not used: {', '.join(dict.fromkeys(unused))}"))
    step_s = np.diff(channels["time_s"])
    if bool((step_s < 0.0).any()):
        row = int(np.argmax(step_s < 0.0)) + 1
        before, time = (f"{channels['time_s'][k]:g}" for k in (row - 1, row))
        raise table.error(row, columns[0].name, time, f"at least that of the row before, {before}")
    repeated = int(np.count_nonzero(step_s == 0.0))
    if repeated:
        keep = np.concatenate(([True], step_s > 0.0))
        channels = {name: values[keep] for name, values in channels.items()}
        notes.append(
            Note(NoteKind.REPAIRED, "time_s", f"rows dropped, whose time the row before has already: {repeated}")
        )
    if channels["time_s"].size < 2:
        raise RecordingError(table.path, table.lines[-1], columns[0].name, "always the same", "rising")
    return Recording(id=table.id, **channels, notes=tuple(notes))


def _read_i3(table: _Table) -> Recording:
    """The TUM files as published (DOI 10.21227/6jr9-5235): current is negative while discharging."""
    return _recording(table, I3_COLUMNS)


def _read_plain(table: _Table) -> Recording:
    """joulepath's own columns; power itself, or voltage and current."""
    names = set(table.names)
    if "power_w" not in names and not {"voltage_v", "current_a"} <= names:
        raise RecordingError(table.path, 1, "power_w", "missing", "power_w, or voltage_v and current_a")
    return _recording(table, PLAIN_COLUMNS)


I3_COLUMNS: Final = (
    _Column("Time [s]", "time_s", 0.0, 1e7),
    _Column("Velocity [km/h]", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS),
    _Column("Elevation [m]", "elevation_m", -500.0, 9000.0),
    _Column("Battery Voltage [V]", "voltage_v", 0.0, 1000.0),
    _Column("Battery Current [A]", "current_a", -1000.0, 1000.0, -1.0),
    _Column("Battery Temperature [°C]", "battery_k", -50.0, 100.0, offset=ZERO_CELSIUS_K),
    _Column("SoC [%]", "soc_frac", 0.0, 100.0, 0.01),
    _Column("Heating Power CAN [kW]", "heater_w", 0.0, 20.0, 1000.0),
    _Column("AirCon Power [kW]", "aircon_w", 0.0, 20.0, 1000.0),
    _Column("Ambient Temperature [°C]", "ambient_k", -50.0, 56.0, offset=ZERO_CELSIUS_K),
)

PLAIN_COLUMNS: Final = (
    _Column("time_s", "time_s", -1e12, 1e12),
    _Column("speed_kmh", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS),
    _Column("power_w", "power_w", -MOST_W, MOST_W),
    _Column("voltage_v", "voltage_v", 0.0, 2000.0),
    _Column("current_a", "current_a", -5000.0, 5000.0),
    _Column("elevation_m", "elevation_m", -500.0, 9000.0),
    _Column("lat", "latitude_deg", -90.0, 90.0),
    _Column("lon", "longitude_deg", -180.0, 180.0),
    _Column("heading_deg", "heading_rad", -360.0, 360.0, RADIAN_PER_DEGREE),
    _Column("soc_frac", "soc_frac", 0.0, 1.0),
    _Column("ambient_c", "ambient_k", -50.0, 56.0, offset=ZERO_CELSIUS_K),
    _Column("battery_c", "battery_k", -50.0, 100.0, offset=ZERO_CELSIUS_K),
    _Column("heater_w", "heater_w", 0.0, 100_000.0),
    _Column("aircon_w", "aircon_w", 0.0, 100_000.0),
    _Column("wind_speed_mps", "wind_speed_mps", 0.0, 60.0),
    _Column("wind_from_deg", "wind_from_rad", -360.0, 360.0, RADIAN_PER_DEGREE),
    _Column("wet", "wet_frac", 0.0, 1.0),
    _Column("payload_kg", "payload_kg", 0.0, 100_000.0),
)

# A further format is one more entry, tried in this order; its reader turns the table into a Recording in any way.
FORMATS: Final = (
    Format(
        "TUM BMW i3",
        ("Time [s]", "Velocity [km/h]", "Battery Voltage [V]", "Battery Current [A]"),
        _read_i3,
    ),
    Format("joulepath CSV", ("time_s", "speed_kmh"), _read_plain),
)
