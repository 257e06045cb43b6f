"""The rooms of the code and what they import of each other, read from it; and their table in architecture.md."""

from __future__ import annotations

import ast
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import grimp

if TYPE_CHECKING:
    from collections.abc import Iterable

ROOT: Final = Path(__file__).resolve().parents[1]
PAGE: Final = ROOT / "docs" / "architecture.md"
MARKS: Final = ("<!-- rooms -->", "<!-- /rooms -->")

Arrow = tuple[str, str]  # from the room that imports to the one imported, as "routing.search"


@dataclass(frozen=True, slots=True)
class Rooms:
    """Packages by layer, from the top down, and the imports between all rooms.

    A room is a sub-package, or a module that stands beside sub-packages; a package with at most one sub-package is one
    room with all its own modules. Seen from another package, modules beside sub-packages are the package.
    """

    layers: tuple[tuple[str, ...], ...]
    names: frozenset[str]
    arrows: frozenset[Arrow]

    def inside(self, package: str) -> tuple[str, ...]:
        """The rooms of one package by name."""
        return tuple(sorted(name for name in self.names if package_of(name) == package))


def package_of(room: str) -> str:
    """The top-level package of a room."""
    return room.partition(".")[0]


def read_rooms() -> Rooms:
    """The rooms as they are now; packages and layers are those of import-linter in pyproject.toml."""
    linter = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    packages = [str(name) for name in linter["root_packages"]]
    graph = grimp.build_graph(*packages, cache_dir=None)
    room_of: dict[str, str] = {}
    seen_outside: set[str | None] = set()
    for package in packages:
        sub_packages = {child for child in graph.find_children(package) if graph.find_children(child)}
        one_room = len(sub_packages) < 2
        seen_outside |= sub_packages
        for module in {package} | graph.find_descendants(package):
            room = ".".join(module.split(".")[:2])
            room_of[module] = package if one_room and room not in sub_packages else room
        if not one_room:
            del room_of[package]  # what its __init__.py holds is no room
    arrows = set()
    for importer, room in room_of.items():
        for imported in graph.find_modules_directly_imported_by(importer):
            target = room_of.get(imported)
            if package_of(imported) != package_of(room) and target not in seen_outside:
                target = package_of(imported)
            if target not in (None, room):
                arrows.add((room, str(target)))
    return Rooms(_layers(linter["contracts"], packages), frozenset(room_of.values()), frozenset(arrows))


def _layers(contracts: list[dict[str, Any]], packages: list[str]) -> tuple[tuple[str, ...], ...]:
    """The layers of the contract, with those packages on top that it does not name."""
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    named = [tuple(re.findall(r"\w+", layer)) for layer in layers]
    known = {package for layer in named for package in layer}
    return (*((package,) for package in packages if package not in known), *named)


def table_of(rooms: Rooms) -> str:
    """The rooms as a Markdown table: what each is, in the words of its docstring, and what it imports."""
    lines = ["| room | what | imports beside it | imports below |", "|---|---|---|---|"]
    for package in (package for layer in rooms.layers for package in layer):
        for room in rooms.inside(package):
            imported = sorted(b for a, b in rooms.arrows if a == room)
            beside = [b for b in imported if package_of(b) == package]
            below = [b for b in imported if package_of(b) != package]
            cells = (f"`{_path(room)}`", _what(room), _listed(beside), _listed(below))
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def arrows_of(page: str) -> frozenset[Arrow]:
    """The arrows of the table in a page."""
    arrows = set()
    for row in re.findall(r"^\| `.*$", table_in(page), re.MULTILINE):
        room, _, beside, below = (cell.strip() for cell in row.strip("|").split(" | "))
        source = _room(room.strip("`"))
        arrows |= {(source, _room(path)) for path in re.findall(r"`([^`]+)`", beside + below)}
    return frozenset(arrows)


def table_in(page: str) -> str:
    """What stands between the marks of a page."""
    return page.partition(MARKS[0])[2].partition(MARKS[1])[0].strip("\n")


def with_table(page: str, table: str) -> str:
    """The page with another table between its marks; raises ValueError where it has not one place for it."""
    if page.count(MARKS[0]) != 1 or page.count(MARKS[1]) != 1 or page.index(MARKS[0]) > page.index(MARKS[1]):
        raise ValueError(f"the page must have one place for the rooms: {MARKS[0]} and then {MARKS[1]}")
    before, _, rest = page.partition(MARKS[0])
    return f"{before}{MARKS[0]}\n{table}\n{MARKS[1]}{rest.partition(MARKS[1])[2]}"


def _path(room: str) -> str:
    path = room.replace(".", "/")
    return f"{path}.py" if (ROOT / f"{path}.py").exists() else f"{path}/"


def _room(path: str) -> str:
    return path.removesuffix(".py").strip("/").replace("/", ".")


def _listed(rooms: Iterable[str]) -> str:
    return ", ".join(f"`{_path(room)}`" for room in rooms) or "–"


def _what(room: str) -> str:
    """The first sentence of a room's docstring."""
    path = ROOT / _path(room)
    source = (path / "__init__.py" if path.is_dir() else path).read_text(encoding="utf-8")
    docstring = ast.get_docstring(ast.parse(source)) or "–"
    return docstring.split("\n", 1)[0].rstrip(".").replace("|", "\\|")
