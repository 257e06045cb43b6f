"""Commands on API keys."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from app.access.keys import add_key, read_keys, remove_key
from app.access.roles import Role
from app.errors.raised import CommandError
from app.settings import Settings

keys = typer.Typer(no_args_is_help=True, help="The API keys that requests need where JOULEPATH_KEYS_FILE names a file.")

NameArgument = Annotated[str, typer.Argument(metavar="NAME", help="whose key it is")]
FileOption = Annotated[
    Path | None, typer.Option("--file", help="file of keys, by default that of JOULEPATH_KEYS_FILE", metavar="FILE")
]


@keys.command("add")
def add(
    name: NameArgument,
    role: Annotated[Role, typer.Option(help="what it allows")] = Role.READ,
    daily_quota: Annotated[
        int | None, typer.Option(min=1, help="units a day, in place of JOULEPATH_DAILY_QUOTA")
    ] = None,
    file: FileOption = None,
) -> None:
    """Make a key and print it, once: only a hash of it is kept. A running server knows it at once."""
    path = _file(file)
    key = add_key(path, name, role, daily_quota)
    note = f"key of {name} with the role {role.value} in {path}; it is not shown again:"
    Console(stderr=True, soft_wrap=True).print(note, markup=False, highlight=False)
    typer.echo(key)


@keys.command("list")
def list_keys(
    as_json: Annotated[bool, typer.Option("--json", help="print as JSON")] = False, file: FileOption = None
) -> None:
    """Names and roles of all keys."""
    shown = [
        {name: value for name, value in asdict(key).items() if name not in ("salt", "hash")}
        for key in read_keys(_file(file))
    ]
    if as_json:
        Console(soft_wrap=True).print_json(data=shown)
        return
    table = Table("name", "role", "made", "units a day")
    for key in shown:
        table.add_row(key["name"], key["role"], key["created"], str(key["daily_quota"] or ""))
    Console().print(table)


@keys.command("remove")
def remove(name: NameArgument, file: FileOption = None) -> None:
    """Remove a key. A running server refuses it within a second."""
    remove_key(_file(file), name)


def _file(given: Path | None) -> Path:
    path = given or Settings().keys_file
    if path is None:
        raise CommandError("no file of keys is named: set JOULEPATH_KEYS_FILE or give --file")
    return path
