"""The sign of recorded power, told from the drive itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from diagnosis.recordings.recording import Recording

PUSH_W_PER_KG: Final = 5.0  # v·a from which a car certainly accelerates, and below the negative of which it brakes
PUSH_SAMPLES: Final = 30


def push_powers_w(recording: Recording) -> tuple[float, float] | None:
    """Mean power while the car clearly gains speed, and while it loses it [W]; None for too few samples of either."""
    push = recording.speed_mps * np.gradient(recording.speed_mps, recording.time_s)
    gains, loses = push > PUSH_W_PER_KG, push < -PUSH_W_PER_KG
    if min(np.count_nonzero(gains), np.count_nonzero(loses)) < PUSH_SAMPLES:
        return None
    return float(recording.power_w[gains].mean()), float(recording.power_w[loses].mean())


def power_sign(recording: Recording) -> int:
    """1 where power is higher while gaining speed than while losing it, −1 where it is lower, 0 if it is not told."""
    powers = push_powers_w(recording)
    if powers is None or powers[0] == powers[1]:
        return 0
    return 1 if powers[0] > powers[1] else -1
