"""What the recorded columns of heater and air conditioning say of the cabin's climate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

CLIMATE_EFFECTS: Final = ("cabin_heating", "air_conditioning")
HEATER_ALONE_BELOW_K: Final = 285.15  # nobody cools a cabin in the cold, so that the heater's column is all of it
COOLER_ALONE_FROM_K: Final = 297.15
LEAST_KNOWN_FRAC: Final = 0.95  # of the samples


def climate_w(recording: Recording) -> NDArray[np.float64] | None:
    """Electric power of the cabin's climate as it was recorded, float64 (n,) [W]; None where that is not all of it."""
    heater, cooler = recording.heater_w, recording.aircon_w
    outside_k = np.nan
    if recording.ambient_k is not None and not bool(np.isnan(recording.ambient_k).all()):
        outside_k = float(np.nanmedian(recording.ambient_k))
    if recording.hvac_w is not None:
        whole = recording.hvac_w
    elif heater is not None and cooler is not None:
        whole = heater + cooler
    elif heater is not None and outside_k < HEATER_ALONE_BELOW_K:
        whole = heater
    elif cooler is not None and outside_k > COOLER_ALONE_FROM_K:
        whole = cooler
    else:
        return None
    known = ~np.isnan(whole)
    if recording.is_one_number or known.mean() < LEAST_KNOWN_FRAC:
        return None
    return np.interp(recording.time_s, recording.time_s[known], whole[known])
