"""Coverage of predicted energies: its arithmetic on drives made here, and the page on the published ones."""

from __future__ import annotations

import dataclasses
import os
import re
from types import MappingProxyType

import numpy as np
import pytest

from diagnosis.causes.driven import median_ambient
from diagnosis.comparison.coverage import (
    TripPrediction,
    at_terminals,
    coverage,
    coverage_png,
    predict,
    source_model,
    wilson_interval,
)
from diagnosis.recordings.reading import Recording
from docs import uncertainty_table
from energy.chain.sampling import sampled_vehicles
from energy.conditions import STILL, Conditions
from energy.replay.replay import replay


def prediction(trip_id="T", measured=10.0, p10=8.0, p50=10.0, p90=12.0):
    return TripPrediction(trip_id, 1e4, 600.0, 280.0, measured, p50, p10, p50, p90, None, None)


@pytest.fixture(scope="module")
def drives(kona):
    """30 drives whose power is that of a sampled vehicle, 10 minutes each, at 5 °C."""
    found = []
    for k, vehicle in enumerate(sampled_vehicles(kona, 30, seed=99)):
        random = np.random.default_rng(k)
        time_s = np.arange(601.0)
        speed = np.clip(14.0 + 10.0 * np.sin(time_s / 30.0 + k) + random.normal(0.0, 0.05, 601).cumsum(), 0.0, 35.0)
        drive = Recording(f"T{k}", time_s, speed, np.zeros(601), ambient_k=np.full(601, 278.15))
        driven = replay(at_terminals(vehicle), drive.profile(), conditions=median_ambient(drive))
        power_w = np.append(driven.power_w, driven.power_w[-1])
        found.append(dataclasses.replace(drive, power_w=power_w))
    return tuple(found)


def test_wilson_interval_is_the_published_example():
    # Wilson's formula for 8 of 10: (0.8 + 0.19208)/1.38416 ∓ 1.96·√(0.016 + 0.009604)/1.38416
    assert wilson_interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=5e-5)
    low, high = wilson_interval(0, 18)
    assert (low, high) == pytest.approx((0.0, 3.8416 / 21.8416))
    assert wilson_interval(5, 5)[1] == pytest.approx(1.0)


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (-1, 3), (4, 3)])
def test_wilson_interval_of_impossible_counts_is_refused(successes, trials):
    with pytest.raises(ValueError, match=r"allowed: 0\.\.trials"):
        wilson_interval(successes, trials)


def test_coverage_counts_and_errors_are_those_by_hand():
    # errors 0, −0.5 and +0.25: mean −1/12, mean size 0.25; half widths 2/10, 2/10, 2/10
    found = coverage(
        [prediction(), prediction(measured=20.0), prediction(measured=8.0 / 1.0, p50=10.0, p10=9.0, p90=11.0)]
    )
    assert (found.trips, found.covered, found.below, found.above) == (3, 1, 1, 1)
    assert found.bias_frac == pytest.approx(-1.0 / 12.0)
    assert found.mape_frac == pytest.approx(0.25)
    assert found.sd_frac == pytest.approx(np.std([0.0, -0.5, 0.25], ddof=1))
    assert found.half_width_frac == pytest.approx((0.2 + 0.2 + 0.1) / 3.0)
    assert (found.covered_low_frac, found.covered_high_frac) == wilson_interval(1, 3)


def test_ends_of_the_interval_count_as_covered():
    assert prediction(measured=8.0).covered
    assert prediction(measured=12.0).covered
    assert not prediction(measured=12.001).covered


def test_coverage_of_no_trip_is_refused_and_of_one_has_no_spread():
    with pytest.raises(ValueError, match="at least one"):
        coverage([])
    assert coverage([prediction()]).sd_frac == 0.0


def test_conditions_take_the_median_temperature_or_none(drives):
    ambient_k = np.full(601, np.nan)
    ambient_k[:3] = 280.0, 281.0, 300.0
    assert median_ambient(dataclasses.replace(drives[0], ambient_k=ambient_k)) == Conditions(ambient_k=281.0)
    assert median_ambient(dataclasses.replace(drives[0], ambient_k=None)) == STILL
    assert source_model(drives[0]) == STILL


def test_terminals_leave_out_the_battery_s_own_resistance(kona):
    outside = at_terminals(kona)
    assert outside.effects.battery_resistance_ohm == 0.0
    assert outside.road_load_a_n == kona.road_load_a_n


def test_prediction_without_uncertainty_is_the_plain_replay(kona, drives):
    certain = dataclasses.replace(kona, sd=MappingProxyType({}))
    (found,) = predict(certain, drives[:1], median_ambient, samples=3, residual_sd_frac=0.0)
    assert found.energy_p10_j == found.energy_p50_j == found.energy_p90_j == found.simulated_j
    plain = replay(at_terminals(kona), drives[0].profile(), conditions=median_ambient(drives[0]))
    assert found.simulated_j == pytest.approx(plain.energy_j, rel=1e-12)
    assert found.measured_j == drives[0].energy_j()


def test_predictions_are_the_same_for_a_seed(kona, drives):
    assert predict(kona, drives[:2], source_model, samples=20) == predict(kona, drives[:2], source_model, samples=20)


def test_drives_of_sampled_vehicles_are_covered_as_often_as_said(kona, drives):
    # without residual the recorded vehicles come from the predicted distribution itself: about 24 of 30
    found = coverage(predict(kona, drives, median_ambient, samples=400, residual_sd_frac=0.0))
    assert found.covered_low_frac < 0.8 < found.covered_high_frac


def test_a_model_without_the_heater_does_not_cover_drives_with_one(kona, drives):
    found = coverage(predict(kona, drives, source_model, samples=100, residual_sd_frac=0.0))
    assert found.above > 20
    assert found.bias_frac < -0.1


def test_wider_residual_covers_no_fewer(kona, drives):
    narrow, wide = (
        coverage(predict(kona, drives[:10], source_model, samples=100, residual_sd_frac=sd)) for sd in (0.05, 0.3)
    )
    assert wide.covered >= narrow.covered
    assert wide.half_width_frac > narrow.half_width_frac


def test_picture_is_a_png_also_with_one_group_only(kona, drives):
    found = predict(kona, drives[:2], source_model, samples=10)
    assert coverage_png([("one", found)], lambda trip: False).startswith(b"\x89PNG")


# the published drives


@pytest.fixture(scope="module")
def renewed() -> str:
    """The page as its script writes it now."""
    if not uncertainty_table.RECORDINGS.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no recordings in {uncertainty_table.RECORDINGS}: CI must have them")
        pytest.skip("no recordings beside the repository (shared/data/recordings)")
    page, picture = uncertainty_table.with_tables(page_text(), uncertainty_table.recordings())
    assert picture.startswith(b"\x89PNG")
    return page


def page_text() -> str:
    return uncertainty_table.PAGE.read_text(encoding="utf-8")


def table(page: str, name: str) -> list[list[str]]:
    block = page.split(f"<!-- {name} -->\n")[1].split(f"<!-- /{name} -->")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines()]


@pytest.mark.shared_data
def test_tables_of_the_page_are_those_of_the_script(renewed):
    """Words and counts are the same, numbers to one in their last digit."""
    for name in ("coverage", "standing", "shares", "choices", "repairs", "trips"):
        for written, now in zip(table(page_text(), name), table(renewed, name), strict=True):
            assert_nearly_the_same(" | ".join(written), " | ".join(now))


def assert_nearly_the_same(written: str, now: str) -> None:
    number = re.compile(r"[+−]?\d+(?:\.\d+)?")
    assert number.sub("#", written) == number.sub("#", now), "run `python -m docs.uncertainty_table`"
    for old, new in zip(number.findall(written), number.findall(now), strict=True):
        last_digit = 10.0 ** -len(old.partition(".")[2])
        assert abs(float(old.replace("−", "-")) - float(new.replace("−", "-"))) < 1.5 * last_digit, (old, new)


def test_all_40_trips_are_on_the_page():
    rows = table(page_text(), "trips")[2:]
    assert len({row[0] for row in rows}) == 40
    assert sum(row[0].startswith("TripA") for row in rows) == 22


def test_prose_repeats_the_figures_of_the_tables():
    page = page_text()
    prose = " ".join(page.split())
    found = {row[0]: row[1:] for row in table(page, "coverage")}
    plain, warm = "(a) source's model", "(b) with air temperature"
    assert f"{found[f'{plain}, all'][0].split(': ')[1][:4]} of the trips are covered" in prose
    assert found[f"{plain}, winter"][0].startswith("0 of 18")
    assert f"The bias of {found[f'{plain}, winter'][4]} % in winter" in prose
    shares = [found[f"{warm}, {group}"][0].split(": ")[1][:4] for group in ("all", "winter", "summer")]
    assert f"(b) covers {shares[0]} of all trips, in winter {shares[1]}." in prose
    assert f"In summer {shares[2]} is too few" in prose
    assert float(found[f"{warm}, summer"][0].rstrip(")").split(" ")[-1]) < 80.0
    assert "the interval excludes 80 %" in prose
    assert found[f"{warm}, all"][1] == "0"
    assert f"All {found[f'{warm}, all'][2]} misses are above P90" in prose
    standing = {row[0]: row[1:] for row in table(page, "standing")}
    measured_w, simulated_w, error, _, rest = standing[f"{warm}, winter"]
    assert f"it draws {int(simulated_w) - int(measured_w)} W too much at standstill" in prose
    assert f"the two cancel to {error} %" in prose
    rests = [round(float(cell.replace("−", "-"))) for cell in (standing[f"{warm}, summer"][4], rest)]
    assert f"The rest, −{-rests[0]} to −{-rests[1]} % of the energy" in prose


def test_page_without_a_place_for_a_table_is_refused(drives):
    with pytest.raises(ValueError, match="one place for the table 'coverage'"):
        uncertainty_table.with_place("nothing", "coverage", "a table")
