"""Terms are accepted that stand out between trips; what others do as well is told; nothing is taken twice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.causes.driven import driven
from diagnosis.causes.library import candidates
from diagnosis.fit.fitting import fit
from diagnosis.fit.jackknife import equations, solve
from diagnosis.fit.model import priors
from diagnosis.fit.noise import estimated
from diagnosis.fit.selection import LEAST_Z, scatter_of, select, still_standing, threshold
from diagnosis.fit.windows import FREE, trip_of, windows_of
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive, heater

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")


@pytest.fixture(scope="module")
def heated(car):
    recordings = [drive(car, number, heater) for number in range(14)]
    trips = [trip_of(recording, driven(recording, car)) for recording in recordings]
    tried = candidates([trip.drive for trip in trips])
    windows = [windows_of(trip, tried) for trip in trips]
    prior = priors(windows[0].names, car, car)
    roots = [
        estimated(windows, [trip.residual_j() / trip.duration_s for trip in windows], 10.0).root(trip)
        for trip in windows
    ]
    return trips, windows, tried, equations(windows, roots, prior)


def test_a_planted_heater_is_selected_once_for_each_of_its_terms(heated):
    _, windows, tried, system = heated
    limit = threshold(system, FREE, tried, 1, np.ones(len(windows)))
    found = select(system, FREE, tried, windows, limit.z).found
    assert {candidate.term.effect for candidate in found} == {"cabin_heating"}
    names = [candidate.term.name for candidate in found]
    assert len(set(names)) == len(names)


def test_the_threshold_is_what_clean_drives_rarely_reach(heated):
    _, windows, tried, system = heated
    limit = threshold(system, FREE, tried, 1, np.ones(len(windows)))
    assert limit.z >= LEAST_Z
    assert limit.false_claims <= 0.011
    assert threshold(system, FREE, tried, 1, np.ones(len(windows))) == limit
    assert threshold(system, FREE, tried, 1, 3.0 * np.ones(len(windows))).z == pytest.approx(limit.z, rel=1e-6)


def test_a_term_that_another_has_taken_over_goes(heated):
    _, windows, tried, system = heated
    by_label = {candidate.label: candidate for candidate in tried}
    warm, tyres = by_label["warm_up_w_per_k@300"], by_label["tyre_warm_up_frac@300"]
    assert tyres not in still_standing(system, FREE, [warm, tyres], windows, 3.5)
    assert warm in still_standing(system, FREE, [warm, tyres], windows, 3.5)


def test_trips_that_scatter_more_are_seen_as_such(heated, car):
    trips, windows, _, system = heated
    louder = [
        replace(
            trip, measured_j=trip.measured_j + 5e4 * np.random.default_rng(k).normal(size=trip.begin_s.size) * (k == 4)
        )
        for k, trip in enumerate(windows)
    ]
    prior = priors(windows[0].names, car, car)
    roots = [np.linalg.cholesky(np.eye(trip.begin_s.size) * 500.0**2) for trip in windows]
    calm, loud = (equations(drives, roots, prior) for drives in (windows, louder))
    before, after = (scatter_of(system_of, solve(system_of, FREE)) for system_of in (calm, loud))
    assert int(np.argmax(after / before)) == 4
    assert len(trips) == system.trips


def test_a_shape_is_refined_towards_the_planted_one(car):
    def slow_heater(time, ambient_c, plain, steps):
        del plain, steps
        return 200.0 * max(20.0 - ambient_c, 0.0) * np.exp(-time / 450.0) + 0.0 * time

    recordings = [drive(car, number, slow_heater) for number in range(16)]
    trips = [trip_of(recording, driven(recording, car)) for recording in recordings]
    model = fit(trips, car, 1, 10.0, lambda stage: None)
    (warm,) = [candidate for candidate in model.found if candidate.term.name == "warm_up_w_per_k"]
    assert warm.shape == pytest.approx(450.0, rel=0.25)
    low, high = model.shape_ci95[warm.label]
    assert low <= warm.shape <= high
