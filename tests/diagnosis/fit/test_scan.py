"""What no effect explains is found where it was put, and only there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.causes.driven import driven
from diagnosis.fit.axes import Axis
from diagnosis.fit.noise import KERNELS, Noise
from diagnosis.fit.scan import ENDS, around, boxes, cell_centre_deg, cell_of, in_box, leading, placed, scan, strongest
from diagnosis.fit.windows import Windows, trip_of, windows_of
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive

ROOT = Path(__file__).resolve().parents[3]
VARIANCE = np.zeros(len(KERNELS))
VARIANCE[0] = 300.0**2
NOISE = Noise(VARIANCE, 10.0)
TRIPS, WINDOWS = 14, 90


def trip(number, draw):
    """Fifteen minutes over hills around one town; draw: power beyond the model's by altitude [W]."""
    rng = np.random.default_rng(number)
    phase = rng.uniform(0.0, 6.0)
    angle = np.linspace(0.0, 5.0, WINDOWS) + phase
    altitude = 500.0 + 250.0 * np.sin(angle) + rng.normal(0.0, 3.0, WINDOWS)
    speed = np.abs(12.0 + 8.0 * np.sin(3.1 * angle) + rng.normal(0.0, 2.0, WINDOWS))
    simulated = 10.0 * (400.0 * speed)
    seconds = np.full(WINDOWS, 10.0)
    return Windows(
        trip_id=f"T{number}", ambient_k=280.0 + number, begin_s=10.0 * np.arange(WINDOWS), duration_s=seconds,
        distance_m=10.0 * speed, standing_s=np.zeros(WINDOWS),
        measured_j=simulated + 10.0 * (draw(altitude) + rng.normal(0.0, 300.0, WINDOWS)),
        simulated_j=simulated, dynamic_w=400.0 * speed, hill_w=np.zeros_like(speed),
        places={
            "altitude_m": altitude, "latitude_deg": 42.5 + 0.02 * np.cos(angle),
            "longitude_deg": 1.5 + 0.02 * np.sin(angle),
        },
        names=("constant", "road_load_a_n", "road_load_c_n_per_mps2"),
        columns_j=np.column_stack((seconds, 10.0 * speed, 10.0 * speed**3)),
    )  # fmt: skip


def scanned(trips, seed=1, places=None):
    base = [windows.columns_j / 10.0 for windows in trips]
    roots = [NOISE.root(windows) for windows in trips]
    return scan(trips, roots, base, np.zeros(3), np.zeros(3), np.ones(len(trips)), seed, places or boxes(trips))


def test_a_draw_between_two_altitudes_is_located_and_sized():
    trips = [trip(k, lambda z: 1500.0 * ((z > 560.0) & (z < 680.0))) for k in range(TRIPS)]
    found = strongest(scanned(trips), trips, 3.0)
    assert found is not None
    assert found.box.axis is Axis.ALTITUDE
    assert (found.box.low, found.box.high) == pytest.approx((560.0, 680.0), abs=35.0)
    assert found.low_w < 1500.0 < found.high_w * 1.15
    assert found.p < 0.01
    assert len(found.trips) >= 10


def test_both_ends_are_found_between_the_edges_that_were_tried_first():
    trips = [trip(k, lambda z: 1500.0 * ((z > 563.0) & (z < 672.0))) for k in range(TRIPS)]
    found = strongest(scanned(trips), trips, 3.0)
    reach = 0.3 * (found.box.high - found.box.low)
    near = around(found.box, reach, trips)
    better = placed(scanned(trips, places=near), found, trips, 2.0 * reach / (ENDS - 1), 1)
    assert (better.box.low, better.box.high) == pytest.approx((563.0, 672.0), abs=8.0)
    assert better.low_set[0] < 563.0 < better.low_set[1]
    assert better.high_set[0] < 672.0 < better.high_set[1]
    assert (better.z, better.p) == (found.z, found.p)


def test_boxes_worked_through_in_parts_are_as_all_at_once(monkeypatch):
    trips = [trip(k, lambda z: 1500.0 * ((z > 560.0) & (z < 680.0))) for k in range(TRIPS)]
    whole = scanned(trips)
    monkeypatch.setattr("diagnosis.fit.scan.AT_ONCE", 7 * TRIPS * 200)
    parts = scanned(trips)
    np.testing.assert_allclose(parts.highest, whole.highest, rtol=1e-9)
    for name in ("coefficients", "sd", "z", "effective", "losses"):
        np.testing.assert_allclose(getattr(parts.added, name), getattr(whole.added, name), rtol=1e-7, atol=1e-9)


def test_a_window_counts_with_the_share_of_its_time_that_lies_inside():
    car = load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")
    driven_trips = [trip_of(each, driven(each, car)) for each in (drive(car, k) for k in range(4))]
    windows = [windows_of(each, ()) for each in driven_trips]
    found, columns = boxes(windows, driven=driven_trips)
    fast = next(k for k, box in enumerate(found) if box.axis is Axis.SPEED and box.low > 20.0)
    steps = driven_trips[0]
    kmh = 3.6 * steps.drive.speed_mps
    inside_s = np.where((kmh >= found[fast].low) & (kmh < found[fast].high), steps.drive.duration_s, 0.0)
    expected = np.bincount(steps.window, weights=inside_s) / windows[0].duration_s
    np.testing.assert_allclose(columns[0][:, fast], expected, atol=1e-9)
    assert bool(((expected > 0.0) & (expected < 1.0)).any())
    np.testing.assert_allclose(in_box(found[fast], windows[0], steps), expected, atol=1e-9)


def test_of_boxes_with_the_same_windows_the_first_is_taken_whatever_the_last_bit():
    trips = [trip(k, lambda z: 1500.0 * ((z > 560.0) & (z < 680.0))) for k in range(TRIPS)]
    once = scanned(trips)
    z, losses = once.added.z, once.added.losses
    twice = replace(
        once,
        boxes=(*once.boxes, *(replace(box, high=np.inf) for box in once.boxes)),
        columns=[np.hstack((column, column)) for column in once.columns],
        hours=np.tile(once.hours, 2),
        added=replace(
            once.added,
            **{name: np.tile(getattr(once.added, name), 2) for name in ("coefficients", "sd", "effective")},
            z=np.concatenate((z, z * (1.0 + 1e-15))),
            losses=np.hstack((losses, losses - 1e-15 * np.abs(losses))),
        ),
    )
    best = strongest(twice, trips, 3.0)
    assert best is not None
    found = [best, *leading(twice, trips, 4)]
    assert [structure.box for structure in found] == [
        structure.box for structure in (strongest(once, trips, 3.0), *leading(once, trips, 4))
    ]


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_found_where_nothing_is(seed):
    trips = [trip(100 * seed + k, lambda z: 0.0 * z) for k in range(TRIPS)]
    assert strongest(scanned(trips, seed + 1), trips, 3.0) is None


def test_windows_of_another_trip_lie_in_the_box_by_its_bounds():
    trips = [trip(k, lambda z: 0.0 * z) for k in range(TRIPS)]
    found, columns = boxes(trips)
    for k in (0, len(found) // 2, len(found) - 1):
        inside = in_box(found[k], trips[3])
        assert np.abs(inside - columns[3][:, k]).sum() <= 1.0  # the highest of all windows lies on a bound


def test_boxes_reach_several_trips_and_leave_something_outside():
    trips = [trip(k, lambda z: 0.0 * z) for k in range(TRIPS)]
    found, columns = boxes(trips, frozenset((Axis.SPEED,)))
    assert Axis.SPEED not in {box.axis for box in found}
    assert {Axis.ALTITUDE, Axis.SINCE_START, Axis.PLACE} <= {box.axis for box in found}
    inside = np.vstack(columns)
    assert bool(((inside == 0.0) | (inside == 1.0)).all())
    reached = np.sum([column.any(axis=0) for column in columns], axis=0)
    assert int(reached.min()) >= 4


def test_a_map_cell_is_about_as_long_as_wide_and_knows_its_centre():
    latitude, longitude = np.array([42.5123, -30.03]), np.array([1.5321, -51.2])
    for number, lat, lon in zip(cell_of(latitude, longitude).tolist(), latitude, longitude, strict=True):
        centre = cell_centre_deg(number)
        assert centre[0] == pytest.approx(lat, abs=0.0012)
        assert centre[1] == pytest.approx(lon, abs=0.0018)
        assert int(cell_of(np.array([centre[0]]), np.array([centre[1]]))[0]) == number
