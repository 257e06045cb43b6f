"""Formats with a fixed name for each column: the TUM BMW i3 files, joulepath's own, ABRP telemetry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.counters import mean_rate
from diagnosis.recordings.formats.clocks import (
    LEAST_STEP_S,
    Series,
    counted_channels,
    is_steady,
    recording_of_series,
    series_of,
)
from diagnosis.recordings.formats.tables import Column, LogTable
from diagnosis.recordings.formats.units import M_PER_FOOT, RADIAN_PER_DEGREE
from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from diagnosis.recordings.recording import REQUIRED, Detail, Recording
from diagnosis.recordings.soundness.charging import without_charging
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, KM_PER_MILE, KMH_PER_MPS, MPS_PER_MPH, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

MOST_KMH: Final = 200.0  # the fastest that energy.vehicle.vehicle knows
MOST_W: Final = 1_000_000.0


def read_i3(table: LogTable) -> Recording:
    """The TUM files as published (DOI 10.21227/6jr9-5235): current is negative while discharging."""
    for name in I3_NEEDS:
        table.cells(name)
    return _recording(table, I3_COLUMNS)


def read_plain(table: LogTable) -> Recording:
    """joulepath's own columns; power itself, or voltage and current, or at least the charge."""
    own = {column.channel for column in PLAIN_COLUMNS if column.name in table.names}
    if not own & {"power_w", "soc_frac", "displayed_frac", "used_j"} and not {"voltage_v", "current_a"} <= own:
        allowed = "power_w, or voltage_v and current_a, or soc_frac, or energy_wh"
        raise RecordingError(table.path, 1, "power_w", "missing", allowed)
    return _recording(table, PLAIN_COLUMNS)


def is_plain(names: Sequence[str]) -> bool:
    """Whether a header is that of joulepath's own columns: a time, and a speed in any unit or an odometer."""
    own = {column.channel for column in PLAIN_COLUMNS if column.name in names}
    return "time_s" in names and bool(own & {"speed_mps", "odometer_m"})


def read_abrp(table: LogTable) -> Recording:
    """Names of the Iternio telemetry API (tlm/send): power [kW] and current [A] positive while discharging.

    A value may be missing in any row, as the API has it: each column is brought to the clock of the speed. What is
    marked is_charging is cut out.
    """
    time_s, written = table.times(ABRP_TIME)
    needed = {"speed_mps", "power_w"} if "power" in table.names else {"speed_mps", "voltage_v", "current_a"}
    series = named_series(table, time_s, ABRP_COLUMNS, needed)
    notes = [
        *unused_notes(table, {column.name for column in (ABRP_TIME, *ABRP_COLUMNS, ABRP_CHARGING)}),
        *_written(written),
    ]
    recording = recording_of_series(table.path, table.id, series, notes)
    if ABRP_CHARGING.name not in table.names:
        return recording
    flag = series_of(ABRP_CHARGING, time_s, table.values(ABRP_CHARGING))
    if flag.time_s.size == 0:
        return recording
    marked = flag.previous_at(recording.time_s) == 1.0
    return without_charging(recording, marked, "marked is_charging", table.path)


def named_series(
    table: LogTable, time_s: NDArray[np.float64], columns: Sequence[Column], needed: Collection[str] = ()
) -> list[Series]:
    """A series for each column that a table has; cells out of range are blanked, or an error in needed channels."""
    return [
        series_of(column, time_s, table.values(column, strict=column.channel in needed))
        for column in columns
        if column.name in table.names
    ]


def _recording(table: LogTable, columns: Sequence[Column]) -> Recording:
    """A recording of the columns that a table has; power is taken from voltage and current where it has no own."""
    time_s, written = table.times(columns[0])
    channels: dict[str, NDArray[np.float64]] = {"time_s": time_s}
    own = {column.channel for column in columns if column.name in table.names}
    has_power = "power_w" in own
    poor = not has_power and not {"voltage_v", "current_a"} <= own
    needed = REQUIRED if has_power or poor else (*REQUIRED, "voltage_v", "current_a")
    notes = [*unused_notes(table, {column.name for column in columns}), *_written(written)]
    for column in columns[1:]:
        if column.name not in table.names:
            continue
        if column.channel in channels:
            notes.append(Note(NoteKind.IGNORED, column.channel, f"column {column.name!r}: it is there in another unit"))
        else:
            channels[column.channel] = table.values(column, required=column.channel in needed)
    detail = Detail.SAMPLES
    if poor or "speed_mps" not in own:
        detail = _counted(table, channels, notes, poor=poor)
    if not has_power and not poor:
        channels["power_w"] = channels["voltage_v"] * channels["current_a"]
    if "soc_frac" not in channels and "displayed_frac" in channels:
        channels["soc_frac"] = channels["displayed_frac"]
    step_s = np.diff(time_s)
    repeated = int(np.count_nonzero(step_s <= LEAST_STEP_S))
    if repeated:
        keep = np.concatenate(([True], step_s > LEAST_STEP_S))
        channels = {name: values[keep] for name, values in channels.items()}
        notes.append(
            Note(NoteKind.REPAIRED, "time_s", f"rows dropped, whose time the row before has already: {repeated}")
        )
    if channels["time_s"].size < 2:
        raise RecordingError(table.path, table.lines[-1], columns[0].name, "always the same", "rising")
    return Recording(id=table.id, **channels, notes=tuple(notes), gaps=(), detail=detail, elevation_source="")


def _counted(table: LogTable, channels: dict[str, NDArray[np.float64]], notes: list[Note], *, poor: bool) -> Detail:
    """Put speed and power by counters among the channels where they are missing, and what is then known of power."""
    time_s = channels["time_s"]
    first = {
        name: series_of(Column(name, name, 0.0, 0.0), time_s, values)
        for name, values in channels.items()
        if name in ("odometer_m", "used_j")
    }
    # what is there already is left alone; its values are not asked for
    there = {name: Series(name, name, time_s, time_s) for name in channels if name == "speed_mps"}
    if not poor:
        there["power_w"] = Series("power_w", "power_w", time_s, time_s)
    series = first | there
    notes += counted_channels(series)
    if "speed_mps" not in series:
        raise RecordingError(table.path, 1, "speed_kmh", "missing", "a speed, or an odometer in steps of metres")
    for name in ("speed_mps", "power_w"):
        if name in series and name not in there:
            channels[name] = np.interp(time_s, series[name].time_s, series[name].values)
    if not poor or "power_w" in series:
        return Detail.SAMPLES
    used = first.get("used_j")
    mean_w = mean_rate(used.time_s, used.values) if used is not None and is_steady(used) else None
    channels["power_w"] = np.full(time_s.size, mean_w or 0.0)
    return Detail.CHARGE if mean_w is None else Detail.COUNTER


def unused_notes(table: LogTable, known: set[str]) -> list[Note]:
    """Notes on the columns that a format has no channel for."""
    unused = [name for name in table.names if name and name not in known]
    notes = []
    for name in sorted({name for name in unused if unused.count(name) > 1}):
        notes.append(Note(NoteKind.IGNORED, "", f"column {name!r} is there {unused.count(name)} times"))
    if unused:
        notes.append(Note(NoteKind.IGNORED, "", f"columns not used: {', '.join(dict.fromkeys(unused))}"))
    return notes


def _written(written: str) -> list[Note]:
    return [Note(NoteKind.READ, "time_s", f"seconds, from {written}")] if written else []


I3_NEEDS: Final = ("Time [s]", "Velocity [km/h]", "Battery Voltage [V]", "Battery Current [A]")
I3_COLUMNS: Final = (
    Column("Time [s]", "time_s", 0.0, 1e7),
    Column("Velocity [km/h]", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS),
    Column("Elevation [m]", "elevation_m", -500.0, 9000.0),
    Column("Battery Voltage [V]", "voltage_v", 0.0, 1000.0),
    Column("Battery Current [A]", "current_a", -1000.0, 1000.0, -1.0),
    Column("Battery Temperature [°C]", "battery_k", -50.0, 100.0, offset=ZERO_CELSIUS_K),
    Column("SoC [%]", "soc_frac", 0.0, 100.0, 0.01),
    Column("displayed SoC [%]", "displayed_frac", 0.0, 100.0, 0.01),
    Column("Heating Power CAN [kW]", "heater_w", 0.0, 20.0, 1000.0),
    Column("AirCon Power [kW]", "aircon_w", 0.0, 20.0, 1000.0),
    Column("Ambient Temperature [°C]", "ambient_k", -50.0, 56.0, offset=ZERO_CELSIUS_K),
)

PLAIN_COLUMNS: Final = (
    Column("time_s", "time_s", -1e12, 1e12),
    Column("speed_kmh", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS),
    Column("speed_mps", "speed_mps", 0.0, MOST_KMH / KMH_PER_MPS),
    Column("speed_mph", "speed_mps", 0.0, MOST_KMH / KM_PER_MILE, MPS_PER_MPH),
    Column("power_w", "power_w", -MOST_W, MOST_W),
    Column("power_kw", "power_w", -MOST_W / 1000.0, MOST_W / 1000.0, 1000.0),
    Column("voltage_v", "voltage_v", 0.0, 2000.0),
    Column("current_a", "current_a", -5000.0, 5000.0),
    Column("elevation_m", "elevation_m", -500.0, 9000.0),
    Column("elevation_ft", "elevation_m", -1640.0, 29_528.0, M_PER_FOOT),
    Column("lat", "latitude_deg", -90.0, 90.0),
    Column("latitude", "latitude_deg", -90.0, 90.0),
    Column("lon", "longitude_deg", -180.0, 180.0),
    Column("longitude", "longitude_deg", -180.0, 180.0),
    Column("heading_deg", "heading_rad", -360.0, 360.0, RADIAN_PER_DEGREE),
    Column("soc_frac", "soc_frac", 0.0, 1.0),
    Column("soc_percent", "soc_frac", 0.0, 100.0, 0.01),
    Column("displayed_soc_frac", "displayed_frac", 0.0, 1.0),
    Column("displayed_soc_percent", "displayed_frac", 0.0, 100.0, 0.01),
    Column("odometer_km", "odometer_m", 0.0, 1e7, 1000.0),
    Column("odometer_mi", "odometer_m", 0.0, 1e7, 1000.0 * KM_PER_MILE),
    Column("energy_wh", "used_j", -1e9, 1e9, JOULE_PER_WH),
    Column("energy_kwh", "used_j", -1e6, 1e6, JOULE_PER_KWH),
    Column("regen_wh", "regen_j", -1e9, 1e9, JOULE_PER_WH),
    Column("regen_kwh", "regen_j", -1e6, 1e6, JOULE_PER_KWH),
    Column("ambient_c", "ambient_k", -50.0, 56.0, offset=ZERO_CELSIUS_K),
    Column("ambient_f", "ambient_k", -58.0, 132.8, 1.0 / 1.8, ZERO_CELSIUS_K - 32.0 / 1.8),
    Column("battery_c", "battery_k", -50.0, 100.0, offset=ZERO_CELSIUS_K),
    Column("battery_f", "battery_k", -58.0, 212.0, 1.0 / 1.8, ZERO_CELSIUS_K - 32.0 / 1.8),
    Column("heater_w", "heater_w", 0.0, 100_000.0),
    Column("aircon_w", "aircon_w", 0.0, 100_000.0),
    Column("hvac_w", "hvac_w", 0.0, 100_000.0),
    Column("wind_speed_mps", "wind_speed_mps", 0.0, 60.0),
    Column("wind_from_deg", "wind_from_rad", -360.0, 360.0, RADIAN_PER_DEGREE),
    Column("wet", "wet_frac", 0.0, 1.0),
    Column("payload_kg", "payload_kg", 0.0, 100_000.0),
)

ABRP_TIME: Final = Column("utc", "time_s", 0.0, 1e11)
ABRP_CHARGING: Final = Column("is_charging", "", 0.0, 1.0)
ABRP_COLUMNS: Final = (
    Column("speed", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS),
    Column("power", "power_w", -MOST_W / 1000.0, MOST_W / 1000.0, 1000.0),
    Column("voltage", "voltage_v", 0.0, 2000.0),
    Column("current", "current_a", -5000.0, 5000.0),
    Column("soc", "soc_frac", 0.0, 100.0, 0.01),
    Column("odometer", "odometer_m", 0.0, 1e7, 1000.0),
    Column("lat", "latitude_deg", -90.0, 90.0),
    Column("lon", "longitude_deg", -180.0, 180.0),
    Column("elevation", "elevation_m", -500.0, 9000.0),
    Column("heading", "heading_rad", -360.0, 360.0, RADIAN_PER_DEGREE),
    Column("ext_temp", "ambient_k", -50.0, 56.0, offset=ZERO_CELSIUS_K),
    Column("batt_temp", "battery_k", -50.0, 100.0, offset=ZERO_CELSIUS_K),
    Column("hvac_power", "hvac_w", 0.0, 100.0, 1000.0),
)
FORMAT_NAMES: Final = frozenset(
    column.name for column in (*I3_COLUMNS, *PLAIN_COLUMNS, *ABRP_COLUMNS, ABRP_TIME, ABRP_CHARGING)
)
