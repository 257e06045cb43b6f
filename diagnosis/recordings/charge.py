"""Drives of which only the charge was recorded: one energy each, from the fall of the charge and the capacity."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.notes import Note, NoteKind
from energy.units import JOULE_PER_KWH, JOULE_PER_WH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.recordings.recording import Recording

LEAST_STEPS: Final = 5.0  # of the charge's resolution, that a drive must take to tell anything


def with_power_of_charge(recordings: Sequence[Recording], capacity_wh: float) -> list[Recording]:
    """The recordings, those of charge alone with the mean power that its fall and a usable capacity tell.

    Only the energy of the whole drive is known of these; in between, their power means nothing. A charge as it is
    displayed counts before any other, since the usable capacity is what it counts. A drive whose charge
    falls by fewer than LEAST_STEPS of its resolution keeps a power of 0.
    """
    return [
        _with_power(recording, capacity_wh) if recording.is_one_number and not recording.power_w.any() else recording
        for recording in recordings
    ]


def _with_power(recording: Recording, capacity_wh: float) -> Recording:
    shown = recording.soc_frac if recording.displayed_frac is None else recording.displayed_frac
    if shown is None:
        return recording
    known = np.flatnonzero(~np.isnan(shown))
    if known.size < 2:
        return recording
    charge = shown[known]
    fall, steps = float(charge[0] - charge[-1]), np.abs(np.diff(charge))
    resolution = float(steps[steps > 0.0].min(initial=1.0))
    if fall < LEAST_STEPS * resolution:
        text = f"charge falls by {fall:.2%}, in steps of {resolution:.2%}: too little to tell an energy"
        return replace(recording, notes=(*recording.notes, Note(NoteKind.SUSPECT, "soc_frac", text)))
    energy_j = fall * capacity_wh * JOULE_PER_WH
    lasts_s = float(recording.time_s[-1] - recording.time_s[0])
    text = (
        f"no power was recorded: {energy_j / JOULE_PER_KWH:.2f} kWh in all, by a charge that falls by {fall:.1%} of"
        f" {capacity_wh / 1000.0:g} kWh"
    )
    power_w = np.full(recording.time_s.size, energy_j / lasts_s)
    return replace(recording, power_w=power_w, notes=(*recording.notes, Note(NoteKind.READ, "power_w", text)))
