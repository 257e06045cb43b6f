"""What a diagnosis leaves of each trip, window by window: measured less the model with all findings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from diagnosis.fit.windows import WINDOW_S

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.answer.results import TripTimeline
    from diagnosis.recordings.reading import Recording


@dataclass(frozen=True, slots=True)
class WindowResiduals:
    """One trip in n windows, each array float64 (n,).

    begin_s, end_s: on the recording's clock, rising, windows never overlap [s]. energy_j: measured less modelled [J].
    """

    begin_s: NDArray[np.float64]
    end_s: NDArray[np.float64]
    energy_j: NDArray[np.float64]


def window_residuals(timeline: TripTimeline, recording: Recording) -> WindowResiduals:
    """What the windows of a trip took more than the model with all findings."""
    begin_s, end_s = window_edges_s(timeline)
    start_s = float(recording.time_s[0])
    energy_j = (timeline.measured_w - timeline.after_w) * timeline.duration_s
    return WindowResiduals(start_s + begin_s, start_s + end_s, energy_j)


def window_edges_s(timeline: TripTimeline) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Beginning and end of each window since the recording's first sample, float64 (n,) each, never overlapping [s].

    Windows begin at whole multiples of WINDOW_S; begin_s of a timeline is the mean of where their steps begin.
    """
    begin_s = WINDOW_S * np.floor(timeline.begin_s / WINDOW_S)
    return begin_s, np.minimum(begin_s + timeline.duration_s, np.append(begin_s[1:], np.inf))
