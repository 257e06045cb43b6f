"""The simpler rules and the oracle on a small world whose cabin is heated, against the tool's own pieces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from proof.oracle import oracle, true_terms
from proof.plans import places
from proof.prepared import prepared, without_noise
from proof.rules import _descended, forward_bic, lasso, ordinary, simpler_rules
from proof.sealed import WORLDS, make_into
from proof.tool import held_out_of, read
from proof.trip_sums import RIDGE_NAME, SUMS_NAME
from proof.worlds.orders import WantedEffect, WorldOrder
from proof.worlds.trips import WorldRegime
from proof.worlds.world import WorldKind

if TYPE_CHECKING:
    from diagnosis.recordings.reading import Recording
    from energy.vehicle.vehicle import Vehicle

    World = tuple[list[Recording], Vehicle, frozenset[str]]

COLD = WorldRegime(minutes=(10.0, 14.0), air_c=(-12.0, 22.0))


@pytest.fixture(scope="module")
def heated(tmp_path_factory: pytest.TempPathFactory) -> World:
    folder = tmp_path_factory.mktemp("heated")
    order = WorldOrder(WorldKind.SINGLE, (WantedEffect("cabin_heating", 0.12),), (24, 24), COLD)
    world_id = make_into(places((order,), 3)[0], folder)
    assert world_id is not None
    return read(folder / WORLDS / world_id)


def measured_kwh(world: World) -> np.ndarray:
    recordings, _, held_out = world
    return np.array([recording.energy_j() / 3.6e6 for recording in recordings if recording.id in held_out])


def test_a_third_of_the_trips_is_held_out_and_the_worlds_name_draws_them(heated: World) -> None:
    recordings, _, held_out = heated
    assert len(held_out) == 7
    assert held_out_of(recordings, 1) != held_out_of(recordings, 2)


def test_the_oracle_predicts_held_out_trips_far_better_than_no_effect(heated: World) -> None:
    recordings, vehicle, held_out = heated
    informed = oracle(recordings, vehicle, held_out, true_terms(["cabin_heating"]))
    blind = oracle(recordings, vehicle, held_out, ())
    right, wrong = (np.abs(np.array(rule.held_out_kwh) - measured_kwh(heated)).mean() for rule in (informed, blind))
    assert informed.families == ("thermal",)
    assert right < 0.5 * wrong


def test_there_is_no_oracle_without_an_effect_or_for_one_that_no_term_stands_for() -> None:
    assert true_terms([]) == ()
    assert true_terms(["cabin_heating", "roof_box"]) == ()
    assert {term.effect for term in true_terms(["wet_road", "regen_cap"])} == {"wet_road", "recuperation_cap"}


def test_every_simpler_rule_claims_the_heating_and_predicts_all_held_out_trips(heated: World) -> None:
    rules = simpler_rules(*heated)
    assert len({rule.name for rule in rules}) == 5
    for rule in rules:
        assert "thermal" in rule.families or rule.name in (RIDGE_NAME, SUMS_NAME)  # which know no families
        assert np.array(rule.held_out_kwh) == pytest.approx(measured_kwh(heated), rel=0.25)


def test_rules_take_nothing_where_nothing_is_left(heated: World) -> None:
    """The equations of residuals that are exactly zero."""
    recordings, vehicle, held_out = heated
    ready = prepared(recordings, vehicle, held_out)
    for system in (ready.system, plain := without_noise(ready)):
        system.vector[:] = 0.0
        system.square[:] = 1.0
    assert ordinary(ready, plain) == ()
    assert forward_bic(ready) == ()
    assert lasso(ready) == ()


def test_coordinate_descent_shrinks_by_the_penalty_and_keeps_signs() -> None:
    """Orthogonal columns: β = max(v − λ, 0) / G, and below zero only where that is allowed."""
    gram = np.diag([1.0, 2.0, 1.0, 1.0])
    vector = np.array([3.0, 3.0, 0.5, -3.0])
    for signed, last in ((False, 0.0), (True, -2.0)):
        found = _descended(gram, vector, 1.0, np.array([False, False, False, signed]), np.zeros(4))
        assert found == pytest.approx([2.0, 1.0, 0.0, last])


def test_coordinate_descent_meets_the_conditions_of_the_minimum() -> None:
    """|gradient| ≤ penalty where β is 0, gradient = penalty where it is above."""
    rng = np.random.default_rng(1)
    columns = rng.normal(size=(50, 6))
    gram, vector = columns.T @ columns, columns.T @ (columns @ [2.0, 0.0, 1.0, 0.0, 0.0, -1.0] + rng.normal(size=50))
    beta = _descended(gram, vector, 5.0, np.zeros(6, np.bool_), np.zeros(6))
    gradient = vector - gram @ beta
    assert np.all(gradient <= 5.0 + 1e-3)
    assert gradient[beta > 0.0] == pytest.approx(5.0, abs=1e-3)
    assert 0 < np.count_nonzero(beta) < 6
