"""The table of a proof: every figure of DIAGNOSIS from the cases, and the simpler rules beside the tool."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from proof.figures import Figure, Target, drawn, gap_closed, rms_ratio, share
from proof.oracle import ORACLE
from proof.scoring import (
    Case,
    cannot_tell,
    claims_falsely,
    clearly_wrong,
    intervals_cover,
    is_clear,
    is_false,
    locates,
    mape_frac,
    mean_square,
    misattributes,
    names_at_all,
    names_clearly,
    resolves,
    says_anything,
    says_too_few,
)
from proof.worlds.world import Kind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from proof.answers import Answer

SIZES: Final = (0.02, 0.05, 0.12)
LEAST_FOR_ORACLE: Final = 0.045  # of the energy: what was ordered as 5 %
NOTHING: Final = (Kind.NULL, Kind.NULL_WRONG_PARAMETERS)
OF_THE_LIBRARY: Final = (*NOTHING, Kind.SINGLE, Kind.SEVERAL, Kind.CONFOUNDED, Kind.CONFOUNDED_SEPARATED)


@dataclass(frozen=True, slots=True)
class Compared:
    """One line of the comparison: a rule's figures on the worlds that all rules were asked on."""

    rule: str
    null_alarms: Figure
    recall: Figure
    false_families: Figure
    rms_ratio: Figure


def figures(cases: Sequence[Case]) -> tuple[Figure, ...]:
    """All figures of the made-up worlds, in the order of the table."""
    return (
        *_of_nothing(cases),
        *_recall(cases),
        *_false_families(cases),
        *_confounded(cases),
        *_outside(cases),
        *_energies(cases),
        *_few(cases),
        *_other_makers(cases),
        share("all worlds", "the tool broke", (one.answer.error is not None for one in cases), Target(high=0.0)),
    )


def size_of(case: Case) -> float:
    """The ordered size that the largest effect of a world is nearest to [-]."""
    shares = [one.energy_share for one in case.label.effects.values()]
    return min(SIZES, key=lambda size: abs(size - max(shares)))


def _of(cases: Iterable[Case], *kinds: Kind) -> list[Case]:
    return [one for one in cases if one.label.kind in kinds]


def _of_nothing(cases: Sequence[Case]) -> tuple[Figure, ...]:
    null, wrong = _of(cases, Kind.NULL), _of(cases, Kind.NULL_WRONG_PARAMETERS)
    group = "nothing left out"
    target = Target(high=0.05)
    return (
        share(group, "a false finding", (claims_falsely(one.answer) for one in null), target),
        share(group, "a false finding, or something unexplained", (says_anything(one.answer) for one in null)),
        share(group, "wrong parameters: a false finding", (claims_falsely(one.answer) for one in wrong), target),
        share(
            group,
            "wrong parameters: a parameter error is told",
            (bool(one.answer.parameters) for one in wrong),
        ),
        share(
            group,
            "wrong parameters: told parameters that are off indeed",
            (each.name in one.label.parameter_changes for one in wrong for each in one.answer.parameters),
        ),
    )


def _recall(cases: Sequence[Case]) -> tuple[Figure, ...]:
    single, several = _of(cases, Kind.SINGLE), _of(cases, Kind.SEVERAL)
    targets = {0.05: Target(low=0.95), 0.12: Target(low=1.0)}
    found = []
    for size in SIZES:
        own = [one for one in single if size_of(one) == size]
        for text, names in (("named clearly", names_clearly), ("named or among rivals", names_at_all)):
            found.append(
                share("recall", f"one effect of {100.0 * size:.0f} %: {text}", _named(own, names), targets.get(size))
            )
    found.append(share("recall", "several of 5 %: each named clearly", _named(several, names_clearly)))
    found.append(share("recall", "several of 5 %: each named or among rivals", _named(several, names_at_all)))
    large = [one for one in single if size_of(one) >= SIZES[1]]
    for family in sorted({one for case in large for one in case.label.families}):
        own = [one for one in large if family in one.label.families]
        found.append(share("recall by family, 5 and 12 %", f"{family}: named clearly", _named(own, names_clearly)))
    for effect in sorted({one for case in large for one in case.label.effects}):
        own = [one for one in large if effect in one.label.effects]
        found.append(share("recall by effect, 5 and 12 %", f"`{effect}`: named clearly", _named(own, names_clearly)))
    return tuple(found)


def _named(cases: Iterable[Case], names: Callable[[Answer, str], bool]) -> list[bool]:
    return [names(one.answer, family) for one in cases for family in one.label.families]


def _false_families(cases: Sequence[Case]) -> tuple[Figure, ...]:
    group, target = "false families among findings", Target(high=0.05)
    known = _of(cases, *OF_THE_LIBRARY)
    acting = [one for one in known if one.label.effects]
    return (
        share(group, "all worlds but outside ones", _false(known), target),
        share(group, "worlds with an effect", _false(acting)),
        share(
            group,
            "worlds with an effect, findings without rivals",
            (is_false(claim, one.label.families) for one in acting for claim in one.answer.claims if is_clear(claim)),
        ),
    )


def _false(cases: Iterable[Case]) -> list[bool]:
    return [is_false(claim, one.label.families) for one in cases for claim in one.answer.claims]


def _confounded(cases: Sequence[Case]) -> tuple[Figure, ...]:
    open_, separated = _of(cases, Kind.CONFOUNDED), _of(cases, Kind.CONFOUNDED_SEPARATED)
    target = Target(low=0.9)
    clear = (all(names_clearly(one.answer, family) for family in one.label.families) for one in open_)
    return (
        share("confounded", "says that it cannot tell", (cannot_tell(one.answer, one.label) for one in open_), target),
        share("confounded", "names the true one clearly", clear),
        share("confounded", "names a wrong one clearly", (clearly_wrong(one.answer, one.label) for one in open_)),
        share(
            "confounded",
            "resolves it with the separating recording",
            (resolves(one.answer, one.label) for one in separated),
            target,
        ),
    )


def _outside(cases: Sequence[Case]) -> tuple[Figure, ...]:
    outside = _of(cases, Kind.OUTSIDE)
    located = [one.label.outside is not None and locates(one.answer, one.label.outside) for one in outside]
    group = "outside the library"
    return (
        share(group, "flagged", (bool(one.answer.spots) for one in outside), Target(low=0.85)),
        share(group, "located", located, Target(low=0.8)),
        share(group, "misattributed", (misattributes(one.answer) for one in outside), Target(high=0.1)),
    )


def _energies(cases: Sequence[Case]) -> tuple[Figure, ...]:
    rows = _mean_squares(cases, lambda one: _energies_of(one, "after_kwh"))
    group = "energy of held-out trips, 5 % and more"
    cover = [hit for one in cases for hit in intervals_cover(one.answer, one.label)]
    return (
        drawn(group, f"RMS over the oracle's, {rows.shape[0]} worlds", rows[:, [0, 2]], rms_ratio, Target(high=1.1)),
        drawn(
            group,
            "RMS over the oracle's, median world",
            rows[:, [0, 2]],
            lambda chosen: float(np.median(np.sqrt(chosen[:, 0] / chosen[:, 1]))),
        ),
        drawn(group, "gap from base to oracle closed", rows, gap_closed, Target(low=0.8), is_share=True),
        share("intervals", "95 % intervals hold the true energy", cover, Target(0.9, 0.98)),
    )


def _mean_squares(cases: Sequence[Case], predicted: Callable[[Case], Sequence[float]]) -> NDArray[np.float64]:
    """Mean square errors of a prediction, of the base refitted, and of the oracle: float64 (worlds, 3)."""
    rows = [
        (
            mean_square(one.answer, predicted(one)),
            mean_square(one.answer, _energies_of(one, "before_kwh")),
            mean_square(one.answer, one.oracle.held_out_kwh),
        )
        for one in _of(cases, Kind.SINGLE, Kind.SEVERAL)
        if one.oracle is not None
        and one.answer.held_out
        and max(each.energy_share for each in one.label.effects.values()) >= LEAST_FOR_ORACLE
    ]
    return np.array(rows, np.float64).reshape(-1, 3)


def _few(cases: Sequence[Case]) -> tuple[Figure, ...]:
    few = _of(cases, Kind.FEW_TRIPS)
    return (
        share("few trips", "says too few, concludes nothing", (says_too_few(one.answer) for one in few)),
        share("few trips", "a false finding", (clearly_wrong(one.answer, one.label) for one in few)),
    )


def _other_makers(cases: Sequence[Case]) -> tuple[Figure, ...]:
    other = [one for one in _of(cases, Kind.FASTSIM) if one.answer.error is None]
    climate, calm = ([one for one in other if bool(one.label.effects) is with_it] for with_it in (True, False))
    rows = np.array(
        [
            (
                mape_frac(one.answer, _energies_of(one, "before_kwh")),
                mape_frac(one.answer, _energies_of(one, "after_kwh")),
            )
            for one in climate
        ]
    ).reshape(-1, 2)
    carried = [one for one in _of(cases, Kind.CARRIER) if one.label.effects]
    group = "worlds driven by fastsim"
    return (
        share(group, "climate: thermal named clearly", _named(climate, names_clearly)),
        share(
            group, "climate: another family named clearly", (clearly_wrong(one.answer, one.label) for one in climate)
        ),
        drawn(
            group, "climate: mean error of held-out trips, before", rows, lambda r: float(r[:, 0].mean()), is_share=True
        ),
        drawn(
            group, "climate: mean error of held-out trips, after", rows, lambda r: float(r[:, 1].mean()), is_share=True
        ),
        share(group, "no climate: a false finding", (claims_falsely(one.answer) for one in calm)),
        share("real drives as carriers", "added effect of 5 %: named clearly", _named(carried, names_clearly)),
        share("real drives as carriers", "added effect of 5 %: named or among rivals", _named(carried, names_at_all)),
    )


def compared(cases: Sequence[Case]) -> tuple[Compared, ...]:
    """The simpler rules, the tool and the oracle on the worlds on which all were asked."""
    asked = [one for one in cases if one.answer.rules]
    names = [rule.name for rule in asked[0].answer.rules] if asked else []
    return (
        _line("base as in the vehicle's file", asked, _nothing, lambda one: _energies_of(one, "nameplate_kwh")),
        _line("base refitted", asked, _nothing, lambda one: _energies_of(one, "before_kwh")),
        *(_line(name, asked, _families_of(k), _predicted_by(k)) for k, name in enumerate(names)),
        _line("joulepath", asked, _clear_families, lambda one: _energies_of(one, "after_kwh")),
        _line(ORACLE, asked, None, lambda one: () if one.oracle is None else one.oracle.held_out_kwh),
    )


def _nothing(case: Case) -> Sequence[str]:
    del case
    return ()


def _clear_families(case: Case) -> Sequence[str]:
    return sorted({claim.family for claim in case.answer.claims if is_clear(claim)})


def _families_of(k: int) -> Callable[[Case], Sequence[str]]:
    return lambda one: one.answer.rules[k].families


def _predicted_by(k: int) -> Callable[[Case], Sequence[float]]:
    return lambda one: one.answer.rules[k].held_out_kwh


def _energies_of(case: Case, field: str) -> Sequence[float]:
    return [getattr(trip, field) for trip in case.answer.held_out]


def _line(
    rule: str,
    cases: Sequence[Case],
    claimed: Callable[[Case], Sequence[str]] | None,
    predicted: Callable[[Case], Sequence[float]],
) -> Compared:
    """One rule; claimed: None for one that is told what acts."""
    ratio = drawn(rule, "RMS over the oracle's", _mean_squares(cases, predicted)[:, [0, 2]], rms_ratio)
    alarms: list[bool] = []
    named: list[bool] = []
    false: list[bool] = []
    if claimed is not None:
        alarms = [bool(claimed(one)) for one in _of(cases, *NOTHING)]
        single = [one for one in _of(cases, Kind.SINGLE) if size_of(one) == SIZES[1]]
        named = [family in claimed(one) for one in single for family in one.label.families]
        known = _of(cases, *OF_THE_LIBRARY)
        false = [family not in one.label.families for one in known for family in claimed(one)]
    return Compared(
        rule,
        share(rule, "null worlds with a claim", alarms),
        share(rule, "recall at 5 %", named),
        share(rule, "false families", false),
        ratio,
    )
