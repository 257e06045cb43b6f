"""The bounds of dominance against drives that really differ: in the entry of a link, or in the time since departure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.chain.chain import Chain, LinkModel, StopRule, simulate_chain
from energy.chain.kernels_link import link_energy
from energy.force.kernels_physics import road_in_time
from energy.stops import StopSettings
from energy.vehicle.coefficients import EffectCoefficients
from routing.dominance.kernels_dominates import warm_up_debt_j
from routing.dominance.kernels_slack import Entry, LinkAhead, state_slack
from routing.places import LinkPosition
from routing.search.found import Limits
from routing.search.search import find_path
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO
from tests.routing.search.test_exact import graph_of, vehicle

STEEP = vehicle(accel=(0.3,) * 5, recuperation_eff=0.85)


def space_of(graph, car):
    return search_space(graph, car, LinkModel.INTEGRATED, StopRule.NONE, StopSettings())


@settings(max_examples=300, deadline=None)
@given(
    entries=st.tuples(st.floats(0.0, 13.0), st.floats(0.0, 13.0)),
    times=st.tuples(st.floats(0.0, 300.0), st.floats(0.0, 300.0)),
    fall_frac=st.floats(0.0, 0.12),
    least_mps=st.sampled_from((0.0, 3.0, 8.0, 12.0)),
    share=st.sampled_from((0.0, 0.5, 2.0)),
    time_s=st.sampled_from((30.0, 600.0)),
    car=st.sampled_from((STEEP, vehicle(), vehicle(accel=(0.5, 1.5, 0.4, 1.0, 0.3)))),
)
def test_drive_costs_at_most_its_bound_more_than_one_in_another_state_at_another_time(
    entries, times, fall_frac, least_mps, share, time_s, car
):
    learned = EffectCoefficients(regen_min_speed_mps=least_mps, tyre_warm_up_frac=share, tyre_time_s=time_s)
    length, limit = 600.0, 13.0
    graph = graph_of([(0, 1, length, limit, 0), (1, 0, length, limit, 0)], [80.0, 80.0 - fall_frac * length])
    space = space_of(graph, replace(car, effects=learned))
    p, g = space.physics, space.arrays
    used = []
    for v, clock in zip(entries, times, strict=True):
        energy = 0.0
        for k, entry in ((0, v), (1, limit), (0, limit), (1, limit)):
            road = road_in_time(p, g.roads, k, clock, length / limit)
            e, t, end = link_energy(p, road, length, entry, 0.0, limit, limit, 0.0, 0.0)
            assert end == limit
            energy, clock = energy + e, clock + t
        used.append(energy)
    k = int(g.top_class[0])
    ahead = LinkAhead(0, length, limit, k)
    entry_a, entry_b = (Entry(speed, 0.0, 0.0) for speed in entries)
    slack_j, _, meets, _ = state_slack(space.slack, space.half_inertia_kg, ahead, entry_a, entry_b)
    assert meets
    debt_j = warm_up_debt_j(space.slack.bounds, k, *times) if share > 0.0 else 0.0
    assert used[0] - used[1] <= slack_j + debt_j + 1e-6


def test_slow_way_that_leaves_the_tyres_warmer_is_not_given_up_for_one_that_leads_when_they_meet():
    # from 1 to 2 a fast way and a slow one; then the same state, 20 km to go, and tyres warmer by the time lost
    links = [(0, 1, 300.0, 15.0, 0), (1, 2, 2000.0, 20.0, 0), (1, 2, 2000.0, 6.0, 0), (2, 3, 500.0, 10.0, 0)]
    links += [(3, 4, 20_000.0, 20.0, 0), (4, 0, 5000.0, 20.0, 0)]
    learned = EffectCoefficients(tyre_warm_up_frac=2.0, tyre_time_s=600.0)
    still = {"stop_rule": StopRule.NONE}

    def taken(car, slow_m, way):
        length = [300.0, slow_m if way == "slow" else 2000.0, 500.0, 20_000.0]
        limit = [15.0, 6.0 if way == "slow" else 20.0, 10.0, 20.0]
        zero = np.zeros(4)
        chain = Chain(np.array(length), zero, np.array(limit), zero, zero, np.zeros(4, np.int8))
        result = simulate_chain(car, chain, **still)
        at_meeting = sum(link.energy_j for link in result.links[:2])
        return at_meeting, result.energy_j

    car = vehicle(aux_power_w=300.0, effects=learned)
    lengths = np.linspace(500.0, 6000.0, 400)
    behind = [(slow, fast) for slow, fast in ((taken(car, m, "slow"), taken(car, m, "fast")) for m in lengths)]
    ahead = [k for k, (slow, fast) in enumerate(behind) if fast[0] + 100.0 < slow[0] and slow[1] + 100.0 < fast[1]]
    assert ahead, "some length leaves the slow way behind at first and ahead at the end"
    slow_m = float(lengths[ahead[len(ahead) // 2]])
    links[2] = (1, 2, slow_m, 6.0, 0)
    graph = graph_of(links, [0.0] * 5)
    space = space_of(graph, car)
    by_limit = {float(limit): k for k, limit in enumerate(space.arrays.speed_limit_mps) if graph.tail[k] == 1}
    start = LinkPosition(int(np.flatnonzero(graph.tail == 0)[0]), 0.0)
    goal = LinkPosition(int(np.flatnonzero(graph.tail == 3)[0]), 20_000.0)
    path, _ = find_path(space, WorkspacePool(graph.link_count), ECO, Limits(), [start], [goal])
    assert path is not None
    assert path.links[1] == by_limit[6.0]
    assert path.energy_j == pytest.approx(taken(car, slow_m, "slow")[1], rel=1e-9)
    assert math.isfinite(path.cost)
