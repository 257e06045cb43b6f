"""Google's encoded polylines: lines as text, latitude before longitude, of 5 or 6 decimals.

The format is that of Google's public documentation of the encoded polyline algorithm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

BITS: Final = 5  # of a number in a character
MORE: Final = 32  # is added where the number goes on
FIRST: Final = 63  # the character of nothing
MOST_CHARACTERS: Final = 8  # of a number: of 40 bits
HEIGHT_DECIMALS: Final = 2  # as openrouteservice has them


def encoded(lonlat: NDArray[np.float64], decimals: int, height_m: NDArray[np.float64] | None = None) -> str:
    """A line as text; lonlat: float64 (k, 2) [deg]. height_m: float64 (k,), a third number of HEIGHT_DECIMALS."""
    whole = np.rint(lonlat[:, ::-1] * 10.0**decimals).astype(np.int64)
    if height_m is not None:
        whole = np.column_stack((whole, np.rint(height_m * 10.0**HEIGHT_DECIMALS).astype(np.int64)))
    steps = np.diff(whole, axis=0, prepend=0).ravel()
    values = (steps << 1) ^ (steps >> 63)
    parts = values[:, None] >> np.arange(0, BITS * MOST_CHARACTERS, BITS)
    sent = parts > 0
    sent[:, 0] = True
    characters = (parts & (MORE - 1)) + FIRST
    characters[:, :-1] += np.where(parts[:, 1:] > 0, MORE, 0)
    return characters[sent].astype(np.uint8).tobytes().decode("ascii")


def decoded(text: str, decimals: int) -> NDArray[np.float64]:
    """The line of a text, float64 (k, 2) lon, lat [deg]; raises ValueError for what is no encoded line."""
    characters = np.frombuffer(text.encode("utf-8", "surrogatepass"), np.uint8).astype(np.int64) - FIRST
    if characters.size == 0 or characters.min() < 0 or characters.max() >= 2 * MORE:
        raise ValueError("characters from ? to ~")
    ends = np.flatnonzero(characters < MORE)
    if ends.size == 0 or ends[-1] != characters.size - 1 or ends.size % 2:
        raise ValueError("whole pairs of numbers")
    begins = np.concatenate(([0], ends[:-1] + 1))
    place = np.arange(characters.size) - np.repeat(begins, ends - begins + 1)
    if place.max() >= MOST_CHARACTERS:
        raise ValueError(f"numbers of at most {MOST_CHARACTERS} characters")
    values = np.add.reduceat((characters & (MORE - 1)) << (BITS * place), begins)
    steps = (values >> 1) ^ -(values & 1)
    lonlat: NDArray[np.float64] = np.cumsum(steps.reshape(-1, 2), axis=0)[:, ::-1] / 10.0**decimals
    return lonlat
