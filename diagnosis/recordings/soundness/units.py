"""Units and factors held against independent channels: positions, odometer, voltage times current, counters of energy.

A channel is converted only where another channel gives the factor of a unit within SURE_FRAC; else it is told. Where
nothing independent was recorded, nothing is touched.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.counters import counts, is_fine, is_of_energy, only_rises, rate, step_of
from diagnosis.recordings.notes import Note, NoteKind
from diagnosis.recordings.recording import Detail
from diagnosis.recordings.soundness.plausibility import WAY_M, WINDOWS, way_ratios
from diagnosis.recordings.soundness.repairs import noted
from energy.units import JOULE_PER_KWH, KM_PER_MILE, KMH_PER_MPS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

SURE_FRAC: Final = 0.02
ODD_FRAC: Final = 0.07
ODD_ENERGY_FRAC: Final = 0.1
EVEN_SPREAD: Final = 1.15  # ratio of the quartiles of stretches below which positions are sure of a factor
SPEED_UNITS: Final = (
    (KMH_PER_MPS, "in m/s, declared as km/h"),
    (KM_PER_MILE, "in miles an hour, declared as km/h"),
    (1.0 / KM_PER_MILE, "in km/h, declared as miles an hour"),
    (1.0 / KMH_PER_MPS, "in km/h, declared as m/s"),
)
POWER_UNITS: Final = ((1000.0, "in kW, declared as W"), (0.001, "in W, declared as kW"))
COUNTED_M: Final = 3000.0
COUNTED_CHANGES: Final = 20
COUNTED_J: Final = 0.5 * JOULE_PER_KWH
MISSED: Final = 1.6  # what rare samples of power may be off by at most, of a counter that is of the same energy
RARE_S: Final = 4.0  # samples further apart than that miss accelerations, which a counter of energy does not


def with_units(recording: Recording) -> Recording:
    """The recording with speed and power in the units that other channels prove, each change with a note."""
    return _with_counted_power(_with_power_unit(_with_speed_unit(recording)))


def factor_notes(recording: Recording) -> Iterator[Note]:
    """Notes on an odometer and on counters of energy that differ from speed and power."""
    by_odometer = _odometer_factor(recording)
    if by_odometer is not None:
        yield from _odometer_notes(by_odometer)
    if recording.detail is Detail.SAMPLES:
        yield from _energy_notes(recording)


def _with_speed_unit(recording: Recording) -> Recording:
    by_positions, by_odometer = _positions_factor(recording), _odometer_factor(recording)
    for factor, what in ((by_positions, "positions"), (by_odometer, "odometer")):
        unit = None if factor is None else _unit(factor, SPEED_UNITS)
        if factor is None or unit is None:
            continue
        value, name = unit
        if what == "odometer" and (value < 1.0 or by_positions is not None):
            continue  # an odometer in miles looks like a speed that is too high
        text = f"is {name}: by the {what} the car drove {factor:.2f} times as fast; converted"
        return noted(replace(recording, speed_mps=value * recording.speed_mps), NoteKind.UNIT, "speed_mps", text)
    return recording


def _with_power_unit(recording: Recording) -> Recording:
    """Power of which voltage times current is a thousand times as much, or a thousandth."""
    if recording.voltage_v is None or recording.current_a is None or recording.detail is not Detail.SAMPLES:
        return recording
    product_w = np.abs(recording.voltage_v * recording.current_a)
    known = ~np.isnan(product_w)
    own_w = float(np.abs(recording.power_w[known]).sum())
    factor = float(product_w[known].sum()) / own_w if own_w > 0.0 else 0.0
    unit = _unit(factor, POWER_UNITS)
    if unit is None:
        return recording
    value, name = unit
    text = f"is {name}: voltage times current is {factor:.4g} times as much; converted"
    return noted(replace(recording, power_w=value * recording.power_w), NoteKind.UNIT, "power_w", text)


def _with_counted_power(recording: Recording) -> Recording:
    """Power by a fine counter of energy, where samples of power are so rare that they miss most of it."""
    used_j, time_s = recording.used_j, recording.time_s
    if used_j is None or recording.detail is not Detail.SAMPLES or float(np.median(np.diff(time_s))) < RARE_S:
        return recording
    known = ~np.isnan(used_j)
    if np.count_nonzero(known) < WINDOWS or not is_fine(time_s[known], used_j[known]):
        return recording
    counted_j, net_j, _, _ = _counted_and_own_j(recording, used_j)
    if not is_of_energy(time_s[known], used_j[known]) or not 1.0 / MISSED <= net_j / counted_j <= MISSED:
        return recording
    counted_w = np.interp(time_s, time_s[known], rate(time_s[known], used_j[known]))
    text = f"by the counter of energy, since samples are {float(np.median(np.diff(time_s))):.3g} s apart"
    return noted(replace(recording, power_w=counted_w), NoteKind.READ, "power_w", text)


def _unit(factor: float, units: tuple[tuple[float, str], ...]) -> tuple[float, str] | None:
    return next((unit for unit in units if abs(factor / unit[0] - 1.0) <= SURE_FRAC), None)


def _positions_factor(recording: Recording) -> float | None:
    """Speed by the positions over the recorded one; None where they do not tell it evenly."""
    ratios, way_m = way_ratios(recording)
    if ratios.size < WINDOWS or way_m < WAY_M:
        return None
    low, factor, high = np.quantile(ratios, (0.25, 0.5, 0.75)).tolist()
    return factor if high <= EVEN_SPREAD * low else None


def _odometer_factor(recording: Recording) -> float | None:
    """Way by the odometer over that by the speed; None where it is short, counts in few steps or runs back."""
    odometer_m = recording.odometer_m
    if odometer_m is None or not only_rises(odometer_m):
        return None
    spans = counts(recording.time_s, odometer_m, recording.gap_steps(recording.time_s))
    driven_m = _so_far(recording, recording.speed_mps)
    way_m = sum(
        float(np.interp(span.to_s, recording.time_s, driven_m) - np.interp(span.from_s, recording.time_s, driven_m))
        for span in spans
    )
    if way_m < COUNTED_M or sum(span.changes for span in spans) < COUNTED_CHANGES:
        return None
    return sum(span.rise for span in spans) / way_m


def _odometer_notes(factor: float) -> Iterator[Note]:
    text = f"by the odometer {factor:.3f} times as fast"
    if abs(factor * KM_PER_MILE - 1.0) <= SURE_FRAC:
        yield Note(NoteKind.UNIT, "odometer_m", f"may count miles, declared as km: {text}; not used")
    elif abs(factor - 1.0) <= ODD_FRAC:
        yield Note(NoteKind.CHECKED, "speed_mps", text)
    else:
        yield Note(NoteKind.SUSPECT, "speed_mps", text)


def _energy_notes(recording: Recording) -> Iterator[Note]:
    if recording.used_j is not None:
        counted_j, net_j, drawn_j, _ = _counted_and_own_j(recording, recording.used_j)
        if abs(counted_j) >= max(COUNTED_J, COUNTED_CHANGES * step_of(recording.used_j)) and net_j > 0.0:
            text = (
                f"adds up to {net_j / JOULE_PER_KWH:.2f} kWh, the counter of energy to {counted_j / JOULE_PER_KWH:.2f}"
            )
            if abs(net_j / counted_j - 1.0) <= ODD_ENERGY_FRAC:
                yield Note(NoteKind.CHECKED, "power_w", text)
            elif abs(drawn_j / counted_j - 1.0) <= 0.5 * ODD_ENERGY_FRAC:
                yield Note(NoteKind.CHECKED, "used_j", f"{text}, which counts what is drawn without recuperation")
            else:
                rare = float(np.median(np.diff(recording.time_s))) >= RARE_S
                why = ", which samples so far apart may miss" if rare else ": another gain, sign or unit of either"
                yield Note(NoteKind.SUSPECT, "power_w", f"{text}{why}")
    if recording.regen_j is not None:
        counted_j, _, _, back_j = _counted_and_own_j(recording, recording.regen_j)
        counted_j = abs(counted_j)
        if counted_j >= max(0.2 * COUNTED_J, COUNTED_CHANGES * step_of(recording.regen_j)) and back_j > 0.0:
            own_kwh, counted_kwh = back_j / JOULE_PER_KWH, counted_j / JOULE_PER_KWH
            text = f"{own_kwh:.2f} kWh came back by the power, {counted_kwh:.2f} by its counter"
            even = 2.0 / 3.0 <= back_j / counted_j <= 1.5
            yield Note(NoteKind.CHECKED if even else NoteKind.SUSPECT, "regen_j", text)


def _counted_and_own_j(recording: Recording, counter_j: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Rise of a counter, and over the same stretches energy by the power: net, what is drawn, what comes back [J]."""
    spans = counts(recording.time_s, counter_j, recording.gap_steps(recording.time_s))
    powers = (recording.power_w, np.maximum(recording.power_w, 0.0), np.maximum(-recording.power_w, 0.0))
    own = []
    for power_w in powers:
        so_far = _so_far(recording, power_w)
        own.append(
            sum(
                float(np.interp(span.to_s, recording.time_s, so_far) - np.interp(span.from_s, recording.time_s, so_far))
                for span in spans
            )
        )
    return sum(span.rise for span in spans), own[0], own[1], own[2]


def _so_far(recording: Recording, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Integral of a channel from the first sample on, without gaps, float64 (n,)."""
    step_s = np.where(recording.gap_steps(recording.time_s), 0.0, np.diff(recording.time_s))
    return np.concatenate(([0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * step_s)))
