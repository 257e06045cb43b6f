"""Copies of links, from which less may follow than from the links themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class LinkCopies:
    """The last links of a graph are copies: they lie on others, and differ from these in what may follow.

    of: int64 (C,) the links that they are copies of. No place is on a copy alone, and no answer names one.
    """

    of: NDArray[np.int64]

    def columns(self) -> dict[str, list[Any]]:
        """The columns as JSON takes them."""
        return {"of": self.of.tolist()}


def link_copies_from(
    columns: Mapping[str, Sequence[Any]], tail: NDArray[np.int32], head: NDArray[np.int32]
) -> LinkCopies:
    """What columns() gave; tail, head: int32 (M,) of all links.

    Raises KeyError, TypeError, ValueError or OverflowError where they are damaged.
    """
    of = np.array(columns["of"], np.int64)
    whole = tail.size - of.size
    if of.ndim != 1 or of.size == 0 or not 0 <= int(of.min()) <= int(of.max()) < whole:
        raise ValueError("copies of unknown links, or none")
    if not (np.array_equal(tail[whole:], tail[of]) and np.array_equal(head[whole:], head[of])):
        raise ValueError("copies that lie elsewhere")
    return LinkCopies(of)
