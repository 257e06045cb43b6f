"""The service's own part of the comparison, on a bundled graph."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from benchmarks.graphs import ROOT
from benchmarks.peers.compare import nodes_within
from benchmarks.peers.ours import ours
from benchmarks.peers.pairs import draw_pairs, on_those_roads
from benchmarks.peers.questions import Question
from benchmarks.run import main
from routing.graph.files import load_graph

FOLDER = ROOT / "data/graphs/coquimbo"


@pytest.fixture(scope="module")
def graph():
    return load_graph(FOLDER)


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    scratch = tmp_path_factory.mktemp("peers")
    alone = scratch / "graphs" / FOLDER.name  # so that no other graph is loaded
    alone.parent.mkdir()
    alone.symlink_to(FOLDER)
    with ours(alone, scratch) as engine:
        yield engine


def test_route_tells_its_times_length_energy_and_ends(service, graph) -> None:
    for start, goal in itertools.islice(draw_pairs(graph, np.random.default_rng(1)), 3):
        question = Question(start, goal)
        answer = service.ask(question)
        assert answer.refused is None
        assert on_those_roads(question, answer)
        assert 0.0 < answer.search_s < answer.seconds
        assert answer.distance_m > 20_000.0  # as the crow flies
        assert answer.energy_kwh > 0.0
        assert answer.size_bytes > 1_000


def test_range_with_more_charge_reaches_more_nodes(service, graph) -> None:
    origin, _ = next(draw_pairs(graph, np.random.default_rng(1)))
    small, large = (service.ask(Question(origin, None, charge)) for charge in (0.02, 0.05))
    assert 0.0 < small.search_s < small.seconds
    assert 0 < nodes_within(graph, small.shape) < nodes_within(graph, large.shape)


def test_place_outside_the_map_is_a_refusal_in_words(service) -> None:
    for goal in (None, (1.0, 1.0)):
        assert "outside" in service.ask(Question((0.0, 0.0), goal, 0.05)).refused


def test_run_without_the_map_says_so(tmp_path, capsys) -> None:
    assert main(["--peers", "--maps", str(tmp_path), "--peer-cache", str(tmp_path / "cache")]) == 1
    assert f"no porto.osm.pbf in {tmp_path}" in capsys.readouterr().err
    assert not (tmp_path / "cache").exists()
