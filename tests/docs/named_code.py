"""What pages name of the code, and whether it is there."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
PACKAGES: Final = tuple(sorted(path.parent.name for path in ROOT.glob("*/__init__.py")))
FOLDERS: Final = (*PACKAGES, "data", "deploy", "docs", "tests", "web")
SPAN: Final = re.compile(r"`([^`\n]+)`")
FILE: Final = re.compile(r"((?:[\w.-]+/)*[\w-]+\.(?:py|js|md))(?:: ([\w.]+))?")
FOLDER: Final = re.compile(rf"((?:{'|'.join(FOLDERS)})(?:/[\w-]+)*)/")
DOTTED: Final = re.compile(rf"((?:{'|'.join(PACKAGES)})(?:\.(?!json\b|csv\b)\w+)+)")


@dataclass(frozen=True, slots=True)
class Named:
    """A file, folder, module or function that a page names."""

    page: str
    text: str
    missing: str | None  # what of it is not there


def named_in(page: Path) -> list[Named]:
    """Everything of the code that a page names between backticks, outside of code blocks."""
    prose = re.sub(r"^ *(```|~~~).*?^ *\1", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    found = []
    for span in SPAN.findall(prose):
        if match := FILE.fullmatch(span):
            found.append(Named(page.name, span, _missing_of_file(page, match[1], match[2])))
        elif match := FOLDER.fullmatch(span):
            found.append(Named(page.name, span, None if (ROOT / match[1]).is_dir() else match[1]))
        elif match := DOTTED.fullmatch(span):
            found.append(Named(page.name, span, _missing_of_module(match[1])))
    return found


def _missing_of_file(page: Path, name: str, function: str | None) -> str | None:
    for folder in (ROOT, page.parent, ROOT / "web"):
        if (folder / name).is_file():
            return _missing_of_source(folder / name, function)
    if "/" not in name:  # a name alone, for a file that the page has named with its folder
        paths = [path for path in _files() if path.name == name]
        if paths:
            return None if any(_missing_of_source(path, function) is None for path in paths) else function
    return name


def _missing_of_module(dotted: str) -> str | None:
    """A module, or what one defines, as `energy.chain.chain.Chain`."""
    parts = dotted.split(".")
    for count in range(len(parts), 0, -1):
        path = ROOT.joinpath(*parts[:count])
        source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if source.is_file():
            return _missing_of_source(source, ".".join(parts[count:]) or None)
    return dotted


def _missing_of_source(path: Path, name: str | None) -> str | None:
    return None if name is None or name in defined_in(path) else name


@cache
def defined_in(path: Path) -> frozenset[str]:
    """Functions, classes with their methods and fields, and constants that a module defines or imports."""
    names: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        own = _names_of(node)
        names |= own
        if isinstance(node, ast.ClassDef):
            names |= {f"{node.name}.{name}" for inner in node.body for name in _names_of(inner)}
    return frozenset(names)


def _names_of(node: ast.stmt) -> set[str]:
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
        return {node.name}
    if isinstance(node, (ast.Import, ast.ImportFrom)):
        return {alias.asname or alias.name for alias in node.names}
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return {name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)}


@cache
def _files() -> tuple[Path, ...]:
    return tuple(
        path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in (".py", ".js", ".md")
    )
