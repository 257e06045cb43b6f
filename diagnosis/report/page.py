"""A diagnosis as one page that needs nothing else: words for the driver first, then figures for whoever checks them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from diagnosis.answer.results import Verdict
from diagnosis.report.causes import battery_section, findings_section, parameters_section, unexplained_section
from diagnosis.report.fit import energy_section, examples_section, fit_section, profile_section, regimes_section
from diagnosis.report.method import method_section, quality_section
from diagnosis.report.rendering import rendered
from diagnosis.report.style import CSS
from diagnosis.report.summary import consumption_bars, next_steps
from diagnosis.report.text import (
    count,
    finding_sentence,
    fit_sentence,
    heaviest_first,
    parameter_sentence,
    rivals_sentences,
    too_few_sentence,
    unexplained_sentence,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from markupsafe import Markup

    from diagnosis.answer.results import Diagnosis

POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'"  # a page that could not load anything if it wanted to
NOTHING: Final = "Your car takes what the model says it should: what is left over looks like chance."
HEADLINES: Final[Mapping[Verdict, str]] = {
    Verdict.TOO_FEW_TRIPS: "Too few drives to name a cause",
    Verdict.NOTHING_MISSING: "Nothing is missing",
    Verdict.PARAMETER_ERROR: "The vehicle's numbers are off",
    Verdict.LEFT_OUT_PHYSICS: "The model leaves something out",
    Verdict.CANNOT_TELL: "Several causes look alike on these drives",
    Verdict.UNEXPLAINED: "Something happens that no known effect explains",
}


class Section(NamedTuple):
    """A section of the page under a heading; name: its id; hidden: shown when asked for."""

    name: str
    title: str
    content: Markup
    hidden: bool = False


def report_html(diagnosis: Diagnosis) -> str:
    """The page as one HTML document: style and plots inline, no script, nothing to load, same bytes for the same input.

    Every string of the diagnosis is shown as text, whatever it holds. Numbers are rounded to their intervals; those in
    tables carry their value to six digits in `<data value>`.
    """
    first, *others = _verdict_sentences(diagnosis)
    page = rendered(
        "page.html",
        policy=POLICY,
        css=CSS,
        vehicle_id=diagnosis.vehicle_id,
        headline=HEADLINES[diagnosis.verdict],
        extent=_extent(diagnosis),
        verdict=[text for text in dict.fromkeys((first, diagnosis.text)) if text],
        others=others,
        bars=consumption_bars(diagnosis),
        steps=next_steps(diagnosis),
        sections=_sections(diagnosis),
    )
    return f"{page}\n"


def _sections(diagnosis: Diagnosis) -> list[Section]:
    """The sections in the page's order."""
    found = [
        Section("fit", "How well drives are met, before and after", fit_section(diagnosis)),
        Section("findings", "What the model leaves out", findings_section(diagnosis)),
        Section("parameters", "Numbers of the vehicle that are off", parameters_section(diagnosis)),
        Section("capacity", "What the battery holds and loses", battery_section(diagnosis.capacity, diagnosis.battery)),
        Section("unexplained", "What no effect explains", unexplained_section(diagnosis)),
        Section("regimes", "Where the mismatch lies", regimes_section(diagnosis)),
        Section("examples", "Example drives over time", examples_section(diagnosis)),
        Section("energy", "Where each drive's energy went", energy_section(diagnosis)),
        Section("profile", "Planning and vehicle model apart", profile_section(diagnosis.profile)),
        Section("quality", "Quality of the recordings", quality_section(diagnosis.data_quality), hidden=True),
        Section("method", "How it was done", method_section(diagnosis), hidden=True),
    ]
    unknown = {"profile": not diagnosis.profile, "capacity": diagnosis.capacity is None and diagnosis.battery is None}
    return [section for section in found if not unknown.get(section.name, False)]


def _extent(diagnosis: Diagnosis) -> str:
    """How much was driven."""
    kilometres = sum(trip.distance_km for trip in diagnosis.trips)
    energy = sum(trip.measured_kwh for trip in diagnosis.trips)
    return (
        f"{count(len(diagnosis.trips), 'drive')}, {kilometres:.0f} km, {energy:.0f} kWh measured; "
        f"{len(diagnosis.fitted_trips)} fitted, {len(diagnosis.held_out_trips)} held out."
    )


def _verdict_sentences(diagnosis: Diagnosis) -> list[str]:
    """What the verdict rests on first, then what else was found, and how well drives are met."""
    findings = heaviest_first(diagnosis.findings)
    said = {
        Verdict.TOO_FEW_TRIPS: [too_few_sentence(diagnosis)] if diagnosis.verdict is Verdict.TOO_FEW_TRIPS else [],
        Verdict.NOTHING_MISSING: [NOTHING] if diagnosis.verdict is Verdict.NOTHING_MISSING else [],
        Verdict.LEFT_OUT_PHYSICS: [finding_sentence(finding) for finding in findings if not finding.ambiguous_with],
        Verdict.CANNOT_TELL: [rivals_sentences(finding) for finding in findings if finding.ambiguous_with],
        Verdict.PARAMETER_ERROR: [
            *(parameter_sentence(error) for error in diagnosis.parameter_errors),
            *([diagnosis.capacity.text] if diagnosis.capacity is not None and diagnosis.capacity.text else []),
        ],
        Verdict.UNEXPLAINED: [unexplained_sentence(place) for place in diagnosis.unexplained],
    }
    fit = fit_sentence(diagnosis.before, diagnosis.after, len(diagnosis.held_out_trips))
    return [*said.pop(diagnosis.verdict), *(text for texts in said.values() for text in texts), fit]
