"""The worlds of a proof for other tools: made, sealed and described, and a scorer for what such a tool answers."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from proof.answers import Answer, Claim, ClaimedParameter, Spot, TripEnergy
from proof.errors import ProofError
from proof.runs import sealed_worlds
from proof.scores import figures
from proof.scoring import Case
from proof.sealed import LABELS, WORLDS, open_labels, read_seal
from proof.tool import read

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from proof.figures import Figure
    from proof.runs import ProofOrder
    from proof.sealed import Seal

HELD_OUT_FILE: Final = "held_out.json"
PAGE_FILE: Final = "README.md"
PAGE: Final = """# Worlds with a concealed truth, for tools that explain recorded drives

`{worlds}/` has {count} folders. Each holds `vehicle.toml`, a car as its maker describes it, and recordings of its
drives: CSV, a sample a second or rarer, columns named with their units. Something may have been left out of the car's
description, or be wrong with it, or with the recordings; or nothing.

`{labels}/` has the truth, sealed with SHA-256 `{seal}`. A tool must not read it. Keep it elsewhere while the tool runs.

`{held_out}` names the trips of each world that must not be fitted: their energies are predicted.

## How to take part
Write one JSON file a world into a folder, `WORLD.json`, and run `joulepath prove --out THIS_FOLDER --score ANSWERS`.
A world without an answer counts as one on which the tool broke. All keys but `trips` may be left out.

```json
{{
 "verdict": "left_out_physics",
 "claims": [{{"effect": "cabin_heating", "family": "thermal", "rivals": [], "energy_kwh": 8.1, "low_kwh": 6.0,
             "high_kwh": 10.2, "share_frac": 0.12, "trips": []}}],
 "spots": [{{"axis": "speed", "low": 60.0, "high": 72.0, "mean_w": 900.0, "trips": []}}],
 "parameters": [{{"name": "mass_kg", "nameplate": 1600.0, "fitted": 1910.0, "aliases": []}}],
 "doubted": ["T004"], "other_car": false, "capacity_frac": [0.85, 0.82, 0.88],
 "trips": [{{"id": "T001", "held_out": true, "measured_kwh": 3.2, "nameplate_kwh": 2.9, "before_kwh": 3.0,
            "after_kwh": 3.1, "thermal_kwh": 0.4}}]
}}
```

Families: thermal, rolling, aerodynamic, wind, mass, grade, drivetrain, recuperation, battery, auxiliary. `rivals`:
families that the drives cannot tell from it. `spots`: what nothing explains, on speed [km/h], altitude [m], since_start
[min], soc [%], heading [°], place (`low` latitude, `high` longitude), or a single trip (axis `trip`). `doubted`: trips
whose temperature is in another unit. `other_car`: the file is of another vehicle. `capacity_frac`: what the battery
holds over what its file says, with its interval, where that is another.
`before_kwh`: predicted without anything left out; `after_kwh`: with it. Rules of scoring: docs/proof.md of joulepath.
"""


def export(order: ProofOrder, progress: Callable[[str, float], None]) -> Seal:
    """Make and seal the worlds of an order, and write a page on how another tool takes part; raises as `prove`."""
    seal = sealed_worlds(order, progress)
    held_out = {world: sorted(read(order.folder / WORLDS / world)[2]) for world in sorted(seal.worlds)}
    (order.folder / HELD_OUT_FILE).write_text(json.dumps(held_out, indent=1) + "\n", encoding="utf-8")
    page = PAGE.format(worlds=WORLDS, labels=LABELS, count=len(seal.worlds), seal=seal.sha256, held_out=HELD_OUT_FILE)
    (order.folder / PAGE_FILE).write_text(page, encoding="utf-8")
    return seal


def score(folder: Path, answers: Path) -> tuple[Figure, ...]:
    """The figures of a tool's answers to exported worlds.

    Raises ProofError where the folder holds no sealed worlds or an answer is not of the form, BrokenSealError where a
    label is not what was sealed.
    """
    seal = read_seal(folder)
    if seal is None:
        raise ProofError(f"--out is {str(folder)!r}, allowed: a folder that --export has filled")
    labels = open_labels(folder, seal.sha256)
    return figures(tuple(Case(label, given(world, answers / f"{world}.json")) for world, label in labels.items()))


def given(world: str, file: Path) -> Answer:
    """What another tool says of a world; raises ProofError naming file and key."""
    if not file.is_file():
        return Answer(world, "", "", error="no answer")
    try:
        sent: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        return Answer(
            world_id=world,
            tool=str(sent.get("tool", "")),
            verdict=str(sent.get("verdict", "")),
            claims=tuple(_claim(claim) for claim in sent.get("claims", ())),
            spots=tuple(
                Spot(str(s["axis"]), float(s["low"]), float(s["high"]), float(s.get("mean_w", 0.0)), _texts(s, "trips"))
                for s in sent.get("spots", ())
            ),
            parameters=tuple(
                ClaimedParameter(str(p["name"]), float(p["nameplate"]), float(p["fitted"]), _texts(p, "aliases"))
                for p in sent.get("parameters", ())
            ),
            trips=tuple(_trip(trip) for trip in sent["trips"]),
            rules=(),
            other_car=bool(sent.get("other_car", False)),
            doubted=_texts(sent, "doubted"),
            capacity_frac=_capacity_frac(sent),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ProofError(f"{file}: {type(error).__name__} {error}, allowed: an answer as {PAGE_FILE} has it") from error


def _claim(sent: Mapping[str, Any]) -> Claim:
    low, high = sent.get("low_kwh"), sent.get("high_kwh")
    return Claim(
        effect=str(sent.get("effect", sent["family"])),
        family=str(sent["family"]),
        rivals=_texts(sent, "rivals"),
        energy_kwh=float(sent["energy_kwh"]),
        low_kwh=None if low is None else float(low),
        high_kwh=None if high is None else float(high),
        share_frac=float(sent.get("share_frac", 0.0)),
        t=float(sent.get("t", 0.0)),
        trips=_texts(sent, "trips"),
    )


def _trip(sent: Mapping[str, Any]) -> TripEnergy:
    after = float(sent["after_kwh"])
    return TripEnergy(
        id=str(sent["id"]),
        held_out=bool(sent["held_out"]),
        duration_s=float(sent.get("duration_s", 1.0)),
        measured_kwh=float(sent["measured_kwh"]),
        nameplate_kwh=float(sent.get("nameplate_kwh", after)),
        before_kwh=float(sent.get("before_kwh", after)),
        after_kwh=after,
        thermal_kwh=float(sent.get("thermal_kwh", 0.0)),
    )


def _capacity_frac(sent: Mapping[str, Any]) -> tuple[float, float, float] | None:
    if sent.get("capacity_frac") is None:
        return None
    value, low, high = (float(number) for number in sent["capacity_frac"])
    return value, low, high


def _texts(sent: Mapping[str, Any], key: str) -> tuple[str, ...]:
    return tuple(str(text) for text in sent.get(key, ()))


__all__ = ["HELD_OUT_FILE", "PAGE_FILE", "export", "given", "score"]
