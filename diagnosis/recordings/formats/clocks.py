"""Channels with clocks of their own, brought to the clock of the speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.counters import is_fine, is_of_energy, mean_rate, only_rises, rate, step_of
from diagnosis.recordings.notes import Note, NoteKind, RecordingError
from diagnosis.recordings.recording import Detail, Recording
from energy.units import JOULE_PER_WH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.formats.tables import Column

LEAST_STEP_S: Final = 1e-6  # times closer than that are the same; seconds since 1970 resolve a quarter of it
BRIDGED_S: Final = 10.0  # straight lines between two samples at most so long apart
HELD_S: Final = 600.0  # a slow channel keeps its value so long, as loggers write many of them only when they change
LINEAR: Final = frozenset(
    {
        "power_w",
        "voltage_v",
        "current_a",
        "elevation_m",
        "latitude_deg",
        "longitude_deg",
        "heater_w",
        "aircon_w",
        "hvac_w",
    }
)


@dataclass(frozen=True, slots=True)
class Series:
    """One channel by its own clock: float64 (n,) times [s], rising or equal, and values in SI units without NaN.

    source: the column that it came from, as notes name it.
    """

    channel: str
    source: str
    time_s: NDArray[np.float64]
    values: NDArray[np.float64]

    def distinct(self) -> Series:
        """The series with one value a time, the last that it has."""
        keep = np.append(np.diff(self.time_s) > LEAST_STEP_S, True)[: self.time_s.size]
        return Series(self.channel, self.source, self.time_s[keep], self.values[keep])

    def linear_at(self, at_s: NDArray[np.float64], limit_s: float = BRIDGED_S) -> NDArray[np.float64]:
        """Values at other times, float64, linear between samples at most limit_s apart, NaN elsewhere."""
        values = np.interp(at_s, self.time_s, self.values, left=np.nan, right=np.nan)
        before = np.searchsorted(self.time_s, at_s, side="right") - 1
        after = np.searchsorted(self.time_s, at_s, side="left")
        inside = (before >= 0) & (after < self.time_s.size)
        apart = self.time_s[np.minimum(after, self.time_s.size - 1)] - self.time_s[np.maximum(before, 0)]
        return np.where(inside & (apart <= limit_s), values, np.nan)

    def near_at(self, at_s: NDArray[np.float64], limit_s: float = BRIDGED_S) -> NDArray[np.float64]:
        """Values at other times, float64, linear between samples and level beyond the ends, NaN far from any sample."""
        before = np.maximum(np.searchsorted(self.time_s, at_s, side="right") - 1, 0)
        after = np.minimum(before + 1, self.time_s.size - 1)
        away = np.minimum(np.abs(at_s - self.time_s[before]), np.abs(at_s - self.time_s[after]))
        return np.where(away <= limit_s, np.interp(at_s, self.time_s, self.values), np.nan)

    def previous_at(self, at_s: NDArray[np.float64], limit_s: float = HELD_S) -> NDArray[np.float64]:
        """Values at other times, float64, each the last one before if it is at most limit_s old, NaN elsewhere."""
        before = np.searchsorted(self.time_s, at_s, side="right") - 1
        held = np.maximum(before, 0)
        known = (before >= 0) & (at_s - self.time_s[held] <= limit_s)
        return np.where(known, self.values[held], np.nan)


def series_of(
    column: Column, time_s: NDArray[np.float64], values: NDArray[np.float64], source: str | None = None
) -> Series:
    """A column's values by its clock, without those that are NaN and with one value a time."""
    known = ~np.isnan(values)
    return Series(column.channel, source or column.name, time_s[known], values[known]).distinct()


def recording_of_series(path: str, trip_id: str, series: Sequence[Series], notes: Sequence[Note]) -> Recording:
    """A recording at the times of its speed; power is that of voltage and current where it has no series of its own.

    Of two series of one channel the first counts, and the second is compared with it in a note. Power, voltage,
    current, height and position are linear between their samples up to BRIDGED_S, all else keeps its value up to
    HELD_S. Samples at which power is not known are dropped. Raises RecordingError where speed or power is missing.
    """
    first: dict[str, Series] = {}
    found = list(notes)
    for record in series:
        if record.time_s.size < 2:
            found.append(Note(NoteKind.IGNORED, record.channel, f"{record.source}: {record.time_s.size} values"))
        elif record.channel in first:
            found.append(_compared(first[record.channel], record))
        else:
            first[record.channel] = record
    if "power_w" not in first and {"voltage_v", "current_a"} <= set(first):
        current, voltage = first["current_a"], first["voltage_v"]
        power = current.values * voltage.near_at(current.time_s)
        known = ~np.isnan(power)
        first["power_w"] = Series("power_w", "voltage times current", current.time_s[known], power[known])
    found += counted_channels(first)
    if "soc_frac" not in first and "displayed_frac" in first:
        first["soc_frac"] = first["displayed_frac"]
    charge = first.get("soc_frac")
    coarse_counter = "power_w" not in first and _with_counted_mean(first)
    charge_only = "power_w" not in first and charge is not None and charge.time_s.size >= 2
    if charge_only and "speed_mps" in first:
        times_s = first["speed_mps"].time_s
        first["power_w"] = Series("power_w", "none recorded", times_s, np.zeros_like(times_s))
    wanted = "a power, or voltage and current, of the battery, or its charge or a counter of energy"
    for channel, needed in (("speed_mps", "a speed, or an odometer in steps of metres"), ("power_w", wanted)):
        if channel not in first or first[channel].time_s.size < 2:
            raise RecordingError(path, 1, channel, "missing", f"{needed}, with at least 2 values")
    time_s = first["speed_mps"].time_s
    channels = {name: _at(record, time_s) for name, record in first.items()}
    keep = ~np.isnan(channels["power_w"])
    if np.count_nonzero(keep) < 2:
        raise RecordingError(path, 1, "power_w", "never recorded while the speed was", f"within {BRIDGED_S:g} s of it")
    dropped = int(np.count_nonzero(~keep))
    if dropped:
        text = f"{dropped} of {keep.size} samples dropped, at which power is not known within {BRIDGED_S:g} s"
        found.append(Note(NoteKind.REPAIRED, "power_w", text))
    others = [
        name
        for name, record in first.items()
        if record.time_s.size != time_s.size or bool((record.time_s != time_s).any())
    ]
    if others:
        text = f"brought to the clock of the speed: {', '.join(sorted(others))}"
        found.append(Note(NoteKind.READ, "", text))
    kept = {name: values[keep] for name, values in channels.items()}
    return Recording(
        id=trip_id,
        time_s=time_s[keep],
        **kept,
        notes=tuple(found),
        gaps=(),
        detail=Detail.CHARGE if charge_only else Detail.COUNTER if coarse_counter else Detail.SAMPLES,
        elevation_source="",
    )


def counted_channels(first: dict[str, Series]) -> list[Note]:
    """Put speed and power by fine counters beside the series where they have none; notes on what was done."""
    notes = []
    for channel, counter, what in (("speed_mps", "odometer_m", "odometer"), ("power_w", "used_j", "counter of energy")):
        record = first.get(counter)
        if channel in first or record is None or not is_fine(record.time_s, record.values):
            continue
        sound = only_rises(record.values) if channel == "speed_mps" else is_of_energy(record.time_s, record.values)
        if not sound:
            continue
        text = f"by the {what}, in steps of {_step_text(channel, record.values)}"
        notes.append(Note(NoteKind.READ, channel, text))
        first[channel] = Series(channel, record.source, record.time_s, rate(record.time_s, record.values))
    return notes


def _step_text(channel: str, values: NDArray[np.float64]) -> str:
    step = step_of(values)
    return f"{step:.3g} m" if channel == "speed_mps" else f"{step / JOULE_PER_WH:.3g} Wh"


def is_steady(record: Series) -> bool:
    """Whether a coarse counter can be of energy: more at the end, and never set back by more than a step."""
    falls = np.diff(record.values)
    if record.values.size < 2 or record.values[-1] <= record.values[0]:
        return False
    return float(falls.min()) >= -1.5 * step_of(record.values)


def _with_counted_mean(first: dict[str, Series]) -> bool:
    """Put the mean power by a coarse counter of energy beside the series, at the speed's clock, if it tells one."""
    record = first.get("used_j")
    if record is None or "speed_mps" not in first or not is_steady(record):
        return False
    mean_w = mean_rate(record.time_s, record.values)
    if mean_w is None:
        return False
    times_s = first["speed_mps"].time_s
    first["power_w"] = Series("power_w", record.source, times_s, np.full(times_s.size, mean_w))
    return True


def _at(series: Series, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    return (
        series.linear_at(time_s)
        if series.channel in LINEAR or series.channel == "speed_mps"
        else series.previous_at(time_s)
    )


def _compared(first: Series, other: Series) -> Note:
    """How far a second series of a channel is from the first, at the times of the second."""
    apart = np.abs(first.previous_at(other.time_s) - other.values)
    known = apart[~np.isnan(apart)]
    text = f"{other.source} left aside for {first.source}"
    if known.size:
        spread = float(np.median(np.abs(first.values - np.median(first.values))))
        text += f": they differ by {np.median(known):.3g} as a rule, by {known.max():.3g} at most"
        if float(np.median(known)) > max(0.1 * spread, 1e-9):
            return Note(NoteKind.SUSPECT, first.channel, text)
    return Note(NoteKind.IGNORED, first.channel, text)
