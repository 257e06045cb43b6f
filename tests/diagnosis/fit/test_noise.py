"""Scatter of residual powers: what is drawn from a noise is found again, and whitening takes it out."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.fit.noise import FLOOR_W, KERNELS, Noise, estimated, whitened
from diagnosis.fit.windows import Windows


def trip(rng, number, windows=120):
    """A trip of 10 s windows that stands a third of the time."""
    moving = rng.random(windows) > 0.33
    power = np.where(moving, rng.uniform(2e3, 3e4, windows), 400.0)
    seconds = np.full(windows, 10.0)
    rolling = np.where(moving, rng.uniform(8.0, 30.0, windows), 0.0)
    return Windows(
        trip_id=f"T{number}", ambient_k=None, begin_s=10.0 * np.arange(windows), duration_s=seconds,
        distance_m=10.0 * rolling, standing_s=np.where(moving, 0.0, 10.0), measured_j=10.0 * power,
        simulated_j=10.0 * power, dynamic_w=power, hill_w=np.zeros_like(power), places={},
        names=("road_load_a_n", "road_load_c_n_per_mps2"),
        columns_j=np.column_stack((10.0 * rolling, 10.0 * rolling**3)),
    )  # fmt: skip


def variance(**sd):
    found = np.zeros(len(KERNELS))
    found[0] = FLOOR_W**2
    for name, value in sd.items():
        found[KERNELS.index(name)] = value**2
    return found


TRUE = variance(white=150.0, white_dynamic=0.1, wander_480s=400.0, level=300.0)


@pytest.fixture(scope="module")
def drives():
    rng = np.random.default_rng(11)
    trips = [trip(rng, k) for k in range(30)]
    noise = Noise(TRUE, 10.0)
    return trips, [noise.root(windows) @ rng.normal(size=120) for windows in trips]


def test_whitening_leaves_unit_scatter_without_memory(drives):
    trips, residuals_w = drives
    noise = Noise(TRUE, 10.0)
    plain = np.concatenate(
        [whitened(noise.root(windows), values) for windows, values in zip(trips, residuals_w, strict=True)]
    )
    assert plain.std() == pytest.approx(1.0, abs=0.03)
    assert np.corrcoef(plain[1:], plain[:-1])[0, 1] == pytest.approx(0.0, abs=0.05)


def test_what_was_drawn_is_found_again(drives):
    trips, residuals_w = drives
    found = dict(zip(KERNELS, np.sqrt(estimated(trips, residuals_w, 10.0).variance), strict=True))
    assert found["white_dynamic"] == pytest.approx(0.1, rel=0.2)
    slow = np.sqrt(sum(found[name] ** 2 for name in ("level", "wander_120s", "wander_480s", "wander_1800s")))
    assert slow == pytest.approx(500.0, rel=0.25)
    assert found["rolling"] < 20.0


def test_a_single_event_does_not_rule_the_noise(drives):
    trips, residuals_w = drives
    struck = [values.copy() for values in residuals_w]
    struck[3][40:43] += 2e5
    calm, shaken = (estimated(trips, values, 10.0).root(trips[0]) for values in (residuals_w, struck))
    assert np.diag(shaken).mean() < 1.5 * np.diag(calm).mean()


def test_expected_parts_add_up_to_what_is_left(drives):
    trips, residuals_w = drives
    parts = Noise(TRUE, 10.0).expected_w(trips[0], residuals_w[0])
    np.testing.assert_allclose(sum(parts.values()), residuals_w[0], rtol=1e-6, atol=1e-6)


def test_floors_hold_where_nothing_scatters(drives):
    trips, _ = drives
    quiet = estimated(trips, [np.zeros(120) for _ in trips], 10.0)
    assert quiet.variance[0] == pytest.approx(FLOOR_W**2)
    assert bool(np.all(np.linalg.eigvalsh(quiet.covariance_w2(trips[0])) > 0.0))
