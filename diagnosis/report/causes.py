"""The report's sections on causes: what was left out, parameters that are off, and what stays unexplained."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from diagnosis.answer.results import Verdict
from diagnosis.report.markup import (
    Header,
    Html,
    cell,
    data,
    element,
    escaped,
    interval_cell,
    items,
    joined,
    paragraphs,
    table,
)
from diagnosis.report.text import (
    FAMILY_NAMES,
    NONE,
    axis_name,
    effect_name,
    fixed,
    heaviest_first,
    listed,
    number,
    percents,
    places,
    probability,
    quantity,
    rivals_sentence,
    share_interval,
    span,
    spoken,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from diagnosis.answer.results import Coefficient, Diagnosis, Finding, ParameterError, Unexplained

NOT_LOOKED: Final = "Not concluded: there are too few drives."


def findings_section(diagnosis: Diagnosis) -> Html:
    """One article a finding, the largest energy first."""
    if not diagnosis.findings:
        return paragraphs(_nothing(diagnosis, "No effect that the model leaves out stands out."))
    carried = diagnosis.not_carried
    return joined(_finding(one, carried.get(one.effect)) for one in heaviest_first(diagnosis.findings))


def parameters_section(diagnosis: Diagnosis) -> Html:
    """Parameters that are off, with what cannot be told from them."""
    errors = diagnosis.parameter_errors
    if not errors:
        return paragraphs(_nothing(diagnosis, "No parameter of the vehicle is off by more than chance allows."))
    heads = [
        *(Header("parameter"), Header("unit"), Header("vehicle file", True), Header("by the drives", True)),
        *(Header("95 %", True), Header("energy [kWh]", True), Header("share [%]", True)),
        *(Header("family"), Header("cannot be told from")),
    ]
    return joined((table("Parameters that are off", heads, map(_parameter_row, errors)), items(_said(errors))))


def unexplained_section(diagnosis: Diagnosis) -> Html:
    """Structure that no effect explains: where it lies, how much it is and how likely chance makes it."""
    found = diagnosis.unexplained
    if not found:
        return paragraphs(_nothing(diagnosis, "Nothing that is left over stands out from chance."))
    heads = [
        *(Header("axis"), Header("where"), Header("power [W]", True), Header("95 %", True)),
        *(Header("energy [kWh]", True), Header("p", True), Header("drives")),
    ]
    return joined(
        (
            table("Structure that no effect explains", heads, map(_unexplained_row, found)),
            paragraphs(
                "Power: above the rest of the drives there. p: chance of as much in drives with nothing left out, "
                "corrected for every place that was looked at.",
                class_="soft",
            ),
            items(_said(found)),
        )
    )


def _nothing(diagnosis: Diagnosis, text: str) -> str:
    """Nothing was found; with too few trips that is no finding either."""
    return NOT_LOOKED if diagnosis.verdict is Verdict.TOO_FEW_TRIPS else text


def _finding(one: Finding, why_not_carried: str | None) -> Html:
    share = percents(share_interval(one))
    facts = {
        "Family": FAMILY_NAMES[one.family],
        "Effect in the library": element("code", one.effect),
        "Energy": quantity(one.energy_kwh, one.energy_kwh_ci95, "kWh"),
        "Share of the measured energy": quantity(100.0 * one.energy_share_frac, share, "%"),
        "Strength (t)": fixed(one.t, 1),
        "Shows": listed(places(one.located)),
        "On drives": ", ".join(one.trips),
        "Cannot be told from": rivals_sentence(one) if one.ambiguous_with else "",
        "A drive that would tell": one.separating_recording or "",
        "Routes and ranges": "" if why_not_carried is None else f"cannot use it: {why_not_carried}",
    }
    heads = [Header("coefficient"), Header("value", True), Header("95 %", True), Header("unit")]
    return element(
        "article",
        element("h3", effect_name(one.effect).capitalize()),
        paragraphs(one.text),
        _facts(facts),
        table(f"Coefficients of {effect_name(one.effect)}", heads, map(_coefficient_row, one.coefficients))
        if one.coefficients
        else None,
    )


def _facts(facts: Mapping[str, str]) -> Html:
    """Names and texts; those without a text are left out."""
    return element("dl", *(joined((element("dt", name), element("dd", text))) for name, text in facts.items() if text))


def _coefficient_row(one: Coefficient) -> list[str]:
    return [one.name, cell(one.value, one.ci95), interval_cell(one.value, one.ci95), one.unit]


def _parameter_row(one: ParameterError) -> list[str]:
    return [
        one.parameter,
        one.unit,
        data(one.nameplate, number(one.nameplate, one.ci95)),
        cell(one.fitted, one.ci95),
        interval_cell(one.fitted, one.ci95),
        cell(one.energy_kwh, signed=True),
        data(100.0 * one.energy_share_frac, fixed(100.0 * one.energy_share_frac, 1, signed=True)),
        FAMILY_NAMES[one.family],
        ", ".join(map(spoken, one.aliases)) or NONE,
    ]


def _unexplained_row(one: Unexplained) -> list[str]:
    return [
        axis_name(one.axis),
        span(one.low, one.high, one.unit),
        cell(one.mean_w, one.ci95_w, signed=True),
        interval_cell(one.mean_w, one.ci95_w, signed=True),
        cell(one.energy_kwh, signed=True),
        data(one.p, probability(one.p)),
        ", ".join(one.trips) or NONE,
    ]


def _said(found: Sequence[ParameterError] | Sequence[Unexplained]) -> list[str]:
    return [escaped(one.text) for one in found if one.text]
