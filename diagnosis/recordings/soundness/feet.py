"""Heights whose unit is doubted: in feet and read as metres, by the energy that hills take beside gains of speed.

A car's mass tells in both alike. Where hills take a third of what their height asks for, they are a third as high.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind
from energy.units import GRAVITY_MPS2

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

WINDOW_S: Final = 60.0  # long against delays of heights, and so that their noise is small beside hills
LEAST_WINDOWS: Final = 12
COARSEST_S: Final = 10.0
LEAST_CLIMB_M: Final = 100.0  # in all windows, as recorded
M_PER_FOOT: Final = 0.3048
BLOCKS: Final = 8
CLEAR_SD: Final = 3.0
SINGLE_SD: Final = 5.0  # of one drive beside others
NEAR_FRAC: Final = 0.15  # of a foot, within which a ratio is that of feet: losses of both ways differ
SURE_SD: Final = 0.02
NOISY_RATIO: Final = 0.5  # heights in metres that are noisy or late still ask for more than that
FEET_RATIOS: Final = (0.15, 0.345)  # a speed in miles an hour, declared as km/h, gives 0.39


@dataclass(frozen=True, slots=True)
class HillRatio:
    """What hills take over what their height asks for, by a mass that gains of speed tell, and its deviation [-]."""

    value: float
    sd: float

    def is_of_feet(self, clear_sd: float) -> bool:
        """Whether heights are rather in feet, by so many standard deviations."""
        return FEET_RATIOS[0] < self.value < FEET_RATIOS[1] and self.value + clear_sd * self.sd < NOISY_RATIO


def with_doubted_heights(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings, heights converted or left out where they seem to be in feet, with a note on each.

    Where all drives together say so, all are; else single drives that say so for themselves. Converted are they where
    the ratio is that of feet, and known to SURE_SD.
    """
    ratios = [hill_ratio(recording) for recording in recordings]
    known = [ratio for ratio in ratios if ratio is not None]
    if not known:
        return list(recordings)
    weights = np.array([1.0 / ratio.sd**2 for ratio in known])
    pooled = HillRatio(
        float(weights @ [ratio.value for ratio in known] / weights.sum()), float(1.0 / np.sqrt(weights.sum()))
    )
    by_all = pooled if pooled.is_of_feet(CLEAR_SD) else None
    found = []
    for recording, ratio in zip(recordings, ratios, strict=True):
        own = ratio if ratio is not None and ratio.is_of_feet(SINGLE_SD) else None
        doubt = by_all or own
        found.append(recording if doubt is None or recording.elevation_m is None else _from_feet(recording, doubt))
    return found


def hill_ratio(recording: Recording) -> HillRatio | None:
    """The ratio of a drive with heights, power and hills; None where it does not tell, deviations by a jackknife."""
    height_m, time_s = recording.elevation_m, recording.time_s
    if height_m is None or recording.is_one_number or float(np.median(np.diff(time_s))) > COARSEST_S:
        return None
    known = ~np.isnan(height_m)
    if np.count_nonzero(known) < LEAST_WINDOWS:
        return None
    at_s = np.arange(time_s[0], time_s[-1], WINDOW_S)
    if at_s.size <= LEAST_WINDOWS:
        return None
    step_s = np.diff(time_s)
    drawn_j, way_m, air = (
        np.interp(at_s, time_s, np.concatenate(([0.0], np.cumsum(0.5 * (each[1:] + each[:-1]) * step_s))))
        for each in (recording.power_w, recording.speed_mps, recording.speed_mps**3)
    )
    kinetic = 0.5 * np.interp(at_s, time_s, recording.speed_mps) ** 2
    climb_m = np.diff(np.interp(at_s, time_s[known], height_m[known]))
    good = ~recording.gap_steps(at_s)
    if np.count_nonzero(good) < LEAST_WINDOWS or float(np.abs(climb_m[good]).sum()) < LEAST_CLIMB_M:
        return None
    columns = np.column_stack(
        [np.diff(kinetic), GRAVITY_MPS2 * climb_m, np.diff(way_m), np.diff(air), np.full(climb_m.size, WINDOW_S)]
    )[good]
    energies = np.diff(drawn_j)[good]
    value = _ratio(columns, energies)
    block = np.arange(energies.size) * BLOCKS // energies.size
    without = [_ratio(columns[block != k], energies[block != k]) for k in range(BLOCKS)]
    if value is None or any(ratio is None for ratio in without):
        return None
    spread = np.array(without, np.float64)
    sd = float(np.sqrt((BLOCKS - 1) / BLOCKS * ((spread - spread.mean()) ** 2).sum()))
    return HillRatio(value, max(sd, 0.02))


def _ratio(columns: NDArray[np.float64], energies: NDArray[np.float64]) -> float | None:
    """Mass by the hills over mass by gains of speed; None where no gain of speed tells a mass."""
    scale = np.sqrt((columns**2).sum(axis=0))
    if not bool(scale.all()):
        return None
    beta = np.linalg.lstsq(columns / scale, energies, rcond=None)[0] / scale
    return float(beta[1] / beta[0]) if beta[0] > 0.0 else None


def _from_feet(recording: Recording, ratio: HillRatio) -> Recording:
    """A recording with its heights converted, or without them where they may be in another unit than feet."""
    assert recording.elevation_m is not None, "only known heights are doubted"
    sure = abs(ratio.value / M_PER_FOOT - 1.0) <= NEAR_FRAC and ratio.sd <= SURE_SD
    text = (
        f"{'is' if sure else 'may be'} in feet: hills take {ratio.value:.2f} of what so many metres would, by the mass"
        f" that gains of speed tell; {'converted' if sure else 'left out'}"
    )
    height_m = M_PER_FOOT * recording.elevation_m if sure else None
    return replace(recording, elevation_m=height_m, notes=(*recording.notes, Note(NoteKind.UNIT, "elevation_m", text)))
