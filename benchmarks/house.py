"""How the code is laid out, in figures: `python -m benchmarks.house [ROOT]` prints a Markdown table of a checkout."""

from __future__ import annotations

import argparse
import ast
import re
import sys
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import grimp
import networkx as nx

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from grimp import ImportGraph

MANY_ARGUMENTS: Final = 10
LONG_LINES: Final = 200
EXPLAINED: Final = f"""\
Most at one level: files of the fullest folder, without `__init__.py`. Up: imports against the layers of the import
contract, or against the greater number between two siblings that import each other. Circles: sets of sibling modules
and folders that import each other, at any level. Long functions: of more than {LONG_LINES} lines, docstring included.
Many arguments: functions that take {MANY_ARGUMENTS} or more, `self` aside."""


@dataclass(frozen=True, slots=True)
class Function:
    """A function: its name, how many lines it has and how many arguments it takes."""

    name: str
    lines: int
    arguments: int


@dataclass(frozen=True, slots=True)
class House:
    """The figures of one package; circles: by their members."""

    package: str
    modules: int
    fullest: tuple[str, int]
    imports: int
    up: int
    circles: tuple[tuple[str, ...], ...]
    functions: tuple[Function, ...]
    lines: int


def measure(root: Path) -> list[House]:
    """The figures of all packages that the import contract of a checkout names, and of its benchmarks and tests."""
    linter = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    packages = [str(name) for name in linter["root_packages"]]
    layers = next(contract["layers"] for contract in linter["contracts"] if contract["type"] == "layers")
    sys.path.insert(0, str(root))
    try:
        graph = grimp.build_graph(*packages, cache_dir=None)
    finally:
        sys.path.remove(str(root))
    houses = [_house(root, package, graph, _upward(graph, layers)) for package in packages]
    return houses + [
        _house(root, folder, None, Counter()) for folder in ("benchmarks", "tests") if (root / folder).is_dir()
    ]


def _house(root: Path, package: str, graph: ImportGraph | None, upward: Counter[str]) -> House:
    files = sorted((root / package).rglob("*.py"))
    folders = Counter(path.parent.relative_to(root).as_posix() for path in files if path.name != "__init__.py")
    siblings = [] if graph is None else list(_siblings(graph, package))
    own = set() if graph is None else {package} | graph.find_descendants(package)
    return House(
        package=package,
        modules=sum(folders.values()),
        fullest=max(folders.items(), key=lambda found: (found[1], found[0]), default=("", 0)),
        imports=0 if graph is None else sum(len(graph.find_modules_directly_imported_by(m) & own) for m in own),
        up=upward[package] + sum(map(_against, siblings)),
        circles=tuple(
            tuple(sorted(circle))
            for each in siblings
            for circle in nx.strongly_connected_components(each)
            if len(circle) > 1
        ),
        functions=tuple(found for path in files for found in _functions(path)),
        lines=sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files),
    )


def _upward(graph: ImportGraph, layers: Sequence[str]) -> Counter[str]:
    """Imports of each package from one in a layer above it, or beside it."""
    depth = {name: k for k, layer in enumerate(layers) for name in re.findall(r"\w+", layer)}
    found: Counter[str] = Counter()
    for importer in graph.modules:
        own = importer.partition(".")[0]
        for imported in graph.find_modules_directly_imported_by(importer):
            other = imported.partition(".")[0]
            if own != other and {own, other} <= set(depth) and depth[other] <= depth[own]:
                found[own] += 1
    return found


def _siblings(graph: ImportGraph, package: str) -> Iterator[nx.DiGraph[str]]:
    """For each folder of a package, what its modules and folders import of each other; weights: how many imports."""
    for folder in sorted({package} | graph.find_descendants(package)):
        children = graph.find_children(folder)
        if not children:
            continue
        home = {module: child for child in children for module in {child} | graph.find_descendants(child)}
        found: nx.DiGraph[str] = nx.DiGraph()
        for importer, child in home.items():
            for imported in graph.find_modules_directly_imported_by(importer):
                other = home.get(imported, child)
                if other != child:
                    count = found.get_edge_data(child, other, {"weight": 0})["weight"]
                    found.add_edge(child, other, weight=count + 1)
        yield found


def _against(siblings: nx.DiGraph[str]) -> int:
    """Imports between two siblings that import each other, the smaller number of either direction."""
    pairs = [(a, b) for a, b in siblings.edges if a < b and siblings.has_edge(b, a)]
    return sum(min(siblings[a][b]["weight"], siblings[b][a]["weight"]) for a, b in pairs)


def _functions(path: Path) -> Iterator[Function]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            given = node.args
            arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs]
            count = sum(each.arg not in ("self", "cls") for each in arguments)
            yield Function(f"{path.stem}.{node.name}", (node.end_lineno or node.lineno) - node.lineno + 1, count)


def table(houses: Iterable[House]) -> str:
    """The figures as a Markdown table, a package a row, and the circles below it."""
    names = (
        *("package", "modules", "most at one level", "imports", "up", "circles"),
        *("longest function, lines", "long functions", "many arguments", "lines"),
    )
    rows = [names, ("---", *("--:" for _ in names[1:]))]
    circles = []
    for house in houses:
        longest = max(house.functions, key=lambda function: function.lines, default=Function("–", 0, 0))
        rows.append(
            (
                house.package,
                str(house.modules),
                f"{house.fullest[1]} (`{house.fullest[0]}`)",
                str(house.imports or "–"),
                str(house.up),
                str(len(house.circles)),
                f"{longest.lines} (`{longest.name}`)",
                str(sum(function.lines > LONG_LINES for function in house.functions)),
                str(sum(function.arguments >= MANY_ARGUMENTS for function in house.functions)),
                str(house.lines),
            )
        )
        circles += [f"- circle: {', '.join(f'`{name}`' for name in circle)}" for circle in house.circles]
    text = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    return "\n\n".join(filter(None, (text, "\n".join(circles), EXPLAINED)))


def main(argv: Sequence[str]) -> int:
    """Print the table of a checkout; 0."""
    options = argparse.ArgumentParser(prog="python -m benchmarks.house", description=__doc__)
    options.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parents[1], help="a checkout")
    print(table(measure(options.parse_args(argv).root.resolve())))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
