"""Stops at the ends of some links are those that all links together have."""

from __future__ import annotations

import numpy as np
import pytest

from energy.chain.chain import StopRule
from energy.stops import FunctionalClass, StopSettings
from routing.graph.road_graph import RoadGraph
from routing.links.spans import ChainMaker
from routing.links.stops import link_stops
from routing.synth import synthesize

pytestmark = pytest.mark.nojit


@pytest.fixture(scope="module")
def graph() -> RoadGraph:
    return synthesize("stops", seed=4, width_km=60.0, height_km=40.0, links_target=3000)


@pytest.mark.parametrize("rule", list(StopRule))
def test_stops_of_some_links_are_those_of_all(graph, rule):
    some = np.array([5, 0, graph.link_count - 1, 5, 77])
    settings = StopSettings()
    for part, whole in zip(link_stops(graph, settings, rule, some), link_stops(graph, settings, rule), strict=True):
        assert part.tolist() == whole[some].tolist()


def test_stops_on_motorways_are_none(graph):
    motorway = np.flatnonzero(graph.functional_class == FunctionalClass.MOTORWAY)
    assert motorway.size > 0
    probability, _ = link_stops(graph, StopSettings(), StopRule.EXPECTED, motorway)
    assert not probability.any()


def test_chain_of_some_links_has_their_climb_altitude_and_heading(graph):
    some = np.arange(3, graph.link_count, 211)
    chain = ChainMaker(graph).of_links(some, graph.length_m[some], StopSettings())
    assert np.array_equal(chain.grade_frac, (graph.climb_m() / graph.length_m)[some])
    assert np.array_equal(chain.altitude_m, graph.altitude_m()[some])
    # the vector units of a processor may round the cosine of a single number otherwise than that of many
    assert np.allclose(chain.heading, graph.heading()[some], rtol=0.0, atol=1e-14)
