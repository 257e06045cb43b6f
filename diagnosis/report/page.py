"""A diagnosis as one page that needs nothing else: words for the driver first, then figures for whoever checks them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from diagnosis.answer.results import Verdict
from diagnosis.report.causes import findings_section, parameters_section, unexplained_section
from diagnosis.report.fit import energy_section, examples_section, fit_section, profile_section, regimes_section
from diagnosis.report.markup import Html, element, items, paragraphs
from diagnosis.report.method import method_section, quality_section
from diagnosis.report.style import CSS
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


def report_html(diagnosis: Diagnosis) -> str:
    """The page as one HTML document: style and plots inline, no script, nothing to load, same bytes for the same input.

    Every string of the diagnosis is shown as text, whatever it holds. Numbers are rounded to their intervals; those in
    tables carry their value to six digits in `<data value>`.
    """
    sections = _sections(diagnosis)
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", http_equiv="Content-Security-Policy", content=POLICY),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("title", f"Diagnosis of {diagnosis.vehicle_id}: {HEADLINES[diagnosis.verdict]}"),
        element("style", Html(CSS)),
    )
    links = items(element("a", title, href=f"#{name}") for name, title, _ in sections)
    body = element(
        "body",
        element("header", element("h1", f"What the drives say about {diagnosis.vehicle_id}"), _extent(diagnosis)),
        element(
            "main",
            _verdict(diagnosis),
            element("nav", links, aria_label="Contents"),
            *(
                element(
                    "section",
                    element("h2", title, id=f"{name}-title"),
                    content,
                    id=name,
                    aria_labelledby=f"{name}-title",
                )
                for name, title, content in sections
            ),
        ),
    )
    return f"<!DOCTYPE html>\n{element('html', head, body, lang='en')}\n"


def _sections(diagnosis: Diagnosis) -> list[tuple[str, str, Html]]:
    """Name, title and content of each section in the page's order."""
    found = [
        ("fit", "How well drives are met, before and after", fit_section(diagnosis)),
        ("findings", "What the model leaves out", findings_section(diagnosis)),
        ("parameters", "Numbers of the vehicle that are off", parameters_section(diagnosis)),
        ("unexplained", "What no effect explains", unexplained_section(diagnosis)),
        ("regimes", "Where the mismatch lies", regimes_section(diagnosis)),
        ("examples", "Example drives over time", examples_section(diagnosis)),
        ("energy", "Where each drive's energy went", energy_section(diagnosis)),
        ("profile", "Planning and vehicle model apart", profile_section(diagnosis.profile)),
        ("quality", "Quality of the recordings", quality_section(diagnosis.data_quality)),
        ("method", "How it was done", method_section(diagnosis)),
    ]
    return [one for one in found if one[0] != "profile" or diagnosis.profile]


def _extent(diagnosis: Diagnosis) -> Html:
    """How much was driven."""
    kilometres = sum(one.distance_km for one in diagnosis.trips)
    energy = sum(one.measured_kwh for one in diagnosis.trips)
    return paragraphs(
        f"{count(len(diagnosis.trips), 'drive')}, {kilometres:.0f} km, {energy:.0f} kWh measured; "
        f"{len(diagnosis.fitted_trips)} fitted, {len(diagnosis.held_out_trips)} held out.",
        class_="soft",
    )


def _verdict(diagnosis: Diagnosis) -> Html:
    """The answer in a sentence, the diagnosis' own words for it, and what else was found."""
    first, *others = _verdict_sentences(diagnosis)
    return element(
        "section",
        element("h2", HEADLINES[diagnosis.verdict], id="verdict-title"),
        paragraphs(first, diagnosis.text if diagnosis.text != first else None),
        items(others) if others else None,
        class_="verdict",
        id="verdict",
        aria_labelledby="verdict-title",
    )


def _verdict_sentences(diagnosis: Diagnosis) -> list[str]:
    """What the verdict rests on first, then what else was found, and how well drives are met."""
    findings = heaviest_first(diagnosis.findings)
    said = {
        Verdict.TOO_FEW_TRIPS: [too_few_sentence(diagnosis)] if diagnosis.verdict is Verdict.TOO_FEW_TRIPS else [],
        Verdict.NOTHING_MISSING: [NOTHING] if diagnosis.verdict is Verdict.NOTHING_MISSING else [],
        Verdict.LEFT_OUT_PHYSICS: [finding_sentence(one) for one in findings if not one.ambiguous_with],
        Verdict.CANNOT_TELL: [rivals_sentences(one) for one in findings if one.ambiguous_with],
        Verdict.PARAMETER_ERROR: [parameter_sentence(one) for one in diagnosis.parameter_errors],
        Verdict.UNEXPLAINED: [unexplained_sentence(one) for one in diagnosis.unexplained],
    }
    fit = fit_sentence(diagnosis.before, diagnosis.after, len(diagnosis.held_out_trips))
    return [*said.pop(diagnosis.verdict), *(text for texts in said.values() for text in texts), fit]
