"""The station graph of one query: places, what is known of the ways between them, and searches on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.charging import kernels_plan as kernels
from routing.charging.kernels_plan import Labels, Rules, Stops, Ways
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from energy.charging.kernels_charging import ChargeCurves
    from routing.charging.ways import Way

LEAST_LABELS: Final = 16_384
LEAST_WAYS: Final = 4096


@dataclass(frozen=True, slots=True)
class Arc:
    """A way of the station graph to a place, of one part or more between via points; its cost and margin [J].

    way: all parts together, with what is charged at fixed stays. margin_j: the least that is kept beyond what it takes
    by the mean.
    """

    to: int
    way: Way
    cost: float
    margin_j: float
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Part:
    """A way between two places that the journey may not pass between: start, stations, via points, goal.

    here, there: as Task numbers them. cap: number of the speed cap that it keeps, 0 for none. margin_j: what is kept
    beyond its energy [J].
    """

    here: int
    there: int
    way: Way
    cap: int = 0
    margin_j: float = 0.0


@dataclass(frozen=True, slots=True)
class Step:
    """A place of the best journey: cost and time on arrival, charge there, charge at departure before, and how."""

    place: int
    cost: float
    time_s: float
    charge_j: float
    depart_j: float
    arc: Arc | None


@dataclass(slots=True)
class Work:
    """Labels of searches on the station graph."""

    made: int = 0
    settled: int = 0


class UndecidedError(Exception):
    """A search on the station graph was to ask for more arcs when it was over."""


class StationGraph:
    """Places and arcs, which are asked for as searches come to a place.

    stops: of kernels_plan, its known all false. arcs_of: all arcs from a place, bounds among them. margin_j: of an arc,
    its own where None.
    """

    def __init__(
        self,
        curves: ChargeCurves,
        stops: Stops,
        arcs_of: Callable[[int], Sequence[Arc]],
        margin_j: Callable[[Arc], float] | None = None,
    ) -> None:
        self._curves, self._stops, self._arcs_of = curves, stops, arcs_of
        self._margin_j = margin_j
        self._arcs: list[Arc] = []
        self._number = np.zeros((LEAST_WAYS, 7))
        self._to = np.zeros(LEAST_WAYS, np.int32)
        self._least_j = np.zeros(LEAST_WAYS)
        self.work = Work()
        self.reached: dict[int, float] = {}  # most charge on arrival by place, of the last search that found nothing

    def arcs(self, place: int) -> Sequence[Arc]:
        """The arcs of a place that a search came to."""
        return self._arcs[int(self._stops.first[place]) : int(self._stops.last[place])]

    def forget(self, place: int) -> None:
        """Ask for the arcs of a place anew."""
        self._stops.known[place] = False

    def weigh(self, factor: float, places: Iterable[int]) -> None:
        """Ask anew for margins of arcs from some places; those of all others are a factor times their own."""
        count = len(self._arcs)
        self._number[:count, kernels.WAY_MARGIN] = factor * self._least_j[:count]
        if self._margin_j is not None:
            for place in places:
                for k in range(int(self._stops.first[place]), int(self._stops.last[place])):
                    self._number[k, kernels.WAY_MARGIN] = self._margin_j(self._arcs[k])

    def best(
        self,
        start: int,
        charge_j: float,
        goal: int,
        rules: Rules,
        bound: float = math.inf,
        *,
        is_over: Callable[[], bool] | None = None,
        known_only: bool = False,
    ) -> list[Step] | None:
        """The journey of least cost, None where none costs less than a bound; raises TimeUpError, AbandonedError.

        is_over: asked before arcs are asked for, where it is UndecidedError is raised instead.
        known_only: along arcs that were asked for before.
        """
        passed: list[int] = []
        labels = _labels(LEAST_LABELS, self._stops.known.size)
        labels.number[0] = 0.0
        labels.number[0, kernels.CHARGE] = charge_j
        labels.number[0, kernels.LEVEL] = math.inf
        labels.pointer[0] = (start, -1, -1, -1, 0)
        labels.latest[start] = 0
        labels.heap_key[0], labels.heap_label[0] = 0.0, 0
        labels.counter[kernels.MADE] = labels.counter[kernels.HEAP] = 1
        while True:
            ways = Ways(self._number, self._to)
            status = kernels.settle(self._curves, self._stops, ways, rules, labels, bound, goal)
            if status == kernels.UNKNOWN and known_only:
                place = int(labels.counter[kernels.ASKED])
                self._stops.first[place] = self._stops.last[place] = 0
                self._stops.known[place] = True
                passed.append(place)
            elif status == kernels.UNKNOWN:
                if is_over is not None and is_over():
                    raise UndecidedError
                self._add(int(labels.counter[kernels.ASKED]))
            elif status == kernels.FULL:
                labels = _grown(labels)
            elif status == kernels.PAUSED:
                time_budget().check()
            else:
                break
        self._stops.known[passed] = False
        self.work.made += int(labels.counter[kernels.MADE])
        self.work.settled += int(labels.counter[kernels.SETTLED])
        if status == kernels.NONE:
            self.reached = _reached(labels)
            return None
        return self._steps(labels)

    def _add(self, place: int) -> None:
        arcs = self._arcs_of(place)
        first = len(self._arcs)
        last = first + len(arcs)
        while last > self._to.size:
            self._number = np.concatenate((self._number, np.zeros_like(self._number)))
            self._to = np.concatenate((self._to, np.zeros_like(self._to)))
            self._least_j = np.concatenate((self._least_j, np.zeros_like(self._least_j)))
        if arcs:
            self._number[first:last] = [
                (
                    arc.cost,
                    arc.way.time_s,
                    arc.way.energy_j,
                    arc.way.need_j,
                    arc.way.spill_j,
                    arc.margin_j if self._margin_j is None else self._margin_j(arc),
                    1.0 if arc.way.is_bound else 0.0,
                )
                for arc in arcs
            ]
            self._to[first:last] = [arc.to for arc in arcs]
            self._least_j[first:last] = [arc.margin_j for arc in arcs]
        self._arcs += arcs
        self._stops.first[place], self._stops.last[place] = first, last
        self._stops.known[place] = True

    def _steps(self, labels: Labels) -> list[Step]:
        steps = []
        label = int(labels.counter[kernels.GOAL])
        while label >= 0:
            number, pointer = labels.number[label], labels.pointer[label]
            way = int(pointer[kernels.WAY])
            steps.append(
                Step(
                    int(pointer[kernels.PLACE]),
                    float(number[kernels.COST]),
                    float(number[kernels.TIME]),
                    float(number[kernels.CHARGE]),
                    float(number[kernels.DEPART]),
                    None if way < 0 else self._arcs[way],
                )
            )
            label = int(pointer[kernels.PARENT])
        return steps[::-1]


def _reached(labels: Labels) -> dict[int, float]:
    made = int(labels.counter[kernels.MADE])
    places, charges = labels.pointer[:made, kernels.PLACE].tolist(), labels.number[:made, kernels.CHARGE].tolist()
    most: dict[int, float] = {}
    for place, charge in zip(places, charges, strict=True):
        most[place] = max(charge, most.get(place, 0.0))
    return most


def _labels(room: int, places: int) -> Labels:
    return Labels(
        number=np.empty((room, 6)),
        pointer=np.empty((room, 5), np.int32),
        latest=np.full(places, -1, np.int32),
        heap_key=np.empty(room),
        heap_label=np.empty(room, np.int32),
        counter=np.zeros(5, np.int64),
    )


def _grown(labels: Labels) -> Labels:
    """The same labels with twice the room."""
    room = labels.heap_key.size
    more = _labels(2 * room, labels.latest.size)
    more.number[:room], more.pointer[:room] = labels.number, labels.pointer
    more.heap_key[:room], more.heap_label[:room] = labels.heap_key, labels.heap_label
    return more._replace(latest=labels.latest, counter=labels.counter)
