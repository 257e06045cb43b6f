"""Arrays that begin where a cache line does."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def aligned(count: int, place: int) -> NDArray[np.float64]:
    """Unset numbers, float64 (count,), of which the one at a place begins a cache line."""
    line = 8  # numbers of 8 bytes
    raw = np.empty(count + 2 * line)
    begin = (-(raw.ctypes.data // 8) - place) % line
    return raw[begin : begin + count]
