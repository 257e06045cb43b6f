"""docs/model.md names every equation once and only code that exists."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from energy import chain, kernels
from energy.chain import Chain
from energy.stops import StopSettings
from energy.vehicle import Vehicle

pytestmark = pytest.mark.nojit

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "model.md").read_text(encoding="utf-8")
SECTIONS = {part.split("\n", 1)[0]: part for part in PAGE.split("\n## ")}


def test_docs_table_of_equations_has_each_of_them_once():
    numbers = re.findall(r"^\| \((\d+)\) \|", SECTIONS["Equations"], re.MULTILINE)
    assert numbers == [str(n) for n in range(1, 42)]


def test_docs_name_functions_that_exist():
    named = re.findall(r"`(kernels|chain)\.(\w+)`", PAGE)
    assert len(named) > 40
    for module, function in named:
        assert callable(getattr({"kernels": kernels, "chain": chain}[module], function))


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
