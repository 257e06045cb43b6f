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
    told_of,
)
from proof.trip_sums import RIDGE_NAME, SUMS_NAME
from proof.worlds.world import WorldKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    from proof.answers import Answer

LEAST_MAPE_FRAC: Final = 1e-3
SIZES: Final = (0.02, 0.05, 0.12)
LEAST_FOR_ORACLE: Final = 0.045  # of the energy: what was ordered as 5 %
CALM: Final = ("no_height", "coarse", "wrong_file", "fahrenheit", "aged")  # in which nothing is left out either
TOLD: Final = {
    "switch": "a draw of 0.5 to 1.5 kW on some trips: named with its trips",
    "step": "tyres that were changed: named with its trips",
    "drift": "tyres that lose air from trip to trip: named with the later trips",
    "foreign": "a drive of another car: told",
    "fahrenheit": "temperatures in °F: doubted on those drives and no other",
    "wrong_file": "a file that is off by 10 to 25 %: told",
    "aged": "a battery that holds 8 to 25 % less: told, within 3 points of its interval",
}
NOTHING: Final = (WorldKind.NULL, WorldKind.NULL_WRONG_PARAMETERS)
OF_THE_LIBRARY: Final = (
    *NOTHING,
    WorldKind.SINGLE,
    WorldKind.SEVERAL,
    WorldKind.CONFOUNDED,
    WorldKind.CONFOUNDED_SEPARATED,
)


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
        *_field(cases),
        *_against_baselines(cases),
        *_other_makers(cases),
        share("all worlds", "the tool broke", (case.answer.error is not None for case in cases), Target(high=0.0)),
    )


def size_of(case: Case) -> float:
    """The ordered size that the largest effect of a world is nearest to [-]."""
    shares = [truth.energy_share for truth in case.label.effects.values()]
    return min(SIZES, key=lambda size: abs(size - max(shares)))


def _of(cases: Iterable[Case], *kinds: WorldKind) -> list[Case]:
    return [case for case in cases if case.label.kind in kinds]


def _of_nothing(cases: Sequence[Case]) -> tuple[Figure, ...]:
    null, wrong = _of(cases, WorldKind.NULL), _of(cases, WorldKind.NULL_WRONG_PARAMETERS)
    group = "nothing left out"
    target = Target(high=0.05)
    return (
        share(group, "a false finding", (claims_falsely(case.answer) for case in null), target),
        share(group, "a false finding, or something unexplained", (says_anything(case.answer) for case in null)),
        share(group, "wrong parameters: a false finding", (claims_falsely(case.answer) for case in wrong), target),
        share(
            group,
            "wrong parameters: a parameter error is told",
            (bool(case.answer.parameters) for case in wrong),
        ),
        share(
            group,
            "wrong parameters: told parameters that are off indeed",
            (parameter.name in case.label.parameter_changes for case in wrong for parameter in case.answer.parameters),
        ),
    )


def _recall(cases: Sequence[Case]) -> tuple[Figure, ...]:
    single, several = _of(cases, WorldKind.SINGLE), _of(cases, WorldKind.SEVERAL)
    targets = {0.05: Target(low=0.9), 0.12: Target(low=0.98)}
    found = []
    for size in SIZES:
        own = [case for case in single if size_of(case) == size]
        for text, names in (("named clearly", names_clearly), ("named or among rivals", names_at_all)):
            found.append(
                share("recall", f"one effect of {100.0 * size:.0f} %: {text}", _named(own, names), targets.get(size))
            )
    found.append(share("recall", "several of 5 %: each named clearly", _named(several, names_clearly)))
    found.append(share("recall", "several of 5 %: each named or among rivals", _named(several, names_at_all)))
    large = [case for case in single if size_of(case) >= SIZES[1]]
    for family in sorted({family for case in large for family in case.label.families}):
        own = [case for case in large if family in case.label.families]
        found.append(share("recall by family, 5 and 12 %", f"{family}: named clearly", _named(own, names_clearly)))
    for effect in sorted({effect for case in large for effect in case.label.effects}):
        own = [case for case in large if effect in case.label.effects]
        found.append(share("recall by effect, 5 and 12 %", f"`{effect}`: named clearly", _named(own, names_clearly)))
    return tuple(found)


def _named(cases: Iterable[Case], names: Callable[[Answer, str], bool]) -> list[bool]:
    return [names(case.answer, family) for case in cases for family in case.label.families]


def _false_families(cases: Sequence[Case]) -> tuple[Figure, ...]:
    group, target = "false families among findings", Target(high=0.05)
    known = _of(cases, *OF_THE_LIBRARY)
    acting = [case for case in known if case.label.effects]
    return (
        share(group, "all worlds but outside ones", _false(known), target),
        share(group, "worlds with an effect", _false(acting)),
        share(
            group,
            "worlds with an effect, findings without rivals",
            (
                is_false(claim, case.label.families)
                for case in acting
                for claim in case.answer.claims
                if is_clear(claim)
            ),
        ),
    )


def _false(cases: Iterable[Case]) -> list[bool]:
    return [is_false(claim, case.label.families) for case in cases for claim in case.answer.claims]


def _confounded(cases: Sequence[Case]) -> tuple[Figure, ...]:
    open_, separated = _of(cases, WorldKind.CONFOUNDED), _of(cases, WorldKind.CONFOUNDED_SEPARATED)
    target = Target(low=0.9)
    clear = (all(names_clearly(case.answer, family) for family in case.label.families) for case in open_)
    return (
        share(
            "confounded", "says that it cannot tell", (cannot_tell(case.answer, case.label) for case in open_), target
        ),
        share("confounded", "names the true one clearly", clear),
        share("confounded", "names a wrong one clearly", (clearly_wrong(case.answer, case.label) for case in open_)),
        share(
            "confounded",
            "resolves it with the separating recording",
            (resolves(case.answer, case.label) for case in separated),
            target,
        ),
    )


def _outside(cases: Sequence[Case]) -> tuple[Figure, ...]:
    outside = _of(cases, WorldKind.OUTSIDE)
    located = [case.label.outside is not None and locates(case.answer, case.label.outside) for case in outside]
    group = "outside the library"
    return (
        share(group, "flagged", (bool(case.answer.spots) for case in outside), Target(low=0.9)),
        share(group, "located", located, Target(low=0.8)),
        share(group, "misattributed", (misattributes(case.answer) for case in outside), Target(high=0.05)),
    )


def _energies(cases: Sequence[Case]) -> tuple[Figure, ...]:
    rows = _mean_squares(cases, lambda case: _energies_of(case, "after_kwh"))
    group = "energy of held-out trips, 5 % and more"
    cover = [hit for case in cases for hit in intervals_cover(case.answer, case.label)]
    return (
        drawn(group, f"RMS over the oracle's, {rows.shape[0]} worlds", rows[:, [0, 2]], rms_ratio, Target(high=1.1)),
        drawn(
            group,
            "RMS over the oracle's, median world",
            rows[:, [0, 2]],
            lambda chosen: float(np.median(np.sqrt(chosen[:, 0] / chosen[:, 1]))),
        ),
        drawn(group, "gap from base to oracle closed", rows, gap_closed, Target(low=0.8), is_share=True),
        share("intervals", "95 % intervals hold the true energy", cover, Target(0.93, 0.97)),
    )


def _mean_squares(cases: Sequence[Case], predicted: Callable[[Case], Sequence[float]]) -> NDArray[np.float64]:
    """Mean square errors of a prediction, of the base refitted, and of the oracle: float64 (worlds, 3)."""
    rows = [
        (
            mean_square(case.answer, predicted(case)),
            mean_square(case.answer, _energies_of(case, "before_kwh")),
            mean_square(case.answer, case.oracle.held_out_kwh),
        )
        for case in _of(cases, WorldKind.SINGLE, WorldKind.SEVERAL)
        if case.oracle is not None
        and case.answer.held_out
        and max(truth.energy_share for truth in case.label.effects.values()) >= LEAST_FOR_ORACLE
    ]
    return np.array(rows, np.float64).reshape(-1, 3)


def _few(cases: Sequence[Case]) -> tuple[Figure, ...]:
    few = _of(cases, WorldKind.FEW_TRIPS)
    return (
        share("few trips", "says too few, concludes nothing", (says_too_few(case.answer) for case in few)),
        share("few trips", "a false finding", (clearly_wrong(case.answer, case.label) for case in few)),
    )


def _field(cases: Sequence[Case]) -> tuple[Figure, ...]:
    """Worlds with what the field has, and false findings and parameters of all worlds in which nothing is left out."""
    group = "the field"
    faults = _of(cases, WorldKind.FAULT)
    calm = [
        case
        for case in (*_of(cases, *NOTHING), *faults)
        if not case.label.effects and (case.label.fault is None or case.label.fault.kind in CALM)
    ]
    heated = [case for case in faults if case.label.effects]
    young = [case for case in cases if case.label.fault is None or case.label.fault.kind != "aged"]
    return (
        share(
            group,
            "nothing left out, whatever the channels and the file: a false finding or parameter",
            (_is_false_anywhere(case) for case in calm),
            Target(high=0.05),
        ),
        *(
            share(
                group,
                text,
                (
                    told_of(case.answer, case.label)
                    for case in faults
                    if case.label.fault and case.label.fault.kind == kind
                ),
                Target(low=0.9),
            )
            for kind, text in TOLD.items()
        ),
        share(
            group,
            "no aged battery, all worlds: a capacity is told",
            (case.answer.capacity_frac is not None for case in young),
            Target(high=0.05),
        ),
        share(group, "no height, cabin heated, 12 %: thermal named clearly", _named(heated, names_clearly)),
        share(group, "no height, cabin heated, 12 %: named or among rivals", _named(heated, names_at_all)),
    )


def _against_baselines(cases: Sequence[Case]) -> tuple[Figure, ...]:
    """Held-out error by the best of the refitted base, the ridge and the regression on trip sums, world by world."""
    ratios = np.array(
        [
            [mape_frac(case.answer, _energies_of(case, "after_kwh")) / max(_best_baseline(case), LEAST_MAPE_FRAC)]
            for case in cases
            if case.answer.rules and case.answer.held_out and case.label.kind is not WorldKind.FEW_TRIPS
        ]
    ).reshape(-1, 1)
    errors = np.array([_errors_of(case) for case in cases if case.answer.rules and case.label.effects]).reshape(-1, 4)
    group = "held-out error against the best of refit, ridge and regression on trip sums"
    return (
        drawn(
            group,
            "worlds with an effect: mean error by that of the best baseline",
            errors,
            lambda rows: float(rows[:, 0].mean() / rows[:, 1:].mean(axis=0).min()),
            Target(high=0.9),
        ),
        drawn(
            group,
            "best baseline of each world, chosen on its held-out trips: mean ratio",
            ratios,
            lambda rows: float(rows.mean()),
            Target(high=0.9),
        ),
        share(
            group,
            "the same: worlds in which it is more than 1.05 times as large",
            ratios[:, 0] > 1.05,
            Target(high=0.02),
        ),
    )


def _best_baseline(case: Case) -> float:
    return min(_errors_of(case)[1:])


def _errors_of(case: Case) -> tuple[float, float, float, float]:
    """Mean errors of held-out trips by the tool, the base refitted, the ridge and the sums; NaN where not asked."""
    rules = {rule.name: mape_frac(case.answer, rule.held_out_kwh) for rule in case.answer.rules}
    before, after = (mape_frac(case.answer, _energies_of(case, which)) for which in ("before_kwh", "after_kwh"))
    return after, before, rules.get(RIDGE_NAME, before), rules.get(SUMS_NAME, before)


def _is_false_anywhere(case: Case) -> bool:
    """Whether there is a finding, a parameter or a capacity that is not off, or the tool broke."""
    wrong = any(
        not {parameter.name, *parameter.aliases} & set(case.label.parameter_changes)
        for parameter in case.answer.parameters
    )
    aged = case.label.fault is not None and case.label.fault.kind == "aged"
    return claims_falsely(case.answer) or wrong or (case.answer.capacity_frac is not None and not aged)


def _other_makers(cases: Sequence[Case]) -> tuple[Figure, ...]:
    other = [case for case in _of(cases, WorldKind.FASTSIM) if case.answer.error is None]
    climate, calm = ([case for case in other if bool(case.label.effects) is with_it] for with_it in (True, False))
    rows = np.array(
        [
            (
                mape_frac(case.answer, _energies_of(case, "before_kwh")),
                mape_frac(case.answer, _energies_of(case, "after_kwh")),
            )
            for case in climate
        ]
    ).reshape(-1, 2)
    carried = [case for case in _of(cases, WorldKind.CARRIER) if case.label.effects]
    group = "worlds driven by fastsim"
    return (
        share(group, "climate: thermal named clearly", _named(climate, names_clearly)),
        share(
            group, "climate: another family named clearly", (clearly_wrong(case.answer, case.label) for case in climate)
        ),
        drawn(
            group, "climate: mean error of held-out trips, before", rows, lambda r: float(r[:, 0].mean()), is_share=True
        ),
        drawn(
            group, "climate: mean error of held-out trips, after", rows, lambda r: float(r[:, 1].mean()), is_share=True
        ),
        share(group, "no climate: a false finding", (claims_falsely(case.answer) for case in calm)),
        share("real drives as carriers", "added effect of 5 %: named clearly", _named(carried, names_clearly)),
        share("real drives as carriers", "added effect of 5 %: named or among rivals", _named(carried, names_at_all)),
    )


def compared(cases: Sequence[Case]) -> tuple[Compared, ...]:
    """The simpler rules, the tool and the oracle on the worlds on which all were asked."""
    asked = [case for case in cases if case.answer.rules]
    names = [rule.name for rule in asked[0].answer.rules] if asked else []
    return (
        _line("base as in the vehicle's file", asked, _nothing, lambda case: _energies_of(case, "nameplate_kwh")),
        _line("base refitted", asked, _nothing, lambda case: _energies_of(case, "before_kwh")),
        *(_line(name, asked, _families_of(k), _predicted_by(k)) for k, name in enumerate(names)),
        _line("joulepath", asked, _clear_families, lambda case: _energies_of(case, "after_kwh")),
        _line(ORACLE, asked, None, lambda case: () if case.oracle is None else case.oracle.held_out_kwh),
    )


def _nothing(case: Case) -> Sequence[str]:
    del case
    return ()


def _clear_families(case: Case) -> Sequence[str]:
    return sorted({claim.family for claim in case.answer.claims if is_clear(claim)})


def _families_of(k: int) -> Callable[[Case], Sequence[str]]:
    return lambda case: case.answer.rules[k].families


def _predicted_by(k: int) -> Callable[[Case], Sequence[float]]:
    return lambda case: case.answer.rules[k].held_out_kwh


def _energies_of(case: Case, field: str) -> Sequence[float]:
    return [getattr(trip, field) for trip in case.answer.held_out]


def _line(
    rule: str,
    cases: Sequence[Case],
    claimed: Callable[[Case], Sequence[str]] | None,
    predicted: Callable[[Case], Sequence[float]],
) -> Compared:
    """One rule; claimed: None for a rule that is given what acts."""
    ratio = drawn(rule, "RMS over the oracle's", _mean_squares(cases, predicted)[:, [0, 2]], rms_ratio)
    alarms: list[bool] = []
    named: list[bool] = []
    false: list[bool] = []
    if claimed is not None:
        alarms = [bool(claimed(case)) for case in _of(cases, *NOTHING)]
        single = [case for case in _of(cases, WorldKind.SINGLE) if size_of(case) == SIZES[1]]
        named = [family in claimed(case) for case in single for family in case.label.families]
        known = _of(cases, *OF_THE_LIBRARY)
        false = [family not in case.label.families for case in known for family in claimed(case)]
    return Compared(
        rule,
        share(rule, "null worlds with a claim", alarms),
        share(rule, "recall at 5 %", named),
        share(rule, "false families", false),
        ratio,
    )
