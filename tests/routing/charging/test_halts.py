"""Bounds on journeys that halt where nothing is charged, against the shortest of all chains of ways."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest

from routing.charging.halts import Course, halt_bounds
from routing.places import LinkPosition

SITES = [(LinkPosition(k, 0.0),) for k in range(5)]
START, VIA, GOAL = ((LinkPosition(k, 0.0),) for k in (5, 6, 7))


class Drawn:
    """Ways between eight places that cost at least what the straight line does, not all of them there."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        at, height = rng.uniform(0.0, 10.0, (8, 2)), rng.uniform(0.0, 3.0, 8)
        self.line = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1)) + height[None] - height[:, None]
        self.ways = self.line + rng.uniform(0.0, 8.0, (8, 8))
        self.ways[rng.random((8, 8)) < 0.3] = math.inf
        np.fill_diagonal(self.ways, 0.0)

    def least(self, here: tuple[LinkPosition, ...], there: Sequence[tuple[LinkPosition, ...]]) -> np.ndarray:
        return self.ways[here[0].link_idx, [place[0].link_idx for place in there]]

    def straight(self, here: tuple[LinkPosition, ...], there: Sequence[tuple[LinkPosition, ...]]) -> np.ndarray:
        return self.line[here[0].link_idx, [place[0].link_idx for place in there]]

    def chained(self) -> np.ndarray:
        """Least costs over any stations, by relaxing each in turn."""
        cost = self.ways.copy()
        for k in range(5):
            cost = np.minimum(cost, cost[:, [k]] + cost[[k]])
        return cost


@pytest.mark.parametrize("seed", range(30))
def test_bounds_are_below_all_chains_of_ways_and_equal_to_those_that_cost_no_more_than_asked(seed: int) -> None:
    drawn = Drawn(seed)
    chained = drawn.chained()
    stay, start, goal = 2.0, -1.0, 1.5
    whole = start + chained[5, 6] + stay + chained[6, 7] + goal
    asked = whole + 3.0 if math.isfinite(whole) else 40.0
    course = Course([START, VIA, GOAL], start, goal, [stay])
    bounds = halt_bounds(course, SITES, drawn.least, drawn.straight, asked, lambda: False)
    assert bounds is not None
    assert bounds.least_cost <= whole + 1e-9
    if math.isfinite(whole):
        assert bounds.least_cost == pytest.approx(whole)
    for stage, site in itertools.product((0, 1), range(5)):
        onward = chained[site, 6] + stay + chained[6, 7] if stage == 0 else chained[site, 7]
        before = chained[5, site] if stage == 0 else chained[5, 6] + stay + chained[6, site]
        assert bounds.ahead[stage, site] <= onward + goal + 1e-9
        through = start + before + onward + goal
        assert bounds.through[stage, site] <= through + 1e-9
        if through <= asked:
            assert bounds.through[stage, site] == pytest.approx(through)


def test_without_time_there_are_no_bounds() -> None:
    drawn = Drawn(0)
    assert (
        halt_bounds(Course([START, GOAL], 0.0, 0.0, []), SITES, drawn.least, drawn.straight, 1e9, lambda: True) is None
    )


def test_without_stations_a_journey_costs_its_ways() -> None:
    drawn = Drawn(1)
    drawn.ways[5, 7] = 12.5
    bounds = halt_bounds(Course([START, GOAL], -1.0, 0.5, []), [], drawn.least, drawn.straight, 1e9, lambda: False)
    assert bounds is not None
    assert bounds.least_cost == 12.0
    assert bounds.ahead.shape == (1, 0)
