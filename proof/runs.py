"""A whole proof: worlds are made and sealed, the tool answers, and only then the labels are opened and scored."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.fit.selection import LEAST_TRIPS
from proof.answers import read_answer, read_rule, write_rule
from proof.errors import ProofError
from proof.hidden_columns import scored, split_answered, split_seeds
from proof.oracle import oracle, true_terms
from proof.plans import places
from proof.scheduling import workers
from proof.scores import compared, figures
from proof.scoring import Case
from proof.sealed import WORLDS, Seal, made_before, make_into, open_labels, read_seal, seal_all
from proof.source import OF_THE_TOOL, source_hash
from proof.tool import answered, read

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from proof.figures import Figure
    from proof.hidden_columns import HiddenProof
    from proof.plans import AnyOrder, PlannedWorld
    from proof.scheduling import ProofWorkers
    from proof.scores import Compared
    from proof.worlds.world import WorldLabel

    Progress = Callable[[str, float], None]

ANSWERS: Final = "answers"
ORACLE: Final = "oracle"
SPLITS: Final = "splits"
MAKING: Final = "making and sealing worlds"
ANSWERING: Final = "the tool answers"
TELLING: Final = "the oracle answers"
HIDING: Final = "real drives, columns hidden"


@dataclass(frozen=True, slots=True)
class ProofOrder:
    """What is to be proved: a plan by its name, from a seed, in a folder that may hold what an earlier run has left.

    recordings, vehicle: a folder of real drives with climate columns and the file of the car that drove them.
    processes: of this machine; scheduler: address of a running one instead. rules_every: simpler rules are asked on one
    world of so many.
    """

    name: str
    plan: tuple[AnyOrder, ...]
    seed: int
    folder: Path
    recordings: Path | None = None
    vehicle: Path | None = None
    processes: int = 2
    scheduler: str | None = None
    rules_every: int = 2


@dataclass(frozen=True, slots=True)
class Proof:
    """What was proved: figures, the comparison with simpler rules, and what both rest on.

    seal: SHA-256 over labels and seeds; tool: of the source that answered. unmade: orders that no drives could carry.
    """

    name: str
    seed: int
    seal: str
    tool: str
    worlds: int
    unmade: int
    compared_worlds: int
    figures: tuple[Figure, ...]
    compared: tuple[Compared, ...]
    hidden: HiddenProof | None
    seconds: float


def prove(order: ProofOrder, progress: Progress | None = None) -> Proof:
    """Carry a proof out; progress: called with the name of a stage and the share of it that is done.

    Raises ProofError without Dask or fastsim, or where the folder holds another proof; BrokenSealError where a label is
    not what was sealed.
    """
    began = time.perf_counter()
    report = progress or (lambda _stage, _done: None)
    tool = source_hash(OF_THE_TOOL)
    planned = places(order.plan, order.seed)
    before = _sealed_before(order.folder, planned)
    with workers(order.processes, order.scheduler) as spread:
        seal = before or _made_and_sealed(spread, planned, order.folder, report)
        if before is not None:
            open_labels(order.folder, before.sha256)  # not to be looked at, but to stop before hours are spent
        _answer_all(spread, seal, order, tool, report)
        labels = open_labels(order.folder, seal.sha256)
        cases = _cases(spread, labels, order.folder, tool, report)
        hidden = _hidden(spread, order, report)
    return Proof(
        name=order.name,
        seed=order.seed,
        seal=seal.sha256,
        tool=tool,
        worlds=len(cases),
        unmade=seal.unmade,
        compared_worlds=sum(bool(case.answer.rules) for case in cases),
        figures=figures(cases),
        compared=compared(cases),
        hidden=hidden,
        seconds=time.perf_counter() - began,
    )


def sealed_worlds(order: ProofOrder, report: Progress) -> Seal:
    """The worlds of an order, made and sealed where they are not there yet; raises as `prove`."""
    planned = places(order.plan, order.seed)
    before = _sealed_before(order.folder, planned)
    if before is not None:
        return before
    with workers(order.processes, order.scheduler) as spread:
        return _made_and_sealed(spread, planned, order.folder, report)


def plan_digest(planned: Sequence[PlannedWorld]) -> str:
    """SHA-256 of all that makes the worlds of a plan."""
    return hashlib.sha256("".join(place.digest() for place in planned).encode()).hexdigest()


def _sealed_before(folder: Path, planned: Sequence[PlannedWorld]) -> Seal | None:
    seal = read_seal(folder)
    if seal is not None and seal.plan != plan_digest(planned):
        raise ProofError(
            f"--out is {str(folder)!r}, where a proof of another plan or seed, or of other makers of worlds, is sealed,"
            " allowed: the same again, or another folder"
        )
    return seal


def _made_and_sealed(spread: ProofWorkers, planned: Sequence[PlannedWorld], folder: Path, report: Progress) -> Seal:
    there = made_before(folder)
    seeds = {there[place.digest()]: place for place in planned if place.digest() in there}
    missing = [place for place in planned if place.digest() not in there]
    unmade = 0
    report(MAKING, 0.0)
    try:
        for done, (k, world_id) in enumerate(spread.each(make_into, [(place, folder) for place in missing]), start=1):
            if world_id is None:
                unmade += 1
            else:
                seeds[world_id] = missing[k]
            report(MAKING, done / len(missing))
    except ModuleNotFoundError as error:
        raise ProofError(f"{error.name} is not installed: install joulepath with the extra `proof`") from error
    return seal_all(seeds, folder, plan_digest(planned), unmade)


def _answer_all(spread: ProofWorkers, seal: Seal, order: ProofOrder, tool: str, report: Progress) -> None:
    worlds = sorted(path.name for path in (order.folder / WORLDS).iterdir() if path.name in seal.worlds)
    calls = []
    for k, world_id in enumerate(worlds):
        file = order.folder / ANSWERS / f"{world_id}.json"
        if not (file.is_file() and read_answer(file).tool == tool):
            calls.append((order.folder / WORLDS / world_id, file, k % order.rules_every == 0))
    report(ANSWERING, 0.0)
    for done, _ in enumerate(spread.each(answered, calls), start=1):
        report(ANSWERING, done / len(calls))


def _cases(
    spread: ProofWorkers, labels: Mapping[str, WorldLabel], folder: Path, tool: str, report: Progress
) -> tuple[Case, ...]:
    """Every world with its answer, and with the oracle's where it has one."""
    answers = {world_id: read_answer(folder / ANSWERS / f"{world_id}.json") for world_id in labels}
    calls = []
    for world_id, label in labels.items():
        enough = len(answers[world_id].trips) - len(answers[world_id].held_out) >= LEAST_TRIPS
        if enough and true_terms(label.effects):
            calls.append((folder / WORLDS / world_id, tuple(label.effects), folder / ORACLE / f"{world_id}.json", tool))
    report(TELLING, 0.0)
    for done, _ in enumerate(spread.each(oracle_answered, calls), start=1):
        report(TELLING, done / len(calls))
    best = {file.stem: read_rule(file)[0] for _, _, file, _ in calls}
    return tuple(Case(label, answers[world_id], best.get(world_id)) for world_id, label in labels.items())


def oracle_answered(world: Path, effects: tuple[str, ...], file: Path, tool: str) -> str:
    """Let the oracle answer the world of a folder into a file; returns the world's id."""
    if not (file.is_file() and read_rule(file)[1] == tool):
        recordings, vehicle, held_out = read(world)
        write_rule(oracle(recordings, vehicle, held_out, true_terms(effects)), tool, file)
    return world.name


def _hidden(spread: ProofWorkers, order: ProofOrder, report: Progress) -> HiddenProof | None:
    if order.recordings is None or order.vehicle is None:
        return None
    seeds = split_seeds(order.seed)
    files = [order.folder / SPLITS / f"{seed}.json" for seed in seeds]
    calls = [(order.recordings, order.vehicle, seed, file) for seed, file in zip(seeds, files, strict=True)]
    report(HIDING, 0.0)
    for done, _ in enumerate(spread.each(split_answered, calls), start=1):
        report(HIDING, done / len(calls))
    return scored([read_answer(file) for file in files], seeds, order.recordings)
