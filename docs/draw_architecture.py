"""The picture and the table of architecture.md from the imports in the code: `python -m docs.draw_architecture`."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from itertools import combinations, pairwise, permutations
from typing import TYPE_CHECKING, Final

import networkx as nx

from docs.rooms import PAGE, ROOT, package_of, read_rooms, table_of, with_table

if TYPE_CHECKING:
    from docs.rooms import Arrow, Rooms

PICTURE: Final = ROOT / "docs" / "images" / "architecture.svg"
WIDTH: Final = 1280
MOST_COLUMNS: Final = 8  # side by side; packages of a layer that have more stand below each other
MARGIN: Final = 12
RAIL: Final = 34  # on the left, for the arrow that says how imports go
BOX: Final = (100, 40)
PITCH_Y: Final = 54
TITLE: Final = 34
BAND_GAP: Final = 22
GROUP_GAP: Final = 14
PORT_GAP: Final = 9
CHIP: Final = 14
INK: Final = "#1f2933"
LINE: Final = "#7b8794"
COLOURS: Final = ("#4b5563", "#a23b72", "#b26a00", "#b5432a", "#00755a", "#0b63a5", "#5b4bb7", "#6b705c")

Cell = tuple[int, int]  # column and row


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the rooms of one package stand, columns from left to right along the imports.

    cells: of rooms. ways: of each arrow, the cells that it passes, its ends included.
    """

    package: str
    columns: int
    rows: int
    cells: dict[str, Cell]
    ways: tuple[tuple[Cell, ...], ...]


def layout_of(package: str, rooms: Rooms) -> Layout:
    """Rooms of a package in columns, with the fewest arrows that tell which room can reach which."""
    graph: nx.DiGraph[str] = nx.DiGraph()
    graph.add_nodes_from(rooms.inside(package))
    graph.add_edges_from(sorted((a, b) for a, b in rooms.arrows if package_of(a) == package_of(b) == package))
    if not nx.is_directed_acyclic_graph(graph):
        raise ValueError(f"rooms of {package} import each other in a circle: {nx.find_cycle(graph)}")
    arrows = sorted(nx.transitive_reduction(graph).edges)
    column = _columns(graph, arrows)
    places: list[list[str]] = [[] for _ in range(max(column.values()) + 1)]
    for room in rooms.inside(package):
        places[column[room]].append(room)
    chains = []
    for number, (a, b) in enumerate(arrows):  # an arrow over several columns passes through a free row of each
        passed = [f"{number}:{k}" for k in range(column[a] + 1, column[b])]
        for k, name in enumerate(passed, column[a] + 1):
            places[k].append(name)
        chains.append((a, *passed, b))
    steps = sorted({step for chain in chains for step in pairwise(chain)})
    row = _rows(places, steps)
    at = {name: (k, row[name]) for k, names in enumerate(places) for name in names}
    return Layout(
        package,
        len(places),
        max(row.values()) + 1,
        {room: at[room] for room in rooms.inside(package)},
        tuple(tuple(at[name] for name in chain) for chain in chains),
    )


def _columns(graph: nx.DiGraph[str], arrows: list[Arrow]) -> dict[str, int]:
    """As far left as imports allow; what nothing imports stands right before what it imports."""
    column = {room: k for k, rooms in enumerate(nx.topological_generations(graph)) for room in rooms}
    for room in graph:
        after = [column[b] for a, b in arrows if a == room]
        if after and graph.in_degree(room) == 0:
            column[room] = min(after) - 1
    alone = sorted(room for room in graph if graph.degree(room) == 0)
    for room in alone:
        others = [column[name] for name in graph if name not in alone]
        column[room] = min(range(max(others, default=0) + 1), key=lambda k: (others.count(k), -k))
    return column


def _rows(places: list[list[str]], steps: list[Arrow]) -> dict[str, int]:
    """A row for each name of a column, so that arrows cross and bend as little as they can.

    Steps lead from one column to the next, so the best rows follow column by column from those of the one before.
    """
    rows = max(len(names) for names in places)
    best: list[tuple[float, dict[str, int]]] = [(0.0, {})]
    for k, names in enumerate(places):
        inner = [(a, b) for a, b in steps if b in names and k > 0]
        ended = []
        for option in permutations(range(rows), len(names)):
            here = dict(zip(names, option, strict=True))
            own = 0.01 * sum(option)
            ended.append(
                min(
                    ((cost + own + _untidiness(before | here, inner), before | here) for cost, before in best),
                    key=lambda found: found[0],
                )
            )
        best = ended
    return min(best, key=lambda found: found[0])[1]


def _untidiness(row: dict[str, int], steps: list[Arrow]) -> float:
    """How often steps between two columns cross, and how steep they are."""
    steep = sum((row[a] - row[b]) ** 2 for a, b in steps)
    crossings = sum((row[a] - row[c]) * (row[b] - row[d]) < 0 for (a, b), (c, d) in combinations(steps, 2))
    return 10.0 * crossings + steep


def _bands(rooms: Rooms) -> list[list[Layout]]:
    """Packages that stand side by side, from above: those of a layer, or each alone where columns are too many."""
    found: list[list[Layout]] = []
    for layer in rooms.layers:
        layouts = [layout_of(package, rooms) for package in layer]
        crowded = sum(layout.columns for layout in layouts) > MOST_COLUMNS
        found += [[layout] for layout in layouts] if crowded else [layouts]
    return found


def picture_of(rooms: Rooms) -> str:
    """The picture as SVG: the same text for the same rooms and arrows, whatever machine draws it."""
    packages = [package for layer in rooms.layers for package in layer]
    colour = {package: COLOURS[k % len(COLOURS)] for k, package in enumerate(packages)}
    parts: list[str] = []
    y = float(MARGIN)
    for layouts in _bands(rooms):
        height = TITLE + max(layout.rows for layout in layouts) * PITCH_Y
        free = WIDTH - RAIL - MARGIN - GROUP_GAP * (len(layouts) - 1)
        whole = sum(layout.columns for layout in layouts)
        x = float(RAIL)
        for layout in layouts:
            width = free * layout.columns / whole
            parts += _group(layout, rooms, colour, (x, y, width, height))
            x += width + GROUP_GAP
        y += height + BAND_GAP
    bottom = y - BAND_GAP
    rail = (
        f'<path d="M{RAIL / 2:g} {MARGIN}V{bottom - 4:g}" stroke="{LINE}" stroke-width="3" marker-end="url(#down)"/>'
        f'<text transform="translate({RAIL / 2 - 5:g} {(MARGIN + bottom) / 2:g}) rotate(-90)" text-anchor="middle" '
        f'font-size="12" fill="{INK}">imports go down only, and to the right within a package</text>'
    )
    return "\n".join((_head(bottom + MARGIN), rail, *parts, "</svg>", ""))


def _head(height: float) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:g}" width="{WIDTH}" height="{height:g}" '
        f'font-family="Verdana, DejaVu Sans, Arial, sans-serif" role="img">\n'
        "<title>Rooms of the code and their imports</title>\n"
        "<defs>"
        f'<marker id="arrow" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        f'<path d="M0 0.8L8 4L0 7.2Z" fill="{LINE}"/></marker>'
        f'<marker id="down" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="5" markerHeight="5" orient="auto">'
        f'<path d="M0 0L8 4L0 8Z" fill="{LINE}"/></marker>'
        "</defs>\n"
        f'<rect width="{WIDTH}" height="{height:g}" fill="#ffffff"/>'
    )


def _group(layout: Layout, rooms: Rooms, colour: dict[str, str], at: tuple[float, float, float, float]) -> list[str]:
    """One package: its frame, its name, its arrows and its rooms."""
    x, y, width, height = at
    own = colour[layout.package]
    pitch_x = (width - 2 * MARGIN - BOX[0]) / max(layout.columns - 1, 1)
    below = sorted({package_of(b) for a, b in rooms.arrows if package_of(a) == layout.package != package_of(b)})
    parts = [
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" rx="8" fill="{own}" '
        f'fill-opacity="0.08" stroke="{own}" stroke-width="1.5"/>',
        f'<text x="{x + MARGIN:.1f}" y="{y + 22:.1f}" font-size="16" font-weight="bold" fill="{own}">'
        f"{escape(layout.package)}/</text>",
    ]
    if below:
        parts += _legend(below, colour, x + width - MARGIN, y + 16)

    def centre(cell: Cell) -> tuple[float, float]:
        top = y + TITLE + (height - TITLE - layout.rows * PITCH_Y) / 2
        return x + MARGIN + BOX[0] / 2 + cell[0] * pitch_x, top + (cell[1] + 0.5) * PITCH_Y - 4

    ends: dict[Cell, list[Cell]] = {}
    for way in layout.ways:
        ends.setdefault(way[-1], []).append(way[-2])
    for way in layout.ways:
        beside = sorted(ends[way[-1]], key=lambda cell: cell[1])
        shift = (beside.index(way[-2]) - (len(beside) - 1) / 2) * PORT_GAP
        parts.append(_arrow([centre(cell) for cell in way], shift))
    for room, cell in layout.cells.items():
        chips = sorted({package_of(b) for a, b in rooms.arrows if a == room} - {layout.package})
        parts += _box(room, centre(cell), own, [(name, colour[name]) for name in chips])
    return parts


def _arrow(points: list[tuple[float, float]], shift: float) -> str:
    """A bow from the right of one box over the rows between to the left of another."""
    x, y = points[0][0] + BOX[0] / 2, points[0][1]
    path = f"M{x:.1f} {y:.1f}"
    for k, (to_x, to_y) in enumerate(points[1:], 1):
        last = k == len(points) - 1
        end_x, end_y = to_x - BOX[0] / 2, to_y + (shift if last else 0.0)
        bend = (end_x - x) / 2
        path += f"C{x + bend:.1f} {y:.1f} {end_x - bend:.1f} {end_y:.1f} {end_x:.1f} {end_y:.1f}"
        if not last:
            path += f"H{to_x + BOX[0] / 2:.1f}"
        x, y = to_x + BOX[0] / 2, end_y
    return f'<path d="{path}" fill="none" stroke="{LINE}" stroke-width="1.4" marker-end="url(#arrow)"/>'


def _box(room: str, at: tuple[float, float], own: str, chips: list[tuple[str, str]]) -> list[str]:
    """A room with its name and a chip for each package below that it imports; a module's frame is dashed."""
    x, y = at
    package, _, name = room.partition(".")
    module = (ROOT / f"{room.replace('.', '/')}.py").exists()
    dashes = ' stroke-dasharray="4 3"' if module else ""
    parts = [
        f'<rect x="{x - BOX[0] / 2:.1f}" y="{y - BOX[1] / 2:.1f}" width="{BOX[0]}" height="{BOX[1]}" rx="5" '
        f'fill="#ffffff" stroke="{own}" stroke-width="1.2"{dashes}/>',
        f'<text x="{x:.1f}" y="{y - 3 if chips else y + 5:.1f}" font-size="13" text-anchor="middle" fill="{INK}">'
        f"{escape(name or package)}</text>",
    ]
    start = x - (len(chips) * (CHIP + 3) - 3) / 2
    for k, (package, chip_colour) in enumerate(chips):
        parts.append(_chip(package, chip_colour, start + k * (CHIP + 3), y + 2))
    return parts


def _chip(package: str, colour: str, x: float, y: float) -> str:
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{CHIP}" height="{CHIP}" rx="3" fill="{colour}"/>'
        f'<text x="{x + CHIP / 2:.1f}" y="{y + CHIP - 3.5:.1f}" font-size="10.5" font-weight="bold" '
        f'text-anchor="middle" fill="#ffffff">{escape(package[0])}</text>'
    )


def _legend(packages: list[str], colour: dict[str, str], right: float, y: float) -> list[str]:
    """What the chips of a package stand for, from the right."""
    parts = []
    for package in reversed(packages):
        right -= 7.2 * len(package) + CHIP + 5
        parts.append(_chip(package, colour[package], right, y - CHIP / 2))
        parts.append(
            f'<text x="{right + CHIP + 4:.1f}" y="{y + 4:.1f}" font-size="12" fill="{INK}">{escape(package)}</text>'
        )
        right -= 12
    return parts


def draw() -> None:
    """Write the picture and the table anew."""
    rooms = read_rooms()
    PICTURE.write_text(picture_of(rooms), encoding="utf-8")
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8"), table_of(rooms)), encoding="utf-8")


if __name__ == "__main__":
    draw()
