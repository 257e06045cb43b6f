"""The report's sections on the recordings' quality and on how the diagnosis was made."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from diagnosis.report.markup import (
    Header,
    Html,
    cell,
    data,
    element,
    escaped,
    folded,
    interval_cell,
    items,
    joined,
    paragraphs,
    table,
)
from diagnosis.report.text import NONE, count, effect_name, listed, plain, rivals_sentence, spoken

if TYPE_CHECKING:
    from diagnosis.answer.results import Diagnosis, QualityNote

MOST_TRIPS: Final = 12  # that a note lists by name
TERMS: Final = (
    ("Model", "computes the power at the battery from speed, slope and the vehicle's numbers."),
    ("Before", "the model with its own numbers fitted to the drives, so that only what it cannot express is left."),
    ("After", "the same with the effects that were found."),
    ("Held out", "a drive that was kept from the fit and serves to check it."),
    (
        "95 %",
        "an interval that holds the true value in 95 of 100 such studies; the drive is the unit, never the second.",
    ),
    ("Effect", "a piece of physics of the library that the model can leave out."),
    ("Family", "the kind of cause that an effect belongs to."),
    ("Explained", "a drive's energy with its own power used for levels that it has, such as payload."),
    ("p", "the chance of seeing as much where nothing is left out."),
)
ALIASES: Final = (
    "A constant error of the slope looks like rolling resistance.",
    "A constant error of the current looks like the auxiliaries' power.",
    "A wrong scale of the speed looks like other road loads and another mass.",
    "Losses of a motor that spins without load look like road loads.",
)


def quality_section(notes: Sequence[QualityNote]) -> Html:
    """What was noticed in the recordings, by kind; trips with the same note share a row."""
    if not notes:
        return paragraphs("Nothing was noticed in the recordings.")
    heads = [Header("channel"), Header("what was noticed"), Header("drives")]
    kinds: defaultdict[str, defaultdict[tuple[str, str], list[str]]] = defaultdict(lambda: defaultdict(list))
    for one in notes:
        kinds[one.kind][one.channel, one.text].append(one.trip_id)
    return joined(
        folded(
            f"{spoken(kind).capitalize()} ({count(sum(map(len, same.values())), 'note')})",
            table(
                f"Notes: {spoken(kind)}",
                heads,
                [[channel or NONE, text, _trips(trips)] for (channel, text), trips in sorted(same.items())],
            ),
        )
        for kind, same in sorted(kinds.items())
    )


def method_section(diagnosis: Diagnosis) -> Html:
    """Terms, what was learned, what cannot be told, which trips were used, and the settings."""
    ambiguous = [rivals_sentence(one) for one in diagnosis.findings if one.ambiguous_with]
    return joined(
        (
            element("h3", "Words"),
            element("dl", *(joined((element("dt", name), element("dd", text))) for name, text in TERMS)),
            element("h3", "What power alone can never tell apart"),
            items([*ALIASES, *ambiguous]),
            element("h3", "What was learned, for routes and ranges"),
            _learned(diagnosis),
            element("h3", "Drives"),
            folded(count(len(diagnosis.fitted_trips), "drive") + " fitted", paragraphs(_all(diagnosis.fitted_trips))),
            folded(
                count(len(diagnosis.held_out_trips), "drive") + " held out", paragraphs(_all(diagnosis.held_out_trips))
            ),
            element("h3", "Models, seeds and thresholds"),
            _settings({"vehicle": diagnosis.vehicle_id, **diagnosis.model}),
        )
    )


def _learned(diagnosis: Diagnosis) -> Html:
    """Effects and parameters that routes use, and findings that they cannot use."""
    heads = [Header("field"), Header("value", True), Header("95 %", True)]
    rows = [
        [name, cell(value, diagnosis.effects_ci95.get(name)), interval_cell(value, diagnosis.effects_ci95.get(name))]
        for name, value in diagnosis.effects.items()
    ]
    parameters = [[name, data(value, plain(value)), NONE] for name, value in diagnosis.parameters.items()]
    if not rows and not parameters and not diagnosis.not_carried:
        return paragraphs("Nothing: routes and ranges stay as they are.")
    return joined(
        (
            table("Coefficients of effects", heads, rows) if rows else None,
            table("Numbers of the vehicle", heads, parameters) if parameters else None,
            items(f"Not used: {effect_name(name)}. {why}" for name, why in diagnosis.not_carried.items())
            if diagnosis.not_carried
            else None,
        )
    )


def _settings(settings: Mapping[str, Any]) -> Html:
    """Names and values as deep as they are nested."""
    return element(
        "dl",
        *(joined((element("dt", spoken(str(name))), element("dd", _value(value)))) for name, value in settings.items()),
    )


def _value(value: Any) -> Html:
    if isinstance(value, Mapping):
        return _settings(value) if value else escaped(NONE)
    if isinstance(value, bool) or value is None:
        return escaped({True: "yes", False: "no", None: NONE}[value])
    if isinstance(value, float):
        return data(value, plain(value))
    if isinstance(value, Sequence) and not isinstance(value, str):
        if any(isinstance(one, Mapping) for one in value):
            return joined(_value(one) for one in value)
        return joined(part for k, one in enumerate(value) for part in ((", ", _value(one)) if k else (_value(one),)))
    return escaped(str(value))


def _trips(trips: Sequence[str]) -> str:
    named = sorted(set(trips))
    if len(named) <= MOST_TRIPS:
        return ", ".join(named)
    return f"{', '.join(named[:MOST_TRIPS])} and {len(named) - MOST_TRIPS} more"


def _all(trips: Sequence[str]) -> str:
    return listed(list(trips)) or NONE
