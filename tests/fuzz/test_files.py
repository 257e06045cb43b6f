"""Damaged files end in an answer or a refusal; `python -m tests.fuzz SECONDS` tries more of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.mutations import mutant
from tests.fuzz.reading import Ending, ending_of
from tests.fuzz.samples import samples

SEEDS = range(20)
FILES = samples()


@pytest.mark.parametrize("name", FILES)
def test_a_sound_file_is_read(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(FILES[name])
    assert ending_of(path) == Ending("read")


@pytest.mark.parametrize("name", FILES)
@pytest.mark.filterwarnings("ignore")  # what a library says of a damaged file
def test_a_damaged_file_ends_in_an_answer_or_a_refusal(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    endings = []
    for seed in SEEDS:
        path.write_bytes(mutant(FILES[name], name, seed))
        endings.append(ending_of(path))
    assert [ending.text for ending in endings if ending.kind == "failed"] == []


def test_the_same_seed_gives_the_same_damage_and_another_seed_another() -> None:
    changed = {seed: [mutant(content, name, seed) for name, content in FILES.items()] for seed in range(5)}
    assert changed[3] == [mutant(content, name, 3) for name, content in FILES.items()]
    assert len({tuple(contents) for contents in changed.values()}) == 5
