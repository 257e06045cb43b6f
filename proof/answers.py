"""What the tool says of a world, as it is laid on disk before any label is opened."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from diagnosis.answer.results import CapacityKind
from diagnosis.fit.scan import cell_centre_deg
from diagnosis.recordings.notes import NoteKind

if TYPE_CHECKING:
    from pathlib import Path

    from diagnosis.answer.results import CapacityEstimate, Diagnosis, Finding, TripAccount, Unexplained


@dataclass(frozen=True, slots=True)
class Claim:
    """A finding: effect, family, families of its rivals, energy over the fitted trips with interval and share.

    trips: that carry it, empty where all do.
    """

    effect: str
    family: str
    rivals: tuple[str, ...]
    energy_kwh: float
    low_kwh: float | None
    high_kwh: float | None
    share_frac: float
    t: float
    trips: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Spot:
    """Unexplained structure: its interval on an axis, or for a place latitude (low) and longitude (high) [°]."""

    axis: str
    low: float
    high: float
    mean_w: float
    trips: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ClaimedParameter:
    """A parameter that is said to be wrong: value of the file and the fitted one, and what it may be instead."""

    name: str
    nameplate: float
    fitted: float
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class TripEnergy:
    """One trip's energies [kWh], as in diagnosis.answer.results.TripAccount."""

    id: str
    held_out: bool
    duration_s: float
    measured_kwh: float
    nameplate_kwh: float
    before_kwh: float
    after_kwh: float
    thermal_kwh: float


@dataclass(frozen=True, slots=True)
class Rule:
    """What a simpler rule says: families that it claims, and energies of the held-out trips in their order [kWh]."""

    name: str
    families: tuple[str, ...]
    held_out_kwh: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Answer:
    """Everything that is scored of a world. error: how the tool broke, None where it did not; all else is then empty.

    capacity_frac: of the battery, over that of the file, with its interval, where it is said to be another.
    tool: hash of the source that answered. other_car: whether the file is said to be of another vehicle. doubted: trips
    of which the unit of a channel is doubted. rules: of simpler rules, where they were asked.
    """

    world_id: str
    tool: str
    verdict: str
    claims: tuple[Claim, ...] = ()
    spots: tuple[Spot, ...] = ()
    parameters: tuple[ClaimedParameter, ...] = ()
    trips: tuple[TripEnergy, ...] = ()
    rules: tuple[Rule, ...] = ()
    threshold_z: float | None = None
    seconds: float = 0.0
    error: str | None = field(default=None)
    other_car: bool = False
    doubted: tuple[str, ...] = ()
    capacity_frac: tuple[float, float, float] | None = None

    @property
    def held_out(self) -> tuple[TripEnergy, ...]:
        """The trips that were not fitted."""
        return tuple(trip for trip in self.trips if trip.held_out)


def answer_of(world_id: str, tool: str, diagnosis: Diagnosis, rules: tuple[Rule, ...], seconds: float) -> Answer:
    """A diagnosis as far as it is scored."""
    return Answer(
        world_id=world_id,
        tool=tool,
        verdict=diagnosis.verdict.value,
        claims=tuple(_claim(finding) for finding in diagnosis.findings),
        spots=tuple(_spot(stretch) for stretch in diagnosis.unexplained),
        parameters=tuple(
            ClaimedParameter(error.parameter, error.nameplate, error.fitted, error.aliases)
            for error in diagnosis.parameter_errors
        ),
        trips=tuple(trip_energy(trip) for trip in diagnosis.trips),
        rules=rules,
        threshold_z=diagnosis.model.get("threshold_z"),
        seconds=seconds,
        other_car=diagnosis.other_car,
        doubted=tuple(sorted({note.trip_id for note in diagnosis.data_quality if note.kind == NoteKind.UNIT.value})),
        capacity_frac=_capacity_frac(diagnosis.capacity),
    )


def trip_energy(account: TripAccount) -> TripEnergy:
    """One trip's account as far as it is scored."""
    return TripEnergy(
        id=account.id,
        held_out=account.held_out,
        duration_s=account.duration_s,
        measured_kwh=account.measured_kwh,
        nameplate_kwh=account.nameplate_kwh,
        before_kwh=account.before_kwh,
        after_kwh=account.after_kwh,
        thermal_kwh=account.predicted_by_family_kwh.get("thermal", 0.0),
    )


def write_answer(answer: Answer, file: Path) -> None:
    """Write an answer whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_text(json.dumps(asdict(answer), indent=1) + "\n", encoding="utf-8")
    part.replace(file)


def read_answer(file: Path) -> Answer:
    """An answer as it was written."""
    read: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    read["claims"] = tuple(
        Claim(**{**claim, "rivals": tuple(claim["rivals"]), "trips": tuple(claim["trips"])}) for claim in read["claims"]
    )
    read["spots"] = tuple(Spot(**{**spot, "trips": tuple(spot["trips"])}) for spot in read["spots"])
    read["doubted"] = tuple(read["doubted"])
    read["capacity_frac"] = None if read["capacity_frac"] is None else tuple(read["capacity_frac"])
    read["parameters"] = tuple(
        ClaimedParameter(**{**parameter, "aliases": tuple(parameter["aliases"])}) for parameter in read["parameters"]
    )
    read["trips"] = tuple(TripEnergy(**trip) for trip in read["trips"])
    read["rules"] = tuple(
        Rule(rule["name"], tuple(rule["families"]), tuple(rule["held_out_kwh"])) for rule in read["rules"]
    )
    return Answer(**read)


def write_rule(rule: Rule, tool: str, file: Path) -> None:
    """Write what a rule said, and the hash of the source that said it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_text(json.dumps({**asdict(rule), "tool": tool}) + "\n", encoding="utf-8")
    part.replace(file)


def read_rule(file: Path) -> tuple[Rule, str]:
    """What a rule said, and the hash of the source that said it."""
    read: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return Rule(read["name"], tuple(read["families"]), tuple(read["held_out_kwh"])), read["tool"]


def _claim(finding: Finding) -> Claim:
    low, high = finding.energy_kwh_ci95 or (None, None)
    return Claim(
        effect=finding.effect,
        family=finding.family.value,
        rivals=tuple(sorted({rival.family.value for rival in finding.ambiguous_with})),
        energy_kwh=finding.energy_kwh,
        low_kwh=low,
        high_kwh=high,
        share_frac=finding.energy_share_frac,
        t=finding.t,
        trips=finding.trips,
    )


def _capacity_frac(capacity: CapacityEstimate | None) -> tuple[float, float, float] | None:
    if capacity is None or capacity.kind not in (CapacityKind.LESS, CapacityKind.MORE):
        return None
    low_wh, high_wh = capacity.ci95_wh
    return capacity.value_wh / capacity.file_wh, low_wh / capacity.file_wh, high_wh / capacity.file_wh


def _spot(unexplained: Unexplained) -> Spot:
    low, high = (
        cell_centre_deg(int(unexplained.low)) if unexplained.axis == "place" else (unexplained.low, unexplained.high)
    )
    return Spot(unexplained.axis, low, high, unexplained.mean_w, unexplained.trips)
