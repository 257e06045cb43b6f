"""Tables of sums: a drive a row, refused with row and column, and what can be told from them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from diagnosis.answer.results import Verdict
from diagnosis.causes.families import Family
from diagnosis.engine import diagnose
from diagnosis.recordings.formats.totals import TOTALS_NAMES
from diagnosis.recordings.notes import RecordingError
from diagnosis.recordings.reading import read_drives, read_recordings
from diagnosis.recordings.recording import Detail
from energy.vehicle.files import load_vehicle

ROOT = Path(__file__).resolve().parents[3]
HEADER = "trip,distance_km,duration_min,energy_kwh,ambient_c"


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")


def table(folder, header, *rows):
    path = folder / "totals.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_each_row_is_a_drive_of_its_sums(tmp_path):
    path = table(tmp_path, f"{HEADER},climb_m,remarks", "a,20,30,4.2,-3,50,two people", "b,10,12,1.7,,,")
    first, second = read_drives(path)
    assert (first.id, second.id) == ("a", "b")
    assert first.detail is Detail.TOTALS
    assert first.distance_m() == pytest.approx(20_000.0)
    assert first.energy_j() / 3.6e6 == pytest.approx(4.2)
    assert first.time_s[-1] - first.time_s[0] == pytest.approx(1800.0)
    assert first.elevation_m[-1] - first.elevation_m[0] == pytest.approx(50.0)
    assert float(first.ambient_k[0]) == pytest.approx(270.15)
    assert [note.text for note in first.notes] == ["remarks: two people"]
    assert second.ambient_k is None
    assert second.elevation_m is None


def test_charge_at_both_ends_stands_for_an_energy_and_dates_order_drives(tmp_path, car):
    path = table(
        tmp_path, "date,distance_km,duration_h,soc_start_percent,soc_end_percent",
        "2026-02-01T08:00,12,0.5,80,70", "2026-02-03,12,0.4,90,81",
    )  # fmt: skip
    first, second = read_drives(path)
    assert (first.id, second.id) == ("totals-2", "totals-3")
    assert second.time_s[0] - first.time_s[0] == pytest.approx(40 * 3600.0)
    found = diagnose([first, second], car)
    assert [trip.measured_kwh for trip in found.trips] == pytest.approx([1.88, 1.692], rel=1e-3)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (["a,20,30,,5"], "row 2: energy_kwh is empty, allowed: an energy, or the charge at both ends"),
        (["a,20,30,4,5", "a,10,20,2,5"], "row 3: trip is a, allowed: an id that no row before has"),
        (["a,300,30,60,5"], "row 2: distance_km is 600 km/h on average"),
        (["a,,30,4,5"], "row 2: distance_km is empty"),
    ],
)
def test_a_row_that_is_no_drive_is_refused_by_name(tmp_path, rows, message):
    with pytest.raises(RecordingError, match=re.escape(message)):
        read_drives(table(tmp_path, HEADER, *rows, "z,5,9,1,5"))


def test_a_table_beside_other_files_gives_all_its_drives(tmp_path):
    table(tmp_path, HEADER, "a,20,30,4.2,5", "b,20,30,4.4,3")
    found, errors = read_recordings([tmp_path])
    assert [recording.id for recording in found] == ["a", "b"]
    assert errors == []


def test_heat_is_told_from_sums_but_not_from_cold_tyres(tmp_path, car):
    rng = np.random.default_rng(5)
    rows = []
    for k in range(24):
        km, minutes, air_c = rng.uniform(8.0, 40.0), rng.uniform(15.0, 50.0), rng.uniform(-10.0, 22.0)
        kwh = 0.115 * km + 0.3 * minutes / 60.0 + 0.13 * max(20.0 - air_c, 0.0) * minutes / 60.0
        rows.append(f"t{k},{km:.1f},{minutes:.1f},{kwh * rng.normal(1.0, 0.02):.2f},{air_c:.1f}")
    found = diagnose(read_drives(table(tmp_path, HEADER, *rows)), car)
    assert found.text.startswith("No speed was recorded on any drive")
    assert found.verdict is Verdict.CANNOT_TELL
    (heat,) = found.findings
    assert heat.family is Family.THERMAL
    assert Family.ROLLING in {rival.family for rival in heat.ambiguous_with}
    assert found.after.mape < 0.5 * found.before.mape
    assert not found.other_car
    assert found.parameter_errors == ()


def test_the_page_names_every_column():
    page = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`(\w+)`", page)) >= TOTALS_NAMES
