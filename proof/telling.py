"""A proof as text: lines of its table, Markdown, and JSON."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final

from diagnosis.comparison.tables import markdown_table

if TYPE_CHECKING:
    from pathlib import Path

    from proof.figures import Figure, Target
    from proof.hidden_columns import HiddenProof, HiddenTrip
    from proof.runs import Proof
    from proof.scores import Compared

HEADER: Final = ("figure", "result", "of", "95 % interval", "target", "")
COMPARED_HEADER: Final = (
    "rule",
    "null worlds with a claim",
    "recall at 5 %",
    "false families",
    "RMS over the oracle's",
)
HIDDEN_HEADER: Final = (
    "trip", "held out", "error before", "error after", "thermal claimed [W]", "claimed held out [W]", "hidden [W]", "",
)  # fmt: skip
MET: Final = "met"
MISSED: Final = "MISSED"
NONE: Final = "–"
JSON_FILE: Final = "proof.json"
MARKDOWN_FILE: Final = "proof.md"


def figure_row(figure: Figure) -> tuple[str, ...]:
    """One line of the table by HEADER."""
    counts = "" if figure.trials is None else f"{figure.successes}/{figure.trials}"
    interval = NONE
    if figure.low is not None and figure.high is not None:
        interval = f"{_number(figure, figure.low)} .. {_number(figure, figure.high)}"
    value = NONE if figure.value is None else _number(figure, figure.value)
    return (figure.name, value, counts, interval, target_text(figure), met_text(figure))


def target_text(figure: Figure) -> str:
    """A target as a reader knows it; empty without one."""
    target = figure.target
    if target is None:
        return ""
    if target.low is not None and target.high is not None:
        return f"{_number(figure, target.low)} .. {_number(figure, target.high)}"
    if target.low is not None:
        return f"≥ {_number(figure, target.low)}"
    return "" if target.high is None else f"≤ {_number(figure, target.high)}"


def met_text(figure: Figure) -> str:
    """Whether a target is met; empty where there is nothing to say."""
    return "" if figure.met is None else MET if figure.met else MISSED


def compared_row(line: Compared) -> tuple[str, ...]:
    """One line of the comparison by COMPARED_HEADER."""
    return (
        line.rule,
        _share(line.null_alarms),
        _share(line.recall),
        _share(line.false_families),
        NONE if line.rms_ratio.value is None else f"{line.rms_ratio.value:.2f}",
    )


def hidden_row(trip: HiddenTrip) -> tuple[str, ...]:
    """One real drive by HIDDEN_HEADER."""
    return (
        trip.id,
        str(trip.held_out),
        *(NONE if value is None else f"{value:.1%}" for value in (trip.before_frac, trip.after_frac)),
        *(
            NONE if value is None else f"{value:.0f}"
            for value in (trip.claimed_w, trip.claimed_held_out_w, trip.hidden_w)
        ),
        trip.why,
    )


def summary(proof: Proof) -> str:
    """What the tables rest on, in a few sentences."""
    unmade = f" {proof.unmade} orders could not be made, as no drives carried them." if proof.unmade else ""
    missed = sum(figure.met is False for figure in every_figure(proof))
    targets = sum(figure.met is not None for figure in every_figure(proof))
    return (
        f"Plan {proof.name}, seed {proof.seed}: {proof.worlds} worlds in {proof.seconds / 60.0:.0f} min.{unmade}"
        f" {targets - missed} of {targets} targets met. Seal {proof.seal[:16]}…, tool {proof.tool[:16]}…."
    )


def every_figure(proof: Proof) -> tuple[Figure, ...]:
    """The figures of made-up worlds and those of real drives, without groups that this proof has nothing on."""
    found = proof.figures + (() if proof.hidden is None else proof.hidden.figures)
    known = {figure.group for figure in found if figure.value is not None}
    return tuple(figure for figure in found if figure.group in known)


def markdown(proof: Proof) -> str:
    """The proof as a section of Markdown without a heading."""
    parts = [summary(proof)]
    for group in dict.fromkeys(figure.group for figure in every_figure(proof)):
        rows = [figure_row(figure) for figure in every_figure(proof) if figure.group == group]
        parts += [f"### {group[0].upper()}{group[1:]}", markdown_table(HEADER, rows)]
    parts += [
        "### Simpler rules",
        f"On {proof.compared_worlds} of the worlds; of the tool, only findings without rivals count as claims here.",
        markdown_table(COMPARED_HEADER, [compared_row(line) for line in proof.compared]),
    ]
    if proof.hidden is not None:
        parts += ["### Real drives, trip by trip", _splits(proof.hidden)]
        parts.append(markdown_table(HIDDEN_HEADER, [hidden_row(trip) for trip in proof.hidden.trips]))
    return "\n\n".join(parts) + "\n"


def as_json(proof: Proof) -> dict[str, Any]:
    """The object of proof.json."""
    hidden = proof.hidden
    return {
        "plan": proof.name,
        "seed": proof.seed,
        "seal": proof.seal,
        "tool": proof.tool,
        "worlds": proof.worlds,
        "unmade": proof.unmade,
        "seconds": round(proof.seconds, 1),
        "figures": [_figure_json(figure) for figure in every_figure(proof)],
        "compared": {
            "worlds": proof.compared_worlds,
            "rules": [
                {
                    "rule": line.rule,
                    "null_alarms": _figure_json(line.null_alarms),
                    "recall": _figure_json(line.recall),
                    "false_families": _figure_json(line.false_families),
                    "rms_ratio": _figure_json(line.rms_ratio),
                }
                for line in proof.compared
            ],
        },
        "hidden_columns": None
        if hidden is None
        else {
            "seeds": list(hidden.seeds),
            "findings": [list(split) for split in hidden.findings],
            "trips": [
                {
                    "id": trip.id,
                    "held_out": trip.held_out,
                    "before": trip.before_frac,
                    "after": trip.after_frac,
                    "claimed_w": trip.claimed_w,
                    "claimed_held_out_w": trip.claimed_held_out_w,
                    "hidden_w": trip.hidden_w,
                    "why": trip.why,
                }
                for trip in hidden.trips
            ],
        },
    }


def write_proof(proof: Proof, folder: Path) -> None:
    """Write proof.json and proof.md into a folder."""
    text = json.dumps(as_json(proof), indent=1, ensure_ascii=False, allow_nan=False)
    (folder / JSON_FILE).write_text(text + "\n", encoding="utf-8")
    (folder / MARKDOWN_FILE).write_text(markdown(proof), encoding="utf-8")


def _splits(hidden: HiddenProof) -> str:
    found: dict[str, int] = {}
    for split in hidden.findings:
        for finding in split:
            effect = finding.split(" ")[0]
            found[effect] = found.get(effect, 0) + 1
    effects = ", ".join(f"`{effect}` in {count}" for effect, count in sorted(found.items(), key=lambda pair: -pair[1]))
    return f"{len(hidden.seeds)} splits. Found: {effects or 'nothing'}. Seeds: {', '.join(map(str, hidden.seeds))}."


def _share(figure: Figure) -> str:
    return NONE if figure.value is None else f"{figure.value:.0%} ({figure.successes}/{figure.trials})"


def _number(figure: Figure, value: float) -> str:
    if math.isnan(value):
        return NONE
    return f"{100.0 * value:.1f} %" if figure.is_share else f"{value:.2f}"


def _figure_json(figure: Figure) -> dict[str, Any]:
    return {
        "group": figure.group,
        "name": figure.name,
        "value": _known(figure.value),
        "ci95": None if figure.low is None else [_known(figure.low), _known(figure.high)],
        "successes": figure.successes,
        "trials": figure.trials,
        "target": _target_json(figure.target),
        "met": figure.met,
    }


def _target_json(target: Target | None) -> list[float | None] | None:
    return None if target is None else [target.low, target.high]


def _known(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else float(f"{value:.6g}")
