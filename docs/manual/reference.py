"""Pages of the manual that are written from the code: commands, HTTP operations and the Python interface."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

import typer.main

import joulepath
from app.cli.main import cli
from app.main import create_app
from app.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import click


def write_reference(folder: Path) -> None:
    """Write all pages to a folder."""
    folder.mkdir(exist_ok=True)
    document = create_app(Settings()).openapi()
    for name, lines in (("commands", _commands()), ("operations", _operations(document)), ("interface", _interface())):
        (folder / f"{name}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _commands() -> Iterator[str]:
    yield "# Commands"
    yield ""
    yield "What `joulepath` can be told on the command line, written from the code."
    yield from _command(typer.main.get_command(cli), "joulepath", 2)


def _command(command: click.Command, name: str, level: int) -> Iterator[str]:
    children: Mapping[str, click.Command] = getattr(command, "commands", {})
    if name != "joulepath":
        yield from ("", f"{'#' * min(level, 4)} {name}", "", (command.help or "").strip())
    rows = [row for parameter in command.params if (row := _parameter(parameter))]
    if rows and name != "joulepath":
        yield from ("", "| option | meaning |", "|---|---|", *rows)
    for child_name, child in children.items():
        if not child.hidden:
            yield from _command(child, f"{name} {child_name}", level + (name != "joulepath"))


def _parameter(parameter: click.Parameter) -> str:
    if parameter.name == "help" or getattr(parameter, "hidden", False):
        return ""
    is_option = parameter.opts[0].startswith("-")
    metavar = getattr(parameter, "metavar", None) or ""
    names = ", ".join(parameter.opts) if is_option else metavar or str(parameter.name).upper()
    metavar = metavar if is_option else ""
    said = getattr(parameter, "help", None) or ""
    return f"| `{_cell(f'{names} {metavar}'.strip())}` | {_cell(said)} |"


def _operations(document: dict[str, Any]) -> Iterator[str]:
    yield "# HTTP operations"
    yield ""
    yield "Every operation with its parameters, written from the OpenAPI document, which has bodies and answers, too."
    for tag in document["tags"]:
        yield from ("", f"## {tag['name'].capitalize()}", "", f"{tag['description'].capitalize()}.")
        for path, methods in document["paths"].items():
            for method, operation in methods.items():
                if tag["name"] in operation["tags"]:
                    yield from _operation(path, method, operation)


def _operation(path: str, method: str, operation: dict[str, Any]) -> Iterator[str]:
    yield from ("", f"### {operation['operationId']}", "", f"`{method.upper()} {path}`: {operation['summary']}.")
    yield from ("", operation["description"])
    parameters = operation.get("parameters", ())
    if parameters:
        yield from ("", "| parameter | in | meaning |", "|---|---|---|")
        for parameter in parameters:
            needed = ", needed" if parameter.get("required") else ""
            said = parameter.get("description") or parameter["schema"].get("description", "")
            yield f"| `{parameter['name']}` | {parameter['in']}{needed} | {_cell(said)} |"


def _interface() -> Iterator[str]:
    yield "# Python interface"
    yield ""
    yield "What the package `joulepath` offers, written from the code. [From Python](../python.md) has examples."
    for name in sorted(joulepath.__all__, key=str.casefold):
        found = getattr(joulepath, name)
        if not (inspect.isclass(found) or callable(found)):
            continue
        yield from ("", f"## {name}", "")
        if not inspect.isclass(found) or "__init__" in vars(found):
            yield from ("```python", f"{name}{_signature(found)}", "```", "")
        yield from _docstring(found)
        if inspect.isclass(found):
            for method, function in vars(found).items():
                plain = function.__func__ if isinstance(function, classmethod | staticmethod) else function
                if not method.startswith("_") and inspect.isfunction(plain):
                    first = (inspect.getdoc(plain) or "").partition("\n\n")[0].replace("\n", " ")
                    yield from ("", f"- `{method}{_signature(plain)}`: {first}")


def _signature(found: Any) -> str:
    try:
        return str(inspect.signature(found))
    except (TypeError, ValueError):
        return "(…)"


def _docstring(found: Any) -> Iterator[str]:
    said = inspect.getdoc(found) or ""
    yield said


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
