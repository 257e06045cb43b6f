"""Speed and power whose unit is doubted, by the mass that gains of speed tell.

Held against the vehicle's file where most drives say the same, and single drives against the other drives.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind
from diagnosis.recordings.soundness.signs import PUSH_SAMPLES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.recordings.recording import Recording

COARSEST_S: Final = 3.0  # samples further apart than that blur gains of speed
LEAST_DRIVES: Final = 3
OTHERS_SPREAD: Final = 1.5  # ratio of the quartiles of the other drives' masses, up to which they are a measure
AMONG: Final = (  # mass told over that of the other drives, which a wrong unit of one drive makes of the same car
    (2.1, 3.0, "speed_mps", "in miles an hour, where the other drives' is in km/h"),  # 1.609 squared is 2.59
    (3.0, 4.2, "speed_mps", "in knots, where the other drives' is in km/h"),  # 1.852 squared is 3.43
    (0.33, 0.476, "speed_mps", "in km/h, where the other drives' is in miles an hour"),
    (10.5, 16.0, "speed_mps", "in m/s, where the other drives' is in km/h"),  # 3.6 squared is 12.96
    (0.0008, 0.0017, "power_w", "in kW or horsepower, where the other drives' is in W"),
    (800.0, 1250.0, "power_w", "in W, where the other drives' is in kW"),
)
LEAST_SHARE: Final = 0.6  # of the drives that tell a mass, that speak for the same unit
UNITS: Final = (  # mass told over that of the file, from and to: of losses and of files that are off
    (2.4, 4.8, "speed_mps", "in miles an hour, declared as km/h"),
    (9.0, 60.0, "speed_mps", "in m/s, declared as km/h"),
    (0.00025, 0.004, "power_w", "in kW, declared as W"),
)


def with_doubted_scales(recordings: Sequence[Recording], mass_kg: float) -> list[Recording]:
    """The recordings with a note on each that tells a mass which a wrong unit explains.

    Most of them do beside the vehicle's file, or a few of them beside the others. Nothing is converted: another vehicle
    may do as well. mass_kg: of the vehicle's file.
    """
    masses = [told_mass_kg(recording) for recording in recordings]
    known = np.array([mass for mass in masses if mass is not None])
    if known.size < LEAST_DRIVES:
        return list(recordings)
    for low, high, channel, unit in UNITS:
        inside = (known >= low * mass_kg) & (known <= high * mass_kg)
        if inside.mean() < LEAST_SHARE:
            continue
        return [
            _doubted(recording, channel, unit, mass, mass_kg)
            if mass is not None and low * mass_kg <= mass <= high * mass_kg
            else recording
            for recording, mass in zip(recordings, masses, strict=True)
        ]
    return [_held_against(recording, masses, k) for k, recording in enumerate(recordings)]


def _held_against(recording: Recording, masses: Sequence[float | None], at: int) -> Recording:
    """A recording with a note where its mass is that of the other drives but for the factor of a unit."""
    own = masses[at]
    others = np.array([mass for k, mass in enumerate(masses) if mass is not None and k != at])
    if own is None or others.size < LEAST_DRIVES:
        return recording
    low, usual, high = np.quantile(others, (0.25, 0.5, 0.75)).tolist()
    if low <= 0.0 or high > OTHERS_SPREAD * low:
        return recording
    for least, most, channel, unit in AMONG:
        if least <= own / usual <= most:
            text = (
                f"may be {unit}: gains of speed take as much as those of {own:.3g} kg, on the others of {usual:.3g};"
                " or it is another car's; nothing was changed"
            )
            return replace(recording, notes=(*recording.notes, Note(NoteKind.UNIT, channel, text)))
    return recording


def told_mass_kg(recording: Recording) -> float | None:
    """Mass that the larger gains of speed tell, in whatever unit speed and power are; None where they are few."""
    step_s = float(np.median(np.diff(recording.time_s)))
    if recording.is_one_number or step_s > COARSEST_S:
        return None
    at_s = np.arange(recording.time_s[0], recording.time_s[-1], max(1.0, step_s))
    if at_s.size < PUSH_SAMPLES:
        return None
    speed, power = (np.interp(at_s, recording.time_s, each) for each in (recording.speed_mps, recording.power_w))
    push = speed * np.gradient(speed, at_s)
    gains = (push > 0.0) & ~np.append(recording.gap_steps(at_s), False)
    if np.count_nonzero(gains) < 2 * PUSH_SAMPLES:
        return None
    gains &= push > float(np.median(push[gains]))
    x, y = push[gains] - push[gains].mean(), power[gains] - power[gains].mean()
    return float(x @ y / (x @ x)) if float(x @ x) > 0.0 else None


def _doubted(recording: Recording, channel: str, unit: str, mass_kg: float, file_kg: float) -> Recording:
    text = (
        f"may be {unit}: gains of speed take as much as those of {mass_kg:.3g} kg, the vehicle has {file_kg:.0f};"
        " nothing was changed"
    )
    return replace(recording, notes=(*recording.notes, Note(NoteKind.UNIT, channel, text)))
