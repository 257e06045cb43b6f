"""One enumeration of causes: kernels, results, schemas and the map have each of its parts, in its order."""

from __future__ import annotations

import dataclasses
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

from app.schemas.route import EnergyPartsKwh, EnergyPartsWh
from energy.force import kernels_parts
from energy.force.kernels_parts import PART_COUNT
from energy.force.parts import SOURCE_PART_COUNT, EnergyParts, Part, energy_parts

pytestmark = pytest.mark.nojit

ROOT = Path(__file__).resolve().parents[3]


def test_each_kernel_column_is_booked_as_the_part_of_its_name():
    columns = {name.lower(): value for name, value in vars(kernels_parts).items() if isinstance(value, int)}
    assert columns.pop("part_count") == PART_COUNT
    assert columns == {part.value: part.column for part in Part if part.column is not None}
    assert sorted(columns.values()) == list(range(PART_COUNT))


def test_the_sources_parts_are_the_first_in_answers_and_kernels_alike():
    assert [part.column for part in Part][:SOURCE_PART_COUNT] == list(range(SOURCE_PART_COUNT))
    effects = [part for part in Part if part.meaning.startswith("effect: ")]
    assert effects == [*Part][SOURCE_PART_COUNT:-1]


def test_results_and_schemas_have_the_parts_in_order():
    names = [part.value for part in Part]
    assert [field.name for field in dataclasses.fields(EnergyParts)] == [f"{name}_j" for name in names]
    assert list(EnergyPartsKwh.model_fields) == list(EnergyPartsWh.model_fields) == names


def test_parts_from_an_array_are_those_of_the_array_and_survive_a_process_border():
    values = np.arange(1.0, len(Part) + 1.0)
    parts = energy_parts(values)
    assert dataclasses.astuple(parts) == tuple(values)
    assert [getattr(parts, f"{part}_j") for part in Part] == values[[part.idx for part in Part]].tolist()
    assert parts.total_j() == values.sum()
    assert pickle.loads(pickle.dumps(parts)) == parts
    with pytest.raises(dataclasses.FrozenInstanceError):
        parts.cabin_j = 0.0
    with pytest.raises(ValueError, match="shorter"):
        energy_parts(values[:-1])


def test_the_map_labels_each_part_in_order():
    script = (ROOT / "web" / "js" / "routes" / "parts.js").read_text(encoding="utf-8")
    (labels,) = re.findall(r"export const CAUSES = \{\n(.*?)\n\};", script, re.DOTALL)
    assert re.findall(r'^  (\w+): \["', labels, re.MULTILINE) == [part.value for part in Part]
