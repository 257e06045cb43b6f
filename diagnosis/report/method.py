"""The report's sections on the recordings' quality and on how the diagnosis was made."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final

from diagnosis.report.rendering import rendered
from diagnosis.report.tables import Header, Table, cell, interval_cell, number_as_chosen
from diagnosis.report.text import NONE, count, effect_name, listed, rivals_sentence, spoken

if TYPE_CHECKING:
    from collections.abc import Sequence

    from markupsafe import Markup

    from diagnosis.answer.results import Diagnosis, QualityNote
    from diagnosis.report.tables import Cell

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


def quality_section(notes: Sequence[QualityNote]) -> Markup:
    """What was noticed in the recordings, by kind; trips with the same note share a row."""
    if not notes:
        return rendered("nothing.html", text="Nothing was noticed in the recordings.")
    heads = [Header("channel"), Header("what was noticed"), Header("drives")]
    kinds: defaultdict[str, defaultdict[tuple[str, str], list[str]]] = defaultdict(lambda: defaultdict(list))
    for note in notes:
        kinds[note.kind][note.channel, note.text].append(note.trip_id)
    tables = []
    for kind, same in sorted(kinds.items()):
        summary = f"{spoken(kind).capitalize()} ({count(sum(map(len, same.values())), 'note')})"
        rows = [[channel or NONE, text, _trips(trips)] for (channel, text), trips in sorted(same.items())]
        tables.append((summary, Table(f"Notes: {spoken(kind)}", heads, rows)))
    return rendered("quality.html", kinds=tables)


def method_section(diagnosis: Diagnosis) -> Markup:
    """Terms, what was learned, what cannot be told, which trips were used, and the settings."""
    heads = [Header("field"), Header("value", True), Header("95 %", True)]
    intervals = diagnosis.effects_ci95
    effects: list[list[Cell]] = [
        [name, cell(value, intervals.get(name)), interval_cell(value, intervals.get(name))]
        for name, value in diagnosis.effects.items()
    ]
    parameters: list[list[Cell]] = [
        [name, number_as_chosen(value), NONE] for name, value in diagnosis.parameters.items()
    ]
    return rendered(
        "method.html",
        terms=TERMS,
        aliases=[*ALIASES, *(rivals_sentence(finding) for finding in diagnosis.findings if finding.ambiguous_with)],
        effects=Table("Coefficients of effects", heads, effects) if effects else None,
        parameters=Table("Numbers of the vehicle", heads, parameters) if parameters else None,
        not_carried=[f"Not used: {effect_name(name)}. {why}" for name, why in diagnosis.not_carried.items()],
        drives=[
            (f"{count(len(trips), 'drive')} {use}", listed(trips) or NONE)
            for trips, use in ((diagnosis.fitted_trips, "fitted"), (diagnosis.held_out_trips, "held out"))
        ],
        model={"vehicle": diagnosis.vehicle_id, **diagnosis.model},
    )


def _trips(trips: Sequence[str]) -> str:
    named = sorted(set(trips))
    if len(named) <= MOST_TRIPS:
        return ", ".join(named)
    return f"{', '.join(named[:MOST_TRIPS])} and {len(named) - MOST_TRIPS} more"
