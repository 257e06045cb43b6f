"""docs/model.md names every equation once and only code that exists."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from app.schemas.conditions import ConditionsSent
from app.schemas.effects import EffectsSent
from energy.chain import chain, kernels_chain, kernels_link
from energy.chain.chain import Chain
from energy.force import effects, kernels_force, kernels_phase, kernels_physics, kernels_terms, parts
from energy.force.parts import PART_NAMES
from energy.stops import StopSettings
from energy.vehicle.coefficients import EffectCoefficients
from energy.vehicle.vehicle import Vehicle

pytestmark = pytest.mark.nojit

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "model.md").read_text(encoding="utf-8")
EFFECTS = Path(__file__).resolve().parents[2] / "docs" / "effects.md"
SECTIONS = {part.split("\n", 1)[0]: part for part in PAGE.split("\n## ")}


def test_docs_table_of_equations_has_each_of_them_once():
    numbers = re.findall(r"^\| \((\d+)\) \|", SECTIONS["Equations"], re.MULTILINE)
    assert numbers == [str(n) for n in range(1, 42)]


def test_docs_name_functions_that_exist():
    modules = (kernels_link, kernels_chain, kernels_force, kernels_phase, kernels_terms, kernels_physics)
    modules += (chain, effects, parts)
    by_name = {module.__name__.rsplit(".", 1)[1]: module for module in modules}
    named = re.findall(rf"`({'|'.join(by_name)})\.(\w+)`", PAGE)
    assert len(named) > 40
    for module, function in named:
        assert callable(getattr(by_name[module], function))
        assert getattr(by_name[module], function).__module__ == by_name[module].__name__


def test_effects_page_has_each_condition_coefficient_and_part_with_its_default():
    page = EFFECTS.read_text(encoding="utf-8")
    shown = set(re.findall(r"`(\w+)`", page))
    sent = set(ConditionsSent.model_fields) | set(EffectsSent.model_fields)
    assert sent <= shown
    assert set(PART_NAMES[7:-1]) <= shown
    for name, default in re.findall(r"`(\w+_(?:w|k|coef|ohm|v|per_k|per_rad|cop|s))`[^`,|]*?([0-9.]+)", page):
        if name in {f.name for f in dataclasses.fields(EffectCoefficients)}:
            value = getattr(EffectCoefficients(), name)
            assert value in (float(default), 1000.0 * float(default)), name


def test_docs_nomenclature_has_every_physical_field():
    table = SECTIONS["Nomenclature"]
    named = set(re.findall(r"`(\w+)`", table))
    physical = {f.name for f in dataclasses.fields(Vehicle)} - {
        "id",
        "name",
        "powertrain",
        "sources",
        "usable_capacity_wh",
    }
    assert physical | {f.name for f in dataclasses.fields(Chain)} <= named


def test_docs_table_of_stops_shows_the_defaults():
    settings = StopSettings()
    rows = re.findall(r"^\| (probability|time), \w+ towns \|(.*)\|$", SECTIONS["Stops"], re.MULTILINE)
    shown = [[float(cell.strip().removesuffix(" s")) for cell in cells.split("|")] for _, cells in rows]
    assert shown == [*settings.probability_frac[:, 1:].tolist(), *settings.time_s[:, 1:].tolist()]
