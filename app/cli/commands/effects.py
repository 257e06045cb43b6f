"""The option that names learned effects: a file, or the id of a diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli.commands.json_files import json_in

EffectsOption = Annotated[
    str | None,
    typer.Option(
        "--effects",
        metavar="FILE|ID",
        help="learned effects: effects.json of a diagnosis, or the id of a diagnosis that is stored",
    ),
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
