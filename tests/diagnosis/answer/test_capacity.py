"""The capacity by charge against energy: steps, an offset, cold and a slope of the voltage don't move it, age does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.answer.capacity import YEAR_S, capacity_of, discharge_of
from diagnosis.answer.results import CapacityKind
from diagnosis.recordings.reading import Recording
from diagnosis.recordings.recording import Detail

FILE_WH = 40_000.0
APRIL_2024_S = 1.712e9


def drive(
    number, holds_wh=FILE_WH, *, step=0.01, offset_w=0.0, slope=0.0, chill=0.0, begins_s=0.0, start=None, minutes=None
):
    """A drive that takes about 12 kW; its charge is rounded down to steps, as displays do."""
    rng = np.random.default_rng(number)
    time_s = np.arange(0.0, 60.0 * (minutes or rng.uniform(15.0, 30.0)))
    power_w = 12_000.0 + 15_000.0 * np.sin(time_s / 11.0) + rng.normal(0.0, 500.0, time_s.size)
    battery_c = float(rng.uniform(-5.0, 30.0))
    taken_wh = np.cumsum(power_w) / 3600.0
    start = float(rng.uniform(0.6, 0.95)) if start is None else start
    holds = holds_wh * (1.0 + chill * max(20.0 - battery_c, 0.0) / 10.0)
    # energy from the start down to a charge s is holds·∫(1 + slope·(s − 0.5)) ds: solved for s
    a, b = 0.5 * slope, 1.0 - 0.5 * slope
    left = a * start**2 + b * start - taken_wh / holds
    charge = left / b if a == 0.0 else (-b + np.sqrt(b**2 + 4.0 * a * left)) / (2.0 * a)
    shown = np.floor(charge / step + 1e-9) * step
    return Recording(
        f"T{number}",
        begins_s + time_s,
        np.full(time_s.size, 15.0),
        power_w + offset_w,
        soc_frac=np.clip(shown, 0.0, 1.0),
        battery_k=np.full(time_s.size, 273.15 + battery_c),
    )


def holds_kwh(drives, file_wh=FILE_WH):
    found = capacity_of(drives, file_wh)
    assert found is not None
    return found


@pytest.mark.parametrize("step", [1e-4, 0.005, 0.01])
def test_a_battery_that_holds_a_fifth_less_is_told_with_its_size_whatever_the_steps_of_its_charge(step):
    found = holds_kwh([drive(k, 0.8 * FILE_WH, step=step) for k in range(12)])
    assert found.kind is CapacityKind.LESS
    assert found.is_carried
    low, high = found.ci95_wh
    assert low < 0.8 * FILE_WH < high
    assert high - low < 0.1 * FILE_WH
    assert "where its file has 40: aged" in found.text


@pytest.mark.parametrize(
    "more", [{}, {"offset_w": 40.0}, {"slope": 0.2}, {"chill": -0.03}, {"slope": 0.15, "step": 0.005}]
)
def test_of_a_battery_as_its_file_has_it_nothing_is_said(more):
    found = holds_kwh([drive(k, **more) for k in range(20)])
    assert found.kind is CapacityKind.AS_IN_FILE
    assert found.text == ""
    low, high = found.ci95_wh
    assert low < FILE_WH < high


def test_a_capacity_from_half_full_drives_is_that_of_the_whole_charge():
    drives = [drive(k, slope=0.25, start=0.35 + 0.05 * (k % 12)) for k in range(24)]
    assert holds_kwh(drives).value_wh == pytest.approx(FILE_WH, rel=0.02)
    full = [drive(k, slope=0.25, start=0.97) for k in range(24)]
    low, high = holds_kwh(full).ci95_wh
    assert low < FILE_WH < high


def test_one_drive_with_a_jump_of_the_charge_does_not_count():
    drives = [drive(k) for k in range(12)]
    jumped = np.array(drives[3].soc_frac)
    jumped[300:] -= 0.1
    found = holds_kwh([*drives[:3], replace(drives[3], soc_frac=jumped), *drives[4:]])
    assert found.kind is CapacityKind.AS_IN_FILE
    assert "T3" not in found.trips
    assert len(found.trips) == 11


def test_a_charge_of_more_than_the_usable_part_is_told_and_not_carried():
    found = holds_kwh([drive(k, 1.2 * FILE_WH, step=0.005) for k in range(12)])
    assert found.kind is CapacityKind.MORE
    assert not found.is_carried
    assert "counts more than the part that drives use" in found.text


def test_short_drives_tell_no_capacity():
    assert capacity_of([drive(k, minutes=3.0) for k in range(20)], FILE_WH) is None
    assert discharge_of(drive(1, minutes=3.0)) is None


def test_a_single_long_drive_tells_a_wide_interval_and_nothing_is_carried():
    found = holds_kwh([drive(1, 0.6 * FILE_WH, minutes=60.0)])
    assert found.kind is CapacityKind.LESS
    assert not found.is_carried
    assert "by one drive" in found.text
    assert "or the file is of a larger battery" in found.text
    assert found.ci95_wh[1] - found.ci95_wh[0] > 0.05 * found.value_wh


def test_what_was_charged_in_a_gap_is_left_out():
    recording = drive(1, minutes=40.0)
    middle = recording.time_s.size // 2
    charged = np.array(recording.soc_frac)
    charged[middle:] += 0.05
    broken = replace(recording, soc_frac=charged, gaps=((float(middle - 1), float(middle)),))
    whole, found = discharge_of(recording), discharge_of(broken)
    assert found.energy_wh / found.fall_frac == pytest.approx(whole.energy_wh / whole.fall_frac, rel=0.02)
    assert found.fall_frac < whole.fall_frac


def test_the_charge_on_the_display_counts_before_any_other():
    drives = [drive(k, 0.85 * FILE_WH) for k in range(8)]
    gross = [replace(each, soc_frac=0.2 + 0.7 * each.soc_frac, displayed_frac=each.soc_frac) for each in drives]
    found = holds_kwh(gross)
    assert found.displayed
    assert found.value_wh == pytest.approx(0.85 * FILE_WH, rel=0.03)


def test_a_battery_that_ages_by_the_year_is_told_and_a_steady_one_is_not():
    def over_two_years(yearly):
        return [
            drive(k, FILE_WH * (1.0 + yearly * k / 12.0), step=0.005, begins_s=APRIL_2024_S + k / 12.0 * YEAR_S)
            for k in range(24)
        ]

    ageing = holds_kwh(over_two_years(-0.04)).drift
    assert ageing is not None
    low, high = ageing.ci95_frac_per_year
    assert low < -0.04 < high < 0.0
    assert ageing.years == pytest.approx(23 / 12)
    assert holds_kwh(over_two_years(0.0)).drift is None
    assert holds_kwh([replace(each, time_s=each.time_s - APRIL_2024_S) for each in over_two_years(-0.04)]).drift is None


def test_sums_of_drives_with_energy_and_charge_tell_it_too():
    rng = np.random.default_rng(5)
    drives = []
    for k in range(15):
        fall = float(rng.uniform(0.15, 0.4))
        start = round(float(rng.uniform(0.6, 0.95)), 2)
        n = 20
        drives.append(
            Recording(
                f"T{k}",
                np.linspace(0.0, 3600.0, n),
                np.full(n, 15.0),
                np.full(n, 0.85 * FILE_WH * fall),
                soc_frac=np.linspace(start, round(start - fall, 2), n),
                detail=Detail.TOTALS,
            )
        )
    found = holds_kwh(drives)
    assert found.kind is CapacityKind.LESS
    assert found.ci95_wh[0] < 0.85 * FILE_WH < found.ci95_wh[1]
    unknown = [replace(each, power_w=np.zeros(20)) for each in drives]
    assert capacity_of(unknown, FILE_WH) is None


def test_a_drive_that_takes_nothing_while_its_charge_falls_tells_no_capacity():
    time_s = np.arange(4.0)
    charge = np.array([0.9, 0.8, 0.6, 0.5])
    nothing = Recording("T0", time_s, np.full(4, 10.0), np.full(4, 1e-9), soc_frac=charge)
    assert discharge_of(nothing) is not None
    assert capacity_of([nothing], FILE_WH) is None
