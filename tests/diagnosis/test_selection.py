"""A planted cause is named; clean drives and wrong parameters give no cause; what can't be told apart is said so."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.errors import DiagnosisError
from diagnosis.exposures import Column, Family, TripWindows
from diagnosis.selection import select

N = 150


def column(name, family=Family.THERMAL, positive=True):
    return Column(name, "W", family, lambda drive: drive.duration_s, positive)


BASE = Column("aux_power_w", "W", Family.AUXILIARY, lambda drive: drive.duration_s)
MASS = Column("mass_kg", "kg", Family.MASS, lambda drive: drive.duration_s)
COLUMNS = (
    BASE,
    MASS,
    column("heating"),
    column("warm_up"),
    column("tyres", Family.ROLLING),
    column("drag", Family.AERODYNAMIC),
)
FREE = ("aux_power_w", "mass_kg")


def world(seed, truth, trips=14, noise_w=600.0, trip_noise_w=60.0, alike=False):
    """Trips with random exposures, the truth's coefficients on them, noise in every window and one level a trip."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(trips):
        cold = rng.uniform(0.0, 30.0)
        time = 10.0 * np.arange(N)
        work = rng.normal(0.0, 40.0, N)  # what a kilogram takes
        heat = np.full(N, 10.0 * cold)
        warm = heat * np.exp(-time / 300.0)
        tyre = heat * rng.uniform(0.0, 20.0, N) if not alike else heat * (1.0 + 1e-3 * rng.normal(size=N))
        drag = 10.0 * rng.uniform(0.0, 900.0, N)
        columns = np.column_stack((np.full(N, 10.0), work, heat, warm, tyre, drag))
        beta = np.array([truth.get(c.name, 0.0) for c in COLUMNS])
        residual = columns @ beta + rng.normal(0.0, 10.0 * noise_w, N) + 10.0 * rng.normal(0.0, trip_noise_w)
        simulated = np.full(N, 10.0 * 6000.0)
        found.append(
            TripWindows(
                f"T{k}",
                294.0 - cold,
                tuple(c.name for c in COLUMNS),
                time,
                np.full(N, 10.0),
                np.full(N, 100.0),
                np.zeros(N),
                simulated + residual,
                simulated,
                columns,
            )
        )
    return found


def names(selection):
    return [finding.column.name for finding in selection.findings]


@pytest.mark.parametrize("seed", range(5))
def test_planted_heating_is_named_with_its_size(seed):
    selection = select(world(seed, {"heating": 80.0, "aux_power_w": 300.0}), COLUMNS, FREE)
    assert names(selection) == ["heating"]
    (finding,) = selection.findings
    assert finding.coefficient == pytest.approx(80.0, rel=0.15)
    assert abs(finding.coefficient - 80.0) < 4.0 * finding.sd
    assert finding.t > 4.0
    assert 0.05 < finding.energy_share_frac < 0.4
    assert finding.ambiguous_with == ()


def test_two_planted_effects_are_both_named():
    selection = select(world(3, {"heating": 60.0, "warm_up": 200.0}, trips=24), COLUMNS, FREE)
    assert sorted(names(selection)) == ["heating", "warm_up"]


def test_clean_drives_and_wrong_parameters_give_no_cause():
    claims = 0
    for seed in range(40):
        truth = {"aux_power_w": 400.0, "mass_kg": 30.0} if seed % 2 else {}
        claims += bool(select(world(100 + seed, truth), COLUMNS, FREE).findings)
    assert claims <= 2  # at most one in twenty


@pytest.mark.parametrize("seed", [7, 8, 9, 10])
def test_effects_that_look_alike_are_not_chosen_between(seed):
    selection = select(world(seed, {"heating": 80.0}, alike=True), COLUMNS, FREE)
    (finding,) = selection.findings
    other = {"heating": "tyres", "tyres": "heating"}[finding.column.name]
    assert finding.ambiguous_with == (other,)


def test_an_effect_below_the_least_share_is_not_claimed():
    selection = select(world(9, {"heating": 80.0}), COLUMNS, FREE, least_share_frac=0.9)
    assert selection.findings == ()
    assert set(selection.fit.names) == set(FREE)


def test_few_trips_and_unknown_free_columns_are_refused():
    with pytest.raises(DiagnosisError, match="5 trips, at least 6"):
        select(world(1, {}, trips=5), COLUMNS, FREE)
    with pytest.raises(DiagnosisError, match="free names 'colour'"):
        select(world(1, {}), COLUMNS, ("colour",))
