"""The report's sections on causes: what was left out, parameters that are off, and what stays unexplained."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.answer.results import CapacityKind, Verdict
from diagnosis.report.rendering import rendered
from diagnosis.report.tables import Header, Table, cell, data, interval_cell
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
    from collections.abc import Mapping

    from markupsafe import Markup

    from diagnosis.answer.results import (
        CapacityEstimate,
        Coefficient,
        Diagnosis,
        Finding,
        ParameterError,
        Unexplained,
    )
    from diagnosis.causes.battery import BatteryLoss
    from diagnosis.report.tables import Cell

NOT_LOOKED: Final = "Not concluded: there are too few drives."
CAPACITY_TEXTS: Final[Mapping[CapacityKind, str]] = {
    CapacityKind.AS_IN_FILE: "The battery holds what its file says, as far as a displayed charge can tell.",
    CapacityKind.NOT_CLEAR: "These drives do not tell clearly what the battery holds.",
}


@dataclass(frozen=True, slots=True)
class Article:
    """What the page says of a finding; facts by their names, of which those without a text are left out."""

    title: str
    text: str
    family: str
    effect: str
    facts: Mapping[str, str]
    coefficients: Table | None


def findings_section(diagnosis: Diagnosis) -> Markup:
    """One article a finding, the largest energy first."""
    if not diagnosis.findings:
        return _nothing(diagnosis, "No effect that the model leaves out stands out.")
    carried = diagnosis.not_carried
    findings = [_article(finding, carried.get(finding.effect)) for finding in heaviest_first(diagnosis.findings)]
    return rendered("findings.html", findings=findings)


def parameters_section(diagnosis: Diagnosis) -> Markup:
    """Parameters that are off, with what cannot be told from them."""
    errors = diagnosis.parameter_errors
    if not errors:
        return _nothing(diagnosis, "No parameter of the vehicle is off by more than chance allows.")
    heads = [
        *(Header("parameter"), Header("unit"), Header("vehicle file", True), Header("by the drives", True)),
        *(Header("95 %", True), Header("energy [kWh]", True), Header("share [%]", True)),
        *(Header("family"), Header("cannot be told from")),
    ]
    table = Table("Parameters that are off", heads, [_parameter_row(error) for error in errors])
    return rendered("parameters.html", parameters=table, texts=[error.text for error in errors if error.text])


def battery_section(capacity: CapacityEstimate | None, battery: BatteryLoss | None) -> Markup:
    """What the battery holds by charge against energy, beside what its file has, and its resistance by its voltage."""
    loses = [] if battery is None else [_resistance_sentence(battery)]
    if capacity is None:
        return rendered("nothing.html", text=" ".join(loses) or "These drives do not tell what the battery holds.")
    heads = [
        *(Header("charge"), Header("vehicle file [kWh]", True), Header("by the drives [kWh]", True)),
        *(Header("95 %", True), Header("drives", True), Header("charge they took [%]", True)),
    ]
    value, interval = capacity.value_wh / 1000.0, (capacity.ci95_wh[0] / 1000.0, capacity.ci95_wh[1] / 1000.0)
    row: list[Cell] = [
        "as displayed" if capacity.displayed else "as recorded",
        data(capacity.file_wh / 1000.0, number(capacity.file_wh / 1000.0, interval)),
        cell(value, interval),
        interval_cell(value, interval),
        data(len(capacity.trips), str(len(capacity.trips))),
        data(100.0 * capacity.fall_frac, fixed(100.0 * capacity.fall_frac, 0)),
    ]
    table = Table("Usable capacity by energy over the fall of the charge", heads, [row])
    return rendered("parameters.html", parameters=table, texts=[capacity.text or CAPACITY_TEXTS[capacity.kind], *loses])


def _resistance_sentence(battery: BatteryLoss) -> str:
    size, half = 1000.0 * battery.ohm, 500.0 * (battery.ohm_ci95[1] - battery.ohm_ci95[0])
    text = (
        f"By the voltage of {battery.trips} drives its resistance is {size:.0f} ± {half:.0f} mΩ at 23 °C,"
        f" and doubles with each {battery.doubling_k:.0f} K colder."
    )
    if battery.share is None:
        return text
    where = "holds what that loses" if battery.share > 0.5 else "is that at its terminals, without what that loses"
    return f"{text} The recorded power {where}."


def unexplained_section(diagnosis: Diagnosis) -> Markup:
    """Structure that no effect explains: where it lies, how much it is and how likely chance makes it."""
    found = diagnosis.unexplained
    if not found:
        return _nothing(diagnosis, "Nothing that is left over stands out from chance.")
    heads = [
        *(Header("axis"), Header("where"), Header("power [W]", True), Header("95 %", True)),
        *(Header("energy [kWh]", True), Header("p", True), Header("drives")),
    ]
    table = Table("Structure that no effect explains", heads, [_unexplained_row(place) for place in found])
    return rendered("unexplained.html", places=table, texts=[place.text for place in found if place.text])


def _nothing(diagnosis: Diagnosis, text: str) -> Markup:
    """Nothing was found; with too few trips that is no finding either."""
    return rendered("nothing.html", text=NOT_LOOKED if diagnosis.verdict is Verdict.TOO_FEW_TRIPS else text)


def _article(finding: Finding, why_not_carried: str | None) -> Article:
    share = percents(share_interval(finding))
    facts = {
        "Energy": quantity(finding.energy_kwh, finding.energy_kwh_ci95, "kWh"),
        "Share of the measured energy": quantity(100.0 * finding.energy_share_frac, share, "%"),
        "Strength (t)": fixed(finding.t, 1),
        "Seen at standstill": ""
        if finding.standing_ratio is None
        else quantity(100.0 * finding.standing_ratio, percents(finding.standing_ratio_ci95), "%"),
        "Shows": listed(places(finding.located)),
        "On drives": ", ".join(finding.trips),
        "Cannot be told from": rivals_sentence(finding) if finding.ambiguous_with else "",
        "A drive that would tell": finding.separating_recording or "",
        "Routes and ranges": "" if why_not_carried is None else f"cannot use it: {why_not_carried}",
    }
    name = effect_name(finding.effect)
    heads = [Header("coefficient"), Header("value", True), Header("95 %", True), Header("unit")]
    coefficients = [_coefficient_row(coefficient) for coefficient in finding.coefficients]
    return Article(
        title=name.capitalize(),
        text=finding.text,
        family=FAMILY_NAMES[finding.family],
        effect=finding.effect,
        facts=facts,
        coefficients=Table(f"Coefficients of {name}", heads, coefficients) if coefficients else None,
    )


def _coefficient_row(coefficient: Coefficient) -> list[Cell]:
    return [
        coefficient.name,
        cell(coefficient.value, coefficient.ci95),
        interval_cell(coefficient.value, coefficient.ci95),
        coefficient.unit,
    ]


def _parameter_row(error: ParameterError) -> list[Cell]:
    return [
        error.parameter,
        error.unit,
        data(error.nameplate, number(error.nameplate, error.ci95)),
        cell(error.fitted, error.ci95),
        interval_cell(error.fitted, error.ci95),
        cell(error.energy_kwh, signed=True),
        data(100.0 * error.energy_share_frac, fixed(100.0 * error.energy_share_frac, 1, signed=True)),
        FAMILY_NAMES[error.family],
        ", ".join(map(spoken, error.aliases)) or NONE,
    ]


def _unexplained_row(place: Unexplained) -> list[Cell]:
    return [
        axis_name(place.axis),
        span(place.low, place.high, place.unit),
        cell(place.mean_w, place.ci95_w, signed=True),
        interval_cell(place.mean_w, place.ci95_w, signed=True),
        cell(place.energy_kwh, signed=True),
        data(place.p, probability(place.p)),
        ", ".join(place.trips) or NONE,
    ]
