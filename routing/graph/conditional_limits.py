"""Speed limits of links that hold under a condition: on a wet road, at hours of the week."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

DAY_MIN: Final = 1440
EVERY_DAY: Final = 0b1111111
FASTEST_MPS: Final = 100.0  # bound of a stored limit, far above any


@dataclass(frozen=True, slots=True)
class ConditionalLimits:
    """One row a limit and span of hours; of those of a link that hold the last counts.

    link: int64 (C,) index of the link; limit_mps: float64 (C,) > 0; wet: bool (C,) on a wet road only.
    days: int64 (C,) bits of weekdays on which the hours begin, Monday the lowest. begin_min, end_min: int64 (C,)
    minutes of that day, 0..1440 and 0..2880, the end not included; all days from 0 to 1440 is always.
    """

    link: NDArray[np.int64]
    limit_mps: NDArray[np.float64]
    wet: NDArray[np.bool_]
    days: NDArray[np.int64]
    begin_min: NDArray[np.int64]
    end_min: NDArray[np.int64]

    def hold(self, minute: int | None) -> NDArray[np.bool_]:
        """Whether a row holds at a minute of the week, 0..10079 from Monday 00:00, or at all times, bool (C,)."""
        if minute is None:
            return np.asarray((self.days == EVERY_DAY) & (self.begin_min == 0) & (self.end_min >= DAY_MIN), np.bool_)
        day, of_day = divmod(minute, DAY_MIN)
        today, yesterday = self.days >> day & 1 == 1, self.days >> (day - 1) % 7 & 1 == 1
        begun = today & (self.begin_min <= of_day) & (of_day < self.end_min)
        return np.asarray(begun | (yesterday & (of_day + DAY_MIN < self.end_min)), np.bool_)

    def over(self, plain_mps: NDArray[np.float64], *, wet: bool, minute: int | None = None) -> NDArray[np.float64]:
        """Limits of all links on a wet or dry road at a minute of the week or an unknown time, float64 (M,) [m/s].

        plain_mps: those without a condition, float64 (M,); given back where none holds.
        """
        held = self.hold(minute) & (wet | ~self.wet)
        if not held.any():
            return plain_mps
        limit_mps = np.array(plain_mps)
        limit_mps[self.link[held]] = self.limit_mps[held]  # of several rows of a link the last stays
        limit_mps.flags.writeable = False
        return limit_mps

    def of_links(self, kept: NDArray[np.int64], rank: NDArray[np.int64]) -> ConditionalLimits:
        """The rows of some links under new numbers; kept: int64 (K,) their links, rank: int64 (K,) the new numbers."""
        new = np.full(int(max(self.link.max(initial=-1), kept.max(initial=-1))) + 1, -1, np.int64)
        new[kept] = rank
        chosen = new[self.link] >= 0
        rest = {f.name: getattr(self, f.name)[chosen] for f in fields(self)}
        return ConditionalLimits(**{**rest, "link": new[self.link[chosen]]})

    def with_links(self, of: NDArray[np.int64], rank: NDArray[np.int64]) -> ConditionalLimits:
        """These limits, and those of links again for copies of them; of, rank: int64 (C,) the links and the copies."""
        rows = [np.flatnonzero(self.link == link) for link in of.tolist()]
        row = np.concatenate((np.arange(self.link.size), *rows)).astype(np.int64)
        link = np.concatenate((self.link, np.repeat(rank, [k.size for k in rows])))
        return ConditionalLimits(**{**{f.name: getattr(self, f.name)[row] for f in fields(self)}, "link": link})

    def columns(self) -> dict[str, list[Any]]:
        """The columns as JSON takes them."""
        return {f.name: getattr(self, f.name).tolist() for f in fields(self)}


def conditional_limits_from(columns: Mapping[str, Sequence[Any]], link_count: int) -> ConditionalLimits:
    """What columns() gave; raises KeyError, TypeError, ValueError or OverflowError where they are damaged."""
    link = np.array(columns["link"], np.int64)
    limits = ConditionalLimits(
        link=link,
        limit_mps=np.array(columns["limit_mps"], np.float64),
        wet=np.array(columns["wet"], np.bool_),
        days=np.array(columns["days"], np.int64),
        begin_min=np.array(columns["begin_min"], np.int64),
        end_min=np.array(columns["end_min"], np.int64),
    )
    if any(getattr(limits, f.name).shape != (link.size,) for f in fields(limits)):
        raise ValueError("columns of different length")
    if link.size and not 0 <= int(link.min()) <= int(link.max()) < link_count:
        raise ValueError("limits of unknown links")
    if not bool(((limits.limit_mps > 0.0) & (limits.limit_mps < FASTEST_MPS)).all()):
        raise ValueError("limits out of range")
    return limits
