"""The picture of scale.md from what `joulepath bench --scale --json` found: `python -m docs.draw_scale FILE`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

IMAGES: Final = Path(__file__).resolve().parent / "images"
DPI: Final = 120
SIZE_IN: Final = (12.0, 4.6)
FONT_PT: Final = 11
PHYSICS: Final = "#c0392b"
FIRST: Final = "#e0a39b"
SCALAR: Final = "#4a7ab5"
GUIDE: Final = "#9aa4ad"

Size = dict[str, Any]


def draw(report: dict[str, Any], out: Path) -> None:
    """One to all against the links, and what a route of 25 km and loading take; both axes logarithmic."""
    sizes: list[Size] = report["sizes"]
    links = np.array([size["made"]["links"] for size in sizes], np.float64)
    figure = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    to_all_axes, route_axes = figure.subplots(1, 2)
    _draw_to_all(to_all_axes, sizes, links, float(report["exponent"]))
    _draw_route(route_axes, sizes, links)
    figure.savefig(out)


def _draw_to_all(axes: Axes, sizes: list[Size], links: NDArray[np.float64], exponent: float) -> None:
    def to_all(name: str) -> Callable[[Size], dict[str, float]]:
        return lambda size: size["searched"]["to_all"][name]

    _line(axes, sizes, links, to_all("first_s"), FIRST, "with physics, first search")
    again_s = _line(axes, sizes, links, to_all("again_s"), PHYSICS, f"with physics, later ones: links^{exponent:.2f}")
    _line(axes, sizes, links, to_all("scalar_s"), SCALAR, "scalar Dijkstra by time")
    axes.plot(links, again_s[0] * links / links[0], color=GUIDE, linestyle=":", label="linear")
    _dress(axes, "One to all")


def _draw_route(axes: Axes, sizes: list[Size], links: NDArray[np.float64]) -> None:
    _line(axes, sizes, links, lambda size: size["load_s"], SCALAR, "loading, memory-mapped, by the clock")
    _line(
        axes,
        sizes,
        links,
        lambda size: size["searched"]["routes"]["whole_s"],
        PHYSICS,
        "route of 25 km, answer and all",
    )
    _line(axes, sizes, links, lambda size: size["searched"]["routes"]["again_s"], FIRST, "of which search")
    _dress(axes, "Loading, and a route of 25 km")


def _line(
    axes: Axes,
    sizes: list[Size],
    links: NDArray[np.float64],
    figure_of: Callable[[Size], dict[str, float]],
    colour: str,
    label: str,
) -> NDArray[np.float64]:
    """Medians with their quartiles as bars; the medians [s]."""
    spreads = [figure_of(size) for size in sizes]
    middle, low, high = (
        np.array([spread[name] for spread in spreads]) for name in ("median", "lower_quartile", "upper_quartile")
    )
    axes.errorbar(links, middle, yerr=(middle - low, high - middle), color=colour, marker="o", capsize=3, label=label)
    return middle


def _dress(axes: Axes, title: str) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("directed links", fontsize=FONT_PT)
    axes.set_ylabel("seconds", fontsize=FONT_PT)
    axes.set_title(title, fontsize=FONT_PT + 2)
    axes.grid(which="major", color="#e3e7ea")
    axes.legend(fontsize=FONT_PT - 1, frameon=False)


if __name__ == "__main__":
    draw(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")), IMAGES / "scale.png")
