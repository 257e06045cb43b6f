"""All sizes one after the other, each measured in processes of its own."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.graphs import Made
from benchmarks.machine import Machine, this_machine
from benchmarks.scale.child import loaded_in_process, opened_in_process, searched_in_process
from benchmarks.scale.opening import VEHICLE, Opened
from benchmarks.scale.regions import kept_region
from benchmarks.scale.searches import Searched
from benchmarks.searches import Spread, spread

if TYPE_CHECKING:
    from collections.abc import Callable

LINKS: Final = (100_000, 300_000, 1_000_000, 5_000_000)
LOAD_TARGET_S: Final = 2.0
GROWTH_TARGET: Final = 1.25  # a route of 25 km, largest over smallest graph
EXPONENT_TARGET: Final = 1.2  # of links, in the time of one to all
MOST_SOURCES: Final = 3  # from each, one to all takes seconds on the largest graph


@dataclass(frozen=True, slots=True)
class ScaleSettings:
    """What was asked for; links: directed, about."""

    links: tuple[int, ...]
    vehicle: str
    seed: int
    pairs: int
    ranges: int
    sources: int
    repeat: int


@dataclass(frozen=True, slots=True)
class SizeFigures:
    """Everything measured on one graph; kept: it was in the cache and made in an earlier run.

    load_s: by the clock; load_processor_s: of the processor.
    """

    made: Made
    kept: bool
    load_s: Spread
    load_processor_s: Spread
    opened: Opened
    searched: Searched

    @property
    def load_met(self) -> bool:
        """Whether loading keeps to its target."""
        return self.load_s.median <= LOAD_TARGET_S


@dataclass(frozen=True, slots=True)
class ScaleReport:
    """One run over graphs in the order of their size; load_after: of the machine, over the last minute."""

    machine: Machine
    load_after: float
    settings: ScaleSettings
    sizes: tuple[SizeFigures, ...]

    @property
    def route_growth(self) -> float:
        """Median time of a whole route of 25 km, largest over smallest graph."""
        first, last = self.sizes[0], self.sizes[-1]
        return last.searched.routes.whole_s.median / first.searched.routes.whole_s.median

    @property
    def exponent(self) -> float:
        """Power of the number of links with which one to all grows, by least squares; 1 where there is one size."""
        if len(self.sizes) < 2:
            return 1.0
        links = np.log([size.made.links for size in self.sizes])
        seconds = np.log([size.searched.to_all.again_s.median for size in self.sizes])
        return float(np.polyfit(links, seconds, 1)[0])


def measure_scale(settings: ScaleSettings, cache: Path, progress: Callable[[str], None]) -> ScaleReport:
    """Make what is missing and measure every size; progress is called with each step.

    Raises CalledProcessError where a process fails.
    """
    machine = this_machine()
    sizes = tuple(_measured(settings, links, cache, progress) for links in sorted(settings.links))
    return ScaleReport(machine, os.getloadavg()[0], settings, sizes)


def _measured(settings: ScaleSettings, links: int, cache: Path, progress: Callable[[str], None]) -> SizeFigures:
    progress(f"make {links}")
    made, folder, kept = kept_region(cache, links, settings.seed)
    progress(f"load {links}")
    loads = np.array([loaded_in_process(folder) for _ in range(settings.repeat)])
    progress(f"open {links}")
    opened = opened_in_process(folder, settings.seed)
    progress(f"search {links}")
    asked = (settings.pairs, settings.ranges, settings.sources, settings.repeat, settings.seed)
    searched = searched_in_process(folder, *asked)
    return SizeFigures(made, kept, spread(loads[:, 0]), spread(loads[:, 1]), opened, searched)


def scale_settings(
    links: tuple[int, ...], seed: int, pairs: int, ranges: int, sources: int, repeat: int
) -> ScaleSettings:
    """Settings with the vehicle of all measurements, and with few sources."""
    return ScaleSettings(links, VEHICLE, seed, pairs, ranges, min(sources, MOST_SOURCES), repeat)
