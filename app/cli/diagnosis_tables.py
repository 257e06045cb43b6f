"""A diagnosis as tables on a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rich.markup import escape
from rich.table import Table

from app.service.learned import CANNOT_TELL, NOTHING

if TYPE_CHECKING:
    from rich.console import Console

    from diagnosis.answer.results import Coefficient, Diagnosis, FitScore, Interval

NO_INTERVAL: Final = "unknown"


def print_diagnosis(console: Console, diagnosis: Diagnosis) -> None:
    """Verdict, findings, parameters, what stays unexplained, and the fit before and after."""
    console.print(f"{diagnosis.verdict.value.replace('_', ' ')}: {diagnosis.text}", markup=False, highlight=False)
    if diagnosis.findings:
        console.print(_findings(diagnosis))
    if diagnosis.parameter_errors:
        console.print(_parameters(diagnosis))
    if diagnosis.unexplained:
        console.print(_unexplained(diagnosis))
    for finding in diagnosis.findings:
        if finding.separating_recording is not None:
            line = f"{finding.effect}: {finding.separating_recording}"
            console.print(line, style="yellow", markup=False, highlight=False)
    if diagnosis.before is not None and diagnosis.after is not None:
        console.print(_fit(diagnosis, diagnosis.before, diagnosis.after))
    carried = diagnosis.effects or diagnosis.parameters
    if not carried:
        reason = diagnosis.not_carried.get(NOTHING)
        console.print(f"nothing is carried to routes{f': {reason}' if reason else ''}", markup=False, highlight=False)
    elif diagnosis.verdict.value == CANNOT_TELL:
        line = "routes and ranges take effects.json with --apply-uncertain only: causes could not be told apart"
        console.print(line, style="yellow", markup=False, highlight=False)
    for name, reason in diagnosis.not_carried.items():
        if name == NOTHING:
            continue
        console.print(f"not for routes: {name}: {reason}", style="dim", markup=False, highlight=False)


def _findings(diagnosis: Diagnosis) -> Table:
    table = Table(title="left out of the model")
    for heading in ("effect", "family", "coefficients"):
        table.add_column(heading, overflow="fold")
    for heading in ("energy [kWh]", "share"):
        table.add_column(heading, justify="right")
    table.add_column("or else", overflow="fold")
    for finding in diagnosis.findings:
        table.add_row(
            escape(finding.effect),
            finding.family.value,
            escape("\n".join(_coefficient(each) for each in finding.coefficients)),
            f"{finding.energy_kwh:.2f}",
            f"{finding.energy_share_frac:.1%}",
            escape(", ".join(each.effect for each in finding.ambiguous_with)),
        )
    return table


def _parameters(diagnosis: Diagnosis) -> Table:
    table = Table(title="the vehicle's own numbers")
    table.add_column("parameter", overflow="fold")
    for heading in ("in its file", "fitted", "95 %", "share"):
        table.add_column(heading, justify="right")
    table.add_column("the same as", overflow="fold")
    for error in diagnosis.parameter_errors:
        table.add_row(
            escape(f"{error.parameter} [{error.unit}]"),
            f"{error.nameplate:.4g}",
            f"{error.fitted:.4g}",
            _interval(error.ci95),
            f"{error.energy_share_frac:.1%}",
            escape(", ".join(error.aliases)),
        )
    return table


def _unexplained(diagnosis: Diagnosis) -> Table:
    table = Table("where", title="unexplained")
    for heading in ("power [W]", "95 %", "energy [kWh]", "p"):
        table.add_column(heading, justify="right")
    for remainder in diagnosis.unexplained:
        table.add_row(
            escape(f"{remainder.axis} {remainder.low:.4g}..{remainder.high:.4g} {remainder.unit}"),
            f"{remainder.mean_w:+.0f}",
            _interval(remainder.ci95_w),
            f"{remainder.energy_kwh:.2f}",
            f"{remainder.p:.3f}",
        )
    return table


def _fit(diagnosis: Diagnosis, before: FitScore, after: FitScore) -> Table:
    held_out = len(diagnosis.held_out_trips)
    title = f"trips that were kept out of the fit: {held_out}" if held_out else "each trip left out of the fit in turn"
    table = Table("error of trip energies", title=title)
    table.add_column("before", justify="right")
    table.add_column("after", justify="right")
    table.add_row("mean absolute", f"{before.mape:.1%}", f"{after.mape:.1%}")
    table.add_row("mean", f"{before.bias:+.1%}", f"{after.bias:+.1%}")
    table.add_row("SD", f"{before.sd:.1%}", f"{after.sd:.1%}")
    table.add_row("power, root mean square [W]", f"{before.rmse_w:.0f}", f"{after.rmse_w:.0f}")
    return table


def _coefficient(coefficient: Coefficient) -> str:
    unit = f" {coefficient.unit}" if coefficient.unit else ""
    return f"{coefficient.name} {coefficient.value:.4g}{unit} ({_interval(coefficient.ci95)})"


def _interval(ci95: Interval) -> str:
    return NO_INTERVAL if ci95 is None else f"{ci95[0]:.4g}..{ci95[1]:.4g}"
