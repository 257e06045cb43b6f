"""The section `[charging]` of vehicle files: units, sources, defaults, and what a broken one says."""

from __future__ import annotations

import re
import tomllib

import pytest

from energy.charging.charging import Charging, Connector
from energy.charging.figures import AC_EFF, DC_EFF, charging_of, figures_of
from energy.errors import VehicleError
from energy.vehicle.charging_section import charging_from_section

FULL = """
connectors = ["type2", "ccs2"]
curve_soc_percent = [0, 7, 50, 100]
curve_kw = [60, 100, 100, 10]
curve_source = "curve"
ac_kw = 11
ac_phases = 3
ac_one_phase_kw = 7.4
ac_eff = 0.88
dc_eff = 0.93
cold_c = [-10, 20]
cold_factor = [0.4, 1]
cold_source = "cold"
source = "car"
"""
ONLY_AC = 'connectors = ["type1"]\nac_kw = 3.7\nsource = "car"\n'


def read(text: str) -> Charging:
    return charging_from_section(tomllib.loads(text), "small")


def full(old: str, new: str) -> Charging:
    assert old in FULL
    return read(FULL.replace(old, new, 1))


def test_section_is_read_into_si_units_with_the_source_of_each_number() -> None:
    charging = read(FULL)
    assert charging.connectors == (Connector.TYPE2, Connector.CCS2)
    assert charging.dc is not None
    assert charging.dc.soc_frac.tolist() == [0.0, 0.07, 0.5, 1.0]
    assert charging.dc.power_w.tolist() == [60_000.0, 100_000.0, 100_000.0, 10_000.0]
    assert (charging.ac_power_w, charging.ac_phases, charging.ac_one_phase_w) == (11_000.0, 3, 7_400.0)
    assert (charging.ac_eff, charging.dc_eff) == (0.88, 0.93)
    assert charging.cold_curve == ((-10.0, 0.4), (20.0, 1.0))
    assert charging.sources == {
        "connectors": "car",
        "dc": "curve",
        "ac_power_w": "car",
        "ac_phases": "car",
        "ac_one_phase_w": "car",
        "ac_eff": "car",
        "dc_eff": "car",
        "cold_curve": "cold",
    }


def test_section_of_alternating_current_alone_assumes_its_efficiency_and_says_so() -> None:
    charging = read(ONLY_AC)
    assert charging.dc is None
    assert (charging.ac_power_w, charging.ac_phases) == (3_700.0, 1)
    assert (charging.ac_eff, charging.dc_eff) == (AC_EFF, DC_EFF)
    assert charging.sources["ac_eff"].startswith("assumed: ")
    assert charging.sources["dc_eff"].startswith("assumed: ")


@pytest.mark.parametrize("text", [FULL, ONLY_AC], ids=["full", "only-ac"])
def test_figures_of_a_record_make_the_same_record(text: str) -> None:
    charging = read(text)
    again = charging_of(figures_of(charging), charging.sources)
    assert figures_of(again) == figures_of(charging)
    assert again.sources == charging.sources


def test_curve_that_rises_and_falls_is_taken() -> None:
    curve = full("curve_kw = [60, 100, 100, 10]", "curve_kw = [60, 100, 40, 90]").dc
    assert curve is not None
    assert curve.power_w.tolist() == [60_000.0, 100_000.0, 40_000.0, 90_000.0]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[0, 7, 50, 100]", "[0, 50, 7, 100]", "charging.curve_soc_percent of vehicle 'small' is [0.0, 50.0, 7.0"),
        ("[0, 7, 50, 100]", "[0, 7, 50, 101]", "allowed: rising from 0 to 100"),
        ("[0, 7, 50, 100]", "[5, 7, 50, 100]", "allowed: rising from 0 to 100"),
        ("[0, 7, 50, 100]", "[0, 7, 100]", "charging.curve_kw of vehicle 'small' is 4 values, allowed: 3, as many as"),
        ("[0, 7, 50, 100]", "[0, 7, nan, 100]", "charging.curve_soc_percent"),
        ("[60, 100, 100, 10]", "[60, 100, 100, 0]", "charging.curve_kw of vehicle 'small' is [60.0, 100.0"),
        ("[60, 100, 100, 10]", "[60, 100, 100, -5]", "allowed: each 0.001..4000 kW"),
        ("[60, 100, 100, 10]", "[60, 100, 100, 5000]", "allowed: each 0.001..4000 kW"),
        ("[60, 100, 100, 10]", "[60, 100, 100, inf]", "allowed: each 0.001..4000 kW"),
        ("[60, 100, 100, 10]", "[60, 100, 100, '10']", "charging.curve_kw[3] of vehicle 'small' is '10'"),
        ("[60, 100, 100, 10]", "60", "charging.curve_kw of vehicle 'small' is 60, allowed: a list of numbers"),
        ("curve_kw = [60, 100, 100, 10]", "", "charging.curve_kw of vehicle 'small' is missing"),
        ("curve_soc_percent = [0, 7, 50, 100]", "", "charging.curve_soc_percent of vehicle 'small' is missing"),
        ('curve_source = "curve"', "", "charging.curve_source of vehicle 'small' is missing"),
        ('cold_source = "cold"', "", "charging.cold_source of vehicle 'small' is missing"),
        ('\nsource = "car"', "", "charging.source of vehicle 'small' is missing"),
        ('"ccs2"', '"ccs"', "charging.connectors of vehicle 'small' is 'ccs', allowed: a list of type1, type2"),
        ('"ccs2"', "7", "charging.connectors of vehicle 'small' is 7"),
        ('"ccs2"', '["ccs2"]', "charging.connectors of vehicle 'small' is ['ccs2']"),
        ('["type2", "ccs2"]', '"ccs2"', "charging.connectors of vehicle 'small' is 'ccs2', allowed: a list"),
        ('["type2", "ccs2"]', "[]", "charging.connectors of vehicle 'small' is none, allowed: at least one"),
        ('"type2", "ccs2"', '"ccs2", "ccs2"', "allowed: at least one, each once"),
        ('"type2", "ccs2"', '"type2"', "charging.connectors of vehicle 'small' is type2, allowed: with a curve one of"),
        ('"type2", "ccs2"', '"chademo"', "allowed: with a charger for"),
        ("ac_kw = 11", "ac_kw = 101", "charging.ac_kw of vehicle 'small' is 101.0, allowed: 0..100 kW"),
        ("ac_kw = 11", "ac_kw = -1", "charging.ac_kw of vehicle 'small' is -1.0"),
        ("ac_kw = 11", "ac_kw = true", "charging.ac_kw of vehicle 'small' is True, allowed: a number"),
        ("ac_phases = 3", "ac_phases = 4", "charging.ac_phases of vehicle 'small' is 4, allowed: 1, 2 or 3"),
        ("ac_phases = 3", "ac_phases = 1.5", "charging.ac_phases of vehicle 'small' is 1.5, allowed: 1, 2 or 3"),
        ("ac_one_phase_kw = 7.4", "ac_one_phase_kw = 3", "charging.ac_one_phase_kw of vehicle 'small' is 3.0"),
        ("ac_one_phase_kw = 7.4", "ac_one_phase_kw = 12", "allowed: from ac_kw / ac_phases to ac_kw"),
        ("ac_eff = 0.88", "ac_eff = 0", "charging.ac_eff of vehicle 'small' is 0.0, allowed: 0.01..1"),
        ("dc_eff = 0.93", "dc_eff = 1.1", "charging.dc_eff of vehicle 'small' is 1.1, allowed: 0.01..1"),
        ("cold_c = [-10, 20]", "cold_c = [20, -10]", "charging.cold_c of vehicle 'small' is [20.0, -10.0]"),
        ("cold_c = [-10, 20]", "cold_c = [-100, 20]", "allowed: rising within -60..80 °C"),
        ("cold_factor = [0.4, 1]", "cold_factor = [0, 1]", "charging.cold_factor of vehicle 'small' is [0.0, 1.0]"),
        ("cold_factor = [0.4, 1]", "cold_factor = [0.4]", "charging.cold_factor of vehicle 'small' is 1 values"),
        ("ac_kw = 11", "ac_kW = 11", "charging.ac_kW of vehicle 'small' is unknown"),
    ],
)
def test_broken_section_names_the_key_its_value_and_what_is_allowed(old: str, new: str, says: str) -> None:
    with pytest.raises(VehicleError, match=re.escape(says)):
        full(old, new)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (ONLY_AC.replace("type1", "ccs1"), "charging.curve_kw of vehicle 'small' is missing, allowed: a curve with"),
        (ONLY_AC.replace("ac_kw = 3.7", ""), "charging.ac_kw of vehicle 'small' is 0.0, allowed: 0..100 kW, above 0"),
    ],
)
def test_plugs_that_carry_nothing_are_refused(text: str, says: str) -> None:
    with pytest.raises(VehicleError, match=re.escape(says)):
        read(text)


def test_section_that_is_no_section_is_refused() -> None:
    with pytest.raises(VehicleError, match=re.escape("charging of vehicle 'small' is 11, allowed: a section with")):
        charging_from_section(11, "small")
