"""Logs of Leaf Spy, whose units of speed, height and air are what its user has set, and not in the file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.formats.clocks import Series, recording_of_series, series_of
from diagnosis.recordings.formats.named_columns import MOST_KMH, named_series
from diagnosis.recordings.formats.tables import Column, LogTable
from diagnosis.recordings.formats.units import K_PER_FAHRENHEIT, M_PER_FOOT
from diagnosis.recordings.notes import Note, NoteKind
from diagnosis.recordings.positions import east_north_m
from energy.units import JOULE_PER_WH, KM_PER_MILE, KMH_PER_MPS, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

NEEDS: Final = ("Date/Time", "Speed", "Pack Volts", "Pack Amps")
TIME: Final = Column("Date/Time", "time_s", 0.0, 1e10)
EPOCH_TIME: Final = Column("epoch time", "time_s", 0.0, 1e10)
SPEED: Final = Column("Speed", "speed_mps", 0.0, MOST_KMH, 1.0 / KMH_PER_MPS)
HEIGHT: Final = Column("Elv", "elevation_m", -500.0, 30_000.0)
AIR: Final = Column("Ambient", "ambient_k", -60.0, 135.0)
CHARGE: Final = Column("SOC", "soc_frac", 0.0, 1e6, 1e-6)  # ten thousandths of a percent
SENSORS: Final = ("4", "3", "2", "1")  # the first has the last word
PACK_TEMPERATURES: Final = (
    *(
        Column(f"Pack T{k} F", "battery_k", -58.0, 212.0, K_PER_FAHRENHEIT, ZERO_CELSIUS_K - 32.0 * K_PER_FAHRENHEIT)
        for k in SENSORS
    ),
    *(Column(f"Pack T{k} C", "battery_k", -50.0, 100.0, offset=ZERO_CELSIUS_K) for k in SENSORS),
)
PERCENT: Final = 1e-4  # as a share of ten thousandths of a percent: what SOC is where it counts percent
COLUMNS: Final = (
    SPEED,
    HEIGHT,
    Column("Pack Volts", "voltage_v", 0.0, 1000.0),
    Column("Pack Amps", "current_a", -1000.0, 1000.0),
    *PACK_TEMPERATURES,
    CHARGE,
    Column("Odo(mi)", "odometer_m", 0.0, 1e7, 1000.0 * KM_PER_MILE),
    Column("Odo(km)", "odometer_m", 0.0, 1e7, 1000.0),
    Column("RegenWh", "regen_j", -1e7, 1e7, JOULE_PER_WH),
    Column("Est Pwr A/C(50w)", "aircon_w", 0.0, 2000.0, 50.0),
    Column("Est Pwr Htr(250w)", "heater_w", 0.0, 400.0, 250.0),
    AIR,
)
POSITIONS: Final = (("Lat", "latitude_deg", 90.0), ("Long", "longitude_deg", 180.0))
LEAF_SPY_NAMES: Final = frozenset((TIME.name, EPOCH_TIME.name, *(column.name for column in COLUMNS), "Lat", "Long"))
MOST_STEP_S: Final = 30.0
LEAST_MPS: Final = 5.0
LEAST_STEPS: Final = 20
MILES: Final = (1.45, 1.8)  # way by positions over that by a speed that is read as km/h
KILOMETRES: Final = (0.9, 1.12)
HOTTEST_C: Final = 48.0


def read_leaf_spy(table: LogTable) -> Recording:
    """A log of Leaf Spy; positions tell whether its speed is in miles an hour, and then its height is in feet.

    The air is in the unit that is nearer to the battery's temperature. Positive current is discharge.
    """
    clock = EPOCH_TIME if EPOCH_TIME.name in table.names else TIME
    time_s, written = table.times(clock)
    series = [record for record in named_series(table, time_s, COLUMNS) if record.values.size]
    for name, channel, most in POSITIONS:
        if name in table.names:
            series.append(_positions(table, time_s, Column(name, channel, -most, most)))
    notes = [Note(NoteKind.READ, "time_s", f"seconds, from {written or 'column ' + repr(clock.name)}")]
    first = {record.channel: record for record in series}
    miles = _is_in_miles(first)
    if miles:
        first["speed_mps"] = _scaled(first["speed_mps"], KM_PER_MILE)
        if "elevation_m" in first:
            first["elevation_m"] = _scaled(first["elevation_m"], M_PER_FOOT)
    what = "miles an hour and feet: so say its positions" if miles else "km/h and metres"
    sure = "" if miles is not None else ", assumed: the file does not tell"
    notes.append(Note(NoteKind.READ, "speed_mps", f"speed and height in {what}{sure}"))
    charge = first.get("soc_frac")
    if charge is not None and float(charge.values.max()) <= PERCENT:
        first["soc_frac"] = _scaled(charge, 0.01 / CHARGE.to_si)
        notes.append(Note(NoteKind.READ, "soc_frac", "in percent: as ten thousandths of it the battery were empty"))
    if "ambient_k" in first:
        first["ambient_k"], unit, why = _air(first["ambient_k"], first.get("battery_k"), miles=bool(miles))
        notes.append(Note(NoteKind.READ, "ambient_k", f"in {unit}, {why}"))
    return recording_of_series(table.path, table.id, list(first.values()), notes)


def _positions(table: LogTable, time_s: NDArray[np.float64], column: Column) -> Series:
    """Positions in degrees, or degrees and minutes; those of exactly 0 are none."""
    values = table.values(column)
    return series_of(column, time_s, np.where(values == 0.0, np.nan, values))


def _is_in_miles(series: dict[str, Series]) -> bool | None:
    """Whether way by the positions is 1.6 times that by a speed read as km/h; None where they do not tell."""
    if not {"latitude_deg", "longitude_deg", "speed_mps"} <= set(series):
        return None
    speed, latitude, longitude = (series[name] for name in ("speed_mps", "latitude_deg", "longitude_deg"))
    at_s = np.intersect1d(np.intersect1d(speed.time_s, latitude.time_s), longitude.time_s)
    if at_s.size < LEAST_STEPS:
        return None
    places = [each.values[np.searchsorted(each.time_s, at_s)] for each in (latitude, longitude)]
    east, north = east_north_m(*places)
    pace = speed.values[np.searchsorted(speed.time_s, at_s)]
    step_s = np.diff(at_s)
    driven_m = 0.5 * (pace[1:] + pace[:-1]) * step_s
    good = (step_s <= MOST_STEP_S) & (np.minimum(pace[1:], pace[:-1]) >= LEAST_MPS)
    if np.count_nonzero(good) < LEAST_STEPS:
        return None
    ratio = float(np.median(np.hypot(np.diff(east), np.diff(north))[good] / driven_m[good]))
    if MILES[0] < ratio < MILES[1]:
        return True
    return False if KILOMETRES[0] < ratio < KILOMETRES[1] else None


def _air(record: Series, battery: Series | None, *, miles: bool) -> tuple[Series, str, str]:
    """The air in K, the unit that it was written in, and why this one."""
    as_f_k = (record.values - 32.0) / 1.8 + ZERO_CELSIUS_K
    as_c_k = record.values + ZERO_CELSIUS_K
    fahrenheit, why = miles, "assumed by the unit of speed: no temperature of the battery tells it"
    if float(np.median(record.values)) > HOTTEST_C:
        fahrenheit, why = True, "as °C it were too hot"
    elif battery is not None and battery.values.size:
        start_k = float(battery.values[0])
        fahrenheit = abs(float(np.median(as_f_k)) - start_k) < abs(float(np.median(as_c_k)) - start_k)
        why = "the unit that is nearer to the battery's temperature"
    values = as_f_k if fahrenheit else as_c_k
    return Series(record.channel, record.source, record.time_s, values), "°F" if fahrenheit else "°C", why


def _scaled(record: Series, factor: float) -> Series:
    return Series(record.channel, record.source, record.time_s, factor * record.values)


def is_leaf_spy(names: Sequence[str]) -> bool:
    """Whether a header is that of Leaf Spy."""
    return set(NEEDS) <= set(names)
