"""All ways between two places that differ in what they do to a battery."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.charging import kernels_ways as kernels
from routing.pareto import kernels_states
from routing.pareto.all_ways import is_applicable, least_to_goal, links_within, places_array, states_between
from routing.places import LinkPosition
from routing.search.found import FoundPath
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from routing.search.space import SearchSpace

STATES_A_LINK: Final = 4096  # which no link of a map that is small enough to be compared has
MOST_LABELS: Final = 400_000


def all_ways_are_comparable(space: SearchSpace) -> bool:
    """Whether a link takes the same from a state whenever it is driven, but for climate of constant power."""
    steady = space.physics.cabin_start_w == 0.0
    return steady and space.conserving and is_applicable(space.physics, carries=space.arrays.carries)


def all_ways(
    space: SearchSpace,
    starts: Sequence[LinkPosition],
    goals: Sequence[LinkPosition],
    most_s: float,
    most_j: float,
    most_stretch_j: float,
    most_labels: int = MOST_LABELS,
) -> list[FoundPath] | None:
    """Ways from rest to rest, none as good as another in all that Way tells of it; None where that takes too much room.

    Without those that take more than most_s or most_j, or of which a stretch takes more than most_stretch_j, and
    without the battery's limits. Raises TimeUpError, AbandonedError.
    """
    ends = kernels_states.Ends(places_array(starts), places_array(goals))
    sg = states_between(space, ends, links_within(space.arrays, ends, most_s), STATES_A_LINK)
    if sg is None or sg.counter[kernels_states.SHARED] > 0:
        return None
    least_s, least_j = least_to_goal(sg, sg.time_s), least_to_goal(sg, sg.energy_j)
    labels = kernels.WayLabels(
        number=np.empty((most_labels, kernels.CRITERIA)),
        pointer=np.empty((most_labels, 4), np.int32),
        latest=np.full(sg.link.size, -1, np.int32),
        heap_key=np.empty(most_labels),
        heap_label=np.empty(most_labels, np.int32),
        counter=np.zeros(3, np.int64),
    )
    status = kernels.PAUSED
    while status == kernels.PAUSED:
        time_budget().check()
        status = kernels.explore_ways(
            sg, least_s, least_j, len(starts), space.physics.cabin_w, most_s, most_j, most_stretch_j, labels
        )
    if status == kernels.FULL:
        return None
    paths = []
    label = int(labels.latest[kernels_states.GOAL])
    while label >= 0:
        time_s, energy_j = (float(x) for x in labels.number[label, :2])
        links: list[int] = []
        first = before = int(labels.pointer[label, kernels.PARENT])
        while before >= 0:
            links.append(int(sg.link[labels.pointer[before, kernels.STATE]]))
            first, before = before, int(labels.pointer[before, kernels.PARENT])
        links.reverse()
        start = starts[int(labels.pointer[first, kernels.STATE]) - 1]
        goal_m = next(place.offset_m for place in goals if place.link_idx == links[-1])
        driven = space.originals(links)
        ends_at = LinkPosition(driven[-1], goal_m)
        starts_at = LinkPosition(driven[0], start.offset_m)
        paths.append(FoundPath(driven, starts_at, ends_at, time_s, energy_j, time_s, math.nan))
        label = int(labels.pointer[label, kernels.NEXT])
    return paths
