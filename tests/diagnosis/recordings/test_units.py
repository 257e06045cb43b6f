"""Units: those of a header are obeyed; wrong ones are proven by another channel and converted, or told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.engine import diagnose
from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.soundness.feet import hill_ratio, with_doubted_heights
from diagnosis.recordings.soundness.masses import with_doubted_scales
from energy.replay.replay import replay
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive as planted
from tests.diagnosis.recorded_drives import drive, plain_csv

ROOT = Path(__file__).resolve().parents[3]
M_PER_FOOT = 0.3048


@pytest.fixture(scope="module")
def car():
    return load_vehicle(ROOT / "data/vehicles/bmw-i3-60ah.toml")


def units(recording):
    return [(note.channel, note.text) for note in recording.notes if note.kind is NoteKind.UNIT]


def hilly(car, number, *, feet=False):
    """A cycle over hills of 60 m, whose power follows them."""
    recording = planted(car, number)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (recording.speed_mps[1:] + recording.speed_mps[:-1]))))
    tall = replace(recording, elevation_m=500.0 + 60.0 * np.sin(way / (700.0 + 40.0 * number)))
    power = replay(car, tall.profile()).power_w
    at = np.concatenate(([power[0]], 0.5 * (power[1:] + power[:-1]), [power[-1]]))
    rng = np.random.default_rng(number)
    return replace(
        tall,
        power_w=at + rng.normal(0.0, 100.0, at.size),
        elevation_m=tall.elevation_m / M_PER_FOOT if feet else tall.elevation_m,
    )


@pytest.mark.parametrize(
    ("name", "channel", "per_si", "offset"),
    [
        ("speed_mph", "speed_mps", 1.0 / 0.44704, 0.0),
        ("speed_mps", "speed_mps", 1.0, 0.0),
        ("power_kw", "power_w", 1e-3, 0.0),
        ("elevation_ft", "elevation_m", 1.0 / M_PER_FOOT, 0.0),
        ("ambient_f", "ambient_k", 1.8, 32.0 - 1.8 * 273.15),
        ("battery_f", "battery_k", 1.8, 32.0 - 1.8 * 273.15),
        ("soc_percent", "soc_frac", 100.0, 0.0),
    ],
)
def test_the_unit_of_a_header_is_obeyed(read, name, channel, per_si, offset):
    driven = drive()
    n = driven.time_s.size
    si = {
        "speed_mps": driven.speed_mps,
        "power_w": driven.power_w,
        "elevation_m": np.linspace(100.0, 160.0, n),
        "ambient_k": np.full(n, 280.0),
        "battery_k": np.full(n, 290.0),
        "soc_frac": np.linspace(0.8, 0.7, n),
    }
    names = {"speed_mps": "speed_kmh", "power_w": "power_w"}
    columns = {"time_s": driven.time_s, "speed_kmh": 3.6 * driven.speed_mps, "power_w": driven.power_w}
    columns.pop(names.get(channel, ""), None)
    columns[name] = per_si * si[channel] + offset
    text = "\n".join(
        [",".join(columns), *(",".join(f"{cell:.9g}" for cell in row) for row in zip(*columns.values(), strict=True))]
    )
    recording = read(text)
    np.testing.assert_allclose(getattr(recording, channel), si[channel], rtol=1e-6, atol=1e-4)
    assert units(recording) == []


def test_of_two_units_of_one_channel_the_first_counts(read):
    driven = drive()
    recording = read(plain_csv(driven, speed_mph=np.full(driven.time_s.size, 5.0)))
    np.testing.assert_allclose(recording.speed_mps, driven.speed_mps, atol=1e-6)
    assert [note.text for note in recording.notes if note.channel == "speed_mps"] == [
        "column 'speed_mph': it is there in another unit"
    ]


def test_power_in_kilowatts_is_proven_by_voltage_and_current_and_converted(read):
    driven = drive()
    volts = np.full(driven.time_s.size, 400.0)
    amperes = driven.power_w / 400.0
    recording = read(plain_csv(driven, power_w=driven.power_w / 1000.0, voltage_v=volts, current_a=amperes))
    np.testing.assert_allclose(recording.power_w, driven.power_w, rtol=1e-6)
    assert units(recording) == [
        ("power_w", "is in kW, declared as W: voltage times current is 1000 times as much; converted")
    ]


def test_hills_ask_for_as_much_as_their_height_and_a_third_in_feet(car):
    for number in (1, 5, 9):  # in town, where gains of speed tell a mass
        metres, feet = hill_ratio(hilly(car, number)), hill_ratio(hilly(car, number, feet=True))
        assert metres.value == pytest.approx(1.0, abs=0.1)
        assert feet.value == pytest.approx(M_PER_FOOT * metres.value, rel=1e-6)


def test_heights_in_feet_are_told_and_converted_and_metres_are_left_alone(car):
    plain = [hilly(car, number) for number in range(8)]
    assert with_doubted_heights(plain) == plain
    found = with_doubted_heights([hilly(car, number, feet=True) for number in range(8)])
    for recording, truth in zip(found, plain, strict=True):
        ((channel, text),) = units(recording)
        assert channel == "elevation_m"
        assert text.startswith("is in feet")
        np.testing.assert_allclose(recording.elevation_m, truth.elevation_m, rtol=1e-9)


def test_single_drives_in_feet_are_told_among_others(car):
    mixed = [hilly(car, number, feet=number in (2, 5)) for number in range(10)]
    doubted = [recording.id for recording in with_doubted_heights(mixed) if units(recording)]
    assert doubted == ["T2", "T5"]


def test_flat_drives_say_nothing_of_their_heights(car):
    flat = [
        replace(planted(car, number), elevation_m=np.full(1370, 400.0)[: planted(car, number).time_s.size])
        for number in range(4)
    ]
    assert all(hill_ratio(recording) is None for recording in flat)


@pytest.mark.parametrize(
    ("factor", "power", "channel", "unit"),
    [
        (1.0 / 1.609344, 1.0, "speed_mps", "in miles an hour"),
        (1.0 / 3.6, 1.0, "speed_mps", "in m/s"),
        (1.0, 1e-3, "power_w", "in kW"),
    ],
)
def test_a_mass_that_no_file_is_off_by_tells_of_a_unit_and_changes_nothing(car, factor, power, channel, unit):
    drives = [planted(car, number) for number in range(1, 12, 2)]
    assert with_doubted_scales(drives, car.mass_kg) == drives
    wrong = [replace(each, speed_mps=factor * each.speed_mps, power_w=power * each.power_w) for each in drives]
    found = with_doubted_scales(wrong, car.mass_kg)
    told = [note for recording in found for note in units(recording)]
    assert len(told) >= 0.6 * len(drives)
    assert all(name == channel and text.startswith(f"may be {unit}") for name, text in told)
    for recording, given in zip(found, wrong, strict=True):
        assert recording.speed_mps is given.speed_mps
        assert recording.power_w is given.power_w


@pytest.mark.parametrize(
    ("factor", "power", "channel", "unit"),
    [
        (1.0 / 1.609344, 1.0, "speed_mps", "in miles an hour, where the other"),
        (1.609344, 1.0, "speed_mps", "in km/h, where"),
        (1.0 / 3.6, 1.0, "speed_mps", "in m/s, where"),
        (1.0 / 1.852, 1.0, "speed_mps", "in knots, where"),
        (1.0, 0.001, "power_w", "in kW or horsepower, where"),
        (1.0, 1.0 / 745.7, "power_w", "in kW or horsepower, where"),
    ],
)
def test_single_drives_in_another_unit_among_the_others_are_doubted(car, factor, power, channel, unit):
    drives = [planted(car, number) for number in range(1, 16, 2)]
    odd = drives[3]
    drives[3] = replace(odd, speed_mps=factor * odd.speed_mps, power_w=power * odd.power_w)
    found = with_doubted_scales(drives, car.mass_kg)
    ((name, text),) = units(found[3])
    assert name == channel
    assert text.startswith(f"may be {unit}")
    assert [units(recording) for recording in (*found[:3], *found[4:])] == [[]] * 7


def test_a_diagnosis_names_the_doubted_unit_first(car):
    found = diagnose([hilly(car, number, feet=True) for number in range(4)], car)
    assert "The unit of the height was doubted on T0, T1, T2, T3: it is in feet" in found.text
