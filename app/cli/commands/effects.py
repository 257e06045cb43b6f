"""The options that name learned effects and say whether they are applied where their causes are open."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.commands.json_files import json_in
from app.errors.raised import CommandError

if TYPE_CHECKING:
    from app.schemas.learned_effects import EffectsChoice
    from app.service.service import Service

EffectsOption = Annotated[
    str | None,
    typer.Option(
        "--effects",
        metavar="FILE|ID",
        help="learned effects: effects.json of a diagnosis, or the id of a diagnosis that is stored",
    ),
]
UncertainOption = Annotated[
    bool,
    typer.Option("--apply-uncertain", help="apply learned effects also where the drives could not tell causes apart"),
]


def effects_choice(named: str | None) -> object:
    """What a request holds as `effects`: the content of a file where there is one of that name, else the id.

    What has a folder or the ending .json is always a file; raises OSError where it can't be read, and CommandError.
    """
    if named is None:
        return None
    path = Path(named)
    if path.is_file() or path.suffix == ".json" or len(path.parts) > 1:
        return json_in(path)
    return named


def changes_anything(service: Service, effects: EffectsChoice | None) -> bool:
    """Whether effects of a request change its vehicle; raises what LearnedEffectsShelf.chosen does."""
    from app.service.learned import carries

    chosen = service.learned.chosen(effects)
    return chosen is not None and carries(chosen)


def refuse_uncertain(service: Service, effects: EffectsChoice | None, apply_uncertain: bool) -> None:
    """Raise CommandError where the diagnosis behind effects could not tell causes apart, unless they are to be applied.

    Raises what LearnedEffectsShelf.chosen does.
    """
    from app.service.learned import uncertain_text

    uncertain = None if apply_uncertain else uncertain_text(service.learned.chosen(effects))
    if uncertain is not None:
        raise CommandError(
            f"--effects is not applied, for it was learned from {uncertain}. To apply it all the same:"
            " --apply-uncertain; to see before what a route takes with it: --compare of joulepath route"
        )
