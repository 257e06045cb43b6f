"""What voltage tells of a battery: its resistance over temperature, and whether power was taken before it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.causes.battery import battery_loss
from diagnosis.recordings.recording import Recording

pytestmark = pytest.mark.nojit

OHM = 0.1  # at 23 °C
DOUBLING_K = 25.0
OPEN_V = 380.0


def trip(number: int, celsius: float, *, upstream: bool = False, seconds: int = 900) -> Recording:
    """A drive whose current comes and goes within half a minute, with a logger's noise and charge that falls."""
    rng = np.random.default_rng(number)
    time_s = np.arange(float(seconds))
    level = np.repeat(rng.uniform(-60.0, 150.0, seconds // 15 + 1), 15)[:seconds]
    amps = np.convolve(level, np.full(3, 1.0 / 3.0), mode="same")
    ohm = OHM * 2.0 ** ((23.0 - celsius) / DOUBLING_K)
    volt = OPEN_V - 0.01 * time_s - ohm * amps
    power_w = (volt + ohm * amps if upstream else volt) * amps
    return Recording(
        id=f"T{number:02}",
        time_s=time_s,
        speed_mps=np.full(seconds, 10.0),
        power_w=1.01 * power_w + rng.normal(0.0, 30.0, seconds),
        ambient_k=np.full(seconds, 273.15 + celsius),
        voltage_v=np.rint(2.0 * (volt + rng.normal(0.0, 0.3, seconds))) / 2.0,
        current_a=amps + rng.normal(0.0, 0.3, seconds),
    )


def drives(*, upstream: bool = False) -> list[Recording]:
    return [trip(k, celsius, upstream=upstream) for k, celsius in enumerate(np.linspace(-10.0, 30.0, 12).tolist())]


@pytest.mark.parametrize("upstream", [False, True])
def test_resistance_and_what_the_power_holds_of_its_loss_come_back(upstream: bool) -> None:
    found = battery_loss(drives(upstream=upstream))
    assert found is not None
    assert found.ohm == pytest.approx(OHM, rel=0.03)
    assert found.ohm_ci95[0] < OHM < found.ohm_ci95[1]
    assert found.doubling_k == pytest.approx(DOUBLING_K, rel=0.1)
    assert found.share == pytest.approx(float(upstream), abs=0.1)


def test_without_a_current_power_over_voltage_stands_for_it() -> None:
    found = battery_loss([replace(drive, current_a=None) for drive in drives()])
    assert found is not None
    assert found.ohm == pytest.approx(OHM, rel=0.05)
    assert found.share is None


@pytest.mark.parametrize(
    "broken",
    [
        lambda drive: replace(drive, voltage_v=None),
        lambda drive: replace(drive, voltage_v=np.full_like(drive.power_w, np.nan)),
        lambda drive: replace(drive, voltage_v=np.full_like(drive.power_w, OPEN_V)),
        lambda drive: replace(drive, voltage_v=np.zeros_like(drive.power_w)),
        lambda drive: replace(drive, voltage_v=np.random.default_rng(1).normal(380.0, 20.0, drive.power_w.size)),
    ],
    ids=["none", "empty", "stuck", "zero", "noise"],
)
def test_a_voltage_that_tells_nothing_gives_no_resistance(broken: object) -> None:
    assert callable(broken)
    assert battery_loss([broken(drive) for drive in drives()]) is None


def test_three_drives_are_too_few() -> None:
    assert battery_loss(drives()[:3]) is None


def test_one_drive_with_a_loose_wire_does_not_decide() -> None:
    found = battery_loss([*drives(), replace(trip(40, 20.0), voltage_v=200.0 + trip(41, 20.0).current_a * 2.0)])
    assert found is None or found.ohm == pytest.approx(OHM, rel=0.1)
