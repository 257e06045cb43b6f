"""Labels and seeds are sealed before the tool runs, and what was changed afterwards is not opened."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from proof.errors import BrokenSealError
from proof.plans import places
from proof.sealed import LABELS, WORLDS, made_before, make_into, open_labels, read_seal, seal_all
from proof.worlds.orders import WantedEffect, WorldOrder
from proof.worlds.trips import WorldRegime
from proof.worlds.world import WorldKind

if TYPE_CHECKING:
    from pathlib import Path

    from proof.sealed import Seal

SHORT = WorldRegime(minutes=(2.0, 3.0), air_c=(-10.0, 0.0))
HEATED = WorldOrder(WorldKind.FEW_TRIPS, (WantedEffect("cabin_heating", 0.1),), (2, 2), SHORT)
PLAN = (HEATED, WorldOrder(WorldKind.FEW_TRIPS, trips=(2, 2), regime=SHORT))


@pytest.fixture
def sealed(tmp_path: Path) -> Seal:
    """Two small worlds in tmp_path, sealed."""
    planned = places(PLAN, 5)
    ids = [make_into(place, tmp_path) for place in planned]
    assert None not in ids
    return seal_all({str(world_id): place for world_id, place in zip(ids, planned, strict=True)}, tmp_path, "a plan", 1)


def test_untouched_labels_open_with_what_the_worlds_hide(sealed: Seal, tmp_path: Path) -> None:
    labels = open_labels(tmp_path, sealed.sha256)
    assert sorted(labels) == list(sealed.worlds)
    assert sorted(label.families for label in labels.values()) == [(), ("thermal",)]
    heated = next(label for label in labels.values() if label.families)
    assert heated.effects["cabin_heating"].energy_share == pytest.approx(0.1, rel=1e-3)
    assert read_seal(tmp_path) == sealed


def test_worlds_hold_no_label_and_no_seed(sealed: Seal, tmp_path: Path) -> None:
    for world_id in sealed.worlds:
        names = {path.name for path in (tmp_path / WORLDS / world_id).iterdir()}
        assert names == {"vehicle.toml", "T001.csv", "T002.csv"}


def test_a_changed_label_is_refused_by_name(sealed: Seal, tmp_path: Path) -> None:
    file = tmp_path / LABELS / sealed.worlds[0] / "label.json"
    file.write_text(file.read_text(encoding="utf-8").replace("few_trips", "null"), encoding="utf-8")
    with pytest.raises(BrokenSealError, match=f"label of world '{sealed.worlds[0]}' is changed"):
        open_labels(tmp_path, sealed.sha256)


def test_a_missing_label_is_refused_by_name(sealed: Seal, tmp_path: Path) -> None:
    (tmp_path / LABELS / sealed.worlds[1] / "label.json").unlink()
    with pytest.raises(BrokenSealError, match=f"'{sealed.worlds[1]}' is missing"):
        open_labels(tmp_path, sealed.sha256)


@pytest.mark.parametrize("name", ["seeds.json", "seal.json"])
def test_changed_seeds_and_a_changed_seal_are_refused(sealed: Seal, tmp_path: Path, name: str) -> None:
    file = tmp_path / LABELS / name
    read = json.loads(file.read_text(encoding="utf-8"))
    file.write_text(json.dumps(dict(sorted(read.items())[1:])), encoding="utf-8")
    with pytest.raises(BrokenSealError, match=rf"seal of .* is [0-9a-f]{{64}}, allowed: {sealed.sha256}"):
        open_labels(tmp_path, sealed.sha256)


def test_a_missing_seal_is_refused(sealed: Seal, tmp_path: Path) -> None:
    (tmp_path / LABELS / "seal.json").unlink()
    with pytest.raises(BrokenSealError, match=r"seal\.json is missing"):
        open_labels(tmp_path, sealed.sha256)


def test_worlds_made_before_are_known_by_order_and_seed(sealed: Seal, tmp_path: Path) -> None:
    there = made_before(tmp_path)
    assert {there[place.digest()] for place in places(PLAN, 5)} == set(sealed.worlds)
    assert not {place.digest() for place in places(PLAN, 6)} & set(there)


def test_labels_of_other_worlds_do_not_come_under_the_seal(tmp_path: Path) -> None:
    first, second = places(PLAN, 5)
    kept, other = (make_into(place, tmp_path) for place in (first, second))
    seal = seal_all({str(kept): first}, tmp_path, "a plan", 0)
    assert list(open_labels(tmp_path, seal.sha256)) == [kept]
    assert not (tmp_path / LABELS / str(other)).exists()


def test_twins_share_a_seed_and_others_do_not() -> None:
    plain = WorldOrder(WorldKind.CONFOUNDED)
    twin = WorldOrder(WorldKind.CONFOUNDED_SEPARATED, twin=True)
    keys = [place.key for place in places((PLAN[0], plain, twin, plain), 5)]
    assert keys == [(0,), (1,), (1,), (3,)]


def test_an_order_that_no_drives_carry_stays_unmade(tmp_path: Path) -> None:
    impossible = WorldOrder(WorldKind.SINGLE, (WantedEffect("air_conditioning", 0.5),), (2, 2), SHORT)
    assert make_into(places((impossible,), 5)[0], tmp_path) is None
    assert made_before(tmp_path) == {}
